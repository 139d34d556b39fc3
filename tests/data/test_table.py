"""Rows of numbers: those that hold nothing else are read at once, and no other way of writing gets by with them."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.data import DataError
from seatrial.data.table import numbers

HEADS = ("t", "x", "y")


def read(rows: list[str], delimiter: str | None = ",") -> np.ndarray:
    return numbers("a.csv", ["t,x,y", *rows], 1, HEADS, delimiter)[0]


def test_blocks_with_and_without_words_give_one_table() -> None:
    rng = np.random.default_rng(3)
    wanted = rng.normal(size=(1700, 3))
    rows = [",".join(map(repr, row)) for row in wanted.tolist()]
    np.testing.assert_array_equal(read(rows), wanted)
    np.testing.assert_array_equal(read([row.replace(",", "  ") for row in rows], None), wanted)
    rows[900], wanted[900, 1] = f"{wanted[900, 0]}, ,{wanted[900, 2]}", np.nan
    table, lines = numbers("a.csv", ["t,x,y", *rows[:4], "", *rows[4:]], 1, HEADS, ",")
    np.testing.assert_array_equal(table, wanted)
    assert lines == [2, 3, 4, 5, *range(7, 1703)]


@pytest.mark.parametrize("cells", ["1,2,3,4", "1,2"])
def test_rows_that_all_have_a_cell_too_many_or_too_few_are_refused(cells: str) -> None:
    with pytest.raises(DataError, match=rf"line 2 has {len(cells.split(','))} cells, not 3"):
        read([cells] * 6)


@pytest.mark.parametrize("cell", ["1_000", "\uff11\uff12", "0x10"])
def test_numbers_in_the_notation_of_a_programming_language_are_none(cell: str) -> None:
    with pytest.raises(DataError, match="line 3"):
        read(["1,2,3", f"1,{cell},3", "1,2,3"])


def test_all_digits_of_a_number_are_read_whatever_its_notation() -> None:
    cells = ["4.9e-324", "2.2250738585072011e-308", "0.1000000000000000055511151231257827021181583404541015625", "-0.0",
             " 1E+05\t", ".5", "1.", "nan", "9007199254740993"]  # fmt: skip
    table = read([",".join(cells[k : k + 3]) for k in range(0, 9, 3)])
    np.testing.assert_array_equal(table.ravel(), [*map(float, cells)])
    assert np.signbit(table[1, 0])


@pytest.mark.parametrize("cell", ["2#", "#", "'2'", "2 3", "1d5", "True"])
def test_what_a_reader_of_tables_may_take_for_a_number_or_a_remark_is_none(cell: str) -> None:
    for row in (f"1,{cell},3", f"1,2,{cell}"):
        with pytest.raises(DataError, match="line 3"):
            read(["1,2,3", row, "1,2,3"])


def test_what_is_infinite_is_told_by_column_and_line() -> None:
    with pytest.raises(DataError, match="column 'x', line 3: infinite"):
        read(["1,2,3", "1,inf,3"])
