"""The reference autopilots among ships that hold on: what they do to pass is judged by geometry and by the rules."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.encounters.avoiding import KeepClear, Seen, bad, good
from seatrial.encounters.conduct import Scene
from seatrial.encounters.meeting import Meeting, imazu
from seatrial.encounters.rules import Limits, judge
from seatrial.encounters.sailing import Sea, sail
from seatrial.ships import Ship
from seatrial.ships.files import load

U, R, L = 8.0, 12000.0, 300.0
PASSING = 1.4 * float(Limits().passing.of(np.array(L)))


def scene(*ships: tuple[float, float, float, float], t: float = 0.0, course: float = 0.0) -> Scene:
    """The own ship at (0, 0) on a course, others by place, course and speed at t = 0, all t seconds later."""
    x, y, psi, speed = (np.array([row]) for row in zip((0.0, 0.0, course, U), *ships, strict=True))
    north, east = speed * np.cos(psi), speed * np.sin(psi)
    return Scene(t, x + north * t, y + east * t, psi, north, east, np.full(1 + len(ships), L))


def chosen(*ships: tuple[float, float, float, float], t: float = 0.0, rules: bool = True, lean: float = 0.0) -> float:
    """The alteration that the autopilot takes on course north at (0, U t) [deg]."""
    pilot = KeepClear(scene(*ships), Limits(), rules=rules, lean=lean)
    return math.degrees(pilot.look(scene(*ships, t=t)).psi[0])


def meets(psi: float, T: float, k: float = 1.0) -> tuple[float, float, float, float]:
    """A ship on course psi [deg] that meets the own ship after T seconds."""
    angle = math.radians(psi)
    return U * T * (1.0 - k * math.cos(angle)), -k * U * T * math.sin(angle), angle, k * U


def test_it_keeps_its_course_among_ships_that_pass_clear() -> None:
    assert chosen((6000.0, 1.1 * PASSING, math.pi, U)) == 0.0
    assert chosen((-6000.0, 0.0, 0.0, 0.9 * U)) == 0.0


@pytest.mark.parametrize("psi", [180.0, -90.0, -60.0])
def test_it_turns_to_starboard_for_ships_that_it_meets_or_gives_way_to(psi: float) -> None:
    assert chosen(meets(psi, 900.0)) >= 30.0
    assert chosen(meets(psi, 1500.0)) == 0.0, "before the horizon there is nothing to do"


def test_it_stands_on_before_ships_from_port_until_it_is_alone_and_then_does_not_turn_to_port() -> None:
    assert chosen(meets(90.0, 900.0)) == 0.0
    assert chosen(meets(90.0, 900.0), t=500.0) == 0.0
    assert chosen(meets(90.0, 900.0), t=560.0) > 0.0


def test_it_yields_to_ships_that_go_before_it_by_their_kind() -> None:
    """Rule 18: from port too, and at once; not to one that it meets after another that does."""
    fishing = replace(scene(meets(90.0, 900.0)), ranks=(0, 2))
    assert KeepClear(fishing, Limits()).look(fishing).psi[0] != 0.0
    own = replace(fishing, ranks=(2, 2))
    assert KeepClear(own, Limits()).look(own).psi[0] == 0.0
    blind = KeepClear(fishing, Limits(), rules=False)
    assert not blind._clear.any()


def test_it_goes_back_to_its_course_when_that_is_free() -> None:
    ship = meets(180.0, 900.0)
    pilot = KeepClear(scene(ship), Limits())
    assert pilot.look(scene(ship)).psi[0] > 0.5
    assert pilot.look(scene(ship, t=950.0)).psi[0] == 0.0  # it has passed


@pytest.mark.parametrize("turned", [15.0, 36.0, 39.0])
def test_an_alteration_that_is_begun_is_made_though_the_other_ship_acts_too(turned: float) -> None:
    """The other ship has turned away by then, so that the old course is free; a half made alteration is not seen."""
    pilot = KeepClear(scene(meets(180.0, 900.0)), Limits())
    ordered = pilot.look(scene(meets(180.0, 900.0))).psi[0]
    assert math.degrees(ordered) == pytest.approx(40.0)
    away = scene((6000.0, -3000.0, math.radians(215.0), U))
    away.psi[:, 0] = math.radians(turned)
    assert pilot.look(away).psi[0] == (0.0 if turned >= 38.0 else ordered)


def test_without_rules_it_turns_to_the_cheaper_side_and_at_once() -> None:
    assert chosen(meets(180.0, 900.0), rules=False, lean=0.3) < 0.0
    assert chosen(meets(180.0, 900.0), rules=False, lean=-0.3) > 0.0


def test_what_it_chooses_passes_as_far_as_asked() -> None:
    """On the chosen course the straight tracks of both pass at the distance at least, by a search in time."""
    t = np.linspace(0.0, 2000.0, 20001)
    for psi in (180.0, -120.0, -90.0, -60.0):
        x, y, angle, speed = meets(psi, 900.0)
        turn = math.radians(chosen((x, y, angle, speed)))
        away = np.hypot(x + speed * math.cos(angle) * t - U * np.cos(turn) * t,
                        y + speed * math.sin(angle) * t - U * np.sin(turn) * t)  # fmt: skip
        assert away.min() >= PASSING


@pytest.fixture(scope="module")
def ship() -> Ship:
    return load("kvlcc2")


@pytest.mark.parametrize("angle", [40.0, -130.0])
def test_what_it_chooses_turns_with_the_compass(angle: float) -> None:
    """Ships and course turned about the origin: the same alteration."""
    turn = math.radians(angle)
    c, s = math.cos(turn), math.sin(turn)
    for psi in (180.0, -90.0, 90.0, -120.0):
        x, y, course, speed = meets(psi, 900.0)
        turned = (c * x - s * y, s * x + c * y, course + turn, speed)
        pilot = KeepClear(scene(turned, course=turn), Limits())
        for t in (0.0, 600.0):
            found = pilot.look(scene(turned, t=t, course=turn)).psi[0] - turn
            assert math.degrees(found) == pytest.approx(chosen((x, y, course, speed), t=t), abs=1e-9)


@pytest.mark.slow
def test_the_good_one_keeps_the_rules_where_the_bad_one_breaks_rules_14_and_17(ship: Ship) -> None:
    """Imazu 1 is head-on, 4 a crossing from port."""
    problems = [imazu(ship.speed, 1500.0)[k - 1] for k in (1, 4)]
    fields = ("x", "y", "psi", "U_target")
    many = Meeting(ship.speed, *(np.stack([getattr(one, name) for one in problems]) for name in fields))
    broken = {}
    for pilot in (good, bad):
        [own] = judge(sail(ship, many, Sea(3000.0), pilot, ("ignores",)).tracks, own=True)
        assert not own.contact.any()
        broken |= {(pilot.__name__, k): own.broken((row,)) for row, k in enumerate((1, 4))}
    assert broken["good", 1] == broken["good", 4] == ()
    assert "14" in broken["bad", 1]
    assert any(rule.startswith("17") for rule in broken["bad", 4])


def seen(x: float, y: float, north: float, east: float, **more: float) -> Seen:
    """A ship that is seen from one at 5 m/s on course north, 100 m to pass at, within 1000 s; 300 m ahead of bows."""
    numbers = {"passing": 100.0, "act": 1000.0, "horizon": 1000.0, "bow": 300.0}
    if "horizon" in more:
        numbers["act"] = more["horizon"]
    numbers |= {name: value for name, value in more.items() if name in numbers}
    flags = {name: np.array([[bool(more.get(name))]]) for name in ("clear", "to_port", "overtakes")}
    rest = {name: np.array([[value]]) for name, value in numbers.items()}
    return Seen(*(np.array([[value]]) for value in (x, y, north, east, 5.0)), **rest, **flags)


def test_an_alteration_keeps_farther_off_than_a_course_that_is_held() -> None:
    """A ship that passes at 1.1 times the distance: the course may be held, an alteration to such a passage not."""
    assert seen(2000.0, 110.0, -5.0, 0.0).barred(0.0) == 0.0
    turn = math.radians(40.0)
    # the same passage as seen along the altered course
    c, s = math.cos(turn), math.sin(turn)
    assert seen(2000.0 * c - 110.0 * s, 2000.0 * s + 110.0 * c, -5.0 * c, -5.0 * s).barred(turn) > 0.0
    assert seen(2000.0 * c - 130.0 * s, 2000.0 * s + 130.0 * c, -5.0 * c, -5.0 * s).barred(turn) == 0.0


def test_who_keeps_clear_does_not_turn_to_port_while_there_is_risk() -> None:
    ahead = seen(2000.0, 0.0, -5.0, 0.0, clear=1.0)
    port, starboard = ahead.barred(math.radians(-60.0)), ahead.barred(math.radians(60.0))
    assert port >= 50.0  # half of what a meeting costs
    assert starboard == 0.0  # and leaves the other on the port side
    assert seen(2000.0, 0.0, -5.0, 0.0).barred(math.radians(-60.0)) == 0.0  # no rule asks
    assert seen(2000.0, 500.0, -5.0, 0.0, clear=1.0).barred(math.radians(-60.0)) == 0.0  # no risk
    assert seen(2000.0, -10.0, -5.0, 0.0, to_port=1.0).barred(math.radians(-60.0)) >= 50.0  # Rule 17(c)


def test_who_keeps_clear_leaves_the_other_ship_to_port() -> None:
    """A slow ship close ahead to starboard, towards which a small turn would leave it on the starboard side."""
    slow = seen(300.0, 60.0, 1.0, 0.0, clear=1.0, passing=90.0)
    assert slow.barred(0.0) > 0.0
    passed = {turn: slow.barred(math.radians(turn)) for turn in (-60.0, 80.0)}
    assert passed[80.0] == 0.0  # it passes ahead, so it is left to port
    crossing = seen(300.0, 600.0, 0.0, -10.0, clear=1.0, passing=90.0, horizon=100.0)
    assert crossing.barred(0.0) > 0.0
    small, large = (crossing.barred(math.radians(turn)) for turn in (5.0, 90.0))
    assert small > 0.0
    assert large == 0.0


def test_a_course_out_of_the_way_is_one_for_as_long_as_risk_is() -> None:
    """A ship that does not give way: from the last moment on, the course taken stays clear, not just until then.

    What was clear for the six minutes at which it acts was a course beside the other one, which came up on it.
    """
    t = np.linspace(0.0, 0.9 * float(Limits().horizon.of(np.array(L))), 5001)
    for beta, k in ((-43.0, 1.11), (-50.0, 1.09), (-47.0, 1.14)):
        # on that bearing at 900 s it meets the own ship: the other's course by the sine rule
        psi = beta + 180.0 - math.degrees(math.asin(math.sin(math.radians(-beta)) / k))
        x, y, angle, speed = meets(psi, 900.0, k)
        assert math.degrees(math.atan2(y, x)) == pytest.approx(beta, abs=1.0)
        at = 560.0
        turn = math.radians(chosen((x, y, angle, speed), t=at))
        assert turn > 0.0
        north, east = speed * math.cos(angle), speed * math.sin(angle)
        away = np.hypot(x + north * at - U * at + (north - U * math.cos(turn)) * t,
                        y + east * at + (east - U * math.sin(turn)) * t)  # fmt: skip
        assert away.min() >= 0.99 * PASSING


def test_a_ship_that_comes_up_from_astern_and_does_not_keep_clear_is_avoided() -> None:
    """Its closest approach is sooner on every other course, and farther off."""
    astern = meets(3.0, 930.0, 1.6)
    assert chosen(astern, t=500.0) == 0.0  # it stands on
    assert abs(chosen(astern, t=650.0)) >= 40.0


def test_of_courses_that_all_meet_somebody_the_one_with_more_room_is_cheaper() -> None:
    hit, near = seen(9000.0, 0.0, -5.0, 0.0), seen(300.0, 80.0, -5.0, 0.0)
    assert hit.barred(0.0) > near.barred(0.0) > 0.0  # after 30 s and not 900 s, but 80 m off
    assert seen(3000.0, 0.0, -5.0, 0.0).barred(0.0) > hit.barred(0.0) + 10.0  # of two alike the sooner


def test_who_overtakes_does_not_cut_in_before_the_other_ship() -> None:
    """A slow ship on course east: passed before its bow within the distance, behind its stern, or far ahead."""
    ahead = (1000.0, -800.0, 0.0, 3.0)  # at (1000, -200) when the own ship is abreast
    assert seen(*ahead, overtakes=1.0).barred(0.0) == pytest.approx(50.0)
    assert seen(*ahead).barred(0.0) == 0.0
    assert seen(*ahead, overtakes=1.0, bow=150.0).barred(0.0) == 0.0
    astern = (1000.0, -400.0, 0.0, 3.0)  # at (1000, 200)
    assert seen(*astern, overtakes=1.0).barred(0.0) == 0.0
    gone = (-1000.0, -800.0, 0.0, -3.0)  # it was passed so
    assert seen(*gone, overtakes=1.0).barred(0.0) == 0.0


def test_who_has_left_its_course_goes_back_when_that_is_free_as_far_ahead_as_any_other() -> None:
    """A ship on the port side that holds on: 400 s before the meeting the old course may be held, not taken again."""
    ship = meets(90.0, 900.0)
    pilot = KeepClear(scene(ship), Limits())
    assert pilot.look(scene(ship, t=500.0)).psi[0] == 0.0
    assert pilot.look(scene(ship, t=560.0)).psi[0] > 0.0
    assert pilot.look(scene(ship, t=500.0)).psi[0] > 0.0
