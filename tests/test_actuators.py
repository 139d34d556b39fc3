"""Actuators against the exact solution of their own equations."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from seatrial.actuators import Actuator, Actuators, Azimuth, Servo, Shaft, queue_length
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.loop import closed_loop
from seatrial.simulate.replay import replay
from seatrial.simulate.run import campaign, simulate
from tiers import slow_but


def run(servo: Servo, orders: list[float], dt: float, start: tuple[float, ...]) -> tuple[list[float], list[float]]:
    """Means over each step, and values at their ends."""
    memory, means, ends = start, [], []
    for order in orders:
        mean, memory = servo.advance(memory, order, dt)
        means.append(mean)
        ends.append(memory[0])
    return means, ends


@pytest.mark.parametrize("dt", slow_but([0.01, 0.5, 2.0, 7.0], 0.5))
@pytest.mark.parametrize(
    ("rate", "lag"), slow_but([(0.05, 2.0), (math.inf, 3.0), (0.02, 0.5), (10.0, 1.0)], (0.05, 2.0))
)
def test_lag_and_rate_are_solved_exactly_at_any_step(dt: float, rate: float, lag: float) -> None:
    """y' = clip((target - y)/lag, +-rate): end and mean against a tight ODE solver."""
    steps = max(int(14.0 / dt), 1)
    means, ends = run(Actuator(rate=rate, lag=lag), [0.6] * steps, dt, (-0.1,))
    t = dt * np.arange(1, steps + 1)
    top = min(rate, 1e9)
    truth: Any = solve_ivp(
        lambda _, y: [np.clip((0.6 - y[0]) / lag, -top, top), y[0]], (0, t[-1]), [-0.1, 0.0],
        t_eval=t, rtol=1e-11, atol=1e-12, max_step=0.02,
    )  # fmt: skip
    assert ends == pytest.approx(truth.y[0], abs=2e-6)
    assert np.cumsum(means) * dt == pytest.approx(truth.y[1], abs=1e-5)


def test_limits_and_rate() -> None:
    rudder = Actuator(low=-0.6, high=0.6, rate=0.04)
    means, ends = run(rudder, [1.0] * 40, 0.5, (0.0,))
    assert ends[0] == pytest.approx(0.02)
    assert means[0] == pytest.approx(0.01)
    assert max(ends) == pytest.approx(0.6)
    assert np.abs(np.diff([0.0, *ends])).max() <= 0.04 * 0.5 + 1e-15


def test_without_a_rate_an_order_acts_at_once() -> None:
    assert run(Actuator(), [0.3], 0.1, (0.0,)) == ([0.3], [0.3])


@pytest.mark.parametrize("wanted", [3.0, -3.0])
def test_an_azimuth_turns_the_shorter_way(wanted: float) -> None:
    """From 170 deg to -170 deg is 20 deg through astern, not 340 deg through ahead (You 2023 Eq. 9, clipped)."""
    servo = Azimuth(rate=0.1151)
    _, ends = run(servo, [-wanted] * 100, 0.2, (wanted,))
    path = np.array([wanted, *ends])
    assert np.abs(np.diff(path)).max() <= 0.1151 * 0.2 + 1e-12
    assert abs(ends[-1]) == pytest.approx(2 * math.pi - 3.0)
    assert ends[-1] == pytest.approx(ends[-2], abs=1e-12), "it rests at its target, without chatter"


def test_a_shaft_stops_and_waits_before_it_reverses() -> None:
    shaft = Shaft(low=-1.0, rate=0.2, rate_down=0.5, pause=3.0)
    _, n = run(shaft, [-1.5] * 200, 0.1, (2.0, 0.0, 0.0))
    stopped = np.flatnonzero(np.array(n) == 0.0)
    assert stopped[0] == pytest.approx(2.0 / 0.5 / 0.1 - 1, abs=1)
    assert stopped.size * 0.1 == pytest.approx(3.0, abs=0.21)
    assert n[-1] == -1.0
    backwards = np.diff(n)[stopped[-1] :]
    assert backwards.min() == pytest.approx(-0.02)


