"""Contact of a hull with fenders, walls and their corners, and mooring lines: impulses that give no energy.

The hull is a convex outline, its own mirror image.  A fender is a point with a height: it is compressed by as much as
the hull comes nearer than that, along the shortest way from the outline to it; a corner of a wall is a hard one of half
a metre.  A corner of the hull is pushed out of a wall by a spring without friction.  All three and the lines have a
potential P(x, y, psi), so that what the hull loses is what they store; friction and the loss in the rubber (Hunt and
Crossley) only take.

Stepping (`Contact.first`, `last`): half of the elastic impulse, the step of the ship without contact, the other half,
as in Verlet's method; then the velocity is scaled down wherever kinetic and stored energy have grown, which is what
makes "no energy gained" a property of the method instead of its step.  Friction is Coulomb's: it takes the sliding
speed away at once as far as mu times the pressure reaches, and looks half a step ahead by the rates of the ship, so a
ship that lies under wind and fenders does not creep.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from itertools import pairwise
from typing import NamedTuple

from ..core.parameters import Scalar, Scalars
from ..core.symbolic import clip, cos, larger, root, sin, smaller, where
from ..core.values import dataclass
from ..environment.fenders import Curve
from ..environment.grid import Stop, Wall

# Thickness of a wall [m], and what keeps roots and quotients finite at zero.
_THICK, _TINY = 5.0, 1e-18

Push = Callable[[Scalars], Scalars]
"""Rates (u, v_m, r) of a force (X, Y, N) on the ship at rest."""


class Touch(NamedTuple):
    """One contact: compression, reaction, stored energy, its place and the way the ship is pushed, in ship axes.

    `n` is the unit vector of the force on the ship.
    """

    delta: Scalar
    R: Scalar
    E: Scalar
    a: Scalar
    b: Scalar
    n_a: Scalar
    n_b: Scalar

    @property
    def force(self) -> Scalars:
        """X, Y, N of the elastic force."""
        X, Y = self.R * self.n_a, self.R * self.n_b
        return X, Y, self.a * Y - self.b * X

    @property
    def pressed(self) -> Pressed:
        """What friction and loss need of it."""
        return Pressed(self.R, self.n_a, self.n_b, self.a * self.n_a + self.b * self.n_b,
                       self.a * self.n_b - self.b * self.n_a)  # fmt: skip


class Pressed(NamedTuple):
    """A contact as friction and loss see it: reaction, way of the push, moments of unit forces."""

    R: Scalar
    n_a: Scalar
    n_b: Scalar
    turn_along: Scalar
    turn_across: Scalar

    @property
    def along(self) -> Scalars:
        """X, Y, N of a unit force along the hull there."""
        return -self.n_b, self.n_a, self.turn_along

    @property
    def across(self) -> Scalars:
        """X, Y, N of a unit force that pushes the ship away."""
        return self.n_a, self.n_b, self.turn_across


@dataclass(frozen=True)
class Line:
    """A mooring line from a bollard to a fairlead: elastic, one-sided, paid out by its winch above a setting.

    Attributes:
        north, east: the bollard [m].
        a, b: the fairlead, ahead of and to starboard of midship [m].
        length: without load [m].
        EA: load per strain [N].
        holds: tension that the winch holds; beyond it the line is paid out at that tension, and hove in again [N].
    """

    north: float
    east: float
    a: float
    b: float
    length: float
    EA: float
    holds: float = 1e12

    def pull(self, x: Scalar, y: Scalar, c: Scalar, s: Scalar) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """Tension [N], energy [J], and the unit vector from fairlead to bollard in ship axes."""
        north, east = self.north - x, self.east - y
        a, b = north * c + east * s - self.a, east * c - north * s - self.b
        far = root(a * a + b * b + _TINY)
        stretch = larger(far - self.length, 0.0)
        k = self.EA / self.length
        most = self.holds / k
        held = smaller(stretch, most)
        T = k * held
        return T, 0.5 * k * held * held + T * (stretch - held), a / far, b / far


def outline(L: float, B: float) -> tuple[tuple[float, float], ...]:
    """Half the outline of a usual ship, from the middle of its stern to its stem, (ahead, aside) of midship [m]."""
    shape = ((-0.5, 0.0), (-0.5, 0.34), (-0.38, 0.5), (0.28, 0.5), (0.42, 0.32), (0.5, 0.0))
    return tuple((x * L, y * B) for x, y in shape)


class Chain(NamedTuple):
    """An outline from its widest point to one end: lengths of its sides, their ways forward (or aft) and out."""

    length: tuple[float, ...]
    away: tuple[float, ...]
    out: tuple[float, ...]


@cache
def _chains(half: tuple[tuple[float, float], ...]) -> tuple[float, float, Chain, Chain]:
    """The widest point of half an outline, and the chains of sides forward and aft of it, as many in both."""
    most = max(b for _, b in half)
    middle = sum(a for a, b in half if b == most) / sum(b == most for _, b in half)
    ahead = [(middle, most), *((a, b) for a, b in half if a > middle)]
    astern = [(middle, most), *((a, b) for a, b in reversed(half) if a < middle)]
    stem, stern = half[-1], half[0]
    ahead += [stem] * (ahead[-1] != stem)
    astern += [stern] * (astern[-1] != stern)
    count = max(len(ahead), len(astern)) - 1

    def chain(points: list[tuple[float, float]], way: float) -> Chain:
        steps = [(way * (a_2 - a), b_2 - b) for (a, b), (a_2, b_2) in pairwise(points)]
        sides = [(s, e / s, f / s) for e, f in steps for s in [(e * e + f * f) ** 0.5]]
        return Chain(*zip(*sides, *[(0.0, 1.0, 0.0)] * (count - len(sides)), strict=True))

    return middle, most, chain(ahead, 1.0), chain(astern, -1.0)


def distance(
    half: tuple[tuple[float, float], ...], a: Scalar, b: Scalar
) -> tuple[Scalar, Scalar, Scalar, Scalar, Scalar]:
    """Distance of a point from a hull, below zero inside; the nearest point of the hull, the unit vector from it.

    From the widest point to either end an outline turns by at most a right angle.  So the nearest point is found by
    going along the sides one after another, each as far as the rest of the way points along it.

    Args:
        half: half its outline, from stern to stem.
        a, b: the point in ship axes [m].
    """
    side = where(b < 0.0, -1.0, 1.0)
    up = side * b
    middle, most, ahead, astern = _chains(half)
    forward = a >= middle
    way = where(forward, 1.0, -1.0)
    rest_a, rest_b = way * (a - middle), up - most
    for one, two in zip(zip(*ahead, strict=True), zip(*astern, strict=True), strict=True):
        length, e, f = (p if p == q else where(forward, p, q) for p, q in zip(one, two, strict=True))
        t = clip(rest_a * e + rest_b * f, 0.0, length)
        rest_a, rest_b = rest_a - t * e, rest_b - t * f
    rest_a = way * rest_a
    within: Scalar = -1e12
    in_a, in_b = 0.0, 0.0
    for (p, q), (p_2, q_2) in pairwise(half):
        length = ((p_2 - p) ** 2 + (q_2 - q) ** 2) ** 0.5
        e, f = (p_2 - p) / length, (q_2 - q) / length
        off = e * up - f * a - (e * q - f * p)  # from the stern forward the water is to starboard
        nearer = off > within
        within = larger(off, within)
        in_a, in_b = where(nearer, -f, in_a), where(nearer, e, in_b)
    inner = within <= 0.0  # on the outline too, where the fold at the widest point may lie on a side across
    far = root(rest_a * rest_a + rest_b * rest_b + _TINY)
    per = 1.0 / far
    n_a, n_b = where(inner, in_a, per * rest_a), where(inner, in_b, per * rest_b)
    gap = where(inner, within, far)
    return gap, a - gap * n_a, side * (up - gap * n_b), n_a, side * n_b


@dataclass(frozen=True)
class Contact:
    """What a hull may touch: as many stops and walls as a cell of the chart holds, and its mooring lines.

    Attributes:
        half: half the outline of the hull, see `outline`.
        curve: the curve of the fenders.
        stops, walls: how many of each the last inputs of a step hold.
        hard: stiffness of a wall [N/m].
        lines: mooring lines.
    """

    half: tuple[tuple[float, float], ...]
    curve: Curve
    stops: int
    walls: int
    hard: float
    lines: tuple[Line, ...] = ()

    def touches(self, state: Scalars, near: Scalars) -> Iterator[Touch]:
        """Every contact of a ship in `state`; those without pressure have R = 0."""
        x, y, psi = state[:3]
        c, s = cos(psi), sin(psi)
        wide = len(Stop._fields)
        for k in range(self.stops):
            yield self._stop(Stop._make(near[k * wide : (k + 1) * wide]), x, y, c, s)
        rest = near[self.stops * wide :]
        corners = [*self.half, *((a, -b) for a, b in self.half if b)]
        for k in range(self.walls):
            wall = Wall._make(rest[k * len(Wall._fields) : (k + 1) * len(Wall._fields)])
            for a, b in corners:
                yield self._corner(wall, a, b, x, y, c, s)

    def _stop(self, stop: Stop, x: Scalar, y: Scalar, c: Scalar, s: Scalar) -> Touch:
        north, east = stop.north - x, stop.east - y
        gap, a, b, n_a, n_b = distance(self.half, north * c + east * s, east * c - north * s)
        height = larger(stop.height, 1e-3)
        delta = larger(stop.height - gap, 0.0)
        force, energy = self.curve.both(delta / height)
        return Touch(delta, stop.reaction * force, stop.reaction * height * energy, a, b, -n_a, -n_b)

    def _corner(self, wall: Wall, a: float, b: float, x: Scalar, y: Scalar, c: Scalar, s: Scalar) -> Touch:
        """A corner of the hull within the block of a wall: pushed out by the shortest way."""
        north, east = x + a * c - b * s - wall.north, y + a * s + b * c - wall.east
        along, off = north * wall.along_x + east * wall.along_y, east * wall.along_x - north * wall.along_y
        best, w_along, w_off = -off, 0.0, 1.0
        for depth, t, n in ((along, -1.0, 0.0), (wall.length - along, 1.0, 0.0), (_THICK + off, 0.0, -1.0)):
            less = depth < best
            best, w_along, w_off = where(less, depth, best), where(less, t, w_along), where(less, n, w_off)
        delta = larger(best, 0.0)
        R = self.hard * delta
        n_x, n_y = w_along * wall.along_x - w_off * wall.along_y, w_along * wall.along_y + w_off * wall.along_x
        return Touch(delta, R, 0.5 * R * delta, a, b, n_x * c + n_y * s, n_y * c - n_x * s)

    def elastic(self, state: Scalars, near: Scalars) -> tuple[list[Touch], Scalars, Scalar]:
        """Contacts, the force X, Y, N of all that is elastic, and what it stores [J]."""
        touches = list(self.touches(state, near))
        total: Scalars = (0.0, 0.0, 0.0)
        energy: Scalar = 0.0
        for touch in touches:
            total = tuple(p + q for p, q in zip(total, touch.force, strict=True))
            energy = energy + touch.E
        c, s = cos(state[2]), sin(state[2])
        for line in self.lines:
            T, stored, a, b = line.pull(state[0], state[1], c, s)
            pull = (T * a, T * b, T * (line.a * b - line.b * a))
            total, energy = tuple(p + q for p, q in zip(total, pull, strict=True)), energy + stored
        return touches, total, energy

    @property
    def size(self) -> int:
        """How many values `touched` gives."""
        return 4 + self.stops * len(Pressed._fields)

    def touched(self, state: Scalars, near: Scalars) -> Scalars:
        """All that the impulses need of a pose: the elastic force, what it stores, and each stop as `Pressed`."""
        touches, force, stored = self.elastic(state, near)
        return (*force, stored, *(value for touch in touches[: self.stops] for value in touch.pressed))

    def _met(self, touched: Scalars, near: Scalars) -> tuple[list[tuple[Pressed, Stop]], Scalars, Scalar]:
        """The stops, the elastic force and what it stores, of what `touched` gave."""
        wide, own = len(Stop._fields), len(Pressed._fields)
        met = [(Pressed._make(touched[4 + k * own : 4 + (k + 1) * own]), Stop._make(near[k * wide : (k + 1) * wide]))
               for k in range(self.stops)]  # fmt: skip
        return met, touched[:3], touched[3]

    def first(self, h: Scalar, state: Scalars, rates: Scalars, near: Scalars, touched: Scalars, push: Push) -> Scalars:
        """State after the impulse before a step of `h` [s], and the energy left to it: stored, less what it gave."""
        met, force, stored = self._met(touched, near)
        v, gained = _kicked(state[3:6], force, push, 0.5 * h)
        ahead = tuple(0.5 * h * rate for rate in rates[3:6])
        v = _rubbed(v, ahead, met, push, 0.5 * h)
        return (*state[:3], *v, *state[6:], stored - gained)

    def last(self, h: Scalar, state: Scalars, kept: Scalar, near: Scalars, touched: Scalars, push: Push) -> Scalars:
        """State after the impulse that ends a step."""
        met, force, stored = self._met(touched, near)
        v, gained = _kicked(state[3:6], force, push, 0.5 * h)
        share = larger(stored + gained - kept, 0.0) / larger(_kinetic(v, push), _TINY)
        slower = root(larger(1.0 - share, 0.0))
        v = tuple(slower * one for one in v)
        for pressed, stop in met:
            v = _damped(v, pressed, stop.chi, push, h)
        v = _rubbed(v, (0.0, 0.0, 0.0), met, push, 0.5 * h)
        return (*state[:3], *v, *state[6:])


def _dot(p: Scalars, q: Scalars) -> Scalar:
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def _kicked(v: Scalars, force: Scalars, push: Push, h: Scalar) -> tuple[Scalars, Scalar]:
    """Velocities after a force for a time, and the kinetic energy that it gave."""
    a = push(force)
    return tuple(one + h * rate for one, rate in zip(v, a, strict=True)), h * (
        _dot(force, v) + 0.5 * h * _dot(force, a)
    )


def _kinetic(v: Scalars, push: Push) -> Scalar:
    """Kinetic energy of a ship whose answers to forces are `push`."""
    X, Y, N = push((1.0, 0.0, 0.0)), push((0.0, 1.0, 0.0)), push((0.0, 0.0, 1.0))
    inverse = Y[1] * N[2] - Y[2] * N[1]
    sway = (N[2] * v[1] - 0.5 * (Y[2] + N[1]) * v[2]) / inverse
    yaw = (Y[1] * v[2] - 0.5 * (Y[2] + N[1]) * v[1]) / inverse
    return 0.5 * (v[0] * v[0] / X[0] + v[1] * sway + v[2] * yaw)


def _rubbed(v: Scalars, ahead: Scalars, met: list[tuple[Pressed, Stop]], push: Push, h: Scalar) -> Scalars:
    """Velocities after friction for a time, contact by contact.

    Each takes away the sliding that there would be with the change `ahead`, as far as its pressure reaches.
    """
    for pressed, stop in met:
        way = pressed.along
        answer = push(way)
        slide = _dot(way, v) + _dot(way, ahead)
        most = h * stop.mu * pressed.R
        impulse = clip(-slide / larger(_dot(way, answer), _TINY), -most, most)
        v = tuple(one + impulse * rate for one, rate in zip(v, answer, strict=True))
    return v


def _damped(v: Scalars, pressed: Pressed, chi: Scalar, push: Push, h: Scalar) -> Scalars:
    """Velocities after the loss within a fender for a time: never a pull, and never more than all of the speed."""
    way = pressed.across
    answer = push(way)
    closing = -_dot(way, v)
    loss = h * chi * pressed.R
    impulse = closing * loss / (1.0 + loss * _dot(way, answer))
    impulse = larger(impulse, -h * pressed.R)
    return tuple(one + impulse * rate for one, rate in zip(v, answer, strict=True))
