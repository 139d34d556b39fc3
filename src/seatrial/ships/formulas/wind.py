"""Wind: the regression of Fujiwara, Ueno and Nimura 1998 from the shape above water."""

from __future__ import annotations

from ...forces.wind import fujiwara1998
from . import NONE, Formula, Particulars


def fujiwara(ship: Particulars) -> dict[str, float]:
    """Coefficients of `forces.wind.Fujiwara`; nothing without a shape above water."""
    air = ship.air
    if air is None:
        return {}
    found = fujiwara1998(
        A_T=air.A_T, A_L=air.A_L, A_OD=air.A_OD, C=air.C, C_BR=air.C_BR, H_BR=air.H_BR, H_C=air.H_C,
        B=ship.B, L=ship.L_pp,
    )  # fmt: skip
    return {f"wind.{name}": value for name, value in found.items()}


FORMULAS = (
    Formula(
        name="Fujiwara 1998", source="fujiwara1998, regression from the shape above water", gives=fujiwara,
        limits={}, basis=NONE,
    ),
)  # fmt: skip
