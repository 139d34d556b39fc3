"""Logs of ArduPilot's own recorder (DataFlash): .bin, and .log as text, by the definitions (FMT) that they hold.

Times are those since boot; UTC is by GPS.GWk and GPS.GMS, 18 s behind GPS time.  What goes to the servos (RCOU) is read
by the parameters in the log: a share of the greatest order, -1 to 1, of the throttles (functions 70, 73 port, 74
starboard) and of the steering (21, 26).  Pulses are neither revolutions nor forces.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ...core.values import dataclass, field
from .. import DataError, Trial
from ..instruments import Heard, each_line, trial_by
from ..table import bytes_of
from .nmea import Aboard, read_mapping

__all__ = ["EXAMPLE", "name", "read", "read_mapping", "suffixes"]

name = "dataflash"
suffixes = (".bin",)
EXAMPLE = """FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns
FMT, 133, 25, ATT, Qccc, TimeUS,Roll,Pitch,Yaw
ATT, 1000000, 0.10, 0.20, 40.00
ATT, 1100000, 0.10, 0.20, 40.50
ATT, 1200000, 0.10, 0.20, 41.00
"""
_HEAD, _FORMATS = b"\xa3\x95", 128
# Code of a field: its type in the file, and the unit of its last digit
_FIELDS: Mapping[str, tuple[str, float]] = MappingProxyType({
    "b": ("b", 1), "B": ("B", 1), "h": ("h", 1), "H": ("H", 1), "i": ("i", 1), "I": ("I", 1), "q": ("q", 1),
    "Q": ("Q", 1), "f": ("f", 1), "d": ("d", 1), "M": ("B", 1), "c": ("h", 0.01), "C": ("H", 0.01), "e": ("i", 0.01),
    "E": ("I", 0.01), "L": ("i", 1e-7), "n": ("4s", 0), "N": ("16s", 0), "Z": ("64s", 0), "a": ("64s", 0),
    "g": ("e", 1),
})  # fmt: skip
_GPS_EPOCH, _LEAP, _WEEK = 315964800.0, 18.0, 604800.0
_RAD = math.pi / 180.0
_SERVOS: Mapping[int, str] = MappingProxyType({
    70: "throttle", 73: "throttle_port", 74: "throttle_starboard", 21: "steering", 26: "steering",
})  # fmt: skip

Row = Mapping[str, float | str]


@dataclass(frozen=True)
class _Kind:
    """A message as its FMT defines it: name, codes and labels of its fields, and its length with the head."""

    name: str
    codes: str
    labels: tuple[str, ...]
    length: int

    def unpacked(self, data: bytes) -> Row:
        """The fields of a message."""
        values = struct.unpack("<" + "".join(_FIELDS[one][0] for one in self.codes), data)
        parts = zip(self.labels, self.codes, values, strict=False)
        return {label: _text(v) if isinstance(v, bytes) else v * _FIELDS[code][1] for label, code, v in parts}

    @property
    def fits(self) -> bool:
        """Whether its fields have the length that it says."""
        known = set(self.codes) <= set(_FIELDS)
        return known and struct.calcsize("<" + "".join(_FIELDS[one][0] for one in self.codes)) == self.length - 3


@dataclass
class _Log:
    """What the messages say, before the servos are known."""

    heard: Heard = field(default_factory=Heard)
    pulses: list[Row] = field(default_factory=list[Row])
    parameters: dict[str, float] = field(default_factory=dict[str, float])
    epochs: list[float] = field(default_factory=list[float])

    def take(self, kind: str, row: Row) -> None:
        """One message."""
        t = _of(row, "TimeUS") / 1e6 if "TimeUS" in row else _of(row, "TimeMS") / 1e3
        if kind == "PARM":
            self.parameters[str(row.get("Name", ""))] = _of(row, "Value")
        elif kind == "RCOU":
            self.pulses.append({**row, "t": t})
        elif kind in _READ:
            giver = f"{int(_of(row, 'I', 0.0))}/{kind}"
            self.heard.add(t, giver, _READ[kind](row))
            if kind == "GPS" and _of(row, "Status", 3.0) >= 3:
                week, ms = _of(row, "GWk"), _of(row, "GMS")
                self.epochs.append(_GPS_EPOCH + _WEEK * week + ms / 1e3 - _LEAP - t)
        else:
            self.heard.leave(kind)


def read(source: Path, mapping: Aboard | None = None) -> Trial:
    """Read one log; without a mapping by the one beside it."""
    log = _Log()
    raw = bytes_of(source)
    if raw.startswith(_HEAD):
        lost = _binary(source, raw, log.take)
        steps = [f"{lost} of {len(raw)} bytes are of no message"] if lost else []
    else:
        del raw
        steps = []
        _text_lines(source, log)
    steps += servos(log.heard, log.pulses, log.parameters, "0/RCOU")
    epochs = [one for one in log.epochs if math.isfinite(one)]
    epoch = float(np.median(epochs)) if epochs else None
    return trial_by(source, log.heard, "ArduPilot messages", mapping, epoch, steps)


def _binary(path: Path, raw: bytes, take: Callable[[str, Row], None]) -> int:
    """Give each message, and the number of bytes that are of none.

    Raises:
        DataError: no definition of messages.
    """
    kinds = {_FORMATS: _Kind("FMT", "BBnNZ", ("Type", "Length", "Name", "Format", "Columns"), 89)}
    at, lost = 0, 0
    while at + 3 <= len(raw):
        kind = kinds.get(raw[at + 2]) if raw.startswith(_HEAD, at) else None
        if kind is None or at + kind.length > len(raw):
            following = raw.find(_HEAD, at + 1)
            end = following if following >= 0 else len(raw)
            lost, at = lost + end - at, end
            continue
        if kind.fits:
            row = kind.unpacked(raw[at + 3 : at + kind.length])
            if kind.name == "FMT":
                kinds[int(row["Type"])] = _defined(row)
            else:
                take(kind.name, row)
        at += kind.length
    if len(kinds) < 2:
        raise DataError(f"{path}: no definitions of messages (FMT) in it; give a whole log")
    return lost


def _defined(row: Row) -> _Kind:
    length = max(int(_of(row, "Length", 3.0)), 3)
    return _Kind(str(row["Name"]).strip(), str(row["Format"]).strip(), _labels(str(row["Columns"])), length)


def _text_lines(path: Path, log: _Log) -> None:
    labels: dict[str, tuple[str, ...]] = {}

    def line(text: str) -> None:
        cells = [one.strip() for one in text.split(",")]
        if cells[0] == "FMT" and len(cells) > 5:
            labels[cells[3]] = _labels(",".join(cells[5:]))
        elif cells[0] in labels and len(cells) == len(labels[cells[0]]) + 1:
            log.take(cells[0], dict(zip(labels[cells[0]], cells[1:], strict=True)))
        else:
            log.heard.refuse(f"{text[:40]!r} is of no message that FMT defines, or has another number of fields")

    each_line(path, log.heard, line)


def servos(heard: Heard, pulses: Sequence[Row], parameters: Mapping[str, float], source: str) -> list[str]:
    """Take orders of the throttles and of the steering by what goes to the servos; what is said of that.

    Args:
        heard: takes them.
        pulses: their widths [us], C1, C2, ..., and the time t [s].
        parameters: of the autopilot.
        source: name of their source.
    """
    number = {k: _SERVOS[int(f)] for k in range(1, 17)
              if (f := parameters.get(f"SERVO{k}_FUNCTION", 0.0)) in _SERVOS}  # fmt: skip
    kind = source.rpartition("/")[2]
    if not pulses:
        return []
    if not number:
        heard.ignored[kind] = len(pulses)
        return [f"{kind}, what goes to the servos, is left out: no parameter SERVOn_FUNCTION of a throttle or steering"]
    for row in pulses:
        shares = {what: _share(_of(row, f"C{k}"), k, parameters) for k, what in number.items()}
        heard.add(_of(row, "t"), source, shares)
    return [f"{what} by servo {k}, a share of its greatest order" for k, what in number.items()]


def _share(pulse: float, k: int, said: Mapping[str, float]) -> float:
    """The order of a servo by its pulse [us]; NaN for none."""
    low, trim, high = (said.get(f"SERVO{k}_{end}", usual)
                       for end, usual in (("MIN", 1100.0), ("TRIM", 1500.0), ("MAX", 1900.0)))  # fmt: skip
    if not pulse > 0.0 or not low < trim < high:
        return math.nan
    share = (pulse - trim) / (high - trim if pulse >= trim else trim - low)
    return -share if said.get(f"SERVO{k}_REVERSED", 0.0) else share


def _labels(text: str) -> tuple[str, ...]:
    return tuple(one.strip() for one in text.split(","))


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("latin-1")


def _of(row: Row, label: str, otherwise: float = math.nan) -> float:
    try:
        return float(row.get(label, otherwise))
    except ValueError:
        return math.nan


def _fix(row: Row) -> dict[str, float]:
    if _of(row, "Status", 3.0) < 3:
        return {}
    return {"latitude": _of(row, "Lat"), "longitude": _of(row, "Lng"), "U_G": _of(row, "Spd"),
            "gamma_G": _of(row, "GCrs") * _RAD}  # fmt: skip


_READ: Mapping[str, Callable[[Row], dict[str, float]]] = MappingProxyType({
    "GPS": _fix,
    "ATT": lambda row: {"psi": _of(row, "Yaw") * _RAD, "phi": _of(row, "Roll") * _RAD,
                        "theta": _of(row, "Pitch") * _RAD},
    "IMU": lambda row: {"r": _of(row, "GyrZ")},
    "DPTH": lambda row: {"depth": _of(row, "Depth")},
})  # fmt: skip
