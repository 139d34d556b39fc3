"""Tables as people export them: footers, newest row first, cut clocks, coarse clocks, letters before numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from shapes import Sailed, sailed
from turning_log import at, table, trials

from seatrial.data import DataError, Trial
from seatrial.data.formats import logs
from seatrial.data.guess import guess
from seatrial.data.guess.layout import read_text
from seatrial.workflow.data import tried

pytestmark = pytest.mark.slow
TRUE = sailed(duration=200.0, dt=1.0)
DEGREES = np.degrees


def columns(ship: Sailed = TRUE, **more: Sequence[object]) -> dict[str, Sequence[object]]:
    """What a bridge logs: places, heading, speed and course over ground, rudder."""
    return {
        "Time": [at(t)[:23] + "Z" for t in ship.t], "Lat": [f"{one:.8f}" for one in ship.latitude],
        "Lon": [f"{one:.8f}" for one in ship.longitude],
        "Heading": [f"{one:.3f}" for one in DEGREES(ship["psi"]) % 360.0],
        "SOG [m/s]": [f"{one:.4f}" for one in ship.sog], "COG": [f"{one:.3f}" for one in DEGREES(ship.cog)],
        "Rudder [deg]": [f"{one:.2f}" for one in DEGREES(ship["delta"])], **more,
    }  # fmt: skip


def imported(source: Path) -> Trial:
    """By the guess, which must not refuse itself."""
    found = tried(guess(source), source)
    assert not found.asks, found.text
    assert not [one for one in found.doubts if "the import refuses" in one or "no reading" in one], found.doubts
    mapping = source.with_name("guessed.toml")
    mapping.write_text(found.text, encoding="utf-8")
    ((trial,),) = (some for _, some in logs("csv", source, mapping))
    return trial


def same(trial: Trial, right: Sailed, late: float = 0.0, digits: Mapping[str, float] | None = None) -> None:
    t = trial.t + late
    for name, digit in (digits or {"psi": 1e-4, "u": 1e-3, "v_m": 1e-3, "delta": 1e-3}).items():
        got, good = trial[name], np.isfinite(trial[name])
        assert good.mean() > 0.2, name
        off = got[good] - np.interp(t[good], right.t, right[name])
        off = np.mod(off + np.pi, 2.0 * np.pi) - np.pi if name == "psi" else off
        assert np.abs(off).max() < digit, (name, np.abs(off).max())


@pytest.mark.parametrize("foot", [
    ["# end of file"], ["", "", "End of the log;;;;;;"], [";;;;;;", "Mean;;;12.3;6.1;;", "Max;;;359.0;7.5;;"],
    ["-----", "rows: 121", ""],
])  # fmt: skip
def test_lines_after_the_last_row_are_left_out(tmp_path: Path, foot: list[str]) -> None:
    path = table(tmp_path / "log.csv", columns(), ";")
    path.write_text(path.read_text() + "\n".join(foot))
    assert len(read_text(path).columns[0]) == TRUE.t.size
    got = imported(path)
    assert len(got) == TRUE.t.size
    same(got, TRUE)


def test_a_table_without_a_footer_has_none(tmp_path: Path) -> None:
    assert "footer" not in guess(table(tmp_path / "log.csv", columns())).text
    gaps = columns() | {"Heading": ["", *columns()["Heading"][1:-1], ""]}
    assert "footer" not in guess(table(tmp_path / "gaps.csv", gaps)).text


def test_a_footer_of_more_lines_than_there_are_is_refused(tmp_path: Path) -> None:
    source = table(tmp_path / "log.csv", {"t": [0, 1, 2], "h": [1, 2, 3]})
    mapped = '\ntime = { column = "t", unit = "s" }\n[channels.psi]\ncolumn = "h"\nunit = "deg"\n'
    (trial,) = trials(source, "footer = 1" + mapped)
    assert trial.t.tolist() == [0.0, 1.0]
    with pytest.raises(DataError, match="fewer than the 9 lines"):
        trials(source, "footer = 9" + mapped)


def test_rows_with_the_newest_first_are_put_in_order(tmp_path: Path) -> None:
    turned = {name: list(cells)[::-1] for name, cells in columns().items()}
    got = imported(table(tmp_path / "log.csv", turned))
    assert got.t[0] == 0.0
    assert got.meta["start"].startswith("2025-04-11T11:51:10")
    same(got, TRUE)


@pytest.mark.parametrize("begin", [0.0, 3000.0])
def test_minutes_and_seconds_alone_go_on_over_the_hour(tmp_path: Path, begin: float) -> None:
    true = sailed(dt=0.5, duration=700.5)
    clock = [f"{int((begin + t) // 60) % 60:02d}:{(begin + t) % 60:04.1f}" for t in true.t]
    got = imported(table(tmp_path / "log.csv", columns(true, Time=clock)))
    assert got.t[-1] == 700.0
    same(got, true)


@pytest.mark.parametrize("begin", [0.0, 0.7])
def test_rows_of_a_clock_of_whole_seconds_are_spread(tmp_path: Path, begin: float) -> None:
    """Five rows a second, the first second begun before the log."""
    true = sailed(dt=0.2, duration=100.0)
    clock = [at(float(np.floor(t + begin)))[:19] + "Z" for t in true.t]
    got = imported(table(tmp_path / "log.csv", columns(true, Time=clock)))
    assert len(got) == true.t.size
    assert np.allclose(np.diff(got.t), 0.2)
    # which fifth of its second the first row has is known to a fifth
    same(got, true, -float(got.t[0]))


@pytest.mark.parametrize("form", ["{side}{size:.2f}", "{side} {size:.2f}", "{size:.2f} {side}"])
def test_letters_of_sides_before_or_behind_the_number(tmp_path: Path, form: str) -> None:
    cells = [form.format(side="SP"[int(one < 0.0)], size=abs(one)) for one in DEGREES(TRUE["delta"])]
    same(imported(table(tmp_path / "log.csv", columns() | {"Rudder [deg]": cells})), TRUE)


def test_a_control_in_words_is_not_left_out_without_a_doubt(tmp_path: Path) -> None:
    odd = [f"<{one:.1f}>" for one in DEGREES(TRUE["delta"]) + 0.1 * TRUE.t]
    found = guess(table(tmp_path / "log.csv", columns(Helm_order=odd)))
    assert any("'Helm_order' looks like a control" in one for one in found.doubts)


@pytest.mark.parametrize(("north", "east"), [(-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
def test_degrees_minutes_and_seconds_with_blanks_alone(tmp_path: Path, north: float, east: float) -> None:
    """The S of the south is not that of seconds."""

    def blank(value: float, sides: str) -> str:
        thousandths = round(abs(value) * 3.6e6)
        letter = sides[int(value < 0.0)]
        return f"{thousandths // 3_600_000} {thousandths // 60_000 % 60} {thousandths % 60_000 / 1000:.3f} {letter}"

    # the mirrored track of a mirrored place; headings and courses are mirrored with it
    heading, course = (np.arctan2(east * np.sin(one), north * np.cos(one)) for one in (
TRUE["psi"], TRUE.cog))  # fmt: skip
    there = columns() | {
        "Lat": [blank(north * one, "NS") for one in TRUE.latitude],
        "Lon": [blank(east * one, "EW") for one in TRUE.longitude],
        "Heading": [f"{one:.3f}" for one in DEGREES(heading) % 360.0],
        "COG": [f"{one:.3f}" for one in DEGREES(course) % 360.0],
    }  # fmt: skip
    there = {name: cells for name, cells in there.items() if name != "Rudder [deg]"}
    got = imported(table(tmp_path / "log.csv", there))
    assert np.abs(got["x"] - north * TRUE["x"]).max() < 0.2
    assert np.abs(got["y"] - east * TRUE["y"]).max() < 0.2
    assert np.abs(np.exp(1j * got["psi"]) - np.exp(1j * heading)).max() < 1e-4


def test_instruments_that_take_turns_are_compared(tmp_path: Path) -> None:
    """No row holds two of them: a fix every second, heading and rudder half a second and a quarter later."""
    true = sailed(dt=0.25, duration=300.0)
    found = columns(true)
    turn = np.arange(true.t.size) % 4
    kept = {"Lat": 0, "Lon": 0, "SOG [m/s]": 0, "COG": 0, "Heading": 2, "Rudder [deg]": 1}
    cells = {name: [cell if name not in kept or turn[k] == kept[name] else "" for k, cell in enumerate(some)]
             for name, some in found.items()}  # fmt: skip
    got = imported(table(tmp_path / "log.csv", cells))
    same(got, true, digits={"psi": 1e-4, "u": 0.02, "v_m": 0.02, "delta": 1e-3})


def test_a_speed_log_alone_is_a_doubt(tmp_path: Path) -> None:
    """There is no speed over ground: u is through the water, and the trial says so."""
    true = columns()
    some = {name: true[name] for name in ("Time", "Lat", "Lon", "Heading")} | {"STW [m/s]": true["SOG [m/s]"]}
    got = imported(table(tmp_path / "log.csv", some))
    assert any(step.startswith("doubt: u through the water") for step in got.meta["processing"])
