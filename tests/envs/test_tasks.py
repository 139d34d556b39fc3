"""What a task pays, sees and ends at, by geometry of its own: corners of the hull, feet of perpendiculars."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.envs import Berth, Canal, Course, Quay, Track
from seatrial.envs.episodes import Settings
from seatrial.envs.tasks import Scale, any_of, held, outside

SHIP = Scale(L=80.0, B=12.0, U=5.0, period=0.8)
TASKS = (Course(), Track(), Berth(), Quay(), Canal())
LENGTHS = 0.8 * 5.0 / 80.0
"""Ship lengths made good between two actions."""


def judged(task: Any, state: Any, controls: Any = (0.0,), goal: Any = (), memory: Any = (), beyond: float = 0.0) -> Any:
    found = task.judge(SHIP, tuple(map(float, state)), controls, goal, memory, beyond)
    assert len(found.seen) == len(task.seen)
    return found


def starts(task: Any, count: int = 4000) -> Any:
    return task.begin(SHIP, np.random.default_rng(1).random((count, task.draws)))


def even(values: Any, low: float, high: float) -> None:
    """Evenly spread between two ends: its extremes near them, its quartiles a quarter apart."""
    width = high - low
    assert low <= values.min() < low + 0.005 * width
    assert high - 0.005 * width < values.max() <= high
    assert np.quantile(values, [0.25, 0.5, 0.75]) == pytest.approx(low + width * np.array([0.25, 0.5, 0.75]),
                                                                  abs=0.035 * width)  # fmt: skip


@pytest.mark.parametrize("task", TASKS, ids=lambda task: type(task).__name__)
def test_an_episode_begins_within_what_is_seen_and_is_not_over(task: Any) -> None:
    begun = starts(task, 300)
    assert begun.state.shape == (300, 6)
    assert begun.goal.shape == (300, len(task.goal))
    assert begun.memory.shape == (300, len(task.memory))
    for state, goal, memory in zip(begun.state, begun.goal, begun.memory, strict=True):
        found = judged(task, state, goal=tuple(goal), memory=tuple(memory))
        assert found.over == 0.0
        assert held(found.seen, task.seen) == pytest.approx(found.seen)
        assert found.memory == pytest.approx(tuple(memory))
        assert abs(found.reward) < 2.0
    for one in task.seen:
        assert one.low in (-10.0, -5.0, -3.0, -2.0, -1.0), one
        assert one.high == -one.low or one.high in (10.0, 20.0, 50.0), one


def test_conditions_hold_where_a_number_is_none() -> None:
    assert [outside(x, -1.0, 2.0) for x in (-1.1, -1.0, 0.0, 2.0, 2.1, math.nan)] == [1.0, 0.0, 0.0, 0.0, 1.0, 1.0]
    assert [outside(x, 0.0, math.inf) for x in (-0.1, 0.0, 9.0, math.nan)] == [1.0, 0.0, 0.0, 1.0]
    assert [outside(x, -math.inf, 0.0) for x in (-9.0, 0.0, 0.1, math.nan)] == [0.0, 0.0, 1.0, 1.0]
    assert [outside(x, -math.inf, math.inf) for x in (-9.0, math.nan)] == [0.0, 1.0]
    assert (any_of(0.0, 0.0), any_of(0.0, 1.0), any_of(1.0, 1.0), any_of()) == (0.0, 1.0, 1.0, 0.0)
    assert (Settings().limit, Settings().wind, Settings().current) == (1000, (0.0, 0.0), (0.0, 0.0))


def test_a_course_costs_its_error_rudder_and_turning_over_ship_lengths() -> None:
    for e, a, r in ((0.3, 0.2, 0.01), (-1.2, -1.0, -0.02), (0.0, 0.5, 0.0)):
        for turns in (0, 1):  # the short way round
            found = judged(Course(), (0, 0, 2.8 + e + turns * math.tau, 4.0, 0.5, r), (a, 0.1), (2.8,))
            cost = e * e + 0.1 * (a * a + 0.01) + 0.1 * (r * 80.0 / 5.0) ** 2
            assert found.reward == pytest.approx(-cost * LENGTHS)
            assert found.seen == pytest.approx((math.sin(e), math.cos(e), 0.8, 0.1, r * 16.0))
            assert found.over == 0.0
    off = judged(Course(), (0, 0, 1.58, 5.0, 0, 0), (0.0,), (0.0,))
    assert (off.over, off.reward) == (1.0, pytest.approx(-100.0 - 1.58**2 * LENGTHS))
    assert judged(Course(), (0, 0, 1.56, 5.0, 0, 0), (0.0,), (0.0,)).over == 0.0
    gone = judged(Course(), (0, 0, 0, 5.0, 0, 0), (0.0,), (0.0,), (), 1.0)
    assert (gone.over, gone.reward) == (1.0, -100.0)
    begun = starts(Course())
    even(begun.state[:, 2], -math.pi, math.pi)
    even(begun.goal[:, 0] - begun.state[:, 2], -math.pi / 3.0, math.pi / 3.0)
    assert (begun.state[:, 3] == 5.0).all()
    ((line,),) = (Course().guide(SHIP, (0.7,), 3.0, 4.0),)
    assert line[0] == (3.0, 4.0)
    assert np.subtract(line[1], line[0]) == pytest.approx((480.0 * math.cos(0.7), 480.0 * math.sin(0.7)))


def test_a_track_is_seen_from_the_leg_that_counts() -> None:
    """Offsets by the foot of the perpendicular on either leg, of a path turned to any bearing."""
    first, turn, length = 0.8, -0.5, 600.0
    legs = [np.array([math.cos(chi), math.sin(chi)]) for chi in (first, first + turn)]
    goal = (*legs[0], *legs[1], length)
    corner = length * legs[0]
    cases = ((0, 300.0, 40.0, 0.9, 0.0), (0, 479.0, -100.0, 0.7, 0.0), (1, 100.0, 30.0, 0.5, 1.0),
             (1, 790.0, -60.0, 0.2, 1.0))  # fmt: skip
    for leg, base, way, psi, memory in cases:
        along, start = legs[leg], (np.zeros(2), corner)[leg]
        at = start + base * along + way * np.array([-along[1], along[0]])
        found = judged(Track(), (*at, psi, 4.0, 0.3, 0.01), (0.5,), goal, (memory,))
        h = psi - (first, first + turn)[leg]
        to_go = ((length, 800.0)[leg] - base) / 80.0
        ahead = (math.sin(turn), math.cos(turn)) if leg == 0 else (0.0, 1.0)
        assert found.seen == pytest.approx((way / 80.0, math.sin(h), math.cos(h), to_go, *ahead, 0.8, 0.06, 0.16))
        cost = (way / 80.0) ** 2 + 0.5 * (1.0 - math.cos(h)) + 0.1 * 0.25
        assert (found.reward, found.over, found.memory) == (pytest.approx(-cost * LENGTHS), 0.0, (float(leg),))
    for left, leg in ((121.0, 0.0), (119.0, 1.0)):  # one and a half lengths before the corner the second leg counts
        assert judged(Track(), (*((length - left) * legs[0]), first, 5, 0, 0), goal=goal, memory=(0.0,)).memory == (
            leg,
        )
    end = judged(Track(), (*(corner + 800.5 * legs[1]), first + turn, 5, 0, 0), goal=goal, memory=(1.0,))
    assert (end.over, end.reward) == (1.0, pytest.approx(0.0, abs=1e-9))
    aside = np.array([-legs[0][1], legs[0][0]])
    ends = ((319.0, first, 0.0, 0.0), (321.0, first, 0.0, 1.0), (-321.0, first, 0.0, 1.0),
            (0.0, first + 1.6, 0.0, 1.0), (0.0, first + 1.5, 0.0, 0.0), (0.0, first, 1.0, 1.0))  # fmt: skip
    for off, psi, beyond, over in ends:
        found = judged(Track(), (*(200.0 * legs[0] + off * aside), psi, 5, 0, 0), (0.0,), goal, (0.0,), beyond)
        assert (found.over, found.reward < -90.0) == (over, over == 1.0)
    begun = starts(Track())
    c1, s1, c2, s2, length_1 = begun.goal.T
    even(np.arctan2(s1, c1), -math.pi, math.pi)
    even(np.arctan2(c1 * s2 - s1 * c2, c1 * c2 + s1 * s2), -math.pi / 3.0, math.pi / 3.0)
    even(length_1, 400.0, 800.0)
    x, y, psi = begun.state[:, :3].T
    even(y * c1 - x * s1, -80.0, 80.0)
    assert x * c1 + y * s1 == pytest.approx(0.0, abs=1e-9)
    even(
        np.arctan2(np.sin(psi) * c1 - np.cos(psi) * s1, np.cos(psi) * c1 + np.sin(psi) * s1), -math.pi / 9, math.pi / 9
    )
    ((path,),) = (Track().guide(SHIP, goal, 0.0, 0.0),)
    assert np.array(path) == pytest.approx(np.array([np.zeros(2), corner, corner + 800.0 * legs[1]]))


def corners(x: float, y: float, psi: float) -> Any:
    """Ends of the rectangle L by B, north and east [m]."""
    c, s = math.cos(psi), math.sin(psi)
    return np.array([(x + a * c - b * s, y + a * s + b * c) for a in (-40.0, 40.0) for b in (-6.0, 6.0)])


def test_a_berth_pays_the_way_made_and_charges_what_touches() -> None:
    """The quay lies a breadth off the berth's middle; room is that of the easternmost corner."""
    rng = np.random.default_rng(2)
    kinds = set()
    for x, y, psi in rng.uniform((-200.0, -40.0, -0.6), (60.0, 12.0, 0.6), (200, 3)).tolist():
        u, v, r = rng.uniform(-0.6, 0.6, 3) * (1.0, 1.0, 0.05)
        found = judged(Berth(), (x, y, psi, u, v, r), (0.5, -0.2), (), (7.0,))
        room = 12.0 - corners(x, y, psi)[:, 1].max()
        to_go = math.hypot(x, y) / 80.0 + 0.5 * abs(psi)
        reward = 7.0 - to_go - (0.02 + 0.02 * 0.29) * LENGTHS
        if room < 0.0:
            reward -= 10.0 * (1.0 + (max(u * math.sin(psi) + v * math.cos(psi), 0.0) / 0.5) ** 2)
        assert found.reward == pytest.approx(reward, abs=1e-6)
        assert found.over == float(room < 0.0)
        assert found.memory == (pytest.approx(to_go, abs=1e-6),)
        assert found.seen == pytest.approx(
            (x / 80.0, y / 80.0, math.sin(psi), math.cos(psi), room / 80.0, u / 5.0, v / 5.0, 16.0 * r)
        )
        kinds.add(found.over)
    assert kinds == {0.0, 1.0}


