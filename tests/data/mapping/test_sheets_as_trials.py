"""Workbooks whose sheets are trials: each comes in, what is no trial is told, and a guess sees them all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatrial.data import DataError
from seatrial.data.guess import guess
from seatrial.data.mapping.checked import read_mapping
from seatrial.data.mapping.reading import read
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
