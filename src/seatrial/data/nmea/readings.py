"""Readings from sentences, in SI and the signs of docs/conventions.md; `ship` has the table of units and signs.

A field that is empty, no number or out of its range is no reading, and costs no other one.  Meaning and order of the
fields are those of IEC 61162-1 as manuals of equipment and open decoders have them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from datetime import date
from types import MappingProxyType

from .heard import Heard
from .ship import KNOT

_RAD = math.pi / 180.0
_SPEEDS = MappingProxyType({"K": 1.0 / 3.6, "M": 1.0, "N": KNOT, "S": 1609.344 / 3600.0})
_NUMBER = re.compile(r"[+-]?(?:\d{1,9}(?:\.\d{0,12})?|\.\d{1,12})")
_CLOCK = re.compile(r"([01]\d|2[0-4])([0-5]\d)([0-5]\d|60)(\.\d*)?")
_DAY = re.compile(r"(\d\d)(\d\d)(\d\d|\d{4})")
_PLACE = re.compile(r"(\d{1,3})(\d\d(?:\.\d*)?)")
_FOOT = 0.3048

Fields = tuple[str, ...]
_Found = Mapping[str, float | None]


def _text(f: Fields, k: int) -> str:
    return f[k] if k < len(f) else ""


def _number(f: Fields, k: int, low: float = -1e6, high: float = 1e6, factor: float = 1.0) -> float | None:
    """A field as a number times a factor; None where it is none, or out of its range."""
    text = _text(f, k)
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    return value * factor if low <= value <= high else None


def _if(valid: bool, value: float | None) -> float | None:
    return value if valid else None


def _direction(f: Fields, k: int) -> float | None:
    return _number(f, k, -360.0, 360.0, _RAD)


def _sided(f: Fields, k: int, plus: str, minus: str, factor: float = _RAD) -> float | None:
    """An angle whose sign is in the next field; without that letter it is unknown."""
    value, side = _number(f, k, 0.0, 180.0, factor), _text(f, k + 1)
    return None if value is None or side not in (plus, minus) else value if side == plus else -value


def _place(f: Fields, k: int, greatest: float, plus: str, minus: str) -> float | None:
    """Degrees and minutes of arc in one field, the hemisphere in the next [deg]."""
    found, side = _PLACE.fullmatch(_text(f, k)), _text(f, k + 1)
    if found is None or side not in (plus, minus) or float(found[2]) >= 60.0:
        return None
    degrees = int(found[1]) + float(found[2]) / 60.0
    return None if degrees > greatest else degrees if side == plus else -degrees


def _fix(f: Fields, k: int, valid: bool) -> dict[str, float | None]:
    latitude, longitude = _place(f, k, 90.0, "N", "S"), _place(f, k + 2, 180.0, "E", "W")
    whole = valid and latitude is not None and longitude is not None
    return {"latitude": _if(whole, latitude), "longitude": _if(whole, longitude)}


def _clock(f: Fields, k: int, valid: bool = True) -> dict[str, float | None]:
    """Time of the day of the fix [s]; that of a fix that is none goes by another name."""
    found = _CLOCK.fullmatch(_text(f, k))
    seconds = 3600 * int(found[1]) + 60 * int(found[2]) + float(found[3] + (found[4] or "")) if found else None
    return {"time_of_day" if valid else "time_of_none": seconds}


def _midnight(year: int, month: int, day: int) -> float | None:
    """Seconds since 1970 at 0 o'clock of a date; two digits of the year from 80 on are those of the last century."""
    full = year if year > 99 else year + (1900 if year >= 80 else 2000)
    try:
        return (date(full, month, day) - date(1970, 1, 1)).days * 86400.0
    except ValueError:  # the 31st of a month that has none
        return None


def _day(text: str) -> float | None:
    found = _DAY.fullmatch(text)
    return _midnight(int(found[3]), int(found[2]), int(found[1])) if found else None


def _rmc(f: Fields) -> _Found:
    valid = _text(f, 1) == "A" and _text(f, 11) != "N"
    return {
        **_clock(f, 0, valid), **_fix(f, 2, valid), "day": _if(valid, _day(_text(f, 8))),
        "U_G": _if(valid, _number(f, 6, 0.0, 999.0, KNOT)), "gamma_G": _if(valid, _direction(f, 7)),
        "variation": _sided(f, 9, "E", "W"),
    }  # fmt: skip


def _gga(f: Fields) -> _Found:
    valid = _text(f, 5) not in ("", "0")
    return {**_clock(f, 0, valid), **_fix(f, 1, valid)}


def _gns(f: Fields) -> _Found:
    valid = bool(set(_text(f, 5)) - {"N"})
    return {**_clock(f, 0, valid), **_fix(f, 1, valid)}


