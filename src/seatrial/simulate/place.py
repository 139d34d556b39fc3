"""Where a ship sails: a chart, another ship on a straight course, mooring lines; what the closed loop needs of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..core.parameters import Scalar
from ..core.symbolic import larger, root
from ..core.values import dataclass
from ..data import Array
from ..engine import Kicks, Scalars
from ..environment import CHANNELS, PLACE, Charted
from ..environment.chart import Chart, crosses, sides
from ..environment.grid import SMOOTH, Grid, Size, grid_of
from ..forces import Force
from ..harbour.contact import Contact, Line, Push, distance, outline
from ..models import Sampled
from ..models.common import Composed, Surroundings
from ..ships import Ship, ShipError

# Frequency of a contact times a step: below it the energy left over at the turning point is below 1e-9.
_FINE = 0.04
# Ship and bare wall give by a metre where they meet at 1 m/s [rad/s].
_HARD = 1.0


@dataclass(frozen=True)
class Other:
    """Another ship on a straight course, at midship (x, y) [m] at first, heading psi [rad] at U [m/s].

    Attributes:
        L, A_M: its length [m] and midship section under water [m^2].
    """

    x: float
    y: float
    psi: float
    U: float
    L: float
    A_M: float

    def at(self, t: Scalar, state: Scalars) -> Scalars:
        """Its channels of `PLACE` for a ship in `state`."""
        north, east = self.U * math.cos(self.psi), self.U * math.sin(self.psi)
        return self.x + north * t - state[0], self.y + east * t - state[1], north, east, self.L, self.A_M


@dataclass(frozen=True, eq=False)
class Place:
    """A ship's surroundings besides the weather.

    Attributes:
        grid: the chart as the ship reads it; None for open water.
        contact: what it may touch; None where it passes through.
        other: another ship.
        hull: half the outline of the ship.
        chart: the chart.
    """

    grid: Grid | None = None
    contact: Contact | None = None
    other: Other | None = None
    hull: tuple[tuple[float, float], ...] = ()
    chart: Chart | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the series that the chart gives."""
        return (*SMOOTH, *self.grid.field.near) if self.grid else ()

    def around(self, t: Scalar, state: Scalars, given: Scalars, looked: Scalars) -> Scalars:
        """Channels and place, as `Charted` has them, then what is near."""
        base, wide = Charted(*given), len(SMOOTH)
        if self.grid is not None:
            per_depth, bank_x, bank_y, away, x, y = looked[:wide]
            size = away * root(larger(x * x + y * y, 1e-6))
            base = base._replace(per_depth=per_depth, bank_x=bank_x, bank_y=bank_y, quay_x=x / size, quay_y=y / size)
        if self.other is not None:
            base = Charted(*base[: -len(PLACE[4:])], *self.other.at(t, state))
        return (*base, *looked[wide:])

    def charted(self, values: Scalars) -> Charted:
        """Channels and place by name; what is not there is zero for every lane, so that no kernel computes it."""
        around = Charted(*values)
        if self.other is not None:
            return around
        return Charted(*around[: -len(PLACE[4:])])

    def kicks(self, controls: int, steps: int, model_of: Callable[[Scalars], Any]) -> Kicks | None:
        """Impulses of contact on a ship; None without contact."""
        contact, first = self.contact, controls + len(CHANNELS) + len(PLACE)
        if contact is None:
            return None

        def push(state: Scalars, acting: Scalars, parameters: Scalars) -> Push:
            around = self.charted(acting[controls:first])
            own = model_of(parameters)
            flow = Surroundings.of(state, around).flow(own.body)
            X, Y, N = (own.answer(Force(*unit), flow) for unit in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
            return lambda force: tuple(
                force[0] * x + force[1] * y + force[2] * n for x, y, n in zip(X, Y, N, strict=True))  # fmt: skip

        return Kicks(
            lambda z, a: contact.touched(z, a[first:]),
            lambda h, z, k, a, t, p: contact.first(h, z, k, a[first:], t, push(z, a, p)),
            lambda h, z, kept, a, t, p: contact.last(h, z, kept, a[first:], t, push(z, a, p)),
            contact.size, steps,
        )  # fmt: skip

    def substeps(self, ship: Ship, dt: float) -> int:
        """Steps of the motion within `dt` [s] that the stiffness of what it may touch needs."""
        if self.contact is None or self.grid is None:
            return 1
        mass, hard = float(ship.model.displaced), self.contact.hard if self.grid.bare else 0.0
        stiff = max([self.grid.stiffness, hard, *(line.EA / line.length for line in self.contact.lines)])
        return max(1, math.ceil(dt * math.sqrt(stiff / mass) / _FINE))


def place_of(
    ship: Ship, chart: Chart | None = None, *, touching: bool = True, other: Other | None = None,
    lines: tuple[Line, ...] = (), cell: float | None = None, hull: tuple[tuple[float, float], ...] | None = None,
) -> Place:  # fmt: skip
    """A place for a ship.

    Args:
        ship: the ship.
        chart: what surrounds it.
        touching: False lets it pass through quays.
        other: another ship.
        lines: mooring lines.
        cell: distance of the nodes of its grid [m].
        hull: half its outline from the middle of the stern to the stem [m]; by default a usual one.

    Raises:
        ShipError: a ship whose family has no masses, or runs in discrete time.
        ChartError: a chart that cannot be tabulated.
    """
    if isinstance(ship.model, Sampled) or not isinstance(ship.model, Composed):
        raise ShipError(
            f"{ship.name}: a chart needs a ship of a body and forces (mmg, fossen); this family has neither"
        )
    size = Size(ship.L_pp, float(ship.model.breadth), float(ship.model.draught))
    half = hull or outline(size.L, size.B)
    _convex(half)
    hard = float(ship.model.displaced) * _HARD * _HARD
    grid = grid_of(chart, size, cell, hard=hard) if chart is not None else None
    contact = None
    if grid is not None and touching and (grid.walls or lines):
        contact = Contact(half, grid.curve, grid.stops, grid.walls, hard, lines)
    return Place(grid, contact, other, half, chart)


def _convex(half: tuple[tuple[float, float], ...]) -> None:
    points = np.array(half)
    if len(points) < 3 or points[0, 1] != 0.0 or points[-1, 1] != 0.0 or crosses(points):
        raise ShipError(
            "hull: half an outline goes from the middle of the stern to the stem, through three points or more"
        )
    sides = np.diff(points, axis=0)
    turns = sides[:-1, 0] * sides[1:, 1] - sides[:-1, 1] * sides[1:, 0]
    if not (turns < 1e-9).all():
        raise ShipError("hull: the outline is not convex; it turns one way from stern to stem")


def aground_or_inside(place: Place, start: tuple[float, ...], draught: float) -> str:
    """What is wrong with a start pose: in a wall, or on dry land; empty where nothing is."""
    if place.chart is None:
        return ""
    x, y, psi = start[:3]
    c, s = math.cos(psi), math.sin(psi)
    for k, quay in enumerate(place.chart.quays, 1):
        for (a, b), (t, e), length in zip(*sides(quay.line), strict=True):
            ahead, off = (x - a) * t + (y - b) * e, (y - b) * t - (x - a) * e
            behind = 0.0 <= ahead <= length and -2.0 * place.hull[-1][0] < off < 0.0
            for way in np.linspace(0.0, length, 1 + max(int(length / (0.1 * place.hull[-1][0])), 2)):
                north, east = a + way * t - x, b + way * e - y
                if behind or distance(place.hull, north * c + east * s, east * c - north * s)[0] < 0.0:
                    return f"it starts inside quay {k}; midship is at {x:.1f} m north, {y:.1f} m east"
    depth = float(place.chart.depth_at(np.array([x]), np.array([y]))[0])
    return f"it starts aground, in {depth:.1f} m of water with a draught of {draught:.1f} m" if depth <= draught else ""


def depths(place: Place, x: Array, y: Array) -> Array:
    """Depth of the water along a track [m], as a ship there meets it; infinite where deep."""
    looked = place.grid.field.look(x, y)[0][:, 0] if place.grid else np.zeros(len(x))
    with np.errstate(divide="ignore"):
        return 1.0 / looked
