"""Tasks of the environments: start of an episode, observation, reward and end; course, track and berthing.

A task is a frozen dataclass.  `begin` works on arrays, of numbers or of symbols, once an episode; `judge` is written
over scalars in the manner of all physics here (`symbolic`, no `if` on a value), as it is traced into the compiled step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from ..core.errors import TaskError as TaskError
from ..core.parameters import Scalar
from ..core.symbolic import atan2, both, clip, cos, magnitude, sin, speed, where
from ..core.values import dataclass
from ..data import Array

Scalars = tuple[Scalar, ...]


def shown(value: object) -> str:
    """A value for a message: on one line, cut where it is long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."


@dataclass(frozen=True)
class Scale:
    """The measures of a ship, by which tasks are the same for a model and the ship.

    Attributes:
        L, B: length and breadth [m].
        U: speed of the approach [m/s].
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
    """Outcome of a moment: observation, reward, whether the episode is over, memory of the task."""

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
        chart: the chart that it sails on, of the library; empty for open water.
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
    @property
    def chart(self) -> str: ...

    def begin(self, scale: Scale, draws: Array) -> Start:
        """Episodes of these draws in [0, 1), shape (lanes, self.draws).

        On a device the draws are symbols in an array of objects: take arithmetic and NumPy's sin, cos, sqrt and abs of
        them, and arrays of their type.
        """
        ...

    def judge(
        self, scale: Scale, state: Scalars, controls: Scalars, goal: Scalars, memory: Scalars, beyond: Scalar = 0.0
    ) -> Judged:
        """The moment as it is.

        Args:
            scale: measures of the ship.
            state: x, y, psi, u, v_m, r over ground.
            controls: actual controls as shares of the farther end of their ranges, -1 to 1.
            goal: as `begin` gave it.
            memory: as the last action left it.
            beyond: 1.0 where the model no longer holds, else 0.0; the episode is over there, at the cost of any other
                failure, since leaving the model would otherwise avoid that cost.
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


@dataclass(frozen=True)
class Course:
    """Course keeping.

    The reward of an action is minus ``(e^2 + rudder a^2 + turning (r L/U)^2) T U / L`` with the heading error e [rad],
    the actuators a as shares of their ranges and the time T between two actions, so that its sum is an integral over
    ship lengths whatever T is.  An episode is over where the error passes `off` or the model no longer holds; that
    costs `lost` besides.

    Attributes:
        change: greatest change of course that an episode begins with [rad].
        off: heading error at which the ship counts as lost [rad].
        rudder, turning: weights of rudder and rate of turn.
        lost: what losing the course costs.
    """

    change: float = math.pi / 3.0
    off: float = math.pi / 2.0
    rudder: float = 0.1
    turning: float = 0.1
    lost: float = 100.0

    steers: ClassVar[tuple[str, ...]] = ("delta",)
    draws: ClassVar[int] = 2
    goal: ClassVar[tuple[str, ...]] = ("psi_goal",)
    memory: ClassVar[tuple[str, ...]] = ()
    seen: ClassVar[tuple[Seen, ...]] = (Seen("sin e", -1.0, 1.0), Seen("cos e", -1.0, 1.0), *MOTION)
    turns: ClassVar[float] = 1.0
    chart: ClassVar[str] = ""

    def begin(self, scale: Scale, draws: Array) -> Start:
        """Any heading, at the approach speed; the course ordered up to `change` to either side."""
        state = np.zeros((len(draws), 6), draws.dtype)
        state[:, 2] = spread(draws[:, 0], -math.pi, math.pi)
        state[:, 3] = scale.U
        goal = state[:, 2:3] + spread(draws[:, 1:2], -self.change, self.change)
        return Start(state, goal, np.zeros((len(draws), 0)))

    def guide(self, scale: Scale, goal: Sequence[float], x: float, y: float) -> Sequence[Sequence[tuple[float, float]]]:
        """A line from the ship in the direction of the course."""
        far = 6.0 * scale.L
        return (((x, y), (x + far * math.cos(goal[0]), y + far * math.sin(goal[0]))),)

    def judge(
        self, scale: Scale, state: Scalars, controls: Scalars, goal: Scalars, memory: Scalars, beyond: Scalar = 0.0
    ) -> Judged:
        """Heading error positive where the ship points to starboard of the course."""
        s, c = sin(state[2] - goal[0]), cos(state[2] - goal[0])
        e, (u, v, r) = atan2(s, c), motion(scale, state)
        effort = sum(a * a for a in controls)
        over = any_of(outside(e, -self.off, self.off), beyond)
        cost = (e * e + self.rudder * effort + self.turning * r * r) * scale.lengths
        return Judged((s, c, u, v, r), -cost - self.lost * over, over)


