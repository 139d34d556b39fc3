"""Direct spiral, reverse spiral and pull-out tell stable ships from unstable ones, and by how much."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from simple_ships import FOLD, RESIDUAL, SETTINGS, UNSTABLE, L, U, measured, norrbin

from seatrial.cli.simulation import index_document
from seatrial.forces import HARD_OVER
from seatrial.manoeuvres import Settings, by_demand, decimals
from seatrial.manoeuvres.pull_out import PullOut
from seatrial.manoeuvres.reverse_spiral import ReverseSpiral
from seatrial.manoeuvres.spiral import Spiral
from seatrial.ships.files import load
from seatrial.simulate.run import approach, campaign, simulate

DEGREE = math.radians(1.0)


def kvlcc2(gamma_R):
    """KVLCC2 made symmetric to port and starboard, and its settings."""
    ship = replace(load("kvlcc2"), validity={})
    ship = ship.having({"rudder.gamma_Rp": gamma_R, "rudder.gamma_Rn": gamma_R, "propeller.C_2n": 1.6})
    speed, n_P = approach(ship)
    return ship, Settings(n_P, speed, ship.L_pp, float(ship.actuators.rudder.high))


def spiral_of(ship, settings=SETTINGS, lengths=960.0, **changes):
    policy, clock = replace(Spiral.ordered(settings), **changes), settings.L_pp / settings.speed
    return policy, simulate(ship, policy, speed=settings.speed, duration=lengths * clock, dt=0.01 * clock)


@pytest.mark.slow
def test_spiral_of_a_linear_ship_is_a_line_of_slope_K():
    policy, run = spiral_of(norrbin())
    assert policy.complete(run)
    delta, r = policy.curve(run)
    assert np.degrees(delta[:10]) == pytest.approx([20, 15, 10, 5, 4, 3, 2, 1, 0, -1], abs=1e-9)
    assert delta.size == 33
    assert r == pytest.approx(0.05 * delta, abs=2 * policy.tolerance)
    found = policy.indices(run, L)
    assert found["steady_rate_starboard"].value == pytest.approx(0.05 * 20 * DEGREE, rel=0.01)
    assert found["loop_width"].value < 0.05 * DEGREE
    assert found["neutral_rudder"].value == pytest.approx(0.0, abs=0.05 * DEGREE)


@pytest.mark.long
def test_spiral_of_an_unstable_ship_jumps_at_the_folds():
    policy, run = spiral_of(UNSTABLE, lengths=1920.0, fine=0.1 * DEGREE, near=3.0 * DEGREE)
    assert policy.complete(run)
    found = policy.indices(run, L)
    assert found["loop_width"].value == pytest.approx(2 * FOLD, abs=0.1 * DEGREE)
    assert found["loop_height"].value == pytest.approx(2 * RESIDUAL, rel=0.01)
    assert found["neutral_rudder"].value == pytest.approx(0.0, abs=0.05 * DEGREE)


@pytest.mark.slow
def test_reverse_spiral_holds_the_unstable_middle():
    """A direct spiral cannot: every point lies on -r + alpha r^3 = K delta."""
    policy = ReverseSpiral.ordered(SETTINGS)
    run = simulate(UNSTABLE, policy, speed=U, duration=960 * L / U, dt=0.2)
    assert policy.complete(run)
    delta, r = policy.curve(run)
    assert delta == pytest.approx((4e4 * r**3 - r) / 0.05, abs=0.05 * DEGREE)
    middle = np.abs(r) < 0.9 / math.sqrt(3 * 4e4)
    assert middle.sum() >= 3
    fine = replace(policy, rate=0.006, step=0.0005)
    found = fine.indices(simulate(UNSTABLE, fine, speed=U, duration=1500 * L / U, dt=0.2), L)
    assert found["loop_width"].value == pytest.approx(2 * FOLD, rel=0.01)
    assert found["loop_height"].value == pytest.approx(2 * RESIDUAL, rel=0.01)
    # a central difference over +-0.0005 rad/s of a slope of -1/K = -20 s at r = 0
    assert found["slope"].value == pytest.approx((4e4 * 0.0005**2 - 1) / 0.05, rel=0.05)


@pytest.mark.long
def test_reverse_spiral_of_a_stable_ship():
    policy = ReverseSpiral.ordered(SETTINGS)
    found = policy.indices(simulate(norrbin(), policy, speed=U, duration=480 * L / U), L)
    assert found["loop_width"].value == pytest.approx(0.0, abs=0.01 * DEGREE)
    assert found["slope"].value == pytest.approx(20.0, rel=0.01)
    assert found["neutral_rudder"].value == pytest.approx(0.0, abs=0.02 * DEGREE)


@pytest.mark.long
def test_symmetric_kvlcc2_stable_is_single_valued_and_odd():
    policy, run = spiral_of(*kvlcc2(0.64))
    delta, r = policy.curve(run)
    assert policy.complete(run)
    turn = int(np.argmin(delta))
    assert r[turn:] == pytest.approx(r[: turn + 1][::-1], abs=2e-4)
    assert r[: turn + 1] == pytest.approx(-r[: turn + 1][::-1], abs=2e-4)
    assert np.ptp(r) > 0.014
    assert policy.indices(run, 320.0)["loop_width"].value < 0.1 * DEGREE


@pytest.mark.long
def test_symmetric_kvlcc2_unstable_all_three_agree():
    ship, settings = kvlcc2(0.395)
    policy, run = spiral_of(ship, settings, fine=0.25 * DEGREE, near=2.0 * DEGREE)
    direct = policy.indices(run, 320.0)
    back = ReverseSpiral.ordered(settings)
    back = replace(back, rate=0.625 * back.rate, step=0.5 * back.step)
    reverse = back.indices(simulate(ship, back, speed=settings.speed, duration=720 * 320.0 / settings.speed), 320.0)
    out = PullOut.ordered(settings)
    pulled = out.indices(simulate(ship, out, speed=settings.speed, duration=240 * 320.0 / settings.speed), 320.0)
    assert direct["loop_width"].value == pytest.approx(reverse["loop_width"].value, abs=0.25 * DEGREE)
    assert direct["loop_height"].value == pytest.approx(reverse["loop_height"].value, rel=0.03)
    assert pulled["residual_difference"].value == pytest.approx(direct["loop_height"].value, rel=0.03)
    assert pulled["residual_rate_port"].value == pytest.approx(-pulled["residual_rate_starboard"].value, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("ship", "residual"), [(norrbin(), 0.0), (UNSTABLE, RESIDUAL)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_pull_out_leaves_nothing_or_the_same_to_both_sides(ship, residual, side):
    policy = PullOut.ordered(replace(SETTINGS, side=side))
    run = simulate(ship, policy, speed=U, duration=240 * L / U)
    assert policy.complete(run)
    assert run["delta_cmd"][0] == side * policy.delta
    found = policy.indices(run, L)
    assert found["residual_rate_starboard"].value == pytest.approx(residual, abs=2 * policy.tolerance)
    assert found["residual_rate_port"].value == pytest.approx(-residual, abs=2 * policy.tolerance)
    assert found["residual_difference"].value == pytest.approx(2 * residual, abs=3 * policy.tolerance)


def test_runs_that_are_too_short_are_not_complete():
    for policy in (Spiral.ordered(SETTINGS), ReverseSpiral.ordered(SETTINGS), PullOut.ordered(SETTINGS)):
        run = simulate(norrbin(), policy, speed=U, duration=15 * L / U)
        assert not policy.complete(run)
        assert "loop_width" not in policy.indices(run, L)
        assert "residual_difference" not in policy.indices(run, L)


@pytest.mark.slow
def test_measured_runs_without_orders_and_with_noise():
    policy, run = spiral_of(UNSTABLE)
    noise = {"delta": 0.1 * DEGREE, "r": 1e-4}
    exact, noisy = policy.indices(run, L), policy.indices(measured(run, **noise), L)
    for name in ("loop_width", "loop_height", "steady_rate_port"):
        assert noisy[name].value == pytest.approx(exact[name].value, rel=0.05)
    out = PullOut.ordered(SETTINGS)
    run = simulate(UNSTABLE, out, speed=U, duration=240 * L / U)
    assert out.complete(measured(run, **noise))
    assert out.indices(measured(run, **noise), L)["residual_rate_port"].value == pytest.approx(-RESIDUAL, rel=0.02)
    without_r = {n: v for n, v in run.channels.items() if n != "r"}
    found = out.indices(replace(run, channels=without_r), L)
    assert found["residual_rate_starboard"].value == pytest.approx(RESIDUAL, rel=0.02)


@pytest.mark.slow
def test_a_campaign_of_spirals_is_one_kernel():
    policy = Spiral.ordered(SETTINGS)
    K = np.array([0.03, 0.05, 0.08])
    vary = {"ship.K": K, "policy.side": np.array([1.0, -1.0, 1.0])}
    together = campaign(norrbin(), policy, vary, speed=U, duration=4000.0, dt=0.5)
    for lane, (gain, side) in enumerate(zip(K.tolist(), (1.0, -1.0, 1.0), strict=True)):
        alone = simulate(norrbin(K=gain), replace(policy, side=side), speed=U, duration=4000.0, dt=0.5)
        assert together.values[lane, :, 5] == pytest.approx(alone["r"], abs=1e-12)


def test_the_width_of_a_loop_is_known_to_the_step_at_its_jumps():
    """Turns with folds at +-7.3 deg, told in steps of 5 deg beyond 5: the width is 14.6 within 5, printed so."""
    fold, steps = 7.3, np.array([20, 15, 10, 5, 4, 3, 2, 1, 0, -1, -2, -3, -4, -5, -10, -15, -20.0])
    upper = np.where(steps > -fold, 0.3 + 0.005 * steps, -0.3 + 0.005 * steps)
    lower = np.where(steps[::-1] < fold, -0.3 + 0.005 * steps[::-1], 0.3 + 0.005 * steps[::-1])
    policy = Spiral.ordered(SETTINGS)

    class Told(Spiral):
        def curve(self, trial):
            return np.radians(np.append(steps, steps[::-1][1:])), np.append(upper, lower[1:])

    found = Told(**vars(policy)).indices(None, L)
    width = found["loop_width"]
    assert found["resolution"].value == pytest.approx(5 * DEGREE)
    assert abs(width.value - 2 * fold * DEGREE) <= width.resolution == pytest.approx(5 * DEGREE)
    assert found["neutral_rudder"].resolution == width.resolution
    assert [decimals(x) for x in (5.0, 1.0, 0.99999999999, 0.25, 0.1, 30.0)] == [1, 1, 1, 2, 2, 0]
    asked = index_document(width)
    assert asked["resolution"] == pytest.approx(5.0)
    assert by_demand({"loop_width": width})["loop_width"].resolution == pytest.approx(500 * DEGREE / HARD_OVER)


@pytest.mark.long
def test_direct_spiral_reverse_spiral_and_a_slow_ramp_agree_within_the_resolution():
    ship = load("kvlcc2")
    speed, n_P = approach(ship)
    settings = Settings(n_P, speed, ship.L_pp, float(ship.actuators.rudder.high))
    policy, run = spiral_of(replace(ship, validity={}), settings)
    direct = policy.indices(run, ship.L_pp)["loop_width"]
    back = ReverseSpiral.ordered(settings)
    clock = ship.L_pp / speed
    reverse = back.indices(
        simulate(replace(ship, validity={}), back, speed=speed, duration=960 * clock, dt=0.01 * clock), ship.L_pp
    )["loop_width"]
    assert abs(direct.value - reverse.value) < direct.resolution
    assert abs(direct.value - 0.40 * DEGREE) < direct.resolution
    assert reverse.value == pytest.approx(0.40 * DEGREE, abs=0.02 * DEGREE)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_next_yaw_rate_of_a_reverse_spiral_is_ordered_when_the_last_is_steady_and_not_before(side: float) -> None:
    rate, step = 0.02, 0.005
    policy = ReverseSpiral(1.5, rate, step, 10.0, 1e-4, 20.0, 0.0, 1e-9, side)  # hardly any rudder: r is judged
    state = [0.0, 0.0, 0.0, 5.0, 0.0, side * rate]
    memory, ordered = policy.begin(tuple(state)), []
    for k in range(100):
        t = float(k)
        state[5] = float(memory[0]) + (0.01 * math.sin(k) if k < 40 else 0.0)  # it hunts at first
        _, memory = policy.command(t, tuple(state), memory)
        ordered.append(float(memory[0]))
    changes = np.flatnonzero(np.abs(np.diff(ordered)) > 1e-12) + 1
    assert changes[0] >= 40 + 2 * 10
    assert (np.diff(changes) >= 2 * 10).all()
    wanted = [side * (rate - n * step) for n in range(len(changes) + 1)]
    assert [ordered[k] for k in (0, *changes)] == pytest.approx(wanted)
    assert len(changes) >= 2
