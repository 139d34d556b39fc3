"""Systems over lanes on a device: arrays with the lanes last, so that neighbouring threads read neighbouring words."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ...core.values import dataclass
from .. import Array, System, trace
from . import Device, DeviceArray, DeviceError, Module, Numbers
from .source import rollout_source, sensitivity_source

COLUMNS, SINGLE_COLUMNS = 6, 9
"""Columns of sensitivities a thread carries: the more, the more share a Jacobian and the fewer fit its registers."""
_TRACED = 64


@dataclass(frozen=True)
class Packed:
    """Series on a device, shape (steps, channels, lanes), or (steps, channels, 1) where all lanes have the same."""

    array: DeviceArray
    lanes: int

    @property
    def steps(self) -> int:
        """Steps that the series cover; one where they hold."""
        return self.array.shape[0]

    @property
    def channels(self) -> int:
        """Channels of the series."""
        return self.array.shape[1]

    @property
    def strides(self) -> tuple[DeviceArray, int, int, int]:
        """The array, and numbers from one step, channel and lane to the next."""
        _, channels, lanes = self.array.shape
        return self.array, 0 if self.steps == 1 else channels * lanes, lanes, int(lanes > 1)


@dataclass(frozen=True)
class _OnDevice:
    device: Device
    single: bool

    @property
    def dtype(self) -> np.dtype[Any]:
        return np.dtype(np.float32 if self.single else np.float64)

    def pack(self, series: Array) -> Packed:
        """Series of shape (lanes, steps, channels); one step where they hold, a stride of zero where lanes share."""
        shared = series[:1] if series.strides[0] == 0 else series
        return Packed(self.put(np.moveaxis(shared, 0, -1)), series.shape[0])

    def put(self, values: Numbers) -> DeviceArray:
        """Values on the device, in the precision of the kernel."""
        return self.device.put(np.ascontiguousarray(values, dtype=self.dtype))


def _places(system: System, lanewise: tuple[str, ...]) -> dict[int, int]:
    return {system.parameters.index(name): k for k, name in enumerate(lanewise)}


@lru_cache(maxsize=_TRACED)
def rollout_code(system: System, lanewise: tuple[str, ...], single: bool) -> str:
    """CUDA source that integrates a system, with the names of its parameters that differ by lane."""
    rhs, before = trace.right_hand_side(system), trace.preparation(system)
    return rollout_source(system, rhs, before, _places(system, lanewise), single)


@lru_cache(maxsize=_TRACED)
def sensitivity_code(system: System, part: Part, lanewise: tuple[str, ...], single: bool) -> str:
    """CUDA source that integrates a system with a part of the columns of its sensitivities."""
    j = trace.jacobian(system, part.free)
    return sensitivity_source(system, j, part.initial, _places(system, lanewise), single)


@dataclass(frozen=True)
class CudaRollout(_OnDevice):
    """A system compiled for plain integration on a device."""

    system: System
    code: Module

    @staticmethod
    def compile(system: System, lanewise: tuple[str, ...], device: Device, single: bool) -> CudaRollout:
        """Trace, print, compile (or take from the cache) and load."""
        return CudaRollout(device, single, system, device.module(rollout_code(system, lanewise, single), single))

    def rows(
        self, state0: DeviceArray, memory0: DeviceArray, series: Packed, lanewise: DeviceArray, shared: Array, *,
        t0: float, dt: float, steps: int, every: int, rk4: bool, into: DeviceArray | None = None,
    ) -> DeviceArray:  # fmt: skip
        """Stored rows on the device, new or `into`, shape (rows, stored, lanes); arguments have the lanes last too."""
        lanes = state0.shape[1]
        out = into or self.device.empty(((steps - 1) // every + 1, len(self.system.stored), lanes), self.dtype)
        self.code.launch("rollout", lanes, shared, lanes, steps, float(t0), float(dt), every, 4 if rk4 else 1,
                         state0, memory0, *series.strides, lanewise, out)  # fmt: skip
        return out

    def run(
        self, state0: Array, memory0: Array, series: Packed, lanewise: Array, shared: Array, *,
        t0: float, dt: float, steps: int, every: int, rk4: bool, threads: int,
    ) -> Array:  # fmt: skip
        """Stored rows of every lane, shape (lanes, rows, stored), on the processor."""
        z, m, q = (self.put(values.T) for values in (state0, memory0, lanewise))
        out = self.rows(z, m, series, q, shared, t0=t0, dt=dt, steps=steps, every=every, rk4=rk4)
        return np.moveaxis(out.host(), -1, 0).astype(np.float64, order="C")

    def evaluate(self, state: Array, acting: Array, lanewise: Array, shared: Array) -> Array:
        """Refused: one right-hand side is work for the processor; DeviceError."""
        raise DeviceError("rates of one moment are computed on the processor; make the simulator with device='cpu'")


@dataclass(frozen=True)
class Part:
    """Columns of sensitivities that one kernel carries: parameters, then states, and where each begins among all."""

    free: tuple[str, ...]
    initial: int
    first: int
    state: int


def parts(free: tuple[str, ...], states: int, width: int) -> tuple[Part, ...]:
    """Columns of the parameters `free`, then of the initial state, `width` a kernel."""
    total, found = len(free) + states, list[Part]()
    for a in range(0, total, width):
        b = min(a + width, total)
        own = free[a:b]
        found.append(Part(own, b - a - len(own), a, max(a - len(free), 0)))
    return tuple(found)


@dataclass(frozen=True)
class CudaSensitivity(_OnDevice):
    """An open-loop system compiled for integration with exact forward sensitivities on a device.

    A thread carries a lane and few columns, as many as its registers hold; other columns are other kernels, each with
    the parts of the Jacobian that it needs.
    """

    system: System
    free: tuple[str, ...]
    codes: tuple[tuple[Part, Module], ...]

    @staticmethod
    def compile(
        system: System, free: tuple[str, ...], lanewise: tuple[str, ...], device: Device, single: bool
    ) -> CudaSensitivity:
        """Trace, differentiate, print, compile (or take from the cache) and load."""
        codes = tuple(
            (part, device.module(sensitivity_code(system, part, lanewise, single), single))
            for part in parts(free, len(system.states), SINGLE_COLUMNS if single else COLUMNS)
        )
        return CudaSensitivity(device, single, system, free, codes)

    def rows(
        self, state0: DeviceArray, series: Packed, lanewise: DeviceArray, shared: Array, *,
        dt: float, steps: int, every: int, rk4: bool,
    ) -> tuple[DeviceArray, DeviceArray]:  # fmt: skip
        """States (rows, states, lanes) and derivatives (rows, states, free + states, lanes) on the device."""
        (ns, lanes), rows, columns = state0.shape, (steps - 1) // every + 1, len(self.free) + len(self.system.states)
        out = self.device.empty((rows, ns, lanes), self.dtype)
        slopes = self.device.empty((rows, ns, columns, lanes), self.dtype)
        for part, code in self.codes:
            code.launch("sensitivity", lanes, shared, lanes, steps, float(dt), every, 4 if rk4 else 1, state0,
                        *series.strides, lanewise, out, slopes, part.first, part.state, columns)  # fmt: skip
        return out, slopes

    def run(
        self, state0: Array, series: Packed, lanewise: Array, shared: Array, *,
        dt: float, steps: int, every: int, rk4: bool, threads: int,
    ) -> tuple[Array, Array]:  # fmt: skip
        """States (lanes, rows, states) and derivatives (lanes, rows, states, free + states) on the processor."""
        out, slopes = self.rows(self.put(state0.T), series, self.put(lanewise.T), shared, dt=dt, steps=steps,
                                every=every, rk4=rk4)  # fmt: skip
        first, second = (np.moveaxis(one.host(), -1, 0).astype(np.float64, order="C") for one in (out, slopes))
        return first, second
