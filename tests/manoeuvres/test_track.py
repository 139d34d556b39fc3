"""Line of sight: the rate and the offset that theory gives, and what the integral does about the latter."""

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.actuators import Actuators
from seatrial.core.parameters import ParameterError, update, values
from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.manoeuvres import Settings
from seatrial.manoeuvres.autopilot import gains
from seatrial.manoeuvres.track import TrackFollowing, legs, los_heading, waypoints
from seatrial.ships.files import load
from seatrial.simulate.run import campaign, simulate

U, L = 7.7175, 160.93
AHEAD = 800.0


@pytest.fixture(scope="module")
def ship():
    """The mariner without limits of its steering gear."""
    return replace(load("mariner_nomoto"), actuators=Actuators())


def north(ship, sigma=0.0, omega=0.08):
    K_p, K_d, _ = gains(ship.model.K, ship.model.T, omega, 1.0)
    return TrackFollowing(0.0, K_p, K_d, AHEAD, 300.0, sigma, path=waypoints([(0.0, 0.0), (1e6, 0.0)]))


def decay(run, first, last):
    part = (run.t > first) & (run.t < last)
    return -np.polyfit(run.t[part], np.log(run["y"][part]), 1)[0]


def test_calm_the_error_dies_out_at_the_rate_of_the_linear_loop(ship):
    """Near the track T s^3 + (1 + K K_d) s^2 + K K_p s + K K_p U/Delta = 0, whose slow root nears U/Delta."""
    policy = north(ship)
    run = simulate(ship, policy, duration=900.0, dt=0.5, start=(0.0, 20.0, 0.0, U, 0.0, 0.0))
    K, T = ship.model.K, ship.model.T
    roots = np.roots([T, 1 + K * policy.K_d, K * policy.K_p, K * policy.K_p * U / AHEAD])
    slow = -max(roots.real)
    assert decay(run, 300.0, 900.0) == pytest.approx(slow, rel=0.01)
    quick = north(ship, omega=0.5)
    run = simulate(ship, quick, duration=900.0, dt=0.1, start=(0.0, 20.0, 0.0, U, 0.0, 0.0))
    assert decay(run, 300.0, 900.0) == pytest.approx(U / AHEAD, rel=0.05)


