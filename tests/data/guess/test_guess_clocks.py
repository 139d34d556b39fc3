"""Clocks in days, in digits without marks and with AM or PM, and positions in every unit: guessed and read alike."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from turning_log import fixes, table, trials, truth

from seatrial.data import DataError, Trial
from seatrial.data.guess import guess
from seatrial.data.guess.cells import columns_of
from seatrial.data.guess.clock import clocks
from seatrial.data.guess.layout import read_text
from seatrial.data.mapping.clocks.patterns import _numbers_of

SCHEMA = 'schema = "seatrial-mapping/1"\n'
BEGUN = datetime(2026, 5, 1, 11, 58, 20, tzinfo=UTC)
"""Over noon, where AM becomes PM, and over minutes and an hour, where digits leap."""

SECONDS = np.arange(0.0, 200.0, 1.0)


def written(form: str) -> dict[str, list[str]]:
    """The columns of a clock of two hundred seconds, in one form."""
    when = [BEGUN + timedelta(seconds=s) for s in SECONDS]
    days = [(one - datetime(1970, 1, 1, tzinfo=UTC)).total_seconds() / 86400.0 for one in when]
    if form in ("excel", "datenum", "julian", "mjd"):
        zero = {"excel": 25569.0, "datenum": 719529.0, "julian": 2440587.5, "mjd": 40587.0}[form]
        return {"UTC": [f"{one + zero:.9f}" for one in days]}
    if form == "parts":
        names = {"UTC year": "%Y", "Month": "%m", "Day": "%d", "Hours": "%H", "Min": "%M"}
        parts = {name: [str(int(one.strftime(part))) for one in when] for name, part in names.items()}
        return {**parts, "Sec": [f"{one.second}.0" for one in when]}
    if form == "yearday":
        return {"yearday": [f"{one - 20454.0:.8f}" for one in days]}
    if "|" in form:
        date, time = form.split("|")
        return {"Date": [one.strftime(date) for one in when], "UTC": [one.strftime(time) for one in when]}
    return {"UTC time": [one.strftime(form) for one in when]}


def read(path: Path, form: str) -> Trial:
    """The log of a clock in some form by the best clock that the guess finds."""
    log = table(path, {**written(form), "psi": list(np.round(0.01 * SECONDS, 4))})
    best = clocks(columns_of(read_text(log)))[0]
    keys = ", ".join(f"{key} = {value}" for key, value in best.keys.items())
    assert best.t - best.t[0] == pytest.approx(SECONDS, abs=2e-3)
    return trials(log, f'time = {{ {keys} }}\n[channels.psi]\ncolumn = "psi"\nunit = "rad"\n')[0]


@pytest.mark.parametrize("form", [
    "excel", "datenum", "julian", "mjd", "parts", "%d.%m.%Y %H.%M.%S", "%d.%m.%Y|%H.%M.%S", "%Y%m%d%H%M%S",
    "%Y%m%dT%H%M%SZ", "%Y%m%d_%H%M%S", "%Y%m%d|%H%M%S", "%d%m%y|%H%M%S",
    "%Y:%m:%d:%H:%M:%S", "%Y:%j:%H:%M:%S", "%a %b %d %H:%M:%S %Y", "%d %B %Y|%Hh%Mm%Ss", "%d %b %Y - %H.%M.%S",
    "%d%m%Y|%H%M%S", "%Y-%m-%d %H:%M:%SZ", "%d.%m.%Y %I:%M:%S %p", "%d.%m.%Y|%I:%M:%S %p",
])  # fmt: skip
def test_a_clock_with_a_date_has_its_seconds_and_its_begin(form: str, tmp_path: Path) -> None:
    found = read(tmp_path / "log.csv", form)
    assert found.t - found.t[0] == pytest.approx(SECONDS, abs=2e-3)
    begin = datetime.fromisoformat(found.meta["start"]) + timedelta(seconds=float(found.t[0]))
    assert abs((begin - BEGUN).total_seconds()) < 2e-3


@pytest.mark.parametrize("form", ["yearday", "%H%M%S", "%I:%M:%S %p", "%I:%M:%S%p", "%H.%M.%S", "%H.%M.%S.5"])
def test_a_clock_without_a_year_has_its_seconds(form: str, tmp_path: Path) -> None:
    assert np.diff(read(tmp_path / "log.csv", form).t) == pytest.approx(1.0, abs=2e-3)


def test_digits_that_are_seconds_stay_seconds(tmp_path: Path) -> None:
    for name, t in {"even": np.arange(0.0, 300.0), "hundreds": 100.0 * np.arange(50.0)}.items():
        log = table(tmp_path / f"{name}.csv", {"Time": [f"{one:.0f}" for one in t], "psi": list(np.round(t, 3))})
        assert "format" not in clocks(columns_of(read_text(log)))[0].keys


def test_the_first_of_joined_digits_may_have_lost_its_zero_and_no_other(tmp_path: Path) -> None:
    log = table(tmp_path / "log.csv", {"T": ["90059", "90100", "90101"], "psi": [0.0, 0.1, 0.2]})
    mapping = 'time = { column = "T", format = "%H%M%S" }\n[channels.psi]\ncolumn = "psi"\nunit = "rad"\n'
    assert trials(log, mapping)[0].t == pytest.approx([0.0, 1.0, 2.0])
    log.write_text("T,psi\n9059,0\n9100,0.1\n")
    with pytest.raises(DataError, match="9059"):
        trials(log, mapping)


def places(form: str) -> tuple[dict[str, list[str]], str]:
    """Columns of the positions of the turning ship in one form, and the mapping of them."""
    latitude, longitude = (np.array(one) for one in fixes(truth()))
    if form == "minutes":
        parts = {"LatDeg": latitude // 1, "LatMin": latitude % 1 * 60, "LonDeg": longitude // 1,
                 "LonMin": longitude % 1 * 60}  # fmt: skip
        return {name: [f"{one:.6f}".removesuffix(".000000") for one in values] for name, values in parts.items()}, (
            '[position]\nlatitude = "LatDeg"\nlongitude = "LonDeg"\nlatitude_minutes = "LatMin"\n'
            'longitude_minutes = "LonMin"\n')  # fmt: skip
    heads = ("Latitude [rad]", "Longitude [rad]") if form == "rad" else ("Lat", "Lng")
    size, digits = (np.pi / 180.0, 11) if form == "rad" else (1e7, 0)
    return {name: [f"{one * size:.{digits}f}" for one in values]
            for name, values in zip(heads, (latitude, longitude), strict=True)}, (
        f'[position]\nlatitude = "{heads[0]}"\nlongitude = "{heads[1]}"\nformat = "{form}"\n')  # fmt: skip


@pytest.mark.parametrize("form", ["rad", "1e-7 deg", "minutes"])
def test_positions_in_every_unit_are_the_track(form: str, tmp_path: Path) -> None:
    true, (columns, mapping) = truth(), places(form)
    log = table(tmp_path / "log.csv", {"t": true.t.tolist(), **columns})
    found = trials(log, 'time = { column = "t", unit = "s" }\n' + mapping)[0]
    assert np.hypot(found["x"] - true["x"], found["y"] - true["y"]).max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("form", ["rad", "1e-7 deg", "minutes"])
def test_the_guess_finds_the_unit_of_a_position(form: str, tmp_path: Path) -> None:
    true, (columns, mapping) = truth(), places(form)
    log = table(tmp_path / "log.csv", {
        "t": true.t.tolist(), **columns, "heading": np.degrees(true["psi"]).tolist(),
        "u [m/s]": true["u"].tolist(), "v [m/s]": true["v_m"].tolist(),
    })  # fmt: skip
    text = guess(log).text
    assert all(line in text for line in mapping.splitlines())


def test_a_header_in_radians_is_not_overridden_and_minutes_end_at_sixty(tmp_path: Path) -> None:
    columns, mapping = places("rad")
    log = table(tmp_path / "log.csv", {"t": truth().t.tolist(), **columns})
    with pytest.raises(DataError, match="in rad, and the mapping says deg"):
        trials(log, 'time = { column = "t", unit = "s" }\n' + mapping.replace('"rad"\n', '"deg"\n'))
    log.write_text("t,LatDeg,LatMin,LonDeg,LonMin\n0,63,20,10,59\n1,63,21,10,60\n")
    with pytest.raises(DataError, match="column 'LonMin', line 3: 60 are no minutes"):
        trials(log, 'time = { column = "t", unit = "s" }\n' + places("minutes")[1])


def test_whole_numbers_in_the_place_of_degrees_are_named(tmp_path: Path) -> None:
    columns, mapping = places("1e-7 deg")
    log = table(tmp_path / "log.csv", {"t": truth().t.tolist(), **columns})
    with pytest.raises(DataError, match="in whole numbers: format = \"1e-7 deg\""):
        trials(log, 'time = { column = "t", unit = "s" }\n' + mapping.replace('"1e-7 deg"', '"deg"'))


def test_minutes_of_the_southern_hemisphere_go_south(tmp_path: Path) -> None:
    log = table(tmp_path / "log.csv", {"t": [0, 1], "LatDeg": [-33, -33], "LatMin": [10.0, 10.5],
                                       "LonDeg": [-70, -70], "LonMin": [5.0, 5.0]})  # fmt: skip
    found = trials(log, 'time = { column = "t", unit = "s" }\n' + places("minutes")[1])[0]
    assert found["x"][1] == pytest.approx(-0.5 / 60.0 * 110_900.0, rel=2e-3)
    assert found.meta["datum"]["latitude"] == pytest.approx(-33.0 - 10.0 / 60.0)


def test_dates_with_dots_are_no_times_with_dots(tmp_path: Path) -> None:
    days = ["13.05.20"] * 100 + ["14.05.20"] * 100
    times = [f"{k // 60 % 24:02d}:{k % 60:02d}:00" for k in range(200)]
    log = table(tmp_path / "log.csv", {"Dato": days, "Kl": times, "psi": list(0.01 * SECONDS)})
    assert [one.kind for one in columns_of(read_text(log))][:2] == ["date", "clock"]


def test_a_time_in_parts_that_are_beyond_their_bounds_is_none(tmp_path: Path) -> None:
    cells = {**written("parts"), "psi": list(0.01 * SECONDS)}
    log = table(tmp_path / "log.csv", {**cells, "Month": ["13"] * 200})
    assert not any("date" in one.keys for one in clocks(columns_of(read_text(log))))


@pytest.mark.parametrize(("written", "month"), [
    ("janv.", 1), ("févr.", 2), ("März", 3), ("avril", 4), ("maj", 5), ("juin", 6), ("juil.", 7), ("août", 8),
    ("sept.", 9), ("okt", 10), ("ottobre", 10), ("Nov", 11), ("Dezember", 12), ("gennaio", 1), ("giugno", 6),
    ("luglio", 7), ("ene", 1), ("mars", 3), ("jul", 7), ("xyz", 0),
])  # fmt: skip
def test_months_by_their_names_in_other_languages(written: str, month: int) -> None:
    assert _numbers_of(pl.Series([written])).tolist() == [month]


def test_a_longitude_that_is_counted_all_the_way_round(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    latitude, longitude = fixes(true)
    mapping = """time = { column = "t", unit = "s" }
