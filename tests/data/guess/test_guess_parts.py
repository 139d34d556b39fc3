"""Winds, clocks, cells, names, layouts and files of a guess, each part by itself, on both sides of its bounds."""

from __future__ import annotations

import codecs
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from columns import TABLE, column, signal

from seatrial.data import Array, DataError
from seatrial.data.guess.answers import Answer, Entry, listed, quoted, text_of
from seatrial.data.guess.cells import _read, spoken
from seatrial.data.guess.clock import Clock, _days, _of_clock, _pattern, _seconds, clocks
from seatrial.data.guess.entries import angle_form, in_degrees
from seatrial.data.guess.guessing import _layout_entry, _once, _reaching, _repeats
from seatrial.data.guess.layout import Layout, Table, decoded, is_value, number, read_text, split_line
from seatrial.data.guess.logs import (
    Log,
    Topic,
    _alike,
    _longest,
    _moved,
    _of_sheet,
    _onto,
    _pieces,
    _shared_end,
    _weight,
    leap,
    read_tables,
)
from seatrial.data.guess.naming import Meaning, meanings, parted, tokens, unit_in_name, unit_of
from seatrial.data.guess.roles import sided, signals, trial_column
from seatrial.data.guess.wind import (
    WindReading,
    _air,
    _chosen,
    _share,
    differences,
    read_two_winds,
    read_wind,
    wind_pairs,
)

KNOT, DEGREE = 1852.0 / 3600.0, math.pi / 180.0
T = np.arange(300.0)
PSI, U, V = 0.02 * T, np.full(300, 5.0), 0.3 * np.sin(0.05 * T)
NORTH, EAST = 6.0, -4.0
"""Where the wind comes from: 7.2 m/s from the north-west."""


def felt() -> tuple[Array, Array]:
    ahead = NORTH * np.cos(PSI) + EAST * np.sin(PSI) + U
    aside = EAST * np.cos(PSI) - NORTH * np.sin(PSI) + V
    return np.hypot(ahead, aside), np.arctan2(aside, ahead)


# -- wind


@pytest.mark.parametrize(("relative", "towards", "side", "unit", "angle"), [
    (True, False, 1, "m/s", "rad"), (True, True, 1, "kn", "deg"), (True, False, -1, "km/h", "deg"),
    (True, True, -1, "m/s", "deg"), (False, False, 1, "kn", "deg"), (False, True, 1, "m/s", "rad"),
])  # fmt: skip
def test_a_wind_in_any_way_of_writing_is_one_wind(
    relative: bool, towards: bool, side: int, unit: str, angle: str
) -> None:
    """The air over ground by the reading that wrote it, and that this reading fits best."""
    true = np.full(300, math.hypot(NORTH, EAST)), np.full(300, math.atan2(EAST, NORTH))
    speed, gamma = felt() if relative else true
    written = side * (gamma + (math.pi if towards else 0.0))
    written = np.degrees(written) if angle == "deg" else written
    size = speed / {"m/s": 1.0, "kn": KNOT, "km/h": 1 / 3.6}[unit]
    one = WindReading(relative, towards, side, unit, angle, 0.0)
    air = _air(one, size, written, (PSI, U, V))
    assert air == pytest.approx(np.tile([NORTH, EAST], (300, 1)))
    words = frozenset({"towards"} if towards else set())
    found = {"s": signal("wind_speed", size, unit=unit),
             "d": signal("wind_direction", written, means=(Meaning("wind_direction", 1.0, words),))}  # fmt: skip
    if relative:
        best = read_wind(found, ("s", "d"), (PSI, U, V)).best
        assert (best.relative, best.side, best.unit, best.angle) == (relative, side, unit, angle)
        assert best.towards == towards
        assert best.miss < 1e-6


