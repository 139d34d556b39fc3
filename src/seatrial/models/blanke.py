"""The family of Blanke and Christensen (1993): a fast naval ship that rolls, by a table of dimensional numbers."""

from __future__ import annotations

from math import inf

from ..core.parameters import Parts, Scalar, Scalars, choice, parts, spec
from ..core.symbolic import magnitude
from ..core.values import dataclass
from ..environment import Environment
from ..forces import Flow, Force, ForceModule
from .common import Composed
from .rolling import GRAVITY, Heeled, Rolling, lateral


@dataclass(frozen=True, kw_only=True)
class Body:
    """Masses of a ship that rolls, added masses and stability; axes midship in the water line.

    The mass matrix need not be symmetric (Y_rdot and N_vdot of the published ship differ).
    """

    rho: Scalar = spec("kg/m^3", "density of the water", (500.0, 2000.0))
    L_pp: Scalar = spec("m", "length between perpendiculars", (1e-3, 1e3))
    B: Scalar = spec("m", "breadth", (1e-3, 1e3))
    d: Scalar = spec("m", "draught", (1e-4, 100.0))
    m: Scalar = spec("kg", "mass of the displaced water", (1e-6, inf))
    x_G: Scalar = spec("m", "centre of gravity ahead of midship")
    z_G: Scalar = spec("m", "centre of gravity below the water line")
    I_x: Scalar = spec("kg m^2", "moment of inertia in roll", (1e-9, inf))
    I_z: Scalar = spec("kg m^2", "moment of inertia in yaw", (1e-9, inf))
    GM: Scalar = spec("m", "metacentric height", (-10.0, 100.0))
    X_udot: Scalar = spec("kg", "surge force by surge acceleration: minus the added mass", (-inf, 0.0))
    Y_vdot: Scalar = spec("kg", "sway force by sway acceleration: minus the added mass", (-inf, 0.0))
    Y_pdot: Scalar = spec("kg m", "sway force by roll acceleration", default=0.0)
    Y_rdot: Scalar = spec("kg m", "sway force by yaw acceleration", default=0.0)
    K_vdot: Scalar = spec("kg m", "roll moment by sway acceleration", default=0.0)
    K_pdot: Scalar = spec("kg m^2", "roll moment by roll acceleration: minus the added inertia", (-inf, 0.0))
    K_rdot: Scalar = spec("kg m^2", "roll moment by yaw acceleration", default=0.0)
    N_vdot: Scalar = spec("kg m", "yaw moment by sway acceleration", default=0.0)
    N_pdot: Scalar = spec("kg m^2", "yaw moment by roll acceleration", default=0.0)
    N_rdot: Scalar = spec("kg m^2", "yaw moment by yaw acceleration: minus the added inertia", (-inf, 0.0))

    def acceleration(
        self, force: tuple[Scalar, Scalar, Scalar, Scalar], u: Scalar, v: Scalar, p: Scalar, r: Scalar, phi: Scalar
    ) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """Rates of u, v_m [m/s^2], p and r [rad/s^2] under X, Y [N], K, N [N m], at velocities through the water."""
        X, Y, K, N = force
        m, high, ahead = self.m, self.m * self.z_G, self.m * self.x_G
        du = (X + m * v * r + ahead * r * r - high * p * r) / (m - self.X_udot)
        dv, dp, dr = lateral(
            (Y - m * u * r, K + high * u * r - m * GRAVITY * self.GM * phi, N - ahead * u * r),
            (
                (m - self.Y_vdot, -high - self.Y_pdot, ahead - self.Y_rdot),
                (-high - self.K_vdot, self.I_x - self.K_pdot, -self.K_rdot),
                (ahead - self.N_vdot, -self.N_pdot, self.I_z - self.N_rdot),
            ),
        )
        return du, dv, dp, dr


