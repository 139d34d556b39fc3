"""Rudder of the standard MMG model."""

from __future__ import annotations

from math import pi

from ..core.parameters import Scalar, spec
from ..core.symbolic import atan2, cos, magnitude, root, sign, sin, speed, where
from ..core.values import dataclass
from . import Flow, Force, RudderModule, Slipstream


def signed_root(square: Scalar) -> Scalar:
    """Velocity whose signed square is given: sgn(q) sqrt|q|."""
    return sign(square) * root(magnitude(square))


def stream(slipstream: Slipstream, eta: Scalar, kappa: Scalar) -> Scalar:
    """Square of the flow along the rudder over epsilon^2 [m^2/s^2], each part with the sign of its own stream."""
    u_P = slipstream.u_P
    gain = root(u_P * u_P + 8.0 / pi * slipstream.K_T_nD2) - magnitude(u_P)
    behind = u_P + kappa * gain
    return eta * behind * magnitude(behind) + (1.0 - eta) * u_P * magnitude(u_P)


def normal_force(flow: Flow, area: Scalar, u_R: Scalar, v_R: Scalar) -> Scalar:
    """Normal force 0.5 rho A_R f_alpha U_R^2 sin(delta - atan2(v_R, u_R)) [N], `area` being A_R f_alpha.

    U_R sin(delta - atan2(v_R, u_R)) = u_R sin(delta) - v_R cos(delta): smooth through rest, no angle.
    """
    across = u_R * sin(flow.delta) - v_R * cos(flow.delta)  # Sawada 2024 (54)
    return 0.5 * flow.rho * area * speed(u_R, v_R) * across  # Sawada 2024 (51), (53)


def on_hull(F_N: Scalar, delta: Scalar, t_R: Scalar, a_H: Scalar, x_R: Scalar, x_H: Scalar) -> Force:
    """Force of a rudder with normal force `F_N` on the ship, what it induces on the hull included."""
    across = F_N * cos(delta)
    return Force(
        -(1.0 - t_R) * F_N * sin(delta),  # Sawada 2024 (48)
        -(1.0 + a_H) * across,  # Sawada 2024 (49), misprint corrected
        -(x_R + a_H * x_H) * across,  # Sawada 2024 (50)
    )


@dataclass(frozen=True, kw_only=True)
class Standard(RudderModule):
    """Rudder of Yasukawa and Yoshimura (2015).

    u_R = epsilon sqrt(eta {u_P + kappa (sqrt(u_P^2 + 8 K_T (nD)^2/pi) - u_P)}^2 + (1 - eta) u_P^2) and
    v_R = U gamma_R (beta - l_R' r').  Astern both parts of u_R keep the sign of their own stream, and
    the drift angle is counted from the stern.
    """

    A_R: Scalar = spec("m^2", "movable area", (0.0, 1e4))
    f_alpha: Scalar = spec("", "slope of the normal force over the angle of attack", (0.0, 10.0))
    eta: Scalar = spec("", "propeller diameter over rudder height", (0.0, 1.0))
    t_R: Scalar = spec("", "steering resistance deduction factor", (-1.0, 1.0))
    a_H: Scalar = spec("", "rudder force induced on the hull, as a ratio", (-1.0, 5.0))
    x_H: Scalar = spec("m", "position of the induced force ahead of midship")
    x_R: Scalar = spec("m", "position of the rudder ahead of midship")
    epsilon: Scalar = spec("", "ratio of 1 - w at the rudder to that at the propeller", (0.0, 5.0))
    kappa: Scalar = spec("", "share of the race velocity that reaches the rudder", (0.0, 5.0))
    l_R: Scalar = spec("m", "effective position of the rudder in a yawing flow")
    gamma_Rp: Scalar = spec("", "flow straightening for beta_R > 0", (0.0, 5.0))
    gamma_Rn: Scalar = spec("", "flow straightening for beta_R < 0", (0.0, 5.0))

    def force(self, flow: Flow, slipstream: Slipstream) -> Force:
        u_R, v_R = self._inflow(flow, slipstream)
        F_N = normal_force(flow, self.A_R * self.f_alpha, u_R, v_R)
        return on_hull(F_N, flow.delta, self.t_R, self.a_H, self.x_R, self.x_H)

    def _inflow(self, flow: Flow, slipstream: Slipstream) -> tuple[Scalar, Scalar]:
        square = stream(slipstream, self.eta, self.kappa)
        beta = atan2(-flow.v_m, magnitude(flow.u))
        across = speed(flow.u, flow.v_m) * beta - self.l_R * flow.r  # U beta_R
        gamma_R = where(across > 0, self.gamma_Rp, self.gamma_Rn)
        return self.epsilon * signed_root(square), gamma_R * across
