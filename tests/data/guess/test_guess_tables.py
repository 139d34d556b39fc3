"""Tables of several ships, numbers that stand for none, groups of thousands, sheets, and long tables."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from columns import column
from turning_log import at, fixes, table, trials, truth

from seatrial.data import DataError
from seatrial.data.guess import guess
from seatrial.data.guess.layout import ungrouped
from seatrial.data.guess.logs import _gapped, _of_one, _ship_column, read_tables
from seatrial.data.guess.naming import meanings
from workbooks import write_workbook

KNOT = 1852.0 / 3600.0
SCHEMA = 'schema = "seatrial-mapping/1"\n'


def ship(number: int, east: float) -> dict[str, list[object]]:
    """The rows of the turning ship under a number, some way to the east."""
    true = truth(dt=2.0)
    latitude, longitude = fixes(true)
    return {"MMSI": [number] * true.t.size, "BaseDateTime": [at(t)[:19] + "Z" for t in true.t], "LAT": list(latitude),
            "LON": [one + east for one in longitude], "Heading": list(np.degrees(true["psi"]) % 360.0)}  # fmt: skip


def alternating(path: Path) -> Path:
    """Two ships whose rows take turns."""
    a, b = ship(257000001, 0.0), ship(257000002, 0.1)
    return table(path, {name: [one for two in zip(a[name], b[name], strict=True) for one in two] for name in a})


MAPPED = ('time = { column = "BaseDateTime", format = "iso" }\n[position]\nlatitude = "LAT"\nlongitude = "LON"\n'
          '[channels.psi]\ncolumn = "Heading"\nunit = "deg"\n[split]\ncolumn = "MMSI"\n')  # fmt: skip


def test_ships_that_take_turns_are_a_trial_each(tmp_path: Path) -> None:
    log, true = alternating(tmp_path / "ais.csv"), truth(dt=2.0)
    both = trials(log, MAPPED + "scattered = true\n")
    assert [one.name for one in both] == ["ais_257000001", "ais_257000002"]
    assert both[1].meta["datum"]["longitude"] - both[0].meta["datum"]["longitude"] == pytest.approx(0.1)
    for one in both:
        assert one.t == pytest.approx(true.t)
        assert np.hypot(one["x"] - true["x"], one["y"] - true["y"]).max() < 0.5
    with pytest.raises(DataError, match=r"again, after others; .*scattered = true"):
        trials(log, MAPPED)
    with pytest.raises(DataError, match=r"split.scattered is of split.column"):
        trials(log, MAPPED.replace('column = "MMSI"', "scattered = true"))


def test_the_column_of_the_ships_is_found_where_their_rows_alternate(tmp_path: Path) -> None:
    (both,) = read_tables(alternating(tmp_path / "ais.csv"))
    assert _ship_column(both) == "MMSI"
    one = _of_one(both, "MMSI")
    assert set(one.columns[0]) == {"257000001"}
    assert len(one.columns[0]) == len(both.columns[0]) / 2
    assert _ship_column(one) == ""
    assert _of_one(one, "") is one


def test_a_column_of_row_numbers_without_a_name_is_no_ship(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    latitude, longitude = fixes(true)
    rows = {"": list(range(true.t.size)), "t [s]": list(true.t), "lat": list(latitude), "lon": list(longitude),
            "heading [deg]": list(np.degrees(true["psi"]) % 360.0)}  # fmt: skip
    (one,) = read_tables(table(tmp_path / "log.csv", rows))
    assert _of_one(one, _ship_column(one)) is one
    assert 'column = "t [s]"' in guess(tmp_path / "log.csv").text


@pytest.mark.slow
def test_the_guess_divides_ships_and_its_import_takes_it(tmp_path: Path) -> None:
    log = alternating(tmp_path / "ais.csv")
    found = guess(log)
    assert 'column = "MMSI"\nscattered = true' in found.text
    assert len(trials(log, found.text.replace(SCHEMA, ""))) == 2


@pytest.mark.parametrize(("name", "value", "words"), [
    ("Heading", 511.0, ("511.0",)), ("LAT", 91.0, ("91.0",)), ("LON", 181.0, ("181.0",)), ("SOG", 102.3, ("102.3",)),
    ("Heading", 91.0, ()), ("rpm", 511.0, ()), ("roll", -999.0, ("-999.0",)), ("rudder", 9999.0, ("9999.0",)),
])  # fmt: skip
def test_a_number_that_stands_for_none_is_a_gap(name: str, value: float, words: tuple[str, ...]) -> None:
    (found,) = _gapped([column([10.0, value, 12.0, 60.0], name, means=tuple(meanings(name)))])
    assert found.missing == words
    assert np.isnan(found.values).tolist() == [False, bool(words), False, False]


def test_numbers_near_others_stay_and_a_column_of_none_alone_is_empty() -> None:
    near, turned, none = _gapped([
        column([350.0, 420.0, 511.0, 530.0], "Heading", means=tuple(meanings("Heading"))),
        column([700.0, 999.0, 850.0], "rpm", means=tuple(meanings("rpm"))),
        column([511.0, 511.0], "Heading", means=tuple(meanings("Heading"))),
    ])  # fmt: skip
    assert near.missing == turned.missing == ()
    assert none.kind == "empty"


@pytest.mark.parametrize(("sog", "gap"), [(102.3, True), (9.0, False)])
def test_a_course_of_360_is_none_where_the_speed_is_that_of_no_speed(sog: float, gap: bool) -> None:
    course = column([10.0, 360.0, 12.0], "COG", means=tuple(meanings("COG")))
    speed = column([8.0, sog, 8.2], "SOG", means=tuple(meanings("SOG")))
    assert np.isnan(_gapped([course, speed])[0].values).tolist() == [False, gap, False]


def speed_and_course(**more: list[object]) -> dict[str, list[object]]:
    """Rows of the turning ship as AIS tells them, in knots, without a heading."""
    true = truth(dt=2.0)
    latitude, longitude = fixes(true)
    course = np.degrees(true["psi"] + np.arctan2(true["v_m"], true["u"])) % 360.0
    return {"t [s]": list(true.t), "LAT": list(latitude), "LON": list(longitude),
            "SOG": list(np.hypot(true["u"], true["v_m"]) / KNOT), "COG": list(course), **more}  # fmt: skip


def test_speed_and_course_over_ground_are_channels_where_no_heading_is(tmp_path: Path) -> None:
    log = table(tmp_path / "ais.csv", speed_and_course())
    found = guess(log)
    assert '[channels.U_G]\ncolumn = "SOG"\nunit = "kn"' in found.text
    (one,) = trials(log, found.text.replace(SCHEMA, ""))
    true = truth(dt=2.0)
    assert one["U_G"] == pytest.approx(np.hypot(true["u"], true["v_m"]))
    off = one["gamma_G"] - true["psi"] - np.arctan2(true["v_m"], true["u"])
    assert np.sin(off) == pytest.approx(0.0, abs=1e-9)


def test_gaps_in_every_third_row_hide_no_unit(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    heading = [511.0 if k % 3 == 1 else one for k, one in enumerate(np.degrees(true["psi"]) % 360.0)]
    found = guess(table(tmp_path / "ais.csv", speed_and_course(Heading=heading)))
    assert 'unit = "kn"' in found.text
    assert not found.asks


@pytest.mark.parametrize(("cells", "mark", "plain"), [
    (("6,650,000.25", "6,650,001"), ".", ("6650000.25", "6650001")), (("950", "1,050.5"), ".", ("950", "1050.5")),
    (("1.234,5", "12"), ",", ("1234,5", "12")), (("1,5", "2,25"), ".", ("1,5", "2,25")),
    (("12.5", "3"), ".", ("12.5", "3")),
    (("1,234", "ab"), ".", ("1,234", "ab")),
])  # fmt: skip
def test_groups_of_three_digits_lose_their_marks(cells: tuple[str, ...], mark: str, plain: tuple[str, ...]) -> None:
    assert ungrouped(cells, mark) == plain


def test_groups_are_read_by_their_key_and_named_without_it(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text('t,N\n0,"6,650,000.00"\n1,"-1,000.5"\n2,999\n')
    mapping = 'time = { column = "t", unit = "s" }\n[channels.x]\ncolumn = "N"\nunit = "m"\n'
    assert trials(log, 'thousands = ","\n' + mapping)[0]["x"] == pytest.approx([6650000.0, -1000.5, 999.0])
    with pytest.raises(DataError, match='give thousands = "," in the mapping'):
        trials(log, mapping)
    with pytest.raises(DataError, match="thousands and decimal are both"):
        trials(log, 'thousands = "."\n' + mapping)
    log.write_text('t,N\n0,"6,65,0"\n1,3\n')
    with pytest.raises(DataError, match="line 2: '6,65,0' is not a number"):
        trials(log, 'thousands = ","\n' + mapping)


def test_a_long_table_is_read_by_its_names(tmp_path: Path) -> None:
    true = truth(dt=5.0)
    values = {"heading": np.degrees(true["psi"]), "sog": np.full(true.t.size, 4.0), "rudder": np.degrees(true["delta"])}
    log = table(tmp_path / "long.csv", {
        "_time": [at(t) for t in true.t for _ in values], "_field": list(values) * true.t.size,
        "_value": [float(f"{one[k]:.9g}") for k in range(true.t.size) for one in values.values()],
    })  # fmt: skip
    text = guess(log).text
    assert 'name = ["_field"]\nvalue = "_value"' in text
    answers = text.replace(SCHEMA, "").replace('sign = "?"', "sign = 1").replace('"?"', '"m/s"')
    read = trials(log, answers)[0]
    assert read["psi"] == pytest.approx(true["psi"], abs=1e-8)


def test_a_table_without_a_quantity_is_refused_rather_than_mapped_to_nothing(tmp_path: Path) -> None:
    log = table(tmp_path / "log.csv", {"time": list(range(30)), "pressure": [1000.0 + k for k in range(30)]})
    with pytest.raises(DataError, match=r"no column is known as a quantity of a ship's motion.*'pressure'"):
        guess(log)


def workbook(path: Path, empty: int) -> Path:
    """A workbook of two sheets alike, their rows below a title and so many empty rows."""
    true = truth()
    rows = zip(true.t, np.degrees(true["psi"]), np.degrees(true["delta"]), strict=True)
    cells = [[f"{one:.9g}" for one in row] for row in rows]
    write_workbook(path, [["Sea trial"], *[[""]] * empty, ["Time", "Heading", "Rudder"], *cells])
    with zipfile.ZipFile(path) as book:
        parts = {name: book.read(name).decode() for name in book.namelist()}
    again = '<sheet name="Second" sheetId="2" r:id="r1"/></sheets>'
    parts["xl/workbook.xml"] = parts["xl/workbook.xml"].replace("</sheets>", again)
    with zipfile.ZipFile(path, "w") as book:
        for name, text in parts.items():
            book.writestr(name, text)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("empty", [0, 1, 2])
def test_sheets_alike_are_trials_and_empty_rows_below_a_title_are_counted(empty: int, tmp_path: Path) -> None:
    log = workbook(tmp_path / "log.xlsx", empty)
    found = guess(log)
    assert f"skip = {1 + empty}" in found.text
    assert 'sheet = "*"' in found.text
    both = trials(log, found.text.replace(SCHEMA, "").replace('"?"', "1"))
    assert [one.name for one in both] == ["log_Sheet1", "log_Second"]
    for read in both:
        assert read["psi"] == pytest.approx(truth()["psi"])


def test_a_column_that_never_changes_is_left_out_with_its_value(tmp_path: Path) -> None:
    """A wind that a person wrote down once: it is no reading, and its number is what the user looks for."""
    true = truth(dt=2.0)
    latitude, longitude = fixes(true)
    log = table(tmp_path / "log.csv", {
        "Time": [at(t)[:19] + "Z" for t in true.t], "LAT": list(latitude), "LON": list(longitude),
        "Heading": list(np.degrees(true["psi"]) % 360.0), "Wind speed kn": [6] * true.t.size,
        "Watch": [k % 7 for k in range(true.t.size)],
    })  # fmt: skip
    assert "Wind speed kn (always 6), Watch" in guess(log).text
