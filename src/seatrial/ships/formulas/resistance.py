"""Resistance, wake and thrust deduction by Holtrop's statistics of model tests and trials."""

from __future__ import annotations

import math
from dataclasses import replace

from ...core.constants import GRAVITY
from . import Formula, Limits, Particulars, table

SHIPS_BEGIN = 30.0
"""Length [m] below which a hull counts as a smooth model without correlation allowance."""
TUGS_END = 80.0
"""Length [m] of the longest ship of van Oortmerssen's data."""
_FASTEST_TUG = 0.5
_DISPLACEMENT = 1.01
"""His length L_D, half the sum of L_pp and that of the water line, over L_pp: an assumption."""
_OORTMERSSEN = tuple(tuple(float(row[f"c_{k}"]) for row in table("oortmerssen")) for k in (1, 2, 3, 4))


def prismatic(ship: Particulars) -> float:
    """Prismatic coefficient C_b/C_m, kept below one."""
    return min(ship.C_b / ship.C_m, 0.95)


def wetted_surface(ship: Particulars) -> float:
    """Wetted surface [m^2] of Holtrop and Mennen 1982, that of the bulb included."""
    B, d, C_b, C_m = ship.B, ship.d, ship.C_b, ship.C_m
    slender = 0.453 + 0.4425 * C_b - 0.2862 * C_m - 0.003467 * B / d + 0.3696 * ship.C_WP
    return ship.L_pp * (2 * d + B) * math.sqrt(C_m) * slender + 2.38 * ship.A_BT / C_b


def centre(ship: Particulars) -> float:
    """Longitudinal centre of buoyancy ahead of midship in per cent of the length; x_G on even keel."""
    return 100.0 * ship.x_G / ship.L_pp


def run(ship: Particulars) -> float:
    """Length of the run over that of the ship, kept above zero."""
    C_p = prismatic(ship)
    return max(1 - C_p + 0.06 * C_p * centre(ship) / (4 * C_p - 1), 0.02)


def form_factor(ship: Particulars) -> float:
    """1 + k_1 of Holtrop 1984, normal stern."""
    L, C_p = ship.L_pp, prismatic(ship)
    return 0.93 + 0.487118 * (
        (ship.B / L) ** 1.06806 * (ship.d / L) ** 0.46106 * run(ship) ** -0.121563
        * (L**3 / ship.volume) ** 0.36486 * (1 - C_p) ** -0.604247
    )  # fmt: skip


def friction(ship: Particulars) -> float:
    """C_F of ITTC 1957."""
    return 0.075 / (math.log10(ship.speed * ship.L_pp / ship.nu) - 2.0) ** 2


def viscous(ship: Particulars) -> float:
    """(1 + k_1) C_F plus, for a ship, the correlation allowance of Holtrop and Mennen 1982."""
    allowance = 0.0
    if ship.L_pp >= SHIPS_BEGIN:
        shallow = 0.04 - min(ship.d / ship.L_pp, 0.04)
        allowance = 0.006 * (ship.L_pp + 100) ** -0.16 - 0.00205
        allowance += 0.003 * math.sqrt(ship.L_pp / 7.5) * ship.C_b**4 * bulb(ship) * shallow
    return form_factor(ship) * friction(ship) + allowance


def bulb(ship: Particulars) -> float:
    """c_2: how much a bulb takes off the waves."""
    if not ship.A_BT:
        return 1.0
    width = math.sqrt(ship.A_BT)
    return math.exp(-1.89 * math.sqrt(0.56 * width**3 / (ship.B * ship.d * (0.31 * width + ship.d - ship.h_B))))


def entrance(ship: Particulars) -> float:
    """Half angle of entrance of the water line [rad], Holtrop and Mennen 1982; for one that is not given."""
    C_p, L, B = prismatic(ship), ship.L_pp, ship.B
    fine = max(1 - C_p - 0.0225 * centre(ship), 0.02)
    power = (
        (L / B) ** 0.80856 * (1 - ship.C_WP) ** 0.30484 * fine**0.6367 * (L * run(ship) / B) ** 0.34574
        * (100 * ship.volume / L**3) ** 0.16302
    )  # fmt: skip
    return math.radians(1 + 89 * math.exp(-power))


