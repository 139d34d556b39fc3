"""Pictures of an episode: the ship, its track and what the task asks for, north up, the ship in the middle.

Drawn on an array, without a library of figures: some milliseconds a picture.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from .tasks import Scale

Picture = NDArray[np.uint8]
Line = Sequence[tuple[float, float]]
"""Points (x, y), north and east [m]."""

SIZE, _ACROSS, _KEPT = 400, 14.0, 4000
"""Pixels of a side, ship lengths across, and points of the track that are kept."""

_WATER, _ASKED, _TRACK, _SHIP = (231, 240, 246), (217, 95, 2), (150, 165, 175), (0, 107, 164)
_HULL = ((0.5, 0.0), (0.25, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.25, -0.5))
"""Outline: shares of length ahead and of breadth to starboard."""


@runtime_checkable
class Guided(Protocol):
    """A task that can be drawn."""

    def guide(self, scale: Scale, goal: Sequence[float], x: float, y: float) -> Sequence[Line]:
        """Lines of what is asked for, where the ship is at (x, y)."""
        ...


class Canvas:
    """A square of water around a point."""

    def __init__(self, scale: Scale, x: float, y: float) -> None:
        self.pixels: Picture = np.empty((SIZE, SIZE, 3), np.uint8)
        self.pixels[...] = _WATER
        self._scale, self._x, self._y, self._per = scale, x, y, SIZE / (_ACROSS * scale.L)

    def line(self, points: Line, colour: tuple[int, int, int], wide: int = 1) -> None:
        """A line through points; what is outside is cut off."""
        for (x_1, y_1), (x_2, y_2) in pairwise(points):
            count = min(int(2.0 * self._per * math.hypot(x_2 - x_1, y_2 - y_1)) + 2, 8 * SIZE)
            share = np.linspace(0.0, 1.0, count)
            row, column = self._at(x_1 + share * (x_2 - x_1), y_1 + share * (y_2 - y_1))
            for dr in range(wide):
                for dc in range(wide):
                    r, c = row + dr, column + dc
                    inside = (r >= 0) & (r < SIZE) & (c >= 0) & (c < SIZE)
                    self.pixels[r[inside], c[inside]] = colour

    def ship(self, x: float, y: float, psi: float) -> None:
        """The outline of the ship, filled."""
        c, s, L, B = math.cos(psi), math.sin(psi), self._scale.L, self._scale.B
        north, east = self._places()
        ahead, aside = (north - x) * c + (east - y) * s, (east - y) * c - (north - x) * s
        inside = np.ones((SIZE, SIZE), bool)
        corners = [(L * a, B * b) for a, b in _HULL]
        for (a_1, b_1), (a_2, b_2) in zip(corners, (*corners[1:], corners[0]), strict=True):
            inside &= (a_2 - a_1) * (aside - b_1) - (b_2 - b_1) * (ahead - a_1) >= 0.0
        self.pixels[inside] = _SHIP

    def _at(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        half = 0.5 * SIZE
        return (np.floor(half - self._per * (x - self._x)).astype(np.intp),
                np.floor(half + self._per * (y - self._y)).astype(np.intp))  # fmt: skip

    def _places(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """North and east of the middle of every pixel [m]."""
        away: NDArray[np.float64] = (np.arange(SIZE, dtype=np.float64) + (0.5 - 0.5 * SIZE)) / self._per
        return self._x - away[:, None], self._y + away[None, :]


class Painter:
    """Draws one episode after another."""

    def __init__(self, task: object, scale: Scale) -> None:
        self._task, self._scale = task, scale
        self._track: deque[tuple[float, float]] = deque(maxlen=_KEPT)

    def begin(self) -> None:
        """Forget the track."""
        self._track.clear()

    def see(self, x: float, y: float) -> None:
        """Take note of a place."""
        self._track.append((x, y))

    def picture(self, x: float, y: float, psi: float, goal: Sequence[float]) -> Picture:
        """The episode as it is, shape (`SIZE`, `SIZE`, 3)."""
        canvas = Canvas(self._scale, x, y)
        if isinstance(self._task, Guided):
            for line in self._task.guide(self._scale, goal, x, y):
                canvas.line(line, _ASKED, 2)
        canvas.line(tuple(self._track), _TRACK, 2)
        canvas.ship(x, y, psi)
        return canvas.pixels
