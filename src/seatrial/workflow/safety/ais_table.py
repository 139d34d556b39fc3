"""A table of AIS reports (CSV) that a user brings, as it is published: names of columns as authorities write them."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from ...data import Array
from ...encounters.area import Reports
from .. import RequestError

_NAMES = {
    "time": ("t", "time", "timestamp", "basedatetime", "base_date_time", "datetime", "date_time_utc"),
    "MMSI": ("mmsi",),
    "latitude": ("lat", "latitude"),
    "longitude": ("lon", "long", "longitude"),
    "speed": ("sog", "speed"),
    "course": ("cog", "course"),
}  # fmt: skip
"""Names of each column, without case and unit, as of Danish, US and Norwegian tables."""

_FORMS = ("%Y-%m-%dT%H:%M:%S", "%Y-%m-%d %H:%M:%S", "%d/%m/%Y %H:%M:%S")
_KNOT = 1852.0 / 3600.0
_NO_SPEED, _NO_COURSE = 102.25, 360.0
"""From which on a report says that it does not know [kn, deg] (ITU-R M.1371-5)."""


def reports(path: Path) -> Reports:
    """Reports of a table: time as a number of seconds or a date, speeds in knots, angles in degrees.

    Raises:
        RequestError: no such table, a column that is not there, or a cell that is none of these.
    """
    import polars as pl

    try:
        table = pl.read_csv(path, infer_schema_length=0)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise RequestError(f"{path}: not a table: {str(error).splitlines()[0]}") from None
    said = {_plain(name): table[name].to_list() for name in table.columns}
    found: dict[str, Sequence[str | None]] = {}
    for what, names in _NAMES.items():
        one = next((said[name] for name in names if name in said), None)
        if one is None:
            raise RequestError(f"{path}: no column of the {what}; it is called {' or '.join(names)}")
        found[what] = one
    t = np.array([_time(path, k, one) for k, one in enumerate(found["time"], 2)])
    ship, latitude, longitude, speed, course = (_numbers(path, what, found[what]) for what in list(_NAMES)[1:])
    good = np.isfinite(ship) & (abs(latitude) <= 89.0) & (abs(longitude) <= 180.0)
    speed[~(speed < _NO_SPEED)], course[~(course < _NO_COURSE)] = np.nan, np.nan
    return Reports(t[good], ship[good].astype(np.int64), latitude[good], longitude[good], speed[good] * _KNOT,
                   np.radians(course[good]))  # fmt: skip


def _plain(name: str) -> str:
    return name.partition("[")[0].strip(" #").lower()


def _numbers(path: Path, what: str, cells: Sequence[str | None]) -> Array:
    found = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        if cell is not None and cell.strip():
            try:
                found[k] = float(cell)
            except ValueError:
                raise RequestError(f"{path}, line {k + 2}: {what} is '{cell[:40]}'; it is a number") from None
    return found


def _time(path: Path, line: int, cell: str | None) -> float:
    text = (cell or "").strip().removesuffix("Z")
    try:
        return float(text)
    except ValueError:
        pass
    for form in _FORMS:
        try:
            return datetime.strptime(text, form).replace(tzinfo=UTC).timestamp()
        except ValueError:
            continue
    raise RequestError(f"{path}, line {line}: time is '{text[:40]}'; it is seconds, or 2026-01-31 12:00:00")