def waves(ship: Particulars) -> float:
    """Wave resistance over the weight rho g volume: Holtrop 1984, between Froude numbers .4 and .55 a straight line."""
    F_n = ship.ratios["F_n"]
    if F_n <= 0.4:
        return _slow(ship, F_n)
    low, high = _slow(ship, 0.4), _fast(ship, 0.55)
    return _fast(ship, F_n) if F_n >= 0.55 else low + (10 * F_n - 4) / 1.5 * (high - low)


def _slow(ship: Particulars, F_n: float) -> float:
    """R_W-A of Holtrop 1984: that of Holtrop and Mennen 1982 with another decay of the humps."""
    L, B, d, C_p = ship.L_pp, ship.B, ship.d, prismatic(ship)
    c_7 = B / L if 0.11 < B / L <= 0.25 else 0.229577 * (B / L) ** 0.33333 if B / L <= 0.11 else 0.5 - 0.0625 * L / B
    half = math.degrees(ship.i_E or entrance(ship))
    c_1 = 2223105 * c_7**3.78613 * (d / B) ** 1.07961 * (90 - half) ** -1.37565
    c_16 = 8.07981 * C_p - 13.8673 * C_p**2 + 6.984388 * C_p**3 if C_p < 0.8 else 1.73014 - 0.7067 * C_p
    m_1 = 0.0140407 * L / d - 1.75254 * ship.volume ** (1 / 3) / L - 4.79323 * B / L - c_16
    return c_1 * bulb(ship) * _transom(ship) * math.exp(m_1 * F_n**-0.9 + _humps(ship, F_n))


def _fast(ship: Particulars, F_n: float) -> float:
    """R_W-B of Holtrop 1984."""
    L, B = ship.L_pp, ship.B
    c_17 = 6919.3 * ship.C_m**-1.3346 * (ship.volume / L**3) ** 2.00977 * max(L / B - 2, 0.02) ** 1.40692
    m_3 = -7.2035 * (B / L) ** 0.326869 * (ship.d / B) ** 0.605375
    return c_17 * bulb(ship) * _transom(ship) * math.exp(m_3 * F_n**-0.9 + _humps(ship, F_n))


def _humps(ship: Particulars, F_n: float) -> float:
    """m_4 cos(lambda F_n^-2): bow and stern waves for and against each other."""
    L_B, C_p, long = ship.L_pp / ship.B, prismatic(ship), ship.L_pp**3 / ship.volume
    c_15 = -1.69385 if long < 512 else 0.0 if long > 1726.91 else -1.69385 + (long ** (1 / 3) - 8) / 2.36
    wave = 1.446 * C_p - (0.03 * L_B if L_B < 12 else 0.36)
    return 0.4 * c_15 * math.exp(-0.034 * F_n**-3.29) * math.cos(wave * F_n**-2)


def _transom(ship: Particulars) -> float:
    """c_5: an immersed transom makes the ship longer for its waves."""
    return 1 - 0.8 * ship.A_T / (ship.B * ship.d * ship.C_m)


def pressure(ship: Particulars) -> float:
    """Resistance of a bulb near the surface and of an immersed transom over rho [m^4/s^2], Holtrop and Mennen 1982."""
    total, U = 0.0, ship.speed
    if ship.A_BT:
        width = math.sqrt(ship.A_BT)
        deep = 0.56 * width / (ship.d - 1.5 * ship.h_B)
        F_i = U / math.sqrt(GRAVITY * (ship.d - ship.h_B - 0.25 * width) + 0.15 * U * U)
        total += 0.11 * math.exp(-3 * deep**-2) * F_i**3 * ship.A_BT**1.5 * GRAVITY / (1 + F_i * F_i)
    if ship.A_T:
        F_T = U / math.sqrt(2 * GRAVITY * ship.A_T / (ship.B * (1 + ship.C_WP)))
        total += 0.5 * U * U * ship.A_T * max(0.2 * (1 - 0.2 * F_T), 0.0)
    return total


def resistance(ship: Particulars) -> dict[str, float]:
    """R_0 at the approach speed: hull, rudders (both sides of their area, 1 + k_2 = 1.5), waves, bulb and transom."""
    area = ship.L_pp * ship.d
    rudders = 1.5 * 2.0 * ship.A_R * ship.screws * friction(ship)
    making = GRAVITY * ship.volume * waves(ship) + pressure(ship)
    return {"hull.R_0": (viscous(ship) * wetted_surface(ship) + rudders + making / (0.5 * ship.speed**2)) / area}


