"""Every sentence of a range read by parsers of others, its values within half of the last digit of the truth."""

from __future__ import annotations

import math
from datetime import UTC, datetime

import pynmea2
import pytest
from pynmeagps import NMEAReader

from scenes import DEG, FERRY, PLACE, Fault, Limits, on_wire, scene
from seatrial.core.constants import KNOT, MILE
from seatrial.data.nmea.framing import split
from seatrial.data.nmea.sentences import SENTENCES, Sentence, encode
from seatrial.realtime.range.reports import interval
from seatrial.realtime.range.scenario import Other, Sailing, ordinary

pyais = pytest.importorskip("pyais")

YACHT = Other("yacht", ordinary("yacht", 20.0, 4.0), Sailing(-2000.0, 700.0, 0.5, 4.0, mmsi=265000001), "class B")
TUG = Other("tug", ordinary("tug", 30.0, 5.0), Sailing(900.0, -900.0, 3.0, 5.0), "class A assigned", radar=False)


def half(digits: int) -> float:
    """Half of the last digit, and what rounding in binary adds."""
    return 0.5001 * 10.0**-digits


@pytest.mark.slow
def test_every_sentence_is_accepted_by_other_parsers_with_its_values():
    stage, wire = on_wire(scene(FERRY, variation=-6.4 * DEG, name="kvlcc2"))
    stage.loop.run(30.0)  # the last tick has TTM, and every sentence of a second
    plant = stage.loop.vessels["own"].plant
    lat, lon = PLACE.place(plant["x"], plant["y"])
    said = {kind: pynmea2.parse(wire.said(kind)[-1].decode(), check=True) for kind in
            ("HDT", "ROT", "RSA", "VBW", "RMC", "GGA", "GLL", "VTG", "ZDA", "HDG", "VHW", "RPM", "MWV", "DPT", "TTM",
             "TLL")}  # fmt: skip
    psi = math.degrees(plant["psi"]) % 360.0
    assert float(said["HDT"].heading) == pytest.approx(psi, abs=half(2))
    assert float(said["HDG"].heading) == pytest.approx((psi + 6.4) % 360.0, abs=half(2))
    assert (float(said["HDG"].variation), said["HDG"].var_dir) == (pytest.approx(6.4, abs=half(2)), "W")
    assert float(said["VHW"].heading_magnetic) == pytest.approx((psi + 6.4) % 360.0, abs=half(2))
    assert float(said["VHW"].water_speed_knots) == pytest.approx(plant["u"] / KNOT, abs=half(3))
    assert float(said["VHW"].water_speed_km) == pytest.approx(plant["u"] * 3.6, abs=half(3))
    assert float(said["VTG"].mag_track) == pytest.approx((float(said["VTG"].true_track) + 6.4) % 360.0, abs=2 * half(2))
    for kind in ("GLL", "GGA", "RMC"):
        assert said[kind].latitude == pytest.approx(lat, abs=half(7) / 60.0)
        assert said[kind].longitude == pytest.approx(lon, abs=half(7) / 60.0)
    moment = datetime.fromtimestamp(stage.fittings.epoch + stage.loop.t, UTC)
    assert said["ZDA"].datetime.replace(microsecond=0) == moment.replace(microsecond=0)
    for line in (line for data in wire.out for line in split(data) if line.startswith(b"$")):
        assert NMEAReader.parse(line + b"\r\n", validate=1).msgID == line[3:6].decode()


@pytest.mark.slow
def test_what_the_radar_tracks():
    stage, wire = on_wire(scene(FERRY, TUG))
    stage.loop.run(20.2)
    assert {line.split(b",")[1] for line in wire.said("TTM")} == {b"01"}  # the radar does not see the tug
    seen = stage.contacts.seen["ferry"]
    data = wire.said("TTM")[-1].decode()
    ttm, other = pynmea2.parse(data, check=True), NMEAReader.parse(data.encode() + b"\r\n", validate=1)
    assert stage.loop.t == pytest.approx(20.2)
    for value, theirs, truth, digits in (
        (ttm.data[1], other.targetdist, seen.distance / MILE, 3),
        (ttm.data[2], other.targetbearing, math.degrees(seen.bearing) % 360.0, 2),
        (ttm.data[4], other.targetspeed, seen.U / KNOT, 3),
        (ttm.data[5], other.targetcourse, math.degrees(seen.chi) % 360.0, 2),
        (ttm.data[7], other.closestapproach, seen.cpa / MILE, 3),
        (ttm.data[8], other.timetoCPA, seen.tcpa / 60.0, 2),
    ):
        assert float(value) == float(theirs) == pytest.approx(truth, abs=half(digits))
    lat, lon = PLACE.place(*(stage.loop.vessels["ferry"].plant[name] for name in ("x", "y")))
    tll = NMEAReader.parse(wire.said("TLL")[-1] + b"\r\n", validate=1)
    assert (tll.targetlat, tll.targetlon) == (pytest.approx(lat, abs=2e-9 + half(7) / 60), pytest.approx(lon, abs=1e-8))


@pytest.mark.slow
def test_a_wrong_compass_turns_what_the_radar_reports_and_nothing_of_transponders():
    stage, wire = on_wire(scene(FERRY, faults=(Fault("jump", "gyro", 0.0, None, {"psi": 10.0 * DEG}),)))
    stage.loop.run(20.2)
    seen = stage.contacts.seen["ferry"]
    bearing = float(wire.said("TTM")[-1].split(b",")[3])
    assert bearing == pytest.approx(math.degrees(seen.bearing) + 10.0, abs=0.02)
    report = pyais.decode(next(line for line in wire.said("VDM") if line.split(b",")[5][:1] == b"1"))
    assert report.course == pytest.approx(270.0, abs=0.06)


