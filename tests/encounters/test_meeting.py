"""Meetings against their geometry: a target that would meet the own ship is where a clock and a compass put it."""

from __future__ import annotations

import math
from itertools import combinations_with_replacement

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.encounters.meeting import Ranges, dnv, drawn, imazu, on_bearing, seen_from, shared, together
from seatrial.encounters.rules import Role

U, T = 7.0, 900.0
CLASSES = (Role.HEAD_ON, Role.OVERTAKING, Role.GIVE_WAY, Role.STAND_ON, Role.OVERTAKEN)


def test_all_ships_of_imazu_are_at_one_place_at_one_time() -> None:
    for one in imazu(U, T):
        assert np.allclose(one.x + one.U_target * T * np.cos(one.psi), U * T)
        assert np.allclose(one.y + one.U_target * T * np.sin(one.psi), 0.0, atol=1e-6)
        distance, t = one.approach
        assert np.allclose(distance, 0.0, atol=1e-6)
        assert np.allclose(t, T)


def test_a_ship_of_equal_speed_is_seen_at_half_its_course_from_abeam() -> None:
    """Distance 2 R sin(|psi|/2), bearing 90 - |psi|/2 on the side opposite to psi: the triangle has equal sides."""
    for one in imazu(U, T):
        equal = one.U_target == U
        psi = np.abs(one.psi[equal])
        assert np.allclose(np.hypot(one.x, one.y)[equal], 2.0 * U * T * np.sin(psi / 2))
        beta = one.bearings[0][equal]
        assert np.allclose(np.abs(beta), math.pi / 2 - psi / 2)
        oblique = psi < 3.0
        assert (np.sign(beta) == -np.sign(one.psi[equal]))[oblique].all()


def test_roles_of_the_first_four_problems() -> None:
    """Head-on, crossing from starboard, a slow ship ahead, crossing from port on a converging course."""
    assert [int(one.roles[0]) for one in imazu(U, T)[:4]] == [
        Role.HEAD_ON, Role.GIVE_WAY, Role.OVERTAKING, Role.STAND_ON]  # fmt: skip


def test_there_are_22_problems_and_21_are_distinct() -> None:
    rows = [tuple(sorted(zip(one.psi.round(6), one.U_target, strict=True))) for one in imazu(U, T)]
    assert [len(row) for row in rows] == [1] * 4 + [2] * 7 + [3] * 11
    assert len(set(rows)) == 21
    assert rows[14] == rows[21]


def test_situations_of_dnv_have_the_roles_bearings_and_times_of_their_table() -> None:
    found = dnv()
    assert [len(one.x) for one in found] == [1] * 5 + [2] * 15 + [3] * 35
    assert [int(one.roles[0]) for one in found[:5]] == [
        Role.HEAD_ON, Role.GIVE_WAY, Role.STAND_ON, Role.OVERTAKING, Role.OVERTAKEN]  # fmt: skip
    twelfth = found[11]
    assert np.degrees(twelfth.bearings[0]) == pytest.approx([45.0, -99.0])
    assert twelfth.approach[1] == pytest.approx([19 * 60.0, 16 * 60.0])
    assert twelfth.U_target / twelfth.U == pytest.approx([1.2, 1.3])
    for one in found:
        assert np.allclose(one.approach[0], 0.0, atol=1e-6)
        assert (one.roles != Role.NONE).all()


def test_each_three_of_five_roles_are_met_once_in_the_set_of_dnv() -> None:
    """With one, two and three targets: all 5, 15 and 35 ways to choose roles that may be alike."""
    found = [tuple(sorted(int(role) for role in one.roles)) for one in dnv()]
    ways = [tuple(sorted(int(role) for role in one)) for count in (1, 2, 3)
            for one in combinations_with_replacement(CLASSES, count)]  # fmt: skip
    assert sorted(found) == sorted(ways)
    last = dnv()[39]
    assert np.degrees(last.bearings[0]) == pytest.approx([10.0, -75.0, -100.0])
    assert last.approach[1] == pytest.approx([1200.0, 900.0, 1740.0])


@pytest.mark.parametrize("role", CLASSES)
def test_drawn_encounters_pass_as_far_and_when_they_were_drawn(role: Role) -> None:
    ranges = Ranges(T=(300.0, 500.0), miss=(50.0, 150.0))
    one = drawn([role], 400, U, 3, ranges)
    distance, t = one.approach
    assert one.x.shape == (400, 1)
    assert (one.roles == role).all()
    assert distance.min() >= 50.0 - 1e-6
    assert distance.max() <= 150.0 + 1e-6
    assert distance.std() > 15.0
    assert t.min() >= 300.0 - 1e-6
    assert t.max() <= 500.0 + 1e-6
    low, high = ranges.k[role]
    assert low <= (one.U_target / U).min()
    assert (one.U_target / U).max() <= high


