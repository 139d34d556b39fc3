"""Readings from sentences, in SI and the signs of docs/conventions.md; `ship` has the table of units and signs.

A field that is empty, no number or out of its range is no reading, and costs no other one.  Meaning and order of the
fields are those of IEC 61162-1 as manuals of equipment and open decoders have them.

Each sentence is read by one function, whether it stands alone (`heard.Heard`) or with many of its shape
(`columns.Columns`): words are the same in all of them, numbers are floats or arrays, NaN where there is none.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from datetime import date
from types import MappingProxyType
from typing import Protocol

import numpy as np

from ...core.constants import KNOT
from .. import Array
from ..mapping.clocks.calendar import leap_seconds
from .heard import Heard, number

_RAD = math.pi / 180.0
_SPEEDS = MappingProxyType({"K": 1.0 / 3.6, "M": 1.0, "N": KNOT, "S": 1609.344 / 3600.0})
_DAY = re.compile(r"(\d\d)(\d\d)(\d\d|\d{4})")
_FOOT = 0.3048
_HEX = re.compile(r"[0-9A-Fa-f]{1,4}")
_GPS_ZERO = 315964800.0
"""Where GPS weeks begin, seconds since 1970."""

Value = float | Array
"""A reading, or one of each sentence; NaN where there is none."""

Found = Mapping[str, Value]


class Fields(Protocol):
    """The fields of a sentence, or of many that have the same words; one that is not there is empty."""

    @property
    def kind(self) -> str: ...

    def __len__(self) -> int:
        """How many there are."""
        ...

    def text(self, k: int) -> str:
        """A field as it is."""
        ...

    def word(self, k: int) -> str:
        """A field as it is; "#" where it has digits, a sign or a point."""
        ...

    def number(self, k: int) -> Value:
        """A field as a number, see `heard.number`."""
        ...

    def clock(self, k: int) -> Value:
        """A field as time of the day, see `heard.clock`."""
        ...

    def place(self, k: int) -> Value:
        """A field as degrees and minutes, see `heard.place`."""
        ...


def _where(good: bool | np.ndarray[tuple[int, ...], np.dtype[np.bool_]], value: Value) -> Value:
    """A value where it is good, else NaN."""
    return (value if good else math.nan) if isinstance(good, bool | np.bool_) else np.where(good, value, math.nan)


def _else(value: Value, other: Value) -> Value:
    """A value, another one where it is NaN."""
    return (
        np.where(value == value, value, other) if isinstance(value, np.ndarray) else value if value == value else other
    )


def _number(f: Fields, k: int, low: float = -1e6, high: float = 1e6, factor: float = 1.0) -> Value:
    """A field as a number times a factor; NaN where it is none, or out of its range."""
    value = f.number(k)
    return _where((low <= value) & (value <= high), value * factor)


def _if(valid: bool, value: Value) -> Value:
    return value if valid else math.nan


def _whole(*values: Value) -> list[Value]:
    """Values where all of them are known."""
    total = sum(values)
    return [_where(total == total, value) for value in values]


def _direction(f: Fields, k: int) -> Value:
    return _number(f, k, -360.0, 360.0, _RAD)


def _sided(f: Fields, k: int, plus: str, minus: str, factor: float = _RAD) -> Value:
    """An angle whose sign is in the next field; without that letter it is unknown."""
    side = f.word(k + 1)
    value = _if(side in (plus, minus), _number(f, k, 0.0, 180.0, factor))
    return value if side == plus else -value


def _place(f: Fields, k: int, greatest: float, plus: str, minus: str) -> Value:
    """Degrees and minutes of arc in one field, the hemisphere in the next [deg]."""
    side, degrees = f.word(k + 1), f.place(k)
    degrees = _where(degrees <= greatest, degrees)
    return _if(side in (plus, minus), degrees if side == plus else -degrees)


def _fix(f: Fields, k: int, valid: bool) -> dict[str, Value]:
    latitude, longitude = _whole(_place(f, k, 90.0, "N", "S"), _place(f, k + 2, 180.0, "E", "W"))
    return {"latitude": _if(valid, latitude), "longitude": _if(valid, longitude)}


def _clock(f: Fields, k: int, valid: bool = True) -> dict[str, Value]:
    """Time of the day of the fix [s]; that of a fix that is none goes by another name."""
    return {"time_of_day" if valid else "time_of_none": f.clock(k)}


def _midnight(year: int, month: int, day: int) -> float:
    """Seconds since 1970 at 0 o'clock of a date; two digits of the year from 80 on are those of the last century."""
    full = year if year > 99 else year + (1900 if year >= 80 else 2000)
    try:
        return (date(full, month, day) - date(1970, 1, 1)).days * 86400.0
    except ValueError:  # the 31st of a month that has none
        return math.nan


