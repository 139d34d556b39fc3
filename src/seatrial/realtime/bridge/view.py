"""Data for the page: orders of a ship with scale and name once, the picture twenty times a second; SI and radians."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

from ...core.values import dataclass
from ...manoeuvres import Index
from ...models import STATES
from ...sensors import Truth
from ..conning import TELEGRAPH
from ..helm import label, obeying, scale, sided
from ..loop import Loop
from ..plant import Plant

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
    return {**{name: value for name, value in vars(order).items() if name != "moves"}, "parts": len(order.moves)}


def indices_json(indices: Mapping[str, Index]) -> list[list[Any]]:
    """Indices of a manoeuvre: name, value, unit, value in ship lengths or None."""
    return [[name, plain(i.value), i.unit, None if i.over_L is None else plain(i.over_L)]
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
        "around": [plain(plant[name]) for name in _AROUND],
        "others": {name: _state(vessel.plant) or last["others"].get(name, [None] * len(STATES))
                   for name, vessel in loop.vessels.items() if name != OWN},
    }  # fmt: skip


class Trail:
    """Thinned history of the ship, for the track and the strips of a page that is loaded later."""

    def __init__(self, plant: Plant, speed: float) -> None:
        self._plant, self._apart = plant, _APART * plant.ship.L_pp / max(speed, 1e-3)
        self._rows: deque[Moment] = deque(maxlen=_TRAIL)

    def see(self, t: float, rudder: float | None) -> None:
        """Keep the present state if it is far enough from the last one and finite."""
        if not self._rows or t - self._rows[-1][0] >= self._apart:
            state = _state(self._plant)
            if state is not None:
                self._rows.append((round(t, 3), state, None if rudder is None else plain(rudder)))

    def clear(self) -> None:
        """Forget all."""
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
    found = [plain(plant[name]) for name in STATES]
    known = [value for value in found if value is not None]
    return known if len(known) == len(found) else None


def _kept(values: Mapping[str, float | None], before: Mapping[str, Any]) -> dict[str, Any]:
    """Values by name; one that is not finite as it was before, None where there is no single value."""
    return {name: value if value is None else plain(value) if math.isfinite(value) else before.get(name)
            for name, value in values.items()}  # fmt: skip


def plain(value: float) -> float | None:
    """A number rounded for the page; None if it is not finite, which JSON cannot represent."""
    return float(f"{value:.7g}") if math.isfinite(value) else None


_DIFFERENT = 0.02
"""Largest difference between the parts of an order that are shown as one value, relative to its range."""

_POSITIONS = ("Stop", "Dead slow", "Slow", "Half", "Full")


@dataclass(frozen=True)
class Order:
    """One order on the page.

    Attributes:
        name: as in `Plant.orders`.
        label: name in mariners' terms.
        kind: place on the page: "rudder", "engine", "dial" of an azimuth, or "thruster".
        unit, per: SI unit in which it is shown, and the factor from the order to it.
        low, high, full: range of the order (`helm.Range`).
        sided: whether positive orders act to starboard and negative ones to port.
        moves: controls that obey, with their factors.
    """

    name: str
    label: str
    kind: str
    unit: str
    per: float
    low: float
    high: float
    full: float
    sided: bool
    moves: tuple[tuple[str, float], ...]

    def actual(self, values: Truth) -> float | None:
        """Actual value on the scale of the order; the mean where several controls obey.

        None where these differ, since each was ordered separately: then no single value is true of all.  Azimuths of a
        shared order are wrapped to half a turn.
        """
        found = {control: values[control] for control, factor in self.moves if factor}
        if len(self.moves) > 1:
            found |= {control: math.remainder(value, math.tau) for control, value in found.items()
                      if control.startswith("alpha") and math.isfinite(value)}  # fmt: skip
        parts = [found[control] / factor for control, factor in self.moves if factor]
        if parts and max(parts) - min(parts) > _DIFFERENT * (self.high - self.low):
            return None
        return sum(parts) / len(parts) if parts else 0.0


def gear(plant: Plant) -> tuple[Order, ...]:
    """Orders of the ship, each with its scale.

    Orders without effect are left out, and so is an order that only one control of another name follows: that control
    takes its place.
    """
    known = {name: moves for name, moves in obeying(plant.ship).items() if name in plant.ranges}
    stand_in = {moves[0][0]: name for name, moves in known.items() if len(moves) == 1 and name not in plant.controls}
    shared = {control: name for name, moves in known.items() if len(moves) > 1 for control, _ in moves}
    found: list[Order] = []
    for name, moves in known.items():
        if name in stand_in.values():
            continue
        reach, (shown, per) = plant.ranges[name], scale(name, moves)
        kind = _kind(stand_in.get(name, name), shared.get(name, ""))
        found.append(Order(
            name, label(name, moves, plant.controls), kind, shown, per, reach.low, reach.high, reach.full,
            sided(name, plant.ship), moves,
        ))  # fmt: skip
    return tuple(found)


def bells() -> list[tuple[float, str]]:
    """Positions of the telegraph as shares of full revolutions with their names, from full ahead down."""
    found: list[tuple[float, str]] = []
    for position, share in TELEGRAPH.items():
        k, astern = int(position[1]), position[0] == "1"
        last, way = ("Crash astern", "astern") if astern else ("Navigation full", "ahead")
        name = _POSITIONS[k] if k < len(_POSITIONS) else last
        found.append((share, f"{name} {way}" if 0 < k < len(_POSITIONS) else name))
    return sorted(found, reverse=True)


def _kind(name: str, shared: str) -> str:
    """Place of an order on the page, by its name or that of the order it replaces."""
    kind = name.partition("_")[0]
    if kind == "alpha":
        return "dial"
    if shared == "" and kind == "delta":
        return "rudder"
    return "engine" if shared == "" and (name == "n_P" or name.startswith("n_P_")) else "thruster"
