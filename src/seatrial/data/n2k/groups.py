"""What parameter groups of NMEA 2000 say, in SI and the signs of docs/conventions.md.

Fields by the public table of canboat; the largest three values of a field are no reading: reserved, out of range, not
available.  Bytes beyond those that are named are not looked at, as later editions add fields.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from .. import Array

FAST = frozenset((127237, 129029, 130578))
"""Groups of those below that have more than 8 bytes, and come as fast packets."""

Value = float | Array
Said = Mapping[str, Value]


class DifferError(Exception):
    """Messages differ in a code or a number by which their readings are named; `part` has it for each."""

    def __init__(self, part: NDArray[np.int64]) -> None:
        super().__init__()
        self.part = part


Message = bytes | NDArray[np.uint8]
"""The bytes of a message, or of many of the same length, a row each."""


def said(pgn: int, data: bytes) -> dict[str, float] | None:
    """Readings of a group, by the names of `nmea.readings.readings`; None for a group that is not read.

    Names beyond those: variation; delta_<instance>, delta_<instance>_cmd, rpm_E_<instance>; gear_<instance>, 1 ahead,
    0 neutral, -1 astern; utc, since 1970 [s].
    """
    reader = _READ.get(pgn)
    if reader is None:
        return None
    return {name: float(value) for name, value in reader(data).items() if value == value}


def all_said(pgn: int, data: NDArray[np.uint8]) -> Iterator[tuple[NDArray[np.intp], Said]]:
    """Readings of many messages of a group that have at most 8 bytes: numbers of messages, and what they say.

    NaN where there is none.
    """
    waiting = [np.arange(len(data))]
    while waiting:
        rows = waiting.pop()
        try:
            yield rows, _READ[pgn](data[rows])
        except DifferError as differ:
            waiting += [rows[differ.part == one] for one in np.unique(differ.part).tolist()]


def _width(data: Message) -> int:
    return len(data) if isinstance(data, bytes) else data.shape[1]


def _raw(data: Message, at: int, size: int, most: int) -> Value:
    """A number without sign; NaN where it is not there, or more than `most`."""
    if _width(data) < at + size:
        return math.nan
    if isinstance(data, bytes):
        raw = int.from_bytes(data[at : at + size], "little")
        return raw if raw <= most else math.nan
    raw = data[:, at : at + size] @ (256.0 ** np.arange(size))
    return np.where(raw <= most, raw, math.nan)


def _u(data: Message, at: int, size: int, unit: float) -> Value:
    return _raw(data, at, size, (1 << 8 * size) - 4) * unit


def _s(data: Message, at: int, size: int, unit: float) -> Value:
    whole = 1 << 8 * size
    if isinstance(data, bytes):
        raw = int.from_bytes(data[at : at + size], "little", signed=True)
        return math.nan if len(data) < at + size or raw > whole // 2 - 4 else raw * unit
    raw = _raw(data, at, size, whole)
    signed = np.where(raw >= whole // 2, raw - whole, raw)
    return np.where(signed <= whole // 2 - 4, signed, math.nan) * unit


def _code(data: Message, at: int, bits: int) -> int:
    """The lowest bits of a byte; all set where there is none."""
    most = (1 << bits) - 1
    if at >= _width(data):
        return most
    if isinstance(data, bytes):
        return data[at] & most
    codes = data[:, at] & most
    if (codes != codes[0]).any():
        raise DifferError(codes.astype(np.int64))
    return int(codes[0])


def _else(value: Value, other: Value) -> Value:
    """A value, another one where it is NaN."""
    if isinstance(value, np.ndarray):
        return np.where(value == value, value, other)
    return value if value == value else other


def _rudder(d: Message) -> Said:
    which = _code(d, 0, 8)
    return {f"delta_{which}": _s(d, 4, 2, 1e-4), f"delta_{which}_cmd": _s(d, 2, 2, 1e-4)} if _width(d) else {}


def _heading(d: Message) -> Said:
    psi, variation, reference = _u(d, 1, 2, 1e-4), _s(d, 5, 2, 1e-4), _code(d, 7, 2)
    if reference != 1:
        return {"psi": psi} if reference == 0 else {}
    true = (psi + variation) % math.tau
    magnetic = (
        np.where(true == true, math.nan, psi) if isinstance(true, np.ndarray) else psi if true != true else math.nan
    )
    return {"psi": true, "variation": variation + 0.0 * psi, "psi_magnetic": magnetic}


def _course(d: Message) -> Said:
    reference, speed = _code(d, 1, 2), _u(d, 4, 2, 0.01)
    # a course from magnetic north is of no use without the variation of its receiver
    return {"gamma_G": _u(d, 2, 2, 1e-4), "U_G": speed} if reference == 0 else {}


def _gear(d: Message) -> Said:
    way = {0: 1.0, 1: 0.0, 2: -1.0}.get(_code(d, 1, 2), math.nan)
    return {f"gear_{_code(d, 0, 8)}": way} if _width(d) else {}


def _speed(d: Message) -> Said:
    speed, way = _u(d, 1, 2, 0.01), _code(d, 6, 4)
    return {"u_log_water": -speed if way == 1 else speed}


def _speeds(d: Message) -> Said:
    names = ("u_log_water", "v_log_water", "u_log", "v_log", "v_stern_water", "v_stern")
    return {name: _s(d, 2 * k, 2, 1e-3) for k, name in enumerate(names)}


def _fix(d: Message) -> Said:
    if _width(d) < 32 or _code(d, 31, 8) >> 4 in (0, 15):
        return {}
    return {"latitude": _s(d, 7, 8, 1e-16), "longitude": _s(d, 15, 8, 1e-16), **_utc(d, 1)}


def _utc(d: Message, at: int) -> Said:
    days, clock = _u(d, at, 2, 1.0), _u(d, at + 2, 4, 1e-4)
    return {"utc": 86400.0 * days + clock}


def _wind(d: Message) -> Said:
    speed, angle, reference = _u(d, 1, 2, 0.01), _u(d, 3, 2, 1e-4), _code(d, 5, 3)
    bow = "U_T", "gamma_T_bow"
    names = {0: ("U_T_ground", "gamma_T_ground"), 2: ("U_A", "gamma_A"), 3: bow, 4: bow}
    return dict(zip(names[reference], (speed, angle + 0.0 * speed), strict=True)) if reference in names else {}


def _depth(d: Message) -> Said:
    depth, offset = _u(d, 1, 4, 0.01), _s(d, 5, 2, 1e-3)
    # an offset below zero is the distance to the keel and does not locate the surface
    return {"depth": depth + np.maximum(_else(offset, 0.0), 0.0)}


def _steering(d: Message) -> Said:
    return {"delta_0_cmd": _s(d, 3, 2, 1e-4)}


def _current(d: Message) -> Said:
    return {"gamma_C": _u(d, 2, 2, 1e-4), "U_C": _u(d, 4, 2, 0.01)} if _code(d, 1, 2) == 0 else {}


_READ: Mapping[int, Callable[[Message], Said]] = MappingProxyType({
    126992: lambda d: _utc(d, 2) if _code(d, 1, 4) != 5 else {},  # 5: the clock of a crystal
    127237: _steering,
    127245: _rudder,
    127250: _heading,
    127251: lambda d: {"r": _s(d, 1, 4, 3.125e-8)},
    127257: lambda d: {"theta": _s(d, 3, 2, 1e-4), "phi": _s(d, 5, 2, 1e-4)},
    127258: lambda d: {"variation": _s(d, 4, 2, 1e-4)},
    127488: lambda d: {f"rpm_E_{_code(d, 0, 8)}": _u(d, 1, 2, 0.25)} if _width(d) else {},
    127493: _gear,
    128259: _speed,
    128267: _depth,
    129025: lambda d: {"latitude": _s(d, 0, 4, 1e-7), "longitude": _s(d, 4, 4, 1e-7)},
    129026: _course,
    129029: _fix,
    129033: lambda d: _utc(d, 0),
    129291: _current,
    130306: _wind,
    130578: _speeds,
})  # fmt: skip

PGNS = frozenset(_READ)
"""Groups that readings are taken from."""

_DISPLAYS = 250


def finished(series: dict[str, tuple[Array, Array]]) -> dict[str, str]:
    """Rudders by their side and revolutions with the sign of the gear; the quantities of their readings."""
    names = {name: "rudder order" if name.endswith("_cmd") else "rudder"
             for name in series if name.startswith("delta_") and name.split("_")[1].isdigit()}  # fmt: skip
    for end in ("", "_cmd"):
        there = {int(one.split("_")[1]): one for one in names if one.endswith("_cmd") == bool(end)}
        real = sorted((k for k in there if k <= _DISPLAYS), reverse=True) or sorted(there)[:1]
        for place, number in zip((f"delta{end}", f"delta_port{end}"), real, strict=False):
            series.setdefault(place, series[there[number]])
        for one in there.values():
            del series[one]
    for gear in [one for one in series if one.startswith("gear_")]:
        t, way = series.pop(gear)
        rpm = f"rpm_E_{gear.removeprefix('gear_')}"
        if rpm in series:
            series[rpm] = series[rpm][0], series[rpm][1] * way[_nearest(t, series[rpm][0])]
    return names


def _nearest(t: Array, wanted: Array) -> NDArray[np.intp]:
    """Places of the times that are nearest to others."""
    after = np.clip(np.searchsorted(t, wanted), 0, len(t) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(np.abs(wanted - t[before]) <= np.abs(t[after] - wanted), before, after)
