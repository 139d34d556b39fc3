"""One turning ship, logged in many shapes: the mapping of each gives the same trial."""

from __future__ import annotations

import math
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from turning_log import DATUM, SCHEMA, at, fixes, table, trials, truth

from seatrial.data import DataError, Trial
from seatrial.data.importing import import_log
from workbooks import write_dates, write_workbook

TIME = 'time = { column = "Time", unit = "s" }\n'
HEADING = '[channels.psi]\ncolumn = "HDG"\nunit = "deg"\n'
RUDDER = '[channels.delta]\ncolumn = "RUD"\nunit = "deg"\n'


def plain(trial: Trial) -> dict[str, list[float]]:
    return {"Time": trial.t.tolist(), "HDG": (np.degrees(trial["psi"]) % 360.0).tolist(),
            "RUD": np.degrees(trial["delta"]).tolist()}  # fmt: skip


def same(found: Trial, true: Trial, names: str, within: float = 1e-9) -> None:
    for name in names.split():
        off = found[name] - true[name]
        if name in ("psi", "gamma_T", "gamma_A"):
            off = np.angle(np.exp(1j * off))
        assert np.abs(off).max() < within, name


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1", "cp1252"])
@pytest.mark.parametrize(("separator", "comma"), [(";", True), ("\t", True), (",", False), ("whitespace", False)])
def test_texts_of_any_encoding_separator_and_decimal_mark(
    tmp_path: Path, encoding: str, separator: str, comma: bool
) -> None:
    true = truth()
    said = {
        name: [str(v).replace(".", ",") if comma else str(v) for v in values] for name, values in plain(true).items()
    }
    said["Kurs_°"] = said.pop("HDG")
    path = table(tmp_path / "turn.csv", said, "   " if separator == "whitespace" else separator, encoding)
    told = f'encoding = "{encoding}"\n' if encoding in ("latin-1", "cp1252") else ""
    mark = 'decimal = ","\n' if comma else ""
    [found] = trials(path, f'delimiter = "{separator}"\n{told}{mark}{TIME}{HEADING}{RUDDER}'.replace("HDG", "Kurs_°"))
    assert found.t == pytest.approx(true.t)
    same(found, true, "psi delta")


