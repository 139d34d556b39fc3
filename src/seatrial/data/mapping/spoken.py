"""Numbers with their unit beside them, "5.2 kn": the unit is taken off the cells and stated for their column."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .. import DataError
from ..units import KNOWN
from .uses import Use

if TYPE_CHECKING:
    import polars as pl

    from .tables import Table

_CELL = r"^([-+]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][-+]?[0-9]+)?)\s*([^0-9\s.,].*|1/.*)$"
_SIDES = frozenset("NSEWPOLB")
"""Letters of a hemisphere or a side: 12.3 S is no time."""

_LOOKED = 1000
"""Cells that are looked at; a logger that writes units writes them from the start."""

_ELSEWHERE = ("position", "split")
"""Keys of columns that have no unit in their cells, or readers of their own."""


def unspoken(table: Table, wanted: Sequence[Use]) -> Table:
    """The table with the units taken off its cells of numbers.

    Raises:
        DataError: two units in one column, naming file, column and row.
    """
    import polars as pl

    frame, stated = table.frame, dict(table.stated)
    for name in dict.fromkeys(one.column for one in wanted if one.number and not one.key.startswith(_ELSEWHERE)):
        cells = frame[name]
        if cells.dtype != pl.String or not _units(cells.drop_nulls().head(_LOOKED)):
            continue
        bare = cells.str.strip_chars(' \t"')
        found = bare.str.extract(_CELL, 2)
        for said in _units(cells):
            row = int(np.flatnonzero((found == said).fill_null(False).to_numpy())[0])
            first, line = stated.setdefault(name, (_symbol(said), int(table.lines[row])))
            if KNOWN.get(first) != KNOWN[_symbol(said)]:
                about = f"in {said}, and {table.word} {line} says {first}; a column has one unit"
                raise DataError(f"{table.at(name, row)}: {about}")
        mine = found.is_in(_units(cells)).fill_null(False)
        frame = frame.with_columns(bare.str.extract(_CELL, 1).zip_with(mine, cells).alias(name))
    return replace(table, frame=frame, stated=stated)


def _units(cells: pl.Series) -> list[str]:
    """Units beside the numbers of some cells, as they are written, in the order of the cells."""
    found = cells.str.strip_chars(' \t"').str.extract(_CELL, 2).drop_nulls().unique(maintain_order=True).to_list()
    return [one for one in found if one not in _SIDES and _symbol(one) in KNOWN]


def _symbol(said: str) -> str:
    """The symbol of a unit: RPM is rpm."""
    return said if said in KNOWN else said.lower()