@dataclass(frozen=True)
class Track:
    """Track following; lengths are in ship lengths.

    The reward of an action is minus ``(e^2 + heading (1 - cos h) + rudder a^2) T U / L`` with the cross-track error e
    in ship lengths and the heading h against the leg.  An episode is over at the end of the second leg, and, at a cost
    of `lost`, more than `off` from the track, heading back along it, or where the model no longer holds.

    Attributes:
        first: least and greatest length of the first leg.
        second: length of the second leg.
        turn: greatest change of course between them [rad].
        reach: distance to the waypoint at which the second leg counts.
        aside: greatest distance from the track at the start.
        off: distance from the track at which the ship counts as lost.
        heading, rudder: weights.
        lost: what losing the track costs.
    """

    first: tuple[float, float] = (5.0, 10.0)
    second: float = 10.0
    turn: float = math.pi / 3.0
    reach: float = 1.5
    aside: float = 1.0
    off: float = 4.0
    heading: float = 0.5
    rudder: float = 0.1
    lost: float = 100.0

    steers: ClassVar[tuple[str, ...]] = ("delta",)
    draws: ClassVar[int] = 5
    goal: ClassVar[tuple[str, ...]] = ("cos_1", "sin_1", "cos_2", "sin_2", "length_1")
    memory: ClassVar[tuple[str, ...]] = ("leg",)
    seen: ClassVar[tuple[Seen, ...]] = (
        Seen("e / L", -5.0, 5.0), Seen("sin h", -1.0, 1.0), Seen("cos h", -1.0, 1.0), Seen("to go / L", -5.0, 50.0),
        Seen("sin turn ahead", -1.0, 1.0), Seen("cos turn ahead", -1.0, 1.0), *MOTION,
    )  # fmt: skip
    turns: ClassVar[float] = 1.0
    chart: ClassVar[str] = ""

    def begin(self, scale: Scale, draws: Array) -> Start:
        """At the approach speed near the origin, where the first leg begins in any direction."""
        chi = spread(draws[:, 0], -math.pi, math.pi)
        after = chi + spread(draws[:, 1], -self.turn, self.turn)
        aside = scale.L * spread(draws[:, 3], -self.aside, self.aside)
        state = np.zeros((len(draws), 6), draws.dtype)
        state[:, 0], state[:, 1] = -np.sin(chi) * aside, np.cos(chi) * aside
        state[:, 2] = chi + spread(draws[:, 4], -math.pi / 9.0, math.pi / 9.0)
        state[:, 3] = scale.U
        length = scale.L * spread(draws[:, 2], *self.first)
        goal = np.column_stack([np.cos(chi), np.sin(chi), np.cos(after), np.sin(after), length])
        return Start(state, goal, np.zeros((len(draws), 1)))

    def guide(self, scale: Scale, goal: Sequence[float], x: float, y: float) -> Sequence[Sequence[tuple[float, float]]]:
        """The two legs."""
        c1, s1, c2, s2, length = goal
        corner, far = (length * c1, length * s1), self.second * scale.L
        return (((0.0, 0.0), corner, (corner[0] + far * c2, corner[1] + far * s2)),)

    def judge(
        self, scale: Scale, state: Scalars, controls: Scalars, goal: Scalars, memory: Scalars, beyond: Scalar = 0.0
    ) -> Judged:
        """Cross-track error positive to starboard of the leg."""
        x, y, psi = state[:3]
        c1, s1, c2, s2, length = goal
        to_go_1 = length - (x * c1 + y * s1)
        leg = where(memory[0] > 0.5, 1.0, where(to_go_1 < self.reach * scale.L, 1.0, 0.0))
        dx, dy = x - length * c1, y - length * s1
        on_second = leg > 0.5
        c, s = where(on_second, c2, c1), where(on_second, s2, s1)
        e = where(on_second, dy * c2 - dx * s2, y * c1 - x * s1) / scale.L
        to_go = where(on_second, self.second * scale.L - (dx * c2 + dy * s2), to_go_1) / scale.L
        sin_h, cos_h = sin(psi) * c - cos(psi) * s, cos(psi) * c + sin(psi) * s
        ahead = (where(on_second, 0.0, c1 * s2 - s1 * c2), where(on_second, 1.0, c1 * c2 + s1 * s2))
        lost = any_of(outside(e, -self.off, self.off), outside(cos_h, 0.0, math.inf), beyond)
        arrived = where(both(on_second, to_go <= 0.0), 1.0, 0.0)
        effort = sum(a * a for a in controls)
        cost = (e * e + self.heading * (1.0 - cos_h) + self.rudder * effort) * scale.lengths
        seen = (e, sin_h, cos_h, to_go, *ahead, *motion(scale, state))
        return Judged(seen, -cost - self.lost * lost, any_of(lost, arrived), (leg,))


