"""The compiled step of many ships at one task, moved by one action at a time, on buffers in the kernel's own order.

Random numbers are counted: each depends on seed, episode and place alone, so lanes are independent of each other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, fields
from itertools import pairwise
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import unknown
from ..data import Array
from ..engine import System
from ..engine.csource import LANES
from ..engine.rollout import Simulator, simulator
from ..engine.virtual import Packed
from ..environment import CALM, CHANNELS, Environment
from ..models import STATES
from ..models.settled import begun, settled
from ..realtime.helm import Helm
from ..ships import Ship
from ..simulate.approach import approach, fastest, rounded_down
from ..simulate.loop import loop_memory, loop_values
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
    """

    period: float | None = None
    steps: int | None = None
    limit: int = 1000
    wind: tuple[float, float] = (0.0, 0.0)
    current: tuple[float, float] = (0.0, 0.0)
    randomise: Mapping[str, float] = field(default_factory=dict[str, float])


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
    return Work(ship, task, scale_of(ship, period), orders, ranges, period / steps, settings.limit,
                task.turns * turns)  # fmt: skip


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


class Lanes:
    """Lanes of one kernel; each has its own seed, episode, parameters, wind and current.

    Attributes:
        work: ship and task.
        lanes: number of ships.
        observation: shape (lanes, len(work.seen)), float32; overwritten by each step.
        reward, terminated, truncated: of the last step, shape (lanes,); also overwritten.
    """

    def __init__(self, ship: Ship, task: Task, lanes: int, settings: Settings, threads: int = 1) -> None:
        given: tuple[Any, ...] = (lanes, threads)
        if not all(isinstance(one, Integral) and int(one) >= 1 for one in given):
            raise TaskError(f"{lanes} ships on {threads} threads; give whole numbers, one or more of each")
        self.work, self.lanes, self.settings = work_of(ship, task, settings), lanes, settings
        self.system, inner = compiled_of(self.work)
        self._free = free_names(inner, settings.randomise)
        turns = self.work.turns
        helm, still = Helm(ship.model.controls, turns), (0.0,) * len(ship.model.states)
        values = loop_values(ship, helm)
        self._nominal = np.array([values[name] for name in self._free])
        blocks = -(-lanes // LANES)
        self._buffers = Buffers.of(self.system, blocks, len(self._free), np.array(list(values.values())))
        self._views(blocks, len(self.work.orders), len(self.work.seen))
        # at the start shafts turn as the task has it, all other actuators rest
        self._rest = np.array(loop_memory(ship, helm, self.work.dt, {"policy.n_P": turns}, still))
        self._acting = self._rest[[inner.memory.index(name) for name in ship.model.controls]]
        self.seeds, self.episodes = (np.zeros(blocks * LANES, dtype=np.uint64) for _ in range(2))
        steps, compiled = round(self.work.scale.period / self.work.dt), simulator(self.system, self._free)
        self._step = stepping(compiled, self._buffers, self.work.dt, steps, threads)

    def _views(self, blocks: int, chosen: int, seen: int) -> None:
        """The same memory in the shapes that the outside has."""
        buffers, at, states = self._buffers, len(CHANNELS), len(self.system.states)
        carried, lanes, last = states + len(self.system.memory), blocks * LANES, self._buffers.out[:, 1]
        self._state, self._memory, self._series = buffers.state, buffers.memory, buffers.series
        self._carried = last[:, :states], last[:, states:carried]
        self._chosen, self._held = self._series[:, at : at + chosen], self._series[:, -1]
        self._actions = np.zeros((lanes, chosen))
        self._by_block = self._actions.reshape(blocks, LANES, chosen).transpose(0, 2, 1)
        observations = np.zeros((lanes, seen), dtype=np.float32)
        self._told = last[:, carried : carried + seen].transpose(0, 2, 1)
        self._observed = observations.reshape(blocks, LANES, seen)
        self._judged = tuple(last[:, carried + seen + k] for k in range(3))
        self._rewards = np.zeros(lanes)
        self._over, self._cut, self._done = (np.zeros(lanes, dtype=np.bool_) for _ in range(3))
        self.observation, self.reward = observations[: self.lanes], self._rewards[: self.lanes]
        self.terminated, self.truncated = self._over[: self.lanes], self._cut[: self.lanes]

    def seed(self, seeds: NDArray[np.uint64]) -> None:
        """Give each lane its seed and begin counting its episodes anew; shape (lanes,)."""
        self.seeds[: self.lanes] = seeds
        self.seeds[self.lanes :] = seeds[-1]
        self.episodes[:] = 0

    def reset(self) -> None:
        """Begin an episode on every lane; `observation` is of its start."""
        self._begin(np.arange(len(self.seeds)))
        self._held[...] = 1.0
        self._advance()
        self._done[:] = False

    def step(self, action: Array | NDArray[np.float32]) -> None:
        """One action on every lane; a lane whose episode is over begins the next one instead.

        Args:
            action: shape (lanes, actions), -1 to 1; beyond that as at the ends.
        """
        self._actions[: self.lanes] = action
        self._chosen[...] = self._by_block
        self._held[...] = self._done.reshape(self._held.shape)
        if self._done.any():
            self._begin(np.flatnonzero(self._done))
        self._advance()
        np.logical_or(self._over, self._cut, out=self._done)

    def _advance(self) -> None:
        self._step()
        states, memory = self._carried
        self._state[...] = states
        self._memory[...] = memory
        self._observed[...] = self._told
        for into, judged in zip((self._rewards, self._over, self._cut), self._judged, strict=True):
            into.reshape(judged.shape)[...] = judged

    def _begin(self, at: NDArray[np.intp]) -> None:
        """Start an episode on these lanes."""
        block, lane = at // LANES, at % LANES
        free, task = len(self._free), self.work.task
        draws = uniform(self.seeds[at], self.episodes[at], _AROUND + free + task.draws)
        self.episodes[at] += np.uint64(1)
        wind = spread(draws[:, 0], *self.settings.wind)
        current = spread(draws[:, 2], *self.settings.current)
        around = [wind * np.cos(2 * math.pi * draws[:, 1]), wind * np.sin(2 * math.pi * draws[:, 1]),
                  current * np.cos(2 * math.pi * draws[:, 3]), current * np.sin(2 * math.pi * draws[:, 3])]  # fmt: skip
        for k, values in enumerate(around):
            self._series[block, k, lane] = values
        halves = np.array(list(self.settings.randomise.values()))
        shares = 1.0 + halves * (2.0 * draws[:, _AROUND : _AROUND + free] - 1.0)
        self._buffers.own[block, :free, lane] = self._nominal * shares
        start = task.begin(self.work.scale, draws[:, _AROUND + free :])
        c, s = np.cos(start.state[:, 2]), np.sin(start.state[:, 2])
        start.state[:, 3] += around[2] * c + around[3] * s
        start.state[:, 4] += around[3] * c - around[2] * s
        here = self._series[block, : len(CHANNELS), lane]
        acting = np.hstack([np.tile(self._acting, (len(here), 1)), here])
        self._state[block, :, lane] = np.hstack([start.state, settled(self.work.ship.model, acting)])
        first, rest = len(CHANNELS) + len(self.work.orders), len(self._rest)
        self._series[block, first : first + len(task.goal), lane] = start.goal
        self._memory[block, :rest, lane] = self._rest
        self._memory[block, rest, lane] = 0.0
        self._memory[block, rest + 1 : rest + 1 + len(task.memory), lane] = start.memory

    def value(self, name: str) -> Array:
        """A state or a control of every lane now, in SI units, shape (lanes,)."""
        return self._buffers.out[:, 1, self.system.stored.index(name)].reshape(-1)[: self.lanes].copy()

    def series(self, name: str) -> Array:
        """A channel of the environment on every lane, shape (lanes,)."""
        return self._series[:, self.system.series.index(name)].reshape(-1)[: self.lanes].copy()


@dataclass(frozen=True)
class Buffers:
    """What the kernel reads and writes; a block holds `LANES` lanes, side by side in the last axis.

    Attributes:
        state, memory, series, own: shape (blocks, names, LANES); `own` are the parameters of each lane.
        shared: parameters of all lanes, with one number behind them.
        out: first and last row of the values stored, shape (blocks, 2, stored, LANES).
    """

    state: Array
    memory: Array
    series: Array
    own: Array
    shared: Array
    out: Array

    @staticmethod
    def of(system: System, blocks: int, free: int, shared: Array) -> Buffers:
        """Zeros for a system with that many parameters a lane."""
        names = (len(system.states), max(len(system.memory), 1), len(system.series), max(free, 1))
        state, memory, series, own = (np.zeros((blocks, count, LANES)) for count in names)
        return Buffers(state, memory, series, own, np.append(shared, 0.0),
                       np.zeros((blocks, 2, len(system.stored), LANES)))  # fmt: skip


def stepping(simulator: Simulator, buffers: Buffers, dt: float, steps: int, threads: int) -> Callable[[], None]:
    """Arguments that move all lanes by `steps` time steps; state and memory are left to the caller."""
    if simulator.virtual:
        return lambda: _slowly(simulator, buffers, dt, steps)
    run, blocks = simulator.kernel.code.rollout, buffers.state.shape[0]
    # the addresses hold as long as the buffers do, which the lanes keep
    state, memory, series, own, shared, out = (
        values.ctypes.data for values in (buffers.state, buffers.memory, buffers.series, buffers.own, buffers.shared,
                                          buffers.out))  # fmt: skip
    numbers = (steps + 1, 0.0, dt, steps, 1)
    arrays = (state, memory, series, buffers.series[0].size, 0, own, shared, out, 2)
    parts = min(threads, blocks)
    if parts == 1:
        return lambda: run(0, blocks, *numbers, *arrays)
    edges = list(pairwise(blocks * k // parts for k in range(parts + 1)))
    pool = ThreadPoolExecutor(parts - 1)

    def together() -> None:
        others = [pool.submit(run, first, last, *numbers, *arrays) for first, last in edges[1:]]
        run(*edges[0], *numbers, *arrays)
        for other in others:
            other.result()

    return together


def _slowly(simulator: Simulator, buffers: Buffers, dt: float, steps: int) -> None:
    """The same on CasADi's virtual machine, where there is no compiler."""
    system, (blocks, channels, _) = simulator.system, buffers.series.shape

    def flat(values: Array, count: int) -> Array:
        return np.moveaxis(values[:, :count], 1, -1).reshape(blocks * LANES, count)

    rows = simulator.kernel.run(
        flat(buffers.state, len(system.states)), flat(buffers.memory, len(system.memory)),
        Packed(flat(buffers.series, channels)[:, None], blocks * LANES), flat(buffers.own, len(simulator.lanewise)),
        buffers.shared[:-1], t0=0.0, dt=dt, steps=steps + 1, every=steps, rk4=True, threads=1,
    )  # fmt: skip
    buffers.out[...] = np.moveaxis(rows.reshape(blocks, LANES, 2, -1), 1, -1)


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