def _gll(f: Fields) -> _Found:
    valid = _text(f, 5) in ("A", "") and _text(f, 6) != "N"
    return {**_clock(f, 4, valid), **_fix(f, 0, valid)}


def _zda(f: Fields) -> _Found:
    day, month, year = (_number(f, k, 1, 9999) for k in (1, 2, 3))
    known = day is not None and month is not None and year is not None
    return {**_clock(f, 0), "day": _midnight(int(year), int(month), int(day)) if known else None}  # type: ignore[arg-type]


def _vtg(f: Fields) -> _Found:
    old = _text(f, 1) != "T"  # four bare numbers: course true and magnetic, knots, km/h
    valid = old or _text(f, 8) != "N"
    knots, hours = (_number(f, k, 0.0, 999.0, factor) for k, factor in (((2, KNOT), (3, 1 / 3.6)) if old else
                                                                       ((4, KNOT), (6, 1 / 3.6))))  # fmt: skip
    return {"gamma_G": _if(valid, _direction(f, 0)), "U_G": _if(valid, hours if knots is None else knots)}


def _vbw(f: Fields) -> _Found:
    names = (("u_log_water", 0, 2), ("v_log_water", 1, 2), ("u_log", 3, 5), ("v_log", 4, 5), ("v_stern_water", 6, 7),
             ("v_stern", 8, 9))  # fmt: skip
    return {name: _if(_text(f, status) == "A", _number(f, k, -99.0, 99.0, KNOT)) for name, k, status in names}


def _vhw(f: Fields) -> _Found:
    knots, hours = _number(f, 4, -99.0, 99.0, KNOT), _number(f, 6, -200.0, 200.0, 1 / 3.6)
    return {"psi": _direction(f, 0), "psi_magnetic": _direction(f, 2), "u_log_water": hours if knots is None else knots}


def _hdg(f: Fields) -> _Found:
    sensor, deviation = _direction(f, 0), _sided(f, 1, "E", "W") or 0.0
    # true = sensor + deviation + variation, east positive
    return {"psi_magnetic": None if sensor is None else sensor + deviation, "variation": _sided(f, 3, "E", "W")}


def _mwv(f: Fields) -> _Found:
    valid = _text(f, 4) in ("A", "")
    speed, angle = _number(f, 2, 0.0, 999.0, _SPEEDS.get(_text(f, 3), math.nan)), _direction(f, 0)
    if not valid or speed is None or speed != speed or angle is None:
        return {}
    return _felt(_text(f, 1) == "R", speed, angle)


def _felt(apparent: bool, speed: float | None, angle: float | None) -> _Found:
    whole = speed is not None and angle is not None
    names = ("U_A", "gamma_A") if apparent else ("U_T", "gamma_T_bow")
    return dict(zip(names, (_if(whole, speed), _if(whole, angle)), strict=True))


def _beside(apparent: bool) -> Callable[[Fields], _Found]:
    """VWR and VWT: the angle to a side, and the speed in one of three units."""

    def read(f: Fields) -> _Found:
        speeds = [_number(f, k, 0.0, 999.0, factor) for k, factor in ((2, KNOT), (4, 1.0), (6, 1 / 3.6))]
        angle = _sided(f, 0, "R", "L")
        speed = next((one for one in speeds if one is not None), None)
        return _felt(apparent, speed, None if angle is None else angle % (2.0 * math.pi))

    return read


def _mwd(f: Fields) -> _Found:
    knots, metres, angle = _number(f, 4, 0.0, 999.0, KNOT), _number(f, 6, 0.0, 999.0), _direction(f, 0)
    speed = knots if metres is None else metres
    whole = speed is not None and angle is not None
    return {"U_T_ground": _if(whole, speed), "gamma_T_ground": _if(whole, angle)}


def _dpt(f: Fields) -> _Found:
    depth, offset = _number(f, 0, 0.0, 12e3), _number(f, 1, -999.0, 999.0)
    # an offset below zero is the distance to the keel and does not locate the surface
    return {"depth": None if depth is None else depth + max(offset or 0.0, 0.0)}


def _dbt(f: Fields) -> _Found:
    metres, feet = _number(f, 2, 0.0, 12e3), _number(f, 0, 0.0, 4e4, _FOOT)
    return {"depth": feet if metres is None else metres}


_TURNED = MappingProxyType({
    "RUDDER": "delta", "HEEL": "phi", "ROLL": "phi", "TRIM": "theta", "PTCH": "theta", "PITCH": "theta",
})  # fmt: skip


def _xdr(f: Fields) -> _Found:
    """Groups of type, value, unit and name; an angle in degrees under a name that is known, whatever stands around."""
    found: dict[str, float | None] = {}
    for k in range(0, len(f) - 3, 4):
        kind, unit, name = f[k], f[k + 2], f[k + 3].upper()
        meant = next((quantity for word, quantity in _TURNED.items() if word in name), None)
        if kind == "A" and unit == "D" and meant:
            found[meant] = _number(f, k + 1, -180.0, 180.0, _RAD)
    return found


