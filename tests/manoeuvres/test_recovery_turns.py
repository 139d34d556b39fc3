"""Williamson, Scharnow and the single turn bring a ship back towards where it came from."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from simple_ships import SETTINGS, L, U, norrbin

from seatrial.manoeuvres import Settings
from seatrial.manoeuvres.scharnow import Scharnow, SingleTurn
from seatrial.manoeuvres.williamson import Williamson
from seatrial.ships.files import load
from seatrial.simulate.run import approach, campaign, simulate

DEGREE = math.radians(1.0)
NIMBLE = norrbin(K=0.05, T=10.0)  # T' = 0.5
HARD = replace(SETTINGS, rudder=30.0 * DEGREE)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("kind", "goal"), [(Williamson, -math.pi), (Scharnow, math.pi)])
def test_turn_back_of_a_nimble_ship(kind, goal, side):
    policy = kind.ordered(replace(HARD, side=side))
    run = simulate(NIMBLE, policy, speed=U, duration=40 * L / U)
    assert policy.complete(run)
    assert run["psi"][-1] == pytest.approx(side * goal, abs=0.2 * DEGREE)
    found = policy.indices(run, L)
    assert 0 < found["time_to_reciprocal"].value < 30 * L / U
    assert not policy.complete(run.rows(slice(0, 300)))
    # hard over, hard over against it, midships, steered
    order = side * run["delta_cmd"] / policy.delta
    first = int(np.argmax(order < 0.5))
    assert side * run["psi"][first] == pytest.approx(policy.swing, abs=0.2 * DEGREE)
    against = np.flatnonzero(order <= -1 + 1e-9)
    assert side * run["psi"][against[-1] + 1] == pytest.approx(goal + policy.short, abs=0.3 * DEGREE)


@pytest.mark.slow
def test_mirrored():
    a, b = (simulate(NIMBLE, Williamson.ordered(replace(HARD, side=s)), speed=U, duration=30 * L / U) for s in (1, -1))
    assert b["y"] == pytest.approx(-a["y"], abs=1e-9)


@pytest.mark.slow
def test_williamson_of_a_ship_without_lag_in_closed_form():
    """Two arcs of one radius R, the second centred at 2 R sin(60) ahead and R - 2 R cos(60) abeam."""
    K, delta = 0.05, 30.0 * DEGREE
    R = U / (K * delta)
    policy = replace(Williamson.ordered(HARD), short=0.0)
    run = simulate(norrbin(K=K, T=0.5), policy, speed=U, duration=40 * L / U, dt=0.02)
    found = policy.indices(run, L)
    transfer = R - 2 * R * math.cos(policy.swing) - R
    assert found["lateral_offset"].value == pytest.approx(transfer, abs=0.06 * R)
    assert found["greatest_advance"].value == pytest.approx(2 * R * math.sin(policy.swing) + R, rel=0.03)


def test_single_turn_stops_the_engine_and_comes_near():
    policy = SingleTurn.ordered(HARD)
    run = simulate(NIMBLE, policy, speed=U, duration=30 * L / U)
    over = int(np.argmax(run["psi"] >= policy.swing))
    assert run["n_P_cmd"][over - 1] == 1.0
    assert (run["n_P_cmd"][over:] == 0).all()
    assert (run["delta_cmd"][over:] == 0).all()
    assert policy.complete(run)
    found = policy.indices(run, L)
    assert found["turning_time"].value == pytest.approx(run.t[over], abs=0.2)
    assert found["miss_distance"].value < math.hypot(found["lateral_offset"].value, found["along_track"].value)


@pytest.mark.parametrize("side", [pytest.param(1.0, marks=pytest.mark.slow), -1.0])
def test_kvlcc2_ends_on_the_reciprocal_course_near_the_track(side):
    ship = load("kvlcc2")
    speed, n_P = approach(ship)
    policy = Williamson.ordered(Settings(n_P, speed, ship.L_pp, float(ship.actuators.rudder.high), side=side))
    run = simulate(ship, policy, duration=45 * ship.L_pp / speed)
    assert policy.complete(run)
    assert abs(run["psi"][-1] + side * math.pi) < DEGREE
    found = policy.indices(run, ship.L_pp)
    # its tactical diameter is 3.05 L
    assert abs(found["lateral_offset"].over_L) < 1.5
    assert found["miss_distance"].over_L < 1.5
    assert found["greatest_transfer"].over_L > 2.0


def test_a_campaign_of_turns_is_one_kernel():
    policy = Williamson.ordered(HARD)
    swing = np.radians([50.0, 60.0, 70.0])
    together = campaign(NIMBLE, policy, {"policy.swing": swing}, speed=U, duration=500.0, dt=0.2)
    offsets = []
    for lane, a in enumerate(swing.tolist()):
        alone = simulate(NIMBLE, replace(policy, swing=a), speed=U, duration=500.0, dt=0.2)
        assert together.values[lane, :, 1] == pytest.approx(alone["y"], abs=1e-9)
        offsets.append(policy.indices(alone, L)["lateral_offset"].value)
    assert offsets == sorted(offsets) or offsets == sorted(offsets, reverse=True)
