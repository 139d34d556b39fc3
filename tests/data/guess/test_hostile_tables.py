"""Tables that would take more memory when read than they are worth: the guess looks at a part, and says so."""

from __future__ import annotations

from pathlib import Path

import pytest
from peaks import MEMORY, peak

from seatrial.data.guess import guess
from seatrial.data.guess.rows_of_names import _WIDEST


def many_names(path: Path, names: int, times: int) -> Path:
    """A long table of many names, each at times of its own, a heading and its rate among them."""
    lines = ["time,name,value"]
    for k in range(times):
        lines += [f"{k}.{j:05d},n{j},{j}" for j in range(names)]
        lines += [f"{k},heading,{(3 * k) % 360}", f"{k},yaw rate,3"]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak of memory is read from /proc")
def test_a_long_table_of_thousands_of_names_takes_little_memory(tmp_path: Path) -> None:
    path = many_names(tmp_path / "log.csv", 6000, 12)
    assert path.stat().st_size < 2e6
    status, memory, said = peak(["import", "--guess", "log.csv", "-o", "m.toml"], tmp_path)
    assert memory < MEMORY
    assert status in (0, 2), said


@pytest.mark.slow
def test_the_commonest_names_are_those_of_the_columns(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    names = ("heading", "rate", "rudder")
    lines = ["time,name,value", *(f"{k},{name},{k % 7}" for k in range(40) for name in names)]
    lines += [f"{k},extra{j},{j}" for j in range(2 * _WIDEST) for k in range(8)]
    path.write_text("\n".join(lines) + "\n")
    text = guess(path).text
    assert 'column = "heading"' in text
    assert 'column = "rudder"' in text


@pytest.mark.slow
@pytest.mark.parametrize("cell", ["(" * 5000, "N" * 5000, "1" * 5000 + "N", "POINT(" + " " * 5000, "E1N" * 900])
def test_a_cell_that_is_nearly_a_place_is_soon_none(cell: str, tmp_path: Path) -> None:
    """Each form is tried in time that grows with the cell, not with its square."""
    path = tmp_path / "log.csv"
    path.write_text("time,heading,position\n" + "".join(f"{k},{k % 360},{cell}\n" for k in range(60)))
    assert "[position]" not in guess(path).text
