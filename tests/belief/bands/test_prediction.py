"""Bands of trials and manoeuvres from a calibration that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_calibration import made

from seatrial.belief.bands.disturbance import Disturbance, Process
from seatrial.belief.bands.held import ALL, held, windows
from seatrial.belief.bands.prediction import fan, manoeuvre, uncertain
from seatrial.belief.power import Power
from seatrial.environment import Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES
from seatrial.simulate.replay import replay
from seatrial.simulate.run import approach
from virtual_logs import log, posterior, ship

FOUND = replace(made(), disturbance=Disturbance((Process("u", 2e-3, 5.0), Process("r", 1e-4, 20.0)), 0.02))


@pytest.mark.slow
def test_a_fan_is_about_its_prediction_and_begins_again_at_each_restart() -> None:
    trial = log(ship(), 1, np.random.default_rng(0))
    predicted = replay(ship(), trial, restart=20.0)
    made = fan(posterior(), FOUND, trial, predicted, 0.9, restart=20.0, draws=100)
    assert made.kind == "turning"
    assert made.notes == ()
    assert np.flatnonzero(made.since == 0.0).tolist() == [0, 40, 80]
    assert np.isfinite(made.half).all()
    for name, (low, high) in made.edges.items():
        assert 0.5 * (low + high) == pytest.approx(predicted[name])
    assert (made.half[39, :3] > 2.0 * made.half[4, :3]).all()
    assert made.half[44, :2] == pytest.approx(made.half[4, :2], rel=0.5)
    again = fan(posterior(), FOUND, trial, predicted, 0.9, restart=20.0, draws=100)
    assert again.half.tolist() == made.half.tolist()
    wider = fan(posterior(), FOUND, trial, predicted, 0.95, restart=20.0, draws=100)
    assert (wider.half > made.half).all()


@pytest.mark.slow
def test_a_prediction_beyond_the_horizons_says_where_its_bands_end() -> None:
    trial = log(ship(), 1, np.random.default_rng(0))
    made = fan(posterior(), FOUND, trial, replay(ship(), trial), 0.9, draws=60)
    assert np.isfinite(made.half[made.since <= 40.0]).all()
    assert np.isnan(made.half[made.since > 40.5]).all()
    remedy = "--restart 40, or seatrial calibrate MODEL --horizon 60"
    assert made.notes == (f"bands of 90 % hold up to 40 s from a start; none beyond ({remedy})",)


def test_coverage_counts_the_rows_at_the_horizons() -> None:
    trial = log(ship(), 1, np.random.default_rng(0))
    predicted = replay(ship(), trial, restart=20.0)
    made = fan(posterior(), FOUND, trial, predicted, 0.9, restart=20.0, draws=60)
    made = replace(made, half=100.0 * made.half)
    off = trial.having(y=trial["y"] + 1e3)  # one of the two components of position lies outside everywhere
    rows = held(windows(made, one, (4.0, 20.0)) for one in (trial, off))
    told = [(row.kind, row.horizon, row.windows, row.trials) for row in rows]
    assert told == [("turning", 4.0, 6, 2), ("turning", 20.0, 6, 2)]
    both = held([windows(made, trial, (4.0,)), replace(windows(made, off, (4.0,)), kind="zigzag")])
    assert [row.kind for row in both] == ["turning", "zigzag", ALL]
    assert both[0].inside["position"] - both[1].inside["position"] == pytest.approx(0.5, abs=0.01)
    assert both[2].inside["position"] == pytest.approx(0.5 * (both[0].inside["position"] + both[1].inside["position"]))
    assert both[0].inside["heading"] == both[1].inside["heading"] == both[2].inside["heading"]


def test_draws_of_a_calibrated_ship_are_as_unsure_as_the_fits_that_left_trials_out() -> None:
    """What residuals add to a sigma was taken off there (`parts.widened`), so it is taken off here."""
    plain = posterior()
    by = dict.fromkeys(plain.names, 2.0)
    wide = replace(plain, covariance=4.0 * plain.covariance, power=Power(3.0, 5, {}, 1.0, by))
    np.testing.assert_allclose(uncertain(wide, FOUND, 50, 1).draws, uncertain(plain, FOUND, 50, 1).draws, rtol=1e-9)


@pytest.mark.slow
def test_a_manoeuvre_has_draws_whose_spread_is_that_of_its_bands() -> None:
    U, n_P = approach(ship())
    policy = Turning(n_P, np.radians(20.0))
    made = manoeuvre(posterior(), FOUND, policy, 0.9, speed=U, duration=60.0, dt=0.2, weather=Uniform(), draws=400)
    assert made.stored[:6] == STATES
    assert made.drawn.shape == (400, len(made.t), len(made.stored))
    assert np.isnan(made.half[made.t > 40.0]).all()
    row = int(np.argmin(np.abs(made.t - 30.0)))
    inside = (np.abs(made.tracks[:, row] - made.fitted[row, :6]) <= made.half[row]).mean(axis=0)
    assert inside == pytest.approx(0.9, abs=0.06)
    alone = replay_of(policy, U)
    assert made.fitted[:, :6] == pytest.approx(alone, abs=1e-9)


def replay_of(policy: Turning, U: float) -> np.ndarray:
    """The same manoeuvre by the simulator."""
    from seatrial.simulate.run import simulate

    return simulate(ship(), policy, speed=U, duration=60.0, dt=0.2, every=2).stack(*STATES)[:151]
