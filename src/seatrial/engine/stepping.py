"""Many lanes moved in place, some steps at a time, on buffers in the kernel's own order.

A rollout packs its arrays for every run; whoever looks at the lanes between steps keeps them packed.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

from ..core.values import dataclass
from . import Array, System
from .csource import LANES
from .rollout import Simulator
from .simd import field_of
from .virtual import Packed


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
        names = (len(system.states), max(len(system.memory), 1), len(system.given), max(free, 1))
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
    arrays = (state, memory, series, buffers.series[0].size, 0, own, shared, out, 2, field_of(simulator.system))
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
