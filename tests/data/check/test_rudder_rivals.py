"""A rudder that contradicts the yaw: its sign, a delay, an indicator that sticks, or mirrored axes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from seatrial.data import Array, Trial
from seatrial.data.check import Finding, check_folder
from seatrial.data.check.controls.effect import effect
from seatrial.data.check.controls.rudder import helm_faults
from seatrial.data.prepare import mended, to_earth

L, U, DT = 98.1, 5.0, 1.0  # a ship time is 3.162 s
K, LAG = 0.06, 9.0
Change = Callable[[Trial], Trial]


def ran(name: str, helm: Callable[[float, float], float], psi: float, witness: bool, seconds: float = 600.0) -> Trial:
    """A ship of Nomoto's first order with a rudder of 4 deg/s, its instruments noisy; wind and course are witnesses."""
    t = np.arange(0.0, seconds, DT)
    delta, r, course = 0.0, 0.0, psi
    rows: list[tuple[float, float, float]] = []
    for now in t:
        rows.append((delta, r, course))
        order = helm(now, course - psi)
        delta += min(max(order - delta, -0.07 * DT), 0.07 * DT)
        before, r = r, r + DT * (K * delta - r) / LAG
        course += 0.5 * DT * (before + r)
    steered, rate, heading = (np.array(one) for one in zip(*rows, strict=True))
    random = np.random.default_rng(len(name))
    u, v = np.full(t.size, U), -30.0 * rate
    north, east = to_earth(u, v, heading)
    x, y = (np.concatenate([[0.0], np.cumsum(0.5 * DT * (part[1:] + part[:-1]))]) for part in (north, east))
    noise = {"x": 0.1, "y": 0.1, "psi": 1e-3, "u": 0.02, "v_m": 0.02, "r": 2e-4, "delta": 1e-3}
    true = {"x": x, "y": y, "psi": heading, "u": u, "v_m": v, "r": rate, "delta": steered}
    table = {n: values + noise[n] * random.standard_normal(t.size) for n, values in true.items()}
    if witness:
        table |= {"gamma_G": np.arctan2(east, north), "U_G": np.hypot(north, east)}
    return Trial(name, t, table, {}, {"L_pp": L})


def zigzag(degrees: float, side: int) -> Callable[[float, float], float]:
    state = [float(side)]

    def helm(t: float, turned: float) -> float:
        if t < 40.0:
            return 0.0
        if state[0] * turned >= math.radians(degrees):
            state[0] = -state[0]
        return state[0] * math.radians(degrees)

    return helm


def day(witness: bool = True) -> list[Trial]:
    return [
        ran("zigzag_10", zigzag(10.0, 1), 0.4, witness), ran("zigzag_20", zigzag(20.0, -1), 2.0, witness),
        ran("turn_20", lambda t, _: 0.35 if t > 30.0 else 0.0, 3.5, witness),
        ran("turn_10", lambda t, _: -0.2 if t > 50.0 else 0.0, 5.5, witness),
    ]  # fmt: skip


def late(seconds: float) -> Change:
    return lambda one: one.having(delta=np.interp(one.t - seconds, one.t, one["delta"]))


def stuck(first: float, last: float) -> Change:
    """Stuck without noise."""

    def change(one: Trial) -> Trial:
        inside = (one.t >= first) & (one.t <= last)
        return one.having(delta=np.where(inside, one["delta"][inside][0], one["delta"]))

    return change


def mirrored(one: Trial) -> Trial:
    """All of the motion in axes east and north, headings and rates counterclockwise, sway to port."""
    return one.having(x=one["y"], y=one["x"], psi=0.5 * np.pi - one["psi"], v_m=-one["v_m"], r=-one["r"])


def west(one: Trial) -> Trial:
    return one.having(y=-one["y"], psi=-one["psi"], v_m=-one["v_m"], r=-one["r"])


def turned(one: Trial) -> Trial:
    return one.having(delta=-one["delta"])


def told(trials: list[Trial]) -> list[Finding]:
    return [one for one in check_folder(trials) if one.severity != "info"]


def off(a: Trial, b: Trial, name: str) -> float:
    """Root mean square of the difference over that of the channel, at the times of the first; of angles by a turn."""
    there = np.interp(a.t, b.t, b[name])
    gap: Array = a[name] - there
    if name == "psi":
        gap = (gap + np.pi) % (2.0 * np.pi) - np.pi
    return float(np.sqrt(np.mean(gap**2) / np.mean(there**2)))


