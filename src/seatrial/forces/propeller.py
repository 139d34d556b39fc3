"""Propeller of the standard MMG model, with either of its two published wake formulas."""

from __future__ import annotations

from ..core.parameters import Scalar, spec
from ..core.symbolic import atan2, exp, magnitude, speed, where
from ..core.values import dataclass
from . import Flow, Force, PropellerModule, Slipstream


def race(n_P: Scalar, u_P: Scalar, D_P: Scalar, k_0: Scalar, k_1: Scalar, k_2: Scalar) -> Scalar:
    """K_T (n_P D_P)^2 [m^2/s^2] for K_T = k_0 + k_1 J + k_2 J^2, J = u_P/(n_P D_P), without a division.

    Turned round for reversed revolutions or inflow, so that the thrust is odd and continuous.
    """
    nD, a = n_P * D_P, magnitude(n_P * D_P)
    return k_0 * nD * a + k_1 * a * u_P + k_2 * u_P * magnitude(u_P)


def inflow_angle(flow: Flow, x_P: Scalar) -> Scalar:
    """Drift angle at the propeller beta - x_P' r' [rad]; astern the drift is counted from the stern."""
    beta = atan2(-flow.v_m, magnitude(flow.u))
    return beta - x_P * flow.r / speed(flow.u, flow.v_m)


def thrust(flow: Flow, t_P: Scalar, D_P: Scalar, u_P: Scalar, K_T_nD2: Scalar) -> tuple[Force, Slipstream]:
    """Surge force of a propeller and the slipstream it leaves."""
    X = (1.0 - t_P) * flow.rho * D_P * D_P * K_T_nD2  # Sawada 2024 (39)
    return Force(X, 0.0, 0.0), Slipstream(u_P, K_T_nD2, D_P)


@dataclass(frozen=True, kw_only=True)
class Standard(PropellerModule):
    """Propeller of Yasukawa and Yoshimura (2015), with their wake in manoeuvring motion.

    (1 - w_P)/(1 - w_P0) = 1 + {1 - exp(-C_1 |beta_P|)} (C_2 - 1), beta_P = beta - x_P' r'.
    """

    D_P: Scalar = spec("m", "diameter", (1e-4, 50.0))
    t_P: Scalar = spec("", "thrust deduction factor", (-0.5, 1.0))
    w_P0: Scalar = spec("", "wake fraction in straight motion", (-0.5, 1.0))
    C_1: Scalar = spec("", "how fast the wake changes with drift at the propeller", (0.0, 100.0))
    C_2p: Scalar = spec("", "final ratio of 1 - w_P for beta_P > 0", (0.0, 10.0))
    C_2n: Scalar = spec("", "final ratio of 1 - w_P for beta_P < 0", (0.0, 10.0))
    x_P: Scalar = spec("m", "effective position ahead of midship")
    k_0: Scalar = spec("", "thrust coefficient at bollard pull", (0.0, 5.0))
    k_1: Scalar = spec("", "slope of the thrust coefficient over J")
    k_2: Scalar = spec("", "curvature of the thrust coefficient over J")

    def force(self, flow: Flow) -> tuple[Force, Slipstream]:
        beta_P = inflow_angle(flow, self.x_P)
        C_2 = where(beta_P > 0, self.C_2p, self.C_2n)
        change = 1.0 + (1.0 - exp(-self.C_1 * magnitude(beta_P))) * (C_2 - 1.0)
        u_P = (1.0 - self.w_P0) * change * flow.u
        pull = race(flow.n_P, u_P, self.D_P, self.k_0, self.k_1, self.k_2)
        return thrust(flow, self.t_P, self.D_P, u_P, pull)


@dataclass(frozen=True, kw_only=True)
class KoseWake(PropellerModule):
    """The same propeller in the older wake w_P = w_P0 exp(-4 beta_P^2) (Kose; used by ShipMMG)."""

    D_P: Scalar = spec("m", "diameter", (1e-4, 50.0))
    t_P: Scalar = spec("", "thrust deduction factor", (-0.5, 1.0))
    w_P0: Scalar = spec("", "wake fraction in straight motion", (-0.5, 1.0))
    x_P: Scalar = spec("m", "effective position ahead of midship (x_P' = -0.690 in ShipMMG)")
    k_0: Scalar = spec("", "thrust coefficient at bollard pull", (0.0, 5.0))
    k_1: Scalar = spec("", "slope of the thrust coefficient over J")
    k_2: Scalar = spec("", "curvature of the thrust coefficient over J")

    def force(self, flow: Flow) -> tuple[Force, Slipstream]:
        beta_P = inflow_angle(flow, self.x_P)
        u_P = (1.0 - self.w_P0 * exp(-4.0 * beta_P * beta_P)) * flow.u
        pull = race(flow.n_P, u_P, self.D_P, self.k_0, self.k_1, self.k_2)
        return thrust(flow, self.t_P, self.D_P, u_P, pull)
