"""Metacentric height, roll inertia and roll period from particulars.

The formulas of KB and BM are from memory of textbooks (Morrish 1892; Schneekluth) and were not looked up; on the two
published ships that roll (tests/ships/formulas/test_stability.py) KB is within 6 % and BM within 13 %, so GM, a small
difference of large numbers, is half a metre off: take it from the stability book, an inclining test or a measured roll
period.
"""

from __future__ import annotations

import math

# That of `models/rolling`, so that the period of the restoring arm made here is the one asked for.
GRAVITY = 9.81


def waterplane(C_b: float) -> float:
    """Coefficient of the water plane (1 + 2 C_b)/3."""
    return (1.0 + 2.0 * C_b) / 3.0


def centre_of_buoyancy(d: float, C_b: float, C_w: float | None = None) -> float:
    """KB = d (5/6 - C_b/(3 C_w)) above the keel [m] (Morrish)."""
    return d * (5.0 / 6.0 - C_b / (3.0 * (C_w or waterplane(C_b))))


def metacentric_radius(B: float, d: float, C_b: float, C_w: float | None = None) -> float:
    """BM = I_T/volume [m], I_T = (0.1216 C_w - 0.0410) L B^3."""
    return (0.1216 * (C_w or waterplane(C_b)) - 0.0410) * B * B / (d * C_b)


def metacentric_height(B: float, d: float, C_b: float, KG: float, C_w: float | None = None) -> float:
    """GM = KB + BM - KG [m]; KG above the keel."""
    return centre_of_buoyancy(d, C_b, C_w) + metacentric_radius(B, d, C_b, C_w) - KG


def period(B: float, d: float, L_WL: float, GM: float) -> float:
    """Natural roll period T = 2 C B/sqrt(GM), C = 0.373 + 0.023 B/d - 0.043 L_WL/100 [s].

    That of the IS Code as several unrelated programs have it; the Code itself was not opened.  It was made for merchant
    ships: of the naval ship of the library it is a quarter too long.
    """
    return 2.0 * _constant(B, d, L_WL) * B / math.sqrt(GM)


def height_by_period(B: float, d: float, L_WL: float, T: float) -> float:
    """GM [m] that belongs to a measured roll period [s]."""
    return (2.0 * _constant(B, d, L_WL) * B / T) ** 2


def inertia(m: float, B: float, d: float, L_WL: float) -> float:
    """Moment of inertia in roll, added one included [kg m^2]: that with which `period` holds, whatever GM."""
    return m * GRAVITY * (_constant(B, d, L_WL) * B / math.pi) ** 2


def _constant(B: float, d: float, L_WL: float) -> float:
    return 0.373 + 0.023 * B / d - 0.043 * L_WL / 100.0
