"""Wind forces by the regression of Isherwood (1972): coefficients at every ten degrees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import NamedTuple

from ..core.parameters import Scalar, spec
from ..core.symbolic import atan2, larger, magnitude, sign
from . import Flow, Force, ForceModule

# Rows: angle of the wind off the bow, 0 to 180 deg in steps of ten; columns: the regressors named below.
_C_X = (
    (2.152, -5.0, 0.243, -0.164, 0.0, 0.0, 0.0),
    (1.714, -3.33, 0.145, -0.121, 0.0, 0.0, 0.0),
    (1.818, -3.97, 0.211, -0.143, 0.0, 0.0, 0.033),
    (1.965, -4.81, 0.243, -0.154, 0.0, 0.0, 0.041),
    (2.333, -5.99, 0.247, -0.19, 0.0, 0.0, 0.042),
    (1.726, -6.54, 0.189, -0.173, 0.348, 0.0, 0.048),
    (0.913, -4.68, 0.0, -0.104, 0.482, 0.0, 0.052),
    (0.457, -2.88, 0.0, -0.068, 0.346, 0.0, 0.043),
    (0.341, -0.91, 0.0, -0.031, 0.0, 0.0, 0.032),
    (0.355, 0.0, 0.0, 0.0, -0.247, 0.0, 0.018),
    (0.601, 0.0, 0.0, 0.0, -0.372, 0.0, -0.02),
    (0.651, 1.29, 0.0, 0.0, -0.582, 0.0, -0.031),
    (0.564, 2.54, 0.0, 0.0, -0.748, 0.0, -0.024),
    (-0.142, 3.58, 0.0, 0.047, -0.7, 0.0, -0.028),
    (-0.677, 3.64, 0.0, 0.069, -0.529, 0.0, -0.032),
    (-0.723, 3.14, 0.0, 0.064, -0.475, 0.0, -0.032),
    (-2.148, 2.56, 0.0, 0.081, 0.0, 1.27, -0.027),
    (-2.707, 3.97, -0.175, 0.126, 0.0, 1.81, 0.0),
    (-2.529, 3.76, -0.174, 0.128, 0.0, 1.55, 0.0),
)  # fmt: skip
_C_Y = (
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (0.096, 0.22, 0.0, 0.0, 0.0, 0.0, 0.0),
    (0.176, 0.71, 0.0, 0.0, 0.0, 0.0, 0.0),
    (0.225, 1.38, 0.0, 0.023, 0.0, -0.29, 0.0),
    (0.329, 1.82, 0.0, 0.043, 0.0, -0.59, 0.0),
    (1.164, 1.26, 0.121, 0.0, -0.242, -0.95, 0.0),
    (1.163, 0.96, 0.101, 0.0, -0.177, -0.88, 0.0),
    (0.916, 0.53, 0.069, 0.0, 0.0, -0.65, 0.0),
    (0.844, 0.55, 0.082, 0.0, 0.0, -0.54, 0.0),
    (0.889, 0.0, 0.138, 0.0, 0.0, -0.66, 0.0),
    (0.799, 0.0, 0.155, 0.0, 0.0, -0.55, 0.0),
    (0.797, 0.0, 0.151, 0.0, 0.0, -0.55, 0.0),
    (0.996, 0.0, 0.184, 0.0, -0.212, -0.66, 0.34),
    (1.014, 0.0, 0.191, 0.0, -0.28, -0.69, 0.44),
    (0.784, 0.0, 0.166, 0.0, -0.209, -0.53, 0.38),
    (0.536, 0.0, 0.176, -0.029, -0.163, 0.0, 0.27),
    (0.251, 0.0, 0.106, -0.022, 0.0, 0.0, 0.0),
    (0.125, 0.0, 0.046, -0.012, 0.0, 0.0, 0.0),
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
)  # fmt: skip
_C_N = (
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (0.0596, 0.061, 0.0, 0.0, 0.0, -0.074),
    (0.1106, 0.204, 0.0, 0.0, 0.0, -0.17),
    (0.2258, 0.245, 0.0, 0.0, 0.0, -0.38),
    (0.2017, 0.457, 0.0, 0.0067, 0.0, -0.472),
    (0.1759, 0.573, 0.0, 0.0118, 0.0, -0.523),
    (0.1925, 0.48, 0.0, 0.0115, 0.0, -0.546),
    (0.2133, 0.315, 0.0, 0.0081, 0.0, -0.526),
    (0.1827, 0.254, 0.0, 0.0053, 0.0, -0.443),
    (0.2627, 0.0, 0.0, 0.0, 0.0, -0.508),
    (0.2102, 0.0, -0.0195, 0.0, 0.0335, -0.492),
    (0.1567, 0.0, -0.0258, 0.0, 0.0497, -0.457),
    (0.0801, 0.0, -0.0311, 0.0, 0.074, -0.396),
    (-0.0189, 0.0, -0.0488, 0.0101, 0.1128, -0.42),
    (0.0256, 0.0, -0.0422, 0.01, 0.0889, -0.463),
    (0.0552, 0.0, -0.0381, 0.0109, 0.0689, -0.476),
    (0.0881, 0.0, -0.0306, 0.0091, 0.0366, -0.415),
    (0.0851, 0.0, -0.0122, 0.0025, 0.0, -0.22),
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
)  # fmt: skip

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
