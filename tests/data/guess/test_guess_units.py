"""Guesses at units that are seldom: of headers, of sizes, of words that are none; and of clocks that begin anew."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from shapes import sailed
from turning_log import table, trials

from seatrial.data import DataError, Trial
from seatrial.data.formats import logs
from seatrial.data.guess import Guess, guess
from seatrial.data.guess.naming import parted, unit_in_name, unit_of
from seatrial.workflow.data import tried

pytestmark = pytest.mark.slow
TRUE = sailed(duration=200.0, dt=1.0)
DEGREES = np.degrees


def cells(values: Sequence[float] | np.ndarray, digits: int = 4) -> list[str]:
    return [f"{one:.{digits}f}" for one in np.asarray(values).tolist()]


def columns(**more: Sequence[object]) -> dict[str, Sequence[object]]:
    return {
        "Time [s]": cells(TRUE.t), "Lat": cells(TRUE.latitude, 8), "Lon": cells(TRUE.longitude, 8),
        "Heading": cells(DEGREES(TRUE["psi"]) % 360.0, 3), "SOG [m/s]": cells(TRUE.sog),
        "COG": cells(DEGREES(TRUE.cog), 3), "Rudder [deg]": cells(DEGREES(TRUE["delta"]), 2), **more,
    }  # fmt: skip


def without(*names: str, **more: Sequence[object]) -> dict[str, Sequence[object]]:
    return {name: some for name, some in columns(**more).items() if name not in names}


def read(path: Path, answers: dict[str, str] | None = None) -> tuple[Trial, Guess]:
    found = tried(guess(path), path)
    text = found.text
    for asked, said in (answers or {}).items():
        assert asked in text, text
        text = text.replace(asked, said)
    mapping = path.with_name("m.toml")
    mapping.write_text(text, encoding="utf-8")
    ((trial,),) = (some for _, some in logs("csv", path, mapping))
    return trial, found


def near(trial: Trial, digits: dict[str, float]) -> None:
    for name, digit in digits.items():
        off = trial[name] - np.interp(trial.t, TRUE.t, TRUE[name])
        off = np.mod(off + np.pi, 2.0 * np.pi) - np.pi if name == "psi" else off - off[0] if name in "xy" else off
        assert np.nanmax(np.abs(off)) < digit, (name, float(np.nanmax(np.abs(off))))


@pytest.mark.parametrize(("head", "turn"), [
    ("Heading [mil]", 6400.0), ("Gyro (gon)", 400.0), ("Heading [mrad]", 2000.0 * np.pi), ("Heading [cdeg]", 36_000.0),
])  # fmt: skip
def test_a_heading_in_a_seldom_unit_of_its_header(head: str, turn: float, tmp_path: Path) -> None:
    angle = cells(np.mod(TRUE["psi"], 2.0 * np.pi) / (2.0 * np.pi) * turn)
    trial, _ = read(table(tmp_path / "a.csv", without("Heading", **{head: angle})))
    near(trial, {"psi": 1e-4, "u": 1e-3, "v_m": 1e-3})


def test_whole_numbers_beyond_two_turns_are_hundredths_of_degrees(tmp_path: Path) -> None:
    """Heading and course without a unit, as autopilots keep them; both rates would fit with both a hundred times."""
    fine = {name: [f"{round(100.0 * float(one)) % 36_000}" for one in columns()[name]] for name in ("Heading", "COG")}
    trial, _ = read(table(tmp_path / "a.csv", columns(**fine)))
    near(trial, {"psi": 2e-4, "u": 2e-3, "v_m": 2e-3})


@pytest.mark.parametrize(("unit", "size"), [("ft", 0.3048), ("yd", 0.9144), ("NM", 1852.0), ("cm", 0.01)])
def test_a_track_is_in_the_unit_of_its_header_for_the_guess_too(unit: str, size: float, tmp_path: Path) -> None:
    """The speed has no unit: its own is found against the track, which has one."""
    rows = without("Lat", "Lon", "SOG [m/s]", "COG", **{
        f"North [{unit}]": cells(TRUE["x"] / size, 7), f"East [{unit}]": cells(TRUE["y"] / size, 7),
        "u": cells(TRUE["u"] / (1852 / 3600)), "v": cells(TRUE["v_m"] / (1852 / 3600)),
    })  # fmt: skip
    trial, found = read(table(tmp_path / "a.csv", rows))
    near(trial, {"x": 0.02, "y": 0.02, "u": 1e-3, "v_m": 1e-3})
    assert not [one for one in found.doubts if "no reading" in one]


@pytest.mark.parametrize(("unit", "size"), [("ft/s", 0.3048), ("mph", 0.44704), ("cm/s", 0.01)])
def test_a_speed_is_in_the_unit_of_its_header(unit: str, size: float, tmp_path: Path) -> None:
    rows = without("SOG [m/s]", **{f"SOG [{unit}]": cells(TRUE.sog / size, 5)})
    trial, _ = read(table(tmp_path / "a.csv", rows))
    near(trial, {"u": 1e-3, "v_m": 1e-3})


def test_a_word_in_the_place_of_a_unit_that_is_none_is_a_doubt(tmp_path: Path) -> None:
    head = "Heading [streck]"
    found = tried(guess(path := table(tmp_path / "a.csv", without("Heading", **{head: columns()["Heading"]}))), path)
    assert any('"streck", which is no unit that is known' in one for one in found.doubts)


@pytest.mark.parametrize("head", ["RPM %", "RPM [%]", "Shaft speed (%)"])
def test_revolutions_in_percent_are_asked_for(head: str, tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", columns(**{head: cells(80.0 + 0.01 * TRUE.t)}))
    found = tried(guess(path), path)
    assert found.asks == ("channels.n_P.unit",)
    assert any("%, which is no unit of revolutions" in one for one in found.doubts)


def test_revolutions_that_are_a_share_are_an_error_of_the_check(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", columns(RPM=cells(0.85 + 1e-4 * TRUE.t, 5)))
    found = tried(guess(path), path)
    assert any("revolutions are too few for the speed" in one for one in found.doubts)
    right = table(tmp_path / "b.csv", columns(RPM=cells(120.0 + 0.1 * TRUE.t)))
    assert not [one for one in tried(guess(right), right).doubts if "revolutions" in one]


def test_azimuths_by_their_short_name_are_no_column_that_is_left_out(tmp_path: Path) -> None:
    more = {f"{what} {side}": cells(value + 0.1 * TRUE.t) for what, value in (("Azi", 10.0), ("RPM", 120.0))
            for side in ("Port", "Stbd")}  # fmt: skip
    trial, _ = read(table(tmp_path / "a.csv", columns(**more)))
    assert np.rad2deg(trial["alpha_2"]) == pytest.approx(10.0 + 0.1 * TRUE.t)
    assert trial["n_1"] == pytest.approx((120.0 + 0.1 * TRUE.t) / 60.0)


@pytest.mark.parametrize("head", ["SecOfDay", "Time", "seconds of day"])
@pytest.mark.parametrize("begin", [86_350.0, 86_399.0])
def test_seconds_of_the_day_go_on_over_midnight(head: str, begin: float, tmp_path: Path) -> None:
    rows = {head: cells((begin + TRUE.t) % 86_400.0, 1), **without("Time [s]")}
    trial, _ = read(table(tmp_path / "a.csv", rows))
    assert trial.t == pytest.approx(TRUE.t)
    near(trial, {"psi": 1e-4, "delta": 1e-3})


def test_numbers_that_go_back_elsewhere_are_no_seconds_of_the_day(tmp_path: Path) -> None:
    rows = {"Time": cells((86_350.0 + TRUE.t) % 86_380.0, 1), **without("Time [s]")}
    assert 'format = "seconds of the day"' not in guess(table(tmp_path / "a.csv", rows)).text


OSLO = ZoneInfo("Europe/Oslo")


def _local(t: float, begin: datetime) -> str:
    return (begin + timedelta(seconds=t)).astimezone(OSLO).strftime("%Y-%m-%d %H:%M:%S.%f")


def test_the_hour_that_summer_time_repeats_is_read_in_its_order(tmp_path: Path) -> None:
    """From 02:58:20 on 25 October 2026 the clock of Oslo goes on from 03:00 with 02:00."""
    begin = datetime.fromisoformat("2026-10-25T00:58:20+00:00")
    path = table(tmp_path / "a.csv", {"Time": [_local(t, begin) for t in TRUE.t], **without("Time [s]")})
    found = guess(path)
    assert found.asks == ("time",)
    assert any("goes back by an hour, as at the end of summer time" in one for one in found.doubts)
    trial, _ = read(path, {'zone = "?"': 'zone = "Europe/Oslo"'})
    assert trial.t == pytest.approx(TRUE.t)
    assert str(trial.meta["start"]).startswith("2026-10-25T00:58:20")
    near(trial, {"psi": 1e-4, "delta": 1e-3})


def test_an_hour_that_is_there_twice_and_does_not_go_back_is_refused(tmp_path: Path) -> None:
    begin = datetime.fromisoformat("2026-10-25T00:10:00+00:00")
    path = table(tmp_path / "a.csv", {"Time": [_local(t, begin) for t in TRUE.t], "r": cells(TRUE["r"])})
    clock = 'time = { column = "Time", format = "iso", zone = "Europe/Oslo" }'
    with pytest.raises(DataError, match="twice, when its clocks are put back"):
        trials(path, clock + '\n[channels.r]\ncolumn = "r"\nunit = "rad/s"\n')


@pytest.mark.parametrize("again", [("head",), ("blank", "head"), ("blank",), ("head", "head")])
def test_a_header_that_a_logger_wrote_again_is_no_row(again: tuple[str, ...], tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", columns())
    head, *rows = path.read_text().splitlines()
    more = {"head": head, "blank": "," * head.count(",")}
    path.write_text("\n".join([head, *rows[:90], *(more[one] for one in again), *rows[90:]]) + "\n")
    trial, found = read(path)
    assert len(trial) == len(TRUE.t)
    assert "missing" not in found.text
    near(trial, {"psi": 1e-4, "u": 1e-3, "delta": 1e-3})


@pytest.mark.parametrize(("head", "name", "unit"), [
    ("RPM %", "RPM", "%"), ("speed_%", "speed", "%"), ("%", "%", ""), ("Sway (ft/s)", "Sway", "ft/s"),
    ("psi [0.01 deg]", "psi", "0.01 deg"), ("SPD(GND)", "SPD(GND)", ""), ("Rudder [port]", "Rudder [port]", ""),
    ("Compass [streck]", "Compass", "streck"),
])  # fmt: skip
def test_heads_are_parted_from_their_units(head: str, name: str, unit: str) -> None:
    assert parted(head) == (name, unit)


def test_words_of_units() -> None:
    assert [unit_of(one) for one in ("mils", "gradians", "yards", "fps", "percent", "0.01 deg")] == [
        "mil", "gon", "yd", "ft/s", "%", "cdeg",
    ]  # fmt: skip
    assert [unit_in_name(one) for one in ("SecOfDay", "second of day", "time day")] == ["", "", "d"]


@pytest.mark.parametrize(("head", "asked"), [("Rudder [%]", True), ("Rudder", False)])
def test_a_rudder_in_percent_is_no_angle(head: str, asked: bool, tmp_path: Path) -> None:
    """Percent of 25 deg: with the unit it is asked for, without one the size is a doubt."""
    share = cells(100.0 * DEGREES(TRUE["delta"]) / 25.0)
    path = table(tmp_path / "a.csv", without("Rudder [deg]", **{head: share}))
    found = tried(guess(path), path)
    assert ("channels.delta.unit" in found.asks) == asked
    assert any("is no unit of an angle" in one or "a share of hard over, in percent" in one for one in found.doubts)


def test_a_clock_of_twelve_hours_is_not_sorted(tmp_path: Path) -> None:
    begin = datetime.fromisoformat("2026-05-14T12:58:20")
    rows = {"Time": [(begin + timedelta(seconds=t)).strftime("%I:%M:%S.%f") for t in TRUE.t], **without("Time [s]")}
    path = table(tmp_path / "a.csv", rows)
    found = tried(guess(path), path)
    assert "sort = true }" not in found.text
    assert any("goes back by 12 hours" in one for one in found.doubts)
    assert any("the import refuses it" in one for one in found.doubts)
