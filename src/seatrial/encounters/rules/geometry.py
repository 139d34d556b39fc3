"""How two ships lie and move to each other: range, bearings, closest approach, ship domains, contact of hulls.

Arrays have rows of time along their last axis and any axes before it; a `Motion` is one ship of a pair in all runs.
`beta` is the bearing of the other ship from the own bow and `alpha` that of the own ship from the other's bow, both
above zero to starboard.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass, replace

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

STILL = 1e-3
"""Relative speed below which two ships keep their distance [m/s]."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A ship in time.

    Attributes:
        x, y, psi: place of midship north and east [m] and heading [rad], shape (..., rows).
        u, v_m: velocity over ground of midship, ahead and to starboard [m/s], same shape.
        L, B: length and breadth [m], shape (..., 1).
    """

    x: Array
    y: Array
    psi: Array
    u: Array
    v_m: Array
    L: Array
    B: Array

    def each(self, change: Callable[[Array], Array]) -> Motion:
        """The same with other rows."""
        x, y, psi, u, v_m = map(change, (self.x, self.y, self.psi, self.u, self.v_m))
        return Motion(x, y, psi, u, v_m, self.L, self.B)

    @cached_property
    def velocity(self) -> tuple[Array, Array]:
        """Over ground, north and east [m/s]."""
        c, s = np.cos(self.psi), np.sin(self.psi)
        return self.u * c - self.v_m * s, self.u * s + self.v_m * c


@dataclass(frozen=True, eq=False)
class Pair:
    """The own ship, the other one, and their common time `t` [s], shape (rows,)."""

    t: Array
    own: Motion
    other: Motion

    @property
    def swapped(self) -> Pair:
        """The same as the other ship sees it."""
        found = Pair(self.t, self.other, self.own)
        # what both see alike is worked out once
        found.__dict__.update(range=self.range, approach=self.approach, beta=self.alpha, alpha=self.beta)
        return found

    @cached_property
    def place(self) -> tuple[Array, Array]:
        """The other ship from the own one, north and east [m]."""
        return self.other.x - self.own.x, self.other.y - self.own.y

    @cached_property
    def range(self) -> Array:
        """Distance of midships [m]."""
        return np.hypot(*self.place)

    @cached_property
    def beta(self) -> Array:
        """Bearing of the other ship from the own bow [rad]."""
        return wrapped(np.arctan2(self.place[1], self.place[0]) - self.own.psi)

    @cached_property
    def alpha(self) -> Array:
        """Bearing of the own ship from the other's bow [rad]."""
        return wrapped(np.arctan2(-self.place[1], -self.place[0]) - self.other.psi)

    @cached_property
    def approach(self) -> tuple[Array, Array]:
        """DCPA [m] and TCPA [s] on the velocities of each row; TCPA is NaN where the distance does not change."""
        (a, b), (c, d) = self.own.velocity, self.other.velocity
        return approach(*self.place, c - a, d - b)

    @cached_property
    def lengths(self) -> Array:
        """Length of the longer ship [m], shape (..., 1)."""
        return np.maximum(self.own.L, self.other.L)


def wrapped(angle: Array) -> Array:
    """An angle within -pi to pi."""
    return angle - np.round(angle / (2.0 * np.pi)) * (2.0 * np.pi)


def approach(north: Array, east: Array, v_north: Array, v_east: Array) -> tuple[Array, Array]:
    """Distance [m] and time [s] of the closest approach on steady courses, from relative place and velocity.

    A closest approach in the past counts with the present distance.
    """
    square = v_north**2 + v_east**2
    still = square < STILL**2
    t = -(north * v_north + east * v_east) / np.where(still, np.nan, square)
    ahead = np.where(t > 0.0, t, 0.0)
    return np.hypot(north + ahead * v_north, east + ahead * v_east), t


@dataclass(frozen=True, eq=False)
class Closest:
    """The closest approach of the tracks themselves.

    Attributes:
        distance: of midships [m].
        t: its time [s].
        row: the row before it.
        share: of the step that follows, 0 to 1.
    """

    distance: Array
    t: Array
    row: NDArray[np.intp]
    share: Array

    def at(self, values: Array) -> Array:
        """Values of rows, between the two rows around the closest approach; angles the shorter way."""
        last = np.minimum(self.row + 1, values.shape[-1] - 1)
        a, b = taken(values, self.row), taken(values, last)
        return a + self.share * (b - a)

    def angle(self, values: Array) -> Array:
        """The same for angles [rad], the shorter way round."""
        last = np.minimum(self.row + 1, values.shape[-1] - 1)
        a, b = taken(values, self.row), taken(values, last)
        return wrapped(a + self.share * wrapped(b - a))


def taken(values: Array, row: NDArray[np.intp]) -> Array:
    """The value of one row of each run."""
    return np.take_along_axis(values, row[..., None], axis=-1)[..., 0]


