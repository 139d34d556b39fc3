"""Rudder behind a propeller that may stop or turn astern: harbour manoeuvres."""

from __future__ import annotations

from math import pi

from ..core.parameters import Scalar, spec
from ..core.symbolic import both, magnitude, root, sign, where
from ..core.values import dataclass
from . import Flow, Force, RudderModule, Slipstream
from .rudder import normal_force, on_hull, signed_root


@dataclass(frozen=True, kw_only=True)
class LowSpeed(RudderModule):
    """Rudder of Miyauchi et al. (2022), Sawada 2024 Eqs. 48-60.

    Three inflows: a propeller that pushes ahead (Yoshimura and Nomoto), one that stands or is reversed
    while the ship moves ahead (Kitagawa), and the ship's own velocity astern.  Misprints corrected:
    the root of Eq. 56, C_PR u^2 in Eq. 58, whose second term has no sign in the authors' code.
    """

    A_R: Scalar = spec("m^2", "movable area", (0.0, 1e4))
    f_alpha: Scalar = spec("", "slope of the normal force over the angle of attack", (0.0, 10.0))
    eta: Scalar = spec("", "propeller diameter over rudder height", (0.0, 1.0))
    t_R: Scalar = spec("", "steering resistance deduction factor", (-1.0, 1.0))
    a_H: Scalar = spec("", "rudder force induced on the hull, as a ratio", (-1.0, 5.0))
    x_H: Scalar = spec("m", "position of the induced force ahead of midship")
    x_R: Scalar = spec("m", "position of the rudder ahead of midship")
    epsilon: Scalar = spec("", "ratio of 1 - w at the rudder to that at the propeller", (1e-3, 5.0))
    k_x: Scalar = spec("", "share of the race velocity that reaches the rudder", (0.0, 5.0))
    k_xPR: Scalar = spec("", "the same for a reversed propeller", (0.0, 5.0))
    C_PR: Scalar = spec("", "correction of the squared inflow for a reversed propeller", (-5.0, 5.0))
    l_R: Scalar = spec("m", "effective position of the rudder in a yawing flow")
    gamma_P: Scalar = spec("", "flow straightening for v_m + x_R r >= 0", (0.0, 5.0))
    gamma_N: Scalar = spec("", "flow straightening for v_m + x_R r < 0", (0.0, 5.0))

    def force(self, flow: Flow, slipstream: Slipstream) -> Force:
        gamma = where(flow.v_m + self.x_R * flow.r >= 0, self.gamma_P, self.gamma_N)
        v_R = -gamma * (flow.v_m + self.l_R * flow.r)  # (55)
        F_N = normal_force(flow, self.A_R * self.f_alpha, self._along(flow, slipstream), v_R)
        return on_hull(F_N, flow.delta, self.t_R, self.a_H, self.x_R, self.x_H)

    def _along(self, flow: Flow, slipstream: Slipstream) -> Scalar:
        """Longitudinal inflow velocity u_R [m/s]."""
        u_P, pull = slipstream.u_P, 8.0 / pi * slipstream.K_T_nD2
        pushing = both(flow.n_P > 0, pull > 0)
        behind = u_P + self.k_x / self.epsilon * (root(u_P * u_P + pull) - u_P)
        ahead = self.epsilon * root(self.eta * behind * behind + (1.0 - self.eta) * u_P * u_P)  # (56)
        outside = self.epsilon * u_P  # (60)
        inside = outside + self.k_xPR * sign(flow.n_P) * root(magnitude(pull))  # (59)
        square = (
            self.eta * inside * magnitude(inside) + (1.0 - self.eta) * outside * outside + self.C_PR * flow.u * flow.u
        )  # (58)
        return where(pushing, ahead, where(flow.u >= 0, signed_root(square), flow.u))  # (57)
