"""Kinds told by the rudder, leg by leg: alternating angles, turns to both sides, what follows a turn, spirals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.data import Array, Trial
from seatrial.data.check.repairs import Suspect, times
from seatrial.data.check.suspects import _third_witness, _told
from seatrial.data.kinds.kind import Kind
from seatrial.data.kinds.signals import Hold, Signals
from seatrial.data.kinds.steering import (
    _alike,
    _alternating,
    _both_sides,
    _initial,
    _midships_after,
    _peaks,
    _pulled,
    _quick,
    _recovery,
    _reversed,
    _weaving,
    spiral,
    zigzag,
)

DEGREE = math.pi / 180.0
T = np.arange(400.0)


def seen(**given: Any) -> Signals:
    still: dict[str, Any] = {"psi": 0.0, "r": 0.0, "u": 1.0, "v_m": 0.0, "delta": None, "n": None, **given}
    wide = {name: value if value is None else np.broadcast_to(np.asarray(value, dtype=np.float64), T.size)
            for name, value in still.items() if name != "clock"}  # fmt: skip
    return Signals(T, reach=None, L_pp=50.0, clock=given.get("clock", 8.0), **wide)


def holds(*legs: tuple[int, int, float]) -> list[Hold]:
    """Held angles [deg] from row to row."""
    return [Hold(a, b, level * DEGREE) for a, b, level in legs]


def test_angles_are_alike_within_a_fifth_or_a_degree_and_a_half() -> None:
    assert _alike(holds((0, 9, 10.0), (10, 19, -11.9)))
    assert not _alike(holds((0, 9, 10.0), (10, 19, -12.3)))  # 2.3 of 11.15
    assert _alike(holds((0, 9, 3.0), (10, 19, -4.4)))
    assert not _alike(holds((0, 9, 3.0), (10, 19, -4.6)))


def test_a_rudder_goes_over_at_once_within_two_clocks_or_half_of_what_it_was_held() -> None:
    ship = seen()
    for after, quick in ((25, True), (26, False)):  # 16 s from 10
        assert _quick(ship, *holds((0, 10, 5.0), (after, 60, -5.0))) == quick
    for after, quick in ((149, True), (151, False)):  # half of 100 s
        assert _quick(ship, *holds((0, 100, 5.0), (after, 200, -5.0))) == quick


def test_the_longest_run_of_alternating_angles_is_taken() -> None:
    legs = holds((0, 10, 20.0), (12, 20, -20.0), (22, 30, 20.0), (32, 40, 1.4), (42, 50, -20.0), (90, 99, 20.0),
                 (101, 110, -20.0), (112, 120, -20.0))  # fmt: skip
    found = _alternating(seen(), legs)
    assert [one.first for one in found] == [0, 12, 22, 42]  # midships between is no leg
    assert [one.first for one in _alternating(seen(), legs[5:])] == [90, 101]
    assert len(_alternating(seen(), holds((0, 10, 20.0), (12, 20, 20.0)))) == 1
    assert len(_alternating(seen(), holds((0, 10, 20.0), (12, 20, -30.0), (22, 30, 30.0)))) == 2


def test_a_heading_that_swings_evenly_weaves() -> None:
    def swing(size: Array | float) -> Array:
        return size * DEGREE * np.sin(2.0 * np.pi * (T + 0.3) / 80.0)

    found = _weaving(seen(psi=1.0 + swing(10.0)))
    assert found is not None
    assert (found.settings["side"], "swings 8 times by 10 deg" in found.evidence[0]) == (-1.0, True)
    assert _peaks(swing(10.0)) == [60, 100, 140, 180, 220, 260, 300, 340]
    assert _weaving(seen(psi=swing(1.9))) is None
    assert _weaving(seen(psi=swing(2.1))) is not None
    assert _weaving(seen(psi=swing(61.0))) is None  # 120 deg in all
    assert _weaving(seen(psi=swing(59.0))) is not None
    assert _weaving(seen(psi=swing(np.where(T < 200, 10.0, 13.0)))) is not None
    assert _weaving(seen(psi=swing(np.where(T < 200, 10.0, 15.0)))) is None
    assert _weaving(seen(psi=np.where(T < 160, swing(10.0), 0.0))) is None


def test_midships_after_a_turn_lasts_a_length_and_follows_within_three() -> None:
    turn = Hold(0, 100, 20.0 * DEGREE)

    def after(first: int, last: int, level: float = 0.0, **more: Any) -> bool:
        delta = np.where((first <= T) & (last >= T), level, np.where(T <= 100, 20.0, 0.5 * T % 37)) * DEGREE
        ship = seen(delta=delta, **more)
        object.__setattr__(ship, "holds", tuple(holds((0, 100, 20.0), (first, last, level))))
        return _midships_after(ship, turn) is not None

    assert after(110, 150)
    assert after(124, 150)  # three clocks
    assert not after(125, 150)
    assert after(110, 118)
    assert not after(110, 117)  # a clock
    assert after(110, 150, 1.9)  # a tenth of the angle
    assert not after(110, 150, 2.1)
    assert after(110, 150, n=np.where(T <= 100, 2.0, 1.65))
    assert not after(110, 150, n=np.where(T <= 100, 2.0, 1.55))  # a fifth of the revolutions


def test_a_turn_that_counter_rudder_meets_is_no_pull_out() -> None:
    turn = Hold(0, 100, 20.0 * DEGREE)
    for met, pulled in ((12.0, True), (-12.0, False)):
        ship = seen(delta=np.where(T <= 100, 20.0, np.where((T > 104) & (T < 112), met, 0.0)) * DEGREE)
        object.__setattr__(ship, "holds", tuple(holds((0, 100, 20.0), (105, 111, met), (114, 160, 0.0))))
        assert (_midships_after(ship, turn) is not None) == pulled


def _zigzag(back: float, backwards: bool) -> Signals:
    """Eight legs of 10 deg over headings of 10 deg; the last is broken off at 2 deg for a way back to a course."""
    at = [0, 20, 30, *range(50, 191, 20), 198, 218, 230]
    psi = np.interp(T, [*at, 399], [0, 0, 10, *([-10, 10] * 4), 2, 5, 5, 5])
    delta = np.select([T < 20, T < 30, T < 190, T < 198, T < 218],
                      [0.0, 10.0, np.where((T - 30) // 20 % 2 == 0, -10.0, 10.0), -10.0, back], 0.0)  # fmt: skip
    if backwards:  # the way onto the first course, in place of one back to it
        psi, delta = psi[::-1], -delta[::-1]
    return seen(psi=psi * DEGREE, delta=delta * DEGREE)


@pytest.mark.parametrize("back", [0.0, 10.0, 9.0])
@pytest.mark.parametrize("backwards", [False, True])
def test_a_way_back_to_a_course_with_the_rudder_of_the_legs_is_no_leg(back: float, backwards: bool) -> None:
    found = zigzag(_zigzag(back, backwards))
    assert found is not None
    assert found.settings["rudder"] == pytest.approx(10.0 * DEGREE, rel=0.02)
    assert found.settings["heading"] == pytest.approx(10.0 * DEGREE, abs=1.01 * DEGREE)  # a row


def test_two_legs_that_end_elsewhere_are_no_zigzag() -> None:
    ship = _zigzag(10.0, backwards=False)
    wild = np.interp(T, [0, *range(30, 191, 20), 399], [0, 10, -10, 40, -10, 10, -40, 10, -10, 9, 9])
    assert zigzag(seen(psi=wild * DEGREE, delta=ship.delta)) is None


def test_what_follows_a_turn_names_it() -> None:
    out = Kind("turning", {"rudder": 0.3})
    rest = Hold(200, 260, 0.0)
    assert _pulled(seen(), out, rest, 539.0 * DEGREE).name == "pull-out"
    assert _pulled(seen(), out, rest, 541.0 * DEGREE).name == "turning"
    assert "midships for 60 s" in _pulled(seen(), out, rest, 1.0).evidence[0]
    psi = np.minimum(T, 50.0) * DEGREE
    for last, doubt in ((359, False), (358, True)):  # a tenth of the rows at the end
        assert bool(_initial(seen(psi=psi), Hold(0, last, 0.2), out, 50.0 * DEGREE).doubts) == doubt
    assert _initial(seen(psi=psi), Hold(0, 399, 0.2), out, 91.0 * DEGREE).doubts
    assert not _initial(seen(psi=psi), Hold(0, 399, 0.2), out, -89.0 * DEGREE).doubts
    assert _initial(seen(psi=psi), Hold(0, 399, 0.2), out, 0.0).settings["heading"] == pytest.approx(50.0 * DEGREE)


def test_two_turns_to_either_side_are_a_pull_out_or_a_recovery() -> None:
    psi = np.interp(T, [0, 150, 200, 350], [0, 100, 100, 0]) * DEGREE
    legs = holds((0, 150, 20.0), (200, 350, -20.0))
    ship = seen(psi=psi)
    object.__setattr__(ship, "holds", tuple(legs))
    found = _both_sides(ship, legs)
    assert found is not None
    assert (found.name, found.settings["side"]) == ("recovery", 1.0)
    assert _both_sides(ship, [legs[0], Hold(200, 350, 20.0 * DEGREE)]) is None
    assert _both_sides(seen(psi=0.89 * psi), legs) is None  # 89 deg
    assert _both_sides(ship, [legs[0], Hold(200, 350, -30.0 * DEGREE)]) is None
    assert _reversed(ship, legs[1], legs) == tuple(legs)  # 50 s after one of 150 s
    assert _reversed(ship, legs[1], [Hold(0, 90, legs[0].level), legs[1]]) is None
    for whole, doubt in ((151.0, False), (149.0, True), (209.0, False), (-211.0, True)):
        turned = seen(psi=np.linspace(0.0, whole * DEGREE, 400))
        assert bool(_recovery(turned, *holds((0, 100, 20.0), (110, 300, -21.0))).doubts) == doubt
    assert _recovery(turned, *holds((0, 100, -20.0), (110, 300, 21.0))).settings == {
        "rudder": pytest.approx(21.0 * DEGREE), "side": -1.0
    }  # fmt: skip


def steps(levels: list[float], rows: int) -> Array:
    return np.repeat(np.array(levels), rows)[:400] * DEGREE


def test_a_spiral_has_seven_steady_turns_from_side_to_side() -> None:
    def run(levels: list[float], rate: float = 0.5) -> Kind | None:
        rows = math.ceil(400 / len(levels))
        return spiral(seen(delta=steps(levels, rows), psi=rate * DEGREE * T, r=0.001 * np.sin(T)))

    whole = run([20.0, 14.0, 8.0, 2.0, -4.0, -10.0, -16.0, -20.0])
    assert whole is not None
    assert whole.settings["rudder"] == pytest.approx(20.0 * DEGREE)
    assert whole.evidence[0].startswith("8 rudder angles held one after another between -20 and 20 deg")
    assert run([20.0, 14.0, 8.0, 2.0, -4.0, -10.0, -16.0, -20.0], -0.5) is not None  # to port
    assert run([20.0, 10.0, 5.0, -5.0, -10.0, -20.0]) is None  # six
    assert run([20.0, 17.0, 14.0, 8.0, 2.0, -3.0, -5.0]) is None  # to one side only: a quarter of the greatest
    assert run([20.0, 17.0, 14.0, 8.0, 2.0, -3.0, -7.0]) is not None
    assert run([20.0, 14.0, 8.0, 2.0, -4.0, -10.0, -16.0, -20.0], 0.25) is None  # 12 deg a turn
    assert run([20.0, 10.0, 0.0, 10.0, 0.0, -10.0, -20.0, -10.0, -20.0]) is None  # it changes its way too often
    assert run([20.0, -20.0, 20.0, -20.0, 20.0, -20.0, 20.0, -20.0]) is None


# -- suspects that explain the same


def suspect(key: str, *channels: str, **more: Any) -> Suspect:
    return Suspect(key, channels, f"{channels[0]} is odd", times(2.0, *channels), "quality", **more)


def test_suspects_that_explain_the_same_are_told_together() -> None:
    one, two = suspect("a", "psi", evidence="first"), suspect("b", "r", evidence="second", grave=False)
    told = _told([one, two], 12.0, 0.25)
    assert (told.severity, told.where, told.what, told.key) == ("error", "psi, r", "psi is odd or r is odd", "a")
    assert told.evidence == (
        "first; second; track, heading, rates and speeds differ by 12 times their noise, by 3 after"
    )
    assert "multiply r by 2" in str(told.remedy)
    assert _told([two], 12.0, 0.25).severity == "warning"


@pytest.mark.parametrize(("pivot", "channels"), [(0.11, "x"), (0.09, "u"), (0.79, "x"), (0.81, "u")])
def test_a_pivot_ahead_of_midship_tells_the_antenna_from_the_log(pivot: float, channels: str) -> None:
    t = np.arange(60.0)
    r = 0.02 + 1e-4 * np.sin(t)
    trial = Trial("a", t, {"r": r, "v_m": -pivot * 50.0 * r}, meta={"L_pp": 50.0})
    both = [suspect("lever_arm", "x", "y"), suspect("lever_arm", "u", "v_m")]
    assert [one.channels[0] for one in _third_witness([trial], both)] == [channels]
    assert _third_witness([Trial("a", t, {})], both) == both[:1]
    scales = [suspect("log_scale", "u"), suspect("time_scale", "t")]
    assert _third_witness([trial], scales) == scales[:1]
    assert _third_witness([trial], scales[::-1]) == scales[::-1]
