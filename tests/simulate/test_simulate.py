"""`simulate`, `replay` and `campaign` as a user meets them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from seatrial.core.parameters import update, values
from seatrial.data import DataError, Trial
from seatrial.engine import SimulationError
from seatrial.environment import Uniform
from seatrial.manoeuvres.thrust_steps import ThrustSteps
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import STATES, Sampled
from seatrial.ships import ShipError
from seatrial.ships.files import library, load
from seatrial.simulate.approach import bracketed_root, step_doubt
from seatrial.simulate.replay import replay
from seatrial.simulate.run import approach, campaign, fastest, simulate, surge_balance, time_step


@pytest.fixture
def l7() -> Any:
    return load("kvlcc2_l7")


@pytest.fixture
def turn(l7: Any) -> Trial:
    return simulate(l7, Turning(n_P=11.85, delta=0.4), duration=60.0, dt=0.1)


@pytest.mark.parametrize("name", library())
def test_approach_is_a_balance_and_the_step_suits_the_ship(name: str) -> None:
    ship = load(name)
    U, n_P = approach(ship)
    assert ship.speed == U
    if ship.n_P is not None and "not a steady speed" in ship.entries["approach.speed"].source:
        return  # the published runs begin there
    assert abs(surge_balance(ship, U, n_P)) < 1e-3 * U * U / ship.L_pp
    if n_P > 0:
        assert approach(ship, n_P=n_P)[0] == pytest.approx(U, rel=1e-2)
    if isinstance(ship.model, Sampled):
        assert time_step(ship) == ship.model.dt
        return
    assert time_step(ship) * 250 * ship.speed / ship.L_pp <= 1.0
    assert 0.4 <= time_step(ship) / min(ship.L_pp / (250 * ship.speed), 0.5 / fastest(ship)) <= 1.0
    assert approach(ship, 1.0, 2.0) == (1.0, 2.0)


def test_a_step_that_is_too_long_is_doubted() -> None:
    ship = load("kvlcc2")
    assert step_doubt(ship, time_step(ship)) is None
    assert step_doubt(ship, 1.0) is None
    assert "inaccurate above some 4 s; take 2 s or less" in str(step_doubt(ship, 5.0))
    assert "unstable above some 40 s" in str(step_doubt(ship, 60.0))
    assert step_doubt(load("kvlcc2_l7_arx"), 60.0) is None  # runs at its own step and no other


@pytest.mark.parametrize(
    ("f", "low", "high"),
    [(lambda x: x * x * x - 2.0, 0.0, 50.0), (lambda x: 1.0 - 1e-3 * x * abs(x), 1e-3, 2000.0),
     (lambda x: math.tanh(40.0 * (x - 0.3)), -1.0, 90.0), (lambda x: math.exp(x) - 1e6, 0.0, 300.0),
     (lambda x: x - 7.0, 7.0, 9.0)],
)  # fmt: skip
def test_a_root_between_two_signs_is_that_of_scipy(f: Any, low: float, high: float) -> None:
    expected: Any = brentq(f, low, high, xtol=1e-14, rtol=1e-14)
    asked: list[float] = []
    found = bracketed_root(lambda x: asked.append(x) or f(x), low, high)
    assert found == pytest.approx(expected, rel=1e-12)
    assert len(asked) < 60


def test_approach_without_a_balance_says_so(l7: Any) -> None:
    with pytest.raises(ShipError, match="kvlcc2_l7: no steady run"):
        approach(l7, n_P=1e4)


@pytest.mark.slow
def test_a_current_only_carries_the_ship_along(l7: Any) -> None:
    """To the error of RK4, which does not know the two frames are one: a fine step brings it below 1e-9."""
    policy, current = Turning(n_P=11.85, delta=0.4), Uniform(U_C=0.1, gamma_C=0.0)
    still = simulate(l7, policy, speed=1.0, duration=40.0, dt=0.01)
    moved = simulate(l7, policy, speed=1.0, duration=40.0, dt=0.01, environment=current)
    assert moved["x"] - 0.1 * moved.t == pytest.approx(still["x"], abs=1e-8)
    assert moved["y"] == pytest.approx(still["y"], abs=1e-8)
    assert moved["r"] == pytest.approx(still["r"], abs=1e-9)


@pytest.mark.slow
def test_port_mirrors_starboard_where_the_ship_is_symmetric(l7: Any) -> None:
    model = update(l7.model, {"rudder.gamma_Rn": l7.model.rudder.gamma_Rp, "propeller.C_2n": l7.model.propeller.C_2p})
    ship = replace(l7, model=model)
    a, b = (simulate(ship, Turning(n_P=11.85, delta=s * 0.6), duration=100.0) for s in (1, -1))
    for name, s in zip(STATES, (1, -1, -1, 1, -1, -1), strict=True):
        assert b[name] == pytest.approx(s * a[name], abs=1e-11)


def test_replay_reproduces_the_run(l7: Any) -> None:
    """The mean of the recorded angles acts over a step, as it did in the run."""
    trial = simulate(l7, Zigzag(n_P=11.85, delta=0.17, psi=0.17), duration=80.0, dt=0.1)
    again = replay(l7, trial)
    for name in STATES:
        assert np.abs(again[name] - trial[name]).max() <= 1e-9


def test_replay_of_a_held_rudder_is_exact_and_takes_gaps_and_uneven_time(l7: Any, turn: Trial) -> None:
    steady = turn.rows(slice(50, None))
    again = replay(l7, steady)
    for name in STATES:
        assert np.abs(again[name] - steady[name]).max() <= 1e-9
    gappy = {n: c.copy() for n, c in steady.channels.items()}
    gappy["u"][:3] = gappy["delta"][20:40] = gappy["psi"][-2:] = gappy["x"][100:150] = np.nan
    found = replay(l7, replace(steady, channels=gappy))
    assert found.t[[0, -1]] == pytest.approx(steady.t[[3, -3]])
    assert found["x"] == pytest.approx(steady["x"][3:-2], abs=1e-9)
    keep = np.ones(len(steady), dtype=bool)
    keep[[7, 30, 31, 200]] = False
    uneven = replay(l7, steady.rows(keep), restart=10.0)
    assert uneven["y"] == pytest.approx(steady["y"][keep], abs=1e-7)


def test_replay_without_controls_or_rows_is_refused(l7: Any, turn: Trial) -> None:
    with pytest.raises(DataError, match="delta"):
        replay(l7, replace(turn, channels={k: v for k, v in turn.channels.items() if k != "delta"}))
    with pytest.raises(DataError, match="complete rows"):
        replay(l7, turn.rows(slice(0, 1)))


@pytest.mark.slow
def test_a_campaign_is_one_run_per_lane(l7: Any) -> None:
    angles = np.radians([5.0, 10.0, 20.0])
    policy = Zigzag(n_P=11.85, delta=0.1, psi=0.1)
    together = campaign(l7, policy, {"policy.delta": angles, "policy.psi": angles}, speed=1.179, duration=60.0, dt=0.1)
    for lane, a in enumerate(angles.tolist()):
        alone = simulate(l7, replace(policy, delta=a, psi=a), speed=1.179, duration=60.0, dt=0.1)
        for k, name in enumerate(STATES):
            assert together.values[lane, :, k] == pytest.approx(alone[name], abs=1e-9)


def test_a_campaign_may_vary_every_parameter_of_the_rudder(l7: Any) -> None:
    model = values(l7.model)
    vary = {f"ship.{path}": np.full(2, model[path]) for path in model if path.startswith("rudder.")}
    lanes = campaign(l7, Turning(n_P=11.85, delta=0.1), vary, speed=1.179, duration=5.0, dt=0.1)
    alone = simulate(l7, Turning(n_P=11.85, delta=0.1), speed=1.179, duration=5.0, dt=0.1)
    assert lanes.values[1, :, 3] == pytest.approx(alone["u"], rel=1e-12)


def test_leaving_the_validity_names_time_and_state(l7: Any) -> None:
    narrow = replace(l7, validity={"r": (-0.01, 0.01)})
    with pytest.raises(SimulationError, match=r"kvlcc2_l7: r = .* at t = .* s is outside \[-0.01, 0.01\]"):
        simulate(narrow, Turning(n_P=11.85, delta=0.6), duration=60.0)


def test_a_current_takes_nobody_out_of_the_validity() -> None:
    """It speaks of the velocity through the water, which is the same wherever the water goes."""
    ship = replace(load("kcs"), validity={"u": (0.0, 13.0), "v_m": (-4.0, 4.0)})
    policy = Turning(n_P=ship.n_P, delta=0.6)
    streams = (Uniform(U_C=U, gamma_C=0.5) for U in (0.0, 2.0, 5.0))
    still, *moved = (simulate(ship, policy, duration=200.0, every=4, environment=stream) for stream in streams)
    assert max(abs(moved[1]["v_m"])) > 4.0
    for one, U in zip(moved, (2.0, 5.0), strict=True):
        assert one["x"] - U * np.cos(0.5) * one.t == pytest.approx(still["x"], abs=0.05)
    slow = replace(ship, validity={"u": (13.0, 20.0)})
    with pytest.raises(SimulationError, match=r"kcs: u = 12.35 through the water at t = 0 s is outside \[13, 20\]"):
        simulate(slow, policy, duration=20.0, environment=Uniform(U_C=5.0))


@pytest.mark.slow
def test_between_rows_the_log_tells_the_mean_of_what_acted() -> None:
    """Orders that change between rows, directions across the cut at 180 deg, and gusts."""
    ship = load("milliampere")
    policy = ThrustSteps(X=200.0, Y=200.0, N=200.0, K_p=600.0, K_d=1500.0, x_first=1.8, x_second=-1.8)
    steps = 801
    gusty = np.zeros((steps, 8))
    gusty[:, 0] = np.random.default_rng(0).normal(-5.0, 1.0, steps)
    runs = [simulate(ship, policy, speed=0.0, duration=40.0, dt=0.05, every=every, environment=gusty)
            for every in (1, 4)]  # fmt: skip
    fine, coarse = runs
    assert set(coarse.meta["held"]) == set(ship.model.controls)
    np.testing.assert_array_equal(coarse.stack(*STATES), fine.stack(*STATES)[::4])
    blocks = [slice(4 * k, 4 * k + 4) for k in range(len(coarse))]
    # A push astern that goes from 179 to -179 deg points astern on the mean.
    for name in ("alpha_bow", "alpha_stern"):
        mean = [first + np.mean(np.angle(np.exp(1j * (fine[name][b] - first))))
                for b, first in zip(blocks, fine[name][::4], strict=True)]  # fmt: skip
        np.testing.assert_allclose(coarse[name], mean, atol=1e-12)
    np.testing.assert_allclose(coarse["f_bow"], [fine["f_bow"][b].mean() for b in blocks], rtol=1e-12)
    np.testing.assert_array_equal(coarse["f_bow_cmd"], fine["f_bow_cmd"][::4])
    wind = [[(fine["U_T"] * np.cos(fine["gamma_T"]))[b].mean()] for b in blocks]
    np.testing.assert_allclose((coarse["U_T"] * np.cos(coarse["gamma_T"]))[:, None], wind, rtol=1e-12)


def test_a_run_too_long_to_keep_every_step_claims_no_held_controls(monkeypatch: pytest.MonkeyPatch) -> None:
    ship, policy = load("milliampere"), ThrustSteps(X=200.0)
    monkeypatch.setattr("seatrial.simulate.run._ROWS", 300)
    run = simulate(ship, policy, speed=0.0, duration=40.0, dt=0.05, every=4)
    assert "held" not in run.meta
    assert len(run) == 201