[position]
latitude = "a"
longitude = "o"
"""
    log = table(tmp_path / "log.csv", {"t": list(true.t), "a": latitude, "o": [one + 226.0 for one in longitude]})
    (trial,) = trials(log, mapping)
    assert trial["y"] == pytest.approx(true["y"], abs=1e-3)
    assert trial.meta["datum"]["longitude"] == pytest.approx(longitude[0] + 226.0 - 360.0)
    silent = table(tmp_path / "log.csv", {"t": list(true.t), "a": latitude, "o": [181.0] * len(true)})
    with pytest.raises(DataError, match=r"181 is no longitude"):
        trials(silent, mapping)
    apart = [longitude[k] if k % 2 else "" for k in range(len(true))]
    rest = ["" if one else a for a, one in zip(latitude, apart, strict=True)]
    shared = table(tmp_path / "log.csv", {"t": list(true.t), "a": rest, "o": apart})
    with pytest.raises(DataError, match=r"no row has a latitude and a longitude"):
        trials(shared, mapping)


def test_times_with_dots_go_on_over_midnight(tmp_path: Path) -> None:
    times = [f"{(86340 + k) % 86400 // 3600:02d}.{(86340 + k) % 3600 // 60:02d}.{k % 60:02d}" for k in range(200)]
    log = table(tmp_path / "log.csv", {"Klo": times, "psi": list(np.round(0.01 * SECONDS, 4))})
    assert np.diff(clocks(columns_of(read_text(log)))[0].t) == pytest.approx(1.0)
