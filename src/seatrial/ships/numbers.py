"""One number of a ship file: `{value | prime, unit, source, sigma}`, checked and made dimensional."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.constants import KNOT
from ..core.files import read_toml
from ..core.kinds import wrong_kind
from ..core.parameters import PRIME, Spec, unknown
from ..core.values import dataclass
from . import Entry, ShipError

_ABSURD = 1e16
# Primed numbers are of order one or below; beyond stands one that was printed times 1e5, or with a unit.
_PRIME_LIMIT = 1e4
KEYS = ("value", "prime", "unit", "source", "sigma")
FACTORS = {
    ("deg", "rad"): math.pi / 180.0, ("deg/s", "rad/s"): math.pi / 180.0,
    ("rpm", "1/s"): 1.0 / 60.0, ("rps", "1/s"): 1.0,
    ("kn", "m/s"): KNOT, ("km/h", "m/s"): 1.0 / 3.6,
    ("mm", "m"): 1e-3, ("cm", "m"): 1e-2, ("km", "m"): 1e3,
    ("kN", "N"): 1e3, ("MN", "N"): 1e6, ("kN m", "N m"): 1e3,
    ("rpm/s", "1/s^2"): 1.0 / 60.0, ("rps/s", "1/s^2"): 1.0,
    ("t", "kg"): 1e3, ("t/m^3", "kg/m^3"): 1e3, ("t m^2", "kg m^2"): 1e3, ("min", "s"): 60.0,
    ("s^2/deg^2", "s^2"): (180.0 / math.pi) ** 2,
}  # fmt: skip
"""Factor from a unit of the field to the one used inside."""

PARTICULARS = {
    "rho": Spec("kg/m^3", "density of the water", 500.0, 2000.0),
    "L_pp": Spec("m", "length between perpendiculars", 1e-3, 1e3),
    "B": Spec("m", "breadth", 1e-3, 1e3),
    "d": Spec("m", "draught", 1e-4, 100.0),
    "C_b": Spec("", "block coefficient", 0.0, 1.0),
    "volume": Spec("m^3", "displaced volume", 0.0),
}
"""Particulars of a ship with unit, meaning and the range beyond which a value is a mistake."""


def read_document(path: Path, schema: str) -> dict[str, Any]:
    """The TOML document of a file of this schema.

    Raises:
        ShipError: it cannot be read, or has another schema.
    """
    try:
        document = read_toml(path)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ShipError(f"{path}: cannot be read as TOML: {error}") from None
    if document.get("schema") != schema:
        raise ShipError(wrong_kind(path, document.get("schema"), schema))
    return document


@dataclass(frozen=True)
class Yardsticks:
    """What makes a primed number dimensional: 0.5 rho L d for a mass, 0.5 rho L^4 d for an inertia."""

    rho: float = math.nan
    L_pp: float = math.nan
    d: float = math.nan

    def factor(self, unit: str) -> float:
        """Value of one primed unit; NaN where it is not defined."""
        if unit == PRIME:
            return 1.0
        mass = 0.5 * self.rho * self.L_pp * self.L_pp * self.d
        return {
            "m": self.L_pp, "m^2": self.L_pp * self.d, "kg": mass, "kg m^2": mass * self.L_pp * self.L_pp
        }.get(unit, math.nan)  # fmt: skip


def number(
    table: Any, meaning: Spec, where: str, scale: Yardsticks | None = None, *, bounded: bool = True
) -> tuple[float, Entry]:
    """Value in the unit of `meaning`, and its provenance; `where` names the file and the key."""
    if not isinstance(table, Mapping):
        raise ShipError(f"{where}: a number is written {{ value = ..., source = ... }}")
    for key in table:
        if key not in KEYS:
            raise ShipError(f"{where}: {unknown(key, KEYS, 'key')}")
    if ("value" in table) == ("prime" in table):
        raise ShipError(f"{where}: give either value or prime" + (", not both" if "value" in table else ""))
    entry = _entry(table, where)
    if not entry.prime and not entry.unit and meaning.unit not in ("", "-", PRIME):
        raise ShipError(f'{where}: no unit; say in what the number is given (unit = "{meaning.unit}", ...)')
    found = resolve(entry, meaning.unit, scale)
    if found is None:
        raise ShipError(f"{where}: {_unusable(entry, meaning, scale)}")
    if entry.prime and abs(entry.given) > _PRIME_LIMIT:
        raise ShipError(f"{where}: {entry.given:g}' is no primed number of a ship; it is below {_PRIME_LIMIT:g}")
    if bounded and not meaning.low <= found <= meaning.high:
        raise ShipError(
            f"{where}: {found:g} {meaning.unit} is outside the physical range "
            f"[{meaning.low:g}, {meaning.high:g}] of the {meaning.about}"
        )
    return found, entry


def resolve(entry: Entry, unit: str, scale: Yardsticks | None) -> float | None:
    """The number of an entry in `unit`; None where the conversion does not exist."""
    if entry.prime:
        factor = 1.0 if unit == PRIME else (scale or Yardsticks()).factor(unit)
        return None if math.isnan(factor) else entry.given * factor
    if entry.unit in ("", unit):
        return entry.given
    factor = FACTORS.get((entry.unit, unit))
    return None if factor is None else entry.given * factor


def _entry(table: Mapping[str, Any], where: str) -> Entry:
    source, unit = table.get("source"), table.get("unit", "")
    if "prime" in table and unit:
        raise ShipError(f"{where}: a primed number has no unit; give value with '{unit}', or leave the unit out")
    if not isinstance(source, str) or not source.strip():
        raise ShipError(f"{where}: no source; say where the number comes from (source = ...)")
    if not isinstance(unit, str):
        raise ShipError(f"{where}: unit is not a text")
    given = _finite(table.get("value", table.get("prime")), where)
    sigma = None if "sigma" not in table else _finite(table["sigma"], f"{where}.sigma")
    if sigma is not None and sigma < 0:
        raise ShipError(f"{where}.sigma: {sigma:g}; a standard uncertainty is zero or above")
    return Entry(source=source, given=given, prime="prime" in table, unit=unit, sigma=sigma)


def _finite(raw: Any, where: str) -> float:
    if isinstance(raw, bool) or not isinstance(raw, int | float):
        raise ShipError(f"{where}: {raw!r} is not a number")
    if not math.isfinite(raw):
        raise ShipError(f"{where}: {raw} is not finite")
    if abs(raw) > _ABSURD:
        raise ShipError(f"{where}: {raw:g} is no number of a ship; it is below {_ABSURD:g}")
    return float(raw)


def _unusable(entry: Entry, meaning: Spec, scale: Yardsticks | None) -> str:
    inside = meaning.unit or "dimensionless"
    if not entry.prime:
        known = [a for a, b in FACTORS if b == meaning.unit]
        return f"unit '{entry.unit}' for a number in {inside}; known: {', '.join([inside, *known])}"
    if math.isnan((scale or Yardsticks(1.0, 1.0, 1.0)).factor(meaning.unit)):
        return f"a number in {inside} cannot be primed; give value"
    return "a primed number needs rho, L_pp and d with value in [body] or [particulars]"
