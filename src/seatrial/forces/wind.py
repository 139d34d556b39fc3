"""Wind forces on the part of the ship above water."""

from __future__ import annotations

from ..core.parameters import Scalar, spec
from ..core.symbolic import speed
from ..core.values import dataclass
from . import Flow, Force, ForceModule


@dataclass(frozen=True, kw_only=True)
class Fujiwara(ForceModule):
    """Wind forces by the series of Fujiwara, Ueno and Nimura (1998), Sawada 2024 Eqs. 61-62.

    The series run over psi = 2 pi - gamma_A, whose sine and cosine come straight from the components
    of the apparent wind; multiples of the angle are polynomials in them.
    """

    rho_air: Scalar = spec("kg/m^3", "density of the air", (0.5, 2.0))
    A_T: Scalar = spec("m^2", "frontal area above water", (0.0, 1e5))
    A_L: Scalar = spec("m^2", "lateral area above water", (0.0, 1e5))
    L_wind: Scalar = spec("m", "length that scales the yaw moment (L_pp in the authors' code)", (1e-3, 1e3))
    X_0: Scalar = spec("", "surge force, mean over the angle")
    X_1: Scalar = spec("", "surge force, cos psi")
    X_3: Scalar = spec("", "surge force, cos 3 psi")
    X_5: Scalar = spec("", "surge force, cos 5 psi")
    Y_1: Scalar = spec("", "sway force, sin psi")
    Y_3: Scalar = spec("", "sway force, sin 3 psi")
    Y_5: Scalar = spec("", "sway force, sin 5 psi")
    N_1: Scalar = spec("", "yaw moment, sin psi")
    N_2: Scalar = spec("", "yaw moment, sin 2 psi")
    N_3: Scalar = spec("", "yaw moment, sin 3 psi")

    def force(self, flow: Flow) -> Force:
        U_A = speed(flow.u_A, flow.v_A)
        c, s = flow.u_A / U_A, -flow.v_A / U_A
        cc = c * c
        C_X = (
            self.X_0 + self.X_1 * c + self.X_3 * c * (4.0 * cc - 3.0)
            + self.X_5 * c * ((16.0 * cc - 20.0) * cc + 5.0)
        )  # (62a)  # fmt: skip
        fifth = (16.0 * cc - 12.0) * cc + 1.0
        C_Y = s * (self.Y_1 + self.Y_3 * (4.0 * cc - 1.0) + self.Y_5 * fifth)  # (62b)
        C_N = s * (self.N_1 + self.N_2 * 2.0 * c + self.N_3 * (4.0 * cc - 1.0))  # (62c)
        pressure = 0.5 * self.rho_air * (flow.u_A * flow.u_A + flow.v_A * flow.v_A)
        side = pressure * self.A_L
        return Force(pressure * self.A_T * C_X, side * C_Y, side * self.L_wind * C_N)  # (61)


def fujiwara1998(
    *, A_T: float, A_L: float, A_OD: float, C: float, C_BR: float, H_BR: float, H_C: float, B: float, L: float
) -> dict[str, float]:
    """Coefficients of `Fujiwara` from the shape above water (regression of Fujiwara et al. 1998).

    Args:
        A_T: frontal area [m^2].
        A_L: lateral area [m^2].
        A_OD: lateral area of superstructure and deck load [m^2].
        C: centroid of A_L ahead of midship [m].
        C_BR: centroid of the superstructure ahead of midship [m].
        H_BR: height of the bridge top above water [m].
        H_C: height of the centroid of A_L above water [m].
        B: breadth [m].
        L: length [m].
    """
    LL, LB, c, bridge = L * L, A_L / (L * B), C / L, C_BR / L
    front = A_T / (B * H_BR)
    return {
        "X_0": -0.330 + 0.293 * B * H_BR / A_T + 0.0193 * C / H_C + 0.682 * A_OD / LL,
        "X_1": -1.353 + 1.700 * LB + 2.870 * L * H_C / A_L - 0.463 * L * H_BR / A_L - 0.570 * A_OD / A_L
        - 6.640 * A_T / (L * B) - 0.0123 * LL / A_T + 0.0202 * L / H_C,
        "X_3": 0.830 - 0.413 * A_L / (L * H_BR) - 0.0827 * A_L / A_T - 0.563 * L * H_C / A_L
        + 0.804 * A_OD / A_L - 5.670 * A_OD / LL + 0.0401 * C / H_C - 0.132 * bridge,
        "X_5": 0.0372 - 0.0075 * A_L / A_OD - 0.103 * bridge + 0.0921 * LB,
        "Y_1": 0.684 + 0.717 * bridge - 3.220 * c + 0.0281 * A_L / A_OD + 0.0661 * C / H_C + 0.298 * front,
        "Y_3": -0.400 + 0.282 * LB + 0.307 * L * H_C / A_L + 0.0519 * bridge + 0.0526 * B / H_BR
        - 0.0814 * A_OD / A_L + 0.0582 * front,
        "Y_5": 0.122 - 0.166 * LB - 0.0054 * L / H_BR - 0.0481 * bridge - 0.0136 * B * B / A_T
        + 0.0864 * c - 0.0297 * C * H_C / A_L,
        "N_1": 0.299 + 1.710 * c + 0.183 * L * H_C / A_L - 1.090 * A_T / A_L - 0.0442 * C / H_C
        - 0.289 * LB + 4.240 * A_T / LL - 0.0646 * B * B / A_T + 0.0306 * bridge,
        "N_2": 0.117 + 0.123 * bridge - 0.323 * c + 0.0041 * A_L / A_OD - 0.166 * A_T / (B * B)
        - 0.0109 * L / H_BR + 0.174 * front + 0.214 * LB - 1.060 * A_L / LL,
        "N_3": 0.023 + 0.0385 * bridge - 0.0339 * front + 0.0023 * A_L / A_T,
    }  # fmt: skip
