"""A chart: depths, banks, quays with their fenders and bollards, and fairways, in metres north and east of its datum.

It is drawn in a GeoJSON file (`geojson`), and read by a ship through a grid (`grid`), whose cost does not grow with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.errors import ChartError as ChartError
from .fenders import Fender

Points = NDArray[np.float64]
"""Points north and east of the datum [m], shape (points, 2)."""


@dataclass(frozen=True, eq=False)
class Area:
    """Water of one depth [m] within a polygon; a later area covers those before it."""

    outline: Points
    depth: float


@dataclass(frozen=True, eq=False)
class Bank:
    """The waterline of a bank, the water to starboard of it as it is drawn.

    Attributes:
        line: its points.
        slope: rise over run, at which it falls off; infinite for a wall.
    """

    line: Points
    slope: float = math.inf


@dataclass(frozen=True, eq=False)
class Quay:
    """The face of a quay or of a lock wall, the water to starboard of it as it is drawn.

    Attributes:
        line: its corners.
        fender: what stands along it; None for a bare wall.
        closed: False for a deck on piles, which water passes under: it is no bank.
        bollards: distance of its bollards [m]; 0 for none.
    """

    line: Points
    fender: Fender | None = None
    closed: bool = True
    bollards: float = 0.0

    def posts(self) -> Points:
        """Its bollards."""
        return spaced(self.line, self.bollards)[0] if self.bollards else np.zeros((0, 2))


@dataclass(frozen=True, eq=False)
class Chart:
    """What lies around ships, in metres north and east of the datum.

    Attributes:
        name: its name.
        depth: depth of the water outside all areas [m]; infinite for deep water.
        areas, banks, quays: what is in it.
        fairways: lines in the direction of traffic.
        source: where it is from.
    """

    name: str
    depth: float = math.inf
    areas: tuple[Area, ...] = ()
    banks: tuple[Bank, ...] = ()
    quays: tuple[Quay, ...] = ()
    fairways: tuple[Points, ...] = ()
    source: str = ""

    def __post_init__(self) -> None:
        for depth in (self.depth, *(area.depth for area in self.areas)):
            if not depth > 0.0:
                raise ChartError(f"{self.name}: a depth of {depth:g} m; depths are positive down, in m")
        for k, bank in enumerate(self.banks, 1):
            if not bank.slope > 0.0:
                raise ChartError(
                    f"{self.name}: bank {k} has a slope of {bank.slope:g}; it is rise over run, above zero"
                )
        for what, lines in (("quay", [q.line for q in self.quays]), ("bank", [b.line for b in self.banks])):
            for k, line in enumerate(lines, 1):
                if len(line) < 2 or not (np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-6).all():
                    raise ChartError(f"{self.name}: {what} {k} needs two points or more, no two alike in a row")
                if crossed := crosses(line):
                    a, b = crossed
                    raise ChartError(
                        f"{self.name}: {what} {k} crosses itself, side {a} with side {b}; draw it in one way"
                    )

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Least and greatest north and east of all that is in it [m].

        Raises:
            ChartError: it is empty.
        """
        lines = [*(a.outline for a in self.areas), *(b.line for b in self.banks), *(q.line for q in self.quays),
                 *self.fairways]  # fmt: skip
        if not lines:
            raise ChartError(f"{self.name}: an empty chart; it has no depth area, bank, quay or fairway")
        low, high = (
            np.min([line.min(axis=0) for line in lines], axis=0),
            np.max([one.max(axis=0) for one in lines], axis=0),
        )
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])

    def depth_at(self, north: Points, east: Points) -> Points:
        """Depth of the water [m] at places, banks included; arrays of one shape."""
        found = np.full(np.shape(north), self.depth)
        for area in self.areas:
            found[inside(area.outline, north, east)] = area.depth
        for bank in self.banks:
            off = offshore(bank.line, north, east)
            under = np.full(np.shape(off), np.inf) if math.isinf(bank.slope) else off * bank.slope
            found = np.where(off > 0.0, np.minimum(found, under), 0.0)
        return found


def sides(line: Points) -> tuple[Points, Points, Points]:
    """First points, unit vectors along and lengths of the sides of a line."""
    along = np.diff(line, axis=0)
    length = np.linalg.norm(along, axis=1)
    return line[:-1], along / length[:, None], length


def nearest(line: Points, north: Points, east: Points) -> tuple[Points, Points, Points]:
    """Distance of places from a line [m], and the unit vector towards its nearest point (north, east)."""
    best, toward = np.full(np.shape(north), np.inf), np.zeros((2, *np.shape(north)))
    for (a, b), (t, s), length in zip(*sides(line), strict=True):
        x, y = a - north, b - east
        along = np.clip(-(x * t + y * s), 0.0, length)
        x, y = x + along * t, y + along * s
        off = np.hypot(x, y)
        closer = off < best
        best = np.where(closer, off, best)
        safe = np.where(off > 0.0, off, 1.0)
        toward = np.where(closer, np.stack([x / safe, y / safe]), toward)
    return best, toward[0], toward[1]


def offshore(line: Points, north: Points, east: Points) -> Points:
    """Distance of places from a line [m], above zero where they lie to starboard of it."""
    best, square = np.full(np.shape(north), np.inf), np.zeros(np.shape(north))
    side = np.zeros(np.shape(north))
    for (a, b), (t, s), length in zip(*sides(line), strict=True):
        x, y = north - a, east - b
        across, along = y * t - x * s, np.clip(x * t + y * s, 0.0, length)
        off = np.hypot(x - along * t, y - along * s)
        # at a corner two sides are as near: the one that is seen more squarely has the say
        closer = (off < best - 1e-9) | ((np.abs(off - best) <= 1e-9) & (np.abs(across) > square))
        side, square = np.where(closer, np.sign(across), side), np.where(closer, np.abs(across), square)
        best = np.where(closer, off, best)
    return side * best


def inside(outline: Points, north: Points, east: Points) -> NDArray[np.bool_]:
    """Whether places lie within a polygon, by crossings of a ray."""
    odd = np.zeros(np.shape(north), dtype=bool)
    for (a, b), (c, d) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        spans = (a > north) != (c > north)
        with np.errstate(divide="ignore", invalid="ignore"):
            odd ^= spans & (east < (d - b) * (north - a) / (c - a) + b)
    return odd


def crosses(line: Points) -> tuple[int, int] | None:
    """Two sides of a line that cross, counted from 1; None where none do."""
    start, end = line[:-1], line[1:]

    def turn(p: Points, q: Points, r: Points) -> Points:
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])

    p, q, r, s = start[:, None], end[:, None], start[None], end[None]
    hit = (turn(p, q, r) * turn(p, q, s) < 0.0) & (turn(r, s, p) * turn(r, s, q) < 0.0)
    found = np.argwhere(np.triu(hit, 2))
    return (int(found[0, 0]) + 1, int(found[0, 1]) + 1) if len(found) else None


def spaced(line: Points, spacing: float) -> tuple[Points, Points]:
    """Points along a line about `spacing` apart, each side's own evenly, and the unit vector into the water at each."""
    points, normals = [], []
    for start, along, length in zip(*sides(line), strict=True):
        count = max(round(length / spacing), 1)
        at = (np.arange(count) + 0.5) * length / count
        points.append(start + at[:, None] * along)
        normals.append(np.tile([-along[1], along[0]], (count, 1)))  # to starboard of the line
    return np.concatenate(points), np.concatenate(normals)
