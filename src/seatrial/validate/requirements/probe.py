"""A ship under examination: rates at a point, runs under held controls, manoeuvres through its actuators."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import ClassVar

import numpy as np

from ...core.parameters import Scalar, spec
from ...core.values import dataclass, field, replace
from ...data import Array, Trial
from ...engine import SimulationError
from ...environment import CALM, Environment, Weather
from ...environment.weather import Gust
from ...manoeuvres import Policy
from ...manoeuvres.zigzag import Zigzag
from ...models import STATES, Sampled, Stepped, unit
from ...models.settled import settled
from ...ships import Ship, ShipError
from ...ships.steering import helm_limit
from ...simulate.approach import fastest, substeps
from ...simulate.lanes import Kernel, Steps, given, run
from ...simulate.loop import open_loop, open_loop_parameters
from ...simulate.run import approach, blown_up, campaign, recorded, simulate, surroundings, time_step


def gusty(base: Weather, seed: int) -> Weather:
    """The gusts that `seatrial simulate --gusts` blows."""
    return Gust(base, seed=seed)


@dataclass(frozen=True)
class Held(Policy):
    """Orders that step at t = 0 and stay."""

    kind: ClassVar[str] = "held orders"

    n_P: Scalar = spec("1/s", "revolutions before the step")
    n_order: Scalar = spec("1/s", "revolutions ordered")
    delta: Scalar = spec("rad", "rudder angle ordered")

    def command(
        self, t: Scalar, state: tuple[Scalar, ...], memory: tuple[Scalar, ...]
    ) -> tuple[tuple[Scalar, ...], tuple[Scalar, ...]]:
        """The orders (n_P [1/s], delta [rad])."""
        return (self.n_order, self.delta), memory


@dataclass(frozen=True)
class Probe:
    """A ship with its approach.

    Attributes:
        U, n_P: speed [m/s] and revolutions [1/s] of its approach.
        balanced: whether those revolutions hold that speed; else the reason, in words.
        clock: gives seconds; what the speed of the computation is measured with.
        dt: time step of every run [s]; None takes that of `time_step`.
        gusts: gusts on a steady wind, by a seed.
        searches: whether slips are looked for where something is unusual.
        made: runs that an item has made, for the others; what blew up among them.
    """

    ship: Ship
    U: float
    n_P: float
    balanced: str = ""
    clock: Callable[[], float] = time.perf_counter
    dt: float | None = None
    gusts: Callable[[Weather, int], Weather] = gusty
    searches: bool = True
    made: dict[tuple[float, ...], Trial | SimulationError] = field(
        default_factory=dict[tuple[float, ...], Trial | SimulationError], compare=False, repr=False, init=False
    )

    @staticmethod
    def of(ship: Ship, clock: Callable[[], float] = time.perf_counter) -> Probe:
        """The ship at its approach speed; without a balance, at no revolutions."""
        try:
            U, n_P = approach(ship)
        except ShipError as error:
            return Probe(ship, ship.speed, ship.n_P or 0.0, str(error), clock)
        return Probe(ship, U, n_P, "", clock)

    @property
    def unit_time(self) -> float:
        """The time of one ship length [s]."""
        return self.ship.L_pp / self.U

    @cached_property
    def quickest(self) -> float:
        """Fastest motion of the ship by itself at its approach [U/L]; 0 of one in discrete time."""
        return 0.0 if isinstance(self.ship.model, Sampled | Stepped) else fastest(self.ship) * self.unit_time

    @cached_property
    def kernel(self) -> Kernel:
        """The ship under given controls."""
        return Kernel(open_loop(self.ship))

    @cached_property
    def parameters(self) -> Array:
        """Values of the model's numbers, in the order of the kernel."""
        return open_loop_parameters(self.ship)

    @cached_property
    def step(self) -> float:
        """Time step of the runs through actuators [s]."""
        return self.dt or time_step(self.ship)

    @cached_property
    def long_step(self) -> float:
        """Time step under held controls, with no ramp to resolve: that between rows of a log [s]."""
        if self.dt is not None or isinstance(self.ship.model, Sampled | Stepped):
            return self.step
        return self.unit_time / substeps(self.ship, self.unit_time)

    @cached_property
    def ahead(self) -> tuple[float, ...]:
        """Speeds ahead that the ship's file claims, as shares of the approach speed, the slowest first."""
        return tuple(f for f in (0.1, 0.25, 0.5, 0.75, 1.0) if self.allows("u", f * self.U)) or (1.0,)

    @cached_property
    def astern(self) -> tuple[float, ...]:
        """Speeds astern that the ship's file claims, as negative shares of the approach speed."""
        return tuple(f for f in (-0.1, -0.25, -0.5) if self.allows("u", f * self.U))

    @cached_property
    def rests(self) -> bool:
        """Whether the file claims that the model is valid at rest."""
        return self.allows("u", 0.0)

    @cached_property
    def reverses(self) -> bool:
        """Whether the file claims that the model is valid with the propulsion reversed."""
        turned = self.controls(-self.n_P)
        each = zip(self.ship.model.controls, turned, strict=True)
        return bool(self.propulsion) and all(self.allows(name, value) for name, value in each)

    @cached_property
    def stops(self) -> bool:
        """Whether the propulsion can be stopped: revolutions change the motion."""
        straight = [(self.U, 0.0, 0.0)]
        return bool(
            np.abs(self.at(straight, self.controls(self.n_P or 1.0)) - self.at(straight, self.controls())).any()
        )

    @cached_property
    def conventional(self) -> bool:
        """Whether it steers by rudders, whose force is made by a flow; not by thrusts that are ordered or turned."""
        return bool(self.steering) and all(name.partition("_")[0] == "delta" for name in self.steering)

    @cached_property
    def moments(self) -> tuple[str, ...]:
        """Steering controls that turn the ship by themselves and push it nowhere: ordered moments, unequal thrusts."""
        pairs = zip(self.ship.model.controls, self.ship.model.differential, strict=True)
        uneven = {name for name, share in pairs if share}
        return tuple(name for name in self.steering if unit(name) == "N m" or name in uneven)

    @cached_property
    def sways(self) -> bool:
        """Whether sideways motion exists in the model: some motion or rudder changes it."""
        moved = [(self.U, 0.1 * self.U, 0.0), (self.U, 0.0, 0.1 / self.unit_time), (self.U, 0.0, 0.0)]
        orders = [self.controls(self.n_P), self.controls(self.n_P), self.controls(self.n_P, 0.5 * self.limit)]
        return bool(np.abs(self.at(moved, orders)[:, 1]).max() > 0.0)

    @cached_property
    def limit(self) -> float:
        """Greatest steering angle or helm [rad], 35 deg where the ship has no limit."""
        return min(helm_limit(self.ship), math.radians(35.0))

    @cached_property
    def steering(self) -> tuple[str, ...]:
        """Controls that obey the order delta."""
        return self._following("delta")

    @cached_property
    def propulsion(self) -> tuple[str, ...]:
        """Controls that obey the order n_P."""
        return self._following("n_P")

    def _following(self, order: str) -> tuple[str, ...]:
        return self.ship.model.obeying(order)

    def controls(self, n_P: float = 0.0, delta: float = 0.0) -> tuple[float, ...]:
        """What the controls settle at under the conventional orders."""
        return tuple(float(x) for x in self.ship.model.obey({"n_P": n_P, "delta": delta}))

    def allows(self, state: str, value: float) -> bool:
        """Whether the ship's file claims to be valid there."""
        low, high = self.ship.validity.get(state, (-math.inf, math.inf))
        return low <= value <= high

    def state(self, u: float = 0.0, v_m: float = 0.0, r: float = 0.0) -> tuple[float, ...]:
        """A state at the origin, heading north, with these velocities; `rates` and `drift` settle what is beyond."""
        return (0.0, 0.0, 0.0, u, v_m, r)

    def rates(self, u: float, v_m: float, r: float, control: tuple[float, ...], around: Environment = CALM) -> Array:
        """Rates of u, v_m, r [m/s^2, m/s^2, rad/s^2]."""
        model = self.ship.model
        rest = settled(model, np.array([[*control, *around]], dtype=np.float64))[0]
        state = (*self.state(u, v_m, r), *rest.tolist())
        if isinstance(model, Sampled):
            return np.array(model.advance(state, control, around, model.begin(state, control))[0], dtype=float)
        return np.array(model.derivative(state, control, around)[3:6], dtype=float)

    def at(
        self, motion: Sequence[Sequence[float]] | Array, control: Sequence[float] | Sequence[Sequence[float]] | Array,
        around: Sequence[float] | Sequence[Sequence[float]] | Array = CALM, psi: float = 0.0,
    ) -> Array:  # fmt: skip
        """Rates of (u, v_m, r) at many points in one call, shape (points, 3).

        Args:
            motion: u, v_m [m/s] and r [rad/s], shape (points, 3) or (1, 3).
            control, around: what acts, shape (points, controls) and (points, 8), or one for all points.
            psi: heading [rad].
        """
        given = [np.atleast_2d(np.asarray(one, dtype=float)) for one in (motion, control, around)]
        rows = max(map(len, given))
        moved, orders, air = (np.broadcast_to(one, (rows, one.shape[1])) for one in given)
        acting = np.hstack([orders, air])
        model = self.ship.model
        if isinstance(model, Sampled):
            return np.array([self.rates(m[0], m[1], m[2], tuple(c), Environment(*a)) for m, c, a in zip(
                moved.tolist(), orders.tolist(), air.tolist(), strict=True)])  # fmt: skip
        place = np.broadcast_to(np.array([0.0, 0.0, psi]), (rows, 3))
        state = np.hstack([place, moved, settled(model, acting)])
        return self.kernel.rates(state, acting, self.parameters)[:, 3:6]

    def slopes(self, u: float, control: tuple[float, ...], v_m: float = 0.0, r: float = 0.0) -> Array:
        """d(rates of u, v_m, r and what is beyond)/d(the same), square, by central differences; straight ahead or so.

        Args:
            v_m, r: a little motion, where the slopes to the two sides of a straight course differ [m/s, rad/s].
        """
        model = self.ship.model
        rest = () if isinstance(model, Sampled) else settled(model, np.array([[*control, *CALM]]))[0].tolist()
        middle = np.array([u, v_m, r, *rest])
        step = 1e-5 * np.array([self.U, self.U, self.U / self.ship.L_pp, *np.maximum(np.abs(rest), 1e-3)])

        def rates(at: Array) -> Array:
            if isinstance(model, Sampled):
                return self.rates(float(at[0]), float(at[1]), float(at[2]), control)
            return np.array(model.derivative((0.0, 0.0, 0.0, *at.tolist()), control, CALM)[3:], dtype=float)

        columns = [(rates(middle + h * e) - rates(middle - h * e)) / (2 * h)
                   for h, e in zip(step, np.eye(len(step)), strict=True)]  # fmt: skip
        return np.column_stack(columns)

    def drift(
        self, states: Sequence[tuple[float, ...]], controls: Sequence[tuple[float, ...]], duration: float,
        around: Environment = CALM,
    ) -> tuple[Array, Array]:  # fmt: skip
        """Times and states (lanes, rows, 6) from given states under held controls, settled to them."""
        dt = self.long_step
        steps = max(round(duration / dt), 2) + 1
        series = np.array([[(*control, *around)] for control in controls], dtype=float)
        begun = np.hstack([np.array(states, dtype=float), settled(self.ship.model, series[:, 0])])
        found = run(given(self.ship, begun, series), Steps(dt, steps, max(steps // 400, 1)))
        return found.t, found.values[:, :, : len(STATES)]

    def run(
        self, n_order: float, delta: float, duration: float, *, speed: float | None = None, dt: float | None = None,
    ) -> Trial:  # fmt: skip
        """A run through the actuators in still air and water, orders step at t = 0; SimulationError: it blows up."""
        (found,) = self.runs([(n_order, delta)], duration, speed=speed, dt=dt)
        if isinstance(found, SimulationError):
            raise found
        return found

    def runs(
        self, orders: Sequence[tuple[float, float]], duration: float, *, speed: float | None = None,
        dt: float | None = None,
    ) -> list[Trial | SimulationError]:  # fmt: skip
        """Such runs of one duration [s], of revolutions [1/s] and rudder [rad] each: at once, and each is made once."""
        at, step = self.U if speed is None else speed, dt or self.step
        asked = {order: (*order, duration, at, step) for order in orders}
        new = [order for order, key in asked.items() if key not in self.made]
        sailed = self.sail(new, duration, at, step) if new else []
        self.made.update({asked[order]: found for order, found in zip(new, sailed, strict=True)})
        return [self.made[asked[order]] for order in orders]

    def sail(
        self, orders: Sequence[tuple[float, float]], duration: float, speed: float, dt: float
    ) -> list[Trial | SimulationError]:  # fmt: skip
        """The same, made anew."""
        free = replace(self.ship, validity={})
        policies = [Held(self.n_P, *order) for order in orders]
        vary = {f"policy.{name}": np.array([float(getattr(one, name)) for one in policies])
                for name in ("n_order", "delta")}  # fmt: skip
        done = campaign(free, policies[0], vary, speed=speed, duration=duration, dt=dt, threads=1)
        failed = {one.lane: SimulationError(f"{free.name}: {blown_up(one, free)}", one.time) for one in done.failures}
        still = surroundings(None, dt, 1)
        return [failed.get(lane) or recorded(free, policy, done.t, done.values[lane], still, dt=dt)
                for lane, policy in enumerate(policies)]  # fmt: skip

    def zigzag(self, angle: float, duration: float) -> Trial:
        """A zigzag with this rudder and heading [rad], through the actuators."""
        free = replace(self.ship, validity={})
        return simulate(free, Zigzag(self.n_P, angle, angle), speed=self.U, duration=duration, dt=self.dt)
