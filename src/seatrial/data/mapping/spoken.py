"""Numbers with their unit beside them, "5.2 kn": the unit is taken off the cells and told."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..units import KNOWN

if TYPE_CHECKING:
    import polars as pl

_CELL = r"^([-+]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][-+]?[0-9]+)?)\s*([^0-9\s.,].*|1/.*)$"
_SIDES = frozenset("NSEWPOLB")
"""Letters of a hemisphere or a side: 12.3 S is no time."""

_LOOKED = 1000
"""Cells that are looked at; a logger that writes units writes them from the start."""


def unspoken(cells: pl.Series) -> tuple[pl.Series, dict[str, int]]:
    """Cells without the units beside their numbers, and these units with the first row of each."""
    if not _units(cells.drop_nulls().head(_LOOKED)):
        return cells, {}
    said = _units(cells)
    bare = cells.str.strip_chars(' \t"')
    found = bare.str.extract(_CELL, 2)
    rows = {one: int(np.flatnonzero((found == one).fill_null(False).to_numpy())[0]) for one in said}
    plain = bare.str.extract(_CELL, 1).zip_with(found.is_in(said).fill_null(False), cells)
    return plain.alias(cells.name), {_symbol(one): row for one, row in rows.items()}


def _units(cells: pl.Series) -> list[str]:
    """Units beside the numbers of some cells, as they are written, in the order of the cells."""
    found = cells.str.strip_chars(' \t"').str.extract(_CELL, 2).drop_nulls().unique(maintain_order=True).to_list()
    return [one for one in found if one not in _SIDES and _symbol(one) in KNOWN]


def _symbol(said: str) -> str:
    """The symbol of a unit: RPM is rpm."""
    return said if said in KNOWN else said.lower()