def _day(text: str) -> float:
    found = _DAY.fullmatch(text)
    return _midnight(int(found[3]), int(found[2]), int(found[1])) if found else math.nan


def _rmc(f: Fields) -> Found:
    valid = f.word(1) == "A" and f.word(11) != "N"
    return {
        **_clock(f, 0, valid), **_fix(f, 2, valid), "day": _if(valid, _day(f.text(8))),
        "U_G": _if(valid, _number(f, 6, 0.0, 999.0, KNOT)), "gamma_G": _if(valid, _direction(f, 7)),
        "variation": _sided(f, 9, "E", "W"),
    }  # fmt: skip


def _gga(f: Fields) -> Found:
    valid = f.text(5) not in ("", "0")
    return {**_clock(f, 0, valid), **_fix(f, 1, valid)}


def _gns(f: Fields) -> Found:
    valid = bool(set(f.word(5)) - {"N"})
    return {**_clock(f, 0, valid), **_fix(f, 1, valid)}


def _gll(f: Fields) -> Found:
    valid = f.word(5) in ("A", "") and f.word(6) != "N"
    return {**_clock(f, 4, valid), **_fix(f, 0, valid)}


def _zda(f: Fields) -> Found:
    day, month, year = (number(f.text(k)) for k in (1, 2, 3))
    known = 1 <= day <= 9999 and 1 <= month <= 9999 and 1 <= year <= 9999
    return {**_clock(f, 0), "day": _midnight(int(year), int(month), int(day)) if known else math.nan}


def _vtg(f: Fields) -> Found:
    old = f.word(1) != "T"  # four bare numbers: course true and magnetic, knots, km/h
    valid = old or f.word(8) != "N"
    knots, hours = (_number(f, k, 0.0, 999.0, factor) for k, factor in (((2, KNOT), (3, 1 / 3.6)) if old else
                                                                       ((4, KNOT), (6, 1 / 3.6))))  # fmt: skip
    return {"gamma_G": _if(valid, _direction(f, 0)), "U_G": _if(valid, _else(knots, hours))}


def _vbw(f: Fields) -> Found:
    names = (("u_log_water", 0, 2), ("v_log_water", 1, 2), ("u_log", 3, 5), ("v_log", 4, 5), ("v_stern_water", 6, 7),
             ("v_stern", 8, 9))  # fmt: skip
    return {name: _if(f.word(status) == "A", _number(f, k, -99.0, 99.0, KNOT)) for name, k, status in names}


def _vhw(f: Fields) -> Found:
    knots, hours = _number(f, 4, -99.0, 99.0, KNOT), _number(f, 6, -200.0, 200.0, 1 / 3.6)
    return {"psi": _direction(f, 0), "psi_magnetic": _direction(f, 2), "u_log_water": _else(knots, hours)}


def _hdg(f: Fields) -> Found:
    sensor, deviation = _direction(f, 0), _else(_sided(f, 1, "E", "W"), 0.0)
    # true = sensor + deviation + variation, east positive
    return {"psi_magnetic": sensor + deviation, "variation": _sided(f, 3, "E", "W")}


def _mwv(f: Fields) -> Found:
    speed, angle = _number(f, 2, 0.0, 999.0, _SPEEDS.get(f.word(3), math.nan)), _direction(f, 0)
    return _felt(f.word(1) == "R", speed, angle) if f.word(4) in ("A", "") else {}


def _felt(apparent: bool, speed: Value, angle: Value) -> Found:
    names = ("U_A", "gamma_A") if apparent else ("U_T", "gamma_T_bow")
    return dict(zip(names, _whole(speed, angle), strict=True))


def _beside(apparent: bool) -> Callable[[Fields], Found]:
    """VWR and VWT: the angle to a side, and the speed in one of three units."""

    def read(f: Fields) -> Found:
        knots, metres, hours = (_number(f, k, 0.0, 999.0, factor) for k, factor in ((2, KNOT), (4, 1.0), (6, 1 / 3.6)))
        return _felt(apparent, _else(knots, _else(metres, hours)), _sided(f, 0, "R", "L") % (2.0 * math.pi))

    return read


