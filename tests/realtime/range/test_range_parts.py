"""Stage, sky, pilots and reports of a range: closed forms, other decoders, and the tables of the standards."""

from __future__ import annotations

import cmath
import math
from copy import deepcopy
from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pynmeagps import NMEAReader

from scenes import DEG, FERRY, PLACE, Criteria, Fault, Limits, Weather, on_wire, scene
from seatrial.core.constants import KNOT, MILE
from seatrial.data.nmea.sentences import SENTENCES, Sentence, decode, encode
from seatrial.environment import CALM, Uniform
from seatrial.environment.weather import Gust
from seatrial.manoeuvres.track import legs
from seatrial.realtime.on_wire import Lockstep
from seatrial.realtime.range.alerts import Alarm, Cause
from seatrial.realtime.range.judge import Judge
from seatrial.realtime.range.panel import Panel
from seatrial.realtime.range.pilots import OwnPilot, Sight
from seatrial.realtime.range.reports import REPORTED, _name, interval
from seatrial.realtime.range.scenario import Other, Sailing, Scenario, ordinary
from seatrial.realtime.range.schema import AlarmsTable, CriteriaTable, FaultTable, ScenarioFile, WeatherTable
from seatrial.realtime.range.stage import Stage

NOON = 1_800_000_000.0  # 2027-01-15 08:00 UTC


# --- stage ---


@pytest.mark.slow
def test_a_stage_is_fitted_as_its_ship_and_scenario_say() -> None:
    """The stern is half a length aft; usual instruments have the antenna .4 L aft, exact ones at midship."""
    for usual, ahead in ((False, 0.0), (True, -60.0)):
        stage, _ = on_wire(scene(usual=usual, variation=0.1, epoch=NOON), simulator=usual)
        fit = stage.fittings
        assert fit.antenna == (pytest.approx(ahead), 0.0)
        assert (fit.stern, fit.variation, fit.mmsi, fit.epoch) == (-75.0, 0.1, 211000001, NOON)
        assert (fit.datum, fit.simulator, fit.mode) == (PLACE, usual, "S" if usual else "A")
        assert fit.length == 150.0
    assert Stage(scene(name="kvlcc2")).fittings.transducer == pytest.approx(20.8)
    assert not Stage(scene()).fittings.simulator


@pytest.mark.slow
def test_a_commander_is_silent_after_ten_seconds_and_a_run_ends_at_its_time() -> None:
    stage, _ = on_wire(scene(rate=2.0, duration=30.0))
    assert stage.on_wire is not None
    assert stage.on_wire.conning.hold == 10.0
    stage.run(12.0)
    assert stage.loop.t == pytest.approx(12.0)
    stage.run()
    assert stage.loop.t == pytest.approx(30.0)
    for said in stage.told():
        assert len(said) == 4


def test_a_run_ends_when_the_last_waypoint_is_abeam_or_the_ship_fails() -> None:
    stage = Stage(scene(rate=2.0, route=((100.0, 0.0),)))
    stage.run()
    assert stage.loop.t == pytest.approx(100.0 / 8.0, abs=0.51)
    stage = Stage(scene(rate=2.0))
    stage.loop.after(lambda loop: setattr(loop.vessels["own"], "failure", "gone") if loop.t > 4.9 else None)
    stage.run()
    assert stage.loop.t == pytest.approx(5.0, abs=0.51)


def test_corners_count_three_lengths_before_their_waypoint() -> None:
    """For the judge, the track pilot and another ship alike: 450 m of 150 m long ships, 270 m of 90 m."""
    route = ((2000.0, 0.0), (2000.0, 2000.0))
    there = Other("coaster", ordinary("coaster", 90.0, 6.0),
                  Sailing(0.0, 900.0, 0.0, 6.0, ((400.0, 900.0), (400.0, 4000.0))))  # fmt: skip
    stage = Stage(scene(there, route=route, rate=2.0))
    assert stage.pilot is not None
    for guide in (stage.judge._guide, stage.pilot.guide):
        guide.across(1549.0, 0.0)
        assert guide.number == 0
        guide.across(1551.0, 0.0)
        assert guide.number == 1
    plant = stage.loop.vessels["coaster"].plant
    while abs(plant["delta"]) < 1e-3:
        stage.loop.step()
    assert plant["x"] == pytest.approx(130.0, abs=6.0)  # two ticks of 3 m on


