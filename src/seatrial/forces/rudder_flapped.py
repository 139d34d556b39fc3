"""Rudder with a flap that follows its angle."""

from __future__ import annotations

from math import pi

from ..core.parameters import Scalar, choice, spec
from ..core.symbolic import TINY, atan2, clip, cos, larger, magnitude, root, sin, smaller, speed, where
from ..core.values import dataclass
from . import Flow, Force, RudderModule, Slipstream
from .rudder import on_hull

_BLADE = 0.7 * pi
# Hensen, Tug Use in Port, as quoted by pilots: absolute flap angle three times the helm where it is
# small, twice where it is large; relative to the rudder twice, falling to once at this helm.
_HENSEN = 35.0 * pi / 180.0


@dataclass(frozen=True, kw_only=True)
class Flapped(RudderModule):
    """Flapped rudder of Okuda et al. (2023), as printed in Suyama 2023 Eqs. 25-36.

    F_N = 0.5 rho A_R U_R^2 {f_alpha(delta_f) sin(alpha_R) + C_l0(delta_f)}, delta_f [rad] relative to the
    rudder.  The paper leaves two things open, so they are choices.

    `flap`: "none" is delta_f = 0, "equal" delta_f = delta, "double" 2 delta, "hensen" 2 delta falling to
    delta at 35 deg; all held to `delta_f_max`.

    `slipstream`: what "8 K_T/(pi J_P^2)" of Eq. 30 means.  "consistent": the K_T of the thrust, which is
    C_T V_r^2/u_P^2 there; "literal": the C_T of Eq. 18 in place of K_T, with J_P = u_P/(n_P D_P).

    Astern the floor of Eq. 29 counts from the velocity of the stream, so that u_R is continuous.
    """

    flap: str = choice("flap angle by rudder angle", ("none", "equal", "double", "hensen"), "equal")
    slipstream: str = choice("reading of Suyama 2023 Eq. 30", ("consistent", "literal"), "consistent")
    A_R: Scalar = spec("m^2", "movable area, flap included", (0.0, 1e4))
    eta: Scalar = spec("", "propeller diameter over rudder height", (0.0, 1.0))
    t_R: Scalar = spec("", "steering resistance deduction factor", (-1.0, 1.0))
    a_H: Scalar = spec("", "rudder force induced on the hull, as a ratio", (-1.0, 5.0))
    x_H: Scalar = spec("m", "position of the induced force ahead of midship")
    x_R: Scalar = spec("m", "position of the rudder ahead of midship")
    epsilon: Scalar = spec("", "ratio of 1 - w at the rudder to that at the propeller", (0.0, 5.0))
    kappa: Scalar = spec("", "share of the race velocity that reaches the rudder", (0.0, 5.0))
    u_R0: Scalar = spec("", "least inflow, as a ratio of the speed of the blades", (0.0, 1.0))
    l_R: Scalar = spec("m", "effective position of the rudder in a yawing flow")
    gamma_Rp: Scalar = spec("", "flow straightening for beta_R > 0", (0.0, 5.0))
    gamma_Rn: Scalar = spec("", "flow straightening for beta_R < 0", (0.0, 5.0))
    f_0: Scalar = spec("", "slope of the normal force over the angle of attack, flap in line", (0.0, 10.0))
    f_2: Scalar = spec("", "change of that slope by delta_f^2")
    l_1: Scalar = spec("", "normal force without attack by delta_f")
    l_3: Scalar = spec("", "normal force without attack by delta_f^3")
    delta_f_max: Scalar = spec("rad", "greatest flap angle relative to the rudder", (0.0, 0.5 * pi))

    def force(self, flow: Flow, slipstream: Slipstream) -> Force:
        u_R, v_R = self._along(flow, slipstream), self._across(flow)
        delta_f = self.flap_angle(flow.delta)
        f_alpha = self.f_0 + self.f_2 * delta_f * delta_f  # (35)
        C_l0 = delta_f * (self.l_1 + self.l_3 * delta_f * delta_f)  # (36)
        U_R = speed(u_R, v_R)  # (27)
        attack = u_R * sin(flow.delta) - v_R * cos(flow.delta)  # U_R sin(alpha_R), (28)
        F_N = 0.5 * flow.rho * self.A_R * (f_alpha * U_R * attack + C_l0 * (u_R * u_R + v_R * v_R))  # (26)
        return on_hull(F_N, flow.delta, self.t_R, self.a_H, self.x_R, self.x_H)  # (25)

    def flap_angle(self, delta: Scalar) -> Scalar:
        """Angle of the flap relative to the rudder [rad] at rudder angle `delta` [rad]."""
        ratio = {
            "none": 0.0, "equal": 1.0, "double": 2.0,
            "hensen": larger(2.0 - magnitude(delta) / _HENSEN, 1.0),
        }[self.flap]  # fmt: skip
        return clip(ratio * delta, -self.delta_f_max, self.delta_f_max)

    def _along(self, flow: Flow, slipstream: Slipstream) -> Scalar:
        """Longitudinal inflow velocity u_R [m/s]."""
        u_P, nD = slipstream.u_P, flow.n_P * slipstream.D_P
        pull = 8.0 / pi * slipstream.K_T_nD2
        if self.slipstream == "literal":
            pull = pull * (8.0 / pi) * nD * nD / (u_P * u_P + _BLADE * _BLADE * nD * nD + TINY)
        gain = root(u_P * u_P + pull) - magnitude(u_P)
        behind = self.epsilon * (u_P + self.eta * self.kappa * gain)  # (30)
        least = _BLADE * nD * self.u_R0 + self.epsilon * smaller(u_P, 0.0)
        return larger(behind, least)  # (29)

    def _across(self, flow: Flow) -> Scalar:
        """Lateral inflow velocity v_R [m/s]."""
        beta = atan2(-flow.v_m, magnitude(flow.u))
        beta_R = speed(flow.u, flow.v_m) * beta - self.l_R * flow.r  # (34), times U
        gamma_R = where(beta_R > 0, self.gamma_Rp, self.gamma_Rn)  # (33)
        return -gamma_R * (flow.v_m + self.l_R * flow.r)  # (32)
