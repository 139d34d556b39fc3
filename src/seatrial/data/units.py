"""Units of logs, and their conversion to SI.

One table: symbol -> (SI symbol, factor).  Only temperature would need an offset; it is not converted,
as no function here computes with it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from types import MappingProxyType

from ..core.constants import KNOT, MILE
from ..core.parameters import unknown
from . import UNITS, DataError

_DEG = math.pi / 180.0

KNOWN: Mapping[str, tuple[str, float]] = MappingProxyType({
    "s": ("s", 1.0), "ms": ("s", 1e-3), "us": ("s", 1e-6), "ns": ("s", 1e-9), "min": ("s", 60.0),
    "h": ("s", 3600.0), "d": ("s", 86400.0),
    "m": ("m", 1.0), "mm": ("m", 1e-3), "cm": ("m", 1e-2), "km": ("m", 1e3), "NM": ("m", MILE),
    "nmi": ("m", MILE), "ft": ("m", 0.3048), "yd": ("m", 0.9144),
    "rad": ("rad", 1.0), "deg": ("rad", _DEG), "°": ("rad", _DEG), "mrad": ("rad", 1e-3), "cdeg": ("rad", 1e-2 * _DEG),
    "gon": ("rad", math.pi / 200.0), "mil": ("rad", math.pi / 3200.0),
    "m/s": ("m/s", 1.0), "cm/s": ("m/s", 1e-2), "mm/s": ("m/s", 1e-3), "ft/s": ("m/s", 0.3048),
    "mph": ("m/s", 0.44704), "km/h": ("m/s", 1 / 3.6), "kn": ("m/s", KNOT), "0.1 kn": ("m/s", 0.1 * KNOT),
    "kt": ("m/s", KNOT), "kts": ("m/s", KNOT), "knot": ("m/s", KNOT), "knots": ("m/s", KNOT),
    "rad/s": ("rad/s", 1.0), "deg/s": ("rad/s", _DEG), "°/s": ("rad/s", _DEG),
    "deg/min": ("rad/s", _DEG / 60.0), "rad/min": ("rad/s", 1 / 60.0),
    "1/s": ("1/s", 1.0), "rps": ("1/s", 1.0), "Hz": ("1/s", 1.0), "rpm": ("1/s", 1 / 60.0),
    "1/min": ("1/s", 1 / 60.0),
    "m/s^2": ("m/s^2", 1.0), "m/s2": ("m/s^2", 1.0), "rad/s^2": ("rad/s^2", 1.0),
    "deg/s^2": ("rad/s^2", _DEG),
    "N": ("N", 1.0), "kN": ("N", 1e3), "MN": ("N", 1e6),
    "N m": ("N m", 1.0), "Nm": ("N m", 1.0), "N*m": ("N m", 1.0), "kN m": ("N m", 1e3), "kNm": ("N m", 1e3),
    "W": ("W", 1.0), "kW": ("W", 1e3), "MW": ("W", 1e6), "V": ("V", 1.0), "A": ("A", 1.0),
    "Pa": ("Pa", 1.0), "kPa": ("Pa", 1e3), "hPa": ("Pa", 1e2), "bar": ("Pa", 1e5),
    "kg": ("kg", 1.0), "t": ("kg", 1e3), "kg/m^3": ("kg/m^3", 1.0), "kg/m3": ("kg/m^3", 1.0),
    "degC": ("degC", 1.0), "°C": ("degC", 1.0),
    "-": ("-", 1.0), "1": ("-", 1.0), "%": ("-", 1e-2),
})  # fmt: skip
"""Unit symbols that a header may name: the SI symbol and the factor to it."""

# First parts of the names of a thruster's channels (docs/conventions.md), such as n_1, alpha_bow, f_2.
UNIT_OF_THRUSTERS = {"n": "1/s", "alpha": "rad", "f": "N", "throttle": "-", "X": "N", "Y": "N", "N": "N m"}
# Units that they cannot have; other units are accepted, as other names begin alike (n_satellites).
_SPEEDS = ("m/s", "rad", "rad/s")
_NEVER = {"n": _SPEEDS, "alpha": ("m/s", "1/s", "rad/s"), "throttle": ("1/s", *_SPEEDS)}
_DERIVED = re.compile(r"_(sd|cmd|\d+)$")


def standard_unit(name: str) -> str | None:
    """SI unit of a standard channel; None for a name without a fixed meaning.

    `delta_1`, `n_P_2_cmd` and `x_sd` have the unit of their stem.
    """
    while name not in UNITS:
        stem = _DERIVED.sub("", name)
        if stem == name:
            return None
        name = stem
    return UNITS[name]


def of_thruster(name: str) -> bool:
    """Whether a channel is that of a thruster with a number, such as `n_1` or `alpha_2_cmd`."""
    stem, _, number = re.sub(r"_(cmd|sd)$", "", name).partition("_")
    return stem in UNIT_OF_THRUSTERS and number.isdigit()


def conversion(name: str, unit: str) -> tuple[str, float]:
    """Unit a channel is kept in, and the factor to it.

    Standard channels come out in SI, and so do channels named like those of thrusters (`n_1`, `alpha_1`)
    whose unit is of that kind.  Others keep their unit: no function here computes with them, and
    they are written back unchanged.

    Raises:
        DataError: an unknown unit, or one that cannot measure this channel.
    """
    if unit not in KNOWN:
        raise DataError(f"column '{name}': {unknown(unit, KNOWN, 'unit')}")
    wanted = standard_unit(name)
    if wanted is None:
        stem, named, _ = name.partition("_")
        if named and KNOWN[unit][0] in _NEVER.get(stem, ()):
            raise DataError(f"column '{name}': unit '{unit}' cannot measure it; it is in {UNIT_OF_THRUSTERS[stem]}")
        return KNOWN[unit] if named and KNOWN[unit][0] == UNIT_OF_THRUSTERS.get(stem) else (unit, 1.0)
    si, factor = KNOWN[unit]
    if si != wanted:
        fitting = ", ".join(symbol for symbol, (to, _) in KNOWN.items() if to == wanted)
        raise DataError(f"column '{name}': unit '{unit}' cannot measure it; right would be one of: {fitting}")
    return si, factor
