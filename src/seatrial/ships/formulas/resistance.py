"""Resistance, wake and thrust deduction by Holtrop's statistics of model tests and trials."""

from __future__ import annotations

import math
from dataclasses import replace

from . import Formula, Particulars

SHIPS_BEGIN = 30.0
"""Length [m] below which a hull counts as a smooth model without correlation allowance."""


def prismatic(ship: Particulars) -> float:
    """Prismatic coefficient C_b/C_m, kept below one."""
    return min(ship.C_b / ship.C_m, 0.95)


def wetted_surface(ship: Particulars) -> float:
    """Wetted surface [m^2] by Denny and Mumford: 1.7 L d + volume/d."""
    return 1.7 * ship.L_pp * ship.d + ship.volume / ship.d


def centre(ship: Particulars) -> float:
    """Longitudinal centre of buoyancy ahead of midship in per cent of the length; x_G on even keel."""
    return 100.0 * ship.x_G / ship.L_pp


def form_factor(ship: Particulars) -> float:
    """1 + k_1 of Holtrop 1984, normal stern."""
    L, C_p = ship.L_pp, prismatic(ship)
    run = 1 - C_p + 0.06 * C_p * centre(ship) / (4 * C_p - 1)
    return 0.93 + 0.487118 * (
        (ship.B / L) ** 1.06806 * (ship.d / L) ** 0.46106 * max(run, 0.02) ** -0.121563
        * (L**3 / ship.volume) ** 0.36486 * (1 - C_p) ** -0.604247
    )  # fmt: skip


def viscous(ship: Particulars) -> float:
    """(1 + k_1) C_F of ITTC 1957 plus, for a ship, the correlation allowance of Holtrop 1982 without bulb."""
    friction = 0.075 / (math.log10(ship.speed * ship.L_pp / ship.nu) - 2.0) ** 2
    allowance = 0.0
    if ship.L_pp >= SHIPS_BEGIN:
        shallow = 0.04 - min(ship.d / ship.L_pp, 0.04)
        allowance = 0.006 * (ship.L_pp + 100) ** -0.16 - 0.00205
        allowance += 0.003 * math.sqrt(ship.L_pp / 7.5) * ship.C_b**4 * shallow
    return form_factor(ship) * friction + allowance


def resistance(ship: Particulars) -> dict[str, float]:
    """R_0 of the approach speed, waves left out."""
    return {"hull.R_0": viscous(ship) * wetted_surface(ship) / (ship.L_pp * ship.d)}


def thrust_deduction(ship: Particulars) -> dict[str, float]:
    """t_P of Holtrop 1984, single screw, normal stern."""
    if ship.screws != 1.0:
        return {}
    wide = (math.sqrt(ship.B * ship.d) / ship.D_P) ** 0.2624
    slack = max(1 - prismatic(ship) + 0.0225 * centre(ship), 0.02)
    return {"propeller.t_P": 0.25014 * (ship.B / ship.L_pp) ** 0.28956 * wide / slack**0.01762}


def wake(ship: Particulars) -> dict[str, float]:
    """w_P0 of Holtrop 1984, single screw, normal stern, even keel."""
    if ship.screws != 1.0:
        return {}
    L, B, d, C_p, S = ship.L_pp, ship.B, ship.d, prismatic(ship), wetted_surface(ship)
    c_8 = B * S / (L * ship.D_P * d)
    if B / d >= 5:
        c_8 = S * (7 * B / d - 25) / (L * ship.D_P * (B / d - 3))
    c_9 = c_8 if c_8 < 28 else 32 - 16 / (c_8 - 24)
    deep = d / ship.D_P
    c_11 = deep if deep < 2 else 0.0833333 * deep**3 + 1.33333
    if C_p < 0.7:
        c_19 = 0.12997 / (0.95 - ship.C_b) - 0.11056 / (0.95 - C_p)
    else:
        c_19 = 0.18567 / (1.3571 - ship.C_m) - 0.71276 + 0.38648 * C_p
    C_V, left = viscous(ship), max(1 - (1.45 * C_p - 0.315 - 0.0225 * centre(ship)), 0.02)
    first = c_9 * C_V * L / d * (0.050776 + 0.93405 * c_11 * C_V / left)
    return {"propeller.w_P0": first + 0.27915 * math.sqrt(B / (L * left)) + c_19}


def twin_thrust_deduction(ship: Particulars) -> dict[str, float]:
    """t_P of Holtrop and Mennen 1982 for each of two screws."""
    if ship.screws != 2.0:
        return {}
    return {"propeller.t_P": 0.325 * ship.C_b - 0.1885 * ship.D_P / math.sqrt(ship.B * ship.d)}


def twin_wake(ship: Particulars) -> dict[str, float]:
    """w_P0 of Holtrop and Mennen 1982 for each of two screws."""
    if ship.screws != 2.0:
        return {}
    slim = 0.23 * ship.D_P / math.sqrt(ship.B * ship.d)
    return {"propeller.w_P0": 0.3095 * ship.C_b + 10.0 * viscous(ship) * ship.C_b - slim}


_HOLTROP = {"L/B": (3.9, 9.5), "F_n": (0.05, 0.45)}
_BASIS = "envelope over the ship types of Holtrop's table, recalled, not read"
WAKE = Formula(
    name="Holtrop 1984", source="holtrop1984, single screw, normal stern, as in public codes",
    gives=wake, limits=_HOLTROP, basis=_BASIS,
)  # fmt: skip
TWIN_WAKE = Formula(
    name="Holtrop-Mennen 1982 (twin screws)", source="holtrop1982, twin screws, as in public codes; recalled, not read",
    gives=twin_wake, limits={"screws": (2.0, 2.0), **_HOLTROP}, basis=_BASIS,
)  # fmt: skip
FORMULAS = (
    Formula(
        name="ITTC 1957 + Holtrop 1984",
        source="ITTC 1957 friction, form factor of holtrop1984, wetted surface of Denny and Mumford, Holtrop's "
        "correlation allowance for ships above 30 m; wave resistance is left out, so a lower bound",
        gives=resistance, limits=_HOLTROP, basis=_BASIS,
    ),
    replace(WAKE, gives=thrust_deduction),
    replace(TWIN_WAKE, gives=twin_thrust_deduction),
)  # fmt: skip
