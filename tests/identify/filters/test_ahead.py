"""Forecasts with bands after a short past: a ferry whose current and yaw moment are unknown and change slowly."""

from __future__ import annotations

import os
import runpy
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import Free, Parts
from seatrial.data import DataError, Trial
from seatrial.forces.azimuth import Azimuth
from seatrial.forces.damping import Polynomial
from seatrial.identify import Fit, Loss, Nuisance, Problem
from seatrial.identify.filters.ahead import CONSTANT_VELOCITY, MODEL, STAYING, Ahead, joined, looked_ahead
from seatrial.identify.filters.filtering import Kalman
from seatrial.identify.filters.measurement import Antenna, Heading
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.models.fossen import Inertia, Particulars
from seatrial.models.harbour import Harbour, Steady
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.replay import replay

PLACES = ((1.8, -0.8), (1.8, 0.8), (-1.8, 0.8), (-1.8, -0.8))
TRUTH = {"inertia.m_22": 3400.0, "inertia.m_33": 9000.0, "damping.N_r": -900.0, "thrusters.1.c_2": 1.4}
FREE = tuple(Free(path, 0.7 * value, prior=0.7 * value, sigma=abs(value)) for path, value in TRUTH.items())
FILTER = Kalman(
    measurement={"gnss": Antenna(0.01), "compass": Heading(0.003)}, current=True,
    process={"u": 0.004, "v_m": 0.004, "r": 0.002, "current": 0.004, "steady.N_0": 3.0},
    parameters=(Free("steady.N_0", 0.0, prior=0.0, sigma=50.0),),
)  # fmt: skip


def ferry(steady: float = 0.0) -> Ship:
    thrusters = Parts(("1", "2", "3", "4"), tuple(Azimuth(x=x, y=y, c_2=1.4) for x, y in PLACES))
    model = Harbour(
        body=Particulars(rho=1000.0, L_pp=5.0, B=2.8), inertia=Inertia(m_11=2400.0, m_22=3400.0, m_33=9000.0),
        damping=Polynomial(X_u=-250.0, Y_v=-300.0, N_r=-900.0), thrusters=thrusters, steady=Steady(N_0=steady),
    )  # fmt: skip
    return replace(load("milliampere"), name="ferry", model=model, actuators=type(load("milliampere").actuators)(),
                   speed=0.3, validity={}, entries={})  # fmt: skip


