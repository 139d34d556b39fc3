"""Progress for those who also want to see the ship as a search has her."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from ..core.parameters import Free
from ..data import Array
from ..ships import Ship
from . import Problem, Progress
from .vector import Vector

MakeShip = Callable[[], Ship]
"""Makes the ship when it is asked; from any thread."""


class Watcher(Protocol):
    """A `Progress` that is also told the best ship so far; both return at once."""

    def __call__(self, iteration: int, objective: float, validation: float) -> None:
        """The search goes on."""
        ...

    def at(self, ship: MakeShip) -> None:
        """Called just before `__call__`."""
        ...


def tell(progress: Progress | None, row: tuple[int, float, float], ship: MakeShip) -> None:
    """Tell `progress`, if any, of (iteration, objective, validation or NaN), and of the ship if it is a `Watcher`."""
    if progress is None:
        return
    at = getattr(progress, "at", None)
    if at is not None:
        at(ship)
    progress(*row)


def stage(progress: Progress | None, text: str) -> None:
    """Say what goes on before there is a row, to the first who has a method `stage`.

    Asked are `progress` and whom it passes its rows on to, its `beside`.
    """
    asked: Any = progress
    while asked is not None:
        hear: Callable[[str], None] | None = getattr(asked, "stage", None)
        if hear is not None:
            hear(text)
            return
        asked = getattr(asked, "beside", None)


def start(progress: Progress | None, ship: Ship) -> None:
    """Show a `Watcher` the ship that a search begins with, where it is long until the first row."""
    at: Callable[[MakeShip], None] | None = getattr(progress, "at", None)
    if at is not None:
        at(lambda: ship)


def with_values(ship: Ship, free: Sequence[Free], values: Array) -> MakeShip:
    """The ship with these values of the free parameters, as they are now; they may move on."""
    kept = np.array(values)
    return lambda: Vector.of(free).ship(ship, kept)


def part(told: Any, name: str, problem: Problem, otherwise: Progress | None) -> Progress | None:
    """Who is told of one fit of several.

    Args:
        told: who is told of all of them; who wants each by itself has a method `part` of name and problem.
        otherwise: who is told where `told` has none.
    """
    make: Callable[[str, Problem], Progress] | None = getattr(told, "part", None)
    return otherwise if make is None else make(name, problem)
