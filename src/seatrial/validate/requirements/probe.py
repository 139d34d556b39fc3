"""A ship under examination: rates at a point, runs under held controls, manoeuvres through its actuators."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ...core.parameters import Scalar, spec
from ...data import Array, Trial
from ...engine.rollout import simulator
from ...environment import CALM, CHANNELS, Environment, Uniform, Weather
from ...manoeuvres import Policy
from ...models import STATES, Sampled
from ...models.settled import settled
from ...ships import Ship, ShipError
from ...simulate.loop import open_loop, open_loop_memory, open_loop_parameters
from ...simulate.run import approach, simulate, time_step


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
    """

    ship: Ship
    U: float
    n_P: float
    balanced: str = ""
    clock: Callable[[], float] = time.perf_counter

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

    @property
    def limit(self) -> float:
        """Greatest steering angle [rad], 35 deg where the ship has no limit."""
        highs = [float(self.ship.actuators.of(name).high) for name in self.steering]
        return min([*highs, math.radians(35.0)])

    @property
    def steering(self) -> tuple[str, ...]:
        """Controls that obey the order delta."""
        return self._following("delta")

    @property
    def propulsion(self) -> tuple[str, ...]:
        """Controls that obey the order n_P."""
        return self._following("n_P")

    def _following(self, order: str) -> tuple[str, ...]:
        model = self.ship.model
        return tuple(c for c, (o, _) in zip(model.controls, model.follows, strict=True) if o == order)

    def controls(self, n_P: float = 0.0, delta: float = 0.0) -> tuple[float, ...]:
        """What the controls settle at under the conventional orders."""
        orders = {"n_P": n_P, "delta": delta}
        return tuple(factor * orders.get(order, 0.0) for order, factor in self.ship.model.follows)

    def allows(self, state: str, value: float) -> bool:
        """Whether the ship's file claims to be valid there."""
        low, high = self.ship.validity.get(state, (-math.inf, math.inf))
        return low <= value <= high

    def state(self, u: float = 0.0, v_m: float = 0.0, r: float = 0.0) -> tuple[float, ...]:
        """A state at the origin, heading north, with these velocities; `rates` and `drift` settle what is beyond."""
        return (0.0, 0.0, 0.0, u, v_m, r)

    def rates(
        self, u: float, v_m: float, r: float, control: tuple[float, ...], around: Environment = CALM
    ) -> Array:
        """Rates of u, v_m, r [m/s^2, m/s^2, rad/s^2]."""
        model = self.ship.model
        rest = settled(model, np.array([[*control, *around]], dtype=np.float64))[0]
        state = (*self.state(u, v_m, r), *rest.tolist())
        if isinstance(model, Sampled):
            return np.array(model.advance(state, control, around, model.begin(state, control))[0], dtype=float)
        return np.array(model.derivative(state, control, around)[3:6], dtype=float)

    def slopes(self, u: float, control: tuple[float, ...]) -> Array:
        """d(rates of u, v_m, r)/d(u, v_m, r) straight ahead, shape (3, 3), by central differences."""
        step = 1e-5 * np.array([self.U, self.U, self.U / self.ship.L_pp])
        columns: list[Array] = []
        for k in range(3):
            aside = np.zeros(3)
            aside[k] = step[k]
            up = self.rates(u + aside[0], aside[1], aside[2], control)
            down = self.rates(u - aside[0], -aside[1], -aside[2], control)
            columns.append((up - down) / (2 * step[k]))
        return np.column_stack(columns)

    def drift(
        self, states: Sequence[tuple[float, ...]], controls: Sequence[tuple[float, ...]], duration: float,
        around: Environment = CALM,
    ) -> tuple[Array, Array]:  # fmt: skip
        """Times and states (lanes, rows, 6) from given states under held controls, settled to them."""
        dt = time_step(self.ship)
        steps = max(round(duration / dt), 2) + 1
        series = np.array([[(*control, *around)] for control in controls], dtype=float)
        begun = np.hstack([np.array(states, dtype=float), settled(self.ship.model, series[:, 0])])
        run = simulator(open_loop(self.ship)).run(
            begun, series, open_loop_parameters(self.ship), dt=dt, steps=steps, every=max(steps // 400, 1),
            memory0=open_loop_memory(self.ship, begun, series[:, 0, : -len(CHANNELS)]),
        )  # fmt: skip
        return run.t, run.values[:, :, : len(STATES)]

    def run(
        self, n_order: float, delta: float, duration: float, *, speed: float | None = None,
        weather: Weather | None = None, dt: float | None = None,
    ) -> Trial:  # fmt: skip
        """A run through the actuators: orders that step at t = 0."""
        free = replace(self.ship, validity={})
        return simulate(
            free, Held(self.n_P, n_order, delta), speed=self.U if speed is None else speed, duration=duration,
            environment=weather or Uniform(), dt=dt,
        )  # fmt: skip
