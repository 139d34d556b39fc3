"""What a ship can be told, as a page needs it: orders with their limits, and what her gear does."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from ...approach import approach
from ...models import unit
from ...ships import Ship, ShipError
from ..helm import limits, obeying

_MOST = 1.25
"""Revolutions at most where the gear has no limit, over those of the approach."""


class Values(Protocol):
    """Whatever says a control by its name."""

    def __getitem__(self, name: str, /) -> float:
        """Its value."""
        ...


@dataclass(frozen=True)
class Order:
    """One thing that can be ordered.

    Attributes:
        name, unit: as in `Plant.orders`, SI.
        low, high: the ends of its scale; those of the gear where that has any.
        full: what counts as full ahead, for a telegraph.
        moves: controls that obey, with their factors.
    """

    name: str
    unit: str
    low: float
    high: float
    full: float
    moves: tuple[tuple[str, float], ...]

    def actual(self, values: Values) -> float:
        """What the gear does, on the scale of the order; the mean where several controls obey."""
        parts = [values[control] / factor for control, factor in self.moves if factor]
        return sum(parts) / len(parts) if parts else 0.0


def gear(ship: Ship) -> tuple[Order, ...]:
    """What the ship can be told, each with its scale."""
    try:
        turns = abs(approach(ship)[1])
    except ShipError:
        turns = 0.0
    found: list[Order] = []
    for name, moves in obeying(ship).items():
        ends = [sorted(end / factor for end in limits(ship, control)) for control, factor in moves if factor]
        low, high = max((a for a, _ in ends), default=0.0), min((b for _, b in ends), default=0.0)
        most = _reach(ship, name, turns)
        low, high = (low if math.isfinite(low) else -most), (high if math.isfinite(high) else most)
        if low < high:
            full = min(turns, high) if name.startswith("n") and turns and name.startswith("n_P") else high
            found.append(Order(name, unit(name), low, high, full, moves))
    return tuple(found)


def _reach(ship: Ship, name: str, turns: float) -> float:
    """The end of a scale where the gear has none: assumed."""
    kind = name.partition("_")[0]
    if kind == "alpha":
        return math.pi
    if kind == "delta":
        return math.radians(35.0)
    return _MOST * (turns or 1.0)
