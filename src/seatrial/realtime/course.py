"""An autopilot of a ship that nobody steers: it holds the course that the ship was on at the start."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from .loop import Loop
from .steering import SteeringControl


class CourseKeeper:
    """The steering control of one ship of a loop, asked after each tick; saved, restored and reset with it.

    It follows the line through the start in the direction of the heading there, so that a current or a hull that is
    not alike on both sides does not set it off its course.
    """

    def __init__(self, loop: Loop, name: str) -> None:
        """Hold the present course of the ship `name`, by the order `delta` which it must have, from now on."""
        self._name, self._vessel = name, loop.vessels[name]
        plant = self._vessel.plant
        self._x, self._y, self._course = plant["x"], plant["y"], plant["psi"]
        self._control = SteeringControl.of(plant.ship, plant.ranges["delta"].high)
        loop.after(self.tick)
        loop.keep(f"the autopilot of {name}", self)

    def tick(self, loop: Loop) -> None:
        """Order the rudder for the next tick."""
        plant = self._vessel.plant
        if self._vessel.failure is None:
            north, east = plant["x"] - self._x, plant["y"] - self._y
            across = east * math.cos(self._course) - north * math.sin(self._course)
            self._control.steer(self._course, across=across)
            loop.order(self._name, "delta", self._control.rudder(plant["psi"], plant["r"], 1.0 / loop.rate))

    def snapshot(self) -> list[float | None]:
        """What it steers, for JSON."""
        return self._control.snapshot()

    def restore(self, saved: Sequence[Any]) -> None:
        """Go on from what `snapshot` gave."""
        self._control.restore(saved)

    def reset(self) -> None:
        """Back to the start."""
        self._control.let_go()
