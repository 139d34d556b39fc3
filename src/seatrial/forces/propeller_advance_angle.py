"""Propeller by the advance angle of its blades: thrust, side force and yaw moment."""

from __future__ import annotations

from math import pi
from typing import ClassVar

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import atan2, clip, exp, where
from ..core.values import dataclass
from . import Flow, Force, PropellerModule, Slipstream
from .propeller import inflow_angle

_DEG = 180.0 / pi
_BLADE = 0.7 * pi


@dataclass(frozen=True, kw_only=True)
class AdvanceAngle(PropellerModule):
    """Propeller of Okuda et al. (2023), as printed in Suyama 2023 Eqs. 16-24.

    Coefficients over 0.5 rho S_P V_r^2 are polynomials in phi = atan(u_P/(0.7 pi n_P D_P)) [deg], with
    V_r^2 = u_P^2 + (0.7 pi n_P D_P)^2; the "K_T" of Eq. 18 is the C_T of that unit.  They are printed for
    u > 0 and n_P > 0.  Elsewhere: a screw turned and sailed the other way round has the opposite forces,
    C(phi - 180) = -C(phi), and between the two quadrants C is linear in phi, so it is bounded and
    continuous all round.  The step that Eq. 20 has at its joint is kept.
    """

    mirror_symmetric: ClassVar[bool] = False

    D_P: Scalar = spec("m", "diameter", (1e-4, 50.0))
    t_P: Scalar = spec("", "thrust deduction factor", (-0.5, 1.0))
    w_P0: Scalar = spec("", "wake fraction in straight motion", (-0.5, 1.0))
    C_w: Scalar = spec("", "change of the wake by the square of the drift angle at the propeller", (-100.0, 0.0))
    x_P: Scalar = spec("m", "effective position ahead of midship")
    T_0: Scalar = spec("", "thrust coefficient at bollard pull", (0.0, 5.0))
    T_1: Scalar = spec("", "thrust coefficient by phi in degrees")
    T_2: Scalar = spec("", "thrust coefficient by the square of phi in degrees")
    T_3: Scalar = spec("", "thrust coefficient by the cube of phi in degrees")
    Y_0: Scalar = spec("", "side force coefficient at bollard pull")
    Y_1: Scalar = spec("", "side force coefficient by phi in degrees")
    Y_2: Scalar = spec("", "side force coefficient by the square of phi in degrees")
    phi_N: Scalar = spec("rad", "phi from which the second branch of the moment holds", (0.0, 0.5 * pi))
    N_0: Scalar = spec("", "moment coefficient at bollard pull")
    N_1: Scalar = spec("", "moment coefficient by phi in degrees")
    N_2: Scalar = spec("", "moment coefficient of the second branch, constant")
    N_3: Scalar = spec("", "moment coefficient of the second branch, by phi in degrees")

    def force(self, flow: Flow) -> tuple[Force, Slipstream]:
        beta_P = inflow_angle(flow, self.x_P)  # (24)
        u_P = (1.0 - self.w_P0 * exp(self.C_w * beta_P * beta_P)) * flow.u  # (23)
        blade = _BLADE * flow.n_P * self.D_P
        square = u_P * u_P + blade * blade  # (22)
        C_T, C_Y, C_N = self._coefficients(u_P, blade)
        disk = 0.25 * pi * self.D_P * self.D_P  # (21)
        unit = 0.5 * flow.rho * disk * square
        force = Force((1.0 - self.t_P) * unit * C_T, unit * C_Y, unit * flow.L_pp * C_N)  # (16)
        return force, Slipstream(u_P, 0.125 * pi * square * C_T, self.D_P)

    def _coefficients(self, u_P: Scalar, blade: Scalar) -> Scalars:
        """(C_T, C_PY, C_PN) all round: printed quadrant, its opposite, and straight lines between them."""
        angle = atan2(u_P, blade) * _DEG
        turned = where(angle < 0, -1.0, 1.0)
        angle = where(angle < 0, angle + 180.0, angle)  # now within [0, 180]
        inside, beyond = clip(angle, 0.0, 90.0), clip(angle - 90.0, 0.0, 90.0) / 90.0
        C = zip(self._printed(inside), self._printed(90.0), self._printed(0.0), strict=True)
        return tuple(
            turned * where(beyond > 0, stopped - beyond * (stopped + bollard), here) for here, stopped, bollard in C
        )

    def _printed(self, phi: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """(C_T, C_PY, C_PN) at `phi` [deg] within [0, 90]."""
        C_T = self.T_0 + phi * (self.T_1 + phi * (self.T_2 + phi * self.T_3))  # (18)
        C_PY = self.Y_0 + phi * (self.Y_1 + phi * self.Y_2)  # (19)
        low, high = self.N_0 + self.N_1 * phi, self.N_2 + self.N_3 * phi
        return C_T, C_PY, where(phi < self.phi_N * _DEG, low, high)  # (20)
