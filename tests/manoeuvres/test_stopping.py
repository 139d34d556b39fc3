"""Stopping, acceleration and straight runs against closed forms: u' = b n|n| - c u|u|."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from simple_ships import SETTINGS, L, U, measured, surge

from seatrial.data import DataError, Trial
from seatrial.manoeuvres.acceleration import Acceleration
from seatrial.manoeuvres.stopping import CrashAstern, Stopping
from seatrial.manoeuvres.straight import Straight
from seatrial.simulate.run import simulate

B, C = 0.05, 0.002


def test_coasting_follows_the_logarithm():
    """u = u_0/(1 + c u_0 t): the way to u_0/5 is ln(5)/c, the time 4/(c u_0)."""
    policy = Stopping.ordered(SETTINGS)
    run = simulate(surge(), policy, speed=U, duration=600.0, dt=0.5)
    assert policy.complete(run)
    found = policy.indices(run, L)
    assert found["track_reach"].value == pytest.approx(math.log(5.0) / C, rel=1e-5)
    assert found["head_reach"].value == pytest.approx(math.log(5.0) / C, rel=1e-5)
    assert found["track_reach"].over_L == pytest.approx(math.log(5.0) / C / L, rel=1e-5)
    assert found["stopping_time"].value == pytest.approx(4.0 / (C * U), rel=1e-5)
    assert found["lateral_deviation"].value == found["heading_change"].value == 0.0


def test_crash_astern_under_constant_reverse_thrust():
    """u' = -b n^2 - c u^2: way ln(1 + c u_0^2/(b n^2))/(2c), time arctan(u_0 sqrt(c/b)/n)/(n sqrt(b c))."""
    policy = CrashAstern.ordered(SETTINGS)
    assert policy.n_astern == -1.0
    run = simulate(surge(), policy, speed=U, duration=300.0, dt=0.05)
    assert policy.complete(run)
    found = policy.indices(run, L)
    assert found["track_reach"].value == pytest.approx(math.log(1 + C * U * U / B) / (2 * C), rel=1e-3)
    # a hundredth of the speed, hence of the time, is left at what counts as stopped
    assert found["stopping_time"].value == pytest.approx(math.atan(U * math.sqrt(C / B)) / math.sqrt(B * C), rel=0.015)
    exact = replace(policy, end=0.0).indices(simulate(surge(), replace(policy, end=0.0), speed=U, duration=150.0), L)
    assert exact["stopping_time"].value == pytest.approx(math.atan(U * math.sqrt(C / B)) / math.sqrt(B * C), rel=1e-4)
    # the engine stops with the ship, which never makes way astern
    assert run["n_P_cmd"][-1] == 0.0
    assert 0.0 < run["u"][-1] <= 0.01 * U


def test_unfinished_stops_have_no_figures():
    for policy in (Stopping.ordered(SETTINGS), CrashAstern.ordered(SETTINGS)):
        run = simulate(surge(), policy, speed=U, duration=20.0, dt=0.5)
        assert not policy.complete(run)
        assert policy.indices(run, L) == {}


def test_measured_stop_with_an_approach_and_a_swing():
    """Half a minute of approach north, then a quarter circle of radius 100 m while the speed falls to zero."""
    t = np.arange(0.0, 200.0, 0.1)
    since = np.clip(t - 30.0, 0.0, None)
    slowing = math.pi * 50.0 / 100.0  # quarter circle over a mean of U/2: U T/2 = pi R/2
    T = math.pi * 100.0 / U
    way = np.where(since < T, U * since - 0.5 * U / T * since**2, 0.5 * U * T)
    angle = way / 100.0
    x = U * np.minimum(t, 30.0) + 100.0 * np.sin(angle)
    y = 100.0 * (1.0 - np.cos(angle))
    u = np.where(t < 30.0, U, np.clip(U * (1 - since / T), 0.0, None))
    trial = Trial("stop", t, {"x": x, "y": y, "psi": angle, "u": u, "n_P": np.where(t < 30.0, 1.0, -1.0)})
    found = replace(CrashAstern.ordered(SETTINGS), end=0.0).indices(trial, L)
    assert angle[-1] == pytest.approx(slowing)
    # without an order it counts from the last sample before the revolutions change: 0.1 s, 0.5 m earlier
    assert found["track_reach"].value == pytest.approx(50.0 * math.pi, rel=4e-3)
    assert found["head_reach"].value == pytest.approx(100.0, rel=6e-3)
    assert found["lateral_deviation"].value == pytest.approx(100.0, rel=3e-3)
    assert found["heading_change"].value == pytest.approx(0.5 * math.pi, rel=3e-3)
    assert found["stopping_time"].value == pytest.approx(T, rel=3e-3)


def test_a_stop_without_a_speed_log_is_refused():
    t = np.arange(10.0)
    with pytest.raises(DataError, match="no channel 'u'"):
        Stopping.ordered(SETTINGS).indices(Trial("s", t, {"x": t, "y": t, "psi": t}), L)


