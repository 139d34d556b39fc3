"""Reader of USV-ASW: path following of a small catamaran with two propellers and no rudder (Dalian, 2025).

Three columns of these workbooks are mislabelled, and the reader corrects them: `t` counts rows by
0.1 s while the clock steps by 0.11 s; in one of the two files the columns of compass and course over ground
are exchanged; and `x`, `y` are 1.1117 times as long as latitude and longitude (with which the speed
over ground agrees within 0.1 %), so positions are computed from the latter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ...core.parameters import unknown
from .. import Array, DataError, Trial, unwrapped
from ..check.track import track_miss
from ..geodesy import E2, SEMI_AXIS
from ..inside import workbook
from ..sidecar import CONVENTIONS
from ..table import check_time, decimal, existing

name = "usv-asw"
suffixes = (".xlsx",)
CLOCK, _CLOCK_FORMAT = "DateTime", "%Y-%m-%d %H:%M:%S.%f"
COMPASS, COURSE = "Heading", "course"
COLUMNS = MappingProxyType({
    "Latitude": "latitude", "Longitude": "longitude", COMPASS: "psi", COURSE: "gamma_G", "Speed": "U_G",
    "HeadingSet": "psi_cmd", "SpeedSet": "U_G_cmd", "Voltage": "voltage", "PWM_L": "throttle_port",
    "PWM_R": "throttle_starboard",
})  # fmt: skip
"""Column of the workbook to channel; the others belong to the controller and are left out."""

STOP, FULL = 1500.0, 500.0
"""Pulse width of a stopped motor, and the difference of full throttle from it [microseconds]."""

_DEGREES = ("psi", "gamma_G", "psi_cmd")
_UNITS = MappingProxyType({
    "psi_cmd": "rad", "U_G_cmd": "m/s", "voltage": "V", "throttle_port": "-", "throttle_starboard": "-",
})  # fmt: skip
_META = MappingProxyType({
    "ship": "usv_asw_twinhull", **CONVENTIONS, "kind": "path following",
    "held": ["throttle_port", "throttle_starboard"],
    "source": "github.com/2345vor/USV-ASW-NMPC, datas/*.xlsx, 2025-07-24", "licence": "MIT",
})  # fmt: skip
_STEPS = (
    f"time from {CLOCK}; the column t is nominal",
    "x, y north and east of the first fix, by latitude and longitude (WGS 84); the columns x, y are 1.11 times as long",
    f"throttle = (pulse width - {STOP:g})/{FULL:g}",
    "degrees to radians, psi and gamma_G made continuous",
    "x, y are those of the antenna, whose position is unknown; midship is taken to be there",
)
# A column follows the track if its course error is smaller than the other's by this factor.
_CLEARLY = 0.7


def read(source: Path, mapping: None = None) -> Trial:
    """Read one workbook of the set; rows that repeat a fix stay as logged."""
    here = existing(source)
    rows = _sheet(here)
    table = {name: _numbers(here, column, rows[column]) for column, name in COLUMNS.items()}
    t = _clock(here, rows[CLOCK])
    for name in _DEGREES:
        table[name] = unwrapped(np.radians(table[name]))
    for name in ("throttle_port", "throttle_starboard"):
        table[name] = (table[name] - STOP) / FULL
    table["x"], table["y"] = north_east(table.pop("latitude"), table.pop("longitude"))
    trial = Trial(here.stem, t, table, _UNITS, {**_META, "processing": list(_STEPS)})
    return _unswapped(trial)


def north_east(latitude: Array, longitude: Array) -> tuple[Array, Array]:
    """Metres north and east of the first fix, from degrees, on the plane that touches WGS 84 there.

    Within a kilometre of the first fix it is right to 1 mm + 0.1 m per kilometre squared.
    """
    good = np.flatnonzero(np.isfinite(latitude + longitude))
    if not good.size:
        return latitude, longitude
    first = good[0]
    phi = math.radians(latitude[first])
    w = 1.0 - E2 * math.sin(phi) ** 2
    along_meridian, across = SEMI_AXIS * (1.0 - E2) / w**1.5, SEMI_AXIS / math.sqrt(w)
    north = along_meridian * np.radians(latitude - latitude[first])
    return north, across * math.cos(phi) * np.radians(longitude - longitude[first])


def _unswapped(trial: Trial) -> Trial:
    """The trial with compass and course assigned by the track, whatever the names of their columns."""
    compass, course = (track_miss(trial, name) for name in ("psi", "gamma_G"))
    if not compass < _CLEARLY * course:
        return trial
    right = trial.having(psi=trial["gamma_G"], gamma_G=trial["psi"])
    return right.noting(
        f"columns {COMPASS} and {COURSE} exchanged: '{COMPASS}' follows the track within "
        f"{np.degrees(compass):.1f} deg, '{COURSE}' within {np.degrees(course):.1f} deg"
    )


def _sheet(path: Path) -> Mapping[str, list[Any]]:
    """Columns of the first sheet as text, by their names."""
    import polars

    with workbook(path):
        frame = polars.read_excel(path, engine="calamine", infer_schema_length=0, raise_if_empty=False)
    for column in (CLOCK, *COLUMNS):
        if column not in frame.columns:
            raise DataError(f"{path}: row 1: {unknown(column, frame.columns, 'column')}")
        again = next((name for name in (f"{column}_1", f"{column}_duplicated_0") if name in frame.columns), None)
        if again is not None:
            raise DataError(f"{path}: column '{column}', row 1: more columns of this name; keep one")
    if frame.height < 2:
        raise DataError(f"{path}: {frame.height} rows below the header; a recording has two at least")
    return {column: frame[column].cast(polars.String).to_list() for column in (CLOCK, *COLUMNS)}


def _numbers(path: Path, column: str, cells: list[Any]) -> Array:
    """Floats of a column; an empty cell is a gap."""
    out = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        text = "" if cell is None else str(cell).strip()
        try:
            out[k] = decimal(text) if text else np.nan
        except ValueError:
            raise DataError(f"{path}: column '{column}', row {k + 2}: '{text}' is no number") from None
        if np.isinf(out[k]):
            raise DataError(f"{path}: column '{column}', row {k + 2}: '{text}' is not finite; leave the cell empty")
    return out


def _clock(path: Path, cells: list[Any]) -> Array:
    """Seconds since the first row."""
    out = np.empty(len(cells))
    first: datetime | None = None
    for k, cell in enumerate(cells):
        try:
            at = datetime.strptime(str(cell), _CLOCK_FORMAT)
        except ValueError:
            raise DataError(
                f"{path}: column '{CLOCK}', row {k + 2}: '{cell}' is no time such as 2025-07-24 15:45:54.179"
            ) from None
        first = first or at
        out[k] = (at - first).total_seconds()
    check_time(path, CLOCK, out, list(range(2, out.size + 2)))
    return out
