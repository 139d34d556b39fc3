"""What the page is told: once what stays, and twenty times a second what changes; SI and radians."""

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

OWN = "own"
"""The name of the ship that is steered, in the loop."""

_AROUND = ("wind_x", "wind_y", "current_x", "current_y")
_TRAIL, _APART = 4000, 1.0 / 40.0
"""Points of the history that are kept, and how far apart they are in time of a ship length."""


def beam(plant: Plant) -> float:
    """Breadth of a ship [m]; a seventh of the length where her file has none."""
    body = getattr(plant.ship.model, "body", plant.ship.model)
    return float(getattr(body, "B", 0.0) or plant.ship.L_pp / 7.0)


def outline(plant: Plant) -> dict[str, Any]:
    """Name and size of a ship [m]."""
    return {"name": plant.ship.name, "L": plant.ship.L_pp, "B": beam(plant)}


def order_json(order: Order) -> dict[str, Any]:
    """An order as the page draws it."""
    return {"name": order.name, "unit": order.unit, "low": order.low, "high": order.high, "full": order.full}


def indices_json(indices: Mapping[str, Index]) -> list[list[Any]]:
    """Figures of a manoeuvre: name, value, unit, in ship lengths or nothing."""
    return [[name, _plain(i.value), i.unit, None if i.over_L is None else _plain(i.over_L)]
            for name, i in indices.items()]  # fmt: skip


def motion(loop: Loop, orders: Sequence[Order]) -> dict[str, Any]:
    """All ships as they are after this tick."""
    plant = loop.vessels[OWN].plant
    acts = {name: plant[name] for name in plant.controls}
    asked = {name: plant[f"{name}_cmd"] for name in plant.controls}
    return {
        "t": round(loop.t, 6),
        "own": _state(plant),
        "act": {order.name: _plain(order.actual(acts)) for order in orders},
        "ord": {order.name: _plain(order.actual(asked)) for order in orders},
        "around": [_plain(plant[name]) for name in _AROUND],
        "others": {name: _state(vessel.plant) for name, vessel in loop.vessels.items() if name != OWN},
    }


class Trail:
    """Where the ship has been, thinned out: for the track and the strips of a page that is loaded later.

    Attributes:
        names: of the columns.
    """

    def __init__(self, plant: Plant, speed: float) -> None:
        self.names = ("t", *STATES)
        self._plant, self._apart = plant, _APART * plant.ship.L_pp / max(speed, 1e-3)
        self._rows: deque[tuple[float, list[float], float]] = deque(maxlen=_TRAIL)

    def see(self, t: float, rudder: float) -> None:
        """Keep this moment, where it is far enough from the last."""
        if not self._rows or t - self._rows[-1][0] >= self._apart:
            self._rows.append((round(t, 3), _state(self._plant), _plain(rudder)))

    def clear(self) -> None:
        """Forget it all."""
        self._rows.clear()

    def rows(self) -> list[list[float]]:
        """Time, the six states and the rudder, the oldest first."""
        return [[t, *state, rudder] for t, state, rudder in tuple(self._rows)]


def _state(plant: Plant) -> list[float]:
    return [_plain(plant[name]) for name in STATES]


def _plain(value: float) -> float:
    """A number that JSON can hold, to what a page can show."""
    return float(f"{value:.7g}") if math.isfinite(value) else 0.0
