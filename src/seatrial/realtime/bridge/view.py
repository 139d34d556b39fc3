"""Data for the page: constant data once, the changing picture twenty times a second; SI and radians."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

from ...manoeuvres import Index
from ...models import STATES
from ..loop import Loop
from ..plant import Plant
from .gear import Order

Moment = tuple[float, list[float], float | None]
"""Time, the six states, and the rudder."""

OWN = "own"
"""Name of the steered ship in the loop."""

_AROUND = ("wind_x", "wind_y", "current_x", "current_y")
_TRAIL, _APART = 4000, 1.0 / 40.0
"""Number of points of the trail, and the time between two in times of one ship length."""


def beam(plant: Plant) -> float:
    """Breadth of a ship [m]; a seventh of the length where the file has none."""
    return float(plant.ship.model.breadth or plant.ship.L_pp / 7.0)


def outline(plant: Plant) -> dict[str, Any]:
    """Name and size of a ship [m]."""
    return {"name": plant.ship.name, "L": plant.ship.L_pp, "B": beam(plant)}


def order_json(order: Order) -> dict[str, Any]:
    """An order as the page draws it."""
    shown = ("name", "label", "kind", "unit", "per", "low", "high", "full", "sided")
    return {**{name: getattr(order, name) for name in shown}, "parts": len(order.moves)}


def indices_json(indices: Mapping[str, Index]) -> list[list[Any]]:
    """Indices of a manoeuvre: name, value, unit, value in ship lengths or None."""
    return [[name, _plain(i.value), i.unit, None if i.over_L is None else _plain(i.over_L)]
            for name, i in indices.items()]  # fmt: skip


def motion(loop: Loop, orders: Sequence[Order], before: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """All ships after this tick; a ship that blew up as it was in `before`, the last picture."""
    last: Mapping[str, Any] = before or {"own": [None] * len(STATES), "act": {}, "ord": {}, "others": {}}
    plant = loop.vessels[OWN].plant
    acts = {name: plant[name] for name in plant.controls}
    asked = {name: plant[f"{name}_cmd"] for name in plant.controls}
    return {
        "t": round(loop.t, 6),
        "own": _state(plant) or last["own"],
        "act": _kept({order.name: order.actual(acts) for order in orders}, last["act"]),
        "ord": _kept({order.name: order.actual(asked) for order in orders}, last["ord"]),
        "around": [_plain(plant[name]) for name in _AROUND],
        "others": {name: _state(vessel.plant) or last["others"].get(name, [None] * len(STATES))
                   for name, vessel in loop.vessels.items() if name != OWN},
    }  # fmt: skip


class Trail:
    """Thinned history of the ship, for the track and the strips of a page that is loaded later.

    Attributes:
        names: of the columns.
    """

    def __init__(self, plant: Plant, speed: float) -> None:
        self.names = ("t", *STATES)
        self._plant, self._apart = plant, _APART * plant.ship.L_pp / max(speed, 1e-3)
        self._rows: deque[Moment] = deque(maxlen=_TRAIL)

    def see(self, t: float, rudder: float | None) -> None:
        """Keep the present state if it is far enough from the last one and finite."""
        if not self._rows or t - self._rows[-1][0] >= self._apart:
            state = _state(self._plant)
            if state is not None:
                self._rows.append((round(t, 3), state, None if rudder is None else _plain(rudder)))

    def clear(self) -> None:
        """Clear the history."""
        self._rows.clear()

    def snapshot(self) -> tuple[Moment, ...]:
        """The whole history."""
        return tuple(self._rows)

    def restore(self, saved: Sequence[Moment]) -> None:
        """Restore the result of `snapshot`."""
        self._rows = deque(saved, maxlen=_TRAIL)

    def rows(self) -> list[list[float | None]]:
        """Time, the six states and the rudder, oldest first."""
        return [[t, *state, rudder] for t, state, rudder in tuple(self._rows)]


def _state(plant: Plant) -> list[float] | None:
    """The six states; None for a ship that blew up."""
    found = [_plain(plant[name]) for name in STATES]
    known = [value for value in found if value is not None]
    return known if len(known) == len(found) else None


def _kept(values: Mapping[str, float | None], before: Mapping[str, Any]) -> dict[str, Any]:
    """Values by name; one that is not finite as it was before, None where there is no single value."""
    return {name: value if value is None else _plain(value) if math.isfinite(value) else before.get(name)
            for name, value in values.items()}  # fmt: skip


def _plain(value: float) -> float | None:
    """A number rounded for the page; None if it is not finite, which JSON cannot represent."""
    return float(f"{value:.7g}") if math.isfinite(value) else None
