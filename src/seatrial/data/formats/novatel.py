"""ASCII logs of NovAtel, and of receivers that write as these do: INSPVA, INSPVAX, BESTPOS, BESTVEL and HEADING2.

A line is ``#NAMEA,header;fields*crc``, or ``%NAMESA,week,seconds;fields*crc``.  Its time is that of GPS, at which the
values hold; a velocity is older by its latency.  Roll is positive to starboard down, pitch with the bow up, azimuth
clockwise from north.  Without a solution a line tells nothing.  HEADING2 is the direction from one antenna to another.
"""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType

import numpy as np

from .. import Trial
from ..instruments import Heard, each_line, trial_by
from ..mapping.clocks.calendar import leap_seconds
from .nmea import Aboard, read_mapping

__all__ = ["EXAMPLE", "name", "read", "read_mapping", "suffixes"]

name = "novatel"
suffixes = (".gps", ".ascii")
EXAMPLE = """%INSPVASA,2446,388818.000;2446,388818.000,35.1,139.7,3,1,0.1,0,0.5,-0.3,40.0,INS_SOLUTION_GOOD*b223396c
%INSPVASA,2446,388818.500;2446,388818.500,35.100005,139.7,3,1,0.2,0,0.5,-0.3,40.5,INS_SOLUTION_GOOD*92449fd0
%INSPVASA,2446,388819.000;2446,388819.000,35.10001,139.7,3,1,0.3,0,0.5,-0.3,41.0,INS_SOLUTION_GOOD*0eca89ec
"""
_LINE = re.compile(r"(?:#([A-Z0-9]+)A|%([A-Z0-9]+)SA),([^;*]*);([^*]*)(?:\*([0-9A-Fa-f]{8}))?\s*")
_RAD = math.pi / 180.0
_GPS_ZERO, _WEEK = 315964800, 604800
"""6 January 1980 after 1970, and a week [s]."""
_SOLVED = frozenset(("SOL_COMPUTED", "INS_SOLUTION_GOOD", "INS_SOLUTION_FREE", "INS_ALIGNMENT_COMPLETE"))
Said = Mapping[str, float]


def _inertial(fields: Sequence[str]) -> Said:
    """From latitude on: height, velocities north, east and up, roll, pitch, azimuth."""
    latitude, longitude, _, north, east, _, roll, pitch, azimuth = map(float, fields)
    return {"latitude": latitude, "longitude": longitude, **_over_ground(math.hypot(north, east),
            math.atan2(east, north)), "phi": _RAD * roll, "theta": _RAD * pitch, "psi": _RAD * azimuth}  # fmt: skip


def _over_ground(speed: float, course: float) -> Said:
    return {"U_G": speed, "gamma_G": course % math.tau}


_READ: Mapping[str, tuple[str, int, Callable[[Sequence[str]], Said]]] = MappingProxyType({
    "INSPVA": ("INSPVA", 11, lambda f: _inertial(f[2:11])),
    "INSPVAX": ("INSPVAX", 0, lambda f: _inertial([*f[2:5], *f[6:12]])),
    "BESTPOS": ("receiver/BESTPOS", 0, lambda f: {"latitude": float(f[2]), "longitude": float(f[3])}),
    "BESTVEL": ("receiver/BESTVEL", 0, lambda f: _over_ground(float(f[4]), _RAD * float(f[5]))),
    "HEADING2": ("receiver/GPHDT", 0, lambda f: {"psi": _RAD * float(f[3]) % math.tau}),
})  # fmt: skip
"""Source, field of the status, and readings of the fields of each kind of line; of two alike the inertial one leads."""


def checked(body: str) -> int:
    """The checksum of what stands between the first character and the star."""
    return zlib.crc32(body.encode("latin-1", "replace"), 0xFFFFFFFF) ^ 0xFFFFFFFF


def read(source: Path, mapping: Aboard | None = None) -> Trial:
    """Read one log; without a mapping by the one beside it."""
    heard, told, good = Heard(), list[tuple[int, bool, float, str, Said]](), [0, 0]

    def take(text: str) -> None:
        found = _LINE.fullmatch(text)
        if found is None:
            heard.refuse(f"{text[:40]!r} is no line of #NAME,header;fields*checksum")
        elif (kind := found[1] or found[2]) not in _READ:
            heard.leave(kind)
        else:
            sound = found[5] is None or int(found[5], 16) == checked(text[1 : found.start(5) - 1])
            good[0 if sound else 1] += 1
            one = _message(kind, found[3].split(","), found[4].split(","))
            if isinstance(one, tuple):
                told.append((heard.lines, sound, *one))
            elif one:
                heard.refuse(one)
            else:
                heard.leave(f"{kind} without a solution")

    each_line(source, heard, take)
    steps = list[str]()
    if good[1] and not good[0]:
        steps.append(f"doubt: none of {good[1]} lines has the checksum that it tells; taken as they are")
    for line, sound, t, device, values in told:
        if sound or not good[0]:
            heard.add(t, device, values)
        else:
            heard.invalid += 1
            heard.first = heard.first or f"line {line}: a wrong checksum"
    return trial_by(source, heard, "ASCII lines of NovAtel", mapping, 0.0, steps)


def _message(kind: str, header: Sequence[str], fields: Sequence[str]) -> tuple[float, str, Said] | str:
    """Time since 1970 [s], source and readings of a line; why it has none, "" without a solution."""
    device, status, values = _READ[kind]
    week, seconds = header[4:6] if len(header) > 2 else header
    try:
        if fields[status].strip() not in _SOLVED or (len(header) > 2 and header[3] == "UNKNOWN"):
            return ""
        late = float(fields[2]) if kind == "BESTVEL" else 0.0
        t = _GPS_ZERO + _WEEK * int(week) + float(seconds) - late
        return t - _ahead(int(t)), device, values(fields)
    except (ValueError, IndexError):
        return f"{kind}: its fields are not those of such a line"


@cache
def _ahead(second: int) -> int:
    """Seconds by which GPS time is ahead of UTC."""
    return int(leap_seconds(np.array([second * 10**9]))[0])
