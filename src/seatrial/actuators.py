"""Actuators between order and force: limits and rates, as states of the plant.

A ramp at constant rate is integrated exactly, once per step: the value that acts over the step is
its mean, and the state is its end point.  So the right-hand side of the ship stays smooth within
the step, whatever the integrator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from .parameters import Scalar, spec
from .symbolic import clip


@dataclass(frozen=True, kw_only=True)
class Actuator:
    """One actuator with a limit and a rate; the defaults let any order through at once."""

    low: Scalar = spec("", "least value", default=-math.inf)
    high: Scalar = spec("", "greatest value", default=math.inf)
    rate: Scalar = spec("1/s", "greatest rate of change", (0.0, math.inf), default=math.inf)

    def advance(self, actual: Scalar, order: Scalar, dt: Scalar) -> tuple[Scalar, Scalar]:
        """Value that acts over the next `dt` seconds, and the value at their end."""
        target = clip(order, self.low, self.high)
        end = clip(target, actual - self.rate * dt, actual + self.rate * dt)
        return 0.5 * (actual + end), end


@dataclass(frozen=True, kw_only=True)
class Actuators:
    """The actuators of a ship by control name."""

    propeller: Actuator = field(default_factory=Actuator)
    rudder: Actuator = field(default_factory=Actuator)
