"""Ship, actuators and task as one system: an action in, the next moment out, observed and judged in the same step.

An action is held for several time steps.  The engine stores what `before` logs at the end of them: there the task sees
the state after the motion and the memory from before it.  A lane that is held keeps state and memory, which is how a
new episode is observed in the same call in which the others move on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from ..core.parameters import Scalar, unknown
from ..core.symbolic import clip, cos, sin, where
from ..core.values import dataclass
from ..engine import System
from ..environment import CHANNELS, Environment, through_water
from ..manoeuvres import Helm
from ..models import Sampled, Stepped
from ..realtime.helm import limits, obeying
from ..ships import Ship
from ..simulate.loop import closed_loop
from ..simulate.place import Place
from .tasks import Judged, Scalars, Scale, Seen, Task, TaskError, any_of, held, outside

REWARDS = 1e3
"""Rewards are limited to this size, so that no blow-up of a model spoils the training."""

_RUDDER = math.radians(35.0)


@dataclass(frozen=True)
class Order:
    """One entry of an action: what it orders, and the orders of -1 and +1 there."""

    name: str
    low: float
    high: float


def actions(ship: Ship, task: Task, ranges: Mapping[str, tuple[float, float]]) -> tuple[Order, ...]:
    """What an agent orders aboard this ship, within the ranges of its controls; TaskError: it lacks an order."""
    obeys = obeying(ship)
    found: list[Order] = []
    for name in task.steers or ship.model.controls:
        if name not in obeys:
            raise TaskError(f"{ship.name}: {unknown(name, obeys, 'order')}; {type(task).__name__} steers by it")
        control, factor = obeys[name][0]
        low, high = sorted(end / factor if factor else end for end in ranges[control])
        if low == high:
            raise _limitless(ship, control)
        if name == "delta" and control.startswith("alpha"):  # thrusters steer like rudders under way
            low, high = max(low, -_RUDDER), min(high, _RUDDER)
        found.append(Order(name, low, high))
    return tuple(found)


def ranges_of(ship: Ship, turns: float) -> dict[str, tuple[float, float]]:
    """Least and greatest value of each control: its actuator's, else its validity, else what is usual.

    A shaft without limits has a range of the revolutions `turns` of the approach [1/s]; none where they are zero.

    Raises:
        TaskError: a control without a range.
    """
    return {control: _range(ship, control, turns) for control in ship.model.controls}


def _range(ship: Ship, control: str, turns: float) -> tuple[float, float]:
    low, high = limits(ship, control)
    if math.isfinite(low) and math.isfinite(high):
        return low, high
    if control in ship.validity:
        return ship.validity[control]
    follow = dict(zip(ship.model.controls, ship.model.follows, strict=True))[control][0]
    if follow == "n_P":
        return -abs(turns), abs(turns)
    if control.startswith("delta"):
        return -_RUDDER, _RUDDER
    if control.startswith("alpha"):
        return -math.pi, math.pi
    raise _limitless(ship, control)


def _limitless(ship: Ship, control: str) -> TaskError:
    wanted = f"give low and high in [actuators.{control}] of its file"
    return TaskError(f"{ship.name}: {control} has no limits; {wanted}")


@dataclass(frozen=True)
class Work:
    """A ship at a task.

    Attributes:
        ship, task, scale: the ship, its task, and the measures of both.
        orders: the entries of an action.
        ranges: least and greatest value of each control.
        dt: time step [s].
        limit: actions after which an episode is cut off.
        turns: revolutions that no action orders [1/s].
        place: where it sails; None on open water.
    """

    ship: Ship
    task: Task
    scale: Scale
    orders: tuple[Order, ...]
    ranges: Mapping[str, tuple[float, float]]
    dt: float
    limit: int
    turns: float
    place: Place | None = None

    @property
    def seen(self) -> tuple[Seen, ...]:
        """Entries of an observation: those of the task, then what each actuator does as a share of its range."""
        return (*self.task.seen, *(Seen(name, -1.5, 1.5) for name in self.ship.model.controls))

    def shares(self, controls: Scalars) -> Scalars:
        """Actual controls as shares of the farther end of each range, 0 where a control is at zero."""
        names = self.ship.model.controls
        ends = (max(map(abs, self.ranges[name])) or 1.0 for name in names)
        return tuple(value / end for value, end in zip(controls, ends, strict=True))

    def ordered(self, action: Scalars) -> Scalars:
        """An order for each control; what no action moves holds the approach."""
        given = {
            name: factor * self.turns if order == "n_P" else 0.0
            for name, (order, factor) in zip(self.ship.model.controls, self.ship.model.follows, strict=True)
        }
        obeys = obeying(self.ship)
        for order, share in zip(self.orders, action, strict=True):
            value = 0.5 * (order.high + order.low) + 0.5 * (order.high - order.low) * clip(share, -1.0, 1.0)
            given |= {control: factor * value for control, factor in obeys[order.name]}
        return tuple(given.values())

    def judged(self, state: Scalars, controls: Scalars, around: Environment, goal: Scalars, memory: Scalars) -> Judged:
        """The moment: within the ranges of observation, over as well where the model no longer holds."""
        shares = self.shares(controls)
        steering = {control for order in self.orders for control, _ in obeying(self.ship)[order.name]}
        own = tuple(s for n, s in zip(self.ship.model.controls, shares, strict=True) if n in steering)
        beyond = self._beyond(state, around)
        said = self.task.judge(self.scale, state[:6], own, goal, memory, beyond)
        seen = held((*said.seen, *shares), self.seen)
        return Judged(seen, clip(said.reward, -REWARDS, REWARDS), any_of(said.over, beyond), said.memory)

    def _beyond(self, state: Scalars, around: Environment) -> Scalar:
        """1.0 where the model no longer holds: outside [validity], or no longer a number."""
        psi, u, v_m = state[2:5]
        u_r, v_r = through_water(u, v_m, around.current_x, around.current_y, cos(psi), sin(psi))
        judged = dict(zip(self.ship.model.states, state, strict=True)) | {"u": u_r, "v_m": v_r}
        free = (-math.inf, math.inf)
        return any_of(*(outside(value, *self.ship.validity.get(name, free)) for name, value in judged.items()))


def compiled_of(work: Work) -> tuple[System, System]:
    """The system of a ship at its task, and the closed loop inside it.

    Series are the environment, the action, the goal and whether the lane is held; the memory is that of the loop,
    the actions taken and the task's; logged are the observation, the reward, terminated and truncated.
    """
    inner = closed_loop(work.ship, Helm(work.ship.model.controls), work.dt, work.place)
    order_names = tuple(f"action.{order.name}" for order in work.orders)

    def derivative(state: Scalars, acting: Scalars, parameters: Scalars) -> Scalars:
        # a product, as a choice between the rates and none would keep the compiler from using vectors
        return tuple(acting[-1] * rate for rate in inner.derivative(state, acting[:-1], parameters))

    system = System(
        states=inner.states, parameters=inner.parameters,
        series=(*CHANNELS, *order_names, *(f"goal.{name}" for name in work.task.goal), "held", *_looked(inner)),
        memory=(*inner.memory, "actions", *(f"task.{name}" for name in work.task.memory)),
        acting=(*inner.acting, "moving"), derivative=derivative, before=_before(work, inner),
        logged=(*(one.name for one in work.seen), "reward", "terminated", "truncated"),
        field=inner.field, kicks=inner.kicks,
    )  # fmt: skip
    return system, inner


def _looked(inner: System) -> tuple[str, ...]:
    """Names of the series that a chart gives."""
    return inner.series[len(inner.given) :]


def _before(work: Work, inner: System) -> Callable[..., tuple[Scalars, Scalars, Scalars]]:
    around, chosen, kept = len(CHANNELS), len(work.orders), len(inner.memory)
    goal = around + chosen
    looked = len(_looked(inner))
    places = [inner.memory.index(name) for name in work.ship.model.controls]
    advance: Any = inner.before

    def before(
        t: Scalar, dt: Scalar, state: Scalars, memory: Scalars, series: Scalars, parameters: Scalars
    ) -> tuple[Scalars, Scalars, Scalars]:
        series, chart = series[: len(series) - looked], series[len(series) - looked :]
        loop, done, own = memory[:kept], memory[kept], memory[kept + 1 :]
        orders = work.ordered(series[around:goal])
        acting, after, _ = advance(t, dt, state, loop, (*series[:around], *orders, *chart), parameters)
        controls = tuple(loop[k] for k in places)
        said = work.judged(state, controls, Environment(*series[:around]), series[goal:-1], own)
        # the clock starts at each action, so its first step is known by the time
        begins = where(t < 0.5 * dt, 1.0, 0.0)
        after = (*after, done + begins,
                 *(where(begins > 0.5, new, old) for new, old in zip(said.memory, own, strict=True)))  # fmt: skip
        still = series[-1] > 0.5
        cut = where(done >= work.limit, 1.0 - said.over, 0.0)
        logged = (*said.seen, *(where(still, 0.0, value) for value in (said.reward, said.over, cut)))
        remembered = tuple(where(still, old, new) for old, new in zip(memory, after, strict=True))
        return (*acting, 1.0 - series[-1]), remembered, logged

    return before


def refused(ship: Ship) -> None:
    """Raise a TaskError for a model that no step of this kind can hold."""
    if isinstance(ship.model, Sampled | Stepped):
        raise TaskError(f"{ship.name}: a model in discrete time; environments take ships in continuous time")


def scale_of(ship: Ship, period: float) -> Scale:
    """Measures of a ship; a breadth that its file does not give is taken as a sixth of the length."""
    return Scale(ship.L_pp, float(ship.model.breadth) or ship.L_pp / 6.0, ship.speed, period)


def free_names(inner: System, spread: Mapping[str, float]) -> tuple[str, ...]:
    """Names of the loop for parameters of the ship that differ from lane to lane.

    Raises:
        TaskError: no such parameter, or a spread that is not between 0 and 1.
    """
    known = [name[5:] for name in inner.parameters if name.startswith("ship.")]
    for name, half in spread.items():
        if name not in known:
            raise TaskError(f"randomise: {unknown(name, known, 'parameter')}")
        if not 0.0 <= half < 1.0:
            raise TaskError(f"randomise: {name} is {half:g}; give a share from 0 to below 1, such as 0.1")
    return tuple(f"ship.{name}" for name in spread)
