"""Readings from sentences, in SI and the signs of docs/conventions.md; `ship` has the table of units and signs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from datetime import date
from types import MappingProxyType

from .sentences import Sentence
from .ship import KNOT

_SPEEDS = MappingProxyType({"K": 1.0 / 3.6, "M": 1.0, "N": KNOT})
_RAD = math.pi / 180.0


def _good(sentence: Sentence, name: str, status: str | None = None, factor: float = 1.0) -> float | None:
    """A number times a factor; None where it is null or its status is not valid."""
    value = sentence.number(name)
    return None if value is None or (status and sentence[status] != "A") else value * factor


def readings(sentence: Sentence) -> dict[str, float]:
    """Readings of a sentence, in SI and radians; null and invalid fields are left out.

    Names beyond those of a trial: latitude, longitude [deg]; u_log, v_log, v_stern and the same with _water;
    gamma_T_bow, true wind from the bow; delta_port; rpm_S_<number> of a shaft and rpm_E_<number> of an
    engine; time_of_day and day, the midnight before it since 1970 [s]; depth is from the surface.
    """
    reader = _READ.get(sentence.kind)
    found = reader(sentence) if reader else {}
    return {name: value for name, value in found.items() if value is not None}


def _speeds(s: Sentence) -> dict[str, float | None]:
    return {
        "u_log_water": _good(s, "longwaterspd", "waterspdstatus", KNOT),
        "v_log_water": _good(s, "transwaterspd", "waterspdstatus", KNOT),
        "u_log": _good(s, "longgroundspd", "groundspdstatus", KNOT),
        "v_log": _good(s, "transgroundspd", "groundspdstatus", KNOT),
        "v_stern_water": _good(s, "sterntranswaterspd", "sternwaterspdstatus", KNOT),
        "v_stern": _good(s, "sterntransgroundspd", "sterngroundspdstatus", KNOT),
    }


def _midnight(day: object) -> float | None:
    """Seconds since 1970 at 0 o'clock of a date."""
    return (day - date(1970, 1, 1)).days * 86400.0 if isinstance(day, date) else None


def _date(s: Sentence) -> dict[str, float | None]:
    day, month, year = (s.number(name) for name in ("day", "month", "year"))
    try:
        day_of = None if day is None or month is None or year is None else date(int(year), int(month), int(day))
    except ValueError:  # the 31st of a month that has none
        day_of = None
    return {"time_of_day": s.number("time"), "day": _midnight(day_of)}


def _minimum(s: Sentence) -> dict[str, float | None]:
    if s["status"] != "A" or s["posMode"] == "N":
        return {"time_of_day": s.number("time")}
    return {"time_of_day": s.number("time"), "day": _midnight(s["date"]), "latitude": s.number("lat"),
            "longitude": s.number("lon"), "U_G": _good(s, "spd", None, KNOT),
            "gamma_G": _good(s, "cog", None, _RAD)}  # fmt: skip


def _fix(s: Sentence) -> dict[str, float | None]:
    fixed = s["quality"] not in (0, None)
    return {"time_of_day": s.number("time"), "latitude": s.number("lat") if fixed else None,
            "longitude": s.number("lon") if fixed else None}  # fmt: skip


def _wind(s: Sentence) -> dict[str, float | None]:
    speed = _good(s, "speed", "status", _SPEEDS.get(str(s["speedu"]), math.nan))
    angle = _good(s, "angle", "status", _RAD)
    if speed is None or speed != speed or angle is None:
        return {}
    return {"U_A": speed, "gamma_A": angle} if s["reference"] == "R" else {"U_T": speed, "gamma_T_bow": angle}


def _depth(s: Sentence) -> dict[str, float | None]:
    depth, offset = s.number("depth"), s.number("offset")
    # an offset below zero is the distance to the keel and does not locate the surface
    return {"depth": None if depth is None else depth + max(offset or 0.0, 0.0)}


_READ: Mapping[str, Callable[[Sentence], Mapping[str, float | None]]] = MappingProxyType({
    "HDT": lambda s: {"psi": _good(s, "headingT", None, _RAD)},
    "THS": lambda s: {"psi": None if s["mi"] == "V" else _good(s, "headt", None, _RAD)},
    "ROT": lambda s: {"r": _good(s, "rot", "valid", _RAD / 60.0)},
    "VBW": _speeds,
    "VTG": lambda s: {"gamma_G": _good(s, "cogt", None, _RAD), "U_G": _good(s, "sogn", None, KNOT)},
    "RMC": _minimum,
    "GGA": _fix,
    "ZDA": _date,
    "RSA": lambda s: {"delta": _good(s, "stbdangle", "stbdstatus", _RAD),
                      "delta_port": _good(s, "portangle", "portstatus", _RAD)},
    "RPM": lambda s: {f"rpm_{'E' if s['source'] == 'E' else 'S'}_{s['engineshaftnum']}": _good(s, "rpm", "status")},
    "MWV": _wind,
    "DPT": _depth,
    "ROR": lambda s: {"delta_cmd": _good(s, "stbdrudderorder", "stbdrudderstatus", _RAD),
                      "delta_port_cmd": _good(s, "portrudderorder", "portrudderstatus", _RAD)},
})  # fmt: skip
