"""The MMG family with roll: the forces of the horizontal plane at their heights, righting moment and roll damping.

The arrangement is that of Yasukawa, Sakuno and Yoshimura (2019) as their abstract and list of symbols tell it: the roll
moment of the hull is its lateral force times the height at which it acts, derivatives with phi come on top of those of
an ordinary captive test, and damping is that of an extinction curve.  Their formulas for the new numbers are not open;
a ship file states its own, or a fit finds them.
"""

from __future__ import annotations

from math import inf
from typing import Any

from ..core.parameters import ParameterError, Scalar, Scalars, spec
from ..core.symbolic import cos, magnitude, sin, speed
from ..core.values import dataclass, field
from ..environment import Environment
from ..forces import Flow, Force
from ..forces.body import Body
from ..forces.shallow import afloat
from .mmg import Mmg
from .rolling import GRAVITY, Heeled, Rolling, lateral


@dataclass(frozen=True, kw_only=True)
class Roll:
    """Inertia, stability and damping in roll, and the heights at which lateral forces act.

    Heights are below the centre of gravity (above it, negative); a force Y there rolls the ship by -z Y.  The righting
    lever is that of a wall-sided hull, GZ = sin(phi) (GM + 0.5 BM tan(phi)^2); BM = 0 leaves GM sin(phi).
    """

    I_x: Scalar = spec("kg m^2", "moment of inertia in roll about the centre of gravity", (1e-9, inf))
    J_x: Scalar = spec("kg m^2", "added moment of inertia in roll", (0.0, inf))
    GM: Scalar = spec("m", "metacentric height", (-10.0, 100.0))
    BM: Scalar = spec("m", "metacentre above the centre of buoyancy, for the sides that rise and sink; 0 for none",
                      (0.0, 100.0), default=0.0)  # fmt: skip
    B_1: Scalar = spec("kg m^2/s", "linear damping", (0.0, inf))
    B_2: Scalar = spec("kg m^2", "quadratic damping", (0.0, inf), default=0.0)
    B_U: Scalar = spec("kg m", "damping by the speed ahead: lift of the hull", (0.0, inf), default=0.0)
    z_H: Scalar = spec("m", "height of the lateral force of the hull")
    z_R: Scalar = spec("m", "height of the lateral force of the rudder")
    z_T: Scalar = spec("m", "height of the lateral force of thrusters", default=0.0)
    z_W: Scalar = spec("m", "height of the lateral force of the wind", default=0.0)
    l_x: Scalar = spec("m", "height of the added mass in surge", default=0.0)
    l_y: Scalar = spec("m", "height of the added mass in sway", default=0.0)

    def moment(self, phi: Scalar, p: Scalar, u: Scalar, weight: Scalar) -> Scalar:
        """Righting moment and damping [N m] at a heel [rad], a roll rate [rad/s] and a speed ahead; weight in N."""
        upright, over = cos(phi), sin(phi)
        tan = over / upright
        lever = over * (self.GM + 0.5 * self.BM * tan * tan)
        return -weight * lever - (self.B_1 + self.B_2 * magnitude(p) + self.B_U * magnitude(u)) * p


