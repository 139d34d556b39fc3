"""Rudder linear in its angle, for control design."""

from __future__ import annotations

from ..core.parameters import Scalar, spec
from ..core.values import dataclass
from . import Flow, Force, RudderModule, Slipstream
from .rudder import stream


@dataclass(frozen=True, kw_only=True)
class Linear(RudderModule):
    """Rudder with U_R = u_R and alpha_R = delta (Sawada 2024 Eqs. 30-32): small angles, no drift or yaw.

    X = -X_dd delta^2, Y = -Y_d delta, N = -N_d delta, whose factors grow with the square of the stream u_R.
    Astern both parts of u_R keep the sign of their own stream, as in the standard MMG rudder.
    """

    A_R: Scalar = spec("m^2", "movable area", (0.0, 1e4))
    f_alpha: Scalar = spec("", "slope of the normal force over the angle of attack (C_N there)", (0.0, 10.0))
    eta: Scalar = spec("", "propeller diameter over rudder height", (0.0, 1.0))
    t_R: Scalar = spec("", "steering resistance deduction factor", (-1.0, 1.0))
    a_H: Scalar = spec("", "rudder force induced on the hull, as a ratio", (-1.0, 5.0))
    x_H: Scalar = spec("m", "position of the induced force ahead of midship")
    x_R: Scalar = spec("m", "position of the rudder ahead of midship")
    epsilon: Scalar = spec("", "ratio of 1 - w at the rudder to that at the propeller", (0.0, 5.0))
    kappa: Scalar = spec("", "share of the race velocity that reaches the rudder", (0.0, 5.0))

    def factors(self, flow: Flow, slipstream: Slipstream) -> tuple[Scalar, Scalar, Scalar]:
        """X_dd [N/rad^2], Y_d [N/rad] and N_d [N m/rad] of Sawada 2024 Eq. 31, in this stream."""
        square = stream(slipstream, self.eta, self.kappa)  # (32)
        half = 0.5 * flow.rho * self.A_R * self.f_alpha * self.epsilon * self.epsilon * square
        # (31): sin^2 delta = delta^2 and sin(2 delta) = 2 delta
        return (1.0 - self.t_R) * half, (1.0 + self.a_H) * half, (self.x_R + self.a_H * self.x_H) * half

    def force(self, flow: Flow, slipstream: Slipstream) -> Force:
        X_dd, Y_d, N_d = self.factors(flow, slipstream)
        return Force(-X_dd * flow.delta * flow.delta, -Y_d * flow.delta, -N_d * flow.delta)  # Sawada 2024 (30)
