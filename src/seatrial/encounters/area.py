"""Encounters of real ships: each pair of an area that came into risk of collision, as met by any ship.

Bearing, courses, ratio of speeds and times stay; lengths scale with the own speed, as in DNV's set.  What happened
after the risk began is not taken: everybody is where it was then, and behaves as the case says.  A table is read as
authorities publish it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from itertools import permutations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.constants import KNOT
from ..core.errors import RequestError
from ..core.values import dataclass
from ..data import Array
from ..data.geodesy import Datum
from .meeting import Meeting
from .rules.geometry import approach, wrapped

_STEP, _GAP = 30.0, 180.0
"""Time between two looks, and the longest one between two reports of a ship that is taken as known between them [s]."""
_MOVING = 1.0
"""Speed from which a ship is under way [m/s]."""
_NEAR, _SOON, _LEAST = 926.0, 1200.0, 180.0
"""Risk begins where ships would pass so near [m] within so long, and not before so little is left [s]."""


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
_NO_SPEED, _NO_COURSE = 102.25, 360.0
"""From which on a report says that it does not know [kn, deg] (ITU-R M.1371-5)."""


@dataclass(frozen=True, eq=False)
class Reports:
    """Reports of ships, in any order; shape (reports,).

    Attributes:
        t: time [s].
        ship: number of the ship, such as its MMSI.
        latitude, longitude: [deg].
        U, chi: speed [m/s] and course over ground [rad].
    """

    t: Array
    ship: NDArray[np.int64]
    latitude: Array
    longitude: Array
    U: Array
    chi: Array


def encounters(reports: Reports, U: float) -> Meeting:
    """Each ordered pair of ships that came into risk, at its first moment; one target each, shape (encounters, 1).

    Args:
        U: speed of the ship that is to meet them [m/s].

    Raises:
        RequestError: nobody came into risk.
    """
    found = [one for a, b in permutations(_tracks(reports), 2) if (one := _first(a, b)) is not None]
    if not found:
        raise RequestError(f"of {len(np.unique(reports.ship))} ships none came into risk of collision with another: "
                           f"{_NEAR:g} m within {_SOON / 60.0:g} min")  # fmt: skip
    x, y, psi, k = np.array(found).T[..., None]
    return Meeting(np.full(len(found), U), x * U, y * U, psi, k * U)


def _tracks(reports: Reports) -> Iterator[Array]:
    """Of each ship t, x, y, north, east on looks at common times; NaN where it is not known; shape (5, looks)."""
    good = np.isfinite(reports.t + reports.latitude + reports.longitude + reports.U + reports.chi)
    if not good.any():
        return
    datum = Datum(float(np.median(reports.latitude[good])), float(np.median(reports.longitude[good])))
    looks = np.arange(math.floor(reports.t[good].min() / _STEP), math.ceil(reports.t[good].max() / _STEP) + 1) * _STEP
    for ship in np.unique(reports.ship[good]):
        mine = np.flatnonzero(good & (reports.ship == ship))
        mine = mine[np.argsort(reports.t[mine], kind="stable")]
        t, first = np.unique(reports.t[mine], return_index=True)
        mine = mine[first]
        places = np.array([datum.north_east(float(a), float(b)) for a, b in zip(
            reports.latitude[mine], reports.longitude[mine], strict=True)])  # fmt: skip
        north, east = reports.U[mine] * np.cos(reports.chi[mine]), reports.U[mine] * np.sin(reports.chi[mine])
        at = np.searchsorted(t, looks, side="right")
        inside = (at > 0) & (at < len(t))
        gap = t[np.clip(at, 1, len(t) - 1)] - t[np.clip(at, 1, len(t) - 1) - 1] if len(t) > 1 else np.inf
        known = inside & (gap <= _GAP)
        values = [np.interp(looks, t, one) for one in (places[:, 0], places[:, 1], north, east)]
        yield np.stack([looks, *(np.where(known, one, np.nan) for one in values)])


def _first(own: Array, other: Array) -> tuple[float, float, float, float] | None:
    """Place over the own speed [s], course relative to the own one [rad] and ratio of speeds where risk begins."""
    place, motion = other[1:3] - own[1:3], other[3:5] - own[3:5]
    dcpa, tcpa = approach(*place, *motion)
    U, V = np.hypot(*own[3:5]), np.hypot(*other[3:5])
    risk = (dcpa < _NEAR) & (tcpa > _LEAST) & (tcpa <= _SOON) & (U > _MOVING) & (V > _MOVING)
    if not risk.any():
        return None
    k = int(risk.argmax())
    chi, course = (math.atan2(one[4, k], one[3, k]) for one in (own, other))
    c, s = math.cos(chi), math.sin(chi)
    north, east = place[:, k] / U[k]
    turned = float(wrapped(np.array(course - chi)))
    return north * c + east * s, east * c - north * s, turned, float(V[k] / U[k])


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
    return Reports(t[good], ship[good].astype(np.int64), latitude[good], longitude[good], speed[good] * KNOT,
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
