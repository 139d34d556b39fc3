"""Base of the hydrodynamic families: velocities over ground and through the water, sets of thrusters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Protocol

from ..core.parameters import Parts, Scalar, Scalars
from ..core.symbolic import cos, sin
from ..environment import Charted, Environment, through_water, to_body, to_earth
from ..forces import Flow, Force, ForceModule, ThrusterModule
from . import Model


class Afloat(Protocol):
    """Density of the water [kg/m^3], length [m] and draught [m] of a ship."""

    @property
    def rho(self) -> Scalar: ...

    @property
    def L_pp(self) -> Scalar: ...

    @property
    def d(self) -> Scalar: ...


class Loads(NamedTuple):
    """What gauges measure on a model that is moved by a carriage, its own inertia taken off.

    Attributes:
        X, Y, N: forces [N] and moment [N m] of the water about midship, those of added mass included.
        T: thrust of the propeller [N]; None in a family that has none of its own.
        F_N: normal force of the rudder [N], as T; positive where it turns the bow to starboard.
    """

    X: Scalar
    Y: Scalar
    N: Scalar
    T: Scalar | None = None
    F_N: Scalar | None = None


class Restrained(Protocol):
    """A family whose forces captive tests measure."""

    body: Any

    def loads(self, flow: Flow, rates: Scalars) -> Loads:
        """Loads in a flow without wind and waves, at these rates of u, v_m [m/s^2] and r [rad/s^2]."""
        ...


class Surroundings(NamedTuple):
    """Velocities over ground and through the water, and what wind and waves are in ship axes.

    Attributes:
        u, v_m, r: velocities over ground at midship [m/s, m/s, rad/s].
        u_r, v_r: velocities through the water at midship [m/s].
        cos_psi, sin_psi: of the heading.
        environment: what surrounds the ship.
    """

    u: Scalar
    v_m: Scalar
    r: Scalar
    u_r: Scalar
    v_r: Scalar
    cos_psi: Scalar
    sin_psi: Scalar
    environment: Environment | Charted

    @classmethod
    def of(cls, state: Scalars, environment: Environment | Charted) -> Surroundings:
        """What a ship in `state` meets."""
        _, _, psi, u, v_m, r = state[:6]
        c, s = cos(psi), sin(psi)
        u_r, v_r = through_water(u, v_m, environment.current_x, environment.current_y, c, s)
        return cls(u, v_m, r, u_r, v_r, c, s, environment)

    def flow(self, body: Afloat, n_P: Scalar = 0.0, delta: Scalar = 0.0) -> Flow:
        """The flow that force modules feel."""
        around = self.environment
        u_W, v_W = to_body(around.wind_x, around.wind_y, self.cos_psi, self.sin_psi)
        wave_u, wave_v = to_body(around.wave_x, around.wave_y, self.cos_psi, self.sin_psi)
        flow = Flow(
            self.u_r, self.v_r, self.r, n_P, delta, u_W + self.u, v_W + self.v_m, body.rho, body.L_pp, body.d,
            wave_u, wave_v, around.wave_T, body.d * around.per_depth,
        )  # fmt: skip
        return flow if isinstance(around, Environment) else self._charted(flow, around)

    def _charted(self, flow: Flow, around: Charted) -> Flow:
        """The flow with what lies around the ship, in its axes."""
        vectors = ((around.bank_x, around.bank_y), (around.quay_x, around.quay_y), (around.other_x, around.other_y))
        bank, quay, other = (to_body(*one, self.cos_psi, self.sin_psi) for one in vectors)
        U_2, _ = to_body(around.other_u, around.other_v, self.cos_psi, self.sin_psi)
        return flow._replace(bank_u=bank[0], bank_v=bank[1], quay_u=quay[0], quay_v=quay[1], xi=other[0],
                             eta=other[1], U_2=U_2, L_2=around.other_L, A_2=around.other_A)  # fmt: skip

    def rates(self, acceleration: tuple[Scalar, Scalar, Scalar]) -> Scalars:
        """Rates of the six states, from rates of the velocities through the water.

        The body turns within a uniform current, whose ship-fixed components turn the other way:
        motion in current is motion in still water plus the drift.
        """
        du, dv, dr = acceleration
        north, east = to_earth(self.u, self.v_m, self.cos_psi, self.sin_psi)
        u_C, v_C = self.u - self.u_r, self.v_m - self.v_r
        return north, east, self.r, du + self.r * v_C, dv - self.r * u_C, dr


class Composed(Model):
    """Base of the families made of a body, force modules and thrusters; the fields are those of the family."""

    body: Any
    wind: ForceModule | None
    thrusters: Parts

    @property
    def conventional(self) -> tuple[tuple[str, str], ...]:
        """Controls that are no thruster's, each with the order that it obeys."""
        return ("n_P", "n_P"), ("delta", "delta")

    @property
    def controls(self) -> tuple[str, ...]:
        """The conventional controls, then those of the thrusters: prefix and part, such as n_bow, alpha_1."""
        own = (f"{prefix}_{name}" for name, part in self.thrusters.items() for prefix in part.prefixes)
        return (*dict(self.conventional), *own)

    @property
    def follows(self) -> tuple[tuple[str, float], ...]:
        """For each control the order that it obeys; a thruster's own where it obeys no conventional one."""
        own = (
            (order, factor) if order else (f"{prefix}_{name}", 1.0)
            for name, part in self.thrusters.items()
            for prefix, (order, factor) in zip(part.prefixes, part.follows, strict=True)
        )
        return (*((order, 1.0) for _, order in self.conventional), *own)

    @property
    def differential(self) -> tuple[float, ...]:
        """Nothing of the helm for the conventional controls; for those of thrusters, what each says."""
        own = (share for part in self.thrusters.components for share in part.differential)
        return (*(0.0 for _ in self.conventional), *own)

    @property
    def draught(self) -> Scalar:
        return self.body.d

    @property
    def breadth(self) -> Scalar:
        return self.body.B

    @property
    def displaced(self) -> Scalar:
        return self.body.m

    @property
    def thrusters_by_name(self) -> Mapping[str, ThrusterModule]:
        return dict(self.thrusters.items())

    @property
    def feels_wind(self) -> bool:
        return self.wind is not None

    def answer(self, force: Force, flow: Flow) -> tuple[Scalar, Scalar, Scalar]:
        """Rates of u, v_m [m/s^2] and r [rad/s^2] at rest under a force alone, in the water of `flow`."""
        return self.body.acceleration(force, 0.0, 0.0, 0.0)

    def thrust(self, flow: Flow, control: Scalars) -> Force:
        """Sum of the thrusters' forces under their own controls, in the order of `controls`."""
        total = Force(0.0, 0.0, 0.0)
        for part, own in self.steered(control):
            total = total + part.force(flow, own)
        return total

    def steered(self, control: Scalars) -> Iterator[tuple[Any, Scalars]]:
        """Each thruster with its own controls, from those of all."""
        for part in self.thrusters.components:
            own, control = control[: len(part.prefixes)], control[len(part.prefixes) :]
            yield part, own
