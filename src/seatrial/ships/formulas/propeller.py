"""Wake and thrust of the propeller."""

from __future__ import annotations

import numpy as np

from . import COMPARED, UNPUBLISHED, Formula, Particulars, table
from .resistance import TWIN_WAKE, WAKE

B_SERIES = [(float(row["C"]), *(int(row[power]) for power in "stuv")) for row in table("b_series")]
"""C, s, t, u, v of K_T = sum C J^s (P/D)^t (A_E/A_0)^u Z^v, Oosterveld and van Oossanen 1975."""


def thrust_coefficient(J: float, pitch_ratio: float, area_ratio: float, blades: float) -> float:
    """K_T of a Wageningen B-series propeller at advance ratio J >= 0."""
    return sum(C * J**s * pitch_ratio**t * area_ratio**u * blades**v for C, s, t, u, v in B_SERIES)


def b_series(ship: Particulars) -> dict[str, float]:
    """k_0, k_1, k_2: the parabola of least squares through 21 points of K_T > 0."""
    shape = (ship.pitch_ratio, ship.area_ratio, ship.blades)
    end = next((J for J in np.arange(0.05, 2.0, 0.01) if thrust_coefficient(float(J), *shape) <= 0), 2.0)
    J = np.linspace(0.0, float(end), 21)
    K_T = [thrust_coefficient(float(x), *shape) for x in J]
    k_2, k_1, k_0 = (float(x) for x in np.polyfit(J, K_T, 2))
    return {"propeller.k_0": k_0, "propeller.k_1": k_1, "propeller.k_2": k_2}


def straight_wake(C_b: float, screws: float = 1.0) -> float:
    """w_P0 = 0.5 C_b - 0.05 (Taylor; Kijima et al. 1990); of two screws 0.55 C_b - 0.2 (Taylor)."""
    return 0.5 * C_b - 0.05 if screws == 1.0 else 0.55 * C_b - 0.2


def taylor(ship: Particulars) -> dict[str, float]:
    """w_P0, and the final ratio 1/(1 - w_P0) to which it fades as w_P0 exp(-4 beta_P^2)."""
    if ship.screws != 1.0:
        return {}
    final = 1 / (1 - ship.w_P0)
    return {"propeller.w_P0": straight_wake(ship.C_b), "propeller.C_2p": final, "propeller.C_2n": final}


def taylor_twin(ship: Particulars) -> dict[str, float]:
    """The same of each of two screws, faded alike."""
    if ship.screws != 2.0:
        return {}
    final = 1 / (1 - ship.w_P0)
    return {"propeller.w_P0": straight_wake(ship.C_b, 2.0), "propeller.C_2p": final, "propeller.C_2n": final}


def drift(_: Particulars) -> dict[str, float]:
    """How fast the wake fades: C_1 = 2 meets exp(-4 beta_P^2) at beta_P = 0.5 rad."""
    return {"propeller.C_1": 2.0, "propeller.x_P": -0.48}


FORMULAS = (
    Formula(
        name="Kijima 1990",
        source="kijima1990: w_P0 = 0.5 C_b - 0.05 (Taylor), fading as exp(-4 beta_P^2) in drift, so C_2 = 1/(1 - w_P0)",
        gives=taylor,
    ),
    Formula(
        name="Taylor (twin screws)",
        source="Taylor 1943 for twin screws: w_P0 = 0.55 C_b - 0.2, as quoted, not read; fading as of a single screw",
        gives=taylor_twin, limits={"screws": (2.0, 2.0), **COMPARED}, basis=UNPUBLISHED,
    ),
    WAKE,
    TWIN_WAKE,
    Formula(
        name="as KVLCC2",
        source="assumed: the value of KVLCC2, yasukawa2015; C_1 = 2 also meets exp(-4 beta_P^2) at 0.5 rad",
        gives=drift, limits={}, basis="an assumption has no range",
    ),
    Formula(
        name="Wageningen B",
        source="oosterveld1975, K_T polynomial of the Wageningen B-series (three public codes agree), "
        "parabola fitted over K_T > 0",
        gives=b_series, limits={"P/D": (0.5, 1.4), "A_E/A_0": (0.3, 1.05), "Z": (2, 7)},
        basis="range of the series",
    ),
)  # fmt: skip
"""Formulas for wake and thrust deduction, the first that the particulars allow is used."""
