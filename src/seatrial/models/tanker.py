"""The form of van Berlekom and Goddard (1972) for tankers: 'bis' system, in deep and in shallow water."""

from __future__ import annotations

from math import inf

from ..core.parameters import PRIME, Scalar, Scalars, spec
from ..core.symbolic import atan2, larger, magnitude, smaller, where
from ..core.values import dataclass
from ..environment import Environment
from . import Model
from .common import Surroundings

# Draught over depth from which on the water is held to be no shallower: z = d/(h - d) is then 19.
_SHALLOWEST = 0.95


@dataclass(frozen=True, kw_only=True)
class Body:
    """Size and masses in the 'bis' system, where the ship's own mass is the unit; origin midship."""

    L_pp: Scalar = spec("m", "length between perpendiculars", (1e-3, 1e3))
    d: Scalar = spec("m", "draught", (1e-4, 100.0))
    m_11: Scalar = spec(PRIME, "mass in surge, 1 - X_udot", (1e-3, inf))
    m_22: Scalar = spec(PRIME, "mass in sway, 1 - Y_vdot", (1e-3, inf))
    m_33: Scalar = spec(PRIME, "inertia in yaw over m L^2, k_z^2 - N_rdot", (1e-6, inf))
    X_udotz: Scalar = spec(PRIME, "surge force by surge acceleration and z", default=0.0)
    Y_vdotz: Scalar = spec(PRIME, "sway force by sway acceleration and z", default=0.0)
    N_rdotz: Scalar = spec(PRIME, "yaw moment by yaw acceleration and z", default=0.0)

    def acceleration(self, X: Scalar, Y: Scalar, N: Scalar, z: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Rates of u, v_m, r under forces over the ship's mass, times L, and the moment over it [m^2/s^2]."""
        L = self.L_pp
        return (
            X / (L * (self.m_11 - self.X_udotz * z)),
            Y / (L * (self.m_22 - self.Y_vdotz * z)),
            N / (L * L * (self.m_33 - self.N_rdotz * z)),
        )


@dataclass(frozen=True, kw_only=True)
class Screw:
    """Thrust and the flow past the rudder, both as squares of u and n_P.

    Thrust over the ship's mass is T = T_uu u |u|/L + T_un u |n| + T_nn L n |n| [m/s^2], as printed where u and n
    are positive and its own opposite where both are negative.  The flow past the rudder is c^2 = c_un u n + c_nn n^2;
    only c^2 enters, so its root is never taken.  A propeller that stands or turns astern leaves the rudder none,
    and neither does one whose c^2 would be negative.
    """

    t: Scalar = spec("", "thrust deduction", (0.0, 1.0))
    T_uu: Scalar = spec(PRIME, "thrust by u^2/L")
    T_un: Scalar = spec(PRIME, "thrust by u n_P")
    T_nn: Scalar = spec(PRIME, "thrust by L n_P^2")
    c_un: Scalar = spec("m", "square of the flow past the rudder by u n_P")
    c_nn: Scalar = spec("m^2", "square of the flow past the rudder by n_P^2")

    def thrust(self, u: Scalar, n: Scalar, L: Scalar) -> Scalar:
        """Thrust over the ship's mass [m/s^2]."""
        turns = magnitude(n)
        return (self.T_uu * magnitude(u) / L + self.T_un * turns) * u + self.T_nn * L * n * turns

    def flow(self, u: Scalar, n: Scalar) -> Scalar:
        """c^2, the square of the flow past the rudder [m^2/s^2]."""
        return larger(where(n > 0, n * (self.c_un * u + self.c_nn * n), 0.0), 0.0)


@dataclass(frozen=True, kw_only=True)
class Tanker(Model):
    """A tanker of one screw with the terms of van Berlekom and Goddard (1972).

    X, Y over the ship's weight per unit of g, N over that times L.  `z` in a name marks a shallow-water term, over
    z = d/(h - d) with the depth h from the environment; `b` is beta = atan(v_m/u), `c` the flow past the rudder and
    `d` its angle, all by their signs and magnitudes as printed.  It was made for running ahead; astern, where it
    was never fitted, resistance and damping turn round with u, so that it stays finite and at rest silent.
    """

    body: Body
    screw: Screw

    d_11: Scalar = spec(PRIME, "surge force by v_m r, 1 + X_vr: the turning axes in it")
    d_22: Scalar = spec(PRIME, "sway force by u r, Y_ur - 1: the turning axes in it")
    d_33: Scalar = spec(PRIME, "yaw moment by u r, N_ur - x_G: the turning axes in it")
    X_uu: Scalar = spec(PRIME, "surge force by u^2: the resistance")
    X_vv: Scalar = spec(PRIME, "surge force by v_m^2")
    X_ccdd: Scalar = spec(PRIME, "surge force by c^2 delta^2")
    X_ccbd: Scalar = spec(PRIME, "surge force by c^2 beta delta")
    Y_uv: Scalar = spec(PRIME, "sway force by u v_m")
    Y_vv: Scalar = spec(PRIME, "sway force by v_m |v_m|")
    Y_ccd: Scalar = spec(PRIME, "sway force by c^2 delta")
    Y_ccbbd: Scalar = spec(PRIME, "sway force by c^2 beta |beta| |delta|")
    Y_T: Scalar = spec(PRIME, "sway force by thrust")
    N_uv: Scalar = spec(PRIME, "yaw moment by u v_m")
    N_vr: Scalar = spec(PRIME, "yaw moment by |v_m| r")
    N_ccd: Scalar = spec(PRIME, "yaw moment by c^2 delta")
    N_ccbbd: Scalar = spec(PRIME, "yaw moment by c^2 beta |beta| |delta|")
    N_T: Scalar = spec(PRIME, "yaw moment by thrust")
    X_uuz: Scalar = spec(PRIME, "surge force by u^2 z", default=0.0)
    X_vrz: Scalar = spec(PRIME, "surge force by v_m r z", default=0.0)
    X_vvzz: Scalar = spec(PRIME, "surge force by v_m^2 z^2", default=0.0)
    Y_urz: Scalar = spec(PRIME, "sway force by u r z", default=0.0)
    Y_vvz: Scalar = spec(PRIME, "sway force by v_m |v_m| z", default=0.0)
    Y_uvz: Scalar = spec(PRIME, "sway force by u v_m z in very shallow water, times 1 - z_uv/z", default=0.0)
    z_uv: Scalar = spec(PRIME, "z above which Y_uvz acts", (1e-3, inf), default=0.8)
    Y_ccbbdz: Scalar = spec(PRIME, "sway force by c^2 beta |beta| |delta| z", default=0.0)
    N_urz: Scalar = spec(PRIME, "yaw moment by u r z", default=0.0)
    N_uvz: Scalar = spec(PRIME, "yaw moment by u v_m z", default=0.0)
    N_vrz: Scalar = spec(PRIME, "yaw moment by |v_m| r z", default=0.0)
    N_ccbbdz: Scalar = spec(PRIME, "yaw moment by c^2 beta |beta| |delta| z", default=0.0)

    @property
    def asymmetries(self) -> tuple[str, ...]:
        """Side force and moment of the single screw."""
        return "Y_T", "N_T"

    @property
    def draught(self) -> Scalar:
        return self.body.d

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        around, body = Surroundings.of(state, environment), self.body
        L = body.L_pp
        q = smaller(body.d * environment.per_depth, _SHALLOWEST)
        z = q / (1.0 - q)
        X, Y, N = self.force(around.u_r, around.v_r, around.r * L, control[0], control[1], z)
        return around.rates(body.acceleration(X, Y, N, z))

    def pushed(self, push: Scalars) -> Scalars:
        return self.body.acceleration(self.body.L_pp * push[0], self.body.L_pp * push[1], push[2], 0.0)

    def force(
        self, u: Scalar, v: Scalar, r: Scalar, n: Scalar, delta: Scalar, z: Scalar
    ) -> tuple[Scalar, Scalar, Scalar]:
        """X L, Y L and N over the ship's mass [m^2/s^2]; r is the rate of turn times L_pp [m/s]."""
        T = self.screw.thrust(u, n, self.body.L_pp) * self.body.L_pp
        cc = self.screw.flow(u, n)
        ahead, aside = magnitude(u), magnitude(v)
        beta = atan2(v, ahead)
        pull = cc * beta * magnitude(beta) * magnitude(delta)
        beyond = self.Y_uvz * larger(z - self.z_uv, 0.0)
        X = (
            (self.X_uu + self.X_uuz * z) * u * ahead + (self.d_11 + self.X_vrz * z) * v * r
            + (self.X_vv + self.X_vvzz * z * z) * v * v + cc * delta * (self.X_ccdd * delta + self.X_ccbd * beta)
            + T * (1.0 - self.screw.t)
        )  # fmt: skip
        Y = (
            (self.Y_uv * ahead + (self.Y_vv + self.Y_vvz * z) * aside) * v + beyond * ahead * v
            + (self.d_22 + self.Y_urz * z) * u * r + self.Y_ccd * cc * delta
            + (self.Y_ccbbd + self.Y_ccbbdz * z) * pull + self.Y_T * T
        )  # fmt: skip
        N = (
            (self.N_uv + self.N_uvz * z) * u * v + (self.N_vr + self.N_vrz * z) * aside * r
            + (self.d_33 + self.N_urz * z) * ahead * r + self.N_ccd * cc * delta
            + (self.N_ccbbd + self.N_ccbbdz * z) * pull + self.N_T * T
        )  # fmt: skip
        return X, Y, N
