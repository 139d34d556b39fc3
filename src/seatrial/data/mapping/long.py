"""Long tables, of one value a row: which quantity it is stands in a column of names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...core.parameters import unknown
from .. import Array, DataError
from .clocks import stamps
from .clocks.stamps import NEVER
from .numbers import texts
from .schema import Long, Mapping, Position
from .tables import Table, opened
from .uses import Use, uses

if TYPE_CHECKING:
    import polars as pl

JOINT = "."
"""Joins the names of several columns, as a measurement and its field."""


def widened(path: Path, mapping: Mapping, long: Long) -> Table:
    """A long table as one with a row a time, in the order of time, and a column for each name of the mapping.

    A value that is there twice at a time makes two rows of it, on which `duplicates` decides.

    Raises:
        DataError: as `opened`; a name that the table does not have, two units of one name.
    """
    import polars as pl

    wanted = uses(mapping)
    clock = [one for one in wanted if one.key.startswith("time.")]
    names = list(dict.fromkeys(one.column for one in wanted if one not in clock))
    own = {**{f"long.name[{k}]": head for k, head in enumerate(long.name)}, "long.value": long.value}
    own |= {"long.unit": long.unit} if long.unit is not None else {}
    table = opened(path, mapping, [*clock, *(Use(key, head, None, False) for key, head in own.items())])
    said = said_names(table, long.name)
    rows = np.flatnonzero(said.is_in(names).to_numpy())
    lost = next((name for name in names if name not in set(said.unique().to_list())), None)
    if lost is not None:
        about = unknown(lost, sorted(said.unique().to_list()), "name")
        raise DataError(f"{path}: column '{JOINT.join(long.name)}': {about}")
    part, said = table.rows(rows), said[rows]
    values = np.asarray(stamps(part, mapping.time).values)
    never = np.isnan(values) if values.dtype.kind == "f" else values == NEVER
    if never.any():
        raise DataError(f"{part.at(clock[0].column, int(np.flatnonzero(never)[0]))}: no time; every row needs its time")
    place = pl.DataFrame({"row": np.unique(values, return_inverse=True)[1], "name": said, "k": np.arange(len(part))})
    place = place.with_columns(again=pl.int_range(pl.len()).over("row", "name"))
    wide = place.pivot("name", index=["row", "again"], values="k").sort("row", "again")
    first = wide.select(pl.min_horizontal(pl.exclude("row", "again"))).to_series().to_numpy()
    cells = texts(part, long.value)
    filled = {name: _taken(cells, wide[name], name in long.hold) for name in names}
    frame = part.frame[first].select([one.column for one in clock])
    frame = frame.with_columns(**_beside(filled, mapping.position, (values[first] - values.min()).astype(float)))
    stated = _stated(part, said, long, names) if long.unit is not None else {}
    return replace(part, frame=frame, lines=part.lines[first], width=len(said.unique()), stated=stated)


def _beside(filled: dict[str, pl.Series], place: Position | None, t: Array) -> dict[str, pl.Series]:
    """Columns with the longitudes on lines at the times of latitudes, where these are written at times of their own."""
    import polars as pl

    if place is None or place.format != "deg" or place.latitude == place.longitude:
        return filled
    latitude, longitude = place.latitude, place.longitude
    if (filled[latitude].is_not_null() & filled[longitude].is_not_null()).any():
        return filled
    north, east = (filled[name].cast(pl.Float64, strict=False).to_numpy() for name in (latitude, longitude))
    own, other = np.isfinite(north), np.isfinite(east)
    if other.sum() < 2 or np.ptp(east[other]) > 180.0:
        return filled
    reach = _REACH * float(np.median(np.diff(t[other])))
    near = np.clip(np.searchsorted(t[other], t[own]), 1, int(other.sum()) - 1)
    inside = (t[other][near] - t[other][near - 1] <= reach) & (t[own] >= t[other][0]) & (t[own] <= t[other][-1])
    on = np.full(len(north), None, dtype=object)
    on[np.flatnonzero(own)[inside]] = [repr(float(one)) for one in np.interp(t[own], t[other], east[other])[inside]]
    return {**filled, longitude: pl.Series(on.tolist(), dtype=pl.String)}


_REACH = 2.5
"""Steps of longitudes that a line spans."""


def said_names(table: Table, columns: Sequence[str]) -> pl.Series:
    """The name of the quantity of each row."""
    import polars as pl

    parts = [texts(table, one).fill_null("").alias(str(k)) for k, one in enumerate(columns)]
    return pl.DataFrame(parts).select(pl.concat_str(pl.all(), separator=JOINT)).to_series()


def _taken(cells: pl.Series, rows: pl.Series, held: bool) -> pl.Series:
    """The cells of some rows, null where there is none; or that of the last one before, where a value is held."""
    return cells.gather(rows.forward_fill() if held else rows)


def _stated(table: Table, said: pl.Series, long: Long, names: Sequence[str]) -> dict[str, tuple[str, int]]:
    """Units of the names, by the column of units.

    Raises:
        DataError: a name with two of them, at the row of the second.
    """
    cells = texts(table, str(long.unit)).fill_null("")
    found: dict[str, tuple[str, int]] = {}
    for name in names:
        rows = np.flatnonzero((said == name).to_numpy())
        units = cells[rows].unique(maintain_order=True).to_list()
        if len(units) > 1:
            row = int(rows[np.flatnonzero((cells[rows] == units[1]).to_numpy())[0]])
            raise DataError(
                f"{table.at(str(long.unit), row)}: {units[1]!r} for {name}, that was in {units[0]!r} before"
            )
        found[name] = units[0], int(table.lines[rows[0]])
    return found
