"""Telemetry logs of MAVLink (.tlog), by pymavlink (extra `mavlink`).

A record is the time of the ground station and a frame.  What was sent says its time since boot, which counts before
that of the radio link; the clock of the ground station gives the date.  Of several systems the autopilot that says most
is read; a ground station (255) is none.  The .bin of the autopilot itself has more, and loses nothing on the way.
What goes to the servos has its meaning in parameters; a log without these has numbers, ``SERVO_OUTPUT_RAW[1]``, which a
mapping makes channels of.
"""

from __future__ import annotations

import math
import mmap
import re
import struct
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ...core.values import dataclass, field
from .. import DataError, Trial
from ..instruments import Heard, trial_by
from ..robot.messages import Values
from ..robot.series import Series
from ..robot.topics import Bare, Topics, named, read_topics
from .dataflash import servos

__all__ = ["name", "read", "read_mapping", "suffixes"]

name = "tlog"
suffixes = (".tlog",)
read_mapping = read_topics
_STAMP = struct.Struct(">Q")
_BEGIN = re.compile(rb"\x00[\x03-\x0e].{6}[\xfd\xfe]", re.DOTALL)
"""A stamp of the years 2000 to 2100 [us since 1970], and the first byte of a frame behind it."""
_LEAST = _STAMP.size + 8
_STATION = 255
_RESTART = 5.0
"""By so much less is the time since boot after another start [s]."""
_RAD = math.pi / 180.0
Readings = dict[str, float]


def _attitude(one: Any) -> Readings:
    return {"psi": one.yaw % math.tau, "phi": one.roll, "theta": one.pitch, "r": one.yawspeed}


def _global(one: Any) -> Readings:
    north, east = one.vx / 100.0, one.vy / 100.0
    place = {"latitude": one.lat / 1e7, "longitude": one.lon / 1e7} if one.lat or one.lon else {}
    return {**place, "U_G": math.hypot(north, east), "gamma_G": math.atan2(east, north) % math.tau}


def _raw(one: Any) -> Readings:
    if one.fix_type < 3:
        return {}
    moving = {"U_G": one.vel / 100.0} if one.vel != 65535 else {}
    course = {"gamma_G": one.cog / 100.0 * _RAD} if one.cog != 65535 and moving else {}
    return {"latitude": one.lat / 1e7, "longitude": one.lon / 1e7, **moving, **course}


def _pulses(one: Any) -> Readings:
    return {f"C{k}": float(getattr(one, f"servo{k}_raw", 0) or 0) for k in range(1, 17)}


_SERVOS = "SERVO_OUTPUT_RAW"
_READ: Mapping[str, tuple[str, Callable[[Any], Readings]]] = MappingProxyType({
    "ATTITUDE": ("ATTITUDE:Att", _attitude), "GLOBAL_POSITION_INT": ("GLOBAL_POSITION_INT:Pos", _global),
    "GPS_RAW_INT": ("GPS_RAW_INT:Fix", _raw), _SERVOS: (_SERVOS, _pulses),
})  # fmt: skip


@dataclass
class _System:
    """What one autopilot said.

    Attributes:
        said: readings by source, with the time since boot as `boot`, at times of the ground station.
        parameters: by name.
        ignored: number of messages of each kind that nothing is read from.
    """

    said: dict[str, Series] = field(default_factory=dict[str, Series])
    parameters: dict[str, float] = field(default_factory=dict[str, float])
    ignored: Counter[str] = field(default_factory=Counter[str])

    def take(self, at: int, one: Any) -> None:
        """One message at a time of the ground station [ns]."""
        kind = one.get_type()
        if kind in _READ:
            source, readings = _READ[kind]
            # times in microseconds may be of another clock
            boot = {"boot": one.time_boot_ms / 1e3} if hasattr(one, "time_boot_ms") else {}
            self.said.setdefault(source, Series(kind)).add(at, Values(None, {**readings(one), **boot}))
        elif kind == "PARAM_VALUE":
            self.parameters[str(one.param_id)] = float(one.param_value)
        else:
            self.ignored[kind] += 1


def read(source: Path, mapping: Topics | None = None) -> Trial:
    """Read one log; without a mapping by the one beside it."""
    systems: dict[int, _System] = {}
    steps: list[str] = []
    for at, one in _messages(source, steps):
        if one.get_srcSystem() != _STATION:
            systems.setdefault(one.get_srcSystem(), _System()).take(at, one)
    if not systems:
        raise DataError(f"{source}: no message of an autopilot; give a whole telemetry log of MAVLink")
    number = max(systems, key=lambda one: sum(len(said.times) for said in systems[one].said.values()))
    own = systems[number]
    if len(systems) > 1:
        steps.append(f"system {number} is read; others speak too: {', '.join(str(k) for k in systems if k != number)}")
    heard, bare, first = _heard(own, steps)
    plain = named(source, mapping or Topics(), heard, bare)
    heard.ignored.update(own.ignored)
    return trial_by(source, heard, "messages of MAVLink", mapping, first, steps, plain=plain, base="psi")


