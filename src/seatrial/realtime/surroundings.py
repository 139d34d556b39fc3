"""What surrounds a ship at each step: weather as it was forecast, or what was set since."""

from __future__ import annotations

import math

import numpy as np

from ..data import Array
from ..environment import Environment, Weather

_HORIZON = 3600.0
"""Weather that changes is worked out this far ahead [s]; each time it runs out, for twice as long."""


class Surroundings:
    """The channels of the environment, step by step.

    Attributes:
        now: their values at the step last asked for, shape (8,).
        steady: the values where they hold; None where they change.
    """

    def __init__(self, weather: Weather, dt: float) -> None:
        self._weather, self._dt = weather, dt
        two = weather.series(dt, 2)
        self._ahead = two if len(two) == 1 else weather.series(dt, math.ceil(_HORIZON / dt) + 1)
        self._forecast = self._ahead
        self.now: Array = self._ahead[0]
        self._always = None if len(two) > 1 else tuple(self.now.tolist())
        self.steady: tuple[float, ...] | None = self._always

    @property
    def changes(self) -> bool:
        """Whether the values differ from step to step."""
        return len(self._ahead) > 1

    def hold(self, values: tuple[float, ...] | Environment | None) -> None:
        """Let the values be these from here on; None goes back to the weather."""
        self.steady = self._always if values is None else tuple(float(value) for value in values)
        self._ahead = self._forecast if self.steady is None else np.array([self.steady], dtype=np.float64)

    def at(self, k: int) -> Array:
        """The values at step `k`."""
        if len(self._ahead) > 1:
            if k >= len(self._ahead):
                self._ahead = self._forecast = self._weather.series(self._dt, 2 * k + 1)
            self.now = self._ahead[k]
        else:
            self.now = self._ahead[0]
        return self.now
