"""The MMG family: hull, propeller, rudder, thrusters, wind and waves, each a module of its own, on one body."""

from __future__ import annotations

from typing import Any

from ..core.parameters import Parts, Scalar, Scalars, choice, parts
from ..core.symbolic import cos, sin
from ..core.values import dataclass, replace
from ..environment import Environment
from ..forces import Flow, Force, ForceModule, PropellerModule, RudderModule
from ..forces.body import Body
from ..forces.shallow import afloat
from .common import Composed, Loads, Surroundings


@dataclass(frozen=True, kw_only=True)
class Mmg(Composed):
    """A single-propeller, single-rudder ship in the horizontal plane.

    `extras` are further forces of one's own, such as a skeg.

    Where the resistance was measured on a hull that carried its superstructure, or where a published model
    without wind is given one, `still_air = "resistance"` takes the drag of air that moves with the water out
    of the wind force: in calm the ship is the one that was published.

    Forces see the velocities through the water; the body turns within a uniform current, so the motion
    in current is the motion in still water plus the drift.
    """

    body: Body
    hull: ForceModule
    propeller: PropellerModule
    rudder: RudderModule
    wind: ForceModule | None = None
    waves: ForceModule | None = None
    thrusters: Parts = parts("thruster")
    extras: Parts = parts("force")
    still_air: str = choice(
        "whether the wind force holds the drag of still air, or the hull's resistance does",
        ("wind", "resistance"), "wind",
    )  # fmt: skip

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        around = Surroundings.of(state, environment)
        flow = around.flow(self.body, control[0], control[1])
        force = self.force(flow, control[2:])
        body = afloat(self.body, self.hull, flow, self.extras.components)
        return around.rates(body.acceleration(force, flow.u, flow.v_m, flow.r))

    def force(self, flow: Flow, control: Scalars = ()) -> Force:
        """Sum of all external forces; `control` holds those of the thrusters."""
        pull, slipstream = self.propeller.force(flow)
        total = self.hull.force(flow) + pull + self.rudder.force(flow, slipstream)
        for module in (self.wind, self.waves, *self.extras.components):
            total = total if module is None else total + module.force(flow)
        if self.wind is not None and self.still_air == "resistance":
            total = total - self.wind.force(flow._replace(u_A=flow.u, v_A=flow.v_m))
        return total + self.thrust(flow, control) if control else total

    def answer(self, force: Force, flow: Flow) -> tuple[Scalar, Scalar, Scalar]:
        body = afloat(self.body, self.hull, flow, self.extras.components)
        return body.acceleration(force, 0.0, 0.0, 0.0)

    def loads(self, flow: Flow, rates: Scalars) -> Loads:
        """What a captive test measures; the rudder by itself is this one without its action on the hull."""
        pull, slipstream = self.propeller.force(flow)
        total = self.hull.force(flow) + pull + self.rudder.force(flow, slipstream)
        for module in self.extras.components:
            total = total + module.force(flow)
        body, (du, dv, dr) = self.body, rates
        rudder: Any = self.rudder
        alone = replace(rudder, **{name: 0.0 for name in ("a_H", "t_R") if hasattr(rudder, name)})
        felt = alone.force(flow, slipstream)
        return Loads(
            total.X - body.m_x * du + body.m_y * flow.v_m * flow.r,
            total.Y - body.m_y * dv - body.m_x * flow.u * flow.r,
            total.N - body.J_z * dr,
            flow.rho * slipstream.D_P * slipstream.D_P * slipstream.K_T_nD2,
            -(felt.X * sin(flow.delta) + felt.Y * cos(flow.delta)),
        )
