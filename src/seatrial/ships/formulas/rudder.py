"""The rudder and its interaction with hull and propeller."""

from __future__ import annotations

from dataclasses import replace

from . import COMPARED, ONE_SCREW, Formula, Particulars
from .hull import YOSHIMURA, YOSHIMURA_BASIS


def fujii(ship: Particulars) -> dict[str, float]:
    """f_alpha = 6.13 A/(A + 2.25), A the aspect ratio of the whole rudder (Fujii and Tuda 1961)."""
    return {"rudder.f_alpha": 6.13 * ship.aspect / (ship.aspect + 2.25)}


def yoshimura(ship: Particulars) -> dict[str, float]:
    """Yoshimura and Masumoto 2012 Eqs. 17-18, merchant ships on even keel; kappa = 0.55/epsilon."""
    epsilon = 2.26 - 1.82 * (1 - ship.w_P0)
    gamma_R = 2.06 * ship.X + 0.14
    return {
        "rudder.t_R": 0.39, "rudder.epsilon": epsilon, "rudder.kappa": 0.55 / epsilon, "rudder.l_R": -0.9,
        "rudder.gamma_Rp": gamma_R, "rudder.gamma_Rn": gamma_R,
    }  # fmt: skip


def yoshimura_hull(ship: Particulars) -> dict[str, float]:
    """What the rudder induces on the hull, same source."""
    return {"rudder.a_H": 3.6 * ship.X, "rudder.x_H": -0.4}


def quadvlieg(ship: Particulars) -> dict[str, float]:
    """a_H = 0.627 C_b - 0.153 (Quadvlieg 2013)."""
    return {"rudder.a_H": 0.627 * ship.C_b - 0.153}


def aoki(_: Particulars) -> dict[str, float]:
    """x_H = -0.45 L (Aoki et al. 2006)."""
    return {"rudder.x_H": -0.45}


def kijima(ship: Particulars) -> dict[str, float]:
    """Kijima et al. 1990; the polynomials of a_H and x_H in circulation could not be verified and are left out."""
    return {
        "rudder.t_R": 0.45 - 0.28 * ship.C_b,
        "rudder.epsilon": -156.2 * ship.X * ship.X + 41.6 * ship.X - 1.76,
    }


def slim(ship: Particulars) -> dict[str, float]:
    """Share of the race 0.55 - 0.8 X, which mmgdynamics uses without a source."""
    return {"rudder.kappa": 0.55 - 0.8 * ship.X}


def geometry(ship: Particulars) -> dict[str, float]:
    """The rudder hangs at the aft perpendicular; eta is the share of its height in the race."""
    return {"rudder.x_R": -0.5, "rudder.eta": min(ship.D_P / ship.H_R, 1.0)}


_MMGDYNAMICS = "as coded in mmgdynamics dynamics.py @dda5e25"
_YOSHIMURA = Formula(
    name="Yoshimura-Masumoto 2012", source="yoshimura2012 Eqs. 17-18 (merchant ships), as in two public codes",
    gives=yoshimura, limits={**YOSHIMURA, **ONE_SCREW}, basis=YOSHIMURA_BASIS,
)  # fmt: skip
FORMULAS = (
    Formula(
        name="Fujii 1961", source="fujii1961: 6.13 A/(A + 2.25)", gives=fujii,
        limits={"rudder aspect": (0.5, 3.0)}, basis="range not found in print; judgement",
    ),
    _YOSHIMURA,
    Formula(name="Quadvlieg 2013", source=f"quadvlieg2013, {_MMGDYNAMICS}", gives=quadvlieg,
            limits={**COMPARED, **ONE_SCREW}),
    Formula(name="Aoki 2006", source=f"aoki2006, {_MMGDYNAMICS}", gives=aoki, limits={**COMPARED, **ONE_SCREW}),
    replace(_YOSHIMURA, gives=yoshimura_hull),
    Formula(
        name="Kijima 1990", source="kijima1990, as in two public codes (-156.2 in one, -156.5 in the other)",
        gives=kijima, limits={**COMPARED, **ONE_SCREW},
    ),
    Formula(name="mmgdynamics", source=f"{_MMGDYNAMICS}, origin not stated there", gives=slim,
            limits={**COMPARED, **ONE_SCREW}),
    Formula(
        name="geometry", source="geometry: rudder at the aft perpendicular, eta = D_P/H_R", gives=geometry,
        limits={}, basis="none needed",
    ),
)  # fmt: skip
"""Formulas for the rudder's force, the first that the particulars allow is used."""
