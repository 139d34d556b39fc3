"""A chart: depths, banks, quays with their fenders and bollards, and fairways, in metres north and east of its datum.

It is drawn in a GeoJSON file (`geojson`), and read by a ship through a grid (`grid`), whose cost does not grow with it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..core.errors import ChartError as ChartError
from ..core.values import dataclass
from .fenders import Fender

# Rows and columns of a tile of a grid, sides of a block, and of an outline that is filled row by row.
_TILE, _BLOCK, _ROWWISE = 16, 64, 50

Points = NDArray[np.float64]
"""Points north and east of the datum [m], shape (points, 2)."""


# Points of all lines of a chart, and posts along a quay, at most.
_POINTS, _POSTS = 200_000, 2_000


@dataclass(frozen=True, eq=False)
class Area:
    """Water of one depth [m] within a polygon; a later area covers those before it.

    Attributes:
        outline: its border.
        depth: 0 of land, and of what dries.
        holes: borders of what is cut out of it.
    """

    outline: Points
    depth: float
    holes: tuple[Points, ...] = ()

    def holds(self, north: Points, east: Points) -> NDArray[np.bool_]:
        """Whether places lie in it."""
        found = inside(self.outline, north, east)
        for hole in self.holes:
            found &= ~inside(hole, north, east)
        return found


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


@dataclass(frozen=True)
class Spot:
    """A danger, a mark or another thing at one place.

    Attributes:
        x, y: north and east of the datum [m].
        what: its kind.
        depth: of the water above it [m]; NaN where that is no matter.
    """

    x: float
    y: float
    what: str
    depth: float = math.nan


@dataclass(frozen=True, eq=False)
class Lane:
    """Water with a direction of traffic: a lane of a separation scheme, a fairway.

    Attributes:
        outline: its border.
        alpha: direction of traffic [rad]; NaN where it has none.
        what: its kind.
    """

    outline: Points
    alpha: float
    what: str


@dataclass(frozen=True, eq=False)
class Chart:
    """What lies around ships, in metres north and east of the datum.

    Attributes:
        name: its name.
        depth: depth of the water outside all areas [m]; infinite for deep water.
        areas, banks, quays: what is in it.
        fairways: lines in the direction of traffic.
        source: where it is from.
        contours: lines of one depth [m], 0 of a coast.
        dangers: wrecks, rocks and obstructions, with the least depth above them.
        marks: buoys and beacons.
        lanes: water with a direction of traffic.
        lacks: what it does not tell, in sentences.
    """

    name: str
    depth: float = math.inf
    areas: tuple[Area, ...] = ()
    banks: tuple[Bank, ...] = ()
    quays: tuple[Quay, ...] = ()
    fairways: tuple[Points, ...] = ()
    source: str = ""
    contours: tuple[tuple[Points, float], ...] = ()
    dangers: tuple[Spot, ...] = ()
    marks: tuple[Spot, ...] = ()
    lanes: tuple[Lane, ...] = ()
    lacks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for depth in (self.depth, *(area.depth for area in self.areas)):
            if not depth >= 0.0:
                raise ChartError(f"{self.name}: a depth of {depth:g} m; depths are positive down, in m, 0 of land")
        for k, bank in enumerate(self.banks, 1):
            if not bank.slope > 0.0:
                raise ChartError(
                    f"{self.name}: bank {k} has a slope of {bank.slope:g}; it is rise over run, above zero"
                )
        self._hold()
        for what, lines in (("quay", [q.line for q in self.quays]), ("bank", [b.line for b in self.banks])):
            for k, line in enumerate(lines, 1):
                if len(line) < 2 or not (np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-6).all():
                    raise ChartError(f"{self.name}: {what} {k} needs two points or more, no two alike in a row")
                if crossed := crosses(line):
                    a, b = crossed
                    raise ChartError(
                        f"{self.name}: {what} {k} crosses itself, side {a} with side {b}; draw it in one way"
                    )

    def _hold(self) -> None:
        """Refuse more points and posts than a grid can be made of."""
        lines = [*(a.outline for a in self.areas), *(b.line for b in self.banks), *(q.line for q in self.quays),
                 *self.fairways]  # fmt: skip
        if (count := sum(map(len, lines))) > _POINTS:
            raise ChartError(f"{self.name}: {count} points; {_POINTS} are the most: simplify its lines, or cut it")
        for k, quay in enumerate(self.quays, 1):
            far = float(np.linalg.norm(np.diff(quay.line, axis=0), axis=1).sum())
            posts = {"fenders": quay.fender.spacing if quay.fender else 0.0, "bollards": quay.bollards}
            for what, spacing in posts.items():
                if spacing and far / spacing > _POSTS:
                    raise ChartError(f"{self.name}: quay {k} of {far:g} m has {what} {spacing:g} m apart, "
                                     f"{far / spacing:.3g}; {_POSTS} are the most")  # fmt: skip

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
        places = found.reshape(-1)
        x, y = np.ravel(north), np.ravel(east)
        for area in self.areas:
            low, high = area.outline.min(axis=0), area.outline.max(axis=0)
            if np.ndim(north) == 2 and (north == north[:, :1]).all() and (east == east[:1]).all():  # a grid: its part
                rows = np.flatnonzero((north[:, 0] >= low[0]) & (north[:, 0] <= high[0]))
                columns = np.flatnonzero((east[0] >= low[1]) & (east[0] <= high[1]))
                here = np.ix_(rows, columns)
                found[here] = np.where(area.holds(north[here], east[here]), area.depth, found[here])
                continue
            near = np.flatnonzero((x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1]))
            places[near[area.holds(x[near], y[near])]] = area.depth
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
    found = np.zeros((3, np.size(north)))
    for at, some, (x, y) in _tiles(line, north, east):
        (_, along, length), each = some, np.arange(len(at))
        far = np.clip(x * along[:, 0] + y * along[:, 1], 0.0, length)
        x, y = far * along[:, 0] - x, far * along[:, 1] - y
        off = np.hypot(x, y)
        k = off.argmin(axis=1)
        best = off[each, k]
        safe = np.where(best > 0.0, best, 1.0)
        found[:, at] = best, x[each, k] / safe, y[each, k] / safe
    a, b, c = found.reshape(3, *np.shape(north))
    return a, b, c


def offshore(line: Points, north: Points, east: Points) -> Points:
    """Distance of places from a line [m], above zero where they lie to starboard of it."""
    found = np.zeros(np.size(north))
    for at, some, (x, y) in _tiles(line, north, east):
        (_, along, length), each = some, np.arange(len(at))
        across, far = y * along[:, 0] - x * along[:, 1], np.clip(x * along[:, 0] + y * along[:, 1], 0.0, length)
        off = np.hypot(x - far * along[:, 0], y - far * along[:, 1])
        # at a corner two sides are as near: the one that is seen more squarely has the say
        near = off <= off.min(axis=1)[:, None] + 1e-9
        k = np.where(near, np.abs(across), -1.0).argmax(axis=1)
        found[at] = np.sign(across[each, k]) * off[each, k]
    return found.reshape(np.shape(north))


_Tile = tuple[NDArray[np.intp], tuple[Points, Points, Points], tuple[Points, Points]]


def _tiles(line: Points, north: Points, east: Points) -> Iterator[_Tile]:
    """Places a few at a time: which, the sides that may be nearest to one of them, and the places from their starts.

    No place of a tile is farther from its middle than `reach`, so the nearest side of any is within twice that of the
    nearest of the middle.
    """
    start, along, length = sides(line)
    numbers = np.arange(np.size(north)).reshape(np.shape(north))
    if numbers.ndim == 2:
        rows, columns = (range(0, count, _TILE) for count in numbers.shape)
        tiles = [numbers[a : a + _TILE, b : b + _TILE].ravel() for a, b in product(rows, columns)]
    else:
        tiles = [numbers.ravel()[a : a + _TILE**2] for a in range(0, numbers.size, _TILE**2)]
    places = np.column_stack([np.ravel(north), np.ravel(east)])
    for at in tiles:
        middle = places[at].mean(axis=0)
        reach = float(np.linalg.norm(places[at] - middle, axis=1).max())
        off = middle - start
        beside = np.clip((off * along).sum(axis=1), 0.0, length)
        away = np.linalg.norm(off - beside[:, None] * along, axis=1)
        some = away <= away.min() + 2.0 * reach + 1e-6
        x, y = (places[at, k][:, None] - start[some, k] for k in range(2))
        yield at, (start[some], along[some], length[some]), (x, y)


def inside(outline: Points, north: Points, east: Points) -> NDArray[np.bool_]:
    """Whether places lie within a polygon, by crossings of a ray."""
    odd = np.zeros(np.shape(north), dtype=bool)
    ends = np.roll(outline, -1, axis=0)
    if len(outline) > _ROWWISE and north.ndim == 2 and (north == north[:, :1]).all():  # a grid, row by row
        for row, h in enumerate(north[:, 0]):
            spans = (outline[:, 0] > h) != (ends[:, 0] > h)
            (a, b), (c, d) = outline[spans].T, ends[spans].T
            crossings = np.sort((d - b) * (h - a) / (c - a) + b)
            odd[row] = (len(crossings) - np.searchsorted(crossings, east[row], "right")) % 2 == 1
        return odd
    for (a, b), (c, d) in zip(outline, ends, strict=True):
        spans = (a > north) != (c > north)
        with np.errstate(divide="ignore", invalid="ignore"):
            odd ^= spans & (east < (d - b) * (north - a) / (c - a) + b)
    return odd


def crosses(line: Points) -> tuple[int, int] | None:
    """Two sides of a line that cross, counted from 1; None where none do."""
    start, end = line[:-1], line[1:]

    def turn(p: Points, q: Points, r: Points) -> Points:
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])

    low, high = np.minimum(start, end), np.maximum(start, end)
    for first in range(0, len(start), _BLOCK):
        here = slice(first, first + _BLOCK)
        near = (low <= high[here].max(axis=0)).all(axis=1) & (high >= low[here].min(axis=0)).all(axis=1)
        others = first + np.flatnonzero(near[first:])
        p, q, r, s = start[here, None], end[here, None], start[None, others], end[None, others]
        hit = (turn(p, q, r) * turn(p, q, s) < 0.0) & (turn(r, s, p) * turn(r, s, q) < 0.0)
        hit &= others > first + np.arange(len(p))[:, None] + 1
        found = np.argwhere(hit)
        if len(found):
            return first + int(found[0, 0]) + 1, int(others[found[0, 1]]) + 1
    return None


def spaced(line: Points, spacing: float) -> tuple[Points, Points]:
    """Points along a line about `spacing` apart, each side's own evenly, and the unit vector into the water at each."""
    points, normals = [], []
    for start, along, length in zip(*sides(line), strict=True):
        count = max(round(length / spacing), 1)
        at = (np.arange(count) + 0.5) * length / count
        points.append(start + at[:, None] * along)
        normals.append(np.tile([-along[1], along[0]], (count, 1)))  # to starboard of the line
    return np.concatenate(points), np.concatenate(normals)
