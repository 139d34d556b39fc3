"""The engine for what no trace can follow: a plant on arrays, its actuators and its policy on CasADi's machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from threadpoolctl import ThreadpoolController

from . import Array, Plant, System, trace
from .virtual import Packed, parameters_of, rows_of

_FEW = 32
"""Lanes below which one thread is faster: threads that wait for each other's small products cost most of the time."""


@dataclass(frozen=True)
class SteppedRollout:
    """A system with a `plant`, all lanes together, one step after the other by Euler's rule."""

    system: System
    lanewise: tuple[str, ...]
    before: Any

    @staticmethod
    def compile(system: System, lanewise: tuple[str, ...]) -> SteppedRollout:
        """Trace what is beside the plant: actuators and policy."""
        return SteppedRollout(system, lanewise, trace.preparation(system))

    def evaluate(self, state: Array, acting: Array, lanewise: Array, shared: Array) -> Array:
        """Rates of every lane for one sample, as if it had held for ever; shape (lanes, states)."""
        return self._plant(np.zeros((state.shape[0], len(self.system.hidden)))).rates(state, acting)

    def run(
        self, state0: Array, memory0: Array, series: Packed, lanewise: Array, shared: Array, *,
        t0: float, dt: float, steps: int, every: int, rk4: bool, threads: int,
    ) -> Array:  # fmt: skip
        """Stored rows of every lane, shape (lanes, rows, stored); `rk4` has no effect."""
        at_once = ThreadpoolController().limit(limits=1 if state0.shape[0] < _FEW else threads, user_api="blas")
        with at_once, np.errstate(over="ignore", invalid="ignore"):  # a lane that blows up is told by the engine
            return self._stepped(state0, memory0, series, parameters_of(self.system, self.lanewise, lanewise, shared),
                                 t0, dt, steps, every)  # fmt: skip

    def _stepped(
        self, state0: Array, memory0: Array, series: Packed, P: Array, t0: float, dt: float, steps: int, every: int
    ) -> Array:
        system, lanes = self.system, state0.shape[0]
        nm, na = len(system.memory), len(system.acting or system.series)
        z, m, plant = state0.copy(), memory0[:, :nm], self._plant(memory0[:, nm:])
        before = self.before.map(lanes) if self.before is not None else None
        out, one = np.empty((lanes, (steps - 1) // every + 1, len(system.stored))), np.ones((1, lanes))
        for k in range(steps):
            acting = series.series[:, min(k, series.steps - 1)]
            after, logged = m, m[:, :0]
            if before is not None:
                y = np.array(before((t0 + k * dt) * one, dt * one, rows_of(z), rows_of(m), rows_of(acting), P)).T
                acting, after, logged = y[:, :na], y[:, na : na + nm], y[:, na + nm :]
            if k % every == 0:
                out[:, k // every] = np.concatenate([z, m, logged], axis=1)
            if k < steps - 1:
                z, m = z + dt * plant.rates(z, acting), after
        return out

    def _plant(self, hidden: Array) -> Plant:
        if self.system.plant is None:
            raise ValueError("a system without a plant is traced, not stepped")
        return self.system.plant(hidden)
