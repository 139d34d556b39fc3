"""Controls of the page: each order of a ship with its scale, name and place, and the actual value of its gear."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from ..conning import TELEGRAPH
from ..helm import label, obeying, scale, sided
from ..plant import Plant

_APART = 0.02
"""Largest difference between the parts of an order that are shown as one value, relative to its range."""

_POSITIONS = ("Stop", "Dead slow", "Slow", "Half", "Full")


class Values(Protocol):
    """A source of values by the name of the control."""

    def __getitem__(self, name: str, /) -> float:
        """Its value."""
        ...


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

    def actual(self, values: Values) -> float | None:
        """Actual value on the scale of the order; the mean where several controls obey.

        None where these differ, since each was ordered separately: then no single value is true of all.
        """
        parts = [self._share(control, values[control], factor) for control, factor in self.moves if factor]
        if not parts:
            return 0.0
        if max(parts) - min(parts) > _APART * (self.high - self.low):
            return None
        return sum(parts) / len(parts)

    def _share(self, control: str, value: float, factor: float) -> float:
        """Actual value of one control on the scale of the order; shared azimuths are wrapped to half a turn."""
        whole = len(self.moves) > 1 and control.startswith("alpha") and math.isfinite(value)
        return (math.remainder(value, 2.0 * math.pi) if whole else value) / factor


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