def test_far_away_the_ship_steers_as_the_look_ahead_says(ship):
    policy = north(ship, omega=0.3)
    run = simulate(ship, policy, duration=100.0, dt=0.1, start=(0.0, 5000.0, 0.0, U, 0.0, 0.0))
    aimed = -math.atan(run["y"][-1] / AHEAD)
    assert run["psi"][-1] == pytest.approx(aimed, abs=math.radians(1.0))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_current_across_leaves_the_known_offset(ship, side):
    V = 1.5
    across = Uniform(U_C=V, gamma_C=side * math.pi / 2)
    run = simulate(ship, north(ship), duration=3000.0, dt=0.5, environment=across, start=(0, 0, 0, U, side * V, 0))
    offset = AHEAD * math.tan(math.asin(V / U))  # the heading that holds the track is the crab angle
    assert run["y"][-1] == pytest.approx(side * offset, rel=1e-3)
    run = simulate(
        ship, north(ship, sigma=3.0), duration=6000.0, dt=0.5, environment=across, start=(0, 0, 0, U, side * V, 0)
    )
    assert run["y"][-1] == pytest.approx(0.0, abs=0.5)
    assert run["psi"][-1] == pytest.approx(-side * math.asin(V / U), abs=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("name", ["mariner_nomoto", "kvlcc2_l7", pytest.param("esso_osaka_3m", marks=pytest.mark.slow)])
def test_the_default_path_is_followed_round_its_corner(name, side):
    vessel = load(name)
    settings = Settings(
        {"mariner_nomoto": 0.0, "kvlcc2_l7": 11.85, "esso_osaka_3m": 10.0}[name], vessel.speed, vessel.L_pp,
        float(vessel.actuators.rudder.high), side=side,
    )  # fmt: skip
    policy = TrackFollowing.ordered(settings)
    run = simulate(vessel, policy, duration=60.0 * vessel.L_pp / vessel.speed)
    assert policy.complete(run)
    found = policy.indices(run, vessel.L_pp)
    assert found["cross_track_max"].over_L < 1.5
    assert abs(found["cross_track_end"].over_L) < 0.25
    assert 0 <= found["corner_overshoot"].over_L <= found["cross_track_max"].over_L + 1e-9
    assert 35.0 < found["time"].value * vessel.speed / vessel.L_pp < 60.0
    assert run["y"][-1] * side > 15 * vessel.L_pp


def test_a_short_run_is_not_complete_and_has_no_time(ship):
    policy = TrackFollowing.ordered(Settings(0.0, U, L, 0.6))
    run = simulate(ship, policy, duration=10.0 * L / U, dt=0.5)
    assert not policy.complete(run)
    assert set(policy.indices(run, L)) == {"cross_track_max", "cross_track_rms", "cross_track_end"}


def test_indices_of_a_path_drawn_by_hand():
    """Along the first leg 5 m to port, then round the corner with 12 m of overshoot, ending 2 m off."""
    policy = TrackFollowing(0.0, 1.0, 1.0, 100.0, 50.0, path=waypoints([(0, 0), (1000, 0), (1000, 1000)]))
    x = np.concatenate([np.linspace(0, 950, 96), np.full(20, 960.0), np.full(20, 1012.0), np.full(61, 1002.0)])
    last = np.linspace(400, 1000, 61)
    y = np.concatenate([np.full(96, -5.0), np.linspace(0, 40, 20), np.linspace(50, 390, 20), last])
    trial = Trial("drawn", np.arange(float(x.size)), {"x": x, "y": y})
    found = policy.indices(trial, 10.0)
    assert found["cross_track_max"].value == pytest.approx(40.0, abs=1.0)  # where it leaves the first leg
    assert found["corner_overshoot"].value == pytest.approx(12.0)
    assert found["cross_track_end"].value == pytest.approx(-2.0)  # port of an eastward leg is north
    assert found["time"].value == pytest.approx(x.size - 1)
    assert policy.complete(trial)


def test_geometry_of_a_leg():
    (leg,) = legs([(1.0, 2.0), (1.0, 12.0)])
    assert leg.alpha == pytest.approx(math.pi / 2)
    assert leg.length == pytest.approx(10.0)
    assert leg.along_across(0.0, 5.0) == pytest.approx((3.0, 1.0))  # south of an eastward leg is to starboard
    assert los_heading(0.3, 5.0, 5.0) == pytest.approx(0.3 - math.pi / 4)


def test_waypoints_are_numbers_and_vary_from_lane_to_lane(ship):
    policy = TrackFollowing.ordered(Settings(0.0, U, L, 0.6))
    assert values(policy)["path.x_2"] == pytest.approx(20 * L)
    assert update(policy, {"path.x_2": 5.0}).legs[0].length == pytest.approx(5.0)
    lanes = campaign(
        ship, policy, {"policy.path.x_2": np.array([3.0, 20.0]) * L, "policy.path.x_3": np.array([3.0, 20.0]) * L},
        speed=U, duration=20 * L / U, dt=0.5,
    )  # fmt: skip
    assert lanes.values[0, -1, 1] > 8 * L  # the early corner
    assert abs(lanes.values[1, -1, 1]) < 2 * L


@pytest.mark.parametrize(
    ("points", "words"),
    [([(0, 0)], "two waypoints or more"), ([(0, 0), (0, 0)], "no leg between"), ([(0, 0), (math.nan, 0)], "no leg")],
)
def test_paths_that_cannot_be_are_refused(points, words):
    with pytest.raises(ParameterError, match=words):
        waypoints(points)


def test_a_track_needs_a_path():
    with pytest.raises(ParameterError, match="two waypoints or more"):
        TrackFollowing(0.0, 1.0, 1.0, 100.0, 50.0)
