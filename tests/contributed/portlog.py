"""Logs of a harbour's pilot plug: text with semicolons, `*.plg`, the first line `PORTLOG 2`.

Each row is time of day, latitude and longitude [deg], heading [deg], speed over ground [kn], rudder [deg, positive to
port] and shaft [rpm]; `--` is no reading.  Rows after midnight go on.
"""

import math
from datetime import datetime
from pathlib import Path

import numpy as np

from .. import DataError, Trial, unwrapped
from ..geodesy import Datum
from ..sidecar import CONVENTIONS
from ..table import check_time, lines_of

name = "portlog"
suffixes = (".plg",)

_HEAD = "PORTLOG 2"
_COLUMNS = ("latitude", "longitude", "heading", "speed", "rudder", "shaft")
_RANGES = ((-90.0, 90.0), (-180.0, 180.0), (0.0, 360.0), (0.0, 60.0), (-90.0, 90.0), (-2000.0, 2000.0))
_KNOT, _DAY = 1852.0 / 3600.0, 86400.0


def read(source: Path, mapping: None = None) -> Trial:
    """Read a log; positions are metres north and east of the first one."""
    lines = lines_of(source)
    if lines[0].strip() != _HEAD:
        raise DataError(f"{source}: line 1: is '{lines[0]:.20}', not '{_HEAD}'")
    rows = [_row(source, k, line) for k, line in enumerate(lines[1:], 2) if line.strip()]
    if len(rows) < 2:
        raise DataError(f"{source}: {len(rows)} rows after the first line; a log has two at least")
    table = np.array(rows)
    t = table[:, 0] + _DAY * np.concatenate([[0.0], np.cumsum(np.diff(table[:, 0]) < -0.5 * _DAY)])
    check_time(source, "time", t, range(2, len(rows) + 2))
    latitude, longitude, heading, speed, rudder, shaft = table[:, 1:].T
    known = np.flatnonzero(np.isfinite(latitude + longitude))
    if not known.size:
        raise DataError(f"{source}: no row has a position")
    x, y = Datum(float(latitude[known[0]]), float(longitude[known[0]])).track(latitude, longitude)
    channels = {
        "x": x, "y": y, "psi": unwrapped(np.radians(heading)), "U_G": _KNOT * speed, "delta": -np.radians(rudder),
        "n_P": shaft / 60.0,
    }  # fmt: skip
    steps = ["knots, degrees and rpm to SI; rudder positive to starboard"]
    return Trial(source.stem, t - t[0], channels, {}, {**CONVENTIONS, "processing": steps})


def _row(source: Path, k: int, line: str) -> list[float]:
    """Seconds of the day and the six values of a line."""
    clock, *cells = (cell.strip() for cell in line.split(";"))
    if len(cells) != len(_COLUMNS):
        raise DataError(f"{source}: line {k}: {len(cells) + 1} fields, not {len(_COLUMNS) + 1}")
    try:
        at = datetime.strptime(clock, "%H:%M:%S.%f" if "." in clock else "%H:%M:%S")
    except ValueError:
        raise DataError(f"{source}: line {k}: time is '{clock:.20}', not HH:MM:SS.s") from None
    seconds = 3600.0 * at.hour + 60.0 * at.minute + at.second + 1e-6 * at.microsecond
    return [seconds, *(_value(source, k, *given) for given in zip(_COLUMNS, _RANGES, cells, strict=True))]


def _value(source: Path, k: int, column: str, span: tuple[float, float], cell: str) -> float:
    """One value; NaN where the log has none."""
    if cell == "--":
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        raise DataError(f"{source}: line {k}: {column} is '{cell:.20}', no number") from None
    if not span[0] <= value <= span[1]:
        raise DataError(f"{source}: line {k}: {column} is {cell}, outside {span[0]:g} to {span[1]:g}")
    return value


EXAMPLE = f"""{_HEAD}
23:59:58.0;35.00000;139.70000;359.0;8.0;0.0;120
23:59:59.0;35.00004;139.70000;359.5;8.0;-5.0;120
00:00:00.0;35.00008;139.70000;0.5;--;-10.0;120
00:00:01.0;35.00011;139.70001;2.0;7.9;-10.0;119
00:00:02.0;--;--;4.0;7.9;-10.0;119
00:00:03.0;35.00019;139.70002;6.0;7.8;-10.0;119
"""