def test_a_ship_without_a_number_of_its_own_has_one_of_no_country() -> None:
    two = Other("two", ordinary("two", 50.0, 5.0), Sailing(5000.0, 0.0, 0.0, 5.0))
    numbered = Other("three", ordinary("three", 50.0, 5.0), Sailing(7000.0, 0.0, 0.0, 5.0, mmsi=265000001))
    stage = Stage(scene(FERRY, two, numbered))
    assert [stage.mmsi(name) for name in ("ferry", "two", "three")] == [200000001, 200000002, 265000001]


def test_rudders_are_watched_and_azimuths_are_not() -> None:
    assert Stage(scene(name="kvlcc2")).alarms._rudders == ("delta",)
    assert Stage(scene(name="milliampere", piloted=False, route=())).alarms._rudders == ()


def test_off_the_route_is_known_only_on_a_route() -> None:
    stage = Stage(scene(rate=2.0))
    assert stage._across() is None  # nothing read yet
    stage.loop.step()
    assert stage._across() == pytest.approx(0.0, abs=1e-6)
    bare = Stage(scene(rate=2.0, route=()))
    bare.loop.step()
    assert bare._across() is None
    assert bare._keel() == math.inf
    assert not bare._deaf()


def test_two_ships_differ_in_the_digest_by_their_last_bit() -> None:
    stages = [Stage(scene(FERRY)) for _ in range(2)]
    one, two = (stage.digest for stage in stages)
    assert one == two
    assert len(one) == 16
    stages[0].loop.step()
    assert stages[0].digest != two


# --- sky ---


def test_weather_by_time_is_linear_between_its_keys_in_every_component() -> None:
    def around(*values: float) -> Any:
        return CALM._replace(**dict(zip(("wind_x", "current_y", "per_depth"), values, strict=True)))

    first, second, third = around(1.0, 2.0, 0.1), around(5.0, -2.0, 0.2), around(-3.0, 4.0, 0.0)
    sky = Stage(scene(weather=(Weather(0.0, 0.0, first), Weather(10.0, 20.0, second), Weather(40.0, 0.0, third)))).sky
    for t, values in ((0.0, (1.0, 2.0, 0.1)), (10.0, (1.0, 2.0, 0.1)), (15.0, (2.0, 1.0, 0.125)),
                      (30.0, (5.0, -2.0, 0.2)), (39.9, (5.0, -2.0, 0.2)), (40.0, (-3.0, 4.0, 0.0))):  # fmt: skip
        found = sky.at(t)
        assert (found.wind_x, found.current_y, found.per_depth) == pytest.approx(values)