CAUSES: dict[str, tuple[Change, str]] = {
    "sign": (turned, "sign"), "late": (late(18.0), "lag"), "early": (late(-18.0), "lag"), "late_9": (late(9.0), "lag"),
    "stuck": (stuck(200.0, 420.0), "frozen"), "east_north": (mirrored, "axes"), "north_west": (west, "axes"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("cause", CAUSES)
def test_the_cause_is_named_and_its_remedy_brings_the_truth_back(cause: str) -> None:
    change, key = CAUSES[cause]
    true = day()
    spoilt = [change(trial) for trial in true]
    [found] = told(spoilt)
    assert found.key == key
    again = [part for trial in spoilt for part in mended(trial, found.steps)]
    assert told(again) == []
    for trial in again:
        source = next(one for one in true if trial.name.startswith(one.name))
        for name in ("x", "y", "psi", "v_m", "r", "delta"):
            # half a row of delay, in a rudder that moves over in five; one that sticks while it is held over
            assert off(trial, source, name) < {"lag": 0.2, "frozen": 0.01}.get(key, 1e-6), name


@pytest.mark.slow
def test_a_right_day_is_left_alone_with_witnesses_and_without() -> None:
    for witness in (True, False):
        assert told(day(witness)) == []


@pytest.mark.slow
@pytest.mark.parametrize("change", [turned, mirrored])
def test_without_a_witness_sign_and_mirrored_axes_are_both_told_and_nothing_is_done(change: Change) -> None:
    [found] = told([change(trial) for trial in day(witness=False)])
    assert (found.severity, found.key, found.steps) == ("error", "sign", ())
    assert "x is east" in found.remedy
    assert "sign = -1 under delta" in found.remedy


@pytest.mark.slow
def test_latitude_and_longitude_are_a_witness() -> None:
    known = [Trial(one.name, one.t, dict(one.channels), {}, {"L_pp": L, "datum": {"latitude": 54.0, "longitude": 10.0}})
             for one in day(witness=False)]  # fmt: skip
    [found] = told([turned(trial) for trial in known])
    assert [step.amount for step in found.steps] == [(-1.0,)]


@pytest.mark.slow
def test_one_turn_against_its_rudder_among_right_ones_gets_no_remedy() -> None:
    """The rudder of one turn may be stuck, or another's; that of a zigzag shows that it is its sign."""
    trials = day()
    held = trials[3].rows(slice(150, None))
    [found] = told([*trials[:3], turned(held)])
    assert (found.key, found.trials, found.steps) == ("sign", ("turn_10",), ())
    [found] = told([turned(trials[0]), *trials[1:]])
    assert (found.key, found.trials) == ("sign", ("zigzag_10",))
    assert [(step.amount, step.trials) for step in found.steps] == [((-1.0,), ("zigzag_10",))]


@pytest.mark.slow
def test_a_rudder_that_is_askew_on_a_straight_course_is_not_turned_round() -> None:
    straight = ran("straight", lambda t, _: 0.0, 1.0, True)
    askew = [one.having(delta=one["delta"] + 0.14) for one in (*day(), straight)]
    assert "sign" not in {one.key for one in told(askew)}


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [6.3, 12.0, 25.0, -12.0])
def test_the_effect_of_a_rudder_tells_its_delay_within_a_ship_time(seconds: float) -> None:
    shown = effect([late(seconds)(trial) for trial in day()])
    assert shown is not None
    assert shown.late == pytest.approx(seconds, abs=1.2 * math.sqrt(L / 9.81))
    assert not shown.opposed


@pytest.mark.slow
def test_the_effect_of_a_rudder_of_the_other_sign_is_opposed_and_not_late() -> None:
    shown = effect([turned(trial) for trial in day()])
    assert shown is not None
    assert shown.opposed
    assert shown.late == 0.0
    right = effect(day())
    assert right is not None
    assert (right.opposed, right.late) == (False, 0.0)
    assert effect([ran("straight", lambda t, _: 0.0, 1.0, False, 15.0)]) is None


def slow(angle: float, heading: float, side: int) -> Trial:
    """A zigzag of a model of 3 m (a ship time is .553 s) at .8 m/s: first order, 4 s late, the rate with some noise."""
    step, rows = 0.02, list[tuple[float, ...]]()
    delta, r, psi, to, x, y = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(7500):
        if k * step > 10.0 and (to == 0.0 or to * psi > math.radians(heading)):
            to = -to or float(side)
        gap = to * math.radians(angle) - delta
        delta += min(max(gap, -0.26 * step), 0.26 * step)
        r += step * (0.12 * delta - r) / 4.0
        psi, x, y = psi + step * r, x + step * 0.8 * math.cos(psi), y + step * 0.8 * math.sin(psi)
        rows.append((k * step, x, y, psi, r, delta))
    t, x_, y_, psi_, r_, delta_ = np.array(rows[::5]).T
    noise = 9e-4 * np.random.default_rng(round(angle + heading)).standard_normal((2, t.size))
    table = {"x": x_, "y": y_, "psi": psi_, "u": np.full(t.size, 0.8), "v_m": 0.0 * t, "r": r_ + noise[0]}
    return Trial(f"{angle:g}_{heading:g}", t, {**table, "delta": delta_ + noise[1]}, {}, {"L_pp": 3.0})


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [0.0, 4.81, -3.0])
def test_a_lag_of_a_slow_hull_is_that_of_its_effect_and_not_of_what_a_quartic_fits_far_off(seconds: float) -> None:
    """The effect tells it to half its step and what hulls respond later by: 1.25 ship times."""
    run = [slow(10.0, 10.0, 1), slow(20.0, 20.0, -1), slow(10.0, 20.0, 1)]
    found = [fault for fault in helm_faults([late(seconds)(one) for one in run]) if fault.key == "lag"]
    assert len(found) == (seconds != 0.0)
    for fault in found:
        assert not isinstance(fault.remedy, str)
        [told_by] = fault.remedy.steps
        assert -told_by.amount[0] == pytest.approx(seconds, abs=1.25 * math.sqrt(3.0 / 9.81))
