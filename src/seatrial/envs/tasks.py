"""What a task is: where an episode begins, what is seen of it, what it pays, when it is over.

A task is a frozen dataclass.  `begin` works on arrays, once an episode; `judge` is written over scalars in the
manner of all physics here (`symbolic`, no `if` on a value), as it is traced into the compiled step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from ..core.errors import TaskError as TaskError
from ..core.parameters import Scalar
from ..core.symbolic import clip, where
from ..data import Array

Scalars = tuple[Scalar, ...]


def shown(value: object) -> str:
    """What was given, for a message: on one line, cut where it is long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."


@dataclass(frozen=True)
class Scale:
    """The measures of a ship, by which tasks are the same for a model and the ship.

    Attributes:
        L, B: length and breadth [m].
        U: speed of her approach [m/s].
        period: time between two actions [s].
    """

    L: float
    B: float
    U: float
    period: float

    @property
    def lengths(self) -> float:
        """Ship lengths made good in a period at the approach speed."""
        return self.period * self.U / self.L


class Seen(NamedTuple):
    """One entry of an observation, without dimension, and the range it is held to."""

    name: str
    low: float
    high: float


@dataclass(frozen=True)
class Start:
    """How episodes begin.

    Attributes:
        state: x, y, psi, u, v_m, r relative to the water, shape (lanes, 6).
        goal: shape (lanes, len(task.goal)).
        memory: shape (lanes, len(task.memory)).
    """

    state: Array
    goal: Array
    memory: Array


@dataclass(frozen=True)
class Judged:
    """What a task makes of a moment: an observation, a reward, whether the episode is over, its memory."""

    seen: Scalars
    reward: Scalar
    over: Scalar
    memory: Scalars = ()


class Task(Protocol):
    """One kind of work for an agent.

    Attributes:
        steers: the orders that the agent gives ("delta"); empty for every control of the ship.
        draws: how many random numbers an episode begins with.
        goal: names of the numbers that hold for an episode.
        memory: names of what is carried from action to action.
        seen: what is observed, before the controls, which come last.
        turns: revolutions at the start, as a share of those of the approach.
    """

    @property
    def steers(self) -> tuple[str, ...]: ...
    @property
    def draws(self) -> int: ...
    @property
    def goal(self) -> tuple[str, ...]: ...
    @property
    def memory(self) -> tuple[str, ...]: ...
    @property
    def seen(self) -> tuple[Seen, ...]: ...
    @property
    def turns(self) -> float: ...

    def begin(self, scale: Scale, draws: Array) -> Start:
        """Episodes of these draws in [0, 1), shape (lanes, self.draws)."""
        ...

    def judge(
        self, scale: Scale, state: Scalars, controls: Scalars, goal: Scalars, memory: Scalars, beyond: Scalar = 0.0
    ) -> Judged:
        """The moment as it is.

        Args:
            scale: measures of the ship.
            state: x, y, psi, u, v_m, r over ground.
            controls: what the actuators do now, as shares of the farther end of their ranges, -1 to 1.
            goal: as `begin` gave it.
            memory: as the last action left it.
            beyond: 1.0 where the model no longer holds, else 0.0; the episode is over there, which is to cost what
                any other failure costs, as leaving would be a way out of it otherwise.
        """
        ...


MOTION = (Seen("u / U", -3.0, 3.0), Seen("v_m / U", -3.0, 3.0), Seen("r L / U", -5.0, 5.0))
"""The velocities over ground, in every task."""


def motion(scale: Scale, state: Scalars) -> Scalars:
    """The entries of `MOTION`."""
    return state[3] / scale.U, state[4] / scale.U, state[5] * scale.L / scale.U


def spread(draw: Array, low: float, high: float) -> Array:
    """A draw in [0, 1) taken to [low, high)."""
    return low + (high - low) * draw


def held(values: Scalars, seen: tuple[Seen, ...]) -> Scalars:
    """Each value within its range; what is not a number becomes the lower end."""
    return tuple(clip(value, one.low, one.high) for value, one in zip(values, seen, strict=True))


def outside(value: Scalar, low: float, high: float) -> Scalar:
    """1.0 where a value is outside, or not a number; else 0.0."""
    inner = where(value <= high, 1.0, 0.0) if math.isfinite(high) else where(value == value, 1.0, 0.0)
    return 1.0 - where(value >= low, inner, 0.0) if math.isfinite(low) else 1.0 - inner


def any_of(*conditions: Scalar) -> Scalar:
    """1.0 where any of these 0.0 and 1.0 is 1.0."""
    none: Scalar = 1.0
    for condition in conditions:
        none = none * (1.0 - condition)
    return 1.0 - none
