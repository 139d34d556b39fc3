"""Tugs without a hull of their own: a force where each is made fast or pushes, less by the speed of the ship.

How fast a tug answers belongs to its actuator in the ship file: `lag` 5 to 15 s for its thrust, `dead_time` for the
order over the radio, `rate` for going round.  The curves over speed are from memory and no maker's polar: direct pull
falls to zero at the tug's free speed (12 to 13 kn), half of a push is lost at 3 to 4 kn and nearly all at 6 kn.
Indirect towing above 8 kn is not modelled, nor the wash of a tug on a short line.
"""

from __future__ import annotations

from math import pi
from typing import ClassVar

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import clip, cos, magnitude, sin, speed
from ..core.values import dataclass
from . import Flow, Force, ThrusterModule


@dataclass(frozen=True, kw_only=True)
class PushTug(ThrusterModule):
    """A tug that pushes square on the side of the hull at (x, y): its order is a push [N].

    Made fast with a line (`pulls` above zero) it also pulls that much of its bollard push, by an order below zero.
    """

    prefixes: ClassVar[tuple[str, ...]] = ("f",)

    x: Scalar = spec("m", "where it pushes, ahead of midship")
    y: Scalar = spec("m", "where it pushes, to starboard; it pushes to the other side")
    f_max: Scalar = spec("N", "bollard push", (0.0, 1e8))
    pulls: Scalar = spec("", "bollard pull over push; 0 without a line", (0.0, 1.5), default=0.0)
    U_end: Scalar = spec("m/s", "speed at which it must use all its power to stay (from memory)", (0.1, 20.0),
                         default=3.6)  # fmt: skip

    def force(self, flow: Flow, control: Scalars) -> Force:
        left = clip(1.0 - (speed(flow.u, flow.v_m) - 1e-6) / self.U_end, 0.0, 1.0)
        # A side that all lanes share, as a quotient: a choice there keeps gcc 12 from vectors.
        side = self.y / (magnitude(self.y) + 1e-30)
        Y = -side * left * clip(control[0], -self.pulls * self.f_max, self.f_max)
        return Force(0.0, Y, self.x * Y)


@dataclass(frozen=True, kw_only=True)
class LineTug(ThrusterModule):
    """A tug on a line from a fairlead at (x, y): a pull [N] and where to, clockwise from ahead; a line never pushes."""

    prefixes: ClassVar[tuple[str, ...]] = ("f", "alpha")

    x: Scalar = spec("m", "its fairlead, ahead of midship")
    y: Scalar = spec("m", "its fairlead, to starboard", default=0.0)
    f_max: Scalar = spec("N", "bollard pull", (0.0, 1e8))
    rise: Scalar = spec("rad", "angle of the line to the water", (0.0, 0.5 * pi), default=0.0)
    U_free: Scalar = spec("m/s", "free speed, at which no pull is left (from memory)", (0.1, 20.0), default=6.4)

    def force(self, flow: Flow, control: Scalars) -> Force:
        left = clip(1.0 - (speed(flow.u, flow.v_m) - 1e-6) / self.U_free, 0.0, 1.0)
        T = left * cos(self.rise) * clip(control[0], 0.0, self.f_max)
        X, Y = T * cos(control[1]), T * sin(control[1])
        return Force(X, Y, self.x * Y - self.y * X)
