"""The MMG family: hull, propeller, rudder and wind, each a module of its own, on one body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..environment import Environment, to_body, to_earth
from ..forces import Flow, Force, ForceModule, PropellerModule, RudderModule
from ..forces.body import Body
from ..parameters import Scalar
from ..symbolic import cos, sin
from . import STATES


@dataclass(frozen=True, kw_only=True)
class Mmg:
    """A single-propeller, single-rudder ship in the horizontal plane.

    Forces see the velocities through the water; the body turns within a uniform current, so the motion
    in current is the motion in still water plus the drift.
    """

    states: ClassVar[tuple[str, ...]] = STATES
    controls: ClassVar[tuple[str, ...]] = ("n_P", "delta")

    body: Body
    hull: ForceModule
    propeller: PropellerModule
    rudder: RudderModule
    wind: ForceModule | None = None

    def derivative(
        self, state: tuple[Scalar, ...], control: tuple[Scalar, ...], environment: Environment
    ) -> tuple[Scalar, ...]:
        """Time derivative of `state` [SI/s] under the actual controls and the environment."""
        _, _, psi, u, v_m, r = state
        c, s = cos(psi), sin(psi)
        u_C, v_C = to_body(environment.current_x, environment.current_y, c, s)
        u_W, v_W = to_body(environment.wind_x, environment.wind_y, c, s)
        flow = self.flow(u - u_C, v_m - v_C, r, control, (u_W + u, v_W + v_m))
        du, dv, dr = self.body.acceleration(self.force(flow), flow.u, flow.v_m, r)
        north, east = to_earth(u, v_m, c, s)
        return north, east, r, du + r * v_C, dv - r * u_C, dr

    def flow(
        self, u: Scalar, v_m: Scalar, r: Scalar, control: tuple[Scalar, ...], apparent: tuple[Scalar, Scalar]
    ) -> Flow:
        """What the modules feel at velocities through the water and an apparent wind."""
        n_P, delta = control
        return Flow(u, v_m, r, n_P, delta, *apparent, self.body.rho, self.body.L_pp, self.body.d)

    def force(self, flow: Flow) -> Force:
        """Sum of all external forces."""
        pull, slipstream = self.propeller.force(flow)
        total = self.hull.force(flow) + pull + self.rudder.force(flow, slipstream)
        return total if self.wind is None else total + self.wind.force(flow)