def closest(pair: Pair, within: Bools) -> Closest:
    """The least distance of midships over the steps that begin `within`, straight between rows.

    Sampled rows alone err by up to half a step of the relative motion.
    """
    north, east = pair.place
    a, b = north[..., :-1], east[..., :-1]
    c, d = np.diff(north, axis=-1), np.diff(east, axis=-1)
    square = c * c + d * d
    share = np.clip(-(a * c + b * d) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    distance = np.where(within[..., :-1], np.hypot(a + share * c, b + share * d), np.inf)
    row = distance.argmin(axis=-1)
    share = taken(share, row)
    return Closest(taken(distance, row), pair.t[row] + share * (pair.t[row + 1] - pair.t[row]), row, share)


def ellipse(pair: Pair, ahead: float, aside: float) -> Array:
    """Smallest factor by which an ellipse about the own ship must shrink for the other ship to lie on its border.

    Semi-axes `ahead` and `aside` in lengths of the own ship (Fujii and Tanaka 1971: 4 and 1.6); shape (..., rows).
    Below 1 the domain is violated, by the degree 1 less the factor (Szlapczynski and Szlapczynska 2016).
    """
    r = pair.range / pair.own.L
    return np.hypot(r * np.cos(pair.beta) / ahead, r * np.sin(pair.beta) / aside)


def clearance(pair: Pair) -> Array:
    """Gap between the bounding rectangles of the hulls along the axis that separates them best [m], shape (..., rows).

    Above zero the hulls are apart (and at least so far), below zero they overlap by so much.
    """
    north, east = pair.place
    gaps: list[Array] = []
    for ship in (pair.own, pair.other):
        for axis in (ship.psi, ship.psi + 0.5 * np.pi):
            reach = _reach(pair.own, axis) + _reach(pair.other, axis)
            gaps.append(np.abs(north * np.cos(axis) + east * np.sin(axis)) - reach)
    return np.maximum.reduce(gaps)


def _reach(ship: Motion, axis: Array) -> Array:
    """Half the extent of a hull along an axis [m]."""
    return 0.5 * (np.abs(ship.L * np.cos(ship.psi - axis)) + np.abs(ship.B * np.sin(ship.psi - axis)))


def touch(pair: Pair) -> Array:
    """Least `clearance` of the whole run [m], also between rows; shape (...).

    Ships whose midships never come within half the sum of their diagonals keep the clearance of their closest row;
    the others are followed in steps of a quarter of the smaller breadth.
    """
    at = closest(pair, np.ones(np.shape(pair.range), dtype=bool))

    def then(rows: Array) -> Array:
        return np.take_along_axis(rows, at.row[..., None], axis=-1)

    near = at.distance <= 0.5 * (np.hypot(pair.own.L, pair.own.B) + np.hypot(pair.other.L, pair.other.B))[..., 0]
    least = np.asarray(clearance(Pair(pair.t, pair.own.each(then), pair.other.each(then)))[..., 0])
    for found in np.argwhere(near):
        where = tuple(found)
        one = replace(pair, own=_one(pair.own, where), other=_one(pair.other, where))
        least[where] = clearance(_finer(one)).min()
    return least


def _one(ship: Motion, where: tuple[int, ...]) -> Motion:
    """A ship in one run of many."""
    sizes = (np.broadcast_to(one, (*ship.x.shape[:-1], 1))[where] for one in (ship.L, ship.B))
    return replace(ship.each(lambda rows: rows[where]), L=next(sizes), B=next(sizes))


def _finer(pair: Pair) -> Pair:
    """One pair with rows between, while its ships are near each other."""
    step = 0.25 * float(min(pair.own.B.min(), pair.other.B.min()))
    moved = np.hypot(*(np.diff(one) for one in pair.place))
    turned = np.abs(np.diff(pair.own.psi)) * pair.own.L + np.abs(np.diff(pair.other.psi)) * pair.other.L
    apart = np.minimum(pair.range[:-1], pair.range[1:]) - moved
    near = apart <= 0.5 * float((np.hypot(pair.own.L, pair.own.B) + np.hypot(pair.other.L, pair.other.B)).item())
    count = np.ceil(np.maximum(moved, 0.5 * turned) / step).clip(1.0, 1e4).astype(int)
    k = np.repeat(np.flatnonzero(near), count[near])
    share = (np.arange(len(k)) - np.repeat(np.cumsum(count[near]) - count[near], count[near])) / count[k]
    t = np.append(pair.t[k] + share * (pair.t[k + 1] - pair.t[k]), pair.t[-1])

    def of(ship: Motion) -> Motion:
        return replace(ship, psi=np.unwrap(ship.psi)).each(lambda rows: np.interp(t, pair.t, rows))

    return Pair(t, of(pair.own), of(pair.other))
