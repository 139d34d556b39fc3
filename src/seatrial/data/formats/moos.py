"""Logs of MOOS (.alog): time since LOGSTART, variable, application and value in each line.

NAV_LAT and NAV_LONG, or NAV_Y and NAV_X (north and east); NAV_HEADING clockwise from north; the ordered rudder is
positive to starboard, the ordered thrust in percent.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from .. import DataError, Trial
from ..instruments import Heard, each_line, trial_by
from .nmea import Aboard, read_mapping

__all__ = ["EXAMPLE", "name", "read", "read_mapping", "suffixes"]

name = "moos"
suffixes = (".alog",)
EXAMPLE = """%% LOGSTART 1795694400.0
0.0 NAV_LAT uSimMarine 35.1
0.0 NAV_LONG uSimMarine 139.7
0.0 NAV_HEADING uSimMarine 40.0
0.5 DESIRED_RUDDER pHelmIvP 5
1.0 NAV_LAT uSimMarine 35.10001
1.0 NAV_LONG uSimMarine 139.70001
1.0 NAV_HEADING uSimMarine 40.5
"""
_RAD = math.pi / 180.0
_MARK = re.compile(r"[<(]?D[>):]?\s*")
_READ: Mapping[str, tuple[str, float]] = MappingProxyType({
    "NAV_LAT": ("latitude", 1.0), "NAV_LONG": ("longitude", 1.0), "NAV_HEADING": ("psi", _RAD),
    "NAV_SPEED": ("U_G", 1.0), "NAV_X": ("y", 1.0), "NAV_Y": ("x", 1.0), "NAV_DEPTH_BELOW": ("depth", 1.0),
    "DESIRED_RUDDER": ("delta_cmd", _RAD), "DESIRED_THRUST": ("throttle_cmd", 0.01),
})  # fmt: skip


def read(source: Path, mapping: Aboard | None = None) -> Trial:
    """Read one log; without a mapping by the one beside it."""
    heard, starts, marked = Heard(), list[float](), set[str]()

    def take(text: str) -> None:
        if text.startswith("%"):
            marked.update(["MARKING ON"] if "MARKING ON" in text else [])
            if "LOGSTART" in text:
                starts.append(_number(text.split()[-1]))
            return
        cells = text.split(None, 3)
        t = _number(cells[0])
        if len(cells) < 3 or not math.isfinite(t):
            heard.refuse(f"{text[:40]!r} is not: time, variable, application, value")
        elif cells[1] not in _READ:
            heard.leave(cells[1])
        else:
            channel, factor = _READ[cells[1]]
            cells.append("")
            heard.add(t, cells[2], {channel: factor * _number(_unmarked(cells[3]) if marked else cells[3])})

    each_line(source, heard, take)
    if len(starts) > 1:
        raise DataError(f"{source}: {len(starts)} lines LOGSTART; a log has one, cut it into its recordings")
    epoch = starts[0] if starts and 0.0 < starts[0] < 1e10 else None

    def finish(series: dict[str, object]) -> Mapping[str, str]:
        if "latitude" in series:
            series.pop("x", None)
            series.pop("y", None)
        return {"delta_cmd": "rudder order"}

    return trial_by(source, heard, "MOOS variables", mapping, epoch, (), finish)  # type: ignore[arg-type]


def _unmarked(text: str) -> str:
    """A value without the letter of its type, which a logger sets before it where it is told to."""
    return _MARK.sub("", text)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
