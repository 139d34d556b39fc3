"""Fossen's family beside a quay, under a steady force: what a log in a harbour holds besides water and thrusters.

A quay pushes where the hull touches it and nowhere else.  Its side is a straight line of the earth; the hull is
an octagon, a rectangle without its corners.  Each corner that is behind the line is pushed out by a spring and a damper
and rubs along it.  The contact is smooth, so that derivatives exist: it fades in over a centimetre or two.
"""

from __future__ import annotations

from math import pi

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import cos, larger, root, sin, tanh
from ..core.values import dataclass, field
from ..environment import Environment, to_body, to_earth
from ..forces import Force
from .common import Surroundings
from .fossen import Fossen

# Over this depth [m] a contact fades in, and over this sliding speed [m/s] friction turns round.
_SOFT, _CREEP = 0.02, 0.03
# A wall across is so thick [m].
_THICK = 0.6


@dataclass(frozen=True, kw_only=True)
class Steady:
    """A force in ship axes that stays: what unequal thrusters and wind leave, on a day of trials."""

    X_0: Scalar = spec("N", "steady surge force", default=0.0)
    Y_0: Scalar = spec("N", "steady sway force", default=0.0)
    N_0: Scalar = spec("N m", "steady yaw moment", default=0.0)


@dataclass(frozen=True, kw_only=True)
class Quay:
    """The side of a quay, a straight line with the water to starboard of it; K = 0 is none.

    At its point a wall of the length `reach` may stand across: with the side it makes an inner corner, and the berth is
    ahead of it.
    """

    north: Scalar = spec("m", "north of a point of the side")
    east: Scalar = spec("m", "east of that point")
    direction: Scalar = spec("rad", "direction of the side, the water to starboard", (-2.0 * pi, 2.0 * pi))
    reach: Scalar = spec("m", "length of a wall across, at the point; 0 for none", (0.0, 1e4), default=0.0)
    K: Scalar = spec("N/m", "stiffness of a contact", (0.0, 1e9), default=0.0)
    C: Scalar = spec("N s/m", "damping of a contact", (0.0, 1e9), default=0.0)
    mu: Scalar = spec("", "friction along the side", (0.0, 2.0), default=0.0)
    flat: Scalar = spec("m", "half the length of the straight sides of the hull", (0.0, 1e3), default=0.0)
    half: Scalar = spec("m", "half the breadth of the straight ends of the hull", (0.0, 1e3), default=0.0)
    middle: Scalar = spec("m", "middle of the hull ahead of midship", default=0.0)

    def force(self, state: Scalars, L_pp: Scalar, B: Scalar) -> Force:
        """Force on the hull.

        Args:
            state: the six states, velocities over ground.
            L_pp, B: length and breadth of the hull [m].
        """
        total = Force(0.0, 0.0, 0.0)
        for ahead in (-1.0, 1.0):
            for side in (-0.5, 0.5):
                total = total + self._corner(state, self.middle + ahead * self.flat, side * B)
                total = total + self._corner(state, self.middle + 0.5 * ahead * L_pp, 2.0 * side * self.half)
        return total

    def _corner(self, state: Scalars, a: Scalar, b: Scalar) -> Force:
        """Force of the quay on the corner at (a, b) [m] of the hull."""
        x, y, psi, u, v_m, r = state[:6]
        c, s = cos(psi), sin(psi)
        north, east = to_earth(a, b, c, s)
        v_north, v_east = to_earth(u - r * b, v_m + r * a, c, s)
        along, out = cos(self.direction), sin(self.direction)
        # In axes of the quay: ahead along its side, and off it into the water.
        ahead, off = to_body(x + north - self.north, y + east - self.east, along, out)
        v_ahead, v_off = to_body(v_north, v_east, along, out)
        push, rub = self._contact(off, v_off, v_ahead)
        back, up = self._contact(ahead, v_ahead, v_off)
        # A corner far behind the wall across came in round its end: there is no wall.
        # Whether there is a wall, which all lanes share, as a quotient: a choice there keeps gcc 12 from vectors.
        wall = self.reach / (self.reach + 1e-30)
        here = _before(off - self.reach) * _before(-ahead - _THICK) * wall
        f_ahead, f_off = rub + here * back, push + here * up
        X, Y = to_body(*to_earth(f_ahead, f_off, along, out), c, s)
        return Force(X, Y, a * Y - b * X)

    def _contact(self, off: Scalar, v_off: Scalar, slide: Scalar) -> tuple[Scalar, Scalar]:
        """Force off a wall and along it on a corner that is `off` [m] from it."""
        size = root(off * off + _SOFT * _SOFT)
        push = _before(off) * larger(0.5 * self.K * (size - off) - self.C * v_off, 0.0)
        return push, -self.mu * push * tanh(slide / _CREEP)


def _before(distance: Scalar) -> Scalar:
    """One below zero and zero above."""
    return 0.5 * (1.0 - distance / root(distance * distance + _SOFT * _SOFT))


@dataclass(frozen=True, kw_only=True)
class Harbour(Fossen):
    """A ship by its matrices M, C and D beside a quay, with a steady force.

    The steady force and a current are what a filter follows as slow disturbances; the quay is the chart's.
    """

    steady: Steady = field(default_factory=Steady)
    quay: Quay = field(default_factory=lambda: Quay(north=0.0, east=0.0, direction=0.0))

    @property
    def asymmetries(self) -> tuple[str, ...]:
        """The steady force and the quay, which have a side."""
        return ("steady.Y_0", "steady.N_0", "quay.K", "quay.C")

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        around, fixed = Surroundings.of(state, environment), len(self.conventional)
        flow = around.flow(self.body, *control[:fixed])
        force = self.force(flow, control[fixed:]) + self.quay.force(state, self.body.L_pp, self.body.B)
        force = force + Force(self.steady.X_0, self.steady.Y_0, self.steady.N_0)
        return around.rates(self.inertia.acceleration(force, flow.u, flow.v_m, flow.r))
