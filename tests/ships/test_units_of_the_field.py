"""Factors from units of the field to those used inside, from what each unit is."""

from __future__ import annotations

import math
import re

import pytest

from seatrial.ships.numbers import FACTORS, PARTICULARS

# One of each in SI; revolutions and angles are counted as 1/s and rad.
BASE = {
    "deg": math.pi / 180, "rad": 1.0, "rpm": 1 / 60, "rps": 1.0, "kn": 1852 / 3600, "kt": 1852 / 3600, "min": 60.0,
    "h": 3600.0, "mm": 0.001, "cm": 0.01, "km": 1000.0, "m": 1.0, "s": 1.0, "N": 1.0, "kN": 1e3, "MN": 1e6, "t": 1e3,
    "kg": 1.0, "1": 1.0, "Hz": 1.0, "g": 0.001, "W": 1.0, "kW": 1e3, "MW": 1e6,
}  # fmt: skip


def size(unit: str) -> float:
    """What one of a unit such as ``t m^2`` or ``s^2/deg^2`` is in SI."""
    above, _, below = unit.partition("/")
    found = 1.0
    for part, sign in ((above, 1), (below, -1)):
        for word in part.split():
            name, power = re.fullmatch(r"([A-Za-z]+|1)(?:\^(\d))?", word).groups()  # type: ignore[union-attr]
            found *= BASE[name] ** (sign * int(power or 1))
    return found


@pytest.mark.parametrize(("of", "to"), FACTORS)
def test_a_factor_is_that_of_the_units(of: str, to: str) -> None:
    assert FACTORS[of, to] == pytest.approx(size(of) / size(to), rel=1e-12)


def test_particulars_have_the_ranges_of_ships_and_their_models() -> None:
    ranges = {name: (one.unit, one.low, one.high) for name, one in PARTICULARS.items()}
    assert ranges == {
        "rho": ("kg/m^3", 500.0, 2000.0), "L_pp": ("m", 1e-3, 1e3), "B": ("m", 1e-3, 1e3), "d": ("m", 1e-4, 100.0),
        "C_b": ("", 0.0, 1.0), "volume": ("m^3", 0.0, math.inf),
    }  # fmt: skip
