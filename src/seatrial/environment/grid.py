"""A chart as a ship reads it: a regular grid of depth, suction of the banks and way to the quay, and what it may touch.

Suction depends on the length of the ship and is tabulated for it: at each node the sum over the banks and closed quays
of the unit vector towards the nearest point of each times the suction of a wall there (`suction`), so any number of
them costs as much as one.  Fenders, walls and corners that the ship may reach from within a cell are its row of
numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.values import dataclass
from ..engine.field import Field
from .chart import Bank, Chart, ChartError, Points, nearest, sides, spaced
from .fenders import CURVES, Curve

SMOOTH = ("chart.per_depth", "chart.bank_x", "chart.bank_y", "chart.quay", "chart.quay_x", "chart.quay_y")
"""What is interpolated: one over depth, suction, distance of the quay [m] and the unit vector towards it."""

# Distance of a quay where there is none [m], least depth that is kept [m], nodes of a grid at most and as a rule.
_NONE, _DRY, _NODES, _USUAL = 1e6, 0.1, 4_000_000, 1_000_000
# Stops, and walls, that a cell holds at most: each is a term of the force in every step.
_CROWD = 100


class Stop(NamedTuple):
    """A fender, or the corner of a wall: a point that pushes where the hull comes within its height."""

    north: float
    east: float
    height: float
    reaction: float
    mu: float
    chi: float


class Wall(NamedTuple):
    """One side of a bare wall, the water to starboard of its direction."""

    north: float
    east: float
    along_x: float
    along_y: float
    length: float


@dataclass(frozen=True)
class Size:
    """The size of a ship as a chart needs it.

    Attributes:
        L, B, d: length, breadth and draught [m].
    """

    L: float
    B: float
    d: float


@dataclass(frozen=True, eq=False)
class Grid:
    """A chart for one ship.

    Attributes:
        field: its tables for the engine, the `stops` and `walls` of a cell behind what is interpolated.
        stops, walls: how many of each a cell holds at most.
        curve: the curve of its fenders.
        stiffness: of all fenders that a ship touches at once, at first [N/m].
        bare: whether a quay has no fenders.
    """

    field: Field
    stops: int
    walls: int
    curve: Curve
    stiffness: float
    bare: bool


def grid_of(chart: Chart, ship: Size, cell: float | None = None, *, hard: float = 1e8) -> Grid:
    """Tabulate a chart for a ship.

    Args:
        chart: the chart.
        ship: the size of the ship.
        cell: distance of the nodes [m]; by default a quarter of the breadth, more where the chart is wide.
        hard: stiffness of bare walls and their corners [N/m].

    Raises:
        ChartError: fenders of different curves; an empty chart; a grid too large.
    """
    margin = ship.L
    low_n, high_n, low_e, high_e = chart.extent
    spans = high_n - low_n + 2.0 * margin, high_e - low_e + 2.0 * margin
    size = _cell_of(chart, ship, spans) if cell is None else cell
    rows, columns = (math.ceil(span / size) + 1 if size > 0.0 else _NODES for span in spans)
    if rows * columns > _NODES:
        raise ChartError(
            f"{chart.name}: {spans[0]:.0f} by {spans[1]:.0f} m with nodes {size:g} m apart, {rows * columns / 1e6:.3g} "
            f"million of them; {_NODES // 1_000_000} million are the most: a larger cell, or a part of the chart"
        )
    north = low_n - margin + size * np.arange(rows, dtype=np.float64)
    east = low_e - margin + size * np.arange(columns, dtype=np.float64)
    N, E = (np.asarray(one, dtype=np.float64) for one in np.meshgrid(north, east, indexing="ij"))
    curve = _curve(chart)
    stops, walls = _stops(chart, curve, hard), _walls(chart)
    # a hull reaches half its diagonal beyond midship, a fender its height towards it; a cell half its own diagonal
    reach = 0.5 * math.hypot(ship.L, ship.B) + 0.75 * size
    near = _Near(rows, columns, north[0], east[0], size)
    try:
        for stop in stops:
            near.point(stop, reach + stop.height)
        for wall in walls:
            near.side(wall, reach)
    except ChartError as error:
        raise ChartError(f"{chart.name}: {error}") from None
    names, which, sets, (most_stops, most_walls) = near.tables()
    field = Field(SMOOTH, names, float(north[0]), float(east[0]), size, _smooth(chart, ship, N, E), which, sets)
    bare = any(quay.fender is None for quay in chart.quays)
    return Grid(field, most_stops, most_walls, curve, _stiffness(chart, ship.L), bare)


def _cell_of(chart: Chart, ship: Size, spans: tuple[float, float]) -> float:
    """Distance of the nodes [m]: finer than what the hull averages over, and coarser where the chart is wide."""
    size = max(0.25 * ship.B, 0.02 * ship.L)
    # quays and banks act over a breadth or two, depth over a length
    most = ship.B if chart.quays or chart.banks else ship.L
    return max(size, min(most, math.sqrt(spans[0] * spans[1] / _USUAL)))


def _smooth(chart: Chart, ship: Size, N: Points, E: Points) -> Points:
    depth = np.maximum(chart.depth_at(N, E), _DRY)
    bank = np.zeros((2, *N.shape))
    full = max((h for h in (chart.depth, *(a.depth for a in chart.areas)) if math.isfinite(h)), default=0.0)
    for line, run in _banks(chart):
        off, x, y = nearest(line, N, E)
        # a sloped bank acts like a wall through the middle of its slope; nearer than B + d the form does not hold
        wall = np.maximum(off - 0.5 * run * full, 0.5 * (ship.B + ship.d))
        bank += np.stack([x, y]) * suction(wall, np.maximum(depth, 1.02 * ship.d), ship.L)
    away, quay = np.full(N.shape, _NONE), np.zeros((2, *N.shape))
    for one in chart.quays:
        off, x, y = nearest(one.line, N, E)
        quay = np.where(off < away, np.stack([x, y]), quay)
        away = np.minimum(away, np.maximum(off, 0.5 * ship.B))
    return np.stack([1.0 / depth, *bank, away, *quay], axis=-1)


def _banks(chart: Chart) -> Iterator[tuple[Points, float]]:
    """Lines that draw a ship, with run over rise."""
    for thing in (*chart.banks, *chart.quays):
        if isinstance(thing, Bank):
            yield thing.line, 1.0 / thing.slope
        elif thing.closed:
            yield thing.line, 0.0


def _curve(chart: Chart) -> Curve:
    curves = {quay.fender.curve for quay in chart.quays if quay.fender}
    if len(curves) > 1:
        raise ChartError(f"{chart.name}: fenders of {len(curves)} curves; a chart has fenders of one curve")
    return next(iter(curves), CURVES["linear"])


def _stops(chart: Chart, curve: Curve, hard: float) -> list[Stop]:
    found: list[Stop] = []
    for quay in chart.quays:
        if quay.fender is not None:
            f = quay.fender
            points, _ = spaced(quay.line, f.spacing)
            found += [Stop(float(a), float(b), f.height, f.reaction, f.mu, f.chi) for a, b in points]
        else:
            found += [_corner(point, curve, hard) for point in quay.line]
    return found


def _stiffness(chart: Chart, L: float) -> float:
    """Of the fenders that the longest part of a ship of length L touches at once."""
    found = [f.reaction / f.height * f.curve.reactions[1] / f.curve.deflections[1] * max(L / f.spacing, 1.0)
             for quay in chart.quays if (f := quay.fender) is not None]  # fmt: skip
    return max(found, default=0.0)


def _corner(point: Points, curve: Curve, hard: float) -> Stop:
    """The corner of a bare wall: a stop of half a metre whose first stiffness is that of the wall."""
    height = 0.5
    slope = curve.reactions[1] / curve.deflections[1]
    return Stop(float(point[0]), float(point[1]), height, hard * height / slope, 0.3, 0.0)


def _walls(chart: Chart) -> list[Wall]:
    """Every side of every quay: behind fenders too the wall stands."""
    return [
        Wall(float(p[0]), float(p[1]), float(t[0]), float(t[1]), float(length))
        for quay in chart.quays for p, t, length in zip(*sides(quay.line), strict=True)
    ]  # fmt: skip


class _Near:
    """Which stops and walls each cell of a grid holds."""

    def __init__(self, rows: int, columns: int, north: float, east: float, size: float) -> None:
        self.stops, self.sides = list[Stop](), list[Wall]()
        self.shape = rows - 1, columns - 1
        self.north, self.east = (
            low + size * (np.arange(count) + 0.5) for low, count in zip((north, east), self.shape, strict=True)
        )
        self.held: dict[int, tuple[list[int], list[int]]] = {}

    def point(self, stop: Stop, reach: float) -> None:
        self._add(0, len(self.stops), np.array([stop[:2]]), reach)
        self.stops.append(stop)

    def side(self, wall: Wall, reach: float) -> None:
        end = (wall.north + wall.length * wall.along_x, wall.east + wall.length * wall.along_y)
        self._add(1, len(self.sides), np.array([wall[:2], end]), reach)
        self.sides.append(wall)

    def _add(self, kind: int, number: int, ends: Points, reach: float) -> None:
        """Note a thing in the cells whose middles lie within its reach."""
        low, high = ends.min(axis=0) - reach, ends.max(axis=0) + reach
        rows, columns = (np.flatnonzero((one >= a) & (one <= b))
                         for one, a, b in zip((self.north, self.east), low, high, strict=True))  # fmt: skip
        N, E = (np.asarray(one, dtype=np.float64)
                for one in np.meshgrid(self.north[rows], self.east[columns], indexing="ij"))  # fmt: skip
        away = nearest(ends, N, E)[0] if kind else np.hypot(N - ends[0, 0], E - ends[0, 1])
        at = np.argwhere(away <= reach)
        for cell in (rows[at[:, 0]] * self.shape[1] + columns[at[:, 1]]).tolist():
            held = self.held.setdefault(cell, ([], []))[kind]
            held.append(number)
            if len(held) > _CROWD:
                what = ("fenders or corners", "sides of quays")[kind]
                raise ChartError(
                    f"over {_CROWD} {what} within reach of a ship {self.north[cell // self.shape[1]]:.0f} m north and "
                    f"{self.east[cell % self.shape[1]]:.0f} m east; put fenders farther apart, or draw fewer corners"
                )

    def tables(self) -> tuple[tuple[str, ...], NDArray[np.int64], Points, tuple[int, int]]:
        """Names, the set of each cell, the sets, and how many stops and walls one holds."""
        numbers: dict[tuple[tuple[int, ...], tuple[int, ...]], int] = {}
        index = np.zeros(self.shape[0] * self.shape[1], dtype=np.int64)
        for cell, (stops, walls) in self.held.items():
            index[cell] = numbers.setdefault((tuple(stops), tuple(walls)), len(numbers) + 1)
        K, W = (max((len(one[kind]) for one in numbers), default=0) for kind in (0, 1))
        names = (*(f"stop_{k}.{f}" for k in range(K) for f in Stop._fields),
                 *(f"wall_{k}.{f}" for k in range(W) for f in Wall._fields))  # fmt: skip
        sets = np.zeros((len(numbers) + 1, len(names)))
        begin = K * len(Stop._fields)
        for (stops, walls), at in numbers.items():
            some = [value for k in stops for value in self.stops[k]]
            sets[at, : len(some)] = some
            others = [value for k in walls for value in self.sides[k]]
            sets[at, begin : begin + len(others)] = others
        return names, index.reshape(self.shape), sets, (K, W)


Array = NDArray[np.float64]

# Beyond so many lengths the closed form is all rounding; there its first term of the series.
_FAR = 20.0


def between(b: Array) -> Array:
    """J(b): the double integral of two straight slopes at distance b in lengths."""
    near = np.minimum(b, _FAR)
    R = np.sqrt(1.0 + near * near)
    closed = (1.0 / (near * near * R) - 3.0 * (1.0 / near - 1.0 / R) + 2.0 * (R + near * near / R - 2.0 * near)) / 6.0
    return np.where(b > _FAR, b**-5.0 / 48.0, closed)


def suction(d: Array, h: Array, L: float, images: int = 10) -> Array:
    """Phi at distances d [m] of a wall from the centreline in water of depth h [m] (infinite where deep).

    Suction of a vertical wall on a ship that passes it, as if its mirror image passed on the other side: double body in
    potential flow, slender, rigid free surface; sections of a parabola of area A (1 - 4 x^2/L^2).  The side force
    towards a wall at d from the centreline is rho U^2 (A/L)^2 phi(d/L, h/L), with

        phi = 64/pi (d/L) sum_k J(2 sqrt(d^2 + k^2 h^2)/L), J(b) = 1/6 int_0^1 (1 - 3t + 2t^3) (t^2 + b^2)^(-3/2) dt,

    k over the images in bottom and surface.  It has no yaw moment in a straight run, and the bottom, viscosity and the
    waves of the ship are not in it: near the bottom it is low (docs/harbour.md).
    """
    total = between(2.0 * d / L)
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(1, images + 1):
            total = total + 2.0 * np.where(np.isfinite(h), between(2.0 * np.sqrt(d * d + (k * h) ** 2) / L), 0.0)
    return 64.0 / math.pi * d / L * total
