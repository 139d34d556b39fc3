"""A scenario in a loop: weather over time, pilots, faults, contacts, alarms, criteria, and who steers."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest

from scenes import DEG, FERRY, Criteria, Fault, Limits, Weather, on_wire, scene
from seatrial.core.errors import LoopError, RefusalError, RunError
from seatrial.data.nmea.sentences import Sentence, decode, encode
from seatrial.environment import Uniform
from seatrial.realtime.afloat import Voyage, _silence
from seatrial.realtime.on_wire import Lockstep
from seatrial.realtime.range.contacts import Contact, approach
from seatrial.realtime.range.judge import Judged
from seatrial.realtime.range.panel import Panel
from seatrial.realtime.range.scenario import Other, Sailing, ordinary
from seatrial.realtime.range.sky import Sky
from seatrial.realtime.range.stage import Stage
from seatrial.realtime.recording import rerun
from seatrial.ships.files import load


def order(kind: str, **fields: object) -> bytes:
    from seatrial.data.nmea.sentences import SENTENCES

    return encode(Sentence("AG", kind, {**dict.fromkeys(SENTENCES[kind].fields), **fields}))  # type: ignore[arg-type]


def heading(degrees: float) -> bytes:
    return order("HTC", override="V", steermode="H", turnmode="N", cmdheading=degrees, headingref="T", status="C")


# --- weather -----------------------------------------------------------------------------------------------------


def test_weather_changes_in_steps_and_ramps():
    calm, blow = Uniform(4.0, 0.0).now(), Uniform(8.0, 0.5 * math.pi).now()
    stage = Stage(scene(weather=(Weather(0.0, 0.0, calm), Weather(10.0, 0.0, blow), Weather(20.0, 10.0, calm))))
    at = stage.sky.at
    assert at(9.999).wind_x == pytest.approx(4.0)
    assert at(10.0).wind_y == pytest.approx(8.0)
    assert (at(25.0).wind_x, at(25.0).wind_y) == (pytest.approx(2.0), pytest.approx(4.0))
    assert at(1e6) == calm
    stage.loop.run(12.0)
    assert stage.loop.vessels["own"].plant["wind_y"] == pytest.approx(8.0)


@pytest.mark.slow
def test_gusts_have_the_mean_and_the_spread_of_their_spectrum_and_the_same_values_again():
    weather = (Weather(0.0, 0.0, Uniform(10.0, 0.0).now()),)
    skies = [Stage(scene(weather=weather, gusts="davenport", seed=seed)).sky for seed in (3, 3, 4)]
    rows = [[sky.at(2.0 * k).wind_x for k in range(900)] for sky in skies]
    assert rows[0] == rows[1] != rows[2]
    mean = sum(rows[0]) / 900.0
    spread = math.sqrt(sum((one - mean) ** 2 for one in rows[0]) / 900.0)
    assert mean == pytest.approx(10.0, abs=0.4)
    assert spread == pytest.approx(math.sqrt(6.0 * 0.003) * 10.0, rel=0.25)


def test_weather_set_from_the_page_stays():
    stage = Stage(scene(weather=(Weather(5.0, 0.0, Uniform(U_C=1.0).now()),)), page=True)
    Panel(stage).weather()
    stage.loop.run(8.0)
    assert stage.loop.vessels["own"].plant["current_x"] == 0.0


# --- pilots ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("usual", [False, True])
def test_the_track_pilot_takes_out_a_steady_current(usual):
    weather = (Weather(0.0, 0.0, Uniform(U_C=0.8, gamma_C=0.5 * math.pi).now()),)
    stage = Stage(scene(weather=weather, route=((9000.0, 0.0),), duration=1500.0, usual=usual, rate=2.0))
    stage.run()
    plant = stage.loop.vessels["own"].plant
    assert stage.judge.arrived is not None
    assert abs(plant["y"]) < (8.0 if usual else 3.0)


@pytest.mark.slow
def test_another_ship_follows_its_waypoints():
    there = Other("coaster", ordinary("coaster", 90.0, 6.0),
                  Sailing(1000.0, 1000.0, 0.0, 6.0, ((3000.0, 1000.0), (3000.0, 4000.0))))  # fmt: skip
    stage = Stage(scene(there, duration=800.0, rate=2.0))
    stage.loop.run(750.0)
    plant = stage.loop.vessels["coaster"].plant
    assert plant["x"] == pytest.approx(3000.0, abs=20.0)
    assert math.degrees(plant["psi"]) == pytest.approx(90.0, abs=1.0)


def test_a_ship_without_a_rudder_cannot_follow_a_route():
    with pytest.raises(LoopError, match="own: otter has no rudder"):
        Stage(scene(name="otter"))


# --- faults ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_jammed_rudder_stays_whatever_is_ordered_and_obeys_when_it_is_free():
    stage, wire = on_wire(scene(faults=(Fault("jammed", "delta", 20.0, 20.0),)))
    plant, loop = stage.loop.vessels["own"].plant, stage.loop
    wire.waiting.append(order("ROR", stbdrudderorder=10.0, stbdrudderstatus="A", portrudderstatus="V"))
    loop.run(19.0)
    assert math.degrees(plant["delta"]) == pytest.approx(10.0)
    loop.run(5.0)
    wire.waiting.append(order("ROR", stbdrudderorder=-10.0, stbdrudderstatus="A", portrudderstatus="V"))
    loop.run(14.0)
    assert math.degrees(plant["delta"]) == pytest.approx(10.0)
    assert math.degrees(stage.faults.ordered("delta")) == pytest.approx(-10.0)
    loop.run(12.0)
    assert math.degrees(plant["delta"]) == pytest.approx(-10.0)


@pytest.mark.slow
def test_a_slow_rudder_moves_at_its_rate_and_a_lost_propeller_does_not_turn():
    faults = (Fault("slow", "delta", 0.0, rate=0.5 * DEG), Fault("lost", "n_P", 0.0))
    stage, wire = on_wire(scene(name="kvlcc2", faults=faults, route=((20000.0, 0.0),)))
    plant = stage.loop.vessels["own"].plant
    wire.waiting.append(order("ROR", stbdrudderorder=20.0, stbdrudderstatus="A", portrudderstatus="V"))
    stage.loop.run(20.0)
    assert math.degrees(plant["delta"]) == pytest.approx(10.0, abs=0.3)
    stage.loop.run(100.0)
    assert abs(plant["n_P"]) < 1e-6
    assert plant["u"] < 7.5


@pytest.mark.slow
def test_instruments_freeze_jump_drift_and_fall_silent():
    faults = (Fault("frozen", "gyro", 10.0, 10.0), Fault("jump", "gnss", 10.0, 5.0, {"x": 100.0}),
              Fault("drift", "speed_log", 10.0, None, {"u_w": 0.1}), Fault("silent", "rate_gyro", 10.0))  # fmt: skip
    stage, wire = on_wire(scene(faults=faults))
    wire.waiting.append(order("ROR", stbdrudderorder=15.0, stbdrudderstatus="A", portrudderstatus="V"))
    own, found = stage.loop.vessels["own"], {}
    for _ in range(125):
        stage.loop.step()
        for one in own.readings:
            found.setdefault(one.kind, {})[round(one.t, 1)] = one.values | {"true": own.plant["psi"],
                                                                           "true_x": own.plant["x"]}  # fmt: skip
    gyro, gnss = found["gyro"], found["gnss"]
    assert gyro[19.0]["psi"] == gyro[12.0]["psi"] != gyro[19.0]["true"]
    assert gyro[25.0]["psi"] == pytest.approx(gyro[25.0]["true"] % math.tau)
    assert gnss[12.0]["x"] - gnss[12.0]["true_x"] == pytest.approx(100.0)
    assert gnss[20.0]["x"] == pytest.approx(gnss[20.0]["true_x"])
    assert found["speed_log"][20.0]["u_w"] == pytest.approx(8.0 + 1.0, abs=0.05)
    assert max(found["rate_gyro"]) == pytest.approx(10.0, abs=0.21)


@pytest.mark.slow
def test_a_run_with_faults_and_weather_is_reproduced_from_its_recording(tmp_path):
    weather = (Weather(0.0, 0.0, Uniform(10.0, 1.0).now()), Weather(20.0, 10.0, Uniform(U_C=0.5).now()))
    faults = (Fault("jammed", "delta", 15.0, 10.0), Fault("slow", "delta", 30.0, rate=0.3 * DEG))
    stage = Stage(scene(name="kvlcc2", weather=weather, gusts="davenport", faults=faults, usual=True,
                        route=((1000.0, 300.0),)))  # fmt: skip
    record = stage.record(tmp_path / "run.csv")
    stage.run(60.0)
    record.close()
    plant, again = stage.loop.vessels["own"].plant, rerun(tmp_path / "run.csv", stage.scenario.own.ship)
    assert [again[name][-1] for name in ("x", "psi", "delta")] == [plant[name] for name in ("x", "psi", "delta")]


@pytest.mark.slow
def test_a_run_is_the_same_again_and_from_the_middle():
    weather = (Weather(0.0, 0.0, Uniform(10.0, 1.0).now()),)
    said = scene(FERRY, name="kvlcc2", weather=weather, gusts="davenport", usual=True, seed=5,
                 faults=(Fault("frozen", "gyro", 20.0, 10.0),), route=((1000.0, 300.0),))  # fmt: skip
    one, two = Stage(said), Stage(said)
    one.run(40.0)
    saved = one.snapshot()
    one.loop.run(40.0)
    two.loop.restore(saved)
    two.loop.run(40.0)
    three = Stage(said)
    three.run(80.0)
    assert one.digest == two.digest == three.digest
    four = Stage(scene(FERRY, name="kvlcc2", weather=weather, gusts="davenport", usual=True, seed=6,
                       faults=said.faults, route=((1000.0, 300.0),)))  # fmt: skip
    four.run(80.0)
    assert four.digest != one.digest


# --- contacts and criteria -----------------------------------------------------------------------------------------


def test_the_nearest_approach_of_two_straight_lines():
    assert approach(1000.0, 1000.0, 0.0, -10.0) == (pytest.approx(1000.0), pytest.approx(100.0))
    assert approach(0.0, 500.0, 0.0, 5.0) == (pytest.approx(0.0), pytest.approx(-100.0))
    assert approach(300.0, 400.0, 0.0, 0.0) == (pytest.approx(500.0), 0.0)
    assert not Contact("a", 2000.0, 0.0, 5.0, 0.0, 10.0, -5.0).dangerous(500.0, 600.0)
    assert Contact("a", 100.0, 0.0, 5.0, 0.0, 100.0, 0.0).dangerous(500.0, 600.0)


@pytest.mark.slow
def test_a_collision_course_is_told_and_judged():
    wanted = Criteria(passing_distance=500.0, cross_track=10.0, time=500.0, heading_error=5 * DEG)
    said = scene(FERRY, rate=2.0, criteria=wanted)
    stage = Stage(said)
    stage.run()
    passed = stage.wakes.passed(926.0, 720.0)
    judged = {one.name: one for one in stage.judge.judged(passed)}
    assert not judged["passing_distance"].met
    assert judged["passing_distance"].where == "ferry"
    assert not judged["contact"].met
    assert passed["ferry"].t == pytest.approx(375.0, abs=5.0)
    assert judged["cross_track"].met
    assert not judged["time"].met  # 6000 m at 8 m/s
    assert stage.judge.arrived == pytest.approx(750.0, abs=1.0)


def test_a_heading_that_was_never_judged_is_not_met():
    stage = Stage(scene(criteria=Criteria(heading_error=5 * DEG, settle=100.0)))
    stage.run(50.0)
    assert [one.met for one in stage.judge.judged({})] == [False]


# --- alarms --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_an_alarm_is_raised_acknowledged_and_ends():
    stage = Stage(scene(FERRY, rate=2.0, limits=Limits(cpa=500.0, tcpa=200.0)))
    alarms = stage.alarms
    stage.loop.run(170.0)
    assert not alarms.standing()
    stage.loop.run(20.0)
    (alarm,) = alarms.standing()
    assert (alarm.state, alarm.cause.text) == ("V", "CPA 01 ferry")
    alarms.acknowledge(10001, 1, stage.loop.t)
    assert alarm.state == "A"
    with pytest.raises(RefusalError, match="no such alarm"):
        alarms.acknowledge(10001, 1, stage.loop.t)
    stage.loop.run(400.0)
    assert alarm.state == "N"
    assert alarm.revision == 3


@pytest.mark.slow
def test_an_alarm_that_ends_unseen_waits_to_be_acknowledged():
    stage = Stage(scene(FERRY, rate=2.0, limits=Limits(cpa=500.0, tcpa=200.0)))
    stage.loop.run(600.0)
    (alarm,) = stage.alarms.standing()
    assert alarm.state == "U"
    stage.alarms.acknowledge(10001, 1, stage.loop.t)
    assert not stage.alarms.standing()


@pytest.mark.slow
def test_lost_instruments_a_stuck_rudder_and_a_silent_autopilot_raise_alarms():
    faults = (Fault("silent", "gyro", 10.0), Fault("silent", "gnss", 10.0), Fault("jammed", "delta", 5.0))
    stage, wire = on_wire(scene(faults=faults), hold=10.0)
    stage.loop.run(8.0)
    wire.waiting.append(order("ROR", stbdrudderorder=20.0, stbdrudderstatus="A", portrudderstatus="V"))
    stage.loop.run(30.0)
    assert {one.cause.text for one in stage.alarms.standing()} == {
        "HEADING LOST", "POSITION LOST", "RUDDER RESPONSE", "AUTOPILOT SILENT"}  # fmt: skip


@pytest.mark.slow
def test_an_autopilot_that_was_silent_has_not_passed_whatever_the_criteria_say():
    stage, wire = on_wire(scene(rate=2.0), hold=10.0)
    assert _silence(stage) == "", "nobody has steered yet"
    for wait, angle in ((8.0, 20.0), (4.0, 0.0), (28.0, 5.0)):
        stage.loop.run(wait)
        wire.waiting.append(order("ROR", stbdrudderorder=angle, stbdrudderstatus="A", portrudderstatus="V"))
    stage.loop.run(5.0)
    said = _silence(stage)
    first, last = map(float, re.findall(r"\d+", said))
    assert said == f"the autopilot on the wire was silent from {first:.0f} s to {last:.0f} s"
    assert (first, last) == (pytest.approx(23.0, abs=1.0), pytest.approx(41.0, abs=1.0))
    ran = Voyage(stage, {}, (Judged("cross_track", 1.0, 2.0, "m", True),), (), None, said)
    assert (ran.met, ran.document()["met"], ran.document()["failure"]) == (False, False, said)
    assert ran.document()["criteria"][0]["met"] is True, "the run went on to its end"
    assert ran.wanting == said


@pytest.mark.slow
def test_what_a_run_that_was_cut_off_has_not_broken_is_not_judged():
    stage, _ = on_wire(scene(rate=2.0))
    judged = (Judged("cross_track", 1.0, 2.0, "m", True), Judged("time", None, 2.0, "s", False))
    cut = Voyage(stage, {}, judged, (), "no answer within 5 s at 1 s")
    assert [one["met"] for one in cut.document()["criteria"]] == [None, False]
    assert cut.wanting == cut.document()["failure"] == "no answer within 5 s at 1 s"
    assert Voyage(stage, {}, judged, (), None).wanting == "not met: time"


@pytest.mark.slow
def test_a_rudder_that_moves_is_not_stuck():
    stage, wire = on_wire(scene(rate=2.0))
    for _ in range(2):
        for angle in (35.0, -35.0):
            wire.waiting.append(order("ROR", stbdrudderorder=angle, stbdrudderstatus="A", portrudderstatus="V"))
            stage.loop.run(30.0)
    assert not any(one.cause.text.startswith("RUDDER") for one in stage.alarms.alarms.values())


# --- command ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_mariner_overrides_the_wire_and_hands_back():
    stage, wire = on_wire(scene(), page=True)
    panel, plant = Panel(stage), stage.loop.vessels["own"].plant
    assert stage.handover.holder == "wire"
    wire.waiting.append(heading(30.0))
    stage.loop.run(60.0)
    assert math.degrees(plant["psi"]) > 10.0
    assert panel.refusal()
    panel.doing["hand"]({"to": "page"})
    assert not panel.refusal()
    stage.loop.order("own", "delta", 0.0)
    stage.loop.run(2.0)
    taken = stage.on_wire.conning.counts["taken"]
    wire.waiting.append(heading(90.0))
    stage.loop.run(20.0)
    assert plant["delta_cmd"] == 0.0
    assert stage.on_wire.conning.counts["taken"] == taken
    assert stage.on_wire.conning.counts["refused"] == 1
    panel.doing["hand"]({"to": "wire"})
    wire.waiting.append(heading(90.0))
    stage.loop.run(5.0)
    assert plant["delta_cmd"] > 0.1
    with pytest.raises(RefusalError, match="nobody called that"):
        panel.doing["hand"]({"to": "the captain"})


@pytest.mark.slow
def test_handed_to_the_track_pilot_the_ship_goes_back_to_its_route():
    stage, wire = on_wire(scene(route=((20000.0, 0.0),), rate=2.0), page=True)
    wire.waiting.append(heading(40.0))
    stage.loop.run(120.0)
    plant = stage.loop.vessels["own"].plant
    away = plant["y"]
    assert away > 100.0
    stage.handover.hand(stage.loop, "pilot")
    stage.loop.run(400.0)
    assert abs(plant["y"]) < 5.0


def test_what_the_page_shows():
    stage, _ = on_wire(scene(FERRY, faults=(Fault("jammed", "delta", label="Jam"),), variation=-7.0 * DEG), page=True)
    panel = Panel(stage)
    hello = panel.hello()
    assert hello["faults"] == ["Jam"]
    assert hello["route"] == [[0.0, 0.0], [6000.0, 0.0]]
    panel.doing["fault"]({"number": 0, "on": True})
    stage.loop.run(1.0)
    frame = panel.frame()
    assert frame["faults"] == [True]
    name, distance, bearing, U, chi, cpa, tcpa, dangerous = frame["contacts"][0]
    assert (name, dangerous) == ("ferry", True)
    assert distance == pytest.approx(math.hypot(2992.0, 2992.0), abs=1.0)
    assert math.degrees(bearing) == pytest.approx(45.0, abs=0.1)
    assert (U, math.degrees(chi)) == (pytest.approx(8.0), pytest.approx(270.0))
    assert cpa < 20.0
    assert tcpa == pytest.approx(374.0, abs=1.0)
    for wrong in ({"number": 1, "on": True}, {"number": 0, "on": "yes"}, {"on": True}):
        with pytest.raises(RefusalError):
            panel.doing["fault"](wrong)


# --- lock step -------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_lock_step_waits_for_an_answer_to_each_time():
    stage, wire = on_wire(scene())
    step = Lockstep(stage.loop, stage.on_wire, patience=0.05)
    with pytest.raises(RunError, match="no valid sentence"):
        step.meet()
    send = wire.send

    def answering(data: bytes) -> None:
        send(data)
        if b"ZDA" in data:
            wire.waiting.append(heading(20.0))

    wire.send = answering
    wire.waiting.append(heading(20.0))
    step.meet()
    stage.run(20.0)
    assert step.answers == 20
    assert not step.failure
    assert stage.on_wire.conning.counts["taken"] == 20  # the last answer waits for the next tick
    wire.send = send
    stage.run(30.0)
    assert "no answer within 0.05 s at 21" in step.failure
    assert step.waited >= 0.1  # twice its patience: nobody to meet at first, nobody at the end
    assert stage.loop.t == pytest.approx(21.0, abs=0.5)


def test_the_time_is_the_last_sentence_of_its_tick():
    stage, wire = on_wire(scene(FERRY, variation=0.1))
    stage.loop.run(5.0)
    for data in wire.out:
        kinds = [line[3:6] for line in data.splitlines()]
        assert b"ZDA" not in kinds[:-1]
    assert {decode(one)["variation"] for one in wire.said("HDG")} == {5.73}


def test_a_sky_is_only_set_where_it_changes():
    stage = Stage(scene())
    sky = Sky(stage.loop, stage.scenario)
    stage.loop.run(3.0)
    assert sky.at(2.0) == sky.at(0.0)


def test_a_ship_without_a_rudder_is_refused_a_route_and_a_conduct_and_else_drifts():
    raft = Other("raft", load("otter"), Sailing(500.0, 0.0, 0.0, 0.0))
    stage = Stage(scene(raft))
    assert [one.text for one in stage.loop.events if one.kind == "drifts"] == [
        "otter has no rudder to steer; it drifts freely"
    ]
    for more in ({"sailing": replace(raft.sailing, route=((900.0, 0.0),))}, {"conduct": "rules"}):
        with pytest.raises(LoopError, match="raft: otter has no rudder to follow a route with"):
            Stage(scene(replace(raft, **more)))
