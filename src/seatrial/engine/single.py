"""One ship, one step at a time, in buffers that stay where they are.

A rollout packs its arrays for every run, which costs more than a step does.  Here the kernel reads and writes the
same memory from step to step: it takes the end of the last step out of one buffer and writes this step to another.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from . import Array, System
from .csource import LANES
from .rollout import Simulator, is_rk4
from .simd import field_of
from .virtual import Packed

_LONG, _DOUBLE, _ARRAY = ctypes.c_long, ctypes.c_double, ctypes.c_void_p


class Stepper(Protocol):
    """A system that moves by one step at a time.

    `now` holds the values of `system.stored` at the present time; a reference kept over a step reads old values.
    """

    now: Sequence[float]

    def give(self, place: int, value: float) -> None:
        """Set the series number `place` from here on."""

    def surround(self, values: Array) -> None:
        """Set the first series, as many as there are values."""

    def step(self, t: float) -> None:
        """Move on by one step from time `t` [s]."""

    def load(self, values: Array) -> None:
        """Begin from these states and memory, hidden ones included."""

    def dump(self) -> Array:
        """States and memory, hidden ones included, as `load` takes them."""
        ...


class KernelStep(Stepper):
    """A compiled system, stepped in place; all lanes of its block are the same ship."""

    def __init__(self, simulator: Simulator, parameters: Array, dt: float, method: str = "rk4") -> None:
        system: System = simulator.system
        self._carried = len(system.states) + len(system.memory)
        self._series = np.zeros((max(len(system.series), 1), LANES))
        self._parameters = np.ascontiguousarray(np.append(parameters, 0.0), dtype=np.float64)
        self._rows = tuple(np.zeros((2, len(system.stored), LANES)) for _ in range(2))
        self._views = tuple(rows[1, :, 0].data for rows in self._rows)
        self._run = simulator.kernel.code.rollout
        unused = np.zeros(LANES)
        self._held = (self._rows, self._series, self._parameters, unused)  # what the addresses below point to
        self._first = (_LONG(0), _LONG(1), _LONG(2))
        self._rest = tuple(self._arguments(system, k, dt, method, unused) for k in range(2))
        self._at = 0
        self.now: Any = self._views[0]

    def _arguments(self, system: System, k: int, dt: float, method: str, unused: Array) -> tuple[Any, ...]:
        """What follows the time in a call that goes from buffer `k` to the other one."""
        start, end = self._rows[k][1], self._rows[1 - k]
        where = [start.ctypes.data, start[len(system.states) :].ctypes.data, self._series.ctypes.data]
        state, memory, series = (_ARRAY(address) for address in where)
        fixed = (unused.ctypes.data, self._parameters.ctypes.data, end.ctypes.data)
        return (_DOUBLE(dt), _LONG(1), _LONG(int(is_rk4(method))), state, memory, series, _LONG(0), _LONG(0),
                *(_ARRAY(address) for address in fixed), _LONG(2), _ARRAY(field_of(system)))  # fmt: skip

    def give(self, place: int, value: float) -> None:
        self._series[place] = value

    def surround(self, values: Array) -> None:
        self._series[: len(values)] = values[:, None]

    def step(self, t: float) -> None:
        at = self._at
        self._run(*self._first, t, *self._rest[at])
        self._at = at = 1 - at
        self.now = self._views[at]

    def load(self, values: Array) -> None:
        self._rows[self._at][1, : self._carried] = values[:, None]

    def dump(self) -> Array:
        return self._rows[self._at][1, : self._carried, 0].copy()


class VirtualStep(Stepper):
    """The same on CasADi's virtual machine, where there is no compiler."""

    def __init__(self, simulator: Simulator, parameters: Array, dt: float, method: str = "rk4") -> None:
        self._simulator, self._parameters, self._dt, self._rk4 = simulator, parameters, dt, is_rk4(method)
        system: System = simulator.system
        self._states, self._carried = len(system.states), len(system.states) + len(system.memory)
        self._series = np.zeros((1, 1, len(system.given)))
        self.now: Any = [0.0] * len(system.stored)

    def give(self, place: int, value: float) -> None:
        self._series[0, 0, place] = value

    def surround(self, values: Array) -> None:
        self._series[0, 0, : len(values)] = values

    def step(self, t: float) -> None:
        start = self.dump()[None]
        out = self._simulator.kernel.run(
            start[:, : self._states], start[:, self._states :], Packed(self._series, 1), np.zeros((1, 0)),
            self._parameters, t0=t, dt=self._dt, steps=2, every=1, rk4=self._rk4, threads=1,
        )  # fmt: skip
        self.now = out[0, 1].tolist()

    def load(self, values: Array) -> None:
        self.now = [*values.tolist(), *self.now[self._carried :]]

    def dump(self) -> Array:
        return np.array(self.now[: self._carried])


def stepper(simulator: Simulator, parameters: Array, dt: float, method: str = "rk4") -> Stepper:
    """What steps a compiled system; each call makes its own, with its own buffers.

    Args:
        simulator: a traced system without lane-wise parameters.
        parameters: values in the order of its parameters.
        dt: time step [s].
        method: "rk4" or "euler".
    """
    kind = VirtualStep if simulator.virtual else KernelStep
    return kind(simulator, parameters, dt, method)
