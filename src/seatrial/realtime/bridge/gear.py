"""What a ship can be told, as a page needs it: orders with scale, name and place, and what her gear does."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from ..conning import TELEGRAPH
from ..helm import label, obeying, scale, sided
from ..plant import Plant

_APART = 0.02
"""Of the range of an order: how far its parts may be from each other and still be shown as one."""

_POSITIONS = ("Stop", "Dead slow", "Slow", "Half", "Full")


class Values(Protocol):
    """Whatever says a control by its name."""

    def __getitem__(self, name: str, /) -> float:
        """Its value."""
        ...


@dataclass(frozen=True)
class Order:
    """One thing that can be ordered.

    Attributes:
        name: as in `Plant.orders`.
        label: what a mariner calls it.
        kind: where it is on a page: "rudder", "engine", "dial" of an azimuth, or "thruster".
        unit, per: SI unit that it is shown in, and how much of it one of the order is.
        low, high, full: the range of the order (`helm.Range`).
        sided: whether it goes to starboard where it is above zero, and to port below.
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

    def actual(self, values: Values) -> float | None:
        """What the gear does, on the scale of the order; the mean where several controls obey.

        None where these stand apart, as each was ordered by itself: no one figure is then true of them.
        """
        parts = [self._share(control, values[control], factor) for control, factor in self.moves if factor]
        if not parts:
            return 0.0
        if max(parts) - min(parts) > _APART * (self.high - self.low):
            return None
        return sum(parts) / len(parts)

    def _share(self, control: str, value: float, factor: float) -> float:
        """What one control does, on the scale of the order; azimuths that were turned round and round alike."""
        whole = len(self.moves) > 1 and control.startswith("alpha") and math.isfinite(value)
        return (math.remainder(value, 2.0 * math.pi) if whole else value) / factor


def gear(plant: Plant) -> tuple[Order, ...]:
    """What the ship can be told, each order with its scale.

    What moves nothing of her is left out, and so is an order that stands for one other control alone: that control
    has its place.
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
    """Positions of the telegraph as shares of full revolutions, and what they are called, from full ahead down."""
    found: list[tuple[float, str]] = []
    for position, share in TELEGRAPH.items():
        k, astern = int(position[1]), position[0] == "1"
        last, way = ("Crash astern", "astern") if astern else ("Navigation full", "ahead")
        name = _POSITIONS[k] if k < len(_POSITIONS) else last
        found.append((share, f"{name} {way}" if 0 < k < len(_POSITIONS) else name))
    return sorted(found, reverse=True)


def _kind(name: str, shared: str) -> str:
    """The place of an order, by its own name or that of the one it stands for."""
    kind = name.partition("_")[0]
    if kind == "alpha":
        return "dial"
    if shared == "" and kind == "delta":
        return "rudder"
    return "engine" if shared == "" and (name == "n_P" or name.startswith("n_P_")) else "thruster"
