"""States and controls that trials tested together: their convex hull in each plane of two channels.

Ranges of each channel by itself call tested what no trial had: the speed of the approach with the rate of turn that a
ship has only where a turn has slowed it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from ..data import Array

# Directions in which a hull reaches farthest: between two of them it is cut by 0.9 % of its half width at most.
_DIRECTIONS = 24


@dataclass(frozen=True)
class Plane:
    """What was tested of two channels together.

    Attributes:
        x, y: the channels.
        corners: of their convex hull, counterclockwise, SI units.
    """

    x: str
    y: str
    corners: tuple[tuple[float, float], ...]

    def excess(self, x: Array, y: Array, slack: tuple[float, float]) -> Array:
        """How far points lie outside of the hull, over the slack; up to 1 they lie within a slack of a tested point.

        Args:
            x, y: the points, shape (points,).
            slack: of x and y, above zero.
        """
        ends = np.array([*self.corners, self.corners[0]])
        over = np.full(len(x), -np.inf)
        for (x_0, y_0), (x_1, y_1) in pairwise(ends.tolist()):
            a, b = y_1 - y_0, x_0 - x_1
            reach = abs(a) * slack[0] + abs(b) * slack[1]
            if reach > 0.0:
                over = np.maximum(over, (a * (x - x_0) + b * (y - y_0)) / reach)
        return over

    def across(self, x: float) -> tuple[float, float]:
        """Lowest and highest tested y at x, or at the tested x that is nearest to it."""
        ends = np.array([*self.corners, self.corners[0]])
        at = min(max(x, float(ends[:, 0].min())), float(ends[:, 0].max()))
        met: list[float] = []
        for (x_0, y_0), (x_1, y_1) in pairwise(ends.tolist()):
            if min(x_0, x_1) <= at <= max(x_0, x_1):
                share = (at - x_0) / (x_1 - x_0) if x_1 != x_0 else 0.0
                met += [y_0 + share * (y_1 - y_0)] + [y_1] * (x_1 == x_0)
        return min(met), max(met)


def planes(channels: Mapping[str, Array], ranges: Mapping[str, tuple[float, float, float]]) -> tuple[Plane, ...]:
    """The hull in each plane of two channels, in their order.

    Args:
        channels: values of each, all of one shape (samples,); NaN where there is none.
        ranges: of each channel, with the slack beyond it; samples outside of both are outliers.
    """
    kept: dict[str, Array] = {}
    for name, values in channels.items():
        if name in ranges:
            low, high, slack = ranges[name]
            near = (values >= low - slack) & (values <= high + slack)
            kept[name] = np.where(near, np.clip(values, low, high), np.nan)
    found = ((x, y, tuple(_corners(kept[x], kept[y]))) for x, y in combinations(kept, 2))
    return tuple(Plane(x, y, corners) for x, y, corners in found if corners)


def _corners(x: Array, y: Array) -> Iterator[tuple[float, float]]:
    """The points that lie farthest in each direction, each once, counterclockwise."""
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    if not x.size:
        return
    along, up = ((one - one.min()) / (float(np.ptp(one)) or 1.0) for one in (x, y))
    angles = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    far = (int(np.argmax(along * np.cos(angle) + up * np.sin(angle))) for angle in angles)
    yield from dict.fromkeys((float(x[k]), float(y[k])) for k in far)
