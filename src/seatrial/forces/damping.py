"""Damping of a hull in Fossen's matrix form: D(nu) nu by polynomials with |.|, or with cross-flow drag."""

from __future__ import annotations

from ..core.parameters import Scalar, choice, spec
from ..core.symbolic import magnitude
from ..core.values import dataclass
from . import Flow, Force, ForceModule
from .crossflow import drag_force, drag_moment

Rows = tuple[tuple[Scalar, Scalar, Scalar], ...]


@dataclass(frozen=True, kw_only=True)
class Polynomial(ForceModule):
    """D(nu) of You et al. (2023) Eq. 4: linear, |.| quadratic and cubic terms; negative numbers damp.

    Only X_u, Y_v and N_r given, it is the diagonal damping of the model with six parameters (Eq. 6).  The
    17 numbers of Eq. 4 belong to the surge-decoupled one with 22.  X_v, X_r, Y_u and N_u fill the linear
    part, and with a full mass matrix make the fully coupled one with 30 (Pedersen 2019, whose table is
    not at hand: that these are its eight couplings is our reading of the count).  They break the symmetry
    of port and starboard; the others keep it.  Y_uv, N_uv and N_ur are not in the paper: the lift of a hull
    that makes way is linear in drift and turn and grows with its speed; it acts in the leading half ahead and astern.
    Nor is X_vr, the resistance of a hull that drifts as it turns, beside the centripetal force.
    """

    order: str = choice(
        "terms that act: linear alone, with |.| u as well, or all",
        ("linear", "quadratic", "cubic"), "cubic",
    )  # fmt: skip
    X_u: Scalar = spec("kg/s", "surge force by u")
    X_uu: Scalar = spec("kg/m", "surge force by |u| u", default=0.0)
    X_uuu: Scalar = spec("kg s/m^2", "surge force by u^3", default=0.0)
    Y_v: Scalar = spec("kg/s", "sway force by v")
    Y_vv: Scalar = spec("kg/m", "sway force by |v| v", default=0.0)
    Y_rv: Scalar = spec("kg", "sway force by |r| v", default=0.0)
    Y_uv: Scalar = spec("kg/m", "sway force by |u| v", default=0.0)
    Y_vvv: Scalar = spec("kg s/m^2", "sway force by v^3", default=0.0)
    Y_r: Scalar = spec("kg m/s", "sway force by r", default=0.0)
    Y_vr: Scalar = spec("kg", "sway force by |v| r", default=0.0)
    Y_rr: Scalar = spec("kg m", "sway force by |r| r", default=0.0)
    N_v: Scalar = spec("kg m/s", "yaw moment by v", default=0.0)
    N_vv: Scalar = spec("kg", "yaw moment by |v| v", default=0.0)
    N_rv: Scalar = spec("kg m", "yaw moment by |r| v", default=0.0)
    N_uv: Scalar = spec("kg", "yaw moment by u v", default=0.0)
    N_r: Scalar = spec("kg m^2/s", "yaw moment by r")
    N_vr: Scalar = spec("kg m", "yaw moment by |v| r", default=0.0)
    N_rr: Scalar = spec("kg m^2", "yaw moment by |r| r", default=0.0)
    N_ur: Scalar = spec("kg m", "yaw moment by |u| r", default=0.0)
    N_rrr: Scalar = spec("kg m^2 s", "yaw moment by r^3", default=0.0)
    X_v: Scalar = spec("kg/s", "surge force by v (fully coupled model)", default=0.0)
    X_r: Scalar = spec("kg m/s", "surge force by r (fully coupled model)", default=0.0)
    Y_u: Scalar = spec("kg/s", "sway force by u (fully coupled model)", default=0.0)
    N_u: Scalar = spec("kg m/s", "yaw moment by u (fully coupled model)", default=0.0)
    X_vr: Scalar = spec("kg", "surge force by v r, beside that of the masses", default=0.0)

    def matrix(self, u: Scalar, v: Scalar, r: Scalar) -> Rows:
        """Rows of D at velocities through the water, so that the force is -D nu."""
        two, three = float(self.order != "linear"), float(self.order == "cubic")
        a, b, c = two * magnitude(u), two * magnitude(v), two * magnitude(r)
        uu, vv, rr = three * u * u, three * v * v, three * r * r
        return (  # You 2023 (4), one line an entry
            (-self.X_u - self.X_uu * a - self.X_uuu * uu, -self.X_v - self.X_vr * two * r, -self.X_r),
            (
                -self.Y_u,
                -self.Y_v - self.Y_uv * a - self.Y_vv * b - self.Y_rv * c - self.Y_vvv * vv,
                -self.Y_r - self.Y_vr * b - self.Y_rr * c,
            ),
            (
                -self.N_u,
                -self.N_v - self.N_uv * two * u - self.N_vv * b - self.N_rv * c,
                -self.N_r - self.N_ur * a - self.N_vr * b - self.N_rr * c - self.N_rrr * rr,
            ),
        )

    def force(self, flow: Flow) -> Force:
        """Damping force -D(nu) nu on the hull."""
        u, v, r = flow.u, flow.v_m, flow.r
        X, Y, N = (-(row[0] * u + row[1] * v + row[2] * r) for row in self.matrix(u, v, r))
        return Force(X, Y, N)


@dataclass(frozen=True, kw_only=True)
class CrossFlowDrag(ForceModule):
    """Linear damping with cross-flow drag across a hull of even draught (Fossen 2011; Sawada 2024, section 4.2).

    The drag of each strip is that of its own lateral velocity v + x r, integrated from stern to bow in
    closed form; a ship without draught in its file has none.
    """

    X_u: Scalar = spec("kg/s", "surge force by u")
    X_uu: Scalar = spec("kg/m", "surge force by |u| u", default=0.0)
    Y_v: Scalar = spec("kg/s", "sway force by v")
    Y_r: Scalar = spec("kg m/s", "sway force by r", default=0.0)
    N_v: Scalar = spec("kg m/s", "yaw moment by v", default=0.0)
    N_r: Scalar = spec("kg m^2/s", "yaw moment by r")
    N_rr: Scalar = spec("kg m^2", "yaw moment by |r| r besides the drag of the strips", default=0.0)
    C_D: Scalar = spec("", "cross-flow drag coefficient", (0.0, 10.0))

    def force(self, flow: Flow) -> Force:
        u, v, r, half = flow.u, flow.v_m, flow.r, 0.5 * flow.L_pp
        strip = 0.5 * flow.rho * flow.d * self.C_D
        return Force(
            self.X_u * u + self.X_uu * magnitude(u) * u,
            self.Y_v * v + self.Y_r * r - strip * drag_force(v, r, half),
            self.N_v * v + (self.N_r + self.N_rr * magnitude(r)) * r - strip * drag_moment(v, r, half),
        )