def test_two_winds_are_one() -> None:
    speed, gamma = felt()
    found = {"U_A": signal("U_A", speed / KNOT), "gamma_A": signal("gamma_A", -np.degrees(gamma)),
             "U_T": signal("U_T", np.full(300, math.hypot(NORTH, EAST))),
             "gamma_T": signal("gamma_T", np.full(300, math.degrees(math.atan2(EAST, NORTH)) + 180.0))}  # fmt: skip
    first, second = read_two_winds(found, ("U_A", "gamma_A"), ("U_T", "gamma_T"), (PSI, U, V))
    assert (first.best.unit, first.best.side, first.best.towards, first.best.relative) == ("kn", -1, False, True)
    assert (second.best.unit, second.best.towards, second.best.relative) == ("m/s", True, False)


def test_without_a_motion_the_names_decide_and_what_strains_little_more_is_close() -> None:
    found = {"s": signal("wind_speed", [5.0, 6.0]), "d": signal("wind_direction", [10.0, 20.0])}
    said = read_wind(found, ("s", "d"), None)
    assert (said.best.relative, said.best.side, said.best.unit, said.best.angle, said.best.strain) == (
        False, 1, "m/s", "deg", 0.0
    )  # fmt: skip
    assert said.rival is None
    assert {round(one.strain, 1) for one in said.close} == {0.3, 0.4, 0.6, 0.7, 1.0, 1.3, 1.4}
    assert max(one.strain for one in said.close) < 1.5
    for roles, relative in ((("s", "gamma_A"), True), (("s", "gamma_T"), False)):
        named = {"s": found["s"], roles[1]: signal(roles[1], [10.0, 20.0])}
        assert read_wind(named, roles, None).best.relative == relative
    for largest, angle in ((7.1, "deg"), (6.9, "rad")):
        small = {"s": found["s"], "d": signal("wind_direction", [0.0, -largest])}
        assert read_wind(small, ("s", "d"), None).best.angle == angle


def test_a_reading_is_near_the_best_within_a_fifth_and_three_hundredths() -> None:
    first = WindReading(True, False, 1, "m/s", "deg", 1.0)
    other = replace(first, side=-1, strain=0.0)
    assert _chosen([(first, 0.1), (other, 0.149)]).best.side == -1
    assert _chosen([(first, 0.1), (other, 0.151)]).best.side == 1
    assert _chosen([(first, 0.1), (replace(other, strain=2.4), 0.14)]).close[0].side == -1
    assert _chosen([(first, 0.1), (replace(other, strain=2.6), 0.14)]).close == ()
    rival = _chosen([(first, 0.1), (replace(other, strain=2.6), 50.0)]).rival
    assert rival is not None
    assert rival.miss == 9.0
    assert _share(np.array([[3.0, 4.0], [3.0, 4.0]]), np.array([3.0, 3.0])) == pytest.approx(0.2)
    assert differences(first, replace(first, relative=False, towards=True, side=-1, unit="kn")) == [
        "true, from north", "where it goes to", "positive to port", "in kn"
    ]  # fmt: skip
    assert differences(replace(first, side=-1, towards=True), first) == ["where it comes from", "positive to starboard"]


def test_a_wind_has_the_speed_that_its_direction_names() -> None:
    def pairs(*names: str) -> list[tuple[str, str]]:
        return wind_pairs({name: signal(name, [1.0, 2.0]) for name in names})

    assert pairs("gamma_A", "U_A", "wind_speed") == [("U_A", "gamma_A")]
    assert pairs("gamma_A", "gamma_T", "wind_speed") == [("wind_speed", "gamma_A")]
    assert pairs("wind_direction", "U_T") == [("U_T", "wind_direction")]
    still = {"gamma_T": signal("gamma_T", [1.0, 1.0]), "U_T": signal("U_T", [2.0, 2.0])}
    assert wind_pairs(still) == []


# -- clocks


