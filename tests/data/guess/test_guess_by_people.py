"""Tables as people make them: merged cells, names twice, other letters, words for orders, odd units and stamps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from columns import TABLE, column, signal
from turning_log import SCHEMA, fixes, table, trials, truth

from seatrial.data import Array, Trial
from seatrial.data.formats import logs
from seatrial.data.guess import guess
from seatrial.data.guess.cells import columns_of
from seatrial.data.guess.layout import Layout, Table, decoded, groups, read_text, told_apart
from seatrial.data.guess.logs import Topic, _moved
from seatrial.data.guess.motion import _aside, _gons, _whole
from seatrial.data.guess.naming import meanings, tokens, unit_of
from seatrial.data.guess.thrust import _scaled, halves_of_rudder
from workbooks import write_sheets

KNOT = 1852.0 / 3600.0
EPOCH = 1788440400.0
"""13 o'clock of 3 September 2026."""


def rows_of(**more: list[object]) -> dict[str, list[object]]:
    true = truth(dt=2.0)
    latitude, longitude = fixes(true)
    course = np.degrees(true["psi"] + np.arctan2(true["v_m"], true["u"])) % 360.0
    return {"Time [s]": list(true.t), "Lat": list(latitude), "Lon": list(longitude),
            "SOG [kn]": list(np.hypot(true["u"], true["v_m"]) / KNOT), "COG": list(course), **more}  # fmt: skip


def heading() -> list[object]:
    return list(np.degrees(truth(dt=2.0)["psi"]) % 360.0)


def rudder(factor: float = 1.0) -> list[object]:
    return list(factor * np.degrees(truth(dt=2.0)["delta"]))


def the(log: Path) -> Trial:
    """The trial of the guess."""
    (one,) = trials(log, answered(guess(log).text))
    return one


def answered(text: str) -> str:
    """The text of a guess without its schema; the ship turns evenly, which tells no side of a rudder."""
    return text.replace(SCHEMA, "").replace('sign = "?"', "sign = 1")


@pytest.mark.slow
@pytest.mark.parametrize("book", [False, True])
def test_names_of_groups_over_the_header_tell_columns_apart(book: bool, tmp_path: Path) -> None:
    rows = rows_of(Heading=heading(), Angle=rudder())
    over = ["", "GPS", "", "", "", "Gyro", "Rudder"]
    if book:
        cells = [list(map(str, row)) for row in zip(*rows.values(), strict=True)]
        log = write_sheets(tmp_path / "log.xlsx", {"Run": [over, [*rows], *cells]})
    else:
        log = table(tmp_path / "log.csv", rows)
        log.write_text(",".join(over) + "\n" + log.read_text())
    found = guess(log)
    assert 'columns = ["Time [s]", "' in found.text
    assert 'column = "Rudder Angle"' in found.text
    one, true = the(log), truth(dt=2.0)
    assert one["delta"] == pytest.approx(true["delta"])
    assert np.sin(one["psi"] - true["psi"]) == pytest.approx(0.0, abs=1e-9)


def test_a_title_or_a_remark_over_the_header_is_no_name_of_a_group(tmp_path: Path) -> None:
    assert groups(["", "GPS", "", "Gyro"])
    assert not groups(["Sea trial of 14 May", "", "", ""])
    assert not groups(["", "GPS", "", "12.5"])
    assert not groups(["a", "b", "c", "d"])
    log = table(tmp_path / "log.csv", rows_of(Heading=heading(), Rudder=rudder()))
    log.write_text("Ship,Ann,Crew,Bo,,,\n" + log.read_text())
    plain = read_text(log)
    assert told_apart(plain) is plain  # the header alone tells as much


