"""Running compiled kernels: lanes in blocks, blocks over threads.

Every array is padded to whole blocks by repeating its last lane, and a lane never looks at its
neighbours, so a result depends neither on the batch nor on the number of threads.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from ..core.symbolic import alone
from ..core.values import dataclass
from . import Array, System, trace
from .cache import library
from .csource import LANES, rollout_source, sensitivity_source

_TYPES = {"l": ctypes.c_long, "d": ctypes.c_double, "a": ctypes.c_void_p}
_TRACED = 64


@dataclass(frozen=True)
class Packed:
    """Series in block order, shape (blocks, steps, series, LANES), and how many lanes are real."""

    blocks: Array
    lanes: int

    @property
    def steps(self) -> int:
        """Steps that the series cover; one where they hold."""
        return self.blocks.shape[1]

    @property
    def channels(self) -> int:
        """Channels of the series."""
        return self.blocks.shape[2]

    @cached_property
    def series(self) -> Array:
        """As they were given, shape (lanes, steps, channels); what another back end packs."""
        return np.moveaxis(self.blocks, -1, 1).reshape(-1, self.steps, self.channels)[: self.lanes]

    @property
    def strides(self) -> tuple[int, int, int]:
        """Address of the series, and numbers from one block and from one step to the next; 0 where they hold."""
        held = self.steps == 1
        return self.blocks.ctypes.data, self.blocks[0].size, 0 if held else self.channels * LANES


def blocks(values: Array) -> Array:
    """(lanes, ...) -> (blocks, ..., LANES), padded with copies of the last lane."""
    lanes = values.shape[0]
    count = -(-lanes // LANES)  # rounded up
    if count * LANES != lanes:
        values = np.concatenate([values, np.repeat(values[-1:], count * LANES - lanes, axis=0)])
    # lanes last and side by side, so that one load of a vector takes one quantity of many ships
    shaped = values.reshape(count, LANES, *values.shape[1:])
    return np.ascontiguousarray(np.moveaxis(shaped, 1, -1), dtype=np.float64)


def pack(series: Array) -> Packed:
    """Series of shape (lanes, steps, channels), one step where they hold, in block order."""
    return Packed(blocks(series), series.shape[0])


def field_of(system: System) -> int:
    """Address of the tables that a system looks into; 0 where it looks into none."""
    return system.field.pointers.ctypes.data if system.field else 0


def _shared(values: Array) -> Array:
    return np.ascontiguousarray(np.append(values, 0.0), dtype=np.float64)


def _declare(function: Any, arguments: str) -> None:
    """Give a C function without a result the types of its arguments, by the letters of `_TYPES`."""
    function.argtypes, function.restype = [_TYPES[letter] for letter in arguments.replace(" ", "")], None


def _spread(job: Callable[[int, int], None], count: int, threads: int) -> None:
    """Run `job(first, last)` over `count` blocks in contiguous parts, one thread a part."""
    parts = min(threads, count)
    # threads, not processes: ctypes lets go of the interpreter's lock while a kernel runs
    edges = [count * i // parts for i in range(parts + 1)]
    if parts == 1:
        job(0, count)
        return
    with ThreadPoolExecutor(parts) as pool:
        for done in [pool.submit(job, a, b) for a, b in pairwise(edges)]:
            done.result()


def _places(system: System, lanewise: tuple[str, ...]) -> dict[int, int]:
    return {system.parameters.index(name): k for k, name in enumerate(lanewise)}


# A system is traced and printed once, however often it is compiled: that takes longer than a short run.
@lru_cache(maxsize=_TRACED)
@alone
def _rollout_source(system: System, lanewise: tuple[str, ...]) -> str:
    return rollout_source(
        system, trace.right_hand_side(system), trace.preparation(system), _places(system, lanewise),
        trace.kicks(system),
    )  # fmt: skip


@lru_cache(maxsize=_TRACED)
@alone
def _sensitivity_source(system: System, free: tuple[str, ...], lanewise: tuple[str, ...]) -> str:
    return sensitivity_source(system, trace.jacobian(system, free), _places(system, lanewise))


@dataclass(frozen=True)
class SimdRollout:
    """A system compiled for plain integration."""

    system: System
    code: ctypes.CDLL

    pack = staticmethod(pack)

    @staticmethod
    def compile(system: System, lanewise: tuple[str, ...]) -> SimdRollout:
        """Trace, print, compile (or take from the cache) and load."""
        code = library(_rollout_source(system, lanewise))
        _declare(code.rollout, "lll dd ll aaa ll aaa l a")
        _declare(code.evaluate, "l aaaaa")
        return SimdRollout(system, code)

    def run(
        self, state0: Array, memory0: Array, series: Packed, lanewise: Array, shared: Array, *,
        t0: float, dt: float, steps: int, every: int, rk4: bool, threads: int,
    ) -> Array:  # fmt: skip
        """Stored rows of every lane, shape (lanes, rows, stored)."""
        lanes, rows = state0.shape[0], (steps - 1) // every + 1
        Z, M, Q, P = blocks(state0), blocks(memory0), blocks(lanewise), _shared(shared)
        count, out = Z.shape[0], np.empty((Z.shape[0], rows, len(self.system.stored), LANES))

        def job(first: int, last: int) -> None:
            self.code.rollout(
                first, last, steps, t0, dt, every, int(rk4), Z.ctypes.data, M.ctypes.data,
                *series.strides, Q.ctypes.data, P.ctypes.data, out.ctypes.data, rows,
                field_of(self.system),
            )  # fmt: skip

        _spread(job, count, threads)
        return np.moveaxis(out, -1, 1).reshape(count * LANES, rows, -1)[:lanes]

    def evaluate(self, state: Array, acting: Array, lanewise: Array, shared: Array) -> Array:
        """Rates of every lane for one call of the right-hand side, shape (lanes, states)."""
        Z, A, Q, P = blocks(state), blocks(acting), blocks(lanewise), _shared(shared)
        out = np.empty_like(Z)
        self.code.evaluate(Z.shape[0], Z.ctypes.data, A.ctypes.data, Q.ctypes.data, P.ctypes.data, out.ctypes.data)
        return np.moveaxis(out, -1, 1).reshape(-1, Z.shape[1])[: state.shape[0]]


@dataclass(frozen=True)
class SimdSensitivity:
    """An open-loop system compiled for integration with exact forward sensitivities."""

    system: System
    free: tuple[str, ...]
    code: ctypes.CDLL

    pack = staticmethod(pack)

    @staticmethod
    def compile(system: System, free: tuple[str, ...], lanewise: tuple[str, ...]) -> SimdSensitivity:
        """Trace, differentiate, print, compile (or take from the cache) and load."""
        code = library(_sensitivity_source(system, free, lanewise))
        _declare(code.sensitivity, "lll d ll aa ll aaaa l a")
        code.room.argtypes, code.room.restype = [], ctypes.c_long
        return SimdSensitivity(system, free, code)

    def run(
        self, state0: Array, series: Packed, lanewise: Array, shared: Array, *,
        dt: float, steps: int, every: int, rk4: bool, threads: int,
    ) -> tuple[Array, Array]:  # fmt: skip
        """States (lanes, rows, states) and derivatives (lanes, rows, states, free + states)."""
        lanes, rows = state0.shape[0], (steps - 1) // every + 1
        Z, Q, P = blocks(state0), blocks(lanewise), _shared(shared)
        count, ns = Z.shape[0], len(self.system.states)
        columns = len(self.free) + ns
        out = np.empty((count, rows, ns, LANES))
        slopes = np.empty((count * LANES, rows, ns, columns))

        def job(first: int, last: int) -> None:
            work = np.empty(self.code.room())
            self.code.sensitivity(
                first, last, steps, dt, every, int(rk4), Z.ctypes.data, *series.strides,
                Q.ctypes.data, P.ctypes.data, out.ctypes.data, slopes.ctypes.data, rows, work.ctypes.data,
            )  # fmt: skip

        _spread(job, count, threads)
        return np.moveaxis(out, -1, 1).reshape(count * LANES, rows, ns)[:lanes], slopes[:lanes]
