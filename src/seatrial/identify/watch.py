"""Progress of a fit for a live page: rows, the best ship so far, and stages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..core.parameters import Free
from ..data import Array
from ..ships import Ship
from . import Problem, Progress
from .vector import Vector

MakeShip = Callable[[], Ship]
"""Makes the ship on request, from any thread."""


@runtime_checkable
class Watcher(Protocol):
    """A `Progress` that also receives the best ship so far; both methods return at once."""

    def __call__(self, iteration: int, objective: float, validation: float) -> None:
        """Take the row of one iteration."""
        ...

    def at(self, ship: MakeShip) -> None:
        """Take the best ship; called just before the row of an iteration."""
        ...


@runtime_checkable
class Staged(Protocol):
    """A `Progress` that also reports what a fit does before its first row."""

    def stage(self, text: str) -> None:
        """Take the text."""
        ...


@runtime_checkable
class Relaying(Protocol):
    """A `Progress` that passes its rows on to another one, its `beside`."""

    beside: Progress | None


@runtime_checkable
class Parted(Protocol):
    """A `Progress` that makes receivers for the fits of a run with several."""

    def part(self, name: str, problem: Problem) -> Progress:
        """The receiver of one of them."""
        ...


def tell(progress: Progress | None, row: tuple[int, float, float], ship: MakeShip) -> None:
    """Report (iteration, objective, validation or NaN) to `progress`, if any, and the ship to a `Watcher`."""
    if isinstance(progress, Watcher):
        progress.at(ship)
    if progress is not None:
        progress(*row)


def stage(progress: Progress | None, text: str) -> None:
    """Report what a fit does before its first row, to the first object that has a method `stage`.

    Searched are `progress` and the object that it passes its rows on to, its `beside`.
    """
    asked: object = progress
    while isinstance(asked, Relaying) and not isinstance(asked, Staged):
        asked = asked.beside
    if isinstance(asked, Staged):
        asked.stage(text)


def start(progress: Progress | None, ship: Ship) -> None:
    """Show a `Watcher` the ship at the start of a search whose first row takes long."""
    if isinstance(progress, Watcher):
        progress.at(lambda: ship)


def with_values(ship: Ship, free: Sequence[Free], values: Array) -> MakeShip:
    """Makes the ship with a copy of these values of the free parameters."""
    kept = np.array(values)
    return lambda: Vector.of(free).ship(ship, kept)


def part(told: Any, name: str, problem: Problem, otherwise: Progress | None) -> Progress | None:
    """The receiver of the progress of one fit of several.

    Args:
        told: receiver of all of them; one with a method `part` makes a receiver from the name and problem of each.
        otherwise: the receiver if `told` has no such method.
    """
    return told.part(name, problem) if isinstance(told, Parted) else otherwise
