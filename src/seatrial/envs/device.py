"""Many ships at one task on a GPU: actions in, observations out, without a copy to the processor.

Three kernels a step: `begin` starts the episodes that are due, from the same counted random numbers as on the
processor; the engine's rollout moves every ship by a period; `tell` hands out what the task saw.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import DeviceError
from ..data import Array
from ..engine import Scalars
from ..engine.cuda import Device, DeviceArray
from ..engine.cuda.lanes import CudaRollout, Packed
from ..engine.cuda.source import lane_source
from ..engine.trace import function_of
from ..environment import CHANNELS
from ..models import STATES
from ..ships import Ship
from .episodes import Fleet, Settings
from .tasks import Task

_NONE = np.zeros(1)
"""Parameters of kernels that have none."""


def episode_source(fleet: Fleet, single: bool) -> str:
    """CUDA source of the kernels that begin an episode and that tell its moment."""
    system, work = fleet.system, fleet.work

    def begin(draws: Scalars) -> Scalars:
        row = np.empty((1, len(draws)), dtype=object)
        for k, draw in enumerate(draws):
            row[0, k] = draw
        start = fleet.begin(row)
        return tuple(value for part in (start.state, start.memory, start.around, start.goal, start.own)
                     for value in part[0])  # fmt: skip

    goal = len(CHANNELS) + len(work.orders)
    into = (("Z", len(system.states)), ("M", len(system.memory)), ("S", len(CHANNELS)),
            (f"(S+{goal}*n)", len(work.task.goal)), ("Q", len(fleet.free)))  # fmt: skip
    sizes = {
        "NS": len(system.states), "NM": len(system.memory), "NSEEN": len(work.seen), "NORDERS": len(work.orders),
        "NAROUND": len(CHANNELS), "NSERIES": len(system.series), "NDRAWS": fleet.draws, "NU1": max(fleet.draws, 1),
    }  # fmt: skip
    template = Path(__file__).with_name("environment.cu").read_text(encoding="utf-8")
    return lane_source(function_of(begin, fleet.draws), template, into, sizes, single)


class DeviceLanes:
    """What `lanes.Lanes` is on the processor, with every array on a device and each overwritten by the next step.

    Attributes:
        work: ship and task.
        lanes: number of ships.
        observation: shape (lanes, len(work.seen)), float32.
        reward, terminated, truncated: of the last step, shape (lanes,).
    """

    def __init__(self, ship: Ship, task: Task, lanes: int, settings: Settings, device: Device, single: bool) -> None:
        """Compile; DeviceError: a model whose states beyond the six depend on the time before."""
        self.fleet, self.lanes, self._device = Fleet.of(ship, task, settings), lanes, device
        self._given = (ship, task, lanes, settings, device, single)
        system, self.work = self.fleet.system, self.fleet.work
        if len(system.states) > len(STATES):
            raise DeviceError(f"{ship.name}: a model with states beyond the six begins on the processor only")
        self._rollout = CudaRollout.compile(system, self.fleet.free, device, single)
        self._episode = device.module(episode_source(self.fleet, single), single)
        self._shared = np.array(list(self.fleet.parameters.values()))
        self._arrays(lanes, self._rollout.dtype)

    def _arrays(self, lanes: int, dtype: Any) -> None:
        system, empty = self.fleet.system, self._device.empty
        counts = (len(system.states), len(system.memory), len(self.fleet.free))
        self._state, self._memory, self._own = (empty((max(count, 1), lanes), dtype) for count in counts)
        self._series = Packed(empty((1, len(system.series), lanes), dtype), lanes)
        self._seeds, self._episodes = (self._device.put(np.zeros(lanes, np.uint64)) for _ in range(2))
        self._last = empty((2, len(system.stored), lanes), dtype)
        self.observation, self.reward = empty((lanes, len(self.work.seen)), np.float32), empty((lanes,), np.float64)
        self.terminated, self.truncated, self._done = (self._device.put(np.zeros(lanes, np.bool_)) for _ in range(3))
        self._still = self._device.put(np.zeros((lanes, len(self.work.orders)), np.float32))

    def __reduce__(self) -> tuple[Any, ...]:
        return DeviceLanes, self._given, tuple(array.host() for array in self._all())

    def __setstate__(self, arrays: tuple[Any, ...]) -> None:
        for into, array in zip(self._all(), arrays, strict=True):
            into.fill(array)

    def _all(self) -> tuple[DeviceArray, ...]:
        """All that changes from step to step."""
        return (self._state, self._memory, self._own, self._series.array, self._seeds, self._episodes, self._last,
                self.observation, self.reward, self.terminated, self.truncated, self._done)  # fmt: skip

    def seed(self, seeds: NDArray[np.uint64]) -> None:
        """Give each lane its seed and begin counting its episodes anew; shape (lanes,)."""
        self._seeds.fill(np.asarray(seeds, np.uint64))
        self._episodes.fill(np.zeros(self.lanes, np.uint64))

    def reset(self) -> None:
        """Begin an episode on every lane; `observation` is of its start."""
        self._advance(self._still, True)

    def step(self, action: Any) -> None:
        """One action on every lane; a lane whose episode is over begins the next one instead.

        Args:
            action: shape (lanes, actions), float32, -1 to 1, beyond that as at the ends: an array of the device that
                knows DLPack, or one of NumPy, which is copied.
        """
        given = self._device.put(action) if isinstance(action, np.ndarray) else self._device.view(action)
        wanted = (self.lanes, len(self.work.orders))
        if given.shape != wanted or given.dtype != np.float32:
            raise ValueError(f"an action of shape {given.shape}, {given.dtype}; this one takes {wanted}, float32")
        self._advance(given, False)

    def _advance(self, action: DeviceArray, anew: bool) -> None:
        lanes, steps = self.lanes, self.fleet.steps
        self._episode.launch("begin", lanes, _NONE, lanes, int(anew), self._seeds, self._episodes, self._done, action,
                             self._state, self._memory, self._series.array, self._own)  # fmt: skip
        self._rollout.rows(
            self._state, self._memory, self._series, self._own, self._shared,
            t0=0.0, dt=self.work.dt, steps=steps + 1, every=steps, rk4=True, into=self._last,
        )  # fmt: skip
        self._episode.launch("tell", lanes, _NONE, lanes, self._last, self._state, self._memory, self.observation,
                             self.reward, self.terminated, self.truncated, self._done, int(anew))  # fmt: skip

    def value(self, name: str) -> Array:
        """A state or a control of every lane now, in SI units, on the processor, shape (lanes,)."""
        return self._last.host()[1, self.fleet.system.stored.index(name)].astype(np.float64)

    def series(self, name: str) -> Array:
        """A channel of the environment on every lane, on the processor, shape (lanes,)."""
        return self._series.array.host()[0, self.fleet.system.series.index(name)].astype(np.float64)
