"""Wind forces by the regression of Isherwood (1972): coefficients at every ten degrees."""

from __future__ import annotations

from collections.abc import Sequence
from csv import reader
from importlib.resources import files
from math import pi
from typing import NamedTuple

from ..core.parameters import Scalar, spec
from ..core.symbolic import atan2, larger, magnitude, sign
from ..core.values import dataclass
from . import Flow, Force, ForceModule


def _table(coefficient: str) -> tuple[tuple[float, ...], ...]:
    """A row for each ten degrees of the wind off the bow, 0 to 180; columns: the regressors of `coefficients`."""
    with (files("seatrial.forces") / "wind_isherwood.csv").open() as table:
        rows = [row for row in reader(table) if row[0] == coefficient]
    return tuple(tuple(float(number) for number in row[2:] if number) for row in rows)


_C_X, _C_Y, _C_N = map(_table, "XYN")
_STEP = pi / (len(_C_X) - 1)


class WindRow(NamedTuple):
    """Coefficients at one angle, signed as Isherwood prints C_Y and C_N, head wind giving a negative C_X.

    Attributes:
        gamma: angle of the wind off the bow [deg].
        C_X, C_Y, C_N: coefficients of surge, sway and yaw.
    """

    gamma: float
    C_X: float
    C_Y: float
    C_N: float


@dataclass(frozen=True, kw_only=True)
class Isherwood(ForceModule):
    """Wind forces of merchant ships, Isherwood (1972), RINA 115, 327-338.

    Between the nineteen angles of the tables each coefficient runs straight, so that it is exact at
    the printed angles and continuous across bow and stern.  Wind from port is the mirror image.
    """

    rho_air: Scalar = spec("kg/m^3", "density of the air", (0.5, 2.0))
    A_T: Scalar = spec("m^2", "frontal area above water", (1e-6, 1e5))
    A_L: Scalar = spec("m^2", "lateral area above water", (1e-6, 1e5))
    L_OA: Scalar = spec("m", "length over all", (1e-3, 1e3))
    B: Scalar = spec("m", "breadth", (1e-3, 1e3))
    S: Scalar = spec("m", "perimeter of the side view without waterline, masts, ventilators", (1e-3, 1e4))
    C: Scalar = spec("m", "bow to the centroid of the lateral area", (0.0, 1e3))
    M: Scalar = spec("", "distinct groups of masts or king posts seen from the side", (0.0, 10.0), default=1.0)
    A_SS: Scalar = spec("m^2", "lateral area of the superstructure", (0.0, 1e5))

    def force(self, flow: Flow) -> Force:
        off_bow = atan2(magnitude(flow.v_A), flow.u_A) / _STEP
        near = [larger(0.0, 1.0 - magnitude(off_bow - i)) for i in range(len(_C_X))]
        C_X, C_Y, C_N = self.coefficients(near)
        pressure = 0.5 * self.rho_air * (flow.u_A * flow.u_A + flow.v_A * flow.v_A)
        # Positive C_Y is away from the wind: to port for a wind from starboard.
        side = -sign(flow.v_A) * pressure * self.A_L
        return Force(pressure * self.A_T * C_X, side * C_Y, side * self.L_OA * C_N)

    def coefficients(self, weights: Sequence[Scalar]) -> tuple[Scalar, Scalar, Scalar]:
        """C_X, C_Y, C_N as the mean over the angles by `weights`."""
        common = (
            1.0, 2.0 * self.A_L / (self.L_OA * self.L_OA), 2.0 * self.A_T / (self.B * self.B),
            self.L_OA / self.B, self.S / self.L_OA, self.C / self.L_OA,
        )  # fmt: skip
        C_X = -_mean(_C_X, weights, (*common, self.M))
        return C_X, _mean(_C_Y, weights, (*common, self.A_SS / self.A_L)), _mean(_C_N, weights, common)


def _mean(table: Sequence[Sequence[float]], weights: Sequence[Scalar], regressors: Sequence[Scalar]) -> Scalar:
    """Sum over the columns of regressor times the weighted mean of the column, zeros left out."""
    total: Scalar = 0.0
    for column, regressor in zip(zip(*table, strict=True), regressors, strict=True):
        part: Scalar = 0.0
        for a, weight in zip(column, weights, strict=True):
            if a:  # a number of the table, never a symbol
                part = part + a * weight
        total = total + regressor * part
    return total


def isherwood1972(
    *, A_T: float, A_L: float, L_OA: float, B: float, S: float, C: float, A_SS: float, M: float = 1.0
) -> tuple[WindRow, ...]:
    """Coefficients at 0, 10, ..., 180 deg off the bow; arguments as the numbers of `Isherwood`."""
    ship = Isherwood(rho_air=1.0, A_T=A_T, A_L=A_L, L_OA=L_OA, B=B, S=S, C=C, M=M, A_SS=A_SS)
    count = len(_C_X)
    unit = [[float(i == j) for j in range(count)] for i in range(count)]
    return tuple(WindRow(10.0 * i, *map(float, ship.coefficients(unit[i]))) for i in range(count))
