"""Two tugs take a ship to a pose alongside or off a quay: a pilot's law on its sideways speed and heading.

The wanted speed across falls with the way left, `closing` at most and `touching` at the end, so the ship meets the
fenders at a speed of choice; along, the propeller is left alone.  Both tugs share the side force and moment that this
takes.
"""

from __future__ import annotations

from math import inf
from typing import ClassVar

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import clip, cos, larger, sign, sin
from ..core.values import dataclass
from . import Policy
from .autopilot import wrapped


@dataclass(frozen=True)
class TugBerthing(Policy):
    """Bring midship to the line through (x, y) in the direction psi, by push and pull of two tugs on one side."""

    kind: ClassVar[str] = "tug_berthing"
    from_rest: ClassVar[bool] = True

    y: Scalar = spec("m", "east of a point of the wanted line")
    x: Scalar = spec("m", "north of that point")
    psi: Scalar = spec("rad", "heading wanted")
    mass: Scalar = spec("kg", "mass of the ship with that of the water in sway", (1e-6, inf))
    inertia: Scalar = spec("kg m^2", "moment of inertia with that of the water", (1e-9, inf))
    arm: Scalar = spec("m", "way of each tug from midship", (1e-3, 1e3))
    side: Scalar = spec("", "side that the tugs are on, 1 starboard, -1 port", (-1.0, 1.0))
    closing: Scalar = spec("m/s", "largest speed across", (0.0, 5.0), default=0.2)
    touching: Scalar = spec(
        "m/s", "speed at the end of the way, held on until something stops it", (0.0, 1.0), default=0.04
    )
    wanting: Scalar = spec("s", "time in which the way left would be gone", (1.0, 1e4), default=200.0)
    answer: Scalar = spec("s", "time in which a wrong speed is mended", (1.0, 1e4), default=100.0)
    fore: str = "f_fore"
    aft: str = "f_aft"

    @property
    def orders(self) -> tuple[str, ...]:
        """Revolutions and helm at rest, and the force of each tug."""
        return "n_P", "delta", self.fore, self.aft

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        x, y, psi, _, v_m, r = state
        c, s = cos(self.psi), sin(self.psi)
        left = c * (self.y - y) - s * (self.x - x)  # to starboard of the ship
        slow = clip(left / self.wanting, -self.closing, self.closing)
        wanted = sign(left) * larger(sign(left) * slow, self.touching)
        Y = self.mass * (wanted - v_m) / self.answer
        turn = wrapped(self.psi - psi)
        N = self.inertia * (turn / (self.answer * self.answer) - 2.0 * r / self.answer)
        push = -self.side
        return (0.0, 0.0, 0.5 * push * (Y + N / self.arm), 0.5 * push * (Y - N / self.arm)), memory
