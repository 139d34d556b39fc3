"""The numbers of a ship that nobody measured: assumed in its file, and not fitted."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from ..ships import Ship

_MARK = "assumed"


@dataclass(frozen=True)
class Assumption:
    """One number that is assumed: where, how much in its unit, and why in the words of the ship file."""

    path: str
    value: float
    unit: str
    why: str


def assumptions(ship: Ship, fitted: Collection[str] = ()) -> tuple[Assumption, ...]:
    """What the ship file calls assumed, but for the paths that were `fitted`."""
    return tuple(
        Assumption(path, entry.given, entry.unit, entry.source[len(_MARK) :].lstrip(" :,;"))
        for path, entry in ship.entries.items()
        if entry.source.lower().startswith(_MARK) and path not in fitted
    )
