"""Cells of a table as numbers and texts: missing values, decimal commas, letters beside numbers."""

from __future__ import annotations

import re
from collections.abc import Mapping as Named
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import unknown
from .. import Array, DataError
from .tables import Table

if TYPE_CHECKING:
    import polars as pl

_LETTERED = r"^([A-Za-z]*)\s*([-+]?[0-9.,]+(?:[eE][-+]?[0-9]+)?)\s*°?\s*([A-Za-z]*)$"


def numbers(table: Table, column: str) -> Array:
    """A column of numbers, shape (rows,); a missing value is NaN.

    Raises:
        DataError: a cell that is no finite number, naming file, column and row.
    """
    import polars as pl

    cells = table.frame[column]
    if cells.dtype == pl.Boolean:
        cells = cells.cast(pl.Float64)
    if cells.dtype.is_numeric():
        found = cells.cast(pl.Float64).fill_null(float("nan")).to_numpy()
    elif cells.dtype == pl.String:
        found = _parsed(table, column, texts(table, column))
    else:
        raise DataError(f"{table.path}: column '{column}': holds {cells.dtype}, not numbers")
    infinite = np.flatnonzero(np.isinf(found))
    if infinite.size:
        advice = "give a finite number, or leave the cell empty for a gap"
        raise DataError(f"{table.at(column, int(infinite[0]))}: infinite; {advice}")
    return found


def texts(table: Table, column: str) -> pl.Series:
    """A column as texts without blanks around them, null where the value is missing."""
    import polars as pl

    cells = table.frame[column]
    if cells.dtype != pl.String:
        return cells.cast(pl.String)
    bare = cells.str.strip_chars(' \t"')
    gone = bare.str.to_lowercase().is_in(sorted(table.missing))
    return bare.set(gone.fill_null(False), None)


def lettered(table: Table, column: str, letters: Named[str, float], letter: str | None) -> Array:
    """Numbers with a letter beside them, or in a column of its own, times the factor of the letter; words alone.

    Raises:
        DataError: no number, an unknown letter, or none beside a number other than zero.
    """
    if letter is not None:
        values, beside = numbers(table, column), texts(table, letter)
    else:
        cells = texts(table, column)
        # a word alone is once its factor, such as Midships = 0 and "HALF AHEAD" = 0.6
        alone = cells.str.to_lowercase().is_in([name.lower() for name in letters]).fill_null(False)
        groups = [cells.str.extract(_LETTERED, k).fill_null("") for k in (1, 2, 3)]
        groups = [cells.zip_with(alone, groups[0]), groups[1].set(alone, "1"), groups[2]]
        before, values = groups[0], _parsed(table, column, groups[1].set(groups[1] == "", None))
        _refuse_others(table, column, cells, np.isnan(values))
        beside = before + groups[2]
    known = {name.lower(): factor for name, factor in letters.items()}
    words = beside.fill_null("").str.to_lowercase()
    factors = np.ones(len(values))
    for word in words.unique().to_list():
        rows = (words == word).to_numpy() & ~np.isnan(values)
        if word in known:
            factors[rows] = known[word]
        elif (found := np.flatnonzero(rows & ((values != 0.0) if word == "" else True))).size:
            said = "no letter" if word == "" else unknown(word, letters, "letter")
            raise DataError(
                f"{table.at(letter or column, int(found[0]))}: {said}; one of {', '.join(letters)} is needed"
            )
    return values * factors


def _refuse_others(table: Table, column: str, cells: pl.Series, gone: NDArray[np.bool_]) -> None:
    wrong = np.flatnonzero(gone & cells.is_not_null().to_numpy())
    if wrong.size:
        about = f"'{cells[int(wrong[0])]:.40}' is no number with a letter beside it"
        raise DataError(f"{table.at(column, int(wrong[0]))}: {about}")


def _parsed(table: Table, column: str, cells: pl.Series) -> Array:
    """Numbers of texts, by the decimal mark of the table."""
    import polars as pl

    if table.thousands:
        mark, point = re.escape(table.thousands), re.escape(table.decimal)
        grouped = cells.str.contains(rf"^[-+]?\d{{1,3}}(?:{mark}\d{{3}})+(?:{point}\d*)?$").fill_null(False)
        cells = cells.str.replace_all(table.thousands, "", literal=True).zip_with(grouped, cells)
    plain = cells
    if table.decimal == ",":
        dotted = cells.str.contains(".", literal=True).fill_null(False).to_numpy()
        if dotted.any():
            row = int(np.flatnonzero(dotted)[0])
            raise DataError(f"{table.at(column, row)}: '{cells[row]:.40}' has a dot, and the decimal mark is a comma")
        plain = cells.str.replace(",", ".", literal=True)
    found = plain.cast(pl.Float64, strict=False)
    wrong = np.flatnonzero((found.is_null() & cells.is_not_null()).to_numpy())
    if wrong.size:
        row = int(wrong[0])
        raise DataError(f"{table.at(column, row)}: '{cells[row]:.40}' is not a number; {_advice(str(cells[row]))}")
    return found.fill_null(float("nan")).to_numpy()


def _advice(cell: str) -> str:
    """What to do with a cell that is no number."""
    if re.fullmatch(r"[-+]?\d{1,3}(?:,\d{3})+\.\d*|[-+]?\d{1,3}(?:,\d{3}){2,}", cell):
        return 'give thousands = "," in the mapping'
    if re.fullmatch(r"[-+]?\d+,\d+", cell):
        return 'give decimal = "," in the mapping, or a number with a decimal dot'
    if re.fullmatch(_LETTERED, cell):
        return "give letters in the mapping, such as letters = { P = -1, S = 1 }, or a number alone"
    if re.search(r"\d[:/-]\d", cell):
        return 'a time has a format in the mapping, such as format = "iso"'
    return ("give a number with a decimal dot, leave the cell empty for a gap, or name the word under missing in the "
            "mapping")  # fmt: skip
