"""Initial turning of a Nomoto ship: psi = K delta (t - T (1 - exp(-t/T)))."""

from __future__ import annotations

import math

import pytest
from scipy.optimize import brentq
from simple_ships import SETTINGS, L, U, measured, norrbin

from seatrial.manoeuvres.initial_turning import InitialTurning
from seatrial.simulate.run import simulate

TEN = math.radians(10.0)
K, T = 0.05, 40.0


def heading(t: float) -> float:
    return K * TEN * (t - T * (1.0 - math.exp(-t / T)))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_against_the_closed_form(side):
    policy = InitialTurning(1.0, TEN, TEN, side)
    run = simulate(norrbin(K, T), policy, speed=U, duration=100.0)
    assert policy.complete(run)
    found = policy.indices(run, L)
    exact = brentq(lambda t: heading(t) - TEN, 1.0, 100.0)
    assert found["initial_turning_time"].value == pytest.approx(exact, rel=1e-5)
    assert found["initial_turning_distance"].value == pytest.approx(U * exact, rel=1e-5)
    assert found["initial_turning_distance"].over_L == pytest.approx(U * exact / L, rel=1e-5)
    assert found["turning_quality"].value == pytest.approx(heading(L / U) / TEN, rel=1e-4)
    assert found["transfer"].value > 0
    assert found["advance"].value < U * exact


def test_usual_set_points_and_a_run_that_ends_before():
    policy = InitialTurning.ordered(SETTINGS)
    assert (policy.delta, policy.psi, policy.side) == (TEN, TEN, 1.0)
    run = simulate(norrbin(K, T), policy, speed=U, duration=25.0)
    assert not policy.complete(run)
    assert set(policy.indices(run, L)) == {"turning_quality"}


def test_measured_run_without_orders():
    policy = InitialTurning.ordered(SETTINGS)
    run = simulate(norrbin(K, T), policy, speed=U, duration=100.0)
    found = policy.indices(measured(run, psi=1e-3, delta=1e-3), L)
    assert found["initial_turning_time"].value == pytest.approx(brentq(lambda t: heading(t) - TEN, 1, 100), rel=0.02)


def test_gaps_in_the_positions_are_bridged():
    policy = InitialTurning.ordered(SETTINGS)
    run = simulate(norrbin(K, T), policy, speed=U, duration=100.0)
    x = run["x"].copy()
    x[100:160] = math.nan
    whole, gappy = (policy.indices(r, L)["initial_turning_distance"].value for r in (run, run.having(x=x)))
    assert gappy == pytest.approx(whole, rel=1e-4)