def sailed(seed: int, seconds: float = 60.0) -> Trial:
    """A minute of random orders in a current that turns and grows, read with noise; the log tells no current."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, seconds, 0.1)
    channels = {name: np.zeros_like(t) for name in ("x", "y", "psi", "u", "v_m", "r")}
    for k in range(1, 5):
        held = np.arange(t.size) // 50
        channels[f"n_{k}"] = rng.uniform(0.0, 8.0, held.max() + 1)[held]
        channels[f"alpha_{k}"] = rng.uniform(-3.0, 3.0, held.max() + 1)[held]
    channels["U_C"] = 0.1 + 0.03 * np.sin(t / 40.0 + seed)
    channels["gamma_C"] = seed + t / 120.0
    truth = replay(ferry(steady=60.0), Trial(f"m_{seed}", t, channels, meta={"held": list(channels)}))
    noise = {"x": 0.01, "y": 0.01, "psi": 0.003, "u": 0.02, "v_m": 0.02, "r": 0.005}
    read = {name: truth[name] + rng.normal(0.0, sd, t.size) for name, sd in noise.items()}
    kept = {name: values for name, values in channels.items() if name[0] in "na"}
    return Trial(f"m_{seed}", t, {**read, **kept}, meta={"held": list(kept)})


@cache
def fitted() -> Fit:
    loss = Loss({"x": 0.02, "y": 0.02, "psi": 0.006, "u": 0.04, "v_m": 0.04, "r": 0.01}, 0.0)
    more = Free("steady.N_0", 0.0, prior=0.0, sigma=100.0)
    problem = Problem(ferry(), tuple(sailed(k) for k in range(4)), (*FREE, more), loss, Nuisance(current=0.2))
    return Trajectory(window=15.0, every=5).fit(problem)


@cache
def forecasts() -> tuple[Ahead, ...]:
    bare = fitted().ship.having({"steady.N_0": 0.0})
    return looked_ahead(FILTER, bare, [sailed(k) for k in (11, 12)], (5.0, 10.0), warm=20.0, every=5.0)


@pytest.mark.slow
def test_the_fit_finds_the_ferry_though_the_current_changes() -> None:
    for path, value, sigma in zip((f.path for f in fitted().free), fitted().values, fitted().sigma, strict=True):
        known = {**TRUTH, "steady.N_0": 60.0}[path]
        assert value == pytest.approx(known, abs=max(4.0 * sigma, 0.04 * abs(known))), path


@pytest.mark.slow
def test_forecasts_beat_those_who_know_no_ship() -> None:
    for ahead in forecasts():
        assert ahead.rms()[0] < 0.3 * min(ahead.rms(STAYING)[0], ahead.rms(CONSTANT_VELOCITY)[0])
        assert ahead.rms()[1] < 0.3 * min(ahead.rms(STAYING)[1], ahead.rms(CONSTANT_VELOCITY)[1])
        assert max(ahead.ratio()) < 0.3


@pytest.mark.slow
def test_bands_hold_what_they_state_and_narrow_ones_do_not() -> None:
    every = joined(forecasts()[1:])
    assert min(every.covered(0.9)) > 0.7
    assert max(every.covered(0.9, widen=0.02)) < 0.5


@pytest.mark.slow
def test_a_ship_without_its_thrusters_forecasts_worse() -> None:
    weak = fitted().ship.having({f"thrusters.{k}.c_2": 0.0 for k in range(1, 5)})
    (worse,) = looked_ahead(FILTER, weak, [sailed(11)], (10.0,), warm=20.0, every=10.0)
    assert worse.rms()[0] > 3.0 * forecasts()[1].rms()[0]


@pytest.mark.slow
def test_readings_after_the_start_change_no_forecast() -> None:
    log = sailed(11)
    (plain,) = looked_ahead(FILTER, fitted().ship, [log], (10.0,), warm=20.0, every=100.0)
    late = np.where(log.t > 20.05, 5.0, 0.0)
    (moved,) = looked_ahead(FILTER, fitted().ship, [log.having(x=log["x"] + late)], (10.0,), warm=20.0, every=100.0)
    assert plain.north - moved.north == pytest.approx(np.array([5.0]), abs=1e-9)
    assert moved.sigma == pytest.approx(plain.sigma)


@pytest.mark.slow
def test_a_trial_that_is_too_short_is_refused() -> None:
    with pytest.raises(DataError, match="leaves room for 20 s"):
        looked_ahead(FILTER, ferry(), [sailed(11, 25.0)], (10.0,), warm=20.0, every=5.0)


@pytest.mark.long
def test_the_real_ferry_is_forecast_better_than_by_staying_put_and_constant_velocity() -> None:
    home = Path(__file__).parents[3]
    root = Path(os.environ.get("SEATRIAL_DATA", home.parent / "shared" / "data")) / "milliampere_2025"
    if not root.is_dir():
        pytest.skip(f"{root} is not here: set SEATRIAL_DATA to the folder of the public data sets")
    script: Any = runpy.run_path(str(home / "studies" / "reports" / "milliampere_real.py"))
    found = script["folds"](*script["looks"](script["st"].read_study(script["STUDY"])))
    five, ten, twenty = (joined([one.ahead[i] for one in found]) for i in range(3))
    bare = joined([one.bare[2] for one in found])
    for ahead in (five, ten):
        for name in script["TRIALS"]:
            assert max(ahead.of(name).ratio()) < 0.7, (name, ahead.horizon)
    assert max(twenty.of("nlp1").ratio()) < 1.0
    assert twenty.of("qp1").ratio()[1] < 1.0, "in the berth the position after 20 s is that of who stays put"
    assert twenty.of("qp1").ratio()[1] < 0.9 * bare.of("qp1").ratio()[1], "part of the way has the better heading there"
    narrow = set[tuple[str, float, str]]()
    for ahead in (five, ten, twenty):
        for name in script["TRIALS"]:
            shares = zip(("position", "heading"), ahead.of(name).covered(0.9), strict=True)
            narrow |= {(name, ahead.horizon, what) for what, share in shares if share <= 0.7}
        assert ahead.rms(MODEL)[0] < ahead.rms(CONSTANT_VELOCITY)[0]
    assert narrow <= {("qp1", 20.0, "position")}, "in the berth alone the bands are narrow (docs/published.md: 68 %)"