def _mwd(f: Fields) -> Found:
    knots, metres, angle = _number(f, 4, 0.0, 999.0, KNOT), _number(f, 6, 0.0, 999.0), _direction(f, 0)
    speed = _else(metres, knots)
    return dict(zip(("U_T_ground", "gamma_T_ground"), _whole(speed, angle), strict=True))


def _dpt(f: Fields) -> Found:
    depth, offset = _number(f, 0, 0.0, 12e3), _number(f, 1, -999.0, 999.0)
    # an offset below zero is the distance to the keel and does not locate the surface
    return {"depth": depth + _else(_where(offset > 0.0, offset), 0.0)}


def _dbt(f: Fields) -> Found:
    metres, feet = _number(f, 2, 0.0, 12e3), _number(f, 0, 0.0, 4e4, _FOOT)
    return {"depth": _else(metres, feet)}


_TURNED = MappingProxyType({
    "RUDDER": "delta", "HEEL": "phi", "ROLL": "phi", "TRIM": "theta", "PTCH": "theta", "PITCH": "theta",
})  # fmt: skip
_TURNS = re.compile(r"(ENGINE|SHAFT|PROP|RPM)\D*(\d{0,2})")
_PORT = re.compile(r"(?<![A-Z])(?:P|PS|PT|PORT|LEFT)(?![A-Z])")


def _xdr(f: Fields) -> Found:
    """Groups of type, value, unit and name; an angle in degrees under a name that is known, whatever stands around.

    A rudder is the port one by P, PS, PORT or LEFT in its name.
    """
    found: dict[str, Value] = {}
    for k in range(0, len(f) - 3, 4):
        name = f.text(k + 3).upper()
        if f.word(k) == "T" and f.word(k + 2) == "R" and (turned := _TURNS.search(name)):
            shaft = f"rpm_{'E' if turned[1].startswith('E') else 'S'}_{int(turned[2] or 0)}"
            found.setdefault(shaft, _number(f, k + 1, -99999.0, 99999.0))
        if f.word(k) != "A" or f.word(k + 2) != "D":
            continue
        meant = next((quantity for word, quantity in _TURNED.items() if word in name), None)
        if meant == "delta" and _PORT.search(name.replace("RUDDER", "")):
            meant = "delta_port"
        if meant == "delta" and "delta" in found:  # two without a side are numbered from port
            found["delta_port"] = found.pop("delta")
        if meant and meant not in found:  # a second transducer of the same angle takes the place of none
            found[meant] = _number(f, k + 1, -180.0, 180.0, _RAD)
    return found


def _rpm(f: Fields) -> Found:
    shaft, which = "E" if f.word(0) == "E" else "S", number(f.text(1))
    if not 0 <= which <= 99:
        return {}
    return {f"rpm_{shaft}_{int(which)}": _if(f.word(4) in ("A", ""), _number(f, 2, -99999.0, 99999.0))}


def _pair(*names: str) -> Callable[[Fields], Found]:
    """RSA and ROR: starboard or only, status, port, status; one that is never valid is not there."""
    return lambda f: {name: _if(f.word(2 * k + 1) == "A", _number(f, 2 * k, -180.0, 180.0, _RAD))
                      for k, name in enumerate(names)}  # fmt: skip


def _attitude(psi: Value, phi: Value, theta: Value, valid: bool = True) -> Found:
    return {"psi": _if(valid, psi), "phi": _if(valid, phi), "theta": _if(valid, theta)}


def _angle(f: Fields, k: int) -> Value:
    return _number(f, k, -180.0, 180.0, _RAD)


def _pashr(f: Fields) -> Found:
    if f.word(2) != "T":  # ATT, POS, SAT and others under the same address
        return {}
    valid = f.text(9) != "0"
    return {**_clock(f, 0, valid), **_attitude(_direction(f, 1), _angle(f, 3), _angle(f, 4), valid)}


def _psxn(f: Fields) -> Found:
    return _attitude(_direction(f, 3), _angle(f, 1), _angle(f, 2)) if f.text(0) == "23" else {}