def test_preamble_units_row_missing_words_and_quotes(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text('logger 7\nship;X\n"Time";HDG;"RUD"\ns;deg;deg\n(raw);;\n0;"1,5";3\n\n1;--;N/A\n2;2,5;"5"\n')
    [found] = trials(path, f'delimiter = ";"\nskip = 2\nunits_row = 2\ndecimal = ","\nmissing = ["N/A", "--"]\n{TIME}'
                     f"{HEADING}{RUDDER}")  # fmt: skip
    assert np.degrees(found["psi"]) == pytest.approx([1.5, math.nan, 2.5], nan_ok=True)
    assert np.degrees(found["delta"]) == pytest.approx([3.0, math.nan, 5.0], nan_ok=True)


def test_a_quoted_cell_may_hold_the_separator(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text('Time,note,HDG,RUD\n0,"calm, sunny",1,2\n1,x,2,2\n')
    [found] = trials(path, TIME + HEADING + RUDDER)
    assert np.degrees(found["psi"]) == pytest.approx([1.0, 2.0])


def test_workbooks_and_parquet(tmp_path: Path) -> None:
    true = truth()
    said = plain(true)
    rows = [["Voyage 7"], list(said), *([repr(v) for v in row] for row in zip(*said.values(), strict=True))]
    book = write_workbook(tmp_path / "turn.xlsx", rows)
    [found] = trials(book, f'skip = 1\nsheet = "Sheet1"\n{TIME}{HEADING}{RUDDER}')
    same(found, true, "psi delta")
    start = datetime(2025, 4, 11, 11, 51, 10)
    times = pl.datetime_range(start, start + timedelta(seconds=2), "1s", eager=True)
    pl.DataFrame({"Time": times, "HDG": [1, 2, 3]}).write_parquet(tmp_path / "a.parquet")
    [found] = trials(tmp_path / "a.parquet", f'time = {{ column = "Time", format = "iso", zone = "UTC" }}\n{HEADING}')
    assert found.t.tolist() == [0.0, 1.0, 2.0]
    assert np.degrees(found["psi"]) == pytest.approx([1, 2, 3])


def test_dates_and_times_of_a_workbook(tmp_path: Path) -> None:
    """Cells of the kind of a date, as a spreadsheet keeps them: days since the end of 1899."""
    day = 45758.0 + (11 * 3600 + 51 * 60 + 10) / 86400.0
    stamps = [day + k * 0.25 / 86400.0 for k in range(3)]
    book = write_dates(
        tmp_path / "a.xlsx", {"Stamp": stamps, "Clock": [v % 1.0 for v in stamps], "Date": [45758.0] * 3}, 3
    )
    for time in ('column = "Stamp"', 'date = "Date", column = "Clock"'):
        [found] = trials(book, f'time = {{ {time}, format = "iso", zone = "UTC" }}\n{HEADING}')
        assert found.t.tolist() == [0.0, 0.25, 0.5]
        assert found.meta["start"] == "2025-04-11T11:51:10.000000+00:00"
    [found] = trials(book, f'time = {{ column = "Clock", format = "clock" }}\n{HEADING}')
    assert found.t.tolist() == [0.0, 0.25, 0.5]


def test_letters_beside_numbers_or_in_a_column(tmp_path: Path) -> None:
    said = {
        "Time": [0, 1, 2, 3],
        "RUD": ["12.3 S", "P 4.5", "0", "7.5p"],
        "DEG": [10, 10, 0, 10],
        "SIDE": ["S", "P", "", "p"],
    }
    path = table(tmp_path / "a.csv", said)
    letters = "letters = { P = -1, S = 1 }\n"
    [found] = trials(path, TIME + RUDDER + letters + "scale = 2.0\noffset = 0.5\n")
    assert np.degrees(found["delta"]) == pytest.approx([25.1, -8.5, 0.5, -14.5])
    [found] = trials(path, TIME + RUDDER.replace("RUD", "DEG") + letters + 'letter = "SIDE"\n')
    assert np.degrees(found["delta"]) == pytest.approx([10, -10, 0, -10])


@pytest.mark.parametrize("format", ["deg", "ddmm.mmm", "dms"])
@pytest.mark.parametrize("letters", [True, False])
def test_positions_of_an_antenna_and_their_datum(tmp_path: Path, format: str, letters: bool) -> None:
    true = truth()

    def written(value: float, letter: str) -> str:
        whole, minutes = int(value), 60.0 * (value % 1.0)
        text = {"deg": f"{value:.10f}", "ddmm.mmm": f"{100 * whole + minutes:.8f}",
                "dms": f"{whole}°{int(minutes)}'{60.0 * (minutes % 1.0):.7f}\""}[format]  # fmt: skip
        return f"{text} {letter}" if letters else text

    latitude, longitude = fixes(true, 12.0, -3.0)
    said: dict[str, list[object]] = {**plain(true), "lat": [written(v, "N") for v in latitude]}
    path = table(tmp_path / "turn.csv", {**said, "lon": [written(v, "E") for v in longitude]})
    place = (f'[position]\nlatitude = "lat"\nlongitude = "lon"\nformat = "{format}"\nantenna = [12.0, -3.0]\n'
             f"datum = [{DATUM.latitude}, {DATUM.longitude}]\n")  # fmt: skip
    [found] = trials(path, TIME + HEADING + place)
    same(found, true, "x y", 1e-3)
    assert found.meta["datum"] == {"latitude": DATUM.latitude, "longitude": DATUM.longitude}


def test_speeds_of_an_antenna_and_an_apparent_wind(tmp_path: Path) -> None:
    """Speed and course over ground at the antenna, and the wind at the mast, give what midship and the earth have."""
    true = truth()
    c, s, r = np.cos(true["psi"]), np.sin(true["psi"]), true["r"]
    u, v = true["u"] + 3.0 * r, true["v_m"] + 12.0 * r
    north, east = u * c - v * s, u * s + v * c
    mast_u, mast_v = true["u"] - 1.0 * r, true["v_m"] + 20.0 * r
    beta = true["gamma_T"] - true["psi"]
    ahead, aside = 8.0 * np.cos(beta) + mast_u, 8.0 * np.sin(beta) + mast_v
    angle = np.degrees(np.arctan2(aside, ahead))
    said: dict[str, list[object]] = {
        **plain(true), "SOG": (np.hypot(north, east) * 3600 / 1852).tolist(), "VN": north.tolist(), "VE": east.tolist(),
        "COG": (np.degrees(np.arctan2(east, north)) % 360.0).tolist(), "AWS": np.hypot(ahead, aside).tolist(),
        "AWA": [f"{abs(a):.9f} {'S' if a > 0 else 'P'}" for a in angle.tolist()],
    }  # fmt: skip
    path = table(tmp_path / "turn.csv", said)
    wind = '[apparent]\nspeed = "AWS"\ndirection = "AWA"\nletters = { P = -1, S = 1 }\nmast = [20.0, 1.0]\n'
    polar = '[ground]\nspeed = "SOG"\ncourse = "COG"\nunit = "kn"\nantenna = [12.0, -3.0]\n'
    [found] = trials(path, TIME + HEADING + polar + wind)
    same(found, true, "u v_m U_T gamma_T", 1e-6)
    assert found.unit("U_G") == "m/s"
    [found] = trials(path, TIME + HEADING + '[ground]\nnorth = "VN"\neast = "VE"\nantenna = [12.0, -3.0]\n' + wind)
    same(found, true, "u v_m U_T gamma_T", 1e-6)
    [found] = trials(path, TIME + wind)
    assert "U_T" not in found
    assert "no true wind" in found.meta["processing"][-1]


@pytest.mark.parametrize(("extra", "factor", "added"), [
    ("sign = -1\n", -1.0, 0.0), ("towards = true\n", 1.0, 180.0), ("sign = -1\ntowards = true\n", -1.0, 180.0),
    ("offset = -7.5\n", 1.0, 7.5), ("sign = -1\noffset = -7.5\n", -1.0, -7.5),
])  # fmt: skip
def test_an_apparent_wind_to_port_towards_and_of_a_turned_vane(
    tmp_path: Path, extra: str, factor: float, added: float
) -> None:
    """However the direction is logged, apparent and true wind are those of the ship."""
    true = truth()
    said = {**plain(true), "AWS": true["U_A"].tolist(), "SOG": np.hypot(true["u"], true["v_m"]).tolist(),
            "COG": np.degrees(true["psi"] + np.arctan2(true["v_m"], true["u"])).tolist(),
            "AWA": ((factor * np.degrees(true["gamma_A"]) + added) % 360.0).tolist()}  # fmt: skip
    path = table(tmp_path / "turn.csv", said)
    wind = '[ground]\nspeed = "SOG"\ncourse = "COG"\n[apparent]\nspeed = "AWS"\ndirection = "AWA"\n'
    [found] = trials(path, TIME + HEADING + wind + extra)
    same(found, true, "U_A gamma_A U_T gamma_T", 1e-6)
    assert np.abs(found["gamma_A"]).max() <= math.pi + 1e-9
    [wrong] = trials(path, TIME + HEADING + wind)
    assert np.ptp(wrong["U_T"]) > 0.1


def test_units_beside_the_numbers(tmp_path: Path) -> None:
    """Degrees as a sign or a word, with a blank or none, decimal commas; gaps stay gaps."""
    path = tmp_path / "a.csv"
    path.write_text("Time;HDG;RUD\n0 s;1,5°;3 Deg\n1 s;--;\n2 s;2,5 deg;-5,0 deg\n")
    [found] = trials(path, f'delimiter = ";"\ndecimal = ","\nmissing = ["--"]\n{TIME}{HEADING}{RUDDER}')
    assert found.t.tolist() == [0.0, 1.0, 2.0]
    assert np.degrees(found["psi"]) == pytest.approx([1.5, math.nan, 2.5], nan_ok=True)
    assert np.degrees(found["delta"]) == pytest.approx([3.0, math.nan, -5.0], nan_ok=True)


def test_a_table_without_a_header(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("logger 7\n0,1,x,2\n1,2,y,3\n")
    named = 'skip = 1\ncolumns = ["Time", "HDG", "", "RUD"]\n'
    [found] = trials(path, named + TIME + HEADING + RUDDER)
    assert np.degrees(found["psi"]) == pytest.approx([1.0, 2.0])
    assert np.degrees(found["delta"]) == pytest.approx([2.0, 3.0])
    book = tmp_path / "b.xlsx"
    write_workbook(book, [["logger 7"], ["0", "1", "x", "2"], ["1", "2", "y", "3"]])
    [again] = trials(book, named + TIME + HEADING + RUDDER)
    assert again["delta"] == pytest.approx(found["delta"])


def test_a_speed_through_the_water_is_the_surge_where_there_is_no_other(tmp_path: Path) -> None:
    true = truth()
    said = {**plain(true), "STW": [2.0] * len(true), "CTW": (np.degrees(true["psi"]) + 30.0).tolist()}
    said |= {"SOG": [3.0] * len(true), "COG": np.degrees(true["psi"]).tolist()}
    path = table(tmp_path / "turn.csv", said)
    log = '[log]\nspeed = "STW"\ncourse = "CTW"\n'
    [found] = trials(path, TIME + HEADING + log)
    assert found["u"] == pytest.approx(2.0 * math.cos(math.pi / 6))
    assert found["v_m"] == pytest.approx(1.0)
    [found] = trials(path, TIME + HEADING + log + '[ground]\nspeed = "SOG"\ncourse = "COG"\n')
    assert found["u"] == pytest.approx(3.0)
    assert found["u_w"] == pytest.approx(2.0 * math.cos(math.pi / 6))


@pytest.mark.parametrize("frame", ["ned", "enu"])
def test_the_heading_of_a_quaternion(tmp_path: Path, frame: str) -> None:
    true = truth()
    half = 0.5 * (true["psi"] if frame == "ned" else 0.5 * math.pi - true["psi"])
    said = {"Time": true.t.tolist(), "qx": [0.0] * len(true), "qy": [0.0] * len(true), "qz": np.sin(half).tolist(),
            "qw": np.cos(half).tolist()}  # fmt: skip
    path = table(tmp_path / "turn.csv", said)
    [found] = trials(
        path, TIME + f'[heading]\nquaternion = ["qx", "qy", "qz", "qw"]\nframe = "{frame}"\noffset = 2.0\n'
    )
    assert np.degrees(np.angle(np.exp(1j * (found["psi"] - true["psi"])))) == pytest.approx(2.0)


def test_a_lag_is_taken_off(tmp_path: Path) -> None:
    true = truth()
    late = np.degrees(np.interp(true.t - 0.75, true.t, true["psi"]))
    path = table(tmp_path / "turn.csv", {**plain(true), "HDG": (late % 360.0).tolist()})
    [found] = trials(path, TIME + HEADING + "lag = 0.75\n")
    inner = slice(4, -4)
    assert np.angle(np.exp(1j * (found["psi"] - true["psi"])))[inner] == pytest.approx(0.0, abs=1e-9)
    assert np.isnan(found["psi"][-1]), "nothing was logged yet"


@pytest.mark.parametrize(("which", "value"), [("first", 350.0), ("last", 10.0), ("mean", 0.0)])
def test_rows_of_one_time(tmp_path: Path, which: str, value: float) -> None:
    """The mean of two headings goes over north."""
    path = table(tmp_path / "a.csv", {"Time": [0, 1, 1, 2], "HDG": [350, 350, 10, 10]})
    [found] = trials(path, f'duplicates = "{which}"\n{TIME}{HEADING}')
    assert found.t.tolist() == [0.0, 1.0, 2.0]
    assert np.degrees(found["psi"][1]) % 360.0 == pytest.approx(value, abs=1e-9)


def test_rows_out_of_order_are_sorted_and_repeated_ones_left_out(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", {"Time": [2, 0, 1, 0, 2], "HDG": [30, 10, 20, 10, ""], "RUD": [3, 1, 2, 1, 3]})
    time = TIME.replace('"s" }', '"s", sort = true }')
    with pytest.raises(DataError, match=r"a\.csv: column 'Time', line 6: time repeats \(2 then 2\)"):
        trials(path, time + HEADING + RUDDER)
    [found] = trials(path, 'duplicates = "first"\n' + time + HEADING + RUDDER)
    assert found.t.tolist() == [0.0, 1.0, 2.0]
    assert np.degrees(found["psi"]) == pytest.approx([10, 20, 30])
    assert "sorted by time, 1 rows that repeat others left out" in found.meta["processing"]


def test_a_log_is_cut_by_a_list_a_column_or_gaps(tmp_path: Path) -> None:
    run, t = [1, 1, 1, "", 2, 2, 2], [0, 1, 2, 3, 40, 41, 42]
    clock = [at(float(one)) for one in t]
    path = table(tmp_path / "day.csv", {"Time": t, "UTC": clock, "HDG": [10] * 7, "RUN": run})
    cuts = '[[trial]]\nname = "zz 10"\nfrom = {}\nto = {}\nkind = "zigzag"\nset_points = {{ "heading [deg]" = 10 }}\n'
    iso = 'time = { column = "UTC", format = "iso", zone = "Europe/Oslo" }\n'
    times = [
        (TIME, "40", "42"),
        (iso, '"11:51:50"', '"11:51:52"'),
        (iso, '"2025-04-11T09:51:50Z"', '"2025-04-11 11:51:52"'),
    ]
    for time, start, stop in times:
        [found] = trials(path, time + HEADING + cuts.format(start, stop))
        assert (found.name, found.t.tolist()) == ("zz 10", [40.0, 41.0, 42.0])
        assert (found.meta["kind"], found.meta["set_points"]) == ("zigzag", {"heading [deg]": 10})
    for split in ('column = "RUN"', "gap = 30.0"):
        found = trials(path, f"{TIME}{HEADING}[split]\n{split}\n")
        assert [one.name for one in found] == ["day_1", "day_2"]
        assert found[1].t.tolist() == [40.0, 41.0, 42.0]


def test_runs_of_a_column_may_each_begin_at_zero(tmp_path: Path) -> None:
    path = table(
        tmp_path / "day.csv", {"Time": [0, 1, 2, 0, 1], "HDG": [10] * 5, "RUN": ["zz/10", "zz/10", "zz/10", 2.0, 2.0]}
    )
    found = trials(path, f'{TIME}{HEADING}[split]\ncolumn = "RUN"\n')
    assert [(one.name, one.t.tolist()) for one in found] == [("day_zz_10", [0.0, 1.0, 2.0]), ("day_2", [0.0, 1.0])]


def test_an_import_writes_each_cut_and_keeps_what_a_person_added(tmp_path: Path) -> None:
    path = table(tmp_path / "logs" / "day.csv", {"Time": range(20), "HDG": range(20)})
    cuts = '[[trial]]\nname = "a"\nfrom = 0\nto = 9\nkind = "zigzag"\n[[trial]]\nname = "b"\nfrom = 10\nto = 19\n'
    (tmp_path / "m.toml").write_text(SCHEMA + TIME + HEADING + cuts)
    again = ("csv", path.parent, tmp_path / "out", tmp_path / "m.toml")
    assert [one.name for one in import_log(*again)] == ["a.csv", "b.csv"]
    with (tmp_path / "out" / "b.yaml").open("a") as sidecar:
        sidecar.write("notes: the tide had turned\n")
    import_log(*again)
    assert "the tide had turned" in (tmp_path / "out" / "b.yaml").read_text()


@pytest.mark.slow
def test_empty_rows_among_those_of_a_sheet_are_none(tmp_path: Path) -> None:
    true = truth()
    said = plain(true)
    rows = [list(said), *([repr(v) for v in row] for row in zip(*said.values(), strict=True))]
    for place in (5, 5, 20):
        rows.insert(place, [""] * 3)
    book = write_workbook(tmp_path / "turn.xlsx", rows)
    [found] = trials(book, f'skip = 0\nsheet = "Sheet1"\n{TIME}{HEADING}{RUDDER}')
    assert len(found) == len(true)
    same(found, true, "psi delta")