@dataclass(frozen=True, kw_only=True)
class HeelDerivatives:
    """Forces on the hull by heel, over 0.5 rho L_pp d U^2, with respect to midship; all zero by default."""

    X_vphi: Scalar = spec("'", "surge force by v' phi", default=0.0)
    X_rphi: Scalar = spec("'", "surge force by r' phi", default=0.0)
    X_phiphi: Scalar = spec("'", "surge force by phi^2", default=0.0)
    Y_phi: Scalar = spec("'", "sway force by phi", default=0.0)
    Y_vvphi: Scalar = spec("'", "sway force by v'^2 phi", default=0.0)
    Y_vphiphi: Scalar = spec("'", "sway force by v' phi^2", default=0.0)
    Y_rrphi: Scalar = spec("'", "sway force by r'^2 phi", default=0.0)
    Y_rphiphi: Scalar = spec("'", "sway force by r' phi^2", default=0.0)
    N_phi: Scalar = spec("'", "yaw moment by phi", default=0.0)
    N_vvphi: Scalar = spec("'", "yaw moment by v'^2 phi", default=0.0)
    N_vphiphi: Scalar = spec("'", "yaw moment by v' phi^2", default=0.0)
    N_rrphi: Scalar = spec("'", "yaw moment by r'^2 phi", default=0.0)
    N_rphiphi: Scalar = spec("'", "yaw moment by r' phi^2", default=0.0)

    def force(self, flow: Flow, phi: Scalar) -> Force:
        """Force of the heel; none where upright."""
        v, r = flow.v_m, flow.r * flow.L_pp
        U = speed(flow.u, v)
        X = (self.X_vphi * v + self.X_rphi * r) * U + self.X_phiphi * U * U * phi
        Y = (self.Y_phi * U + (self.Y_vphiphi * v + self.Y_rphiphi * r) * phi) * U
        N = (self.N_phi * U + (self.N_vphiphi * v + self.N_rphiphi * r) * phi) * U
        vv, rr, area = v * v, r * r, 0.5 * flow.rho * flow.L_pp * flow.d * phi
        return Force(
            area * X, area * (Y + self.Y_vvphi * vv + self.Y_rrphi * rr),
            area * flow.L_pp * (N + self.N_vvphi * vv + self.N_rrphi * rr),
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class MmgRoll(Mmg, Rolling):
    """A single-propeller, single-rudder ship that sways, turns and rolls.

    Its forces are those of `mmg:Mmg`, so that the file of such a ship needs this family's name and [roll] only; further
    forces of one's own act at the height of the hull's.  Without heights and heel derivatives it moves as that ship
    does, upright.
    """

    roll: Roll
    heel: HeelDerivatives = field(default_factory=HeelDerivatives)

    def __post_init__(self) -> None:
        made: Any = type(self.body)
        if made is not Body:
            raise ParameterError(f"a ship that rolls has a body of its own equations; {made.__name__} cannot be one")

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        heeled = Heeled.of(state, environment)
        flow = heeled.flow(self.body, control[0], control[1])
        force, driving = self.rolling(flow, heeled.phi, control[2:])
        righting = self.roll.moment(heeled.phi, heeled.p, flow.u, self.body.m * GRAVITY)
        return heeled.rates(*self._acceleration(afloat(self.body, self.hull, flow), force, driving + righting, flow))

    def rolling(self, flow: Flow, phi: Scalar, control: Scalars = ()) -> tuple[Force, Scalar]:
        """Sum of all external forces at a heel, and their roll moment [N m]; `control` holds those of the thrusters."""
        roll = self.roll
        pull, slipstream = self.propeller.force(flow)
        hull = self.hull.force(flow) + pull + self.heel.force(flow, phi)
        for module in self.extras.components:
            hull = hull + module.force(flow)
        steer = self.rudder.force(flow, slipstream)
        total, moment = hull + steer, -roll.z_H * hull.Y - roll.z_R * steer.Y
        if self.waves is not None:
            total = total + self.waves.force(flow)
        if self.wind is not None:
            blown = self.wind.force(flow)
            if self.still_air == "resistance":
                blown = blown - self.wind.force(flow._replace(u_A=flow.u, v_A=flow.v_m))
            total, moment = total + blown, moment - roll.z_W * blown.Y
        if not control:
            return total, moment
        push = self.thrust(flow, control)
        return total + push, moment - roll.z_T * push.Y

    def _acceleration(
        self, body: Body, force: Force, K: Scalar, flow: Flow
    ) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """Rates of u, v_m [m/s^2], p and r [rad/s^2], as `Body.acceleration` with the coupling of roll."""
        u, v_m, r = flow.u, flow.v_m, flow.r
        surge, sway, lever = body.m + body.m_x, body.m + body.m_y, body.x_G * body.m
        below, yaw = body.m_y * self.roll.l_y, body.I_zG + body.x_G * lever + body.J_z
        dv, dp, dr = lateral(
            (force.Y - surge * u * r, K + body.m_x * self.roll.l_x * u * r, force.N - lever * u * r),
            ((sway, -below, lever), (-below, self.roll.I_x + self.roll.J_x, 0.0), (lever, 0.0, yaw)),
        )
        return (force.X + sway * v_m * r + lever * r * r) / surge, dv, dp, dr