def _rpm(f: Fields) -> _Found:
    number = _number(f, 1, 0, 99)
    shaft = "E" if _text(f, 0) == "E" else "S"
    valid = number is not None and _text(f, 4) in ("A", "")
    return {} if number is None else {f"rpm_{shaft}_{int(number)}": _if(valid, _number(f, 2, -99999.0, 99999.0))}


def _pair(*names: str) -> Callable[[Fields], _Found]:
    """RSA and ROR: starboard or only, status, port, status; one that is never valid is not there."""
    return lambda f: {name: _if(_text(f, 2 * k + 1) == "A", _number(f, 2 * k, -180.0, 180.0, _RAD))
                      for k, name in enumerate(names)}  # fmt: skip


def _attitude(psi: float | None, phi: float | None, theta: float | None, valid: bool = True) -> _Found:
    return {"psi": _if(valid, psi), "phi": _if(valid, phi), "theta": _if(valid, theta)}


def _angle(f: Fields, k: int) -> float | None:
    return _number(f, k, -180.0, 180.0, _RAD)


def _pashr(f: Fields) -> _Found:
    if _text(f, 2) != "T":  # ATT, POS, SAT and others under the same address
        return {}
    valid = _text(f, 9) != "0"
    return {**_clock(f, 0, valid), **_attitude(_direction(f, 1), _angle(f, 3), _angle(f, 4), valid)}


def _psxn(f: Fields) -> _Found:
    return _attitude(_direction(f, 3), _angle(f, 1), _angle(f, 2)) if _text(f, 0) == "23" else {}


def _pssn(f: Fields) -> _Found:
    if _text(f, 0) != "HRP":
        return {}
    valid = _text(f, 10) != "0"
    return {**_clock(f, 1, valid), "day": _day(_text(f, 2)),
            **_attitude(_direction(f, 3), _angle(f, 4), _angle(f, 5), valid)}  # fmt: skip


def _ptnl(f: Fields) -> _Found:
    if _text(f, 0) != "AVR":
        return {}
    valid = _text(f, 9) != "0"
    return {**_clock(f, 1, valid), "psi": _if(valid, _direction(f, 2))}


def _psat(f: Fields) -> _Found:
    if _text(f, 0) != "HPR":
        return {}
    return {**_clock(f, 1), **_attitude(_direction(f, 2), _angle(f, 4), _angle(f, 3))}


_READ: Mapping[str, Callable[[Fields], _Found]] = MappingProxyType({
    "RMC": _rmc, "GGA": _gga, "GNS": _gns, "GLL": _gll, "ZDA": _zda, "VTG": _vtg, "VBW": _vbw, "VHW": _vhw,
    "HDT": lambda f: {"psi": _direction(f, 0)},
    "THS": lambda f: {"psi": _if(_text(f, 1) != "V", _direction(f, 0))},
    "HDM": lambda f: {"psi_magnetic": _direction(f, 0)}, "HDG": _hdg,
    "ROT": lambda f: {"r": _if(_text(f, 1) in ("A", ""), _number(f, 0, -9999.0, 9999.0, _RAD / 60.0))},
    "RSA": _pair("delta", "delta_port"), "ROR": _pair("delta_cmd", "delta_port_cmd"), "RPM": _rpm, "XDR": _xdr,
    "MWV": _mwv, "VWR": _beside(True), "VWT": _beside(False), "MWD": _mwd, "DPT": _dpt, "DBT": _dbt,
    "PASHR": _pashr, "PSXN": _psxn, "PSSN": _pssn, "PTNL": _ptnl, "PSAT": _psat,
    "PRDID": lambda f: _attitude(_direction(f, 2), _angle(f, 1), _angle(f, 0)),
})  # fmt: skip

KINDS = tuple(_READ)
"""Sentences that readings are taken from."""


def readings(heard: Heard) -> dict[str, float]:
    """Readings of a sentence, in SI and radians; empty and invalid fields are left out.

    Names beyond those of a trial: latitude, longitude [deg]; psi_magnetic, of a compass whose deviation is applied, and
    variation, east positive; u_log, v_log, v_stern and the same with _water; gamma_T_bow, true wind from the bow, and
    U_T_ground, gamma_T_ground, against north; delta_port; rpm_S_<number> of a shaft and rpm_E_<number> of an engine;
    time_of_day of a fix, time_of_none of one that is none, and day, the midnight before it since 1970 [s]; depth from
    the surface, or from the transducer where the log does not say where that is.
    """
    reader = _READ.get(heard.kind)
    return {name: value for name, value in reader(heard.fields).items() if value is not None} if reader else {}