@dataclass(frozen=True, kw_only=True)
class Hull:
    """Forces on the hull by products of velocities and heel, dimensional, as DMI fits its roll planar motion tests.

    A magnitude doubles its letter: Y_uuv is by |u| v, Y_vrr by v |r|.  `yaw_by_heel` picks what N_phiuv multiplies:
    phi |u v|, as its name and its unit say, or phi |u phi|, as the public code has it.
    """

    yaw_by_heel: str = choice("what N_phiuv multiplies", ("phi_uv", "phi_uphi"), "phi_uv")
    X_uu: Scalar = spec("kg/m", "surge force by u |u|: minus the resistance", (-inf, 0.0))
    X_vr: Scalar = spec("kg", "surge force by v r, beside that of the mass", default=0.0)
    Y_uuv: Scalar = spec("kg/m", "sway force by |u| v")
    Y_ur: Scalar = spec("kg", "sway force by u r")
    Y_vv: Scalar = spec("kg/m", "sway force by v |v|")
    Y_vrr: Scalar = spec("kg", "sway force by v |r|")
    Y_rvv: Scalar = spec("kg", "sway force by r |v|")
    Y_phiuv: Scalar = spec("kg/m", "sway force by phi |u v|")
    Y_phiur: Scalar = spec("kg", "sway force by phi |u r|")
    Y_phiuu: Scalar = spec("kg/m", "sway force by phi u^2")
    K_uuv: Scalar = spec("kg", "roll moment by |u| v")
    K_ur: Scalar = spec("kg m", "roll moment by u r")
    K_vv: Scalar = spec("kg", "roll moment by v |v|")
    K_vrr: Scalar = spec("kg m", "roll moment by v |r|")
    K_rvv: Scalar = spec("kg m", "roll moment by r |v|")
    K_phiuv: Scalar = spec("kg", "roll moment by phi |u v|")
    K_phiur: Scalar = spec("kg m", "roll moment by phi |u r|")
    K_phiuu: Scalar = spec("kg", "roll moment by phi u^2")
    K_up: Scalar = spec("kg m", "roll moment by |u| p: damping with speed")
    K_pp: Scalar = spec("kg m^2", "roll moment by p |p|: quadratic damping", (-inf, 0.0))
    K_p: Scalar = spec("kg m^2/s", "roll moment by p: linear damping", (-inf, 0.0))
    K_phiphiphi: Scalar = spec("N m", "roll moment by phi^3, beside that of GM")
    N_uuv: Scalar = spec("kg", "yaw moment by |u| v")
    N_uur: Scalar = spec("kg m", "yaw moment by |u| r")
    N_rvv: Scalar = spec("kg m", "yaw moment by r |v|")
    N_rr: Scalar = spec("kg m^2", "yaw moment by r |r|", (-inf, 0.0))
    N_phiuv: Scalar = spec("kg", "yaw moment by phi |u v|, or by phi |u phi|")
    N_phiur: Scalar = spec("kg m", "yaw moment by phi u |r|")
    N_phiuu: Scalar = spec("kg", "yaw moment by phi u |u|")

    def force(
        self, u: Scalar, v: Scalar, p: Scalar, r: Scalar, phi: Scalar
    ) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """X, Y [N], K and N [N m] at velocities through the water."""
        U, V, R = magnitude(u), magnitude(v), magnitude(r)
        uv, ur, uu = phi * U * V, phi * U * R, phi * u * u
        X = self.X_uu * u * U + self.X_vr * v * r
        Y = ((self.Y_uuv * U + self.Y_vv * V + self.Y_vrr * R) * v + (self.Y_ur * u + self.Y_rvv * V) * r
             + self.Y_phiuv * uv + self.Y_phiur * ur + self.Y_phiuu * uu)  # fmt: skip
        K = ((self.K_uuv * U + self.K_vv * V + self.K_vrr * R) * v + (self.K_ur * u + self.K_rvv * V) * r
             + self.K_phiuv * uv + self.K_phiur * ur + self.K_phiuu * uu
             + (self.K_up * U + self.K_pp * magnitude(p) + self.K_p) * p
             + self.K_phiphiphi * phi * phi * phi)  # fmt: skip
        drawn = uv if self.yaw_by_heel == "phi_uv" else phi * U * magnitude(phi)
        N = (self.N_uuv * U * v + (self.N_uur * U + self.N_rvv * V + self.N_rr * R) * r
             + self.N_phiuv * drawn + (self.N_phiur * R + self.N_phiuu * U) * phi * u)  # fmt: skip
        return X, Y, K, N


@dataclass(frozen=True, kw_only=True)
class Blanke(Composed, Rolling):
    """Hull and body of Blanke and Christensen (1993), driven by thrusters or by forces ordered directly.

    Its r is the rate of the heading, whatever the heel.  The published model is the hull: it has neither rudder nor
    propeller.  A side force of a thruster or the wind at the height z_T or z_W below the water line (above it,
    negative) rolls the ship by -z Y.
    """

    body: Body
    hull: Hull
    wind: ForceModule | None = None
    thrusters: Parts = parts("thruster")
    z_T: Scalar = spec("m", "where the thrusters' side force acts, below the water line", default=0.0)
    z_W: Scalar = spec("m", "where the wind's side force acts, below the water line", default=0.0)

    @property
    def conventional(self) -> tuple[tuple[str, str], ...]:
        """None: all controls are the thrusters'."""
        return ()

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        heeled = Heeled.of(state, environment)
        flow = heeled.flow(self.body)
        force = self.force(flow, heeled.phi, heeled.p, control)
        rates = self.body.acceleration(force, flow.u, flow.v_m, heeled.p, flow.r, heeled.phi)
        return heeled.rates(*rates, turning=flow.r)

    def force(
        self, flow: Flow, phi: Scalar, p: Scalar, control: Scalars = ()
    ) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """X, Y [N], K and N [N m] of hull, thrusters and wind."""
        X, Y, K, N = self.hull.force(flow.u, flow.v_m, p, flow.r, phi)
        push = self.thrust(flow, control)
        blown = Force(0.0, 0.0, 0.0) if self.wind is None else self.wind.force(flow)
        total = push + blown
        return X + total.X, Y + total.Y, K - self.z_T * push.Y - self.z_W * blown.Y, N + total.N
