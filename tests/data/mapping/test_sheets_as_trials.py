"""Workbooks whose sheets are trials: each comes in, what is no trial is told, and a guess sees them all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatrial.data import DataError
from seatrial.data.guess import guess
from seatrial.data.mapping.checked import read_mapping
from seatrial.data.mapping.reading import read
from seatrial.data.mapping.schema import Channel, Clock, Mapping
from seatrial.workflow.data import guess_mapping
from workbooks import write_sheets

HEADS = ["Time [s]", "Heading [deg]", "ROT [deg/s]", "Rudder [deg]"]
MAPPING = """schema = "seatrial-mapping/1"
time = { column = "Time [s]", unit = "s" }
skip = 1
sheet = "*"
[channels.psi]
column = "Heading [deg]"
unit = "deg"
[channels.delta]
column = "Rudder [deg]"
unit = "deg"
"""


def swing(size: float, count: int = 120) -> list[list[str]]:
    """A heading that swings by a size [deg], its rate, and the rudder that drives it."""
    t = np.arange(count, dtype=float)
    rows = zip(t, size * np.sin(t / 9.0), size / 9.0 * np.cos(t / 9.0), -size * np.sin(t / 9.0 - 0.1), strict=True)
    return [["Trial"], HEADS, *([f"{value:.4f}" for value in row] for row in rows)]


def book(folder: Path) -> Path:
    notes = [["Ship", "Blue"], ["L", "5.2"]]
    return write_sheets(folder / "log.xlsx", {"About": notes, "ZZ 10": swing(10.0), "ZZ20": swing(20.0, 90)})


def test_each_sheet_with_the_columns_is_a_trial(tmp_path: Path) -> None:
    path = book(tmp_path)
    (tmp_path / "m.toml").write_text(MAPPING)
    first, second = read(path, read_mapping(tmp_path / "m.toml"))
    assert (first.name, second.name) == ("log_ZZ_10", "log_ZZ20")
    assert (len(first), len(second)) == (120, 90)
    for trial, size in ((first, 10.0), (second, 20.0)):
        np.testing.assert_allclose(np.degrees(trial["psi"]), size * np.sin(trial.t / 9.0), atol=1e-4)
    assert any("sheets without its columns: About" in one for one in first.meta["processing"])


@pytest.mark.slow
def test_a_guess_sees_that_sheets_are_trials(tmp_path: Path) -> None:
    found = guess_mapping(book(tmp_path), tmp_path / "m.toml")
    assert 'sheet = "*"' in found.text
    assert any("2 sheets with the same columns, each a trial" in note for note in found.notes)
    trials = read(tmp_path / "log.xlsx", read_mapping(tmp_path / "m.toml"))
    assert [len(one) for one in trials] == [120, 90]


def test_sheets_of_another_kind_are_told(tmp_path: Path) -> None:
    other = [["t", "voltage", "current"], *([str(k), "12.5", str(k / 7)] for k in range(30))]
    path = write_sheets(tmp_path / "log.xlsx", {"Power": other, "Swing": swing(10.0)})
    found = guess(path)
    assert 'sheet = "Swing"' in found.text
    assert any('sheets "Power" are tables too' in one for one in found.doubts)


@pytest.mark.parametrize(("change", "said"), [
    (("Rudder [deg]", "RUD"), "no column 'RUD'"), (("skip = 1", "skip = 500"), "no sheet with a column of the mapping"),
    (('sheet = "*"', 'sheet = "*"\n[files]\npattern = "*.xlsx"'), "cannot stand beside files"),
])  # fmt: skip
def test_what_no_sheet_has_is_refused(change: tuple[str, str], said: str, tmp_path: Path) -> None:
    path = book(tmp_path)
    (tmp_path / "m.toml").write_text(MAPPING.replace(*change))
    with pytest.raises(DataError, match=said):
        read(path, read_mapping(tmp_path / "m.toml"))


def test_a_wrong_cell_is_named_with_its_sheet(tmp_path: Path) -> None:
    broken = swing(20.0)
    broken[40][1] = "1.2.3"
    path = write_sheets(tmp_path / "log.xlsx", {"ZZ10": swing(10.0), "ZZ20": broken})
    (tmp_path / "m.toml").write_text(MAPPING)
    with pytest.raises(DataError, match=r"column 'Heading \[deg\]', sheet 'ZZ20', row 41: '1.2.3' is not a number"):
        read(path, read_mapping(tmp_path / "m.toml"))


def test_a_text_has_no_sheets(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(MAPPING)
    (tmp_path / "log.csv").write_text("x\n" + ",".join(HEADS) + "\n0,1,2,3\n1,1,2,3\n")
    with pytest.raises(DataError, match="a text has no sheets"):
        read(tmp_path / "log.csv", read_mapping(tmp_path / "m.toml"))


def check(folder: Path, seed: int) -> None:
    """A workbook by chance: sheets of trials, of another kind, and empty ones; titles, a row of units, gaps."""
    hand = np.random.default_rng(seed)
    title, units, one = int(hand.integers(0, 3)), bool(hand.random() < 0.5), bool(hand.random() < 0.3)
    heads = [f"c{k}" for k in range(int(hand.integers(1, 5)))]
    above = [["a title"], *[[""]] * (title - 1)] if title else []
    sheets: dict[str, list[list[str]]] = {}
    truth: dict[str, list[list[float]]] = {}
    for k in range(1 if one else int(hand.integers(2, 5))):
        t = np.cumsum(0.1 + hand.random(int(hand.integers(5, 30))))
        cells = [[f"{value:.6f}" for value in t]]
        for _ in heads:
            digits = int(hand.integers(0, 10))
            values = hand.normal(size=t.size) * 10.0 ** hand.integers(-3, 6)
            cells.append(["" if hand.random() < 0.1 else f"{value:.{digits}f}" for value in values])
        rows = [list(row) for row in zip(*cells, strict=True)]
        sheets[f"run {k}"] = [*above, ["t", *heads], *([["s", *["-"] * len(heads)]] if units else []), *rows]
        truth[f"_run_{k}"] = [[float(cell) if cell else np.nan for cell in column] for column in cells]
    if hand.random() < 0.5:
        sheets["Notes"] = [["Ship", "Blue"], ["L", "5.2"]]
    names = [list(sheets)[k] for k in hand.permutation(len(sheets))]
    path = write_sheets(folder / "log.xlsx", {name: sheets[name] for name in names})
    how = Mapping(time=Clock("t", unit="s"), channels={f"a_{head}": Channel(head, "-") for head in heads},
                  skip=title, units_row=units, sheet="run 0" if one else "*")  # fmt: skip
    found = {trial.name.removeprefix("log") or "_run_0": trial for trial in read(path, how)}
    assert set(found) == set(truth)
    for name, (t, *columns) in truth.items():
        np.testing.assert_array_equal(found[name].t, t)
        for head, values in zip(heads, columns, strict=True):
            np.testing.assert_array_equal(found[name][f"a_{head}"], values)


@pytest.mark.slow
def test_what_is_written_comes_back_to_the_last_digit(tmp_path: Path) -> None:
    for seed in range(25):
        check(tmp_path, seed)


@pytest.mark.long
def test_what_is_written_comes_back_a_thousand_times(tmp_path: Path) -> None:
    for seed in range(25, 1025):
        check(tmp_path, seed)
