"""What many ships at one task have in common: their system, what differs by lane, and how an episode begins.

Random numbers are counted: each depends on seed, episode and place alone, so lanes are independent of each other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import unknown
from ..core.values import dataclass, field, fields
from ..data import Array
from ..engine import System
from ..environment import CALM, CHANNELS, Environment
from ..environment.geojson import load_chart
from ..manoeuvres import Helm
from ..models import STATES
from ..models.settled import begun, settled
from ..ships import Ship
from ..simulate.approach import approach, fastest, rounded_down
from ..simulate.loop import loop_memory, loop_values
from ..simulate.place import place_of
from .system import Work, actions, compiled_of, free_names, ranges_of, refused, scale_of
from .tasks import Task, TaskError, shown, spread

# Actions per ship length at the approach speed, and how much the fastest motion may decay within a time step.
_ACTIONS, _DECAY = 25.0, 0.5
_AROUND = 4
"""Draws of wind and current, before those of parameters and of the task."""


@dataclass(frozen=True)
class Settings:
    """Environment of the ships, time between actions, and spread of parameters.

    Attributes:
        period: time between two actions [s]; None for about a 25th of a ship length at the approach speed.
        steps: time steps within it; None for what its fastest motion needs, at least two.
        limit: actions after which an episode is cut off.
        wind: least and greatest true wind of an episode, from any direction [m/s].
        current: least and greatest current of an episode, towards any direction [m/s].
        randomise: parameters of the ship (`hull.Y_v`) and by which share of their value they differ to either side.
        chart: a chart of the library, or a file; None for what the task sails on, if anything.
    """

    period: float | None = None
    steps: int | None = None
    limit: int = 1000
    wind: tuple[float, float] = (0.0, 0.0)
    current: tuple[float, float] = (0.0, 0.0)
    randomise: Mapping[str, float] = field(default_factory=dict[str, float])
    chart: str | Path | None = None


def work_of(ship: Ship, task: Task, settings: Settings) -> Work:
    """A ship at a task, with settings that were left out filled in; TaskError: a ship or a setting that cannot be."""
    if isinstance(task, type) or not hasattr(task, "judge"):
        raise TaskError(f"task is {shown(task)}; give a task such as Course()")
    refused(ship)
    _check(settings)
    period = settings.period or rounded_down(ship.L_pp / (_ACTIONS * max(ship.speed, 1e-3)))
    steps = settings.steps or max(2, math.ceil(fastest(ship) * period / _DECAY))
    turns = approach(ship)[1]
    ranges = ranges_of(ship, turns)
    orders = actions(ship, task, ranges)
    if settings.wind[1] and not _feels_wind(ship):
        raise TaskError(f"wind: {ship.name} has no force of wind; leave it at (0, 0)")
    chart = settings.chart or task.chart
    place = place_of(ship, load_chart(chart)) if chart else None
    return Work(ship, task, scale_of(ship, period), orders, ranges, period / steps, settings.limit,
                task.turns * turns, place)  # fmt: skip


def settings_of(given: Mapping[str, Any]) -> Settings:
    """Settings by name; TaskError: no such setting."""
    known = [one.name for one in fields(Settings)]
    for name in given.keys() - known:
        raise TaskError(unknown(name, known, "setting"))
    return Settings(**given)


def _check(settings: Settings) -> None:
    given: dict[str, Any] = vars(settings)
    period = settings.period
    if period is not None and not (_number(period) and 0.0 < period < math.inf):
        raise TaskError(f"period is {shown(period)}; it must be a number of seconds above zero")
    for name in ("steps", "limit"):
        value = given[name]
        whole = isinstance(value, Integral) and int(value) >= 1
        if not (whole or (value is None and name == "steps")):
            raise TaskError(f"{name} is {shown(value)}; it must be a whole number, one or more")
    for name in ("wind", "current"):
        pair = given[name]
        both = isinstance(pair, tuple | list | np.ndarray) and len(pair) == 2 and all(map(_number, pair))
        if not (both and 0.0 <= pair[0] <= pair[1] < math.inf):
            raise TaskError(f"{name} is {shown(pair)}; give the least and the greatest speed [m/s], such as (0.0, 3.0)")
    spread_of = given["randomise"]
    if not (isinstance(spread_of, Mapping) and all(map(_number, spread_of.values()))):
        raise TaskError(f"randomise is {shown(spread_of)}; give shares by parameter, such as {{'hull.Y_v': 0.1}}")


def _number(value: Any) -> bool:
    return isinstance(value, Real)


def _feels_wind(ship: Ship) -> bool:
    control = tuple(0.1 for _ in ship.model.controls)

    def motion(around: Environment) -> tuple[float, ...]:
        state = begun(ship.model, (0.0, 0.0, 0.7, ship.speed, 0.0, 0.0), control, around)
        return ship.model.derivative(state, control, around)[: len(STATES)]

    return motion(CALM) != motion(CALM._replace(wind_x=10.0))


@dataclass(frozen=True)
class Episode:
    """How an episode begins on each lane.

    Attributes:
        state, memory: of the system, shape (lanes, names).
        around: channels of the environment, shape (lanes, 8).
        goal: of the task.
        own: values of the parameters that differ by lane.
    """

    state: Array
    memory: Array
    around: Array
    goal: Array
    own: Array


@dataclass(frozen=True)
class Fleet:
    """Ships at a task.

    Attributes:
        work, settings, system: ship and task, their surroundings, and both as one system.
        free: names of the parameters that differ by lane.
        parameters: values of all parameters by name.
        rest: memory of the loop at the start.
        acting: what the actuators do then.
    """

    work: Work
    settings: Settings
    system: System
    free: tuple[str, ...]
    parameters: Mapping[str, float]
    rest: Array
    acting: Array

    @staticmethod
    def of(ship: Ship, task: Task, settings: Settings) -> Fleet:
        """Put together; TaskError: a ship or a setting that cannot be."""
        work = work_of(ship, task, settings)
        system, inner = compiled_of(work)
        # at the start shafts turn as the task has it, all other actuators rest
        helm, still = Helm(ship.model.controls, work.turns), (0.0,) * len(ship.model.states)
        rest = np.array(loop_memory(ship, helm, work.dt, {"policy.n_P": work.turns}, still))
        acting = rest[[inner.memory.index(name) for name in ship.model.controls]]
        free = free_names(inner, settings.randomise)
        return Fleet(work, settings, system, free, loop_values(ship, helm), rest, acting)

    @property
    def steps(self) -> int:
        """Time steps between two actions."""
        return round(self.work.scale.period / self.work.dt)

    @property
    def draws(self) -> int:
        """Random numbers that an episode begins with."""
        return _AROUND + len(self.free) + self.work.task.draws

    def begin(self, draws: Array) -> Episode:
        """Episodes of these draws, shape (lanes, self.draws); symbols in an array of objects give symbols."""
        free, task, settings = len(self.free), self.work.task, self.settings
        wind, current = spread(draws[:, 0], *settings.wind), spread(draws[:, 2], *settings.current)
        sides = [turn(2 * math.pi * draws[:, k]) for k in (1, 3) for turn in (np.cos, np.sin)]
        around = np.zeros((len(draws), len(CHANNELS)), draws.dtype)
        for k, value in enumerate((wind, wind, current, current)):
            around[:, k] = value * sides[k]
        halves = np.array(list(settings.randomise.values()))
        nominal = np.array([self.parameters[name] for name in self.free])
        own = nominal * (1.0 + halves * (2.0 * draws[:, _AROUND : _AROUND + free] - 1.0))
        start = task.begin(self.work.scale, draws[:, _AROUND + free :])
        c, s = np.cos(start.state[:, 2]), np.sin(start.state[:, 2])
        start.state[:, 3] += around[:, 2] * c + around[:, 3] * s
        start.state[:, 4] += around[:, 3] * c - around[:, 2] * s
        acting = np.hstack([np.tile(self.acting, (len(draws), 1)), around])
        state = np.hstack([start.state, settled(self.work.ship.model, acting)])
        rest = np.tile([*self.rest, 0.0], (len(draws), 1))
        return Episode(state, np.hstack([rest, start.memory]), around, start.goal, own)


Counts = NDArray[np.uint64]

# The increment and the mixing constants of SplitMix64 (Steele, Lea and Flood 2014).
_STEP, _FIRST, _SECOND = (np.uint64(k) for k in (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB))


def _mixed(z: Counts) -> Counts:
    z = z + _STEP
    z = (z ^ (z >> np.uint64(30))) * _FIRST
    z = (z ^ (z >> np.uint64(27))) * _SECOND
    return z ^ (z >> np.uint64(31))


def uniform(seeds: Counts, episodes: Counts, count: int) -> Array:
    """Numbers in [0, 1), shape (lanes, count), of each lane's seed and episode."""
    key = _mixed(_mixed(seeds) ^ episodes)
    places = np.arange(count, dtype=np.uint64)
    return (_mixed(key[:, None] ^ _mixed(places)) >> np.uint64(11)).astype(np.float64) * 2.0**-53
