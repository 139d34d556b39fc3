"""The heading autopilot of the bridge: it holds the heading that the page orders until a manual order ends it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ...core.errors import RefusalError
from ..conning import SteeringControl
from ..plant import Plant


class Autopilot:
    """Holds a heading, with the steering control that a ship on the wire has."""

    def __init__(self, plant: Plant) -> None:
        """An autopilot that is off; one that cannot be engaged for a ship without the order `delta`."""
        self._plant = plant
        self._control = SteeringControl.of(plant.ship, plant.ranges["delta"].high) if "delta" in plant.ranges else None

    @property
    def able(self) -> bool:
        """Whether the ship has a rudder to steer by."""
        return self._control is not None

    @property
    def course(self) -> float | None:
        """Heading to steer [rad], 0 to 2 pi; None while it is off."""
        return None if self._control is None else self._control.course

    def engage(self, course: float) -> None:
        """Hold this heading [rad] from now on.

        Raises:
            RefusalError: a ship without a rudder.
        """
        if self._control is None:
            raise RefusalError(f"{self._plant.ship.name} has no rudder to hold a heading with")
        self._control.steer(course % math.tau)

    def disengage(self) -> None:
        """Hold nothing."""
        if self._control is not None:
            self._control.let_go()

    def rudder(self, dt: float) -> float:
        """Rudder for the next `dt` seconds [rad]."""
        return 0.0 if self._control is None else self._control.rudder(self._plant["psi"], self._plant["r"], dt)

    def snapshot(self) -> list[float | None] | None:
        return None if self._control is None else self._control.snapshot()

    def restore(self, saved: Sequence[Any] | None) -> None:
        if self._control is not None and saved is not None:
            self._control.restore(saved)