def _heard(own: _System, steps: list[str]) -> tuple[Heard, dict[str, Bare], float]:
    """Readings by the clock of the autopilot, pulses whose use nothing says, and when it was 0 [s since 1970]."""
    at = {source: np.array(one.times) / 1e9 for source, one in own.said.items()}
    boots = {source: one.column("boot") for source, one in own.said.items()}
    late = np.concatenate([np.zeros(0), *(at[source] - boots[source] for source in at)])
    late = late[np.isfinite(late)]
    again = any(np.any(np.diff(one[np.isfinite(one)]) < -_RESTART) for one in boots.values())
    if again:
        steps.append("doubt: the autopilot was started again; times are those of the ground station")
    elif late.size:
        steps.append(f"times are those since boot; the delay of the link changed by {np.ptp(late):.3g} s at most")
    booted = late.size > 0 and not again
    first = float(np.median(late)) if booted else min((float(one[0]) for one in at.values()), default=0.0)
    heard, bare = Heard(), dict[str, Bare]()
    for source, one in own.said.items():
        t = np.where(booted & np.isfinite(boots[source]), boots[source], at[source] - first)
        if source == _SERVOS:
            names = [name for name in one.columns if name != "boot"]
            if not any(re.fullmatch(r"SERVO\d+_FUNCTION", known) for known in own.parameters):
                bare |= {f"{source}[{name[1:]}]": (t, np.where(one.column(name) > 0.0, one.column(name), math.nan))
                         for name in names if (one.column(name) > 0.0).any()}  # fmt: skip
                continue
            rows = np.column_stack([t, *(one.column(name) for name in names)]).tolist()
            steps += servos(heard, [dict(zip(("t", *names), row, strict=True)) for row in rows], own.parameters, source)
            continue
        for name in one.columns:
            if name != "boot":
                heard.whole(source, name, t, one.column(name))
    return heard, bare, first


def _messages(path: Path, steps: list[str]) -> Iterator[tuple[int, Any]]:
    """Time of the ground station [ns since 1970] and each message whose checksum is right.

    Raises:
        DataError: the extra is not installed, or the file is not readable.
    """
    try:
        from pymavlink.dialects.v20 import ardupilotmega as dialect
    except ImportError:
        raise DataError(f"{path}: telemetry logs need the extra 'mavlink': pip install 'seatrial[mavlink]'") from None
    codec, lost, foreign, at = dialect.MAVLink(None), 0, 0, 0
    wrong = (dialect.MAVError, struct.error, ValueError, UnicodeDecodeError, TypeError)
    with _mapped(path) as data:
        while at + _LEAST <= len(data):
            one, end = _decoded(codec, wrong, data, at)
            if one is None:
                found = _BEGIN.search(data, at + 1)
                following = found.start() if found else len(data)
                lost, at = lost + following - at, following
                continue
            (stamp,) = _STAMP.unpack_from(data, at)
            at = end
            if one.get_type().startswith("UNKNOWN"):
                foreign += 1
            else:
                yield stamp * 1000, one
        size = len(data)
    if foreign:
        steps.append(f"{foreign} messages of other dialects than ArduPilot's are left out")
    if lost + size - at:
        doubt = "doubt: " if lost > 0.01 * size else ""
        steps.append(f"{doubt}{lost + size - at} of {size} bytes are of no whole message")


def _decoded(codec: Any, wrong: tuple[type[Exception], ...], data: mmap.mmap | bytes, at: int) -> tuple[Any, int]:
    """The message of a record, None for none, and where the record ends."""
    frame = _frame(data, at)
    one, end = None, at + _STAMP.size + len(frame)
    if frame:
        with suppress(*wrong):
            one = codec.decode(bytearray(frame))
    # the checksum of a message of another dialect is not known: the record behind it says whether it is whole
    whole = one is None or not one.get_type().startswith("UNKNOWN") or _BEGIN.match(data, end) is not None
    return (one if whole else None), end


@contextmanager
def _mapped(path: Path) -> Generator[mmap.mmap | bytes]:
    """The bytes of a file, read as they are asked for."""
    try:
        with path.open("rb") as file:
            if not path.stat().st_size:
                yield b""
                return
            with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
                yield data
    except OSError as error:
        raise DataError(f"{path}: not readable: {error.strerror}") from None


def _frame(data: mmap.mmap | bytes, at: int) -> bytes:
    """The frame behind a stamp of the years 2000 to 2100, of MAVLink 1 or 2, signed or not; empty for none."""
    if _BEGIN.match(data, at) is None:
        return b""
    first = at + _STAMP.size
    magic, count, flags = data[first : first + 3]
    length = count + (8 if magic == 0xFE else 12 + 13 * (flags & 1))
    return bytes(data[first : first + length]) if first + length <= len(data) else b""