@dataclass(frozen=True)
class Berth:
    """Berthing; the berth is at the origin, heading north, the quay a straight wall to starboard.

    The reward of an action is the way made towards the berth in ship lengths, heading error counting as `heading`
    lengths per radian, less ``(waiting + effort a^2) T U / L``.  An episode is over when the ship lies within `within`
    of the pose and below `slow`, which pays `berthed`; when a corner of its rectangle L by B touches the quay, which
    costs `touched` times 1 plus the square of midship's speed towards it over 0.1 U; and beyond `area` or where the
    model no longer holds, which costs `touched`.

    Attributes:
        ahead, aside: least and greatest distance short of the berth and off it at the start, in ship lengths.
        way: least and greatest speed at the start, in approach speeds.
        gap: room between ship and quay when berthed, in breadths.
        within: along, in lengths; across, in gaps; heading [rad].
        slow: speed that counts as rest, in approach speeds; rates of turn by U/L.
        area: distance at which the ship has left the harbour, in ship lengths.
        heading, waiting, effort: weights.
        berthed, touched: what success pays and failure costs.
    """

    ahead: tuple[float, float] = (2.0, 4.0)
    aside: tuple[float, float] = (0.5, 1.5)
    way: tuple[float, float] = (0.2, 0.5)
    gap: float = 0.5
    within: tuple[float, float, float] = (0.1, 0.5, math.pi / 36.0)
    slow: float = 0.1
    area: float = 8.0
    heading: float = 0.5
    waiting: float = 0.02
    effort: float = 0.02
    berthed: float = 10.0
    touched: float = 10.0

    steers: ClassVar[tuple[str, ...]] = ()
    draws: ClassVar[int] = 4
    goal: ClassVar[tuple[str, ...]] = ()
    memory: ClassVar[tuple[str, ...]] = ("to_go",)
    seen: ClassVar[tuple[Seen, ...]] = (
        Seen("x / L", -10.0, 10.0), Seen("y / L", -10.0, 10.0), Seen("sin psi", -1.0, 1.0), Seen("cos psi", -1.0, 1.0),
        Seen("room to the quay / L", -2.0, 20.0), *MOTION,
    )  # fmt: skip
    turns: ClassVar[float] = 0.0
    chart: ClassVar[str] = ""

    def begin(self, scale: Scale, draws: Array) -> Start:
        """Short of the berth and off the quay, nearly parallel to it, with little way on."""
        state = np.zeros((len(draws), 6), draws.dtype)
        state[:, 0] = -scale.L * spread(draws[:, 0], *self.ahead)
        state[:, 1] = -scale.L * spread(draws[:, 1], *self.aside)
        state[:, 2] = spread(draws[:, 2], -math.pi / 12.0, math.pi / 12.0)
        state[:, 3] = scale.U * spread(draws[:, 3], *self.way)
        to_go = np.sqrt(state[:, 0] ** 2 + state[:, 1] ** 2) / scale.L + self.heading * np.abs(state[:, 2])
        return Start(state, np.zeros((len(draws), 0)), to_go[:, None])

    def guide(self, scale: Scale, goal: Sequence[float], x: float, y: float) -> Sequence[Sequence[tuple[float, float]]]:
        """The quay, and the outline of the berth."""
        quay, far, a, b = (0.5 + self.gap) * scale.B, 10.0 * scale.L, 0.5 * scale.L, 0.5 * scale.B
        return ((-far, quay), (far, quay)), ((a, b), (-a, b), (-a, -b), (a, -b), (a, b))

    def judge(
        self, scale: Scale, state: Scalars, controls: Scalars, goal: Scalars, memory: Scalars, beyond: Scalar = 0.0
    ) -> Judged:
        """Room to the quay is that of the nearest corner."""
        x, y, psi, u, v, _ = state
        s, c = sin(psi), cos(psi)
        error = magnitude(atan2(s, c))
        away = speed(x, y) / scale.L
        to_go = away + self.heading * error
        quay = (0.5 + self.gap) * scale.B
        room = quay - y - 0.5 * (magnitude(s) * scale.L + magnitude(c) * scale.B)
        touches = outside(room, 0.0, math.inf)
        along, across, turned = self.within
        swift = any_of(*(outside(value, -self.slow, self.slow) for value in motion(scale, state)))
        amiss = any_of(outside(magnitude(x), 0.0, along * scale.L), outside(error, 0.0, turned),
                       outside(magnitude(y), 0.0, across * self.gap * scale.B))  # fmt: skip
        done = 1.0 - any_of(swift, amiss, touches, beyond)
        gone = any_of(outside(away, 0.0, self.area), beyond)
        towards = where(u * s + v * c > 0.0, u * s + v * c, 0.0) / (0.1 * scale.U)
        effort = sum(a * a for a in controls)
        reward = (memory[0] - to_go - (self.waiting + self.effort * effort) * scale.lengths + self.berthed * done
                  - self.touched * (touches * (1.0 + towards * towards) + gone))  # fmt: skip
        seen = (x / scale.L, y / scale.L, s, c, room / scale.L, *motion(scale, state))
        return Judged(seen, reward, any_of(touches, done, gone), (to_go,))
