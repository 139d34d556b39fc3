"""Logs called PORTLOG 2: text, a magic line, then one row a line, seven cells separated by semicolons.

A row is time of the day, latitude north and longitude east [deg], heading [deg], speed [kn], rudder [deg, positive to
port] and shaft revolutions [rpm]; ``--`` is a missing value.  The time goes on across midnight.  The log does not say
which speed it is; it is taken for the speed over ground of a receiver.
"""

import re
from pathlib import Path

import numpy as np

from .. import Array, DataError, Trial, unwrapped
from ..geodesy import Datum
from ..sidecar import CONVENTIONS
from ..table import check_time, lines_of, numbers

name = "portlog"
suffixes = (".plg",)

MAGIC = "PORTLOG 2"
HEADS = ("time", "latitude", "longitude", "heading", "speed", "rudder", "shaft")
RANGES = (
    ("latitude", -90.0, 90.0, "deg"),
    ("longitude", -180.0, 180.0, "deg"),
    ("heading", 0.0, 360.0, "deg"),
    ("speed", -100.0, 100.0, "kn"),
    ("rudder", -90.0, 90.0, "deg"),
    ("shaft", -10000.0, 10000.0, "rpm"),
)
CLOCK = re.compile(r"([01]\d|2[0-3]):([0-5]\d):([0-5]\d(?:\.\d*)?)")
DAY = 86400.0
KNOT = 1852.0 / 3600.0


def read(source: Path, mapping: None = None) -> Trial:
    """Read a log; t is in seconds since the midnight before its first row."""
    lines = lines_of(source)
    if lines[0].strip() != MAGIC:
        raise DataError(f"{source}: line 1 is '{lines[0].strip()[:40]}', where such a log has '{MAGIC}'")
    plain = [_plain(source, k, line) for k, line in enumerate(lines, 1)]
    table, where = numbers(source, plain, 1, HEADS, ";")
    for column, low, high, unit in RANGES:
        _check_range(source, column, table[:, HEADS.index(column)], where, (low, high, unit))
    clock, latitude, longitude, heading, speed, rudder, shaft = table.T
    t = _across_midnight(clock)
    check_time(source, "time", t, where)
    steps = ["degrees to radians", "knots to m/s", "rpm to 1/s", "sign of the rudder changed: starboard is positive"]
    channels = {
        "psi": unwrapped(np.radians(heading)),
        "U_G": speed * KNOT,
        "delta": -np.radians(rudder),
        "n_P": shaft / 60.0,
    }
    meta: dict[str, object] = {**CONVENTIONS, "processing": steps}
    fixes = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude))
    if fixes.size:
        datum = Datum(float(latitude[fixes[0]]), float(longitude[fixes[0]]))
        x, y = datum.track(latitude, longitude)
        channels = {"x": x, "y": y, **channels}
        meta["datum"] = {"latitude": datum.latitude, "longitude": datum.longitude}
        steps.append("latitude and longitude to metres north and east of the first fix")
    return Trial(source.stem, t, channels, {}, meta)


def _plain(source: Path, k: int, line: str) -> str:
    """The line as numbers: seconds since midnight in place of the clock, nothing in place of a missing value."""
    cells = [cell.strip() for cell in line.split(";")]
    if k == 1 or cells == [""]:
        return line
    cells = ["" if cell == "--" else cell for cell in cells]
    if cells[0]:
        found = CLOCK.fullmatch(cells[0])
        if found is None:
            raise DataError(f"{source}: line {k}, time: '{cells[0][:40]}' is no time of the day such as 23:59:58.5")
        hours, minutes, seconds = found.groups()
        cells[0] = repr(3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds))
    return ";".join(cells)


def _check_range(source: Path, column: str, values: Array, where: list[int], limits: tuple[float, float, str]) -> None:
    """Refuse a value that no ship has."""
    low, high, unit = limits
    for value, k in zip(values, where, strict=True):
        if not (low <= value <= high or np.isnan(value)):
            raise DataError(f"{source}: line {k}, {column}: {value:g} {unit} is not within {low:g} to {high:g} {unit}")


def _across_midnight(clock: Array) -> Array:
    """Seconds of the day, made continuous: a step back by more than half a day is midnight."""
    t = clock.copy()
    known = np.isfinite(clock)
    t[known] += DAY * np.cumsum(np.diff(clock[known], prepend=clock[known][:1]) < -0.5 * DAY)
    return t


EXAMPLE = """PORTLOG 2
23:59:58.0;51.950000;4.100000;359.0;10.2;0.0;92.0
23:59:58.5;51.950013;4.100000;359.4;10.2;-2.5;92.0
23:59:59.0;51.950026;4.100000;359.9;--;-5.0;92.1
23:59:59.5;51.950039;4.100000;0.5;10.1;-5.0;92.0
00:00:00.0;--;--;1.2;10.1;-5.0;91.9
00:00:00.5;51.950065;4.100002;2.0;10.1;--;--
00:00:01.0;51.950078;4.100003;2.9;10.0;-5.0;91.8
"""