@pytest.mark.parametrize(
    ("k", "most"), [(0, 8.0), (1, 3.0), (2, math.pi / 36.0), (3, 0.5), (4, 0.5), (5, 0.1 * 5.0 / 80.0)]
)
def test_a_ship_is_berthed_within_its_limits_and_not_beyond_any(k: int, most: float) -> None:
    for share, paid in ((0.98, True), (-0.98, True), (1.02, False), (-1.02, False)):
        state = np.zeros(6)
        state[k] = share * most
        found = judged(Berth(), state, (0.0,), (), (0.0,))
        touches = 12.0 - corners(*state[:3])[:, 1].max() < 0.0
        assert (found.reward > 9.0, found.over) == (paid and not touches, float(paid or touches))


def test_out_of_the_harbour_or_the_model_costs_as_a_touch() -> None:
    for x, beyond, gone in ((-639.0, 0.0, 0.0), (-641.0, 0.0, 1.0), (-100.0, 1.0, 1.0)):
        found = judged(Berth(), (x, -20.0, 0.0, 1.0, 0.0, 0.0), (0.0,), (), (math.hypot(x, 20.0) / 80.0,), beyond)
        assert (found.over, found.reward) == (gone, pytest.approx(-10.0 * gone - 0.02 * LENGTHS, abs=1e-6))
    begun = starts(Berth())
    even(begun.state[:, 0], -320.0, -160.0)
    even(begun.state[:, 1], -120.0, -40.0)
    even(begun.state[:, 2], -math.pi / 12.0, math.pi / 12.0)
    even(begun.state[:, 3], 1.0, 2.5)
    quay, berth = Berth().guide(SHIP, (), 0.0, 0.0)
    assert quay == ((-800.0, 12.0), (800.0, 12.0))
    assert (np.min(berth, axis=0).tolist(), np.max(berth, axis=0).tolist()) == ([-40.0, -6.0], [40.0, 6.0])