@pytest.mark.slow
def test_of_columns_of_one_name_the_later_ones_get_a_number(tmp_path: Path) -> None:
    rows = rows_of(Heading=heading(), Rudder=rudder())
    log = table(tmp_path / "log.csv", rows)
    lines = log.read_text().splitlines()
    twice = [f"{line},{'Heading' if k == 0 else float(line.split(',')[5]) - 4.0}" for k, line in enumerate(lines)]
    log.write_text("\n".join(twice) + "\n")
    found = guess(log)
    assert any("two columns are called Heading: this is the first, Heading (2) the" in one for one in found.doubts)
    assert np.sin(the(log)["psi"] - truth(dt=2.0)["psi"]) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("name", "role"), [
    ("船首方位", "heading"), ("対地速力(kn)", "sog"), ("対地針路", "cog"), ("舵角", "delta"), ("纬度", "latitude"),
    ("经度", "longitude"), ("对地航速", "sog"), ("对地航向", "cog"), ("航向", "heading"), ("主机转速", "n_P"),
    ("转艏角速度", "r"), ("时间", "time"), ("艏向角", "heading"), ("선수방위", "heading"), ("相对风速", "U_A"),
    ("Широта", "latitude"), ("КУРС", "heading"), ("Путевой угол, ", "cog"), ("Скорость над грунтом", "sog"),
    ("Угол перекладки руля", "delta"), ("Руль", "delta"), ("Время", "time"), ("Обороты", "n_P"),
])  # fmt: skip
def test_names_in_other_letters_are_known(name: str, role: str) -> None:
    assert meanings(name.partition("(")[0])[0].role == role


def test_units_in_other_letters_are_known() -> None:
    said = {"节": "kn", "度": "deg", "度/秒": "deg/s", "ノット": "kn", "转/分": "rpm", "米/秒": "m/s", "秒": "s",
            "уз": "kn", "град": "deg", "об/мин": "rpm", "nœuds": "kn"}  # fmt: skip
    assert {one: unit_of(one) for one in said} == said
    assert tokens("Rudder angle") == ["rudder", "angle"]


@pytest.mark.slow
@pytest.mark.parametrize(("encoding", "names"), [
    ("gb18030", ("时间 (秒)", "纬度", "经度", "对地航速(节)", "对地航向", "船首向", "舵角(度)")),
    ("cp1251", ("Время (сек)", "Широта", "Долгота", "Скорость (уз)", "Путевой угол", "Курс", "Руль (град)")),
    ("shift_jis", ("時刻 (秒)", "緯度", "経度", "対地速力(kn)", "対地針路", "船首方位", "舵角(deg)")),
])  # fmt: skip
def test_tables_in_other_letters_come_in(encoding: str, names: tuple[str, ...], tmp_path: Path) -> None:
    rows = dict(zip(names, rows_of(Heading=heading(), Rudder=rudder()).values(), strict=True))
    log = table(tmp_path / "log.csv", rows, encoding=encoding)
    assert decoded(log)[1] == encoding
    one, true = the(log), truth(dt=2.0)
    assert one["delta"] == pytest.approx(true["delta"])
    assert one["u"] == pytest.approx(true["u"], abs=1e-6)
    assert np.sin(one["psi"] - true["psi"]) == pytest.approx(0.0, abs=1e-9)


