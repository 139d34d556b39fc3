"""The weather of a scenario, set tick by tick: changes in steps or ramps, and gusts on the mean wind of the moment.

All ships have the same weather, evaluated once a tick; nothing is computed ahead, so that no tick takes longer than
another.  Where the weather changes, a recording has it in its journal of surroundings and can be run again without the
scenario.
"""

from __future__ import annotations

import math
from bisect import bisect_right

import numpy as np

from ...environment import Environment, Uniform
from ...environment.weather import Gust
from ..loop import Loop
from .scenario import Scenario

Key = tuple[float, Environment]


def keys(scenario: Scenario) -> tuple[Key, ...]:
    """Weather by time, linear between two of them; of two of one time the later counts from then on."""
    found: list[Key] = [(0.0, scenario.first)]
    for change in scenario.weather:
        found += [(change.at, found[-1][1]), (change.at + change.over, change.around)]
    return tuple(found)


class Sky:
    """The weather at all ships of a loop.

    Attributes:
        held: whether somebody at the page has set other weather, which stays.
    """

    def __init__(self, loop: Loop, scenario: Scenario) -> None:
        """Set the weather from the next tick on."""
        self._keys = keys(scenario)
        self._times = [t for t, _ in self._keys]
        self._gust = None if scenario.gusts is None else Gust(Uniform(), scenario.gusts, scenario.seed)
        self.held = False
        self._last: Environment | None = None
        self.tick(loop)
        loop.after(self.tick)
        loop.keep("the weather", self)

    def at(self, t: float) -> Environment:
        """The weather at a time [s], gusts included."""
        k = bisect_right(self._times, t) - 1
        (t_0, before), (t_1, after) = self._keys[k], self._keys[min(k + 1, len(self._keys) - 1)]
        share = (t - t_0) / (t_1 - t_0) if t_1 > t_0 else 0.0
        mean = Environment(*(a + share * (b - a) for a, b in zip(before, after, strict=True))) if share else before
        U = math.hypot(mean.wind_x, mean.wind_y)
        if self._gust is None or U <= 0.0:
            return mean
        along, across = (float(part[0]) for part in self._gust.gusts(np.array([t]), U))
        north, east = mean.wind_x / U, mean.wind_y / U
        return mean._replace(wind_x=mean.wind_x + along * north - across * east,
                             wind_y=mean.wind_y + along * east + across * north)  # fmt: skip

    def tick(self, loop: Loop) -> None:
        """Set the weather of the next tick, if it differs from the last."""
        if self.held:
            return
        now = self.at(loop.t)
        if now != self._last:
            self._last = now
            for name in loop.vessels:
                loop.surround(name, now)

    def hold(self) -> None:
        """Leave the weather to somebody else from now on."""
        self.held = True

    def snapshot(self) -> bool:
        return self.held

    def restore(self, saved: bool) -> None:
        self.held, self._last = saved, None

    def reset(self) -> None:
        self.held, self._last = False, None
