"""Logs of PX4 (ULog), by pyulog (extra `ulog`).

Axes are north, east, down and forward, starboard, down; times are those since boot, UTC is by the receiver's own.
Names of topics and fields change with the versions of PX4: of several the first that is there is read.  What goes to
the motors are numbers, ``actuator_motors[0]``, which a mapping makes channels of.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...core.errors import first_line
from .. import Array, DataError, Trial
from ..geodesy import Datum
from ..instruments import Heard, trial_by
from ..robot.topics import Bare, Topics, named, read_topics

__all__ = ["name", "read", "read_mapping", "suffixes"]

name = "ulog"
suffixes = (".ulg",)
read_mapping = read_topics
_MAGIC = b"ULog\x01\x12\x35"
_HEADER, _HEAD = 16, struct.Struct("<HB")
_LARGEST = 65_535
"""Bytes of a message at most, by the width of its length."""

_SIZES = {"int8_t": 1, "uint8_t": 1, "bool": 1, "char": 1, "int16_t": 2, "uint16_t": 2, "int32_t": 4, "uint32_t": 4,
          "float": 4, "int64_t": 8, "uint64_t": 8, "double": 8}  # fmt: skip
_FIELD = re.compile(r"([\w/]+)(?:\[(\d{1,6})\])? (\w+)")
_FIXES = ("vehicle_gps_position", "sensor_gps")
_ACTUATORS = ("actuator_motors", "actuator_servos", "actuator_outputs", "actuator_controls_0")
_TOPICS = ("vehicle_attitude", "vehicle_local_position", "vehicle_global_position", "vehicle_angular_velocity",
           "esc_status", *_FIXES, *_ACTUATORS)  # fmt: skip
Rows = Mapping[str, Array]


def read(source: Path, mapping: Topics | None = None) -> Trial:
    """Read one log."""
    topics = mapping or Topics()
    log = _log(source)
    data = dict(_first(log))
    heard, steps = Heard(), list[str]()
    if log.file_corruption:
        steps.append("doubt: the log is damaged; what could be read is read")
    if log.dropouts:
        lost = sum(one.duration for one in log.dropouts) / 1e3
        steps.append(f"the recorder left out {lost:.3g} s in {len(log.dropouts)} pieces")
    _attitude(heard, data)
    _fixes(heard, data)
    datum = _local(heard, data, steps)
    plain = named(source, topics, heard, dict(_bare(data)))
    heard.ignored.update({one.name: len(next(iter(one.data.values()), ())) for one in log.data_list
                          if one.name not in _TOPICS})  # fmt: skip
    aboard = topics if datum is None or topics.datum is not None else replace(topics, datum=datum)
    return trial_by(source, heard, "topics of PX4", aboard, _epoch(data), steps, plain=plain, base="psi")


def _log(path: Path) -> Any:
    """The log as pyulog reads it, its definitions counted before.

    Raises:
        DataError: the extra is not installed, another file, or a damaged one.
    """
    try:
        from pyulog import ULog
    except ImportError:
        raise DataError(f"{path}: a ULog needs the extra 'ulog': pip install 'seatrial[ulog]'") from None
    try:
        with path.open("rb") as file:
            _hold(path, file)
            file.seek(0)
            with redirect_stdout(StringIO()):
                return ULog(file)
    except DataError:
        raise
    except OSError as error:
        raise DataError(f"{path}: not readable: {error.strerror}") from None
    except Exception as error:  # whatever pyulog raises on a damaged file
        raise DataError(f"{path}: not a whole ULog of PX4: {first_line(error, 120) or type(error).__name__}") from None


def _hold(path: Path, file: BinaryIO) -> None:
    """Refuse definitions of messages that are larger than any, or that hold themselves.

    Raises:
        DataError: one of them.
    """
    if not file.read(_HEADER).startswith(_MAGIC):
        raise DataError(f"{path}: no ULog of PX4: its first bytes are not ULog")
    fields: dict[str, list[tuple[str, int]]] = {}
    while len(head := file.read(_HEAD.size)) == _HEAD.size:
        size, kind = _HEAD.unpack(head)
        if chr(kind) not in "BFIMPQ":
            break
        text = file.read(size)
        if chr(kind) == "F":
            title, _, rest = text.decode(errors="replace").partition(":")
            fields[title] = [(one[1], int(one[2] or 1)) for one in map(_FIELD.fullmatch, rest.split(";")) if one]
    sizes: dict[str, int] = {}
    for title in fields:
        if _size(title, fields, sizes, 0) > _LARGEST:
            raise DataError(f"{path}: a message {title[:40]!r} of more than {_LARGEST} bytes; copy the log again")


def _size(kind: str, fields: Mapping[str, Sequence[tuple[str, int]]], sizes: dict[str, int], depth: int) -> int:
    """Bytes of a message with the messages in it."""
    if kind in _SIZES:
        return _SIZES[kind]
    if kind not in sizes:
        parts = fields.get(kind, ()) if depth < 20 else ((next(iter(_SIZES)), _LARGEST + 1),)
        sizes[kind] = sum(count * _size(one, fields, sizes, depth + 1) for one, count in parts)
    return sizes[kind]


def _first(log: Any) -> Iterator[tuple[str, Rows]]:
    """The topics that are read, by name, those of several instances with their number; rows without a time left out."""
    for one in log.data_list:
        if one.name in _TOPICS and len(one.data.get("timestamp", ())) > 0:
            rows = {key: np.asarray(values, dtype=np.float64) for key, values in one.data.items()}
            yield (one.name if one.multi_id == 0 else f"{one.name}#{one.multi_id}"), rows


def _t(rows: Rows) -> Array:
    return rows["timestamp"] / 1e6


def _attitude(heard: Heard, data: Mapping[str, Rows]) -> None:
    rows = data.get("vehicle_attitude", {})
    if all(f"q[{k}]" in rows for k in range(4)):
        w, x, y, z = (rows[f"q[{k}]"] for k in range(4))
        for reading, values in (
            ("psi", np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))),
            ("phi", np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))),
            ("theta", np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0))),
        ):
            heard.whole("vehicle_attitude:Att", reading, _t(rows), values)
    rates = data.get("vehicle_angular_velocity", {})
    for source, key in ((rates, "xyz[2]"), (rows, "yawspeed")):
        if key in source:
            heard.whole("vehicle_angular_velocity:Gyr", "r", _t(source), source[key])
            return


def _fixes(heard: Heard, data: Mapping[str, Rows]) -> None:
    """Positions and velocities of the receivers, where they have a fix in three dimensions."""
    for topic, rows in data.items():
        if topic.partition("#")[0] not in _FIXES:
            continue
        fixed = rows["fix_type"] >= 3 if "fix_type" in rows else np.ones(len(_t(rows)), dtype=bool)
        degrees = ("latitude_deg", "longitude_deg", 1.0) if "latitude_deg" in rows else ("lat", "lon", 1e-7)
        if not all(key in rows for key in degrees[:2]):
            continue
        for reading, key in zip(("latitude", "longitude"), degrees[:2], strict=True):
            heard.whole(f"{topic}:Fix", reading, _t(rows), np.where(fixed, rows[key] * degrees[2], np.nan))
        if "vel_n_m_s" in rows and "vel_e_m_s" in rows:
            north, east = (np.where(fixed, rows[key], np.nan) for key in ("vel_n_m_s", "vel_e_m_s"))
            _ground(heard, f"{topic}:Fix", _t(rows), north, east)


def _ground(heard: Heard, source: str, t: Array, north: Array, east: Array) -> None:
    heard.whole(source, "U_G", t, np.hypot(north, east))
    heard.whole(source, "gamma_G", t, np.mod(np.arctan2(east, north), 2.0 * np.pi))


def _local(heard: Heard, data: Mapping[str, Rows], steps: list[str]) -> Datum | None:
    """Place and velocity of the estimator; where its zero is."""
    rows = data.get("vehicle_local_position", {})
    if not all(key in rows for key in ("x", "y", "vx", "vy")):
        return None
    valid = rows.get("xy_valid", np.ones(len(_t(rows)))) > 0.0
    moving = rows.get("v_xy_valid", np.ones(len(_t(rows)))) > 0.0
    _ground(heard, "vehicle_local_position:Odo", _t(rows), np.where(moving, rows["vx"], np.nan),
            np.where(moving, rows["vy"], np.nan))  # fmt: skip
    zeros = {(float(a), float(b)) for a, b in zip(rows.get("ref_lat", ()), rows.get("ref_lon", ()), strict=True)
             if math.isfinite(a + b) and (a, b) != (0.0, 0.0)}  # fmt: skip
    if len(zeros) > 1:
        steps.append("doubt: the zero of vehicle_local_position moves during the log; the fixes are taken instead")
        return None
    for reading in ("x", "y"):
        heard.whole("vehicle_local_position:Odo", reading, _t(rows), np.where(valid, rows[reading], np.nan))
    return Datum(*next(iter(zeros))) if zeros else None


def _bare(data: Mapping[str, Rows]) -> Iterator[tuple[str, Bare]]:
    """Numbers of actuators and motors, by topic and place."""
    for topic, rows in data.items():
        if topic.partition("#")[0] not in (*_ACTUATORS, "esc_status"):
            continue
        for key, values in rows.items():
            found = re.fullmatch(r"(?:control|output|esc)(\[\d+\])(?:\.(esc_rpm))?", key)
            if found is not None and (found[2] or not key.startswith("esc")):
                yield f"{topic}{found[1]}", (_t(rows), values)


def _epoch(data: Mapping[str, Rows]) -> float | None:
    """Seconds since 1970 at boot, by the clock of the receiver."""
    for topic in _FIXES:
        rows = data.get(topic, {})
        known = rows["time_utc_usec"] > 1e15 if "time_utc_usec" in rows else np.zeros(0, dtype=bool)
        if known.any():
            return float(np.median(rows["time_utc_usec"][known] / 1e6 - _t(rows)[known]))
    return None
