"""Figures read off runs that are drawn by hand: executes, crossings, ways, holds, and the curves of spirals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from simple_ships import SETTINGS, L

from seatrial.data import DataError, Trial
from seatrial.manoeuvres import reading
from seatrial.manoeuvres.pull_out import PullOut
from seatrial.manoeuvres.reverse_spiral import ReverseSpiral
from seatrial.manoeuvres.steady import waited

DEGREE = math.radians(1.0)


def drawn(t: np.ndarray, **channels: np.ndarray) -> Trial:
    return Trial("drawn", t, {name: np.broadcast_to(value, t.shape).astype(float) for name, value in channels.items()})


def test_a_level_is_reached_between_rows_and_read_there() -> None:
    values = np.array([0.0, 1.0, 3.0, 2.0])
    assert reading.reached(values, 2.0) == 1.5
    assert reading.reached(values, 3.0) == 2.0
    assert reading.reached(values, 0.0) == 0.0
    assert reading.reached(values, 3.1) is None
    assert [reading.at(values, row) for row in (0.0, 0.25, 1.5, 2.5, 3.0)] == [0.0, 0.25, 2.0, 2.5, 2.0]
    assert reading.rms(np.array([3.0, math.nan, -4.0])) == pytest.approx(math.sqrt(12.5))
    length = reading.in_lengths(250.0, 100.0)
    assert (length.value, length.unit, length.over_L) == (250.0, "m", 2.5)


def test_a_track_is_in_axes_of_the_first_heading() -> None:
    """A quarter circle of 50 m to starboard from any heading: 50 m along, 50 m across, and a heading over north."""
    turn = np.linspace(0.0, 0.5 * math.pi, 91)
    for psi in (0.0, 2.9, -1.0):
        ahead, aside = 50.0 * np.sin(turn), 50.0 * (1.0 - np.cos(turn))
        x = 7.0 + math.cos(psi) * ahead - math.sin(psi) * aside
        y = -3.0 + math.sin(psi) * ahead + math.cos(psi) * aside
        wrapped = np.mod(psi + turn + math.pi, math.tau) - math.pi
        run = drawn(turn * 20.0, x=x, y=y, psi=wrapped)
        along, across = reading.track(run)
        assert along == pytest.approx(ahead, abs=1e-9)
        assert across == pytest.approx(aside, abs=1e-9)
        assert reading.turned(run) == pytest.approx(turn, abs=1e-12)
        assert reading.yaw_rate(run) == pytest.approx(0.05)
        assert reading.path_length(run) == pytest.approx(50.0 * turn, rel=1e-4)
    assert reading.yaw_rate(drawn(turn, psi=turn, r=0.3)) == pytest.approx(0.3)


def test_a_way_is_that_of_the_places_or_of_the_speed_and_gaps_are_bridged() -> None:
    t, nan = np.arange(6.0), math.nan
    u = np.array([0.0, 2.0, nan, 6.0, 8.0, 10.0])
    assert reading.path_length(drawn(t, u=u)) == pytest.approx([0.0, 1.0, 5.0, 9.0, 16.0, 25.0])
    assert reading.path_length(drawn(t, u=-u)) == pytest.approx([0.0, 1.0, 5.0, 9.0, 16.0, 25.0])
    assert reading.path_length(drawn(t, u=3.0, v_m=-4.0)) == pytest.approx(5.0 * t)
    x = np.array([0.0, 3.0, nan, 9.0, 12.0, 15.0])
    assert reading.path_length(drawn(t, x=x, y=4.0 * t, u=99.0)) == pytest.approx(5.0 * t)
    assert np.isnan(reading.path_length(drawn(t, u=nan))).all()
    assert reading.complete_rows(drawn(t, u=u, x=x), ("u", "x")).t == pytest.approx([0.0, 1.0, 3.0, 4.0, 5.0])
    with pytest.raises(DataError, match="fewer than two samples know all of u, x"):
        reading.complete_rows(drawn(t, u=u, x=np.where(t == 1.0, 1.0, nan)), ("u", "x"))


def test_a_current_is_taken_off_in_ship_axes() -> None:
    """Two knots towards east, of a ship that heads east and one that heads north."""
    for psi, wanted in ((0.5 * math.pi, (4.0, 0.5)), (0.0, (5.0, -0.5))):
        u, v = reading.through_water(drawn(np.arange(2.0), u=5.0, v_m=0.5, psi=psi, U_C=1.0, gamma_C=0.5 * math.pi))
        assert (u[0], v[0]) == pytest.approx(wanted)
    bare = reading.through_water(drawn(np.arange(2.0), u=5.0, v_m=0.5, psi=0.0, U_C=1.0))
    assert (bare[0][0], bare[1][0]) == (5.0, 0.5)


def test_a_run_begins_at_its_order_or_at_the_foot_of_its_rudder() -> None:
    t = np.arange(0.0, 20.0)
    step = np.where(t < 5.0, 0.0, 0.35)
    ramp = np.clip(0.07 * (t - 4.0), 0.0, 0.35)
    assert reading.after(drawn(t, delta_cmd=step, delta=ramp, psi=0.0), 0.35).t[0] == 5.0
    assert reading.after(drawn(t, delta=ramp, psi=0.0), 0.35).t[0] == 4.0
    assert reading.after(drawn(t, delta=-ramp, psi=0.0), -0.35).t[0] == 4.0
    assert reading.after(drawn(t, delta=0.35, psi=0.0), 0.35).t[0] == 0.0
    twitch = np.where(t == 2.0, 0.016, ramp)  # less than a twentieth of the angle
    assert reading.after(drawn(t, delta=twitch, psi=0.0), 0.35).t[0] == 4.0
    with pytest.raises(DataError, match="never leaves"):
        reading.after(drawn(t, delta=0.016 * (t == 2.0), psi=0.0), 0.35)
    assert [reading.rudder_channel(drawn(t, **{name: t})) for name in ("delta_1", "delta_1_cmd", "u")] == [
        "delta_1", "delta_1_cmd", "delta"]  # fmt: skip
    assert reading.helm_channel(drawn(t, delta_cmd=t, delta_1=t)) == "delta_1"


def test_holds_are_stretches_within_a_width_that_last() -> None:
    t = np.arange(0.0, 300.0, 0.5)
    level = np.where(t < 100.0, 1.0, np.where(t < 130.0, 2.0, 3.0))
    noisy = level + 0.05 * np.random.default_rng(1).standard_normal(t.size)
    for values in (level, noisy):
        found = reading.holds(t, values, 0.4, 60.0)
        assert [round(float(values[part].mean())) for part in found] == [1, 3]
        ends = [(t[part.start], t[part.stop - 1]) for part in found]
        assert ends[0] == pytest.approx((0.0, 100.0 - 3.0), abs=1.6)
        assert ends[1] == pytest.approx((130.0 + 3.0, 299.5), abs=1.6)
    assert len(reading.holds(t, level, 0.4, 20.0)) == 3
    assert reading.holds(t[:1], level[:1], 0.4, 20.0) == []
    assert reading.last_seconds(t, slice(0, 200), 10.0) == slice(179, 200)
    assert reading.last_seconds(t, slice(0, 200), 10.0, before=20.0) == slice(139, 160)
    assert reading.last_seconds(t, slice(195, 200), 10.0) == slice(195, 200)


def test_a_turn_is_steady_after_two_calm_windows_in_a_row() -> None:
    memory = (0.0, 0.0, 0.0)
    rates = [0.01, 0.0105, 0.01055, 0.0106, 0.02, 0.02, 0.02]
    told = []
    for k, r in enumerate(rates, 1):
        assert waited(10.0 * k - 5.0, 9.0, memory, 10.0, 1e-4)[1] == memory  # within a window nothing is judged
        steady, memory = waited(10.0 * k, r, memory, 10.0, 1e-4)
        assert memory[:2] == (10.0 * k, r)
        told.append(bool(steady))
    assert told == [False, False, False, True, False, False, True]


def stairs(levels: np.ndarray, rudder: np.ndarray, seconds: float) -> Trial:
    """A run that holds each yaw rate in turn, each with its rudder."""
    t = np.arange(0.0, seconds * levels.size, 1.0)
    k = np.minimum((t / seconds).astype(int), levels.size - 1)
    return drawn(t, r=levels[k], delta=rudder[k], psi=np.cumsum(levels[k]))


@pytest.mark.parametrize("alpha", [9e4, 4e4])
def test_the_curve_of_an_unstable_ship_has_its_loop(alpha: float) -> None:
    """Rudder K delta = alpha r^3 - r + e: folds at r = (3 alpha)^-1/2, midships at alpha^-1/2, neutral at -e."""
    policy = replace(ReverseSpiral.ordered(SETTINGS), rate=0.01, step=0.0005)
    r = np.arange(0.01, -0.0101, -0.0005)
    run = stairs(r, (alpha * r**3 - r) / 0.05, 7.0 * policy.window)
    found = {name: index.value for name, index in policy.indices(run, L).items()}
    fold = 2.0 / (3.0 * math.sqrt(3.0 * alpha)) / 0.05
    assert found["loop_width"] == pytest.approx(2.0 * fold, rel=5e-3)
    assert found["loop_height"] == pytest.approx(2.0 / math.sqrt(alpha), rel=1e-2)  # straight between two points
    assert found["slope"] == pytest.approx((alpha * 0.0005**2 - 1.0) / 0.05, rel=1e-9)
    assert found["neutral_rudder"] == pytest.approx(0.0, abs=1e-12)
    shifted = policy.indices(stairs(r, (alpha * r**3 - r + 1e-4) / 0.05, 7.0 * policy.window), L)
    assert shifted["neutral_rudder"].value == pytest.approx(1e-4 / 0.05, rel=1e-6)
    assert shifted["neutral_rudder"].helm == 1
    assert policy.complete(run)
    assert not policy.complete(run.rows(slice(0, len(run) - round(1.1 * policy.window))))
    line = policy.indices(stairs(r, r / 0.05, 7.0 * policy.window), L)
    assert line["slope"].value == pytest.approx(20.0)
    assert line["loop_width"].value == line["loop_height"].value == 0.0


def test_a_pull_out_leaves_the_mean_rate_of_its_last_window() -> None:
    policy = PullOut.ordered(SETTINGS)
    window = policy.window
    parts = ((policy.delta, 0.02), (0.0, 0.003), (-policy.delta, -0.02), (0.0, -0.001))
    rudder, rates = (np.array(column) for column in zip(*parts, strict=True))
    run = stairs(rates, rudder, 4.0 * window)
    tail = run.t > 8.0 * window - 0.5 * window - 1.0
    r = run["r"].copy()
    r[(run.t < 8.0 * window) & tail] += 0.001  # half of the last window turns faster
    run = run.having(r=r)
    found = {name: index.value for name, index in policy.indices(run, L).items()}
    assert found["residual_rate_starboard"] == pytest.approx(0.0035, abs=1.5e-4)  # less what is blurred at its end
    assert found["residual_rate_port"] == pytest.approx(-0.001)
    assert found["residual_difference"] == pytest.approx(found["residual_rate_starboard"] + 0.001)
    assert policy.complete(run)
    assert not policy.complete(run.rows(slice(0, round(14.0 * window))))
