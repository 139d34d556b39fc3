"""Hull forces of the standard MMG model: a polynomial in drift and yaw rate."""

from __future__ import annotations

from ..core.parameters import Scalar, spec
from ..core.symbolic import larger, magnitude, speed, where
from ..core.values import dataclass
from . import Flow, Force, ForceModule

# Yaw rate r L_pp/U up to which cubic terms are as printed: twice that of the hardest turns.  Beyond, on the spot, the
# division by U would make them infinite; they then go with r^2.
_FASTEST_TURN = 4.0


@dataclass(frozen=True, kw_only=True)
class Polynomial(ForceModule):
    """Bare-hull forces of Yasukawa and Yoshimura (2015), with respect to midship.

    X' = -R_0' + X_vv' v'^2 + X_vr' v'r' + X_rr' r'^2 + X_vvvv' v'^4, Y' and N' cubic in v' and r';
    v' = v_m/U, r' = r L_pp/U, forces over 0.5 rho L_pp d U^2, the moment over 0.5 rho L_pp^2 d U^2.
    Written with velocities, so that a square needs no U and a cubic term one.  Astern, where the
    model was never fitted, the resistance turns round with the surge velocity; on the spot (r' > 4) the
    cubic terms are those at r' = 4, so that they stay finite.
    """

    R_0: Scalar = spec("'", "resistance in straight motion", (0.0, 1.0))
    X_vv: Scalar = spec("'", "surge force by v'^2")
    X_vr: Scalar = spec("'", "surge force by v' r', added mass excluded")
    X_rr: Scalar = spec("'", "surge force by r'^2, added mass excluded")
    X_vvvv: Scalar = spec("'", "surge force by v'^4")
    Y_v: Scalar = spec("'", "sway force by v'")
    Y_r: Scalar = spec("'", "sway force by r', added mass excluded")
    Y_vvv: Scalar = spec("'", "sway force by v'^3")
    Y_vvr: Scalar = spec("'", "sway force by v'^2 r'")
    Y_vrr: Scalar = spec("'", "sway force by v' r'^2")
    Y_rrr: Scalar = spec("'", "sway force by r'^3")
    N_v: Scalar = spec("'", "yaw moment by v'")
    N_r: Scalar = spec("'", "yaw moment by r'")
    N_vvv: Scalar = spec("'", "yaw moment by v'^3")
    N_vvr: Scalar = spec("'", "yaw moment by v'^2 r'")
    N_vrr: Scalar = spec("'", "yaw moment by v' r'^2")
    N_rrr: Scalar = spec("'", "yaw moment by r'^3")

    def force(self, flow: Flow) -> Force:
        u, v, r = flow.u, flow.v_m, flow.r * flow.L_pp
        U = speed(u, v)
        vv, vr, rr = v * v, v * r, r * r
        resistance = where(u < 0, -self.R_0, self.R_0) * (u * u + vv)
        quartic = vv / U
        X = -resistance + self.X_vv * vv + self.X_vr * vr + self.X_rr * rr + self.X_vvvv * quartic * quartic
        Y_cubic = v * (self.Y_vvv * vv + self.Y_vvr * vr + self.Y_vrr * rr) + self.Y_rrr * rr * r
        N_cubic = v * (self.N_vvv * vv + self.N_vvr * vr + self.N_vrr * rr) + self.N_rrr * rr * r
        V = larger(U, magnitude(r) / _FASTEST_TURN)
        Y = (self.Y_v * v + self.Y_r * r) * U + Y_cubic / V
        N = (self.N_v * v + self.N_r * r) * U + N_cubic / V
        area = 0.5 * flow.rho * flow.L_pp * flow.d
        return Force(area * X, area * Y, area * flow.L_pp * N)