@pytest.mark.parametrize(("text", "pattern", "seconds"), [
    ("2000-01-02T00:00:01.25Z", "iso", 86401.25), ("2000/01/01 02:00:00+02:00", "iso", 0.0),
    ("2000-01-01 00:00:00 UTC", "iso", 0.0), ("03.01.2000 00:01:00,5", "%d.%m.%Y %H:%M:%S.%f", 172860.5),
    ("01/03/00 01:00", "%m/%d/%y %H:%M", 2 * 86400 + 3600), ("31.02.2000 00:00:00", "%d.%m.%Y %H:%M:%S", math.nan),
])  # fmt: skip
def test_stamps_are_seconds_after_the_year_two_thousand(text: str, pattern: str, seconds: float) -> None:
    assert _seconds(text, pattern) == pytest.approx(seconds, nan_ok=True)


def test_digits_that_count_are_nanoseconds() -> None:
    assert _seconds("2000-01-01T00:00:01.250", "iso", count=True) == pytest.approx(1.0 + 250e-9, abs=1e-12)
    assert [_of_clock(one) for one in ("01:02:03,5", "10:30", "x")] == pytest.approx([3723.5, 37800, NAN], nan_ok=True)


NAN = math.nan


@pytest.mark.parametrize(("cells", "pattern", "doubt"), [
    (["03/04/2025 10:00:00"], "%d/%m/%Y %H:%M:%S", True), (["13/04/2025 10:00:00"], "%d/%m/%Y %H:%M:%S", False),
    (["04/13/2025 10:00"], "%m/%d/%Y %H:%M", False), (["03.04.25 10:00:00.5"], "%d.%m.%y %H:%M:%S.%f", False),
    (["2025.04.03 10:00:00"], "%Y.%m.%d %H:%M:%S", False), (["04/04/2025 10:00:00"], "%d/%m/%Y %H:%M:%S", False),
    (["20250403 10:00:00"], "%Y%m%d %H:%M:%S", False), (["030425 10:00:00"], "%d%m%y %H:%M:%S", False),
    (["12/04/2025T10:00:00"], "%d/%m/%YT%H:%M:%S", True),
    (["12/12/2025 10:00", "11/13/2025 10:00"], "%m/%d/%Y %H:%M", False),
])  # fmt: skip
def test_days_and_months_are_told_by_those_beyond_twelve(cells: list[str], pattern: str, doubt: bool) -> None:
    found = _pattern(cells)
    assert (found[0], bool(found[1])) == (pattern, doubt)


def meaning(role: str, score: float = 1.0, *words: str) -> tuple[Meaning, ...]:
    return (Meaning(role, score, frozenset(words)),)


@pytest.mark.parametrize(("size", "unit"), [(1.0, "s"), (1e3, "ms"), (1e6, "us"), (1e9, "ns")])
def test_numbers_since_1970_are_told_by_their_size(size: float, unit: str) -> None:
    zero = 1.7e9
    (found,) = clocks([column(size * (zero + np.arange(40.0)), means=meaning("time"))])
    assert found.keys["unit"] == quoted(unit)
    assert found.keys["format"] == quoted("epoch")
    assert np.diff(found.t) == pytest.approx(1.0, abs=1e-5)
    assert found.t[0] == pytest.approx(zero - 946684800.0, abs=1e-5)
    for middle, epoch in ((0.93e9, False), (0.95e9, True), (2.4e9, True), (2.6e9, False)):
        (one,) = clocks([column(size * (middle + np.arange(40.0)), means=meaning("time"))])
        assert ("format" in one.keys) == epoch