def _pssn(f: Fields) -> Found:
    if f.word(0) != "HRP":
        return {}
    valid = f.text(10) != "0"
    return {**_clock(f, 1, valid), "day": _day(f.text(2)),
            **_attitude(_direction(f, 3), _angle(f, 4), _angle(f, 5), valid)}  # fmt: skip


def _ptnl(f: Fields) -> Found:
    if f.word(0) != "AVR":
        return {}
    valid = f.text(9) != "0"
    return {**_clock(f, 1, valid), "psi": _if(valid, _direction(f, 2))}


def _psat(f: Fields) -> Found:
    if f.word(0) != "HPR":
        return {}
    return {**_clock(f, 1), **_attitude(_direction(f, 2), _angle(f, 4), _angle(f, 3))}


def _ins(f: Fields) -> Found:
    """VNINS: seconds of the week by GPS, week, status, yaw, pitch, roll, latitude, longitude, height, velocity.

    The last two bits of the status say what it is about: 0 has no solution.
    """
    status = f.text(2)
    valid = status != "" and int(status, 16) & 3 > 0 if _HEX.fullmatch(status) else False
    week, seconds = number(f.text(1)), f.number(0)
    if not valid or not 1000.0 <= week <= 9999.0:
        return {}
    zero = _GPS_ZERO + 604800.0 * week
    utc = seconds - float(leap_seconds(np.array([int(zero) * 10**9]))[0])
    north, east = (_number(f, k, -99.0, 99.0) for k in (9, 10))
    latitude, longitude = _whole(_number(f, 6, -90.0, 90.0), _number(f, 7, -180.0, 180.0))
    day = np.floor(utc / 86400.0)
    return {"time_of_day": utc - 86400.0 * day, "day": zero + 86400.0 * day, "latitude": latitude,
            "longitude": longitude, **_attitude(_direction(f, 3), _angle(f, 5), _angle(f, 4)),
            "U_G": np.hypot(north, east), "gamma_G": np.arctan2(east, north) % (2.0 * math.pi)}  # fmt: skip


_READ: Mapping[str, Callable[[Fields], Found]] = MappingProxyType({
    "RMC": _rmc, "GGA": _gga, "GNS": _gns, "GLL": _gll, "ZDA": _zda, "VTG": _vtg, "VBW": _vbw, "VHW": _vhw,
    "HDT": lambda f: {"psi": _direction(f, 0)},
    "THS": lambda f: {"psi": _if(f.word(1) != "V", _direction(f, 0))},
    "HDM": lambda f: {"psi_magnetic": _direction(f, 0)}, "HDG": _hdg,
    "ROT": lambda f: {"r": _if(f.word(1) in ("A", ""), _number(f, 0, -9999.0, 9999.0, _RAD / 60.0))},
    "RSA": _pair("delta", "delta_port"), "ROR": _pair("delta_cmd", "delta_port_cmd"), "RPM": _rpm, "XDR": _xdr,
    "MWV": _mwv, "VWR": _beside(True), "VWT": _beside(False), "MWD": _mwd, "DPT": _dpt, "DBT": _dbt,
    "PASHR": _pashr, "INS": _ins, "PSXN": _psxn, "PSSN": _pssn, "PTNL": _ptnl, "PSAT": _psat,
    "PRDID": lambda f: _attitude(_direction(f, 2), _angle(f, 1), _angle(f, 0)),
})  # fmt: skip

KINDS = tuple(_READ)
"""Sentences that readings are taken from."""


def read(fields: Fields) -> Found:
    """Readings of a sentence or of many, in SI and radians; see `readings` for their names."""
    reader = _READ.get(fields.kind)
    return reader(fields) if reader else {}


def readings(heard: Heard) -> dict[str, float]:
    """Readings of a sentence, in SI and radians; empty and invalid fields are left out.

    Names beyond those of a trial: latitude, longitude [deg]; psi_magnetic, of a compass whose deviation is applied, and
    variation, east positive; u_log, v_log, v_stern and the same with _water; gamma_T_bow, true wind from the bow, and
    U_T_ground, gamma_T_ground, against north; delta_port; rpm_S_<number> of a shaft and rpm_E_<number> of an engine;
    time_of_day of a fix, time_of_none of one that is none, and day, the midnight before it since 1970 [s]; depth from
    the surface, or from the transducer where the log does not say where that is.
    """
    return {name: float(value) for name, value in read(heard).items() if value == value}