def test_a_quay_pays_the_way_to_its_fenders_and_charges_a_hard_meeting() -> None:
    """The fenders' line is two metres off; the hull meets it with its parallel side, a third of the length each way."""
    cases = ((0.5, 0.01, 0.02, 0.05, 1e-4), (0.005, -0.02, 0.0, 0.06, -2e-4), (0.0, 0.0, 0.0, 0.09, 0.0),
             (0.01, 0.01, 0.1, -0.03, 0.0))  # fmt: skip
    for gap, psi, u, v, r in cases:
        y = -2.0 - (0.5 + gap) * 12.0
        found = judged(Quay(), (250.0 + 6.0, y, psi, u, v, r), (0.4, -0.3), (), (1.0,))
        near = gap * 12.0 - 0.33 * 80.0 * abs(math.sin(psi))
        towards = u * math.sin(psi) + v * math.cos(psi) + 0.33 * 80.0 * abs(r)
        meets = max(towards, 0.0) / 0.08 if near < 0.0 else 0.0
        to_go = abs(gap) + 5.0 * abs(psi)
        reward = 1.0 - to_go - 0.002 - 0.002 * 0.25 - 0.2 * meets**2
        assert (found.reward, found.over) == (pytest.approx(reward, abs=1e-9), 0.0)
        assert found.memory == (pytest.approx(to_go),)
        assert found.seen == pytest.approx((0.5, gap, psi, 10.0 * u, 10.0 * v, 800.0 * r), abs=1e-9)


