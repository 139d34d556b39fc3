"""The modified Abkowitz model: one polynomial for the hull, a thrust of its own, a rudder in its race."""

from __future__ import annotations

import math

from ..core.parameters import PRIME, Scalar, Scalars, spec
from ..core.symbolic import larger, magnitude, root, sign, speed
from ..core.values import dataclass
from ..environment import Environment
from ..forces import Flow
from . import Model
from .abkowitz import Body
from .common import Loads, Surroundings

# Bounds of r' and of the drift angle at the rudder [rad] beyond which a division by U or c no longer grows.
_TURNING, _DRIFTING = 5.0, 3.0
# Least flow past the rudder that divides [m/s].
_STILL = 1e-6


@dataclass(frozen=True, kw_only=True)
class Race:
    """The propeller and the water it throws at the rudder.

    u_Ainf = -(1 - w)u + sqrt((1 - w)^2 u^2 + 8/pi K_T (n D)^2) is what the propeller adds far behind itself, and
    c^2 = A_P/A_R ((1 - w)u + k u_Ainf)^2 + (1 - A_P/A_R)(1 - w)^2 u^2 the square of the flow past the rudder
    (Abkowitz 1980).  A square keeps the sign of what is squared, and so does c: astern the water comes from behind.
    """

    D_P: Scalar = spec("m", "diameter of the propeller", (1e-3, 100.0))
    k_0: Scalar = spec("", "K_T = k_0 + k_1 J + k_2 J^2")
    k_1: Scalar = spec("", "K_T by J")
    k_2: Scalar = spec("", "K_T by J^2")
    w: Scalar = spec("", "wake fraction at propeller and rudder", (-1.0, 1.0))
    k: Scalar = spec("", "part of u_Ainf that has come about at the rudder", (0.0, 2.0))
    washed: Scalar = spec("", "A_P/A_R, part of the rudder's area in the race", (0.0, 1.0))

    def flow(self, u: Scalar, n: Scalar) -> tuple[Scalar, Scalar]:
        """c, the flow past the rudder from ahead, and u_Ainf [m/s]."""
        u_A, nD = (1.0 - self.w) * u, n * self.D_P
        turns, runs = magnitude(nD), magnitude(u_A)
        K_T_nD2 = self.k_0 * nD * turns + (self.k_1 * turns + self.k_2 * runs) * u_A
        u_Ainf = root(u_A * u_A + 8.0 / math.pi * K_T_nD2) - runs
        u_P = u_A + self.k * u_Ainf
        square = self.washed * u_P * magnitude(u_P) + (1.0 - self.washed) * u_A * magnitude(u_A)
        return sign(square) * root(magnitude(square)), u_Ainf


@dataclass(frozen=True, kw_only=True)
class Derivatives:
    """The numbers of Sawada 2024 Eqs. 21 to 23, in primes: forces over 0.5 rho L^2, the moment over 0.5 rho L^3."""

    eta_1: Scalar = spec(PRIME, "thrust by u^2")
    eta_2: Scalar = spec(PRIME, "thrust by n u L")
    eta_3: Scalar = spec(PRIME, "thrust by n^2 L^2")
    C_R: Scalar = spec(PRIME, "resistance over 0.5 rho S u^2", (0.0, math.inf))
    S: Scalar = spec(PRIME, "wetted surface over L^2", (0.0, math.inf))
    X_vv: Scalar = spec(PRIME, "surge force by v_m^2")
    X_ee: Scalar = spec(PRIME, "surge force by c^2 e^2")
    X_rr: Scalar = spec(PRIME, "surge force by r^2")
    X_vr: Scalar = spec(PRIME, "surge force by v_m r")
    X_vvrr: Scalar = spec(PRIME, "surge force by v_m^2 r^2/U^2")
    Y_0: Scalar = spec(PRIME, "sway force by (u_Ainf/2)^2: the bias of a single screw")
    Y_v: Scalar = spec(PRIME, "sway force by U v_m")
    Y_r: Scalar = spec(PRIME, "sway force by U r")
    Y_d: Scalar = spec(PRIME, "sway force by c^2 delta, and by the drift at the rudder where c is not c_0")
    Y_vvv: Scalar = spec(PRIME, "sway force by v_m^3/U")
    Y_vvr: Scalar = spec(PRIME, "sway force by v_m^2 r/U")
    Y_vrr: Scalar = spec(PRIME, "sway force by v_m r^2/U")
    Y_rrr: Scalar = spec(PRIME, "sway force by r^3/U")
    Y_eee: Scalar = spec(PRIME, "sway force by c^2 e^3")
    N_0: Scalar = spec(PRIME, "yaw moment by (u_Ainf/2)^2: the bias of a single screw")
    N_v: Scalar = spec(PRIME, "yaw moment by U v_m")
    N_r: Scalar = spec(PRIME, "yaw moment by U r")
    N_d: Scalar = spec(PRIME, "yaw moment by c^2 delta, and by the drift at the rudder where c is not c_0")
    N_vvv: Scalar = spec(PRIME, "yaw moment by v_m^3/U")
    N_vvr: Scalar = spec(PRIME, "yaw moment by v_m^2 r/U")
    N_vrr: Scalar = spec(PRIME, "yaw moment by v_m r^2/U")
    N_rrr: Scalar = spec(PRIME, "yaw moment by r^3/U")
    N_eee: Scalar = spec(PRIME, "yaw moment by c^2 e^3")