def test_numbers_that_rise_are_seconds_or_what_their_header_says() -> None:
    for unit, size in (("", 1.0), ("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("min", 60.0), ("h", 3600.0)):
        (found,) = clocks([column(np.arange(40.0), means=meaning("time"), unit=unit)])
        assert found.t == pytest.approx(size * np.arange(40.0))
        assert found.keys["unit"] == quoted(unit or "s")
        assert found.units == (() if unit else ("ms", "min", "us"))
    assert clocks([column(np.arange(40.0), means=meaning("time", 0.39))]) == []
    assert len(clocks([column(np.arange(40.0), means=meaning("time", 0.41))])) == 1
    assert clocks([column(-np.arange(40.0), means=meaning("time"))]) == []
    gone = np.where(np.arange(40) < 9, NAN, np.arange(40.0))
    assert clocks([column(gone, means=meaning("time"))]) == []  # .775 of the rows
    assert len(clocks([column(np.where(np.arange(40) < 8, NAN, np.arange(40.0)), means=meaning("time"))])) == 1


def test_gps_weeks_and_days_without_a_date() -> None:
    week, tow = column(np.full(40, 2300.0), "wk", means=meaning("week")), column(
        1000.0 * np.arange(40.0) + 6.1e8, "tow", means=meaning("tow")
    )
    (found,) = clocks([week, tow])
    assert found.keys["unit"] == quoted("ms")
    assert found.t == pytest.approx(2300 * 604800.0 + 6.1e5 + np.arange(40.0))
    small = replace(tow, values=np.arange(40.0) + 6.04e5)
    assert "unit" not in clocks([week, small])[0].keys
    assert clocks([replace(week, values=np.full(40, 4000.0)), tow]) == []
    cells = tuple(f"23:59:{50 + k}" if k < 10 else f"00:00:{k - 10:02d}" for k in range(40))
    (day,) = clocks([column(np.full(40, NAN), kind="clock", cells=cells)])
    assert np.diff(day.t) == pytest.approx(1.0)


# -- cells and names


@pytest.mark.parametrize(("cells", "kind", "values"), [
    (["12.5", "nan", "", "-3"], "number", [12.5, NAN, NAN, -3.0]), (["12.3 S", "4 P"], "letters", [12.3, 4.0]),
    (["63° 26.4' N", "10° 30' S"], "minutes", [63.44, -10.5]),
    (["63° 26' 24\" N", "1° 0' 36\" W"], "dms", [63.44, -1.01]),
    (["10:30:00", "10:30:01"], "clock", None), (["2025-01-01", "2025-01-02"], "date", None),
    (["2025-01-01T10:00:00Z"] * 2, "iso", None), (["01.02.2025 10:00"] * 2, "stamp", None), (["", "na"], "empty", None),
    (["x", "y"], "text", None), (["20250101", "20250102"], "date", None),
    (["1", "2", "off", "3"], "number", [1, 2, NAN, 3]),
])  # fmt: skip
def test_cells_are_of_a_kind(cells: list[str], kind: str, values: list[float] | None) -> None:
    found = _read(tuple(cells), ".")
    assert found[0] == kind
    if values is not None:
        assert found[1] == pytest.approx(values, nan_ok=True)
    assert found[3] == (("off",) if "off" in cells else ())


def test_units_beside_numbers_are_taken_off() -> None:
    assert spoken(("5.2 kn", "5.4 kn", ""), ".") == ("kn", ("5.2", "5.4", ""))
    assert spoken(("5.2 kn", "5.4", "6"), ".")[0] == ""  # a third of them
    assert spoken(("5.2 kn", "5.4"), ".")[0] == "kn"
    assert spoken(("5.2 kn", "5.4 deg"), ".")[0] == ""
    assert spoken(("5.2 S", "5.4 N"), ".")[0] == ""


def test_names_are_taken_apart() -> None:
    assert parted("RUD [deg]") == ("RUD", "deg")
    assert parted("SPD(GND)") == ("SPD(GND)", "")
    assert parted("speed, kn") == ("speed", "kn")
    assert parted("speed, over ground") == ("speed, over ground", "")
    assert tokens("rudderAngle_PS2") == ["rudder", "angle", "ps", "2"]
    assert (unit_of("[Grad]"), unit_in_name("hdg_deg"), unit_in_name("rot deg min"), unit_in_name("x m")) == (
        "deg", "deg", "deg/min", ""
    )  # fmt: skip
    scores = {one.role: one.score for one in meanings("rudder angle")}
    assert scores["delta"] == pytest.approx(1.11)
    strange = {one.role: one.score for one in meanings("rudder angle foo")}
    assert strange["delta"] == pytest.approx(1.11 / 1.7 - 0.05)
    port = meanings("port rudder angle cmd")[0]
    assert (port.words, port.number) == (frozenset({"port", "command"}), 0)
    assert meanings("rudder angle 2")[0].number == 2
    assert meanings("data", "logs/rudder")[0].role == "delta"
    assert meanings("data", "logs/rudder")[0].score < meanings("rudder data")[0].score


def test_rudders_of_both_sides_are_numbered_from_port() -> None:
    def of(*columns: Any) -> set[str]:
        return set(sided(signals(columns, ())))

    both = [column([1.0, 2.0], head, means=meaning("delta", 1.0, side))
            for head, side in (("a", "starboard"), ("b", "port"))]  # fmt: skip
    assert of(*both) == {"delta_1", "delta_2"}
    assert signals(both, ())["delta_1"].column.head == "b"
    assert of(both[0]) == {"delta"}
    order = column([1.0, 2.0], "c", means=meaning("delta", 1.0, "command"))
    assert of(both[0], order) == {"delta", "delta_cmd"}
    assert of(column([1.0, 2.0], means=meaning("north"))) == set()
    assert of(column([1.0, 2.0], means=meaning("u", 0.44))) == set()
    assert of(column([1.0, 2.0], means=meaning("u", 0.46))) == {"u"}
    assert signals([column([1.0, 2.0], "t", means=meaning("u"))], ("t",)) == {}
    fit, wrong = (column([1.0, 2.0], head, means=meaning("u"), unit=unit)
                  for head, unit in (("m", "m/s"), ("d", "deg")))  # fmt: skip
    assert signals([wrong, fit], ())["u"].column.head == "m"
    assert (signal("r", [1.0], unit="deg/s").unit, signal("r", [1.0], unit="kn").unit) == ("deg/s", "")


def test_the_column_of_trials_has_few_values_each_in_one_piece() -> None:
    t = np.arange(100.0)

    def of(*cells: str) -> bool:
        one = column(np.zeros(100), means=meaning("trial"), cells=tuple(cells))
        return trial_column([one], t) is not None

    assert of(*["a"] * 40, *["b"] * 60)
    assert not of(*["a"] * 100)
    assert not of(*["a"] * 40, *["b"] * 30, *["a"] * 30)
    assert of(*(str(k // 20) for k in range(100)))  # four changes
    assert not of(*(str(k // 16) for k in range(100)))  # six, of five at most


# -- layouts


@pytest.mark.parametrize(("cell", "mark", "value"), [
    ("1.5", ".", 1.5), ("1,5", ".", None), ("1,5", ",", 1.5), (" -2e3 ", ".", -2000.0), (".5", ".", 0.5),
    ("", ".", None),
])  # fmt: skip
def test_numbers_have_their_decimal_mark(cell: str, mark: str, value: float | None) -> None:
    assert number(cell, mark) == value


def test_what_is_a_value_in_a_cell() -> None:
    for good in ("1.5", "12.3 S", "10:30:00", "2025-01-01", "1/2/2025", "01.02.2025", "63° 26' N", "5 kn", "3 %"):
        assert is_value(good), good
    for wrong in ("abc", "", "1.5x2", "time", "S", "1-2"):
        assert not is_value(wrong), wrong
    assert split_line('"a b" ; c;d', ";") == ["a b", "c", "d"]
    assert split_line(" a  b\tc", "whitespace") == ["a", "b", "c"]


def test_encodings_by_their_marks_zeros_and_letters(tmp_path: Path) -> None:
    for raw, encoding in (("a,ø\n1,2".encode(), "utf-8-sig"), ("a,ø\n1,2".encode("cp1252"), "cp1252"),
                          (codecs.BOM_UTF16_LE + "a,b".encode("utf-16-le"), "utf-16"),
                          ("a,b\n1,2".encode("utf-16-le"), "utf-16-le"),
                          ("a,b\n1,2".encode("utf-16-be"), "utf-16-be")):  # fmt: skip
        (tmp_path / "a").write_bytes(raw)
        assert decoded(tmp_path / "a")[1] == encoding
    (tmp_path / "a").write_bytes(b"\0\0 \r\n")
    with pytest.raises(DataError, match="empty"):
        decoded(tmp_path / "a")


def test_a_header_units_and_lines_before_are_found(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("a log\n\nt;psi;u\ns;deg;-\n0,0;1,5;2\n1,0;2,5;3\n\n2,0;3,5;4\n")
    found = read_text(path)
    assert found.layout == Layout("utf-8-sig", ";", ",", 2, 1)
    assert (found.heads, found.units) == (("t", "psi", "u"), ("s", "deg", "-"))
    assert found.columns[1] == ("1,5", "2,5", "3,5")
    for text, about in (("1,2\n3,4\n", "line 1: no header with 2 names"), ("a,b\n1,2\n", "1 rows of numbers"),
                        ("a\nb\nc\n", "no rows of numbers")):  # fmt: skip
        path.write_text(text)
        with pytest.raises(DataError, match=about):
            read_text(path)


# -- logs of several files


def topic(t: Array, name: str = "a", **columns: Any) -> Topic:
    made = tuple(column(values, head, means=meaning(head)) for head, values in columns.items())
    table = Table(Path(name), Layout(), tuple(columns), ("",) * len(columns), tuple(one.cells for one in made))
    return Topic(name, table, made, Clock({}, t, Answer(""), (), 1.0))


def log(main: Topic, *topics: Topic, **more: Any) -> Log:
    return Log(main, topics, main.clock.t if main.clock else np.zeros(0), slice(None), {}, **more)


def test_files_that_follow_each_other_within_twenty_steps_are_pieces() -> None:
    first = topic(np.arange(50.0))
    for gap, pieces in ((20.0, True), (20.5, False), (0.5, True), (0.0, False), (-3.0, False)):
        second = topic(49.0 + gap + np.arange(50.0), "b")
        assert _pieces([second, first]) == pieces


def test_a_leap_divides_a_file_where_it_is_a_hundred_steps_and_half_a_minute() -> None:
    def file(gap: float, step: float = 1.0, rows: int = 60) -> Array:
        return np.concatenate([step * np.arange(rows), step * (rows - 1) + gap + step * np.arange(rows)])

    assert leap(file(101.0)) == 50.0
    assert leap(file(99.0)) is None
    assert leap(file(31.0, 0.1)) == 16.0
    assert leap(file(29.0, 0.1)) is None
    assert leap(file(500.0, rows=25)) is None  # 49 steps
    assert leap(file(500.0, rows=26)) is not None
    many = np.concatenate([1000.0 * k + np.arange(40.0) for k in range(5)])
    assert leap(many) is None  # four leaps of 199 steps are too many
    assert _longest([], file(500.0)[:100]) == slice(0, 60)


def test_noise_of_a_rudder_amidships_is_no_motion_beside_a_zigzag(tmp_path: Path) -> None:
    """The first file by name goes straight on and is longest; its noise goes from end to end of its own small range."""
    noise = 0.2 * np.sin(np.arange(120.0) * math.pi / 2.0)
    zigzag = 20.0 * np.sign(np.sin(np.arange(100.0) * math.pi / 25.0 + 0.1))
    for name, rudder in (("ahead", noise), ("zigzag", zigzag)):
        rows = "\n".join(f"{k},{angle:.1f}" for k, angle in enumerate(rudder))
        (tmp_path / f"{name}.csv").write_text(f"time [s],rudder [deg]\n{rows}\n", encoding="utf-8")
    tables = [read_tables(tmp_path / f"{name}.csv")[0] for name in ("ahead", "zigzag")]
    assert _alike(tmp_path, tables, []).main.name == "zigzag.csv"


def test_the_rudder_that_moves_most_is_looked_at_and_the_topic_that_says_most() -> None:
    wave = np.sin(np.arange(80.0) * math.pi / 2.0)
    busy = topic(np.arange(80.0), delta=wave, heading=np.arange(80.0))
    assert _moved(busy) == pytest.approx((79.0, 2.0))
    assert _moved(topic(np.arange(80.0), heading=np.arange(80.0))) == (79.0, 79.0)
    assert _moved(topic(np.arange(80.0), u=wave)) == (0.0, 0.0)
    assert [_weight({name: signal(name, [1.0, 2.0])}) for name in ("heading", "qw", "x", "latitude", "u")] == [
        2.0, 2.0, 1.0, 1.0, 0.0
    ]  # fmt: skip
    assert _weight({"heading": signal("heading", [1.0, 1.0])}) == 0.0
    assert _shared_end(["a_1.csv", "bb_1.csv"]) == "_1.csv"


def test_values_go_onto_other_times_by_lines_or_the_nearest() -> None:
    own, t = np.array([0.0, 2.0, 4.0]), np.array([-1.0, 0.9, 1.1, 3.0, 5.0])
    lines = _onto(t, own, signal("u", [0.0, 2.0, 6.0]))
    assert lines == pytest.approx([NAN, 0.9, 1.1, 4.0, NAN], nan_ok=True)
    assert _onto(t, own, signal("heading", [0.0, 350.0, 10.0])).tolist() == [0.0, 0.0, 350.0, 10.0, 10.0]
    assert _onto(t, own[::-1], signal("u", [6.0, 2.0, 0.0])) == pytest.approx(lines, nan_ok=True)


def test_lines_reach_over_usual_delays_and_orders_hold() -> None:
    def keys(t: Array, table: str = "channels.u") -> dict[str, str]:
        return _reaching(log(topic(np.arange(9.0)), topic(t, "b")), Entry(table, {"file": quoted("b")})).keys

    even = np.arange(40.0)
    assert "limit" not in keys(even)
    late = np.append(even, 39.0 + 2.4)
    assert "limit" not in keys(late)
    assert keys(np.append(even, 39.0 + 2.6))["limit"] == "2.5"
    assert keys(0.1 * np.append(even, 39.0 + 40.0))["limit"] == "1"  # a second at least
    assert keys(0.1 * np.append(even, 39.0 + 4.0))["limit"] == "0.4"
    held = keys(np.append(even, 39.0 + 12.0), "channels.delta_cmd")
    assert (held["limit"], held["interpolate"]) == ("12", quoted("hold"))
    assert keys(np.append(even, 99.0), "channels.delta_cmd")["limit"] == "30"
    assert keys(even, "x") == {"file": quoted("b")}


def test_rows_that_repeat_a_time_are_told_and_left_out_once() -> None:
    t = np.array([0.0, 1.0, 1.0, 2.0, 1.5, NAN, 3.0, *range(4, 40)])
    rows, found = _once(t, {"u": signal("u", np.arange(t.size))}, slice(None))
    assert rows[:4].tolist() == [0.0, 1.0, 2.0, 3.0]
    assert found["u"].values[:4].tolist() == [0.0, 1.0, 3.0, 6.0]
    same = np.repeat(np.arange(20.0), 2)
    (entry,) = _repeats(log(topic(same, u=np.repeat(np.arange(20.0), 2))))
    assert (entry.keys["duplicates"], entry.answer.doubts) == (quoted("first"), ())
    (entry,) = _repeats(log(topic(same, u=np.arange(40.0))))
    assert (entry.keys["duplicates"], len(entry.answer.doubts)) == (quoted("spread"), 1)
    uneven = np.repeat(np.arange(8.0), [1, 9, 2, 7, 1, 8, 3, 9])
    (entry,) = _repeats(log(topic(uneven, u=np.arange(40.0))))
    assert (entry.keys["duplicates"], len(entry.answer.doubts)) == (quoted("mean"), 1)
    seldom = np.concatenate([[0.0], np.arange(39.0)])
    (entry,) = _repeats(log(topic(seldom, u=np.arange(40.0))))
    assert entry.keys["duplicates"] == quoted("first")
    assert entry.answer.evidence.startswith("1 rows repeat the time of another, with other values")
    assert not list(_repeats(log(topic(np.arange(40.0), u=np.arange(40.0)))))


def test_minutes_that_run_on_become_degrees() -> None:
    place = {"latitude": signal("latitude", [-6330.0, 6315.0]), "longitude": signal("longitude", [10.5, 10.6])}
    found = in_degrees(place)
    assert found["latitude"].values == pytest.approx([-63.5, 63.25])
    assert found["longitude"].values == pytest.approx([10.5, 10.6])


def test_a_mapping_is_written_with_keys_before_tables() -> None:
    entries = [Entry("b", {"k": "1"}, Answer("why", ("or not",))), Entry("", {"top": quoted('a"b\t\\')})]
    assert text_of(["head", ""], entries) == (
        '# head\n\n\ntop = "a\\"b\\t\\\\"\n\n# why\n# DOUBT: or not\n[b]\nk = 1\n'
    )
    assert listed(["a", "b"]) == '["a", "b"]'
    assert Entry("", {"a": quoted("?"), "b": "1"}).asked == ("a",)
    assert TABLE.heads == ()


@pytest.mark.parametrize(("values", "unit", "form"), [
    ([0.6, 0.61], "rad", "rad"), ([-3.14, 3.1], "rad", "rad"), ([35.0, 35.1], "rad", "deg"), ([1.2, 1.3], "", "deg"),
    ([351234567.0, 351234667.0], "", "1e-7 deg"), ([3559.99, 3600.01], "", "ddmm.mmm"),
])  # fmt: skip
def test_angles_of_a_place_are_in_what_their_size_allows(values: list[float], unit: str, form: str) -> None:
    assert angle_form(signal("latitude", values, unit=unit)) == form


def test_a_sheet_of_words_alone_is_no_table() -> None:
    words = [["a", "b"], ["c", "d"], ["e", "f"], ["g", "h"]]
    assert _of_sheet(Path("a.xlsx"), "", words) is None
    found = _of_sheet(Path("a.xlsx"), "", [*words[:2], ["1", "2"], ["3", "4"]])
    assert found is not None
    assert (found.heads, found.columns) == (("c", "d"), (("1", "3"), ("2", "4")))


def test_the_layout_has_a_key_for_what_is_not_usual_and_a_word_for_each_key_alone() -> None:
    def entry(**more: Any) -> Entry:
        main = topic(np.arange(5.0), psi=np.zeros(5))
        return _layout_entry(log(replace(main, table=replace(main.table, layout=replace(Layout(), **more)))))

    plain = entry()
    assert (plain.keys, plain.answer.evidence) == ({}, "")
    assert entry(delimiter=";").keys == {"delimiter": '";"'}
    strange = entry(skip=3, units_row=1, decimal=",", footer=2, encoding="utf-16")
    assert strange.keys == {"skip": "3", "footer": "2", "units_row": "true", "decimal": '","'}
    assert strange.answer.evidence == ("3 lines before the header; 2 lines after the last row; "
                                   "the row below the header has units")  # fmt: skip


@pytest.mark.parametrize(("hours", "is_clock"), [(0.45, True), (0.49, False)])
def test_days_are_a_clock_where_rows_are_nearer_than_half_an_hour(hours: float, is_clock: bool) -> None:
    values = 45_000.0 + hours / 24.0 * np.arange(50)
    found = _days([column(values, "Time", means=meanings("Time"))])
    assert bool(found) == is_clock


def test_half_of_a_position_is_none_and_the_clock_is_no_quantity() -> None:
    columns = [column(np.linspace(1.0, 2.0, 9), head, means=meanings(head)) for head in ("Latitude", "Heading", "Time")]
    assert set(signals(columns, ("Time",))) == {"heading"}
    columns += [column(np.linspace(1.0, 2.0, 9), "Longitude", means=meanings("Longitude"))]
    assert set(signals(columns, ("Time",))) == {"heading", "latitude", "longitude"}