def test_crossings_are_drawn_alike_from_both_sides() -> None:
    """GIVE_WAY and STAND_ON are mirror images: equal shares of |beta| below 45 deg, within the noise of counts."""
    share = [(np.abs(drawn([role], 4000, U, 5).bearings[0]) < math.pi / 4).mean()
             for role in (Role.GIVE_WAY, Role.STAND_ON)]  # fmt: skip
    assert abs(share[0] - share[1]) < 4.0 * math.sqrt(0.5 / 4000)


def test_the_first_rows_do_not_depend_on_the_count_and_targets_are_independent() -> None:
    few, many = (drawn([Role.HEAD_ON, Role.HEAD_ON], n, U, 9) for n in (7, 3000))
    assert np.array_equal(few.x, many.x[:7])
    assert np.array_equal(few.psi, many.psi[:7])
    assert abs(np.corrcoef(many.psi[:, 0] % 6.28, many.psi[:, 1] % 6.28)[0, 1]) < 0.1
    assert not np.array_equal(few.x, drawn([Role.HEAD_ON, Role.HEAD_ON], 7, U, 10).x)


def test_ships_on_nearly_one_course_begin_apart() -> None:
    """Of one course and speed, who meets in ten minutes is beside the ship from the start."""
    near, far = (drawn([Role.STAND_ON], 4000, U, 1, Ranges(apart=apart)) for apart in (0.0, 900.0))
    assert np.hypot(near.x, near.y).min() < 900.0
    assert np.hypot(far.x, far.y).min() >= 900.0
    kept = np.hypot(near.x, near.y)[:, 0] >= 900.0  # the others are left out and nothing else
    count = int(kept.sum())
    assert (far.x[:count] == near.x[kept]).all()


@pytest.mark.parametrize(("call", "message"), [
    (lambda: imazu(0.0, T), "U is 0"),
    (lambda: imazu(U, math.nan), "T is nan"),
    (lambda: imazu(U, T, 1.2), "share from 0"),
    (lambda: on_bearing(Role.OVERTAKEN, math.pi, 0.5, U, T), "overtaken"),
    (lambda: drawn([Role.HEAD_ON], 0, U, 1), "one or more"),
    (lambda: drawn([Role.NONE], 3, U, 1), "none"),
    (lambda: drawn([Role.OVERTAKEN], 3, U, 1, Ranges(k={Role.OVERTAKEN: (0.2, 0.3)})), "overtaken"),
    (lambda: drawn([], 3, U, 1), "one own ship"),
    (lambda: Ranges(T=(5.0, 3.0)), "T is drawn"),
    (lambda: Ranges(apart=-1.0), "apart is drawn"),
    (lambda: together([*imazu(U, T)[:1], *imazu(U + 1, T)[:1]]), "one speed"),
])  # fmt: skip
def test_a_meeting_that_cannot_be_is_one_line(call: object, message: str) -> None:
    with pytest.raises(RequestError, match=message) as found:
        call()  # type: ignore[operator]
    assert "\n" not in str(found.value)


def test_a_meeting_is_shared_by_ships_that_each_have_it_as_the_own_one() -> None:
    """Places of all ships are the same whoever has it, roles are opposite, and the others stand in their order."""
    met = drawn([Role.GIVE_WAY, Role.HEAD_ON, Role.STAND_ON], 5, 8.0, 4)
    runs, start = shared(met, 3)
    assert (start[::3] == 0.0).all()
    x, y, psi = seen_from(runs, *start.T)
    own, rest = (0.0, 0.0, 0.0), (met.x, met.y, met.psi)
    for k in range(3):
        for value, first, one, at in zip((x, y, psi), own, rest, start.T, strict=True):
            whole = np.column_stack([np.full(5, first), one])
            assert value[k::3] == pytest.approx(np.delete(whole, k, axis=1), abs=1e-9)
            assert at[k::3] == pytest.approx(whole[:, k])
    assert (runs.roles[1::3, 0] == Role.STAND_ON).all()
    assert (runs.roles[2::3, 0] == Role.HEAD_ON).all()
    assert runs.U[1::3] == pytest.approx(met.U_target[:, 0])
    assert runs.U_target[1::3, 0] == pytest.approx(np.full(5, 8.0))
