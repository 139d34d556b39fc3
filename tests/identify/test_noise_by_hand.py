"""Noise of logs at its bounds: floors, steps, spikes of a known size, and what two readings leave open between them."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.environment import CHANNELS
from seatrial.identify.diagnosis.linear import _draws
from seatrial.identify.noise import (
    _at_its_rate,
    _clipped,
    _cubic,
    _jumps,
    _open,
    between_rows,
    channel,
    input_noise,
    noise,
    outliers,
    resolution,
    screened,
    sensor_noise,
)


def trial(**channels: Any) -> Trial:
    size = len(next(iter(channels.values())))
    return Trial("a", np.arange(float(size)), {name: np.asarray(one, dtype=float) for name, one in channels.items()})


def white(size: int, level: float, seed: int = 0) -> np.ndarray:
    return level * np.random.default_rng(seed).standard_normal(size)


# --- the noise of a channel ---


def test_two_readings_in_a_row_tell_no_noise_and_three_do() -> None:
    assert math.isnan(sensor_noise(np.array([1.0, 2.0])))
    assert math.isnan(sensor_noise(np.array([1.0, 2.0, math.nan, 1.0, 2.0])))
    # one second difference of variance 6
    assert sensor_noise(np.array([0.0, 3.0, 0.0])) == pytest.approx(6.0 / math.sqrt(6.0))


def test_gaps_do_not_count() -> None:
    values = white(4000, 0.2)
    values[::7] = math.nan
    assert sensor_noise(values) == pytest.approx(0.2, rel=0.1)


def test_a_polynomial_is_no_noise() -> None:
    t = np.linspace(0.0, 1.0, 200)
    assert sensor_noise(t**5 - 3.0 * t**2) < 1e-9


def test_what_is_clipped_lies_beyond_four_times_the_rest() -> None:
    values = np.ones(99)
    assert _clipped(np.append(values, 3.9)) == pytest.approx(math.sqrt((99 + 3.9**2) / 100.0))
    assert _clipped(np.append(values, 50.0)) == pytest.approx(1.0)
    assert _clipped(np.zeros(5)) == 0.0


@pytest.mark.parametrize(("values", "step"), [
    ([0.0, 0.1, 0.2, 0.1, 0.0, 0.1, 0.2, 0.2], 0.1), ([0.0, 0.1, 0.2, 0.4, 0.0, 0.1, 0.2, 0.4], 0.1),
    ([1.0] * 8, 0.0), ([0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0], 1.0), ([0.0, 1.0, 2.0, 3.0, 4.0, 1.0, 2.0, 3.0], 0.0),
    ([0.0, math.nan, 0.5, 0.0, 0.5, 0.5, 0.0, 0.0], 0.5), ([0.0, 0.1, 0.24, 0.0, 0.1, 0.24], 0.12),
])  # fmt: skip
def test_a_resolution_is_the_usual_step_where_at_most_half_of_the_readings_differ(values: Any, step: float) -> None:
    assert resolution(np.array(values)) == pytest.approx(step)


def test_rounding_to_steps_is_their_twelfth_at_least() -> None:
    still = np.repeat([0.0, 0.2, 0.4], 200)
    assert sensor_noise(still) == pytest.approx(0.2 / math.sqrt(12.0))


# --- over trials ---


def test_trials_count_by_their_length_and_a_sidecar_by_its_word() -> None:
    short, long = trial(u=white(1000, 0.3, 1)), trial(u=white(4000, 0.1, 2))
    assert noise([short, long])["u"] == pytest.approx(math.sqrt((0.09 + 4 * 0.01) / 5.0), rel=0.05)
    told = Trial("b", long.t, long.channels, meta={"noise": {"u": 0.5, "r": 9.0}})
    assert noise([short, told])["u"] == pytest.approx(math.sqrt((0.09 + 4 * 0.25) / 5.0), rel=0.05)
    assert noise([Trial("b", long.t, long.channels, meta={"noise": "none"})])["u"] == pytest.approx(0.1, rel=0.05)
    assert noise([short], ["v_m"]) == noise([trial(u=[2.0] * 9)]) == {}


def test_a_log_without_noise_has_a_hundredth_of_its_spread() -> None:
    t = np.linspace(0.0, 1.0, 400)
    found = noise([trial(u=t, r=t**2)])
    assert found == pytest.approx({"u": 0.01 * np.std(t), "r": 0.01 * np.std(t**2)})
    # one channel with noise, and the log is measured: what has none is at its floor
    mixed = noise([trial(u=t, r=t**2 + white(400, 0.01))])
    assert mixed["r"] == pytest.approx(0.01, rel=0.15)
    assert mixed["u"] == pytest.approx(1e-5 * np.std(t), rel=1e-6)


def test_a_heading_is_made_continuous_and_no_other_channel() -> None:
    psi = np.linspace(3.0, 9.0, 50)
    one = trial(psi=psi % math.tau, u=psi % math.tau)
    assert np.ptp(channel(one, "psi")) == pytest.approx(6.0)
    assert np.ptp(channel(one, "u")) < math.tau


MODEL: Any = SimpleNamespace(controls=("n_P", "delta"))


def test_inputs_have_the_noise_of_the_noisiest_trial_each() -> None:
    a = trial(n_P=10.0 + white(2000, 0.02, 1), delta=np.zeros(2000))
    b = trial(n_P=10.0 + white(2000, 0.05, 2), delta=white(2000, 0.001, 3), U_T=5.0 + 0 * np.arange(2000),
              gamma_T=white(2000, 0.01, 4))  # fmt: skip
    level = input_noise([a, b], MODEL)
    assert level.shape == (2 + len(CHANNELS),)
    assert level[0] == pytest.approx(0.05, rel=0.1)
    assert level[1] == pytest.approx(0.001, rel=0.1)
    assert level[2 + CHANNELS.index("wind_y")] == pytest.approx(0.05, rel=0.1)  # 5 m/s about north
    assert level[2 + CHANNELS.index("wind_x")] < 0.01
    assert not level[4:].any()
    assert not input_noise([trial(delta=[math.nan] * 9, n_P=[1.0] * 9)], MODEL).any()


def test_a_channel_that_is_read_seldom_is_judged_by_its_readings() -> None:
    read = np.full(3000, math.nan)
    read[::3] = white(1000, 0.04)
    assert _at_its_rate(read).size == 1000
    assert input_noise([trial(delta=read)], MODEL)[1] == pytest.approx(0.04, rel=0.1)
    gappy = white(100, 0.1)
    gappy[40:44] = math.nan
    assert _at_its_rate(gappy) is gappy


# --- spikes ---


@pytest.mark.parametrize(("size", "found"), [(8.01, True), (7.99, False), (-8.01, True), (-7.99, False)])
def test_a_spike_is_an_outlier_from_eight_scatters_of_its_distance_from_a_neighbour(size: float, found: bool) -> None:
    """Two readings of unit noise lie a root of two apart."""
    values = np.zeros(40)
    values[20] = size * math.sqrt(2.0) * 0.5
    assert bool(outliers(values, 0.5).any()) is found


def test_the_distance_from_the_cubic_counts_where_it_is_the_smaller() -> None:
    """On a parabola a spike towards its inside lies nearer to the neighbours than to the cubic, and the other way."""
    t = np.arange(11.0) - 5.0
    flat = _jumps(np.where(t == 0.0, 1.0, 0.0), 1)
    assert flat[5] == pytest.approx(1.0 / math.sqrt(2.0))
    assert flat[4] == 0.0  # its neighbour is not beyond both of its own
    weights = np.array([-1.0, 4.0, 4.0, -1.0]) / 6.0
    curve = t**2 + np.where(t == 0.0, 3.0, 0.0)
    # 3 above the cubic, 2 above either neighbour
    assert _jumps(curve, 1)[5] == pytest.approx(min(3.0 / math.sqrt(1.0 + weights @ weights), 2.0 / math.sqrt(2.0)))
    low = t**2 - np.where(t == 0.0, 0.5, 0.0)
    assert _jumps(low, 1)[5] == pytest.approx(0.5 / math.sqrt(1.0 + weights @ weights))


@pytest.mark.parametrize(("length", "found"), [(1, 1), (2, 2), (3, 3), (4, 0)])
def test_up_to_three_readings_are_one_spike(length: int, found: int) -> None:
    values = np.zeros(400)
    values[100 : 100 + length] = 1.0
    bad = outliers(values, 0.01)
    assert bad.sum() == found
    if found:
        assert np.flatnonzero(bad).tolist() == list(range(100, 100 + length))


def test_few_readings_have_no_outliers_and_those_at_the_ends_none() -> None:
    assert not outliers(np.array([0.0, 0.0, 9.0, 0.0, 0.0]), 0.1).any()
    assert outliers(np.array([0.0, 0.0, 9.0, 0.0, 0.0, 0.0]), 0.1).tolist() == [False, False, True, False, False, False]
    ends = np.zeros(50)
    ends[[0, 1, -1, -2]] = 9.0
    assert not outliers(ends, 0.1).any()


def test_spikes_of_more_than_a_fiftieth_are_a_fault_of_the_channel() -> None:
    for count, found in ((11, 11), (12, 0)):
        values = np.zeros(400)
        values[10 : 10 + 30 * count : 30] = 1.0
        assert outliers(values, 0.01).sum() == found


def test_outliers_become_gaps_and_are_counted_by_trial_and_channel() -> None:
    values = np.zeros(60)
    values[[20, 40]] = 1.0
    kept = screened([trial(u=values, r=values[::-1] * 0.0)], {"u": 0.01, "r": 0.01, "v_m": 0.01})
    assert kept.rejected == {"a": {"u": 2}}
    assert np.flatnonzero(np.isnan(kept.trials[0]["u"])).tolist() == [20, 40]
    assert not np.isnan(kept.trials[0]["r"]).any()


# --- what acts between two readings ---


def still_open(moves: Any, level: float, span: Any = None) -> np.ndarray:
    moves = np.array(moves, dtype=float)[None, :, None]
    span = np.ones((moves.shape[1], 1)) if span is None else np.array(span, dtype=float)[:, None]
    return _open(moves, span, np.array([level]))[0, :, 0]


@pytest.mark.parametrize("share", [0.2, 0.5, 0.7])
def test_a_rudder_that_stops_between_two_readings_has_another_mean_than_the_line(share: float) -> None:
    """It moves at 2 a row until `share` of the interval: its mean less that of the straight line, by integration."""
    u = (np.arange(100_000) + 0.5) / 100_000
    true = np.minimum(2.0 * u, 2.0 * share).mean()
    assert still_open([2.0, 2.0 * share, 0.0], 0.1)[1] == pytest.approx(true - share, abs=1e-6)
    assert still_open([0.0, 2.0 * share, 2.0], 0.1)[1] == pytest.approx(
        abs(np.maximum(2.0 * (u - 1.0 + share), 0.0).mean() - share), abs=1e-6)


def test_a_move_within_one_interval_may_come_at_any_time_of_it() -> None:
    """A step of 3 at a uniform time leaves 3 / root 12, over however many rows."""
    assert still_open([0.0, 3.0, 0.0], 0.1)[1] == pytest.approx(3.0 / math.sqrt(12.0))
    assert still_open([0.0, -3.0, 0.0], 0.1)[1] == pytest.approx(3.0 / math.sqrt(12.0))
    assert still_open([0.0, 3.0, 0.0], 0.1, [1, 4, 2])[1] == pytest.approx(3.0 / math.sqrt(12.0))
    assert still_open([4.0, 0.0, 4.0], 0.1)[1] == pytest.approx(4.0 / math.sqrt(12.0))  # it rests within
    assert still_open([2.0, 2.0, 2.0], 0.1).tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(("times", "told"), [(7.01, True), (6.99, False)])
def test_a_bend_is_more_than_noise_from_seven_noises_on(times: float, told: bool) -> None:
    for moves in ([0.0, times, 0.0], [times, 0.5 * times, 0.0]):
        assert bool(still_open(moves, 1.0)[1] > 0.0) is told


def means_of(values: np.ndarray) -> np.ndarray:
    return (0.5 * (values[1:] + values[:-1]))[None, :, None]


def test_moves_are_found_from_the_means_of_two_rows() -> None:
    """A rudder that is laid over within one row and turned back at a steady rate later."""
    values = np.zeros(40)
    values[11:] = 3.0
    values[25:] = 3.0 - 0.4 * np.minimum(np.arange(15.0), 5.0)
    found = between_rows(means_of(values), np.array([0.01]))[0, :, 0]
    assert found.shape == (39,)
    assert found[10] == pytest.approx(3.0 / math.sqrt(12.0), rel=1e-6)
    assert np.flatnonzero(found > 1e-9).tolist() == [10]
    alone = between_rows(means_of(values[:6]), np.array([0.01]))
    assert not alone.any()
    assert not between_rows(np.ones((1, 5, 1)), np.array([0.0])).any()


def test_where_a_control_is_read_seldom_its_moves_are_those_between_its_readings() -> None:
    """Readings each third row, joined by lines: a step of 3 between two of them is open in all three rows."""
    values = np.interp(np.arange(43), np.arange(0, 43, 3), np.where(np.arange(0, 43, 3) > 18, 3.0, 0.0))
    read = np.zeros((1, 42, 1), dtype=bool)
    read[0, ::3, 0] = True
    found = between_rows(means_of(values), np.array([0.01]), read)[0, :, 0]
    assert np.flatnonzero(found > 1e-9).tolist() == [18, 19, 20]
    assert found[18] == pytest.approx(3.0 / math.sqrt(12.0), rel=1e-6)


@pytest.mark.parametrize("length", [1, 2, 3])
def test_weights_of_the_neighbours_give_any_cubic_between_them(length: int) -> None:
    def cubic(t: float) -> float:
        return 2.0 - t + 0.5 * t**2 - 0.3 * t**3

    beside = [cubic(t) for t in (-2.0, -1.0, length, length + 1.0)]
    found = [float(weights @ beside) for weights in _cubic(length)]
    assert found == pytest.approx([cubic(k) for k in range(length)])


def test_what_is_clipped_is_clipped_until_no_more_lies_beyond() -> None:
    """Of 100 ones with one value of 50 and one of 6 the first bound holds the 6 in, the second leaves it out."""
    values = np.append(np.where(np.arange(100) % 2, 1.0, -1.0), [50.0, 6.0])
    assert _clipped(values) == pytest.approx(1.0)
    assert _clipped(np.ones(10)) == 1.0
    assert _clipped(np.zeros(4)) == 0.0


@pytest.mark.parametrize("substeps", [1, 2])
@pytest.mark.parametrize("apart", [1, 4])
def test_draws_of_the_inputs_have_their_noise_and_controls_act_as_means_of_two_rows(substeps: int, apart: int) -> None:
    """A control of noise s that acts as the mean of two readings has s^2 / 2 and half of that from row to row."""
    rows, lanes = 400, 3
    log = trial(n_P=10.0 + white(rows, 0.02, 1), delta=white(rows, 0.01, 2), U_T=5.0 + 0 * np.arange(rows),
                gamma_T=white(rows, 0.01, 4))  # fmt: skip
    series = np.zeros((lanes, rows * substeps, 2 + len(CHANNELS)))
    read = np.zeros((lanes, rows, 2), dtype=np.bool_)
    read[:, ::apart] = True
    cut = SimpleNamespace(series=series, read=read, dt=1.0 / substeps)
    posed: Any = SimpleNamespace(trials=[log], ship=SimpleNamespace(model=MODEL))
    draws = np.array(_draws(SimpleNamespace(windows=cut), posed))[:, :, ::substeps]  # type: ignore[arg-type]
    assert draws.shape == (16, lanes, rows, 2 + len(CHANNELS))
    for k, level in enumerate((0.02, 0.01)):
        one = draws[..., k]
        if apart == 1:
            assert one.std() == pytest.approx(level / math.sqrt(2.0), rel=0.15)
            assert np.mean(one[..., 1:] * one[..., :-1]) / np.mean(one**2) == pytest.approx(0.5, abs=0.05)
        else:  # straight lines between readings
            assert np.mean(one[..., 1:] * one[..., :-1]) / np.mean(one**2) > 0.8
    wind = draws[..., 2 + CHANNELS.index("wind_y")]
    assert wind.std() == pytest.approx(0.05, rel=0.15)
    assert abs(np.mean(wind[..., 1:] * wind[..., :-1])) < 0.02 * np.mean(wind**2)
