"""Contacts, judge, alarms and faults of the range against closed forms and brute force: straight tracks, rectangles."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest

from scenes import DEG, FERRY, Criteria, Fault, Limits, scene
from seatrial.core.errors import RefusalError
from seatrial.manoeuvres.track import legs
from seatrial.realtime.range.contacts import Contact, contact
from seatrial.realtime.range.faults import INSTRUMENTS
from seatrial.realtime.range.judge import Judge
from seatrial.realtime.range.pilots import Guide, OwnPilot
from seatrial.realtime.range.scenario import Other, Sailing, ordinary
from seatrial.realtime.range.stage import Stage
from seatrial.sensors import Reading

Array = np.ndarray


class Placed(dict):
    """A ship of this length at this place, as contacts see a plant."""

    def __init__(self, length: float, breadth: float = 0.0, **state: float) -> None:
        super().__init__(dict.fromkeys(("x", "y", "psi", "u", "v_m", "r"), 0.0) | state)
        self.ship = ordinary("placed", length, 8.0)
        self.breadth = breadth or length / 7.0  # what a ship without a breadth is taken to have


# --- nearest approach ---


def test_the_nearest_approach_is_the_least_distance_of_a_fine_march():
    draw = random.Random(3)
    for _ in range(40):
        own = Placed(
            100.0, x=draw.uniform(-500, 500), psi=draw.uniform(0, 6.3), u=draw.uniform(-3, 9), v_m=draw.uniform(-1, 1)
        )
        far = draw.uniform(800, 4000)
        to = draw.uniform(0, 6.3)
        other = Placed(80.0, x=own["x"] + far * math.cos(to), y=far * math.sin(to), psi=draw.uniform(0, 6.3),
                       u=draw.uniform(1, 12), v_m=draw.uniform(-1, 1))  # fmt: skip
        seen = contact("x", own, other)

        def at(ship: Placed, t: float) -> complex:
            turn = complex(math.cos(ship["psi"]), math.sin(ship["psi"]))
            return complex(ship["x"], ship["y"]) + turn * complex(ship["u"], ship["v_m"]) * t

        apart = at(other, 0.0) - at(own, 0.0)
        assert seen.distance == pytest.approx(abs(apart))
        assert seen.bearing == pytest.approx(math.atan2(apart.imag, apart.real))
        way = at(other, 1.0) - at(other, 0.0)
        assert (seen.U, seen.chi) == (pytest.approx(abs(way)), pytest.approx(math.atan2(way.imag, way.real)))
        least = min(abs(at(other, seen.tcpa + dt) - at(own, seen.tcpa + dt)) for dt in (-1.0, -0.1, 0.1, 1.0))
        assert abs(at(other, seen.tcpa) - at(own, seen.tcpa)) == pytest.approx(seen.cpa, abs=1e-6)
        assert least > seen.cpa


@pytest.mark.parametrize(("distance", "cpa", "tcpa", "danger"), [
    (3000.0, 400.0, 100.0, True), (3000.0, 500.0, 100.0, False), (3000.0, 400.0, 600.0, False),
    (3000.0, 400.0, 599.0, True), (3000.0, 400.0, -1.0, False), (400.0, 400.0, -1.0, False), (400.0, 400.0, 0.0, True),
    (400.0, 100.0, 1000.0, True), (600.0, 600.0, 0.0, False),
])  # fmt: skip
def test_what_is_dangerous(distance, cpa, tcpa, danger):
    assert Contact("x", distance, 0.0, 5.0, 0.0, cpa, tcpa).dangerous(500.0, 600.0) is danger


def meeting(y: float, x: float = 3000.0, speed: float = 6.0, length: float = 100.0, psi: float = math.pi) -> Other:
    """A ship that comes the other way, `y` to the east."""
    return Other("other", ordinary("other", length, speed), Sailing(x, y, psi, speed))


@pytest.mark.slow
def test_two_that_meet_pass_at_their_offset_when_they_are_abeam():
    """8 m/s north meets 6 m/s south from 3000 m: abeam after 3000/14 s at the 300 m between the lines."""
    stage = Stage(scene(meeting(300.0), rate=5.0, limits=Limits(cpa=926.0, tcpa=100.0)))
    stage.loop.run(400.0)
    passed = stage.wakes.passed(926.0, 100.0)["other"]
    assert passed.t == pytest.approx(3000.0 / 14.0, abs=0.21)
    assert passed.distance == pytest.approx(300.0, abs=0.01)
    assert passed.touched is None
    assert passed.in_hand == pytest.approx(0.0, abs=0.21)  # it was never avoided
    saved = stage.loop.snapshot()
    stage.loop.reset()
    stage.loop.restore(saved)
    again = stage.wakes.passed(926.0, 100.0)["other"]
    assert [(one.distance, one.t, one.in_hand, one.margins) for one in (again,)] == [
        (passed.distance, passed.t, passed.in_hand, passed.margins)]  # fmt: skip


@pytest.mark.slow
def test_a_meeting_ship_that_is_seen_too_late_has_no_time_in_hand():
    stage = Stage(scene(meeting(1000.0), rate=5.0))
    stage.loop.run(300.0)
    assert stage.wakes.passed(926.0, 720.0)["other"].in_hand is None


@pytest.mark.slow
@pytest.mark.parametrize(("other", "when"), [
    (meeting(0.0), (3000.0 - 125.0) / 14.0),  # bows meet: half of 150 m and half of 100 m
    (meeting(-15.0), (3000.0 - 125.0) / 14.0),  # and overlap: half breadths of 10.7 m and 7.1 m
    (meeting(-19.0), None), (meeting(19.0), None),
    (meeting(0.0, 600.0, 6.0, psi=0.0), (600.0 - 125.0) / 2.0),  # overtaken from astern
])  # fmt: skip
def test_hulls_touch_when_their_bows_meet(other, when):
    stage = Stage(scene(other, rate=5.0, route=((9000.0, 0.0),), criteria=Criteria(passing_distance=1.0)))
    stage.loop.run(330.0)
    passed = stage.wakes.passed(926.0, 720.0)
    touched = passed["other"].touched
    assert touched is None if when is None else touched == pytest.approx(when, abs=0.21)
    judged = {one.name: one for one in stage.judge.judged(passed)}
    assert ("contact" in judged) is (when is not None)
    if when is not None:
        assert not judged["contact"].met
        assert (judged["contact"].value, judged["contact"].where) == (touched, "other")


# --- the judge: a ship that goes north beside a leg that does not ---


def straight(alpha: float, length: float, **criteria: float) -> tuple[Stage, Judge]:
    stage = Stage(scene(piloted=False, rate=2.0))
    route = legs([(0.0, 0.0), (length * math.cos(alpha), length * math.sin(alpha))])
    return stage, Judge(stage.loop, "own", route, 100.0, Criteria(**criteria))


def test_errors_of_a_straight_run_beside_its_leg_are_those_of_a_triangle():
    alpha, T = 0.3, 120.0
    stage, judge = straight(alpha, 5000.0, settle=40.0)
    stage.loop.run(39.0)
    assert judge.heading_error is None
    stage.loop.run(T - 39.0)
    most = 8.0 * T * math.sin(alpha)
    assert judge.cross_track == pytest.approx(most, rel=1e-6)
    assert judge.cross_track_rms == pytest.approx(most / math.sqrt(3.0), rel=5e-3)  # a ramp
    assert judge.heading_error == pytest.approx(alpha, abs=1e-9)
    assert judge.arrived is None


@pytest.mark.slow
@pytest.mark.parametrize("alpha", [0.4, -0.4])
def test_the_last_waypoint_is_abeam_when_the_way_along_the_leg_is_its_length(alpha):
    stage, judge = straight(alpha, 900.0)
    stage.loop.run(200.0)
    when = 900.0 / (8.0 * math.cos(alpha))
    assert judge.arrived == pytest.approx(when, abs=0.51)
    assert judge.cross_track == pytest.approx(8.0 * when * math.sin(0.4), abs=2.0)  # nothing counts after it


def test_each_criterion_is_met_on_its_side_of_the_limit():
    """100 s at 8 m/s, .3 rad beside the leg: 8 * 100 * sin .3 = 236.4 m across; the other ship stays 2000 m abeam."""
    other = Other("other", ordinary("o", 100.0, 8.0), Sailing(0.0, -2000.0, 0.0, 8.0))
    stage = Stage(scene(other, piloted=False, rate=2.0))
    cases = [
        ("cross_track", 240.0, "m", True), ("cross_track", 230.0, "m", False), ("heading_error", 0.31, "rad", True),
        ("heading_error", 0.29, "rad", False), ("time", 99.0, "s", False), ("time", 101.5, "s", False),
        ("passing_distance", 1990.0, "m", True), ("passing_distance", 2100.0, "m", False),
    ]  # fmt: skip
    route = legs([(0.0, 0.0), (5000.0 * math.cos(0.3), 5000.0 * math.sin(0.3))])
    judges = [
        Judge(stage.loop, "own", route, 100.0, Criteria(**{name: limit}, settle=10.0)) for name, limit, _, _ in cases
    ]
    stage.loop.run(100.0)
    passed = stage.wakes.passed(926.0, 720.0)
    for judge, wanted in zip(judges, cases, strict=True):
        (judged,) = judge.judged(passed)
        assert (judged.name, judged.limit, judged.unit, judged.met) == wanted


@pytest.mark.parametrize(("limit", "met"), [(111.9, False), (113.1, True)])
def test_the_time_is_that_of_arrival(limit, met):
    stage, judge = straight(0.0, 900.0, time=limit)  # 112.5 s
    stage.loop.run(150.0)
    (judged,) = judge.judged({})
    assert judged.met is met
    assert judged.value == pytest.approx(112.5, abs=0.51)


def test_water_under_the_keel_is_the_least_of_the_run():
    stage = Stage(scene(piloted=False))
    depths = iter([9.0, 4.0, 7.0, *[8.0] * 50])
    judge = Judge(
        stage.loop, "own", legs([(0.0, 0.0), (9000.0, 0.0)]), 100.0, Criteria(under_keel=4.5), lambda: next(depths)
    )
    stage.loop.run(5.0)
    assert judge.under_keel == 4.0
    assert [one.met for one in judge.judged({})] == [False]


def test_a_corner_is_taken_its_distance_before_the_waypoint_and_is_no_error_at_once():
    route = legs([(0.0, 0.0), (1000.0, 0.0), (1000.0, 1000.0)])
    guide = Guide(route, 200.0)
    assert guide.across(799.0, 3.0) == pytest.approx(3.0)
    assert guide.number == 0
    assert guide.across(801.0, 3.0) == pytest.approx(1000.0 - 801.0)  # to starboard of an eastbound leg is south
    assert (guide.number, guide.past) == (1, False)
    guide.across(1000.0, 999.0)
    assert not guide.past
    guide.across(1000.0, 1001.0)
    assert guide.past


@pytest.mark.parametrize("psi", [0.0, 0.8, -2.5])
def test_midship_is_found_from_the_antenna(psi):
    stage = Stage(scene(usual=True))
    pilot = OwnPilot(stage.loop, "own", legs([(0.0, 0.0), (9000.0, 0.0)]), False)
    ahead, aside = -0.4 * 150.0, 0.0
    at = complex(50.0, 30.0) + complex(math.cos(psi), math.sin(psi)) * complex(ahead, aside)
    assert pilot._midship({"x": at.real, "y": at.imag, "psi": psi}) == (pytest.approx(50.0), pytest.approx(30.0))
    pilot._antenna = (12.0, -5.0)
    at = complex(50.0, 30.0) + complex(math.cos(psi), math.sin(psi)) * complex(12.0, -5.0)
    assert pilot._midship({"x": at.real, "y": at.imag, "psi": psi}) == (pytest.approx(50.0), pytest.approx(30.0))


# --- alarms ---


@pytest.mark.parametrize(("kind", "text"), [("gyro", "HEADING LOST"), ("gnss", "POSITION LOST")])
def test_an_instrument_is_lost_five_seconds_after_its_last_reading(kind, text):
    stage = Stage(scene(rate=5.0, faults=(Fault("silent", kind, 10.0, 12.0),)))
    stage.loop.run(14.0)
    assert not stage.alarms.standing()
    stage.loop.run(2.0)
    (alarm,) = stage.alarms.standing()
    assert (alarm.cause.text, alarm.cause.priority, alarm.state) == (text, "W", "V")
    assert (alarm.cause.identifier, alarm.cause.instance) == ({"gyro": 10011, "gnss": 10012}[kind], 1)
    assert alarm.changed == pytest.approx(15.5, abs=0.51)
    stage.loop.run(8.0)
    assert alarm.state == "U"


def test_every_alarm_is_told_with_the_times_at_which_it_had_a_cause():
    """Off the track from 3 to 6 s and again from 9 s on: looked for once a second; a saved run goes on with them."""
    stage = Stage(scene(rate=5.0, limits=Limits(cross_track=50.0)))
    stage.alarms._across = lambda: 60.0 if 2.5 < stage.loop.t < 5.5 or stage.loop.t > 8.5 else 0.0
    stage.loop.run(7.0)
    (told,) = stage.alarms.told()
    assert (told["text"], told["priority"], told["state"], told["spans"]) == ("OFF TRACK", "W", "U", [[3.0, 6.0]])
    saved = stage.loop.snapshot()
    stage.alarms.reset()
    assert stage.alarms.told() == []
    stage.loop.restore(saved)
    stage.loop.run(4.0)
    (told,) = stage.alarms.told()
    assert (told["state"], told["spans"]) == ("V", [[3.0, 6.0], [9.0, None]])


@pytest.mark.parametrize(("across", "raised"), [(49.0, False), (51.0, True), (-49.0, False), (-51.0, True)])
def test_off_track_is_beyond_the_limit_on_either_side(across, raised):
    stage = Stage(scene(rate=5.0, limits=Limits(cross_track=50.0)))
    stage.alarms._across = lambda: across
    stage.loop.run(2.0)
    found = [(one.cause.text, one.cause.identifier) for one in stage.alarms.standing()]
    assert found == [("OFF TRACK", 10031)] * raised


@pytest.mark.parametrize(("under", "raised"), [(3.1, False), (2.9, True)])
def test_little_water_under_the_keel(under, raised):
    stage = Stage(scene(rate=5.0, limits=Limits(under_keel=3.0)))
    stage.alarms._keel = lambda: under
    stage.loop.run(2.0)
    assert [(one.cause.identifier, one.cause.priority) for one in stage.alarms.standing()] == [(10051, "A")] * raised


@pytest.mark.parametrize(("angle", "raised"), [(4.0, False), (6.0, True)])
def test_a_rudder_apart_from_its_order_by_more_than_its_limit_for_five_seconds(angle, raised):
    stage = Stage(scene(rate=5.0, piloted=False, faults=(Fault("jammed", "delta", 1.0),)))
    stage.loop.run(2.0)
    stage.loop.order("own", "delta", angle * DEG)
    stage.loop.run(4.5)
    assert not stage.alarms.standing()
    stage.loop.run(3.0)
    found = [(one.cause.text, one.cause.identifier) for one in stage.alarms.standing()]
    assert found == [("RUDDER RESPONSE", 10021)] * raised


@pytest.mark.slow
def test_a_rudder_that_creeps_is_stuck_and_one_that_moves_is_not():
    """Within five seconds a rudder that is on its way goes at least 2.5 deg: here .4 and .6 deg a second."""
    for rate, raised in ((0.4, True), (0.6, False)):
        stage = Stage(scene(rate=5.0, piloted=False, faults=(Fault("slow", "delta", 1.0, rate=rate * DEG),)))
        stage.loop.run(2.0)
        stage.loop.order("own", "delta", 30.0 * DEG)
        stage.loop.run(20.0)
        assert bool(stage.alarms.standing()) is raised


def test_a_rudder_that_jams_on_its_way_is_stuck_five_seconds_later():
    stage = Stage(scene(rate=5.0, piloted=False, faults=(Fault("jammed", "delta", 8.0),)))
    stage.loop.run(2.0)
    stage.loop.order("own", "delta", 30.0 * DEG)
    stage.loop.run(8.0)
    assert 5.0 * DEG < stage.loop.vessels["own"].plant["delta"] < 25.0 * DEG  # it had moved for six seconds
    assert not stage.alarms.standing()
    stage.loop.run(4.0)
    assert [one.cause.text for one in stage.alarms.standing()] == ["RUDDER RESPONSE"]


def test_the_soonest_danger_comes_first():
    late, soon = meeting(0.0, 6000.0), Other("soon", ordinary("s", 90.0, 5.0), Sailing(1500.0, 0.0, math.pi, 5.0))
    stage = Stage(scene(late, soon, rate=2.0))
    assert [one.name for one in stage.contacts.dangerous()] == ["soon", "other"]
    stage.loop.run(2.0)
    assert {one.cause.text for one in stage.alarms.standing()} == {"CPA 01 other", "CPA 02 soon"}


def test_a_ship_that_is_numbered_already_is_named_once_and_only_the_wire_cuts_the_name():
    ships = [Other(name, ordinary("s", 90.0, 5.0), Sailing(1500.0, k, math.pi, 5.0))
             for k, name in enumerate(("1 a ship of the command line", "2", "11 eleven"))]  # fmt: skip
    stage = Stage(scene(*ships, rate=2.0))
    stage.loop.run(2.0)
    causes = sorted((one.cause for one in stage.alarms.standing()), key=lambda one: one.instance)
    assert [one.text for one in causes] == ["CPA 1 a ship of the command line", "CPA 2", "CPA 03 11 eleven"]
    assert causes[0].title == "CPA 1 a ship of"


# --- faults ---

UNITS = {
    ("gnss", "course"): DEG,
    ("gyro", "heading"): DEG,
    ("rate_gyro", "rate"): DEG,
    ("anemometer", "direction"): DEG,
}


@pytest.mark.parametrize("kind", ["jump", "drift"])
@pytest.mark.parametrize(("of", "name"), [(of, name) for of, names in INSTRUMENTS.items() for name in names])
def test_each_value_of_an_instrument_is_wrong_by_what_was_said(of, name, kind):
    """From 4 s on by 3 units, or by 3 units for each second since."""
    inner, unit = INSTRUMENTS[of][name]
    assert unit == UNITS.get((of, name), 1.0)
    stage = Stage(scene(rate=5.0, faults=(Fault(kind, of, 4.0, 6.0, {inner: 3.0 * unit}),)))
    vessel = stage.loop.vessels["own"]
    stage.loop.run(8.0)
    assert 0 in stage.faults.since
    truth = Reading(of, 8.0, {inner: 0.25, "other": 7.0})
    (altered,) = stage.faults._alter([truth])
    grown = 3.0 * unit * (1.0 if kind == "jump" else 8.0 - stage.faults.since[0])
    assert altered.values == {inner: pytest.approx(0.25 + grown), "other": 7.0}
    assert stage.faults.since[0] == pytest.approx(4.0, abs=0.21)
    stage.loop.run(3.0)
    assert not stage.faults.since
    assert vessel.altered([truth]) == [truth]


def test_a_frozen_instrument_repeats_what_it_said_last_and_no_other_does():
    stage = Stage(scene(rate=5.0, faults=(Fault("frozen", "gyro"), Fault("silent", "rate_gyro"))))
    said = [Reading("gyro", float(k), {"psi": 0.1 * k}) for k in range(5)]
    other = Reading("gnss", 2.0, {"x": 9.0})
    assert stage.faults._alter([said[0], said[1]]) == [said[0], said[1]]
    stage.faults.set(stage.loop, 0, True)
    found = stage.faults._alter([said[2], other, said[3]])
    assert [(one.kind, one.t, dict(one.values)) for one in found] == [
        ("gyro", 2.0, {"psi": pytest.approx(0.1)}),
        ("gnss", 2.0, {"x": 9.0}),
        ("gyro", 3.0, {"psi": pytest.approx(0.1)}),
    ]
    stage.faults.set(stage.loop, 0, False)
    stage.faults.set(stage.loop, 1, True)
    assert stage.faults._alter([said[4], Reading("rate_gyro", 4.0, {"r": 1.0})]) == [said[4]]
    stage.faults.set(stage.loop, 0, True)  # again: it freezes at what was said since
    (again,) = stage.faults._alter([said[0]])
    assert again.values == said[4].values
    with pytest.raises(RefusalError, match="no such fault"):
        stage.faults.set(stage.loop, 2, True)


@pytest.mark.parametrize(("at", "lasts"), [(0.0, None), (3.0, 2.0), (3.1, 0.05)])
def test_a_fault_begins_and_ends_at_its_times(at, lasts):
    stage = Stage(scene(rate=5.0, faults=(Fault("silent", "gyro", at, lasts),)))
    stage.loop.run(12.0)
    begins, *ends = [event.t for event in stage.loop.events if event.kind == "fault"]
    assert at - 1e-9 <= begins <= at + 0.2 + 1e-9
    assert len(ends) == (lasts is not None)
    if lasts is not None:
        assert begins + lasts - 1e-9 <= ends[0] <= begins + lasts + 0.2 + 1e-9


@pytest.mark.slow
def test_a_ferry_is_where_it_should_be():
    """The traffic of these scenes holds its speed and its line, on which the closed forms above rest."""
    stage = Stage(scene(FERRY, rate=5.0))
    stage.loop.run(100.0)
    plant: Any = stage.loop.vessels["ferry"].plant
    assert (plant["x"], plant["y"]) == (pytest.approx(3000.0, abs=1e-6), pytest.approx(2200.0, abs=1e-6))
