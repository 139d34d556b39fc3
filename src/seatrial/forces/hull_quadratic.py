"""Hull forces as a polynomial in the drift angle, with |.| in place of third powers."""

from __future__ import annotations

from ..core.parameters import Scalar, spec
from ..core.symbolic import atan2, larger, magnitude, speed, where
from ..core.values import dataclass
from . import Flow, Force, ForceModule

# Yaw rate r L_pp/U up to which the terms are as printed, as in `hull`; beyond, the one by b r'^2 fades with the speed.
_FASTEST_TURN = 4.0


@dataclass(frozen=True, kw_only=True)
class QuadraticDrift(ForceModule):
    """Bare-hull forces in the form of Inoue et al. (1981) and Kijima et al. (1990), with respect to midship.

    X' = -R_0' + X_bb b^2 + X_br b r' + X_rr r'^2 + X_bbbb b^4,
    Y' = Y_b b + Y_r r' + Y_bb b|b| + Y_rr r'|r'| + (Y_bbr b + Y_brr r') b r', N' in the same way; b is the drift
    angle atan2(-v_m, u) [rad], r' = r L_pp/U, forces over 0.5 rho L_pp d U^2, the moment over 0.5 rho L_pp^2 d U^2.
    Astern the angle is counted from the stern and the resistance turns round.
    """

    R_0: Scalar = spec("'", "resistance in straight motion", (0.0, 1.0))
    X_bb: Scalar = spec("'", "surge force by b^2", default=0.0)
    X_br: Scalar = spec("'", "surge force by b r', added mass excluded", default=0.0)
    X_rr: Scalar = spec("'", "surge force by r'^2, added mass excluded", default=0.0)
    X_bbbb: Scalar = spec("'", "surge force by b^4", default=0.0)
    Y_b: Scalar = spec("'", "sway force by b")
    Y_r: Scalar = spec("'", "sway force by r', added mass excluded")
    Y_bb: Scalar = spec("'", "sway force by b|b|")
    Y_rr: Scalar = spec("'", "sway force by r'|r'|", default=0.0)
    Y_bbr: Scalar = spec("'", "sway force by b^2 r'", default=0.0)
    Y_brr: Scalar = spec("'", "sway force by b r'^2", default=0.0)
    N_b: Scalar = spec("'", "yaw moment by b")
    N_r: Scalar = spec("'", "yaw moment by r'")
    N_bb: Scalar = spec("'", "yaw moment by b|b|", default=0.0)
    N_rr: Scalar = spec("'", "yaw moment by r'|r'|", default=0.0)
    N_bbr: Scalar = spec("'", "yaw moment by b^2 r'", default=0.0)
    N_brr: Scalar = spec("'", "yaw moment by b r'^2", default=0.0)

    def force(self, flow: Flow) -> Force:
        U, r = speed(flow.u, flow.v_m), flow.r * flow.L_pp
        b = atan2(-flow.v_m, magnitude(flow.u))
        Ub, rr = U * b, r * magnitude(r)
        bb, brr = Ub * U * magnitude(b), Ub * r * r / larger(U, magnitude(r) / _FASTEST_TURN)
        straight = where(flow.u < 0, self.R_0, -self.R_0) * (flow.u * flow.u + flow.v_m * flow.v_m)
        drifting = (self.X_bb + self.X_bbbb * b * b) * Ub * Ub
        X = straight + drifting + self.X_br * Ub * r + self.X_rr * r * r
        mixed, area = Ub * b * r, 0.5 * flow.rho * flow.L_pp * flow.d
        Y = (self.Y_b * Ub + self.Y_r * r) * U + self.Y_bb * bb + self.Y_rr * rr + self.Y_bbr * mixed + self.Y_brr * brr
        N = (self.N_b * Ub + self.N_r * r) * U + self.N_bb * bb + self.N_rr * rr + self.N_bbr * mixed + self.N_brr * brr
        return Force(area * X, area * Y, area * flow.L_pp * N)
