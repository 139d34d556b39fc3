"""Sentences by hand: each number in the unit of its field, each status, each bound; and reports of a transponder."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import date
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

from seatrial.data import DataError
from seatrial.data.formats.nmea import (
    Aboard,
    Log,
    Place,
    _from,
    _ground,
    _on_rows,
    _positions,
    _velocities,
    controls,
    felt_at_midship,
)
from seatrial.data.geodesy import Datum
from seatrial.data.nmea import ais
from seatrial.data.nmea.clocks import PIECES, Piece, Spoken, timed
from seatrial.data.nmea.framing import LARGEST, TOKEN, Line, NmeaError, Tag, datagram, read_line, split, tag_block
from seatrial.data.nmea.heard import hear
from seatrial.data.nmea.readings import readings
from seatrial.data.nmea.sentences import SENTENCES, Clock, Day, Number, Whole, Word, checksum
from seatrial.data.nmea.sentences import Place as Angle
from seatrial.data.nmea.ship import Fittings, clock, compass, lines
from seatrial.data.nmea.stamping import around, form_of

KNOT, DEGREE = 1852.0 / 3600.0, math.pi / 180.0


def line(text: str) -> bytes:
    return f"${text}*{checksum(text.encode())}\r\n".encode()


def read(text: str) -> dict[str, float]:
    return readings(hear(line(text)))


@pytest.mark.parametrize(("text", "said"), [
    ("HEHDT,90.0,T", {"psi": 0.5 * math.pi}), ("HETHS,180.0,A", {"psi": math.pi}), ("HETHS,180.0,V", {}),
    ("TIROT,-30.0,A", {"r": -0.5 * DEGREE}), ("TIROT,-30.0,V", {}),
    ("VDVBW,10.0,-1.0,A,9.0,2.0,A,0.5,A,-0.5,A",
     {"u_log_water": 10 * KNOT, "v_log_water": -KNOT, "u_log": 9 * KNOT, "v_log": 2 * KNOT,
      "v_stern_water": 0.5 * KNOT, "v_stern": -0.5 * KNOT}),
    ("VDVBW,10.0,-1.0,V,9.0,2.0,A", {"u_log": 9 * KNOT, "v_log": 2 * KNOT}),
    ("VDVBW,10.0,-1.0,A,9.0,2.0,V,0.5,V,-0.5,V", {"u_log_water": 10 * KNOT, "v_log_water": -KNOT}),
    ("GPVTG,45.0,T,40.0,M,10.0,N,18.52,K", {"gamma_G": 0.25 * math.pi, "U_G": 10 * KNOT}),
    ("GPRMC,120001.50,A,3530.0000,N,13915.0000,W,10.0,90.0,010180,,,A",
     {"time_of_day": 43201.5, "day": 3652 * 86400.0, "latitude": 35.5, "longitude": -139.25, "U_G": 10 * KNOT,
      "gamma_G": 0.5 * math.pi}),
    ("GPRMC,120001.50,V,3530.0000,N,13915.0000,W,10.0,90.0,010170,,,A", {"time_of_none": 43201.5}),
    ("GPRMC,120001.50,A,3530.0000,N,13915.0000,W,10.0,90.0,010170,,,N", {"time_of_none": 43201.5}),
    ("GPGGA,000000.00,3530.0000,S,13915.0000,E,1,08,1.0,0.0,M,0.0,M,,",
     {"time_of_day": 0.0, "latitude": -35.5, "longitude": 139.25}),
    ("GPGGA,000000.00,3530.0000,S,13915.0000,E,0,08,1.0,0.0,M,0.0,M,,", {"time_of_none": 0.0}),
    ("GPZDA,000001.00,02,01,1981,00,00", {"time_of_day": 1.0, "day": (11 * 365 + 3 + 1) * 86400.0}),
    ("GPZDA,000001.00,31,02,2001,00,00", {"time_of_day": 1.0}),
    ("RCRSA,-10.0,A,20.0,A", {"delta": -10 * DEGREE, "delta_port": 20 * DEGREE}),
    ("RCRSA,-10.0,V,20.0,A", {"delta_port": 20 * DEGREE}), ("RCRSA,-10.0,A,,V", {"delta": -10 * DEGREE}),
    ("RCRPM,S,1,90.0,,A", {"rpm_S_1": 90.0}), ("RCRPM,E,2,-90.0,,A", {"rpm_E_2": -90.0}),
    ("RCRPM,S,1,90.0,,V", {}),
    ("WIMWV,270.0,R,36.0,K,A", {"U_A": 10.0, "gamma_A": 1.5 * math.pi}),
    ("WIMWV,30.0,T,10.0,N,A", {"U_T": 10 * KNOT, "gamma_T_bow": 30 * DEGREE}),
    ("WIMWV,30.0,T,10.0,M,A", {"U_T": 10.0, "gamma_T_bow": 30 * DEGREE}), ("WIMWV,30.0,T,10.0,M,V", {}),
    ("SDDPT,12.0,3.0,", {"depth": 15.0}), ("SDDPT,12.0,-3.0,", {"depth": 12.0}), ("SDDPT,12.0,,", {"depth": 12.0}),
    ("SDDPT,,3.0,", {}),
    ("RCROR,5.0,A,-6.0,A,B", {"delta_cmd": 5 * DEGREE, "delta_port_cmd": -6 * DEGREE}),
    ("RCROR,5.0,V,-6.0,A,B", {"delta_port_cmd": -6 * DEGREE}), ("AGXTE,A,A,0.1,L,N,A", {}),
])  # fmt: skip
def test_a_sentence_means_what_its_fields_say(text: str, said: dict[str, float]) -> None:
    assert read(text) == pytest.approx(said, rel=1e-12)


@pytest.mark.parametrize(("rule", "good", "bad"), [
    (Number(-5.0, 5.0, 2), {"-5.0": -5.0, "5": 5.0, ".5": 0.5}, ("-5.01", "5.01", "1e1", "")),
    (Whole(1, 99, 2), {"01": 1, "99": 99}, ("0", "100", "1.0", "-1")),
    (Clock(), {"000000": 0.0, "235960.5": 86400.5, "010203.25": 3723.25}, ("240000", "006000", "000061", "1234")),
    (Day(), {"311279": date(2079, 12, 31), "010180": date(1980, 1, 1)}, ("310230", "1180", "001301")),
    (Word(("A", "V")), {"A": "A"}, ("B", "")), (Word(), {"a.b-c": "a.b-c"}, ("x" * 21, "a,b")),
    (Angle(90, ("N", "S")), {"9000.0,N": 90.0, "0030.6,S": -0.51}, ("9000.1,N", "0060.0,N", "0030.6,E", "030.6,N")),
    (Angle(180, ("E", "W")), {"18000.0,W": -180.0, "00630.0,E": 6.5}, ("18000.1,E", "0630.0,E")),
])  # fmt: skip
def test_a_field_holds_its_values_and_no_others(rule: Any, good: dict[str, Any], bad: tuple[str, ...]) -> None:
    for text, value in good.items():
        assert rule.value(text) == (pytest.approx(value) if isinstance(value, float) else value)
    assert [rule.value(text) for text in bad] == [None] * len(bad)


def test_numbers_are_written_with_their_digits_and_directions_within_the_circle() -> None:
    assert Number(0.0, 360.0, 2, circle=True).text(359.996) == "0.00"
    assert Number(0.0, 360.0, 2, circle=True).text(359.994) == "359.99"
    assert Number(0.0, 360.0, 2).text(359.996) == "360.00"
    assert Number(-5.0, 5.0, 1).text(-0.04) == "0.0"
    assert [Number(-5.0, 5.0, 1).text(one) for one in (-5.0, 5.0, 5.01, math.nan, "5")] == ["-5.0", "5.0"] + [None] * 3
    assert [Whole(1, 99, 2).text(one) for one in (1, 99, 0, 100, True, 1.0)] == ["01", "99", None, None, None, None]
    assert [Clock().text(one) for one in (0.0, 86399.999, 3723.254, 86400.0, -0.1)] == [
        "000000.00", "235959.99", "010203.25", None, None
    ]  # fmt: skip
    assert [Day().text(date(year, 2, 1)) for year in (1979, 1980, 2079, 2080)] == [None, "010280", "010279", None]
    assert Angle(90, ("N", "S")).text(-0.51) == "0030.6000000,S"
    assert Angle(180, ("E", "W"), 2).text(6.999999) == "00700.00,E"
    assert [Angle(90, ("N", "S")).text(one) for one in (90.1, None)] == [None, None]
    assert [compass(one) for one in (-0.5 * math.pi, 2.0 * math.pi)] == pytest.approx([270.0, 0.0])


def test_the_limits_of_each_field_are_those_of_the_standard() -> None:
    """Of numbers low, high and decimals; the least number of fields."""
    kinds = {"heading": (0.0, 360.0, 2), "bearing": (0.0, 360.0, 1), "rate": (-99999.0, 99999.0, 2),
             "knots": (-999.0, 999.0, 3), "speed": (0.0, 999.0, 3), "angle": (-180.0, 180.0, 2),
             "unsigned": (0.0, 180.0, 2), "share": (-100.0, 100.0, 1), "length": (0.0, 99999.0, 3),
             "offset": (-999.0, 999.0, 2), "minutes": (-9999.0, 9999.0, 2), "turn": (0.0, 9999.0, 2)}  # fmt: skip
    of = {("HDT", "headingT"): "heading", ("ROT", "rot"): "rate", ("VBW", "longwaterspd"): "knots",
          ("VTG", "sogn"): "speed", ("RSA", "stbdangle"): "angle", ("HDG", "variation"): "unsigned",
          ("RPM", "rpm"): "rate", ("RPM", "pitch"): "share", ("DPT", "depth"): "length", ("DPT", "offset"): "offset",
          ("TTM", "timetoCPA"): "minutes", ("HTC", "cmdturnrate"): "turn", ("TRC", "dmdazimuth"): "bearing",
          ("MWV", "angle"): "heading", ("MWV", "speed"): "speed", ("PRC", "leverdmdpos"): "share",
          ("HTC", "cmdrudderang"): "unsigned", ("APB", "ctrkerr"): "length"}  # fmt: skip
    for (kind, field), name in of.items():
        rule = SENTENCES[kind].fields[field]
        assert isinstance(rule, Number)
        assert (rule.low, rule.high, rule.decimals) == kinds[name], (kind, field)
        assert rule.circle == (name in ("heading", "bearing"))
    least = {kind: one.least for kind, one in SENTENCES.items() if one.least < len(one.fields)}
    assert least == {"VBW": 6, "VTG": 8, "RMC": 9, "GLL": 3, "TTM": 13, "TLL": 5, "DPT": 2, "ROR": 4, "HTC": 13,
                     "APB": 14, "XTE": 5}  # fmt: skip
    whole = {(kind, name): (rule.low, rule.high, rule.digits) for kind, one in SENTENCES.items()
             for name, rule in one.fields.items() if isinstance(rule, Whole)}  # fmt: skip
    assert whole["GGA", "quality"] == (0, 8, 1)
    assert whole["GGA", "numSV"] == whole["TTM", "targetnum"] == (0, 99, 2)
    assert whole["GGA", "diffStation"] == (0, 1023, 4)
    assert (whole["ZDA", "day"], whole["ZDA", "month"], whole["ZDA", "year"]) == (
        (1, 31, 2), (1, 12, 2), (1980, 2079, 4)
    )  # fmt: skip
    assert whole["ALF", "alertid"] == (1, 9_999_999, 1)
    assert whole["ACK", "alarmid"] == (0, 999, 3)


def test_the_clock_of_a_ship_is_its_epoch_and_its_time_to_a_hundredth() -> None:
    moment = clock(Fittings(epoch=1_800_000_000.0), {"t": 1.234567})
    assert moment.timestamp() == pytest.approx(1_800_000_001.23, abs=1e-6)
    assert [Fittings(shafts=tuple(names)).numbers for names in ("n", "ab", "abc", "abcd")] == [
        {"n": 0}, {"a": 2, "b": 1}, {"a": 2, "b": 0, "c": 1}, {"a": 4, "b": 2, "c": 1, "d": 3}
    ]  # fmt: skip


# -- transponders

AT = {"latitude": 35.0, "longitude": -139.5, "U": 10.04 * KNOT, "chi": 359.96 * DEGREE, "psi": 89.6 * DEGREE,
      "r": 2.0 * DEGREE / 60.0}  # fmt: skip


def told(lines: list[bytes]) -> dict[str, Any]:
    pyais = pytest.importorskip("pyais")
    return pyais.decode(*[one.strip() for one in lines]).asdict()


def test_a_position_report_is_in_knots_degrees_and_their_tenths() -> None:
    by = ais.Transponder(123456789)
    said = told(ais.position(by, AT, 17, "VDM"))
    assert (said["msg_type"], said["mmsi"], said["second"]) == (1, 123456789, 17)
    assert (said["speed"], said["course"], said["heading"]) == (pytest.approx(10.0), 0.0, 90)
    assert (said["lat"], said["lon"]) == pytest.approx((35.0, -139.5))
    assert float(said["turn"]) == pytest.approx(2.0, abs=0.4)  # its code is 4.733 times the root
    fast = told(ais.position(by, {**AT, "U": 200.0 * KNOT, "psi": 359.6 * DEGREE, "r": -1.0}, 0, "VDO", 3))
    assert (fast["msg_type"], fast["speed"], fast["heading"]) == (3, pytest.approx(102.2), 0)
    assert float(fast["turn"]) < -700.0
    small = told(ais.position(ais.Transponder(1, class_b=True), AT, 5, "VDM"))
    assert (small["msg_type"], small["speed"], small["heading"]) == (18, pytest.approx(10.0), 90)
    assert said["status"] == 0
    stuck = told(ais.position(ais.Transponder(1, status="aground"), AT, 5, "VDM"))
    assert stuck["status"] == 6  # ITU-R M.1371-5, Table 48


@pytest.mark.parametrize("class_b", [False, True])
def test_static_data_tell_the_ship_about_its_antenna(class_b: bool) -> None:
    by = ais.Transponder(7, "Blåhaj-1 of the northern seas", 100.0, 20.0, 6.04, (-30.0, 4.0), class_b, "tanker")
    lines = ais.static(by, "VDO")
    said = told(lines) if not class_b else {**told(lines[:1]), **told(lines[1:])}
    assert said["shipname"].strip() == "BL HAJ-1 OF THE NORT"
    assert [said[f"to_{side}"] for side in ("bow", "stern", "port", "starboard")] == [80, 20, 14, 6]
    assert said["ship_type"] == 80  # ITU-R M.1371-5, Table 53
    if not class_b:
        assert (said["draught"], said["epfd"]) == (pytest.approx(6.0), 1)
    deep = ais.Transponder(7, length=3000.0, breadth=500.0, draught=40.0, antenna=(0.0, 300.0))
    far = told(ais.static(deep, "VDO"))
    assert [far[f"to_{side}"] for side in ("bow", "port", "starboard")] == [511, 63, 0]
    assert far["draught"] == pytest.approx(25.5)
    assert far["ship_type"] == 0  # not told


# -- frames


def test_a_line_has_its_tag_and_a_datagram_its_lines() -> None:
    tag = Tag("HE0001", 7, 1_793_275_200.1234)
    block = tag_block(tag)
    assert block.startswith(b"\\s:HE0001,n:7,c:1793275200123*")
    assert read_line(block + b"$X") == Line(b"$X", Tag("HE0001", 7, 1_793_275_200.123))
    assert read_line(b"\\c:100000000000*" + checksum(b"c:100000000000").encode() + b"\\!").tag == Tag(time=1e11)
    assert read_line(b"\\c:100000000001*" + checksum(b"c:100000000001").encode() + b"\\!").tag == Tag(time=1e8 + 1e-3)
    for wrong in (Tag("a" * 16), Tag("a-b"), Tag(number=1000), Tag(number=-1), Tag()):
        with pytest.raises(NmeaError):
            tag_block(wrong)
    for number in (0, 999):
        assert read_line(tag_block(Tag("x", number))).tag == Tag("x", number)
    room = LARGEST - len(TOKEN)
    assert len(datagram([Line(b"x" * room)])) == 1472
    with pytest.raises(NmeaError):
        datagram([Line(b"x" * (room + 1))])
    assert split(TOKEN + b"a\r\nb\n\r\nc\rd") == [b"a", b"b", b"c\rd"]
    with pytest.raises(NmeaError):
        split(b"x" * 1473)


# -- logs of sentences


def test_a_place_aboard_moves_as_the_ship_turns() -> None:
    u, v, r = np.array([5.0]), np.array([0.3]), np.array([0.02])
    there = u - (-3.0) * r, v + 40.0 * r  # of a point 40 m ahead and 3 m to port
    back = _from(Place(40.0, -3.0), *there, r)
    assert (back[0][0], back[1][0]) == pytest.approx((5.0, 0.3))
    assert (bool(Place()), bool(Place(0.0, 1.0)), bool(Place(1.0))) == (False, True, True)
    wind = felt_at_midship(np.array([10.0]), np.array([0.25 * math.pi]), r, Place(-50.0))
    ahead, aside = 10.0 * math.cos(0.25 * math.pi), 10.0 * math.sin(0.25 * math.pi) + 50.0 * 0.02
    assert (wind[0][0], wind[1][0]) == pytest.approx((math.hypot(ahead, aside), math.atan2(aside, ahead)))


def test_courses_and_fixes_of_an_antenna_are_brought_to_midship() -> None:
    psi, r = np.array([0.7, 0.7]), np.array([0.02, 0.02])
    way = complex(5.0, 0.3) + 0.02j * complex(20.0, -4.0)
    raw = {"U_G": np.full(2, abs(way)), "gamma_G": np.full(2, 0.7 + math.atan2(way.imag, way.real)),
           "u_log_water": np.full(2, 4.0 - 0.02 * 2.0)}  # fmt: skip
    aboard = Aboard(antenna=Place(20.0, -4.0), log=Place(10.0, 2.0))
    u, v = _ground(raw, psi, r, aboard)
    assert (u[0], v[0]) == pytest.approx((5.0, 0.3))
    channels: dict[str, Any] = {}
    _velocities(channels, raw, psi, r, aboard, [])
    assert {name: float(values[0]) for name, values in channels.items()} == pytest.approx(
        {"u": 5.0, "v_m": 0.3, "u_w": 4.0, "U_G": math.hypot(5.0, 0.3), "gamma_G": 0.7 + math.atan2(0.3, 5.0)}
    )
    here = Datum(35.0, 139.0)
    lever = complex(20.0, -4.0) * complex(math.cos(0.7), math.sin(0.7))
    place = here.place(100.0 + lever.real, -50.0 + lever.imag)
    fixes = {"latitude": np.full(2, place[0]), "longitude": np.full(2, place[1])}
    found: dict[str, Any] = {}
    assert _positions(found, fixes, psi, Aboard(antenna=Place(20.0, -4.0), datum=here), []) == here
    assert (found["x"][0], found["y"][0]) == pytest.approx((100.0, -50.0), abs=1e-5)
    assert _positions({}, fixes, psi, Aboard(), []) == Datum(*place)
    assert aboard.place == (20.0, -4.0)


def test_rudders_and_shafts_are_numbered_from_port() -> None:
    one, two = np.array([0.1]), np.array([0.2])
    channels: dict[str, Any] = {}
    steps: list[str] = []
    raw = {"delta": one, "delta_port": two, "delta_cmd": one, "rpm_S_1": 60.0 * one, "rpm_S_2": 60.0 * two,
           "rpm_S_0": 600.0 * one, "rpm_E_1": one}  # fmt: skip
    controls(channels, raw, steps)
    assert {name: float(values[0]) for name, values in channels.items()} == pytest.approx(
        {"delta_1": 0.2, "delta_2": 0.1, "delta_cmd": 0.1, "n_P_1": 0.2, "n_P_2": 1.0, "n_P_3": 0.1}
    )
    assert "those of the engine are left out" in steps[0]
    engines: dict[str, Any] = {}
    controls(engines, {"rpm_E_0": 90.0 * np.ones(1)}, steps)
    assert (float(engines["n_P"][0]), "as fast" in steps[1]) == (1.5, True)


def test_stamps_are_seconds_milliseconds_or_dates() -> None:
    def read(*texts: bytes) -> list[float | None]:
        tried = around([(text, b"") for text in texts])
        form = form_of(tried)
        return [] if form is None else [one if one == one else None for one in form.seconds(tried).tolist()]

    assert read(b"12.5 ", b"13. ") == [12.5, 13.0]
    assert read(b"1800000000000,", b"1800000000500,") == [1_800_000_000.0, 1_800_000_000.5]
    noon = 1_767_268_800.0
    for text in (b"2026-01-01T12:00:00Z", b"2026-01-01 12:00:00", b"2026-01-01T14:00:00+02:00",
                 b"2026-01-01T06:30:00-0530"):
        assert read(text) == [noon]
    assert read(b"2026-13-01T12:00:00Z", *[b"2026-01-01T12:00:00Z"] * 19)[:2] == [None, noon]
    assert read(b"nothing") == []


def spoken(source: str, lines: Sequence[int], stamps: Sequence[float], **values: Sequence[float]) -> Spoken:
    return Spoken(source, tuple(values), PIECES * np.array(lines), np.array(list(values.values())), np.array(stamps))


def test_a_line_without_a_stamp_has_that_of_both_its_neighbours() -> None:
    found = spoken("HEHDT", range(6), (1.0, np.nan, 1.0, np.nan, 2.0, 3.0), a=[float(k) for k in range(6)])
    when = timed("log", Piece([found]), False)
    assert [one.tolist() for one in when.told["HEHDT"]["a"]] == [[1.0, 2.0, 3.0], [2.0, 4.0, 5.0]]
    assert when.untimed == 1
    assert when.steps == ("2 of 6 sentences have no stamp: 1 of them get that of the lines around them, 1 are left out",
                          "2 readings at the time of another one of their kind: the later one counts")  # fmt: skip


def test_sentences_are_spread_between_the_clocks_also_over_midnight() -> None:
    def told(lines: Sequence[int], clock: Sequence[float], day: Sequence[float]) -> list[Spoken]:
        heads = [line + k for line in lines for k in (1, 2)]
        return [spoken("GPZDA", lines, [np.nan] * len(lines), time_of_day=clock, day=day),
                spoken("HEHDT", heads, [np.nan] * len(heads), psi=[0.0, 1.0] * len(lines))]  # fmt: skip

    when = timed("log", Piece(told([1, 4, 7], [86399.0, 0.0, 3.0], [0.0, 86400.0, 86400.0])), False)
    assert when.told["HEHDT"]["psi"][0].tolist() == [86399.0, 86399.5, 86400.0, 86401.5, 86403.0, 86404.5]
    assert when.told["HEHDT"]["psi"][1].tolist() == [0.0, 1.0] * 3
    assert when.epoch == 0.0
    with pytest.raises(DataError, match="no time: the clock of GPZDA stands still"):
        timed("log", Piece(told([1], [5.0], [0.0])), False)


def test_rows_are_those_of_the_quickest_and_others_go_to_the_nearest() -> None:
    t = np.arange(10.0)
    log = Log({"psi": (t, t), "r": (t[::2] + 0.3, t[::2]), "u_log": (np.array([2.49, 7.5, 20.0]), np.ones(3))})
    rows, out, steps = _on_rows(FilePath("a"), log)
    assert rows.tolist() == t.tolist()
    assert np.flatnonzero(np.isfinite(out["r"])).tolist() == [0, 2, 4, 6, 8]
    assert np.flatnonzero(np.isfinite(out["u_log"])).tolist() in ([2, 7], [2, 8])
    assert steps == ["readings moved to the nearest row, by 0.5 s at most"]
    assert _on_rows(FilePath("a"), Log({"psi": (t, t), "r": (t, t)}))[2] == []
    with pytest.raises(DataError, match="to make rows of"):
        _on_rows(FilePath("a"), Log({"psi": (t[:1], t[:1]), "u_log": (t, t)}))


def test_directions_of_a_magnetic_compass_are_less_by_its_variation_and_speeds_in_both_units() -> None:
    """Variation east 5.73 deg: magnetic is true less variation."""
    pytest.importorskip("pynmeagps")
    now = {"t": 0.0, "psi": 1.0, "u_w": 5.0, "chi": 2.0, "U": 6.0}
    east, west, none = (Fittings(variation=one) for one in (0.1, -0.1, None))

    def text(kind: str, fit: Fittings) -> str:
        (found,) = lines(kind, fit, now)
        return found.decode().split("*")[0]

    assert text("VHW", east) == "$VWVHW,57.30,T,51.57,M,9.719,N,18.000,K"
    assert text("VHW", none) == "$VWVHW,57.30,T,,M,9.719,N,18.000,K"
    assert text("VTG", east) == "$GPVTG,114.59,T,108.86,M,11.663,N,21.600,K,A"
    assert text("VTG", Fittings(simulator=True)) == "$GPVTG,114.59,T,,M,11.663,N,21.600,K,S"
    assert text("HDG", east) == "$HCHDG,51.57,,,5.73,E"
    assert text("HDG", west) == "$HCHDG,63.03,,,5.73,W"
    assert text("THS", none) == "$HETHS,57.30,A"
    assert text("ZDA", none) == "$GPZDA,080000.00,15,01,2027,00,00"
