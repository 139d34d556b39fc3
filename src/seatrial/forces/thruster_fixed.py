"""Thrusters that stand fixed and push along the ship, commanded by a share of full throttle.

Small craft log the command of the motor's speed controller (a pulse width), not revolutions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..core.parameters import ParameterError, Scalar, Scalars, spec
from ..core.symbolic import clip, is_symbol, magnitude, where
from . import Flow, Force, ThrusterModule
from .azimuth import columns


@dataclass(frozen=True, kw_only=True)
class Fixed(ThrusterModule):
    """Thrust ahead by the command s from -1 (full astern) to 1 (full ahead): T_1 s + T_2 |s| s.

    `astern` multiplies it for s < 0.  The map holds from `low` to `high`; beyond, the thrust stays as it is
    there, and `lint` reports a trial that goes there.
    """

    prefixes: ClassVar[tuple[str, ...]] = ("throttle",)

    x: Scalar = spec("m", "position ahead of midship", default=0.0)
    y: Scalar = spec("m", "position to starboard of the centreline")
    T_1: Scalar = spec("N", "thrust, linear in the command", (0.0, 1e8), default=0.0)
    T_2: Scalar = spec("N", "thrust, by |s| s", (0.0, 1e8), default=0.0)
    astern: Scalar = spec("", "thrust astern over that ahead at the same |s|", (0.0, 2.0), default=1.0)
    low: Scalar = spec("", "least command for which the map holds", (-1.0, 0.0), default=-1.0)
    high: Scalar = spec("", "greatest command for which the map holds", (0.0, 1.0), default=1.0)

    def __post_init__(self) -> None:
        if not any(is_symbol(x) or x for x in (self.T_1, self.T_2)):
            raise ParameterError("a fixed thruster needs T_1 or T_2 above zero; without them it does not push")

    @property
    def tested(self) -> tuple[float, float]:
        """Commands for which the map holds."""
        return float(self.low), float(self.high)

    @property
    def effect(self) -> tuple[tuple[Scalar, Scalar, Scalar], ...]:
        """Column of B: what a force ahead does at its place."""
        return columns(self.x, self.y)[:1]

    def thrust(self, command: Scalar) -> Scalar:
        """Thrust ahead [N] at a command in [-1, 1]."""
        s = clip(command, self.low, self.high)
        return where(s < 0, self.astern, 1.0) * s * (self.T_1 + self.T_2 * magnitude(s))

    def inputs(self, flow: Flow, control: Scalars) -> Scalars:
        """Thrust ahead [N]."""
        return (self.thrust(control[0]),)

    def force(self, flow: Flow, control: Scalars) -> Force:
        T = self.thrust(control[0])
        return Force(T, 0.0, -self.y * T)
