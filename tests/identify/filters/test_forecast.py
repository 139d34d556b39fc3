from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import Free
from seatrial.data import DataError
from seatrial.environment import Uniform
from seatrial.identify import StudyError
from seatrial.identify.filters.filtering import Kalman
from seatrial.identify.filters.forecast import forecasts
from seatrial.identify.filters.measurement import Antenna, Heading
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

TUG = load("qiuxin5")
NOISE = {"x": 0.02, "y": 0.02, "psi": 0.002}


@pytest.fixture(scope="module")
def trial():
    """A tug in a current of 0.1 m/s that its log does not mention."""
    zigzag = Zigzag(n_P=7.0, delta=math.radians(20), psi=math.radians(20))
    run = simulate(TUG, zigzag, duration=60.0, dt=0.02, every=10, speed=0.9, environment=Uniform(U_C=0.1, gamma_C=1.0))
    kept = {k: v for k, v in run.channels.items() if k not in ("U_C", "gamma_C", "u", "v_m", "r")}
    return Sensors(NOISE).read(replace(run, channels=kept), np.random.default_rng(1))


def kalman(**more):
    return Kalman(
        measurement={"gnss": Antenna(0.02), "compass": Heading(0.002)},
        process={"u": 0.002, "v_m": 0.002, "r": 0.001}, current=True, **more,
    )  # fmt: skip


@pytest.mark.slow
def test_a_right_model_foresees_what_comes(trial):
    found = kalman().run(TUG, trial)
    far = forecasts(found, 10.0, every=5.0, begin=20.0)
    position, heading, end = far.rms()
    assert far.starts == pytest.approx(np.arange(20.0, 50.0, 5.0))
    assert position < 0.2
    assert heading < math.radians(3.0)
    assert end == pytest.approx(float(np.sqrt(np.mean(far.end**2))))


@pytest.mark.slow
def test_the_current_found_so_far_is_used(trial):
    """Without one, 0.1 m/s goes wrong by a metre in ten seconds."""
    blind = replace(kalman(), current=False).run(TUG, trial)
    with_current = forecasts(kalman().run(TUG, trial), 10.0, every=5.0, begin=20.0).rms()
    assert forecasts(blind, 10.0, every=5.0, begin=20.0).rms()[2] > 2.0 * with_current[2]


@pytest.mark.slow
def test_what_a_filter_learnt_later_is_not_used(trial):
    """The same start, whatever the log holds after the horizon."""
    walking = (Free("damping.N_r", -40.0, -1e3, 0.0, -40.0, 20.0),)
    found = kalman(parameters=walking).run(TUG, trial)
    spoilt = trial.having(x=np.where(trial.t > 35.0, trial["x"] + 1.0, trial["x"]))
    other = kalman(parameters=walking).run(TUG, spoilt)
    one, two = (forecasts(f, 10.0, every=4.0, begin=20.0) for f in (found, other))
    early = one.starts + 10.0 < 34.9
    assert early.sum() >= 1
    assert one.position[early] == pytest.approx(two.position[early], abs=1e-12)


@pytest.mark.slow
def test_refused(trial):
    found = kalman().run(TUG, trial)
    with pytest.raises(StudyError, match="smoothed run knows what comes"):
        forecasts(found.smoothed(), 10.0, every=5.0)
    with pytest.raises(DataError, match=r" 60 s; .* 100 s after 0 s"):
        forecasts(found, 100.0, every=5.0)
