"""Propeller in all four quadrants of speed and revolutions: harbour manoeuvres and stopping."""

from __future__ import annotations

from typing import ClassVar

from ..core.parameters import Scalar, Scalars, choice, spec
from ..core.symbolic import both, clip, magnitude, speed, where
from ..core.values import dataclass
from . import Flow, Force, PropellerModule, Slipstream


@dataclass(frozen=True, kw_only=True)
class FourQuadrant(PropellerModule):
    """Propeller of Miyauchi et al. (2022), Sawada 2024 Eqs. 39-47.

    Ahead (n_P > 0) the open-water polynomial; reversed (n_P < 0) the thrust of Hasegawa and Fukutomi
    and the side force of Ueno et al.  At n_P = 0 there is no force, as in the authors' own code.
    Every coefficient stands on J_s = u/(n_P D_P); products with n_P^2 are written out, so that nothing
    is divided by n_P.  Misprints corrected: "v_p = 0" of Eq. 42 is w_P = 0; L_pp, not L_pp^2, in Eq. 43.
    `hand` declares to which side the swirl of the numbers A and B must push; `seatrial requirements` tests it.
    """

    mirror_symmetric: ClassVar[bool] = False

    hand: str = choice("hand of the propeller: its turn ahead, seen from astern", ("right", "left"), "right")
    D_P: Scalar = spec("m", "diameter", (1e-4, 50.0))
    pitch_ratio: Scalar = spec("", "pitch over diameter", (0.0, 5.0))
    t_P: Scalar = spec("", "thrust deduction factor ahead; 0 reversed", (-0.5, 1.0))
    w_P0: Scalar = spec("", "wake fraction in straight motion ahead; 0 astern", (-0.5, 1.0))
    tau: Scalar = spec("", "change of the wake by |v' + x_P' r'|")
    C_P: Scalar = spec("", "change of the wake by (v' + x_P' r')^2")
    x_P: Scalar = spec("m", "effective position ahead of midship")
    k_0: Scalar = spec("", "thrust coefficient at bollard pull", (0.0, 5.0))
    k_1: Scalar = spec("", "slope of the thrust coefficient over J_P")
    k_2: Scalar = spec("", "curvature of the thrust coefficient over J_P")
    A_1: Scalar = spec("", "sway force: reversed, J_syn <= J_s <= J_syn0")
    A_2: Scalar = spec("", "sway force: the same, by J_s")
    A_3: Scalar = spec("", "sway force: reversed, J_s < J_syn")
    A_4: Scalar = spec("", "sway force: the same, by J_s")
    A_5: Scalar = spec("", "sway force: reversed, J_s > J_syn0")
    A_6: Scalar = spec("", "sway force: astern at ahead revolutions, by J_s^2")
    A_7: Scalar = spec("", "sway force: the same, by J_s")
    A_8: Scalar = spec("", "sway force: the same, constant")
    B_1: Scalar = spec("", "yaw moment: reversed, J_syn <= J_s <= J_syn0")
    B_2: Scalar = spec("", "yaw moment: the same, by J_s")
    B_3: Scalar = spec("", "yaw moment: reversed, J_s < J_syn")
    B_4: Scalar = spec("", "yaw moment: the same, by J_s")
    B_5: Scalar = spec("", "yaw moment: reversed, J_s > J_syn0")
    B_6: Scalar = spec("", "yaw moment: astern at ahead revolutions, by J_s^2")
    B_7: Scalar = spec("", "yaw moment: the same, by J_s")
    B_8: Scalar = spec("", "yaw moment: the same, constant")
    C_3: Scalar = spec("", "thrust coefficient reversed, J_s < C_10")
    C_6: Scalar = spec("", "thrust coefficient reversed, J_s >= C_10, constant")
    C_7: Scalar = spec("", "the same, by J_s")
    C_10: Scalar = spec("", "J_s at which the reversed thrust stops changing", (-10.0, 0.0))
    J_syn: Scalar = spec("", "J_s below which the reversed side force follows A_3, A_4", (-10.0, 0.0))
    J_syn0: Scalar = spec("", "J_s above which the reversed side force is constant", (-10.0, 0.0))

    def force(self, flow: Flow) -> tuple[Force, Slipstream]:
        u_P = self._wake(flow) * flow.u
        nD, ud = flow.n_P * self.D_P, flow.u
        ahead = self.k_0 * nD * nD + self.k_1 * nD * u_P + self.k_2 * u_P * u_P
        reversed_ = where(ud <= self.C_10 * nD, self.C_6 * nD * nD + self.C_7 * nD * ud, self.C_3 * nD * nD)
        pull = where(nD > 0, ahead, where(nD < 0, reversed_, 0.0))
        deduction = where(nD < 0, 1.0, 1.0 - self.t_P)  # (41)
        area = 0.5 * flow.rho * flow.L_pp * flow.d
        A = (self.A_1, self.A_2, self.A_3, self.A_4, self.A_5, self.A_6, self.A_7, self.A_8)
        B = (self.B_1, self.B_2, self.B_3, self.B_4, self.B_5, self.B_6, self.B_7, self.B_8)
        force = Force(
            deduction * flow.rho * self.D_P * self.D_P * pull,  # (39), (45)
            area * self._side(nD, ud, A),  # (43), (46)
            area * flow.L_pp * self._side(nD, ud, B),  # (44), (47)
        )
        return force, Slipstream(u_P, pull, self.D_P)

    def _wake(self, flow: Flow) -> Scalar:
        """1 - w_P; the wake fraction is held within [0, 1]."""
        drift = (flow.v_m + self.x_P * flow.r) / speed(flow.u, flow.v_m)
        ahead = 1.0 - self.w_P0 + self.tau * magnitude(drift) + self.C_P * drift * drift  # (40)
        return where(flow.u > 0, clip(ahead, 0.0, 1.0), 1.0)  # (42)

    def _side(self, nD: Scalar, u: Scalar, c: Scalars) -> Scalar:
        """(n_P D_P)^2 times the side-force polynomial of the quadrant at work [m^2/s^2]."""
        square, cross = nD * nD, nD * u
        middle = c[0] * square + c[1] * cross
        fast = c[2] * square + c[3] * cross
        reversed_ = where(u > self.J_syn * nD, fast, where(u < self.J_syn0 * nD, c[4] * square, middle))
        astern = self.pitch_ratio * self.pitch_ratio * (c[5] * u * u + c[6] * cross + c[7] * square)
        return where(nD < 0, reversed_, where(both(nD > 0, u < 0), astern, 0.0))
