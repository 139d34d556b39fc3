"""Twin screws and rudders: the MMG family with a propeller and a rudder on either side."""

from __future__ import annotations

from ..core.parameters import Parts, Scalar, Scalars, choice, parts, spec
from ..core.values import dataclass
from ..environment import Environment
from ..forces import Flow, Force, ForceModule, PropellerModule, RudderModule
from ..forces.body import Body
from ..forces.shallow import afloat
from .common import Composed, Surroundings


@dataclass(frozen=True, kw_only=True)
class TwinMmg(Composed):
    """A ship with two propellers, each with a rudder behind it, y_P and y_R off the centre line.

    `propeller` and `rudder` are those of the port side.  The screws of a pair usually turn opposite
    ways, so the starboard side is their mirror image (`pair` = "opposite"): side forces and what
    differs with the sign of a drift angle change sides.  With "alike" both sides are as given, as where
    both screws turn the same way.

    Each side meets the surge velocity of its own place, u - y r, and with it a drift angle of its own; sway and
    yaw are those of midship.  A surge force off the centre line turns the ship: N = -y X.
    """

    body: Body
    hull: ForceModule
    propeller: PropellerModule
    rudder: RudderModule
    y_P: Scalar = spec("m", "distance of either propeller from the centre line", (0.0, 100.0))
    y_R: Scalar = spec("m", "distance of either rudder from the centre line", (0.0, 100.0))
    pair: str = choice("starboard side: mirror image of the port side, or as it is", ("opposite", "alike"), "opposite")
    wind: ForceModule | None = None
    waves: ForceModule | None = None
    thrusters: Parts = parts("thruster")

    @property
    def conventional(self) -> tuple[tuple[str, str], ...]:
        """n_P [1/s] and delta [rad] of port (1) and starboard (2)."""
        return ("n_P_1", "n_P"), ("n_P_2", "n_P"), ("delta_1", "delta"), ("delta_2", "delta")

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        around = Surroundings.of(state, environment)
        flow = around.flow(self.body)
        force = self.force(flow, control)
        body = afloat(self.body, self.hull, flow)
        return around.rates(body.acceleration(force, flow.u, flow.v_m, flow.r))

    def answer(self, force: Force, flow: Flow) -> tuple[Scalar, Scalar, Scalar]:
        return afloat(self.body, self.hull, flow).acceleration(force, 0.0, 0.0, 0.0)

    def force(self, flow: Flow, control: Scalars) -> Force:
        """Sum of all external forces under the controls of `controls`."""
        n_1, n_2, delta_1, delta_2 = control[:4]
        port = self._side(flow._replace(n_P=n_1, delta=delta_1), -1.0)
        if self.pair == "opposite":
            starboard = mirrored(self._side(mirrored_flow(flow._replace(n_P=n_2, delta=delta_2)), -1.0))
        else:
            starboard = self._side(flow._replace(n_P=n_2, delta=delta_2), 1.0)
        total = self.hull.force(flow) + port + starboard
        for module in (self.wind, self.waves):
            total = total if module is None else total + module.force(flow)
        return total + self.thrust(flow, control[4:])

    def _side(self, flow: Flow, side: float) -> Force:
        """Propeller and rudder of one side (-1 port, +1 starboard)."""
        y_P, y_R = side * self.y_P, side * self.y_R
        pull, slipstream = self.propeller.force(flow._replace(u=flow.u - y_P * flow.r))
        steer = self.rudder.force(flow._replace(u=flow.u - y_R * flow.r), slipstream)
        return pull + steer + Force(0.0, 0.0, -y_P * pull.X - y_R * steer.X)


def mirrored_flow(flow: Flow) -> Flow:
    """The flow in the mirror image about the centre plane."""
    return flow._replace(v_m=-flow.v_m, r=-flow.r, delta=-flow.delta, v_A=-flow.v_A, wave_v=-flow.wave_v)


def mirrored(force: Force) -> Force:
    """The force in the mirror image about the centre plane."""
    return Force(force.X, -force.Y, -force.N)