@pytest.mark.parametrize("gamma", [0.0, 0.5 * math.pi, 2.0, -2.5])
def test_gusts_are_along_and_across_the_wind_of_the_moment(gamma: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Turned with the wind: a complex number of the same size for each direction."""
    monkeypatch.setattr(Gust, "gusts", lambda self, t, U: (0.1 * U * np.cos(t), 0.05 * U * np.sin(t)))
    sky = Stage(scene(weather=(Weather(0.0, 0.0, Uniform(10.0, gamma).now()),), gusts="davenport")).sky
    for t in (0.0, 1.3, 7.0):
        found = sky.at(t)
        wanted = complex(10.0 + math.cos(t), 0.5 * math.sin(t)) * cmath.exp(1j * gamma)
        assert complex(found.wind_x, found.wind_y) == pytest.approx(wanted)
    calm = Stage(scene(gusts="davenport")).sky.at(3.0)
    assert (calm.wind_x, calm.wind_y) == (0.0, 0.0)


def test_weather_is_set_for_every_ship_when_it_changes_and_not_else(monkeypatch: pytest.MonkeyPatch) -> None:
    stage = Stage(scene(FERRY, rate=2.0, weather=(Weather(3.0, 0.0, Uniform(U_C=1.0).now()),)))
    set_for: list[tuple[str, float]] = []
    surround = stage.loop.surround
    monkeypatch.setattr(stage.loop, "surround",
                        lambda name, now: (set_for.append((name, now.current_x)), surround(name, now)))  # fmt: skip
    stage.loop.run(6.0)
    assert set_for == [("own", 1.0), ("ferry", 1.0)]
    sky = stage.sky
    assert sky.snapshot() is False
    sky.hold()
    assert sky.snapshot() is True
    sky.tick(stage.loop)
    sky.restore(False)
    sky.tick(stage.loop)  # restored: what was set is not known, so it is set again
    assert len(set_for) == 4
    sky.hold()
    sky.reset()
    assert not sky.held
    sky.tick(stage.loop)
    assert len(set_for) == 6


# --- pilots ---


def test_the_line_of_sight_learns_an_offset_by_its_law() -> None:
    """Borhaug (2008): the integral grows by Delta y / (Delta^2 + (y + sigma int)^2), here with sigma = U/8."""
    sight, ahead, speed, dt = Sight(300.0, 8.0), 300.0, 8.0, 0.5
    integral = 0.0
    for y in (50.0, -20.0, 120.0, 299.0, 301.0, -5000.0, 10.0):
        aim = y + speed / 8.0 * integral
        assert sight.aim(y, dt) == pytest.approx(aim)
        if abs(y) < ahead:
            integral += dt * ahead * y / (ahead**2 + aim**2)
        assert sight.integral == pytest.approx(integral)


def test_a_pilot_waits_for_its_instruments_steers_while_active_and_is_saved() -> None:
    """To port of its line it gives starboard rudder; handed over, it forgets what it has learnt."""
    stage = Stage(scene(piloted=False, rate=2.0))
    plant = stage.loop.vessels["own"].plant
    pilot = OwnPilot(stage.loop, "own", legs([(0.0, 40.0), (9000.0, 40.0)]), True)
    stage.loop.vessels["own"].readings.clear()
    pilot.tick(stage.loop)
    assert pilot.across is None
    stage.loop.run(3.0)
    assert plant["delta_cmd"] > 0.0
    assert pilot.across == pytest.approx(-40.0 + plant["y"], abs=0.5)
    law = Sight(pilot.control.ahead, 8.0)
    for _ in range(6):  # the ship has hardly moved: six ticks of half a second with readings
        law.aim(-40.0, 0.5)
    assert pilot._sight.integral == pytest.approx(law.integral, rel=0.05, abs=0.02)
    assert pilot._sight.integral < 0.0
    saved = pilot.snapshot()
    stage.loop.run(2.0)
    later = pilot.snapshot()
    pilot.restore(saved)
    assert pilot.snapshot() == saved != later
    pilot.active = False
    stage.loop.run(2.0)
    assert pilot._sight.integral == 0.0
    assert pilot.across is not None
    pilot.reset()
    assert (pilot.across, pilot.active) == (None, False)


@pytest.mark.slow
def test_another_ship_is_steered_to_its_line_from_either_side() -> None:
    for side in (-1.0, 1.0):
        there = Other("other", ordinary("other", 90.0, 6.0),
                      Sailing(2000.0, 2000.0, 0.0, 6.0, ((9000.0, 2000.0 + 700.0 * side),)))  # fmt: skip
        stage = Stage(scene(there, rate=2.0))
        stage.loop.run(2.0)
        assert stage.loop.vessels["other"].plant["delta_cmd"] * side > 0.0
        saved = stage.loop.snapshot()
        stage.loop.run(20.0)
        there_then = [stage.loop.vessels["other"].plant[name] for name in ("x", "y", "psi", "delta")]
        stage.loop.restore(saved)
        stage.loop.run(20.0)
        assert [stage.loop.vessels["other"].plant[name] for name in ("x", "y", "psi", "delta")] == there_then


# --- reports ---


@pytest.mark.parametrize(("knots", "per_minute", "class_b", "seconds"), [
    (13.9, 0.0, False, 10.0), (14.1, 0.0, False, 6.0), (22.9, 0.0, False, 6.0), (23.1, 0.0, False, 2.0),
    (13.9, 9.9, False, 10.0), (13.9, 10.1, False, 10.0 / 3.0), (14.1, -9.9, False, 6.0), (14.1, -10.1, False, 2.0),
    (1.9, 50.0, True, 180.0), (2.1, 50.0, True, 30.0),
])  # fmt: skip
def test_intervals_change_at_the_bounds_of_the_recommendation(knots, per_minute, class_b, seconds) -> None:
    """ITU-R M.1371-5, table 1; a turn counts from 10 degrees a minute on."""
    assert interval(knots * KNOT, per_minute * DEG / 60.0, class_b) == pytest.approx(seconds)


def times(wire: Any, stage: Stage, kind: str, seconds: float) -> list[float]:
    """When sentences of a kind go out."""
    found = list[float]()
    for _ in range(round(seconds * stage.loop.rate)):
        wire.out.clear()
        stage.loop.step()
        found += [round(stage.loop.t, 3)] * len(wire.said(kind))
    return found


@pytest.mark.slow
def test_the_radar_reports_each_two_seconds_and_a_transponder_in_its_turn() -> None:
    """The first of two ships reports from 1 s on, the second from 2 s on, each 10 s below 14 kn, 6 s above."""
    fast = Other("fast", ordinary("fast", 60.0, 9.0), Sailing(9000.0, 0.0, 0.0, 9.0), radar=False)
    slow = Other("slow", ordinary("slow", 60.0, 5.0), Sailing(7000.0, 0.0, 0.0, 5.0))
    stage, wire = on_wire(scene(fast, slow, rate=1.0), rates={"HDT": 0.01})
    assert times(wire, stage, "TTM", 9.0) == [1.0, 3.0, 5.0, 7.0, 9.0]
    stage, wire = on_wire(scene(fast, slow, rate=1.0), rates={"HDT": 0.01})
    said = times(wire, stage, "VDM", 24.0)  # static data are two sentences
    assert said == [1.0] * 3 + [2.0] * 3 + [7.0, 12.0, 13.0, 19.0, 22.0]


@pytest.mark.slow
def test_static_data_come_again_after_six_minutes() -> None:
    pyais = pytest.importorskip("pyais")
    stage, wire = on_wire(scene(FERRY, rate=1.0, piloted=False), only=("VDM",), rates={"HDT": 0.001})
    found = list[float]()
    for _ in range(725):
        wire.out.clear()
        stage.loop.step()
        parts = [line for line in wire.said("VDM") if line.split(b",")[1] == b"2"]
        if parts:
            found.append(stage.loop.t)
            static = pyais.decode(*parts)
    assert found == [1.0, 361.0, 721.0]
    assert (static.to_bow, static.to_stern) == (75, 75)
    assert static.shipname == "FERRY"


@pytest.mark.parametrize(("psi", "u", "v_m"), [(0.4, 5.0, 0.0), (3.0, 5.0, 1.5), (-1.0, 0.5, -2.0)])
def test_a_transponder_tells_place_and_way_over_ground(psi: float, u: float, v_m: float) -> None:
    stage, _ = on_wire(scene(FERRY))
    state = {"x": 1200.0, "y": -700.0, "psi": psi, "u": u, "v_m": v_m, "r": 0.01}
    found = stage.reports._motion(7.0, state)  # type: ignore[arg-type]
    way = complex(u, v_m) * cmath.exp(1j * psi)
    assert found["U"] * cmath.exp(1j * found["chi"]) == pytest.approx(way)
    assert PLACE.north_east(found["latitude"], found["longitude"]) == pytest.approx((1200.0, -700.0))
    assert (found["t"], found["psi"], found["r"]) == (7.0, psi, 0.01)


def test_the_radar_places_a_contact_by_its_bearing_from_midship_of_what_the_receiver_says() -> None:
    """A position 100 m too far north moves the place of the contact as much; an antenna aft does not."""
    stage, _ = on_wire(scene(FERRY, rate=2.0, usual=True, faults=(Fault("jump", "gnss", 0.0, None, {"x": 100.0}),)))
    assert stage.on_wire is not None
    stage.loop.run(5.0)
    seen, latest = stage.contacts.seen["ferry"], dict(stage.on_wire.latest)
    for psi, (ahead, aside) in ((0.0, (-60.0, 0.0)), (0.7, (-60.0, 5.0)), (-2.0, (10.0, -20.0))):
        stage.on_wire.fittings = SimpleNamespace(datum=PLACE, antenna=(ahead, aside), epoch=NOON)  # type: ignore
        stage.on_wire._voice.latest["psi"] = psi
        found = stage.reports._placed(5.0, seen, 0.2)
        at = complex(*PLACE.north_east(latest["latitude"], latest["longitude"]))
        at += seen.distance * cmath.exp(1j * (seen.bearing + 0.2)) - complex(ahead, aside) * cmath.exp(1j * psi)
        where = PLACE.north_east(found["targetlat"], found["targetlon"])  # type: ignore[arg-type]
        assert complex(*where) == pytest.approx(at, abs=0.02)
        assert (found["targetnum"], found["status"], found["time"]) == (1, "T", pytest.approx(8 * 3600.0 + 5.0))


def test_a_track_says_how_near_and_when_and_the_time_of_day() -> None:
    epoch = datetime(2026, 5, 4, 13, 27, 41, tzinfo=UTC).timestamp()
    stage, wire = on_wire(scene(FERRY, rate=2.0, epoch=epoch))
    stage.loop.run(3.5)
    data = wire.said("TTM")[-1]
    ttm, said = NMEAReader.parse(data + b"\r\n", validate=1), data.split(b",")
    assert said[14] == b"132743.50"  # of the second sweep
    assert (ttm.targetnum, ttm.speedu, ttm.targetname, ttm.targetstatus) == (1, "N", "ferry", "T")
    seen = stage.contacts.seen["ferry"]
    for tcpa, told in ((-1e9, -9999.0), (1e9, 9999.0), (120.0, 2.0)):
        contact = type(seen)(**{**vars(seen), "tcpa": tcpa})
        found = stage.reports._tracked(0.0, contact, 0.25)
        assert found["timetoCPA"] == told
        assert found["targetbearing"] == pytest.approx(math.degrees(seen.bearing + 0.25) % 360.0)
        assert found["targetcourse"] == pytest.approx(math.degrees(seen.chi + 0.25) % 360.0)
        assert found["targetdist"] == pytest.approx(seen.distance / MILE)
        assert found["targetspeed"] == pytest.approx(seen.U / KNOT)
        assert found["closestapproach"] == pytest.approx(seen.cpa / MILE)


ALERTS = {(10001, 2): (102, "A"), (10011, 1): (12, "B"), (10012, 1): (13, "B"), (10021, 1): (21, "B"),
          (10031, 1): (32, "B"), (10041, 1): (42, "B")}  # fmt: skip
"""What the documentation lists: number in ALR, and category in ALF."""


@pytest.mark.parametrize("state", ["V", "A", "U", "N"])
@pytest.mark.parametrize("key", ALERTS)
def test_an_alarm_is_told_in_both_forms(key: tuple[int, int], state: Any) -> None:
    """IEC 62923-1: V and A are active, V and U not acknowledged."""
    stage, _ = on_wire(scene(FERRY, epoch=NOON))
    alarm = Alarm(Cause(*key, "W", "SOMETHING"), state, 65.5, 7)
    alf, alr = (decode(line) for line in stage.reports._alert(alarm))
    number, category = ALERTS[key]
    assert (alf.kind, alr.kind) == ("ALF", "ALR")
    assert {name: alf[name] for name in ("numSen", "senNum", "seqmid", "escalationctr", "revisionctr")} == {
        "numSen": 1, "senNum": 1, "seqmid": 1, "escalationctr": 0, "revisionctr": 7}  # fmt: skip
    assert (alf["alertcat"], alf["alertpriority"], alf["alertstate"], alf["mfrcode"]) == (category, "W", state, "RNG")
    assert (alf["alertid"], alf["alertinst"], alf["alerttxt"]) == (*key, "SOMETHING")
    assert alf["timelastchange"] == alr["timealarmchange"] == pytest.approx(8 * 3600.0 + 65.5)
    assert alr["alarmnum"] == number
    assert alr["alarmcond"] == ("A" if state in "VA" else "V")
    assert alr["alarmstate"] == ("V" if state in "VU" else "A")
    for _ in range(9):
        *_, last = [decode(line)["seqmid"] for line in stage.reports._alert(alarm) if line[3:6] == b"ALF"]
    assert last == 0  # it counts from 0 to 9


def test_an_alarm_goes_out_when_it_changes_and_each_half_minute_while_it_stands() -> None:
    stage, _ = on_wire(scene(rate=1.0))
    alarm = Alarm(Cause(10041, 1, "W", "SILENT"), "V", 0.0)
    stage.alarms.alarms[10041, 1] = alarm
    loop: Any = SimpleNamespace(t=0.0)

    def said(t: float) -> int:
        loop.t = t
        return len(list(stage.reports._alerts(loop)))

    assert [said(t) for t in (0.0, 1.0, 29.0, 30.0, 31.0, 59.0, 60.0)] == [2, 0, 0, 2, 0, 0, 2]
    alarm.turn("A", 61.0)
    assert [said(t) for t in (61.0, 62.0)] == [2, 0]
    saved = deepcopy(stage.reports.snapshot())
    alarm.turn("N", 63.0)
    assert [said(t) for t in (63.0, 64.0, 99.0, 999.0)] == [2, 0, 0, 0]
    stage.reports.restore(saved)
    assert said(63.0) == 2
    assert stage.reports.snapshot() == {**saved, "sent": {"10041 1": (3, 63.0)}, "count": saved["count"] + 1}


@pytest.mark.parametrize(("fields", "refused"), [
    ({"alertid": 10041, "alertnum": 1, "alertcmd": "A"}, 0), ({"alertid": 10041, "alertnum": 1, "alertcmd": "Q"}, 0),
    ({"alertid": 10041, "alertnum": 1, "alertcmd": "A", "mfrcode": "RNG"}, 0),
    ({"alertid": 10041, "alertnum": 1, "alertcmd": "A", "mfrcode": "XYZ"}, 1),
    ({"alertid": 10041, "alertnum": 2, "alertcmd": "A"}, 1), ({"alertid": 10031, "alertnum": 1, "alertcmd": "A"}, 1),
    ({"alertid": 10041, "alertnum": 1, "alertcmd": "S"}, 1), ({"alertnum": 1, "alertcmd": "A"}, 1),
])  # fmt: skip
def test_what_acknowledges_and_what_is_refused(fields: dict[str, Any], refused: int) -> None:
    """A acknowledges, Q asks for the alarm again; anything else is refused and answered by ARC."""
    stage, wire = on_wire(scene(rate=1.0), rates={"HDT": 1.0})
    alarm = Alarm(Cause(10041, 1, "W", "SILENT"), "V", 0.0)
    stage.alarms._deaf = lambda: True
    stage.alarms.alarms[10041, 1] = alarm
    stage.loop.step()
    wire.out.clear()
    blank = dict.fromkeys(SENTENCES["ACN"].fields) | {"status": "C"}
    wire.waiting.append(encode(Sentence("VR", "ACN", {**blank, **fields})))
    stage.loop.step()
    stage.loop.step()
    assert stage.reports.refused == refused
    assert alarm.state == ("A" if not refused and fields["alertcmd"] == "A" else "V")
    assert len(wire.said("ARC")) == refused
    assert len(wire.said("ALF")) == (not refused)


@pytest.mark.parametrize(("number", "state"), [(42, "A"), (41, "V"), (43, "V")])
def test_the_older_acknowledgement_names_the_alarm_by_its_number(number: int, state: str) -> None:
    stage, wire = on_wire(scene(rate=1.0), rates={"HDT": 1.0})
    alarm = stage.alarms.alarms[10041, 1] = Alarm(Cause(10041, 1, "W", "SILENT"), "V", 0.0)
    stage.alarms._deaf = lambda: True
    wire.waiting.append(encode(Sentence("VR", "ACK", {"alarmid": number})))
    stage.loop.step()
    assert (alarm.state, stage.reports.refused) == (state, int(state == "V"))
    assert not wire.said("ARC")


def test_only_the_sentences_that_were_asked_for_go_out() -> None:
    for only in REPORTED[:5]:
        stage, wire = on_wire(scene(FERRY, rate=1.0, limits=Limits(cpa=500.0, tcpa=900.0)), only=(only,), rates={})
        stage.loop.run(4.0)
        assert {line[3:6] for data in wire.out for line in data.splitlines()} == {only.encode()}


def test_a_ship_without_a_transponder_or_that_failed_says_nothing() -> None:
    dumb = Other("dumb", ordinary("dumb", 60.0, 5.0), Sailing(7000.0, 0.0, 0.0, 5.0), "none")
    stage, wire = on_wire(scene(dumb, FERRY, rate=1.0), only=("VDM",), rates={})
    stage.loop.run(5.0)
    assert len(wire.said("VDM")) == 3  # of the ferry alone
    stage, wire = on_wire(scene(FERRY, rate=1.0), only=("VDM",), rates={})
    stage.loop.vessels["ferry"].failure = RuntimeError("gone")  # type: ignore[assignment]
    stage.loop.run(5.0)
    assert not wire.said("VDM")


def test_names_of_targets_are_twelve_plain_characters() -> None:
    assert _name("Pötzlinger Länge 12") == "P_tzlinger L"
    assert _name("a,b*c$d") == "a_b_c_d"
    assert _name("   ") is None


# --- judge, faults and lock step ---


@pytest.mark.slow
def test_a_corner_is_judged_by_the_nearer_leg_until_the_heading_counts() -> None:
    """A ship that goes straight on over a corner of 90 deg: from the corner on its distance from the old leg counts.

    After `settle` seconds it is the new leg's, whose distance to port grows by 8 m/s.
    """
    stage = Stage(scene(route=((1000.0, 0.0), (1000.0, 5000.0)), piloted=False, rate=2.0))
    judge = Judge(stage.loop, "own", legs([(0.0, 3.0), (1000.0, 3.0), (1000.0, 5000.0)]), 200.0, Criteria(settle=30.0))
    stage.loop.run(129.0)  # the corner counts from x = 800 m on, at 100 s
    assert judge.cross_track == pytest.approx(3.0, abs=1e-6)
    assert judge.heading_error == pytest.approx(0.0, abs=1e-9)
    stage.loop.run(2.0)
    assert judge.heading_error == pytest.approx(0.5 * math.pi)
    stage.loop.run(19.0)
    assert judge.cross_track == pytest.approx(8.0 * 150.0 - 1000.0, abs=5.0)
    saved, again = judge.snapshot(), Judge(stage.loop, "own", judge._guide.route, 200.0, Criteria(settle=30.0))
    again.restore(saved)
    assert again.snapshot() == saved
    assert again.cross_track_rms == judge.cross_track_rms
    judge.reset()
    assert (judge.cross_track, judge.heading_error, judge.arrived, judge.under_keel) == (0.0, None, None, math.inf)
    assert judge.cross_track_rms == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_after_a_corner_the_distance_from_the_leg_before_counts_as_a_distance(side: float) -> None:
    """A leg that leaves the way of the ship by 50 m in 1000: in the corner the distance from it grows on."""
    stage = Stage(scene(piloted=False, rate=2.0))
    route = legs([(0.0, 0.0), (1000.0, side * 50.0), (1000.0, side * 5000.0)])
    judge = Judge(stage.loop, "own", route, 200.0, Criteria(settle=500.0))
    stage.loop.run(150.0)
    assert judge._guide.number == 1
    assert judge.cross_track == pytest.approx(8.0 * 150.0 * math.sin(math.atan(0.05)), rel=1e-3)


def test_an_answer_is_waited_for_as_long_as_it_may_take(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock is moved by hand: 3 s pass in each wait, of which none is longer than .2 s of the wire's."""
    clock, waits = [100.0], list[float]()
    monkeypatch.setattr("seatrial.realtime.on_wire.time", SimpleNamespace(monotonic=lambda: clock[0]))
    stage, wire = on_wire(scene(rate=1.0))
    assert stage.on_wire is not None

    def wait(seconds: float) -> None:
        waits.append(seconds)
        clock[0] += 3.0
        if len(waits) == 3:
            wire.waiting.append(encode(Sentence("AG", "ACK", {"alarmid": 1})))

    monkeypatch.setattr(wire, "wait", wait)
    step = Lockstep(stage.loop, stage.on_wire)
    step.meet()
    assert (waits, step.waited) == ([0.2] * 3, 9.0)
    assert step._answered("wire") is False
    assert (len(waits), step.waited) == (7, 21.0)  # 12 s are more than 10 s
    step.alive = lambda: False
    assert step._answered("wire") is False
    assert step.waited == 21.0


def test_an_order_of_a_link_is_looked_for_every_few_milliseconds(monkeypatch: pytest.MonkeyPatch) -> None:
    """No datagram ends such a wait: one as long as a wire's would let five steps pass in a second."""
    stage, wire = on_wire(scene(rate=1.0))
    on = stage.on_wire
    assert on is not None
    waits = list[float]()

    def wait(seconds: float) -> None:
        waits.append(seconds)
        wire.waiting.append(encode(Sentence("AG", "ACK", {"alarmid": 1})))  # a sentence is no order of a link
        on.asked += len(waits) == 3

    monkeypatch.setattr(wire, "wait", wait)
    step = Lockstep(stage.loop, on, by="link")
    assert step._answered("link") is True
    assert len(waits) == 3
    assert max(waits) <= 0.01


def test_a_scenario_file_without_a_word_means_what_a_scenario_without_one_does() -> None:
    """Two statements of the same defaults, one in degrees, the other in radians."""
    plain, file = scene(), vars(ScenarioFile)
    assert Scenario("a", 1.0, plain.own).rate == file["rate"] == 10.0
    assert Scenario("a", 1.0, plain.own).seed == file["seed"] == 1
    assert Scenario("a", 1.0, plain.own).epoch == file["start"].timestamp()
    limits, alarms = Limits(), AlarmsTable()
    assert (limits.cpa, limits.tcpa) == (alarms.cpa, alarms.tcpa) == (926.0, 720.0)
    assert math.degrees(limits.rudder) == pytest.approx(alarms.rudder) == pytest.approx(5.0)
    assert Criteria().settle == CriteriaTable().settle == 60.0
    assert FaultTable(kind="silent", of="gyro").at is Fault("silent", "gyro").at is None


def test_texts_of_alarms_have_sixteen_plain_characters_and_rudders_their_numbers() -> None:
    assert Cause(10001, 1, "A", "CPA 01 M\u00f6we, the long one").title == "CPA 01 M we  the"
    stage = Stage(scene(name="kvlcc2"))
    stage.alarms._stuck = lambda control, t: True  # type: ignore[method-assign]
    assert [(one.identifier, one.instance) for one in stage.alarms._causes(0.0)] == [(10021, 1)]


def test_the_page_knows_the_place_the_route_and_the_numbers_of_the_others() -> None:
    stage, _ = on_wire(scene(FERRY, epoch=NOON, variation=0.1), page=True)
    hello = Panel(stage).hello()
    assert (hello["datum"], hello["epoch"], hello["variation"]) == ([35.0, 139.7], NOON, 0.1)
    assert (hello["limits"], hello["mmsi"], hello["title"]) == ({"cpa": 926.0, "tcpa": 720.0}, {"ferry": 0}, "a test")
    assert hello["known"] == ("wire", "pilot", "page")
    stage.loop.run(1.0)
    frame = Panel(stage).frame()
    assert (frame["leg"], frame["depth"], frame["arrived"]) == ([0, pytest.approx(0.0, abs=1e-6)], None, None)
    assert frame["place"] == pytest.approx(PLACE.place(8.0, 0.0), abs=1e-6)
    assert frame["wire"] == ["", "none", False, 1]


def test_the_latest_alarm_stands_first_and_weather_without_a_time_is_of_the_start() -> None:
    stage = Stage(scene())
    for k, t in enumerate((5.0, 9.0, 7.0)):
        stage.alarms.alarms[k, 1] = Alarm(Cause(k, 1, "W", "A"), "V", t)
    assert [one.changed for one in stage.alarms.standing()] == [9.0, 7.0, 5.0]
    assert (WeatherTable().at, WeatherTable().over) == (0.0, 0.0)