@pytest.mark.parametrize(
    ("change", "over", "paid"),
    [({}, 1.0, 5.0), ({"x": 297.0}, 1.0, 5.0), ({"x": 299.0}, 1.0, -5.0), ({"x": 201.0}, 1.0, -5.0),
     ({"gap": 0.02}, 0.0, 0.0), ({"psi": 0.021}, 0.0, 0.0), ({"u": 0.0098}, 1.0, 5.0), ({"u": 0.0102}, 0.0, 0.0),
     ({"v": -0.0102}, 0.0, 0.0), ({"r": 0.0102 / 26.4}, 0.0, 0.0), ({"r": -0.0098 / 26.4}, 1.0, 5.0),
     ({"gap": 4.1}, 1.0, -5.0), ({"gap": 3.9}, 0.0, 0.0), ({"gap": -0.11, "u": 0.05}, 1.0, -5.0),
     ({"beyond": 1.0}, 1.0, -5.0),
     ({"gap": -0.01, "v": 0.29}, 0.0, -0.2 * (0.29 / 0.08) ** 2),
     ({"gap": -0.01, "v": 0.31}, 1.0, -5.0 - 0.2 * (0.31 / 0.08) ** 2),
     ({"gap": -0.01, "v": 2.0}, 1.0, -5.0 - 0.2 * 100.0)],
)  # fmt: skip
def test_a_ship_lies_on_its_fenders_or_does_not(change: dict[str, float], over: float, paid: float) -> None:
    gap, psi = change.get("gap", -0.005), change.get("psi", 0.0)
    state = (change.get("x", 250.0), -2.0 - (0.5 + gap) * 12.0, psi, change.get("u", 0.0), change.get("v", 0.0),
             change.get("r", 0.0))  # fmt: skip
    at = judged(Quay(), state, (0.0,), (), (abs(gap) + 5.0 * abs(psi),), change.get("beyond", 0.0))
    slow = max(change.get("u", 0.0) * math.sin(psi) + abs(change.get("r", 0.0)) * 26.4, 0.0) / 0.08
    meets = 0.2 * slow**2 if "r" in change else 0.0
    assert at.over == over
    if not (change.keys() == {"x"} and paid < 0.0):
        assert at.reward == pytest.approx(paid - 0.002 - meets, abs=1e-9)


def test_the_start_off_the_quay_is_clear_of_the_fenders() -> None:
    begun = starts(Quay())
    even(begun.state[:, 0], 244.0, 256.0)
    even(begun.state[:, 2], -0.03, 0.03)
    east = begun.state[:, 1] + 0.5 * 80.0 * np.abs(np.sin(begun.state[:, 2]))
    even((-2.0 - east) / 12.0 - 0.5, 0.3, 1.5)
    assert not begun.state[:, 3:].any()
    quay, fenders = Quay().guide(SHIP, (), 0.0, 0.0)
    assert quay == ((250.0 - 560.0, 0.0), (250.0 + 560.0, 0.0))
    assert fenders == ((210.0, -2.0), (290.0, -2.0))


def test_a_canal_costs_what_is_off_its_middle() -> None:
    found = judged(Canal(), (0.0, 6.0, 0.1, 2.0, 0.25, 0.01), (0.5,))
    assert found.reward == pytest.approx(-0.05 * (0.25 + 4.0 * (1.0 - math.cos(0.1)) + 0.1 * 0.25))
    assert found.seen == pytest.approx((0.5, math.sin(0.1), 0.4, 0.05, 0.16))
    cases = ((26.3, 0.0, 0.0, 0.0), (26.5, 0.0, 0.0, 1.0), (-26.5, 0.0, 0.0, 1.0), (0.0, 0.78, 0.0, 0.0),
             (0.0, 0.79, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0))  # fmt: skip
    for y, psi, beyond, over in cases:
        at = judged(Canal(), (0.0, y, psi, 2.0, 0.0, 0.0), (0.0,), (), (), beyond)
        wanted = -0.05 * ((y / 12.0) ** 2 + 4.0 * (1.0 - math.cos(psi))) - 10.0 * over
        assert (at.over, at.reward) == (over, pytest.approx(wanted))
    begun = starts(Canal())
    assert (begun.state[:, 0] == -3500.0).all()
    even(begun.state[:, 1], -12.0, 12.0)
    even(begun.state[:, 2], -0.05, 0.05)
    even(begun.state[:, 3], 1.75, 2.5)
    assert Canal().guide(SHIP, (), 100.0, 3.0) == (((-460.0, 0.0), (660.0, 0.0)),)
