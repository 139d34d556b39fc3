"""Every unit that a log may name against its definition."""

from __future__ import annotations

import math

import pytest

from seatrial.data import DataError
from seatrial.data.units import KNOWN, conversion, standard_unit

MILE, FOOT, TURN, MINUTE, HOUR = 1852.0, 0.3048, 2 * math.pi, 60.0, 3600.0
# so many of the unit are so much in SI
DEFINED = {
    "s": (1, 1), "ms": (1000, 1), "us": (1_000_000, 1), "ns": (1_000_000_000, 1), "min": (1, MINUTE),
    "h": (1, HOUR), "d": (1, 24 * HOUR),
    "m": (1, 1), "mm": (1000, 1), "cm": (100, 1), "km": (1, 1000), "NM": (1, MILE), "nmi": (1, MILE), "ft": (1, FOOT),
    "yd": (1, 3 * FOOT), "rad": (1, 1), "deg": (360, TURN), "°": (360, TURN), "cdeg": (36_000, TURN), "mrad": (1000, 1),
    "gon": (400, TURN), "mil": (6400, TURN), "ft/s": (1, FOOT), "mph": (HOUR, 5280 * FOOT),
    "m/s": (1, 1), "mm/s": (1000, 1), "cm/s": (100, 1), "km/h": (HOUR, 1000), "kn": (HOUR, MILE), "kt": (HOUR, MILE),
    "0.1 kn": (10 * HOUR, MILE),
    "kts": (HOUR, MILE),
    "knot": (HOUR, MILE), "knots": (HOUR, MILE),
    "rad/s": (1, 1), "deg/s": (360, TURN), "°/s": (360, TURN), "deg/min": (360 * MINUTE, TURN), "rad/min": (MINUTE, 1),
    "1/s": (1, 1), "rps": (1, 1), "Hz": (1, 1), "rpm": (MINUTE, 1), "1/min": (MINUTE, 1),
    "m/s^2": (1, 1), "m/s2": (1, 1), "rad/s^2": (1, 1), "deg/s^2": (360, TURN),
    "N": (1, 1), "kN": (1, 1e3), "MN": (1, 1e6), "N m": (1, 1), "Nm": (1, 1), "N*m": (1, 1), "kN m": (1, 1e3),
    "kNm": (1, 1e3), "W": (1, 1), "kW": (1, 1e3), "MW": (1, 1e6), "V": (1, 1), "A": (1, 1),
    "Pa": (1, 1), "kPa": (1, 1e3), "hPa": (1, 1e2), "bar": (1, 1e5),
    "kg": (1, 1), "t": (1, 1e3), "kg/m^3": (1, 1), "kg/m3": (1, 1), "degC": (1, 1), "°C": (1, 1),
    "-": (1, 1), "1": (1, 1), "%": (100, 1),
}  # fmt: skip


def test_each_unit_is_as_it_is_defined() -> None:
    assert set(DEFINED) == set(KNOWN)
    for symbol, (count, si) in DEFINED.items():
        assert count * KNOWN[symbol][1] == pytest.approx(si, rel=1e-12), symbol


def test_a_rate_of_turn_indicator_in_degrees_per_minute() -> None:
    """A ship that turns at 30 deg/min has gone once round in twelve minutes."""
    si, factor = conversion("r", "deg/min")
    assert si == "rad/s"
    assert 30.0 * factor * 12 * 60 == pytest.approx(TURN)


def test_one_kind_of_quantity_has_one_standard_unit() -> None:
    """What a unit measures is what its SI unit says: lengths in m, rates in rad/s."""
    for name, good, bad in (("r", "deg/min", "deg"), ("n_P", "rpm", "deg/s"), ("u", "kn", "NM"), ("delta", "deg", "%")):
        assert conversion(name, good)[0] == standard_unit(name)
        with pytest.raises(DataError, match="cannot measure it"):
            conversion(name, bad)
