"""Stepping a network: what it remembers is handed through, so that a run can be saved at any step."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..data import Array
from ..engine import System
from ..engine.rollout import Simulator
from ..environment import CHANNELS, Environment
from ..ships import Ship


class NetworkStep:
    """A ship that moves on arrays, by Euler's rule at her own sample time; a `engine.single.Stepper`."""

    def __init__(self, ship: Ship, simulator: Simulator, parameters: Array, dt: float) -> None:
        self._model: Any = ship.model
        self._system: System = simulator.system
        self._before, self._parameters, self._dt = simulator.kernel.before, parameters, dt
        self._series = np.zeros(len(self._system.series))
        self._hidden: tuple[float, ...] = (0.0,) * len(self._system.hidden)
        self.now: Any = [0.0] * len(self._system.stored)

    def give(self, place: int, value: float) -> None:
        """Set the series number `place` from here on."""
        self._series[place] = value

    def surround(self, values: Array) -> None:
        """Set the first series, as many as there are values."""
        self._series[: len(values)] = values

    def step(self, t: float) -> None:
        """Move on by one step from time `t` [s]."""
        n, m, c = len(self._system.states), len(self._system.memory), len(self._model.controls)
        state, memory = self.now[:n], self.now[n : n + m]
        prepared = self._before(t, self._dt, state, memory or [0.0], self._series, self._parameters)
        y = np.array(prepared).ravel().tolist()
        na = len(self._system.acting)
        control, around = tuple(y[:c]), Environment(*y[c : c + len(CHANNELS)])
        rates, self._hidden = self._model.advance(tuple(state), control, around, self._hidden)
        moved = (*self._model.derivative(tuple(state), control, around)[:3], *rates)
        self.now = [*(z + self._dt * dz for z, dz in zip(state, moved, strict=True)), *y[na:]]

    def load(self, values: Array) -> None:
        """Begin from these states and memory, hidden ones last."""
        given, own = values.tolist(), len(values) - len(self._hidden)
        self.now, self._hidden = [*given[:own], *self.now[own:]], tuple(given[own:])

    def dump(self) -> Array:
        """States and memory, hidden ones last."""
        own = len(self._system.states) + len(self._system.memory)
        return np.array([*self.now[:own], *self._hidden])
