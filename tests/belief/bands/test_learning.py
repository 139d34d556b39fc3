"""Sizes of what a model lacks, learned from errors whose law is known; variances against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from seatrial.belief.bands.calibration import Left
from seatrial.belief.bands.disturbance import Disturbance, Process
from seatrial.belief.bands.learning import (
    LAYOUT,
    TAUS,
    Variances,
    Windows,
    by_trial,
    joined,
    learned,
    quiet,
    size,
    sources,
    variances,
    windows_of,
)
from seatrial.belief.bands.sailing import FreeRuns, Uncertain, sailed
from seatrial.belief.parts import LeftOut
from seatrial.data import Trial
from seatrial.environment import Environment
from seatrial.manoeuvres.turning import Turning
from seatrial.ships.files import load
from seatrial.simulate.loop import open_loop
from seatrial.simulate.run import simulate
from virtual_logs import posterior

SHIP = load("esso_osaka_3m")
HORIZONS = np.array([5.0, 10.0, 20.0])


@pytest.fixture(scope="module")
def turn() -> Trial:
    return simulate(SHIP, Turning(10.0, 0.2), speed=0.4, duration=61.0, dt=0.5, name="turn")


def test_a_trial_counts_once_however_many_windows_it_has() -> None:
    weights = by_trial(["a", "b", "a", "a"])
    assert weights == pytest.approx([1 / 3, 1.0, 1 / 3, 1 / 3])


def spectrum(windows: int, seed: int) -> tuple[Variances, np.random.Generator, np.ndarray]:
    """Sources that differ in channel and in growth with the horizon, as accelerations of three times do."""
    rng = np.random.default_rng(seed)
    speed = np.vstack([np.ones(windows), rng.choice([0.0, 1.0, 4.0], (2, windows))])  # of the medium, squared
    unit = np.zeros((len(LAYOUT) * len(TAUS) + 1, windows, len(HORIZONS), 6))
    for k in range(len(LAYOUT)):
        for j in range(len(TAUS)):
            shape = (HORIZONS / 5.0) ** (2.0 + j)
            unit[k * len(TAUS) + j, :, :, k % 3 + 3] = 0.01 * shape * speed[k // 3][:, None]
    unit[-1, :, :, :2] = (HORIZONS**2)[:, None]
    return Variances(np.full((windows, len(HORIZONS), 6), 1e-6), unit), rng, speed


@pytest.mark.slow
@pytest.mark.parametrize("tau", [0, 1, 2])
def test_sizes_of_known_errors_are_found(tau: int) -> None:
    """Two accelerations and a current, each of known size; what is not there is left out, and its time is told."""
    found, rng, _ = spectrum(400, tau)
    truth = np.zeros(len(found.unit))
    truth[0 * len(TAUS) + tau], truth[2 * len(TAUS) + tau], truth[-1] = 0.3**2, 0.7**2, 0.05**2
    total = found.known + np.tensordot(truth, found.unit, 1)
    # Student's t with four degrees of freedom, the law that is assumed, has its scale where the variance stands.
    error = np.sqrt(total) * rng.standard_t(4.0, total.shape)
    out = learned(SHIP, error, found, np.ones(400))
    assert out.current == pytest.approx(0.05, rel=0.1)
    sizes = np.array([one.sigma for one in out.processes])
    # Which medium and time are settled slowly; the whole, which is the width of a band, is not.
    times = [round(one.tau / (SHIP.L_pp / SHIP.speed), 6) for one in out.processes]
    theta = np.zeros(len(found.unit))
    for k, one in enumerate(times):
        theta[k * len(TAUS) + TAUS.index(one)] = sizes[k] ** 2
    made, true = (np.tensordot(x, found.unit, 1).mean(axis=0)[:, 3:] for x in (theta, truth))
    assert made[:, [0, 2]] == pytest.approx(true[:, [0, 2]], rel=0.25)
    assert (made[:, 1] < 0.02 * true[:, 0]).all()
    assert times[0] == times[2] == TAUS[tau]
    assert [(one.on, one.by) for one in out.processes] == list(LAYOUT)


@pytest.mark.slow
@pytest.mark.parametrize("tau", [0, 1, 2])
def test_simulated_accelerations_are_told_with_their_time_and_grow_as_it_does(tau: int) -> None:
    """Ornstein-Uhlenbeck accelerations of surge and yaw, by exact steps, and the velocities that they add up to.

    In t a velocity has the variance 2 sigma^2 T^2 (t/T - 1 + exp(-t/T)); a sum of a short and a long time is near to
    one of the middle, but each of them alone is not: at the longest horizon its variance is half or twice as large.
    """
    rng, windows, dt = np.random.default_rng(tau), 300, 0.1
    horizons, times = np.array([5.0, 20.0, 80.0]), np.array(TAUS) * SHIP.L_pp / SHIP.speed
    grown = np.array([2.0 * T**2 * (horizons / T - 1.0 + np.exp(-horizons / T)) for T in times])
    unit = np.zeros((len(LAYOUT) * len(TAUS) + 1, windows, len(horizons), 6))
    for k, (on, by) in enumerate(LAYOUT):
        for j in range(len(TAUS)):
            column = {"u": 3, "v_m": 4, "r": 5}[on]
            unit[k * len(TAUS) + j, :, :, column] = grown[j] * (by == "")
    error, sigma, kept = np.zeros((windows, len(horizons), 6)), 0.01, math.exp(-dt / times[tau])
    for column in (3, 5):
        a, v = sigma * rng.standard_normal(windows), np.zeros(windows)
        for step in range(1, round(horizons[-1] / dt) + 1):
            after = kept * a + math.sqrt(1.0 - kept**2) * sigma * rng.standard_normal(windows)
            a, v = after, v + 0.5 * dt * (a + after)
            here = np.isclose(horizons, step * dt)
            error[:, here, column] = v[:, None]
    out = learned(SHIP, error, Variances(np.full(error.shape, 1e-8), unit), np.ones(windows))
    for k in (LAYOUT.index(("u", "")), LAYOUT.index(("r", ""))):
        one = out.processes[k]
        assert one.tau == pytest.approx(times[tau])
        # a law of t takes a variance of normal errors for .75 of it, whatever the horizon; 300 windows show some 6 %
        assert one.sigma**2 == pytest.approx(0.75 * sigma**2, rel=0.2)
    assert max(out.processes[k].sigma for k, (on, by) in enumerate(LAYOUT) if on == "v_m" and not by) < 1e-3 * sigma


@pytest.mark.slow
def test_errors_that_the_noise_explains_need_nothing_else() -> None:
    found, rng, _ = spectrum(300, 5)
    out = learned(SHIP, 1e-3 * rng.standard_t(4.0, found.known.shape), found, np.ones(300))
    assert max(one.sigma for one in out.processes[:3]) < 0.01
    assert out.current < 1e-4


@pytest.mark.slow
def test_errors_that_nobody_measured_count_for_nothing() -> None:
    found, rng, _ = spectrum(300, 6)
    truth = np.zeros(len(found.unit))
    truth[-1] = 0.05**2
    error = np.sqrt(found.known + np.tensordot(truth, found.unit, 1)) * rng.standard_t(4.0, found.known.shape)
    whole = learned(SHIP, error, found, np.ones(300))
    wild = np.concatenate([error, 50.0 * error])
    twice = Variances(np.concatenate([found.known] * 2), np.concatenate([found.unit] * 2, axis=1))
    weights = np.repeat([1.0, 0.0], 300)
    assert learned(SHIP, wild, twice, weights).current == pytest.approx(whole.current, rel=1e-6)
    wild[300:] = np.nan
    assert learned(SHIP, wild, twice, np.ones(600)).current == pytest.approx(whole.current, rel=1e-6)


def test_sources_stand_alone_in_the_order_of_the_layout() -> None:
    found = sources(SHIP)
    assert len(found) == len(LAYOUT) * len(TAUS) + 1
    for at, one in enumerate(found[:-1]):
        k, j = divmod(at, len(TAUS))
        alone = [process for process in one.processes if process.sigma > 0]
        assert len(alone) == 1
        assert one.processes.index(alone[0]) == k
        assert (alone[0].on, alone[0].by) == LAYOUT[k]
        assert alone[0].tau == pytest.approx(TAUS[j] * SHIP.L_pp / SHIP.speed)
        assert size(one) == alone[0].sigma
        assert one.current == 0.0
    assert size(found[-1]) == found[-1].current > 0.0
    assert all(process.sigma == 0.0 for process in found[-1].processes)


@pytest.mark.slow
def test_windows_begin_evenly_and_err_by_what_the_log_differs(turn: Trial) -> None:
    """On the ship's own log nothing is amiss; a heading read .1 rad off errs by that, in every window."""
    cut = windows_of(SHIP, [turn], HORIZONS, 0.5)
    assert np.nanmax(np.abs(cut.error)) < 1e-6
    assert cut.rows.tolist() == [1, 2, 4]
    assert cut.begins[0] == 0
    assert len(cut.trials) == len(cut.begins) == len(cut.error)
    assert (np.diff(cut.begins) * 0.5 >= 5.0).all()
    for begin, row in zip(cut.begins, cut.measured, strict=True):
        for h, seconds in enumerate(HORIZONS):
            at = begin + round(seconds / 0.5)
            if at < len(turn):
                assert row[h, 2] == pytest.approx(turn["psi"][at], abs=1e-9)
            else:
                assert np.isnan(row[h]).all()
    late = np.arange(len(turn)) > 60
    off = turn.having(psi=turn["psi"] + np.where(late, 0.1, 0.0))
    other = windows_of(SHIP, [off], np.array([5.0, 10.0]), 0.5)
    crossing = (other.begins <= 60) & (other.begins + 10 > 60)
    assert crossing.any()
    assert other.error[crossing][:, 0, 2] == pytest.approx(-0.1, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("longer", [0.0, 40.0])
def test_a_horizon_as_long_as_the_log_or_longer_has_what_there_is(turn: Trial, longer: float) -> None:
    """Steps of a log are seldom exact: 1200 of .2 s were 1.3e-12 s longer than one of 240 s, which ended calibrate."""
    whole = turn.duration * (1.0 + 5e-15) + longer
    cut = windows_of(SHIP, [turn], np.array([0.5, 1.0]) * whole, 0.5 * (1.0 + 5e-15))
    half = cut.error[0, 0]
    assert np.abs(half).max() < 1e-5
    assert np.isnan(cut.error[:, 1]).all() == (longer > 0.0), "the end of the log is there, or lies before the horizon"
    rows = sailed(SHIP, cut.lanes, quiet(SHIP, 1), 0)[0]
    ends = cut.reached(rows)
    assert ends.shape == (len(cut.trials), 2, 6)
    np.testing.assert_array_equal(ends[:, 0], rows[:, cut.rows[0]])
    assert np.isnan(ends[:, 1]).all() == (longer > 0.0)


@pytest.mark.slow
def test_a_first_window_may_begin_elsewhere_and_windows_join(turn: Trial) -> None:
    state = np.array([turn[n][0] for n in ("x", "y", "psi", "u", "v_m", "r")])
    moved = state + np.array([7.0, -3.0, 0, 0, 0, 0])
    cut = windows_of(SHIP, [turn], HORIZONS, 0.5, {"turn": moved})
    assert cut.error[0, :, :2] == pytest.approx(np.tile([7.0, -3.0], (3, 1)), abs=1e-6)
    assert np.nanmax(np.abs(cut.error[1:])) < 1e-6
    both = joined([cut, cut.some(np.arange(len(cut.trials)) == 0)])
    assert len(both.trials) == len(cut.trials) + 1
    assert both.error[-1] == pytest.approx(cut.error[0])


def drifted(north: float, east: float) -> np.ndarray:
    """North [m] at the horizons of a ship that lies bow north, from rest, in a current [m/s]."""

    def rates(t: float, z: np.ndarray) -> tuple[float, ...]:
        around = Environment(current_x=north, current_y=east)
        return tuple(SHIP.model.derivative(tuple(z), (0.0,) * len(SHIP.model.controls), around))

    found = solve_ivp(rates, (0.0, HORIZONS[-1]), np.zeros(6), t_eval=HORIZONS, rtol=1e-8, atol=1e-10)
    return found.y[0]


@pytest.mark.slow
def test_variances_of_start_and_current_are_those_of_the_kinematics() -> None:
    """A ship at rest: a steady current moves it by U t, a start that is off stays off; readings add their own."""
    state, series = np.zeros((40, 6)), np.zeros((40, 41, len(open_loop(SHIP).series)))
    lanes = FreeRuns(state, series, 0.5, 10)
    none, places = np.zeros((40, 3, 6)), np.zeros(40, dtype=np.intp)
    cut = Windows(("t",) * 40, ("turning",) * 40, lanes, np.array([5.0, 10.0, 20.0]), none, none, places)
    held = posterior()
    out = LeftOut(replace(held, ship=SHIP, covariance=1e-12 * held.covariance), ())
    noise = np.array([0.5, 0.2, 0.0, 0.0, 0.0, 0.0])
    found = variances(out, cut, noise, seed=3)
    # 40 lanes of 12 draws: the standard error of a variance is sqrt(2 / 480), 6.5 %.
    for c, sigma in enumerate(noise[:2]):
        assert found.known[:, :, c].mean(axis=0) == pytest.approx(2.0 * sigma**2, rel=4 * 0.065)
    # What a current of size s does to a ship at rest, by another integrator and Gauss's rule over its sizes.
    s = size(sources(SHIP)[-1])
    nodes, weights = np.polynomial.hermite_e.hermegauss(5)
    squares = sum(v * w * drifted(s * a, s * b) ** 2 for a, v in zip(nodes, weights, strict=True)
                  for b, w in zip(nodes, weights, strict=True)) / weights.sum() ** 2  # fmt: skip
    current = found.unit[-1]
    assert current[:, :, 0].mean(axis=0) == pytest.approx(squares / s**2, rel=4 * 0.1)
    # A force on surge that stays moves no heading.
    assert np.abs(found.unit[: len(TAUS), :, :, 2]).max() < 1e-9


def test_longer_steps_act_with_the_mean_of_their_inputs() -> None:
    rng = np.random.default_rng(0)
    lanes = FreeRuns(np.zeros((2, 6)), rng.normal(size=(2, 41, 3)), 0.01, 20)
    longer = lanes.longer(SHIP)
    k = round(longer.dt / lanes.dt)
    assert k > 1
    assert longer.every * longer.dt == pytest.approx(lanes.every * lanes.dt)
    assert longer.t == pytest.approx(lanes.t)
    for j in range(40 // k):
        assert longer.series[:, j] == pytest.approx(lanes.series[:, j * k : (j + 1) * k].mean(axis=1))
    odd = FreeRuns(np.zeros((2, 6)), np.zeros((2, 15, 3)), 0.01, 7)
    assert odd.longer(SHIP) is odd


@pytest.mark.slow
def test_draws_differ_by_what_is_uncertain_and_by_nothing_else() -> None:
    state = np.tile([0.0, 0.0, 0.0, 0.4, 0.0, 0.0], (3, 1))
    lanes = FreeRuns(state, np.zeros((3, 41, len(open_loop(SHIP).series))), 0.5, 10)
    still = sailed(SHIP, lanes, quiet(SHIP, 2), 1)
    assert still.shape == (2, 3, 5, 6)
    assert (still[0] == still[1]).all()
    drawn = np.array([[SHIP.model.hull.X_0F], [1.3 * SHIP.model.hull.X_0F]])
    quietly = quiet(SHIP, 2)
    some = sailed(SHIP, lanes, Uncertain(("hull.X_0F",), drawn, quietly.start, quietly.disturbance), 1)
    assert some[0] == pytest.approx(still[0], abs=1e-12)
    assert (some[1, :, 1:, 3] < some[0, :, 1:, 3]).all()  # more resistance, less speed


def test_the_usual_error_is_a_root_mean_square_by_trial() -> None:
    """Position has one size north and east; a trial of many windows counts as one of few."""
    error = np.full((3, 1, 6), np.nan)
    error[0, 0], error[1, 0], error[2, 0] = [3, 1, 1, 1, 1, 1], [3, 1, 1, 1, 1, 1], [1, 1, 4, 1, 1, np.nan]
    left = Left(("a", "a", "b"), ("a", "a", "b"), ("", "", ""), np.array([5.0]), error, 2.0 * np.ones((3, 1, 6)))
    x, y = (9.0 + 1.0) / 2.0, 1.0
    assert left.usual[0, :2] ** 2 == pytest.approx([(x + y) / 2.0] * 2)
    assert left.usual[0, 2] ** 2 == pytest.approx((1.0 + 16.0) / 2.0)
    assert left.usual[0, 5] == pytest.approx(1.0)
    assert left.scores(1.0)[0, 0, 0] == pytest.approx(1.5)
    assert left.scores(0.0)[0, 0, 0] == pytest.approx(3.0 / left.usual[0, 0])
    assert left.scores(0.5)[0, 0, 0] == pytest.approx(3.0 / math.sqrt(2.0 * left.usual[0, 0]))


@pytest.mark.slow
@pytest.mark.parametrize(("on", "column", "power"), [("u", 3, 1), ("r", 5, 1), ("v_m", 4, 1)])
def test_a_short_push_spreads_velocity_as_a_random_walk(on: str, column: int, power: int) -> None:
    """Variance of velocity after t: 2 sigma^2 tau^2 (t/tau - 1 + exp(-t/tau)), where the ship hardly damps it."""
    sigma, tau, t = 1e-4, 2.0, 3.0
    still = [Process(a, 0.0, tau, by) for a, by in LAYOUT]
    still[LAYOUT.index((on, ""))] = Process(on, sigma, tau)
    lanes = FreeRuns(np.zeros((400, 6)), np.zeros((400, 31, len(open_loop(SHIP).series))), 0.1, 30)
    quietly = quiet(SHIP, 6)
    run = sailed(SHIP, lanes, Uncertain((), quietly.draws, quietly.start, Disturbance(tuple(still))), 2)
    expected = 2.0 * (sigma * tau) ** 2 * (t / tau - 1.0 + math.exp(-t / tau))
    found = float(run[:, :, 1, column].var())
    assert found**power == pytest.approx(expected, rel=4 * math.sqrt(2.0 / 2400) + 0.05)