def test_german_letters_are_not_taken_for_chinese_ones(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_bytes("Zeit [s];Kurs über Grund [°];Länge\n1;2;3\n".encode("cp1252"))
    assert decoded(log)[1] == "cp1252"


@pytest.mark.slow
def test_a_rudder_in_words_has_its_sides_and_its_middle(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    angle = np.where(true.t > 90.0, 0.0, true["delta"])
    said = ["Midships" if a == 0 else f"{'Stbd' if a > 0 else 'Port'} {abs(np.degrees(a)):.1f}" for a in angle]
    one = the(table(tmp_path / "log.csv", rows_of(Heading=heading(), Rudder=said)))
    assert one["delta"] == pytest.approx(angle)


@pytest.mark.slow
def test_orders_in_words_are_named_and_letters_read_them(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    said = ["Half Ahead" if t < 60.0 else "FULL AHEAD" if t < 90.0 else "Stop" for t in true.t]
    log = table(tmp_path / "log.csv", rows_of(Heading=heading(), Rudder=rudder(), EOT=said))
    found = guess(log)
    assert any("'EOT' has orders in words (FULL AHEAD, Half Ahead, Stop)" in one for one in found.doubts)
    orders = '[channels.n_P_cmd]\ncolumn = "EOT"\nunit = "rpm"\n'
    orders += 'letters = { "full ahead" = 90, "half ahead" = 60, stop = 0 }'
    (one,) = trials(log, answered(found.text) + orders)
    assert 60.0 * one["n_P_cmd"] == pytest.approx(np.select([true.t < 60.0, true.t < 90.0], [60.0, 90.0], 0.0))


@pytest.mark.slow
def test_degrees_true_are_degrees(tmp_path: Path) -> None:
    said = [f"{a:07.3f}°T" for a in heading()]
    one = the(table(tmp_path / "log.csv", rows_of(Heading=said, Rudder=rudder())))
    assert np.sin(one["psi"] - truth(dt=2.0)["psi"]) == pytest.approx(0.0, abs=1e-4)


def test_gons_are_told_by_a_circle_of_400() -> None:
    assert _gons(np.array([0.0, 399.9, np.nan]))
    assert not _gons(np.array([0.0, 359.9]))
    assert not _gons(np.array([0.0, 400.1]))
    assert not _gons(np.array([-10.0, 380.0]))
    assert not _gons(np.array([np.nan]))


@pytest.mark.slow
def test_headings_and_courses_in_gons_come_in(tmp_path: Path) -> None:
    rows = rows_of(Heading=[a / 0.9 for a in heading()], Rudder=rudder())
    log = table(tmp_path / "log.csv", {**rows, "COG": [a / 0.9 for a in rows["COG"]]})
    one, true = the(log), truth(dt=2.0)
    assert np.sin(one["psi"] - true["psi"]) == pytest.approx(0.0, abs=1e-9)
    assert one["v_m"] == pytest.approx(true["v_m"], abs=1e-6)


@pytest.mark.slow
def test_a_ship_that_goes_astern_by_its_heading_is_a_doubt_and_no_other_sense_of_turn(tmp_path: Path) -> None:
    astern = [(a + 180.0) % 360.0 for a in heading()]
    found = guess(table(tmp_path / "log.csv", rows_of(Heading=astern, Rudder=rudder())))
    assert any("the bow is the stern: offset = 180" in one for one in found.doubts)
    assert "sign = -1\noffset" not in found.text
    found = guess(table(tmp_path / "log.csv", rows_of(Heading=heading(), Rudder=rudder())))
    assert not any("the bow is the stern" in one for one in found.doubts)


def test_astern_counts_as_a_fixed_angle_beside_what_is_aside_of_it() -> None:
    psi = np.full(30, 0.4)
    for off, aside in ((0.1, 0.1), (np.pi - 0.4, 0.5), (np.pi, 0.3)):
        assert _aside(np.cos(psi + off), np.sin(psi + off), psi) == pytest.approx(aside)


@pytest.mark.slow
def test_parts_of_a_day_beside_a_day_of_spreadsheets_are_a_clock(tmp_path: Path) -> None:
    rows = rows_of(Heading=heading(), Rudder=rudder())
    t = np.array(rows.pop("Time [s]"), dtype=np.float64)
    when = {"Date": [45426] * t.size, "Time": [f"{(27012.25 + one) / 86400.0:.10f}" for one in t]}
    log = table(tmp_path / "log.csv", {**when, **rows})
    found = guess(log)
    assert any("parts of a day beside the days in 'Date'" in one for one in found.doubts)
    one = the(log)
    assert one.t - one.t[0] == pytest.approx(t, abs=1e-4)


def test_a_remark_that_looks_like_a_row_is_not_the_first(tmp_path: Path) -> None:
    log = table(tmp_path / "log.txt", {"t": np.arange(6.0).tolist(), "psi": np.arange(1.0, 7.0).tolist()}, "\t")
    log.write_text("Samples\t600\n***End***\n" + log.read_text())
    assert read_text(log).heads == ("t", "psi")
    assert read_text(log).layout.skip == 2


def test_the_pulse_of_rest_is_the_commonest_one_near_the_neutral() -> None:
    """Not that of a thrust which was held for longer."""
    pulses = [1510.0] * 20 + [1750.0] * 60 + [1504.0] * 5 + [1250.0] * 15
    keys, values, _ = _scaled(signal("throttle_1", pulses), "throttle")
    assert keys["offset"] == f"{-1510.0 / 410.0:.10g}"
    assert values[[0, 20]] == pytest.approx([0.0, 240.0 / 410.0])


def test_of_recordings_with_two_motors_the_one_that_drives_both_ways_is_looked_at() -> None:
    """Straight runs tell no side and spins no sense; a heading that crosses north has not moved."""
    wave, other = np.sin(np.arange(100) / 5.0), np.sin(np.arange(100) / 9.0)

    def far(port: Array, starboard: Array) -> float:
        columns = tuple(column(values, name, means=tuple(meanings(name))) for name, values in (
            ("thr_left", port), ("thr_right", starboard), ("yaw", 360.0 * (np.arange(100) % 2))))  # fmt: skip
        return _moved(Topic("a.csv", TABLE, columns, None))[0]

    assert far(wave, wave) == pytest.approx(0.0)
    assert far(wave, -wave) == pytest.approx(0.0)
    assert far(wave, other) > 10.0


@pytest.mark.slow
@pytest.mark.parametrize(("unit", "factor"), [("cm/s", 100.0), ("mm/s", 1000.0)])
def test_velocities_in_whole_numbers_are_tried_in_fine_units(unit: str, factor: float, tmp_path: Path) -> None:
    true = truth(dt=2.0)
    c, s = np.cos(true["psi"]), np.sin(true["psi"])
    rows = rows_of(Heading=heading(), Rudder=rudder())
    del rows["SOG [kn]"], rows["COG"]
    north = np.round(factor * (true["u"] * c - true["v_m"] * s)).astype(int).tolist()
    east = np.round(factor * (true["u"] * s + true["v_m"] * c)).astype(int).tolist()
    log = table(tmp_path / "log.csv", {**rows, "v_north": north, "v_east": east})
    assert f'unit = "{unit}"' in guess(log).text
    assert the(log)["u"] == pytest.approx(true["u"], abs=1.0 / factor)


def test_speeds_of_ships_are_tried_in_no_fine_units() -> None:
    assert _whole(np.array([61.0, np.nan]), np.array([3.0, 0.0]))
    assert not _whole(np.array([60.0]), np.array([3.0]))
    assert not _whole(np.array([300.0]), np.array([2.5]))
    assert not _whole(np.array([np.nan]), np.array([np.nan]))


def test_two_columns_that_are_never_over_together_are_one_rudder() -> None:
    over = 20.0 * np.sin(np.arange(100) / 9.0)
    port, starboard = np.maximum(-over, 0.0), np.maximum(over, 0.0)

    def doubts(a: Array, b: Array) -> int:
        found = {"delta_1": signal("delta_1", a, "Rudder P"), "delta_2": signal("delta_2", b, "Rudder S")}
        return sum(len(one.answer.doubts) for one in halves_of_rudder(found))

    assert doubts(port, starboard) == 1
    assert doubts(-port, starboard) == 0  # with their signs they are two rudders, or one that is split
    assert doubts(np.abs(over), np.abs(over)) == 0
    assert doubts(np.zeros(100), starboard) == 0
    assert list(halves_of_rudder({})) == []


def test_a_name_of_a_group_joins_only_the_names_that_say_less_alone() -> None:
    over = ("", "DGPS", "", "", "", "Kreisel", "Ruder", "Welle", "")
    heads = ("Zeit", "Breite", "Länge", "FüG", "KüG", "Kurs", "Lage", "Drehzahl", "")
    found = told_apart(Table(Path("a.csv"), Layout(skip=3), heads, ("",) * 9, ((),) * 9, over=over))
    assert found.heads[6] == "Ruder Lage"
    assert (*found.heads[:6:5], *found.heads[7:]) == ("Zeit", "Kurs", "Drehzahl", "")
    assert (found.layout.skip, found.layout.named) == (4, True)


@pytest.mark.slow
def test_a_control_that_no_entry_takes_is_a_doubt_also_where_the_mapping_names_all_columns(tmp_path: Path) -> None:
    rows = {**rows_of(Heading=heading()), "Actual": rudder(), "Ordered": rudder(1.1)}
    log = table(tmp_path / "log.csv", {**rows, "Angle": rudder(0.3)})
    log.write_text(",GPS,,,,Gyro,Helm servo,,Rudder\n" + log.read_text())
    found = guess(log)
    assert "columns = [" in found.text
    assert any("looks like a control" in one for one in found.doubts)
    assert "columns left out of log.csv" in found.text


def test_a_polish_log_in_its_own_encoding(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    latitude, longitude = fixes(true)

    def comma(values: Array | list[float]) -> list[object]:
        return [f"{one:.7f}".replace(".", ",") for one in values]

    cells = {"Czas [s]": comma(true.t), "Szer. geogr.": comma(latitude), "Dł. geogr.": comma(longitude),
             "Kurs żyro": comma(np.degrees(true["psi"]) % 360.0),
             "Prędkość [węzły]": comma(np.hypot(true["u"], true["v_m"]) / KNOT)}  # fmt: skip
    log = table(tmp_path / "a.csv", cells, ";", "cp1250")
    found = guess(log)
    assert 'encoding = "cp1250"' in found.text
    trial = trials(log, found.text.replace(SCHEMA, ""))[0]
    assert trial["x"] - trial["x"][0] == pytest.approx(true["x"] - true["x"][0], abs=0.05)


def test_stamps_with_a_blank_do_not_part_a_table_of_semicolons(tmp_path: Path) -> None:
    """A historian's tags and units are words, so that blanks would make more cells values than semicolons do."""
    lines = [f"03.09.2026 13:{k // 60:02d}:{k % 60:02d}.{20 * n:03d};NAV.{tag};{value + k};deg;Good"
             for k in range(120) for n, (tag, value) in enumerate((("GYRO", 20.0), ("STG.RUD", -60.0)))]  # fmt: skip
    log = tmp_path / "a.csv"
    log.write_text("Timestamp;TagName;Value;Unit;Quality\n" + "\n".join(lines) + "\n")
    assert read_text(log).heads == ("Timestamp", "TagName", "Value", "Unit", "Quality")


def test_a_rate_about_an_axis_is_no_speed_along_it() -> None:
    roles = {one.role for one in meanings("field.angular_velocity.x")} | {one.role for one in meanings("accel y")}
    assert not roles & {"u", "v", "vx", "vy", "x", "y"}
    assert meanings("field.angular_velocity.z")[0].role == "r"
    assert meanings("twist.linear.x")[0].role == "vx"


def test_files_of_one_trial_with_clocks_of_their_own(tmp_path: Path) -> None:
    true = truth(dt=0.5)
    latitude, longitude = fixes(true)
    for name, shift in (("zz10", 0.0), ("turn", 400.0)):
        stamps = [f"2026-09-03T13:{int(t + shift) // 60:02d}:{(t + shift) % 60.0:06.3f}Z" for t in true.t]
        own = {"utc": stamps, "lat": list(latitude), "lon": list(longitude)}
        table(tmp_path / "logs" / f"{name}_navigation.csv", {**own, "heading": list(np.degrees(true["psi"]) % 360.0)})
        epoch = [f"{EPOCH + t + shift:.3f}" for t in true.t]
        table(tmp_path / "logs" / f"{name}_control.csv", {"timestamp": epoch, "shaft_rpm": list(60.0 * true["n_P"])})
    found = guess(tmp_path / "logs")
    assert '[files.clocks."{trial}_control.csv"]' in found.text
    (tmp_path / "m.toml").write_text(found.text)
    read = {trial.name: trial for _, some in logs("csv", tmp_path / "logs", tmp_path / "m.toml") for trial in some}
    assert set(read) == {"zz10", "turn"}
    for trial in read.values():
        known = np.isfinite(trial["n_P"])
        assert known.mean() > 0.95
        assert trial["n_P"][known] == pytest.approx(np.interp(trial.t, true.t, true["n_P"])[known], abs=0.006)


def test_a_trial_may_stand_at_the_end_of_the_names_of_its_files(tmp_path: Path) -> None:
    true = truth(dt=0.5)
    latitude, longitude = fixes(true)
    for name, shift in (("zz10", 0.0), ("turn", 400.0)):
        own = {"time": list(true.t + shift), "lat": list(latitude), "lon": list(longitude)}
        table(tmp_path / f"nav_{name}.csv", {**own, "heading": list(np.degrees(true["psi"]) % 360.0)})
        table(tmp_path / f"ctl_{name}.csv", {"time": list(true.t + shift), "rpm": list(60.0 * true["n_P"])})
    text = guess(tmp_path).text
    assert 'pattern = "nav_{trial}.csv"' in text
    assert 'file = "ctl_{trial}.csv"' in text


@pytest.mark.parametrize("head", ["Engine (rpm)", "Main [1/min]", "Stb. Motor (rpm)"])
def test_a_name_with_revolutions_as_its_unit_is_that_of_a_shaft(head: str) -> None:
    lines = Table(Path("a.csv"), Layout(), (head,), ("",), (("100", "101", "102"),))
    assert columns_of(lines)[0].means[0].role == "n_P"
