"""Regression formulas: from the particulars of a ship to the numbers of its MMG model, one part a module.

Contract: a `Formula` has a name, a source, what it needs, its range, and `gives`, which turns
`Particulars` into numbers by dotted path.  Hull numbers, added masses and positions are primed (0.5 rho L d
U^2 and its kin, positions over L_pp); the rest is as in the ship file.  Each module lists its formulas in
`FORMULAS`, for every number the one to be used first.  The formulas stand as v' and r' polynomials:
numbers published over the drift angle beta are turned by v' = -beta.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Mapping
from importlib.resources import files

from ...core.constants import GRAVITY
from ...core.values import dataclass, field

Limits = Mapping[str, tuple[float, float]]

COMPARED: Limits = {"L/B": (5.5, 7.2), "B/d": (2.4, 3.0), "C_b": (0.65, 0.83)}
"""Range of KVLCC2, KCS and Esso Osaka, on which every formula was compared with published numbers."""

ONE_SCREW: Limits = {"screws": (1.0, 1.0)}
"""Of what a rudder or propeller on the centre line does to the hull, and the hull to it."""

UNPUBLISHED = "range not found in print; that of KVLCC2, KCS and Esso Osaka, where it was compared, is used"
"""The basis of a formula whose range is our own comparison."""
NONE = "range not found in print"
"""The basis of a formula that no range limits."""


def table(name: str) -> list[dict[str, str]]:
    """The rows of a table that stands beside the formulas, by the names of its columns."""
    with (files("seatrial.ships.formulas") / f"{name}.csv").open(encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


@dataclass(frozen=True, kw_only=True)
class Air:
    """Shape of the ship above water, as Fujiwara 1998 names it; lengths [m], areas [m^2]."""

    A_T: float
    A_L: float
    A_OD: float
    C: float
    C_BR: float
    H_BR: float
    H_C: float
    rho_air: float


@dataclass(frozen=True, kw_only=True)
class Particulars:
    """What is known or assumed of a ship, in SI; `reading.MEANING` describes each number; i_E of zero is not known."""

    L_pp: float
    B: float
    d: float
    C_b: float
    rho: float
    nu: float
    volume: float
    x_G: float
    C_m: float
    speed: float
    D_P: float
    pitch_ratio: float
    blades: float
    area_ratio: float
    A_R: float
    H_R: float
    aspect: float
    w_P0: float
    C_WP: float
    A_BT: float = 0.0
    h_B: float = 0.0
    A_T: float = 0.0
    i_E: float = 0.0
    air: Air | None = None
    screws: float = 1.0

    @property
    def k(self) -> float:
        """2 d/L_pp, the aspect ratio of the hull as a wing."""
        return 2.0 * self.d / self.L_pp

    @property
    def X(self) -> float:
        """C_b B/L_pp."""
        return self.C_b * self.B / self.L_pp

    @property
    def m(self) -> float:
        """Mass over 0.5 rho L_pp^2 d."""
        return self.volume / (0.5 * self.L_pp * self.L_pp * self.d)

    @property
    def ratios(self) -> dict[str, float]:
        """The ratios by which ranges of validity are given."""
        return {
            "L/B": self.L_pp / self.B, "B/d": self.B / self.d, "d/B": self.d / self.B, "C_b": self.C_b,
            "C_p": self.C_b / self.C_m,
            "F_n": self.speed / math.sqrt(GRAVITY * self.L_pp), "P/D": self.pitch_ratio, "Z": self.blades,
            "A_E/A_0": self.area_ratio, "rudder aspect": self.aspect, "screws": self.screws,
        }  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Formula:
    """One published formula.

    Attributes:
        name: author and year, as tables show it.
        source: text for the ship file, departures and doubts included.
        gives: numbers by dotted path (primed as in the module's docstring) for given particulars.
        limits: range of validity by ratio.
        basis: where the limits come from.
    """

    name: str
    source: str
    gives: Callable[[Particulars], Mapping[str, float]]
    limits: Limits = field(default_factory=lambda: COMPARED)
    basis: str = UNPUBLISHED

    def outside(self, ship: Particulars) -> list[str]:
        """Each ratio that leaves the range, in words; empty where the formula may be used."""
        ratios = ship.ratios
        return [
            f"{name} = {ratios[name]:.3g}, range {low:g} to {high:g}"
            for name, (low, high) in self.limits.items()
            if not low * (1 - 1e-9) <= ratios[name] <= high * (1 + 1e-9)
        ]