def test_acceleration_follows_the_hyperbolic_tangent():
    """From rest u = V tanh(c V t), x = ln cosh(c V t)/c, with V = n sqrt(b/c)."""
    policy = Acceleration.ordered(SETTINGS)
    assert Acceleration.from_rest
    run = simulate(surge(), policy, speed=0.0, duration=1600.0, dt=0.5)
    V = math.sqrt(B / C)
    assert run["u"] == pytest.approx(V * np.tanh(C * V * run.t), abs=1e-6)
    assert policy.complete(run)
    found = policy.indices(run, L)
    assert found["final_speed"].value == pytest.approx(V, rel=1e-4)
    assert found["time_to_90_percent"].value == pytest.approx(math.atanh(0.9) / (C * V), rel=1e-3)
    way = math.log(math.cosh(math.atanh(0.9))) / C
    assert found["distance_to_90_percent"].value == pytest.approx(way, rel=1e-3)
    assert not policy.complete(run.rows(slice(0, 400)))


def test_straight_run_measures_the_mile():
    policy = Straight.ordered(SETTINGS)
    run = simulate(surge(), policy, speed=U, duration=100.0, dt=0.5)
    assert policy.complete(run)
    found = policy.indices(run, L)
    assert found["mean_speed"].value == pytest.approx(U, rel=1e-9)  # b n^2 = c U^2
    assert found["distance"].over_L == pytest.approx(5.0, rel=1e-9)
    aside = run.having(y=0.1 * run["x"], psi=np.full(len(run), 0.0))
    assert policy.indices(aside, L)["lateral_deviation"].value == pytest.approx(50.0)


def test_measured_coasting_with_noise():
    policy = replace(Stopping.ordered(SETTINGS), end=0.5)
    run = measured(simulate(surge(), policy, speed=U, duration=300.0, dt=0.5), u=0.01)
    assert policy.indices(run, L)["track_reach"].value == pytest.approx(math.log(2.0) / C, rel=0.01)


def test_acceleration_of_a_drawn_run_counts_from_its_first_sample_and_means_its_last_twentieth():
    """A speed that rises evenly from 1 to 5 m/s in 100 s, then stays but for one reading; a course that veers."""
    t = 20.0 + np.arange(0.0, 200.0, 0.5)
    since = t - 20.0
    u = np.minimum(1.0 + 0.04 * since, 5.0)
    x = np.where(since < 100.0, since + 0.02 * since**2, 300.0 + 5.0 * (since - 100.0))
    u[-5] = 5.2  # one of the twenty
    trial = Trial("a", t, {"u": u, "x": 7.0 + x, "y": -3.0 - 0.01 * x, "psi": np.linspace(0.0, 0.1, t.size)})
    found = Acceleration(0.0, 1.0, fraction=0.8).indices(trial, L)
    assert found["final_speed"].value == pytest.approx(5.01, rel=1e-9)
    reached = (0.8 * 5.01 - 1.0) / 0.04
    assert found["time_to_80_percent"].value == pytest.approx(reached, rel=1e-9)
    way = (reached + 0.02 * reached**2) * math.hypot(1.0, 0.01)
    assert found["distance_to_80_percent"].value == pytest.approx(way, rel=1e-4)
    assert found["lateral_deviation"].value == pytest.approx(-0.01 * x[-1])
    assert found["lateral_deviation"].over_L == pytest.approx(-0.01 * x[-1] / L)
    assert found["heading_change"].value == pytest.approx(0.1)
    bare = Acceleration(0.0, 1.0).indices(Trial("a", t, {"u": u}), L)
    assert bare["distance_to_90_percent"].value == pytest.approx(
        ((0.9 * 5.01 - 1.0) / 0.04) + 0.02 * ((0.9 * 5.01 - 1.0) / 0.04) ** 2, rel=1e-4
    )
    assert set(Acceleration(0.0, 1.0).indices(Trial("a", t, {"u": u[::-1]}), L)) == {"final_speed"}


@pytest.mark.parametrize(("change", "settled"), [(1.8e-3, True), (2.2e-3, False)])
def test_a_speed_has_settled_by_what_it_changes_over_the_last_fifth(change, settled):
    u = np.concatenate([np.linspace(0.0, 4.99, 80), np.linspace(5.0 * (1.0 - change), 5.0, 20)])
    assert Acceleration(0.0, 1.0).complete(Trial("a", np.arange(100.0), {"u": u})) is settled


def test_acceleration_orders_its_revolutions_and_the_rudder_midships():
    policy = Acceleration(0.5, 2.0)
    assert policy.command(3.0, (0.0,) * 6, ()) == ((2.0, 0.0), ())
    assert (Acceleration.ordered(SETTINGS).n_P, Acceleration.ordered(SETTINGS).n_ahead) == (0.0, SETTINGS.n_P)