def test_a_shaft_that_keeps_its_sign_never_waits() -> None:
    _, n = run(Shaft(rate=0.5, rate_down=0.5, pause=9.0), [1.0] * 5 + [0.5] * 30, 0.1, (0.8, 0.0, 0.0))
    assert n[-1] == 0.5


def test_a_shaft_that_was_first_stopped_waits_all_the_same() -> None:
    """An order to stop and then one to go astern is a reversal; stopping and going on ahead is not."""
    shaft = Shaft(rate=1.0, rate_down=1.0, pause=3.0)
    _, n = run(shaft, [0.0] * 20 + [-1.0] * 60, 0.1, (1.0, 0.0, 0.0))
    assert np.count_nonzero(np.array(n) == 0.0) * 0.1 == pytest.approx(3.0, abs=0.21)
    _, n = run(shaft, [0.0] * 20 + [1.0] * 20, 0.1, (1.0, 0.0, 0.0))
    assert n[20] == pytest.approx(0.1)


def test_who_obeys_at_once() -> None:
    assert Actuator(high=1.0).at_once
    assert not any(a.at_once for a in (Actuator(rate=1.0), Actuator(lag=1.0), Actuator(dead_time=1.0)))
    assert not Shaft(rate_down=0.1).at_once
    assert not Shaft(pause=3.0).at_once


def test_a_lane_without_lag_among_lanes_with_one() -> None:
    ship = replace(load("kvlcc2_l7"), actuators=Actuators({"rudder": Actuator(high=0.6, low=-0.6, lag=2.0)}))
    run = campaign(ship, Turning(n_P=11.85, delta=0.5), {"rudder.lag": np.array([2.0, 0.0])}, speed=1.0, duration=20.0)
    assert not run.failures
    delta = run.values[:, :, closed_loop(ship, Turning(1.0, 0.1), 0.1).stored.index("delta")]
    assert delta[0, 100] == pytest.approx(0.5 * -math.expm1(-run.t[100] / 2.0), rel=1e-6)
    assert delta[1, 5] == pytest.approx(0.5)


def test_a_replay_of_controls_that_obey_at_once_is_the_run() -> None:
    ship = replace(load("mariner_nomoto"), actuators=Actuators())
    trial = simulate(ship, Zigzag(n_P=0.0, delta=0.17, psi=0.17), duration=600.0, dt=0.5)
    assert trial.meta["held"] == ["n_P", "delta"]
    for name in ("x", "y", "psi", "r"):
        assert replay(ship, trial)[name] == pytest.approx(trial[name], abs=1e-9)
    coarse = simulate(ship, Zigzag(n_P=0.0, delta=0.17, psi=0.17), duration=600.0, dt=0.5, every=20)
    # A row of a coarse log holds the mean of what acted until the next one.
    acted = trial["delta"][: 20 * (len(coarse) - 1)].reshape(-1, 20).mean(axis=1)
    assert coarse["delta"][:-1] == pytest.approx(acted, abs=1e-12)


def test_a_sampled_model_replays_what_stood_at_its_samples() -> None:
    ship = load("kvlcc2_l7_arx")
    trial = simulate(ship, Zigzag(n_P=11.85, delta=0.17, psi=0.17), duration=100.0)
    again = replay(ship, trial)
    assert again["psi"] == pytest.approx(trial["psi"], abs=1e-9)


@pytest.mark.parametrize("dead", [0.0, 0.3, 0.5, 0.62, 0.65, 2.0])
def test_dead_time_shifts_the_answer(dead: float) -> None:
    """A rudder with a dead time moves as one without, that much later; also between two steps."""
    ship = load("kvlcc2_l7")
    slow = Actuator(low=-0.61, high=0.61, rate=0.2, dead_time=dead)
    trial = simulate(replace(ship, actuators=Actuators({"rudder": slow})), Turning(n_P=11.85, delta=0.5),
                     duration=12.0, dt=0.1)  # fmt: skip
    expected = np.clip(0.2 * (trial.t - dead), 0.0, 0.5)
    assert trial["delta"] == pytest.approx(expected, abs=1e-12)
    assert trial["delta_cmd"][:-1] == pytest.approx(0.5)
    assert queue_length(dead, 0.1) == math.ceil(dead / 0.1 - 1e-9)
