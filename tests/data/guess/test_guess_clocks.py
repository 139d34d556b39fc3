"""Clocks in days, in digits without marks and with AM or PM, and positions in every unit: guessed and read alike."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from turning_log import fixes, table, trials, truth

from seatrial.data import DataError, Trial
from seatrial.data.guess import guess
from seatrial.data.guess.cells import columns_of
from seatrial.data.guess.clock import clocks
from seatrial.data.guess.layout import read_text

SCHEMA = 'schema = "seatrial-mapping/1"\n'
BEGUN = datetime(2026, 5, 1, 11, 58, 20, tzinfo=UTC)
"""Over noon, where AM becomes PM, and over minutes and an hour, where digits leap."""

SECONDS = np.arange(0.0, 200.0, 1.0)


def written(form: str) -> dict[str, list[str]]:
    """The columns of a clock of two hundred seconds, in one form."""
    when = [BEGUN + timedelta(seconds=s) for s in SECONDS]
    days = [(one - datetime(1970, 1, 1, tzinfo=UTC)).total_seconds() / 86400.0 for one in when]
    if form in ("excel", "datenum", "julian"):
        zero = {"excel": 25569.0, "datenum": 719529.0, "julian": 2440587.5}[form]
        return {"UTC": [f"{one + zero:.9f}" for one in days]}
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
    "excel", "datenum", "julian", "%Y%m%d%H%M%S", "%Y%m%dT%H%M%SZ", "%Y%m%d_%H%M%S", "%Y%m%d|%H%M%S", "%d%m%y|%H%M%S",
    "%d%m%Y|%H%M%S", "%Y-%m-%d %H:%M:%SZ", "%d.%m.%Y %I:%M:%S %p", "%d.%m.%Y|%I:%M:%S %p",
])  # fmt: skip
def test_a_clock_with_a_date_has_its_seconds_and_its_begin(form: str, tmp_path: Path) -> None:
    found = read(tmp_path / "log.csv", form)
    assert found.t - found.t[0] == pytest.approx(SECONDS, abs=2e-3)
    begin = datetime.fromisoformat(found.meta["start"]) + timedelta(seconds=float(found.t[0]))
    assert abs((begin - BEGUN).total_seconds()) < 2e-3


@pytest.mark.parametrize("form", ["yearday", "%H%M%S", "%I:%M:%S %p", "%I:%M:%S%p"])
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