@pytest.mark.parametrize(("other", "kinds"), [
    pytest.param(FERRY, {1, 5}, marks=pytest.mark.slow), (TUG, {2, 5}),
    pytest.param(YACHT, {18, 24}, marks=pytest.mark.slow),
])  # fmt: skip
def test_transponders_report_position_and_static_data(other, kinds):
    stage, wire = on_wire(scene(other, name="kvlcc2"))
    stage.loop.run(33.0)
    whole: list[list[bytes]] = []
    for line in wire.said("VDM"):  # sentences of one message follow one another
        (whole.append([line]) if line.split(b",")[2] == b"1" else whole[-1].append(line))
    found = [pyais.decode(*parts) for parts in whole]
    assert {one.msg_type for one in found} == kinds
    assert {one.mmsi for one in found} == {other.sailing.mmsi or 200000001}
    plant = stage.loop.vessels[other.name].plant
    place = [one for one in found if one.msg_type in (1, 2, 18)][-1]
    behind = plant["u"] * 12.0 if other is not YACHT else plant["u"] * 33.0
    lat, lon = PLACE.place(plant["x"], plant["y"])
    assert math.hypot(place.lat - lat, (place.lon - lon) * 0.8) * 60.0 * MILE < behind + 1.0
    assert place.speed == pytest.approx(plant["u"] / KNOT, abs=half(1))
    assert place.heading == round(math.degrees(plant["psi"])) % 360
    names = [one.shipname for one in found if one.msg_type == 5 or (one.msg_type == 24 and one.partno == 0)]
    assert names[0] == other.name.upper()
    libais = pytest.importorskip("ais", reason="a second decoder: pip install libais")
    for parts, ours in zip(whole, found, strict=True):
        fields = [part.split(b",") for part in parts]
        theirs = libais.decode("".join(one[5].decode() for one in fields), int(fields[-1][6][:1]))
        assert (theirs["id"], theirs["mmsi"]) == (ours.msg_type, ours.mmsi)
        if "x" in theirs:
            assert (theirs["x"], theirs["y"]) == (pytest.approx(ours.lon, abs=1e-6), pytest.approx(ours.lat, abs=1e-6))


def test_intervals_are_those_of_the_recommendation():
    knots, turning = KNOT, 20.0 * DEG / 60.0
    assert [interval(u * knots, 0.0, False) for u in (10.0, 20.0, 25.0)] == [10.0, 6.0, 2.0]
    assert [interval(u * knots, -turning, False) for u in (10.0, 20.0, 25.0)] == [10.0 / 3.0, 2.0, 2.0]
    assert [interval(u * knots, 0.0, True) for u in (1.0, 10.0)] == [180.0, 30.0]


@pytest.mark.slow
def test_a_turning_ship_reports_by_message_3():
    turning = Other("t", ordinary("t", 60.0, 6.0), Sailing(0.0, 3000.0, 0.0, 6.0, ((0.0, 2000.0), (2000.0, 2000.0))))
    stage, wire = on_wire(scene(turning))
    stage.loop.run(20.0)
    assert 3 in {pyais.decode(line).msg_type for line in wire.said("VDM") if line.split(b",")[1] == b"1"}


@pytest.mark.slow
def test_alarms_go_out_and_are_acknowledged_over_the_wire():
    stage, wire = on_wire(scene(FERRY, limits=Limits(cpa=500.0, tcpa=300.0)))
    stage.loop.run(80.0)
    (alf,), (alr,) = wire.said("ALF"), wire.said("ALR")
    parsed, older = (NMEAReader.parse(one + b"\r\n", validate=1) for one in (alf, alr))
    assert (parsed.alertstate, parsed.alertid, parsed.alertinst, parsed.alerttxt) == ("V", "10001", "1", "CPA 01 ferry")
    assert (older.alarmnum, older.alarmcond, older.alarmstate) == ("101", "A", "V")
    wire.out.clear()
    fields = dict.fromkeys(SENTENCES["ACN"].fields) | {"alertid": 10001, "alertcmd": "A", "status": "C"}
    wire.waiting.append(encode(Sentence("VR", "ACN", {**fields, "alertnum": 7})))  # no such instance
    stage.loop.run(2.0)
    arc = NMEAReader.parse(wire.said("ARC")[0] + b"\r\n", validate=1)
    assert (arc.alertid, arc.alertinst, arc.alertcmd) == ("10001", 7, "A")
    wire.waiting.append(encode(Sentence("VR", "ACN", {**fields, "alertnum": 1})))
    stage.loop.run(2.0)
    assert wire.said("ALF")[-1].split(b",")[7] == b"A"
    assert stage.alarms.standing()[0].state == "A"
    assert stage.reports.refused == 1
    stage.loop.run(60.0)
    assert len(wire.said("ALF")) == 3  # and again every 30 s while it stands


@pytest.mark.slow
def test_an_older_acknowledgement_and_a_sender_without_authority():
    from seatrial.realtime.wire import Authority

    ack = encode(Sentence("VR", "ACK", {"alarmid": 101}))
    for authority, state in ((Authority(), "A"), (Authority.of(("10.0.0.1",)), "V")):
        stage, wire = on_wire(scene(FERRY, limits=Limits(cpa=500.0, tcpa=400.0)), authority=authority)
        stage.loop.run(20.0)
        wire.waiting.append(ack)
        stage.loop.run(2.0)
        assert stage.alarms.standing()[0].state == state


def test_only_what_is_asked_for_is_sent():
    stage, wire = on_wire(scene(FERRY), only=("TTM",), rates={"HDT": 1.0})
    stage.loop.run(10.0)
    assert {line[3:6] for data in wire.out for line in split(data)} == {b"TTM", b"HDT"}