def residuary(ship: Particulars) -> float:
    """Residuary resistance over the weight of tugs and trawlers, van Oortmerssen 1971."""
    L, C_p, F_n2 = _DISPLACEMENT * ship.L_pp, prismatic(ship), ship.ratios["F_n"] ** 2 / _DISPLACEMENT
    C_WL, lcb = math.degrees(ship.i_E or entrance(ship)) * L / ship.B, centre(ship)
    terms = (1.0, lcb, lcb * lcb, C_p, C_p * C_p, L / ship.B, (L / ship.B) ** 2, C_WL, C_WL * C_WL,
             ship.B / ship.d, (ship.B / ship.d) ** 2, ship.C_m)  # fmt: skip
    c_1, c_2, c_3, c_4 = (1e-3 * sum(a * x for a, x in zip(column, terms, strict=True)) for column in _OORTMERSSEN)
    m = 0.14347 * C_p**-2.1976
    decay = math.exp(-m / F_n2)
    return c_1 * math.exp(-m / 9 / F_n2) + decay * (c_2 + c_3 * math.sin(1 / F_n2) + c_4 * math.cos(1 / F_n2))


def by_oortmerssen(ship: Particulars) -> dict[str, float]:
    """R_0 of a small ship below a Froude number of .5: ITTC 1957 friction without form factor, and `residuary`."""
    if ship.L_pp > TUGS_END or ship.ratios["F_n"] > _FASTEST_TUG:
        return {}
    U2 = 0.5 * ship.speed**2
    made = friction(ship) * wetted_surface(ship) * U2 + GRAVITY * ship.volume * residuary(ship)
    return {"hull.R_0": made / (U2 * ship.L_pp * ship.d)} if made > 0.0 else {}


def broad(ship: Particulars) -> dict[str, float]:
    """`by_oortmerssen` of a ship that is too broad for Holtrop's data."""
    return by_oortmerssen(ship) if ship.L_pp / ship.B < _HOLTROP["L/B"][0] else {}


def slender(ship: Particulars) -> dict[str, float]:
    """`by_oortmerssen` of a ship that is not."""
    return {} if broad(ship) else by_oortmerssen(ship)


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


_HOLTROP: Limits = {"L/B": (3.9, 9.5), "F_n": (0.05, 0.45)}
_BASIS = "envelope over the ship types of Holtrop's table, recalled, not read"
WAKE = Formula(
    name="Holtrop 1984", source="holtrop1984, single screw, normal stern, as in public codes",
    gives=wake, limits=_HOLTROP, basis=_BASIS,
)  # fmt: skip
TWIN_WAKE = Formula(
    name="Holtrop-Mennen 1982 (twin screws)", source="holtrop1982, twin screws, as in public codes; recalled, not read",
    gives=twin_wake, limits={"screws": (2.0, 2.0), **_HOLTROP}, basis=_BASIS,
)  # fmt: skip
_TUGS = Formula(
    name="van Oortmerssen 1971",
    source="oortmerssen1971, tugs and trawlers: ITTC 1957 friction without form factor and residuary resistance, "
    "coefficients as in a public code, which the paper's errata touch (Helmore 2008)",
    gives=broad,
    limits={"L/B": (3.0, 6.2), "B/d": (1.9, 4.0), "C_p": (0.5, 0.73), "F_n": (0.0, 0.5)},
    basis="range of the paper, recalled, not read",
)  # fmt: skip
FORMULAS = (
    _TUGS,
    Formula(
        name="Holtrop-Mennen",
        source="holtrop1982 and holtrop1984: ITTC 1957 friction, form factor, allowance for ships above 30 m, rudders, "
        "waves, bulb and transom, at the approach speed; checked on the example printed in holtrop1982",
        gives=resistance, limits=_HOLTROP, basis=_BASIS,
    ),
    replace(_TUGS, gives=slender),
    replace(WAKE, gives=thrust_deduction),
    replace(TWIN_WAKE, gives=twin_thrust_deduction),
)  # fmt: skip
