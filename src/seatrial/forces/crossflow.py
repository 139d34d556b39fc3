"""Hull forces at low speed: linear lift along the hull and cross-flow drag across it."""

from __future__ import annotations

from math import pi

from ..core.parameters import Scalar, spec
from ..core.symbolic import atan2, magnitude, sign, speed, where
from ..core.values import dataclass
from . import Flow, Force, ForceModule


@dataclass(frozen=True, kw_only=True)
class CrossFlow(ForceModule):
    """Unified harbour and ocean hull model of Yoshimura et al. (2009), as in Sawada 2024 Eq. 38.

    Misprints of that equation are corrected: the strip integrals run from -L_pp/2 to +L_pp/2, and the
    drift angle that blends the resistances ahead and astern enters by its magnitude.
    """

    X_0F: Scalar = spec("'", "resistance coefficient ahead (negative)", (-1.0, 1.0))
    X_0A: Scalar = spec("'", "resistance coefficient astern (negative)", (-1.0, 1.0))
    X_vr: Scalar = spec("'", "surge force by v' r', added mass excluded")
    Y_v: Scalar = spec("'", "sway force by v'")
    Y_r: Scalar = spec("'", "sway force by r', added mass excluded")
    N_v: Scalar = spec("'", "yaw moment by v'")
    N_r: Scalar = spec("'", "yaw moment by r'")
    C_D: Scalar = spec("", "cross-flow drag coefficient", (0.0, 10.0))
    C_rY: Scalar = spec("", "weight of the yaw rate in the cross flow of the sway force", (0.0, 100.0))
    C_rN: Scalar = spec("", "weight of the yaw rate in the cross flow of the yaw moment", (0.0, 100.0))

    def force(self, flow: Flow) -> Force:
        u, v, r, L = flow.u, flow.v_m, flow.r * flow.L_pp, flow.L_pp
        drift = atan2(magnitude(v), u) / pi
        X_0 = self.X_0F + (self.X_0A - self.X_0F) * drift
        drag_Y = self.C_D / L * drag_force(v, self.C_rY * flow.r, 0.5 * L)
        drag_N = self.C_D / (L * L) * drag_moment(v, self.C_rN * flow.r, 0.5 * L)
        area = 0.5 * flow.rho * L * flow.d
        return Force(
            area * (X_0 * u * speed(u, v) + self.X_vr * v * r),  # (38) X_H
            area * (self.Y_v * v * magnitude(u) + self.Y_r * r * u - drag_Y),  # (38) Y_H
            area * L * (self.N_v * v * u + self.N_r * r * magnitude(u) - drag_N),  # (38) N_H
        )


def drag_force(v: Scalar, k: Scalar, h: Scalar) -> Scalar:
    """Integral of |v + k x| (v + k x) over x from -h to h, in closed form [m^3/s^2].

    Where the cross flow has one sign along the hull it is a square; else its zero x = -v/k splits it.
    """
    a = magnitude(k)
    one_sign = magnitude(v) >= a * h
    square = sign(v) * (2.0 * h * v * v + 2.0 / 3.0 * k * k * h * h * h)
    split = 2.0 / 3.0 * v * v * v / where(one_sign, 1.0, a) + 2.0 * v * a * h * h
    return where(one_sign, square, split)


def drag_moment(v: Scalar, k: Scalar, h: Scalar) -> Scalar:
    """Integral of |v + k x| (v + k x) x over x from -h to h, in closed form [m^4/s^2]."""
    a = magnitude(k)
    one_sign = magnitude(v) >= a * h
    square = magnitude(v) * k * (4.0 / 3.0 * h * h * h)
    zero = v / where(one_sign, 1.0, a)
    split = sign(k) * (v * v * h * h + 0.5 * k * k * h * h * h * h - v * v * zero * zero / 6.0)
    return where(one_sign, square, split)
