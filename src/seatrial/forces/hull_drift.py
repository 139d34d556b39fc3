"""Hull forces as a polynomial in the drift angle, normalised with a fixed speed."""

from __future__ import annotations

from ..core.parameters import Scalar, spec
from ..core.symbolic import atan2, magnitude, smaller
from ..core.values import dataclass
from . import Flow, Force, ForceModule


@dataclass(frozen=True, kw_only=True)
class DriftAngle(ForceModule):
    """Bare-hull forces of Yoshimura, Ueno and Tsukada (2008), with respect to midship.

    X' = X_0 u'^2 + X_bb b^2 + X_br b r' + X_rr r'^2 + X_bbbb b^4, Y' and N' cubic in b and r'; b is the
    drift angle atan2(-v_m, u) [rad], u' = u/U_ref, r' = r L_pp/U_ref, forces over 0.5 rho L_pp d U_ref^2,
    the moment over 0.5 rho L_pp^2 d U_ref^2.  U_ref is a fixed speed, not that of the moment.

    A drift angle does not vanish with the speed, so as printed a ship drifting at a millimetre a second
    feels its full force.  Below `U_low` the angle therefore counts by (U/U_low)^2, which makes its forces
    grow with the square of the speed and silent at rest; above it nothing is changed.  Astern, where the
    model was never fitted, the angle is counted from the stern and the resistance turns round.
    """

    U_ref: Scalar = spec("m/s", "speed that makes velocities and forces non-dimensional", (1e-3, 100.0))
    U_low: Scalar = spec("m/s", "speed below which the drift angle counts by the square of the speed", (1e-6, 100.0))
    X_0: Scalar = spec("'", "surge force in straight motion", (-1.0, 0.0))
    X_bb: Scalar = spec("'", "surge force by b^2")
    X_br: Scalar = spec("'", "surge force by b r'; contains what the body does not write out")
    X_rr: Scalar = spec("'", "surge force by r'^2")
    X_bbbb: Scalar = spec("'", "surge force by b^4")
    Y_b: Scalar = spec("'", "sway force by b")
    Y_r: Scalar = spec("'", "sway force by r'; contains what the body does not write out")
    Y_bbb: Scalar = spec("'", "sway force by b^3")
    Y_bbr: Scalar = spec("'", "sway force by b^2 r'")
    Y_brr: Scalar = spec("'", "sway force by b r'^2")
    Y_rrr: Scalar = spec("'", "sway force by r'^3")
    N_b: Scalar = spec("'", "yaw moment by b")
    N_r: Scalar = spec("'", "yaw moment by r'")
    N_bbb: Scalar = spec("'", "yaw moment by b^3")
    N_bbr: Scalar = spec("'", "yaw moment by b^2 r'")
    N_brr: Scalar = spec("'", "yaw moment by b r'^2")
    N_rrr: Scalar = spec("'", "yaw moment by r'^3")

    def force(self, flow: Flow) -> Force:
        share = smaller(1.0, (flow.u * flow.u + flow.v_m * flow.v_m) / (self.U_low * self.U_low))
        b = share * atan2(-flow.v_m, magnitude(flow.u))
        u, r = flow.u / self.U_ref, flow.r * flow.L_pp / self.U_ref
        bb, br, rr = b * b, b * r, r * r
        X = self.X_0 * u * magnitude(u) + self.X_bb * bb + self.X_br * br + self.X_rr * rr + self.X_bbbb * bb * bb
        Y = self.Y_b * b + self.Y_r * r + b * (self.Y_bbb * bb + self.Y_bbr * br + self.Y_brr * rr)
        N = self.N_b * b + self.N_r * r + b * (self.N_bbb * bb + self.N_bbr * br + self.N_brr * rr)
        unit = 0.5 * flow.rho * flow.L_pp * flow.d * self.U_ref * self.U_ref
        return Force(
            unit * X, unit * (Y + self.Y_rrr * rr * r), unit * flow.L_pp * (N + self.N_rrr * rr * r)
        )  # fmt: skip
