"""What surrounds a ship at each step: weather as it comes, or what was set since.

Weather that can be told for any time, gusts on a steady wind, is worked out a few steps at a time (few enough that
the linear algebra stays on one thread), so that it costs neither memory nor a pause however long the ship sails.  Of
any other weather a long part is worked out beforehand, and twice as much each time it runs out.  Which part a step is
taken from follows from its number alone: a run that is made again from the middle meets the same weather to the last
bit.
"""

from __future__ import annotations

import math

import numpy as np

from ..data import Array
from ..environment import CHANNELS, Environment, Uniform, Weather
from ..weather import Gust, Together

_AT_A_TIME = 16
_AHEAD = 3600.0
"""Other weather is worked out this far ahead at first [s]."""


class Surroundings:
    """The channels of the environment, step by step.

    Attributes:
        values: their values at the step last asked for, eight of them.
        steady: the values where they hold; None where they change.
    """

    def __init__(self, weather: Weather, dt: float) -> None:
        self._weather, self._dt = weather, dt
        self._first, self._rows = -1, np.zeros((0, len(CHANNELS)))
        always = len(weather.series(dt, 2)) == 1  # which refuses parts that do not go together
        first = _window(weather, dt, 0, 1)
        self._local = first is not None
        self.values: list[float] = (weather.series(dt, 1) if first is None else first)[0].tolist()
        self._always = tuple(self.values) if always else None
        self.steady: tuple[float, ...] | None = self._always

    @property
    def changes(self) -> bool:
        """Whether the values differ from step to step."""
        return self.steady is None

    def hold(self, values: tuple[float, ...] | Environment | None) -> None:
        """Let the values be these from here on; None goes back to the weather."""
        self.steady = self._always if values is None else tuple(float(value) for value in values)
        if self.steady is not None:
            self.values = list(self.steady)

    def at(self, k: int) -> Array:
        """The values at step `k`, shape (8,)."""
        if self.steady is not None:
            return np.array(self.steady)
        if not self._first <= k < self._first + len(self._rows):
            self._work_out(k)
        row = self._rows[k - self._first]
        self.values = row.tolist()
        return row

    def _work_out(self, k: int) -> None:
        """The rows about step `k`."""
        if self._local:
            self._first = k - k % _AT_A_TIME
            rows = _window(self._weather, self._dt, self._first, _AT_A_TIME)
            self._rows = self._rows if rows is None else rows
            return
        whole = math.ceil(_AHEAD / self._dt)
        last = whole << (k // whole).bit_length()
        self._first = 0 if last == whole else last // 2
        self._rows = self._weather.series(self._dt, last)[self._first :].copy()


def _window(weather: Weather, dt: float, first: int, steps: int) -> Array | None:
    """Rows of some steps of a weather that can be told for them alone; None of any other."""
    if isinstance(weather, Uniform):
        return np.broadcast_to(weather.series(dt, 1), (steps, len(CHANNELS)))
    if isinstance(weather, Gust) and isinstance(weather.base, Uniform):
        out = np.array(np.broadcast_to(weather.base.series(dt, 1), (steps, len(CHANNELS))))
        U = math.hypot(out[0, 0], out[0, 1])
        if U > 0.0:
            north, east = out[0, 0] / U, out[0, 1] / U
            along, across = weather.gusts(dt * np.arange(first, first + steps, dtype=np.float64), U)
            out[:, 0] += along * north - across * east
            out[:, 1] += along * east + across * north
        return out
    if isinstance(weather, Together) and weather.parts:
        parts = [_window(part, dt, first, steps) for part in weather.parts]
        known = [part for part in parts if part is not None]
        return np.sum(known, axis=0) if len(known) == len(parts) else None
    return None