@dataclass(frozen=True, kw_only=True)
class ModifiedAbkowitz(Model):
    """Sawada 2024 Eqs. 21 to 23 (Abkowitz 1980; Hwang 1980), with the dimensions put right.

    Forces over 0.5 rho L^2, the moment over 0.5 rho L^3; masses as in the Abkowitz model, with the terms of the
    turning axes apart.  e = delta + (v_m - r L/2)/c is the angle of the flow at the rudder; delta turns to
    starboard, so Y_d is negative and N_d positive.

    Changed from the print: powers of L as the dimensions want them; n^2 and u^2 carry their sign, so that a
    propeller pushes astern when it turns astern; the terms with c - c_0 are what c^2 e gains at first order in v_m
    and r, of the same sense in both rows; c_0 is proportional to U, one number for every speed.
    """

    body: Body
    race: Race
    derivatives: Derivatives
    c_0: Scalar = spec(PRIME, "c over U in a steady straight run", (0.0, math.inf))

    @property
    def asymmetries(self) -> tuple[str, ...]:
        """The bias of a single screw."""
        return "derivatives.Y_0", "derivatives.N_0"

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        around = Surroundings.of(state, environment)
        u, v, r = around.u_r, around.v_r, around.r * self.body.L_pp
        n_P, delta = control
        return around.rates(self.body.acceleration(self.force(u, v, r, n_P * self.body.L_pp, delta), u, v, r))

    def pushed(self, push: Scalars) -> Scalars:
        return self.body.pushed((push[0], push[1], push[2]))

    def loads(self, flow: Flow, rates: Scalars) -> Loads:
        """What a captive test measures."""
        u, v, r, n = flow.u, flow.v_m, flow.r * flow.L_pp, flow.n_P * flow.L_pp
        return self.body.restrained(self.force(u, v, r, n, flow.delta), flow, rates)

    def force(self, u: Scalar, v: Scalar, r: Scalar, n: Scalar, delta: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """X, Y, N over 0.5 rho L^2, 0.5 rho L^2, 0.5 rho L^3 [m^2/s^2]; r and n are times L_pp [m/s]."""
        at, c, u_Ainf = self.derivatives, *self.race.flow(u, n / self.body.L_pp)
        U = larger(speed(u, v), magnitude(r) / _TURNING)
        bias = 0.25 * u_Ainf * u_Ainf
        drift, ahead = v - 0.5 * r, magnitude(c)
        ce = c * delta + drift
        lift = c * ahead * delta + (ahead - self.c_0 * U) * drift
        stall = ce * ce * ce / larger(larger(ahead, magnitude(drift) / _DRIFTING), _STILL)
        vv, vr, rr = v * v / U, v * r / U, r * r / U
        X = (  # (21)
            (at.eta_1 - at.C_R * at.S) * u * magnitude(u) + at.eta_2 * n * u + at.eta_3 * n * magnitude(n)
            + at.X_vv * v * v + at.X_ee * ce * ce + at.X_rr * r * r + at.X_vr * v * r + at.X_vvrr * vr * vr
        )  # fmt: skip
        Y = (  # (22)
            at.Y_0 * bias + U * (at.Y_v * v + at.Y_r * r) + at.Y_d * lift + at.Y_eee * stall
            + (at.Y_vvv * v + at.Y_vvr * r) * vv + at.Y_vrr * v * rr + at.Y_rrr * r * rr
        )  # fmt: skip
        N = (  # (23)
            at.N_0 * bias + U * (at.N_v * v + at.N_r * r) + at.N_d * lift + at.N_eee * stall
            + (at.N_vvv * v + at.N_vvr * r) * vv + at.N_vrr * v * rr + at.N_rrr * r * rr
        )  # fmt: skip
        return X, Y, N
