"""Forces on the bare hull: linear and cubic terms of the polynomial in v' and r'."""

from __future__ import annotations

import math

from . import Formula, Limits, Particulars
from .added_mass import motora, twentieth

YOSHIMURA: Limits = {"L/B": (2.6, 7.1), "d/B": (0.25, 0.46), "C_b": (0.51, 0.65)}
"""Limits of its non-linear coefficients."""
YOSHIMURA_BASIS = (
    "range of the paper's database, quoted by a public code (marine merchant and fishing ships); its authors hold "
    "the linear terms good for full ships too"
)
"""Where those limits come from."""


def _linear(ship: Particulars) -> dict[str, float]:
    """Wing of low aspect ratio with the fullness of the stern: common to three of the sources."""
    k = ship.k
    return {"hull.Y_v": -(0.5 * math.pi * k + 1.4 * ship.X), "hull.N_v": -k, "hull.N_r": -0.54 * k + k * k}


def yoshimura_linear(ship: Particulars) -> dict[str, float]:
    """Yoshimura and Masumoto 2012 Eq. 11, even keel."""
    return _linear(ship) | {"hull.Y_r": twentieth(ship)["body.m_x"] + 0.5 * ship.X}


def yoshimura(ship: Particulars) -> dict[str, float]:
    """Yoshimura and Masumoto 2012 Eqs. 14-16, even keel.

    Printed over beta: terms odd in beta change sign, among them X_betar - m_y = -1.91 X + 0.08.
    """
    L_B, X = ship.L_pp / ship.B, ship.X
    m_y = motora(ship)["body.m_y"]
    slim = (1 - ship.C_b) * L_B
    return {
        "hull.X_vv": 1.15 * X - 0.18,
        "hull.X_vr": -(-1.91 * X + 0.08 + m_y),
        "hull.X_rr": -0.085 * X + 0.008 - ship.x_G / ship.L_pp * m_y,
        "hull.X_vvvv": -6.68 * X + 1.1,
        "hull.Y_vvv": -(0.185 * L_B + 0.48),
        "hull.Y_vvr": -0.75,
        "hull.Y_vrr": -(0.26 * slim + 0.11),
        "hull.Y_rrr": -0.051,
        "hull.N_vvv": -(-0.69 * ship.C_b + 0.66),
        "hull.N_vvr": 1.55 * X - 0.76,
        "hull.N_vrr": -(0.075 * slim - 0.098),
        "hull.N_rrr": 0.25 * X - 0.056,
    }


def inoue(ship: Particulars) -> dict[str, float]:
    """Inoue, Hirano and Kijima 1981, even keel."""
    return _linear(ship) | {"hull.Y_r": 0.25 * math.pi * ship.k}


def kijima(ship: Particulars) -> dict[str, float]:
    """Kijima et al. 1990: what stands in the same terms; beta|beta| and r|r| have no place in a cubic."""
    d_B, X = ship.d / ship.B, ship.X
    m_x = twentieth(ship)["body.m_x"]
    return _linear(ship) | {
        "hull.Y_r": ship.m + m_x - 1.5 * X,
        "hull.Y_vvr": 1.5 * d_B * ship.C_b - 0.65,
        "hull.Y_vrr": -5.95 * d_B * (1 - ship.C_b),
        "hull.N_vvr": -(57.5 * X * X - 18.4 * X + 1.6),
        "hull.N_vrr": 0.5 * d_B * ship.C_b - 0.05,
    }


def clarke(ship: Particulars) -> dict[str, float]:
    """Velocity derivatives of Clarke, Gedling and Hine 1983 over 0.5 rho L d; their Y_r holds -m_x."""
    B_L, B_d, d_L = ship.B / ship.L_pp, ship.B / ship.d, ship.d / ship.L_pp
    scale = 0.5 * math.pi * ship.k
    return {
        "hull.Y_v": -scale * (1 + 0.4 * ship.C_b * B_d),
        "hull.Y_r": -scale * (-0.5 + 2.2 * B_L - 0.08 * B_d) + twentieth(ship)["body.m_x"],
        "hull.N_v": -scale * (0.5 + 2.4 * d_L),
        "hull.N_r": -scale * (0.25 + 0.039 * B_d - 0.56 * B_L),
    }


def hasegawa(ship: Particulars) -> dict[str, float]:
    """X_vr = (C_m - 1) m_y, C_m = 1.66 C_b - 0.432 (Hasegawa 1980)."""
    return {"hull.X_vr": (1.66 * ship.C_b - 1.432) * motora(ship)["body.m_y"]}


_PUBLIC = "yoshimura2012 {}, as quoted by equation in a public code; signs checked on KVLCC2 and KCS"
FORMULAS = (
    Formula(
        name="Yoshimura-Masumoto 2012 (linear)", source=_PUBLIC.format("Eq. 11"), gives=yoshimura_linear,
        limits={"L/B": (2.6, 7.2), "d/B": (0.25, 0.46), "C_b": (0.51, 0.85)},
        basis=YOSHIMURA_BASIS + "; here to C_b 0.85 and the L/B of KCS",
    ),
    Formula(
        name="Yoshimura-Masumoto 2012", source=_PUBLIC.format("Eqs. 14-16"), gives=yoshimura,
        limits=YOSHIMURA, basis=YOSHIMURA_BASIS,
    ),
    Formula(name="Inoue 1981", source="inoue1981, MARSIM 2003 and public codes", gives=inoue),
    Formula(
        name="Kijima 1990",
        source="kijima1990, as in two public codes (over beta in one, over v' in the other: N_vrr agrees)",
        gives=kijima,
    ),
    Formula(name="Clarke 1983", source="clarke1983, as coded in MSS clarke83.m @736a3d1", gives=clarke),
    Formula(
        name="Hasegawa 1980",
        source="hasegawa1980; form as on MARSIM 2003, C_m = 1.66 C_b - 0.432 recalled, not read", gives=hasegawa,
    ),
)  # fmt: skip
"""Formulas for the hull's damping, the first that the particulars allow is used."""
