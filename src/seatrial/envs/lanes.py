"""The compiled step of many ships at one task, moved by one action at a time, on buffers in the kernel's own order."""

from __future__ import annotations

from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..data import Array
from ..engine.csource import LANES
from ..engine.stepping import Buffers, stepping
from ..environment import CHANNELS
from ..ships import Ship
from ..simulate.lanes import Kernel
from .episodes import Fleet, Settings, uniform
from .tasks import Task, TaskError


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
        self.fleet, self.lanes = Fleet.of(ship, task, settings), lanes
        fleet, self._given = self.fleet, (ship, task, lanes, settings, threads)
        self.work, self.system = fleet.work, fleet.system
        blocks = -(-lanes // LANES)
        self._buffers = Buffers.of(self.system, blocks, len(fleet.free), np.array(list(fleet.parameters.values())))
        self._views(blocks, len(self.work.orders), len(self.work.seen))
        self.seeds, self.episodes = (np.zeros(blocks * LANES, dtype=np.uint64) for _ in range(2))
        compiled = Kernel(self.system, fleet.free).forward
        self._step = stepping(compiled, self._buffers, self.work.dt, fleet.steps, threads)

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

    def __reduce__(self) -> tuple[Any, ...]:
        # What is compiled stays in its process; another one takes it from the cache, and goes on from the same numbers.
        return Lanes, self._given, tuple(array.copy() for array in self._all())

    def __setstate__(self, arrays: tuple[Any, ...]) -> None:
        for into, array in zip(self._all(), arrays, strict=True):
            into[...] = array

    def _all(self) -> tuple[NDArray[Any], ...]:
        """All that changes from step to step."""
        buffers = self._buffers
        return (buffers.state, buffers.memory, buffers.series, buffers.own, buffers.out, self.seeds, self.episodes,
                self._actions, self._observed, self._rewards, self._over, self._cut, self._done)  # fmt: skip

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

    def begin_over(self) -> None:
        """Begin the next episode at once where one is over: `observation` is of its start there; all else stays."""
        at = np.flatnonzero(self._done)
        said = tuple(array.copy() for array in (self._observed, self._rewards, self._over, self._cut))
        self._begin(at)
        self._held[...] = 1.0  # every lane keeps its state; those that begin are seen
        self._advance()
        fresh = self._observed.reshape(len(self.seeds), -1)[at].copy()
        for into, before in zip((self._observed, self._rewards, self._over, self._cut), said, strict=True):
            into[...] = before
        self._observed.reshape(len(self.seeds), -1)[at] = fresh
        self._done[:] = False

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
        block, lane, fleet = at // LANES, at % LANES, self.fleet
        start = fleet.begin(uniform(self.seeds[at], self.episodes[at], fleet.draws))
        self.episodes[at] += np.uint64(1)
        first, around = len(CHANNELS) + len(self.work.orders), len(CHANNELS)
        self._series[block, :around, lane] = start.around
        self._series[block, first : first + start.goal.shape[1], lane] = start.goal
        self._buffers.own[block, : len(fleet.free), lane] = start.own
        self._state[block, :, lane] = start.state
        self._memory[block, : start.memory.shape[1], lane] = start.memory

    def value(self, name: str) -> Array:
        """A state or a control of every lane now, in SI units, shape (lanes,)."""
        return self._buffers.out[:, 1, self.system.stored.index(name)].reshape(-1)[: self.lanes].copy()

    def series(self, name: str) -> Array:
        """A channel of the environment on every lane, shape (lanes,)."""
        return self._series[:, self.system.series.index(name)].reshape(-1)[: self.lanes].copy()
