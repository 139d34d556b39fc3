"""Orders that come from outside, and what of a ship they move."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ..manoeuvres.given import Given
from ..models import follows
from ..parameters import Scalar, spec
from ..ships import Ship


class CommandError(ValueError):
    """An order that no ship can take: no such control, or no number."""


@dataclass(frozen=True)
class Helm(Given):
    """A policy whose orders are given step by step, one for each control."""

    n_P: Scalar = spec("1/s", "revolutions at the start", default=0.0)


def obeying(ship: Ship) -> dict[str, tuple[tuple[str, float], ...]]:
    """What each order moves, by the name of the order: controls with their factors.

    A control obeys its own name; n_P and delta, where they are no controls, all that follow them.
    """
    found: dict[str, tuple[tuple[str, float], ...]] = {name: ((name, 1.0),) for name in ship.model.controls}
    pairs = list(zip(ship.model.controls, follows(ship.model), strict=True))
    for order in dict.fromkeys(order for _, (order, _) in pairs):
        if order not in found:
            found[order] = tuple((control, factor) for control, (of, factor) in pairs if of == order)
    return found


def limits(ship: Ship, control: str) -> tuple[float, float]:
    """Least and greatest value that the actuator of a control takes."""
    servo: Any = ship.actuators.of(control)
    return float(getattr(servo, "low", -math.inf)), float(getattr(servo, "high", math.inf))
