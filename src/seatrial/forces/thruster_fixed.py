"""Thrusters that stand fixed and push along the ship, by a share of full throttle or by revolutions.

Off the centreline they steer the craft by pushing unequally: helm hard over (`HARD_OVER`) asks the side away from
the turn for full throttle ahead more, and the other side for as much less.
"""

from __future__ import annotations

from typing import ClassVar

from ..core.parameters import ParameterError, Scalar, Scalars, spec
from ..core.symbolic import clip, is_symbol, magnitude, where
from ..core.values import dataclass
from . import HARD_OVER, Flow, Force, ThrusterModule
from .azimuth import columns


def unequal(y: Scalar, full: float) -> tuple[float, ...]:
    """What a thruster at `y` takes of the helm, per radian: `full` hard over, ahead on the side away from the turn."""
    return (full / HARD_OVER * ((y < 0) - (y > 0)),)


@dataclass(frozen=True, kw_only=True)
class Fixed(ThrusterModule):
    """Thrust ahead by the command s from -1 (full astern) to 1 (full ahead): T_1 s + T_2 |s| s at rest.

    Small craft log the command of the motor's speed controller (a pulse width), not revolutions.  For a manoeuvre,
    whose order ahead is one of revolutions, 1 1/s is full throttle.

    `astern` multiplies it for s < 0.  A propeller that pushes against the way of the craft works in its own wash:
    its thrust is that at rest over 1 + `against` u^2, and one that pushes astern as the craft goes astern loses the
    share `sternway` |u|: fits to trials and no theory.  The map holds from `low` to `high`; beyond, the thrust stays as
    it is there, and `lint` reports a trial that goes there.
    """

    prefixes: ClassVar[tuple[str, ...]] = ("throttle",)

    x: Scalar = spec("m", "position ahead of midship", default=0.0)
    y: Scalar = spec("m", "position to starboard of the centreline")
    T_1: Scalar = spec("N", "thrust, linear in the command", (0.0, 1e8), default=0.0)
    T_2: Scalar = spec("N", "thrust, by |s| s", (0.0, 1e8), default=0.0)
    astern: Scalar = spec("", "thrust astern over that ahead at the same |s|", (0.0, 2.0), default=1.0)
    against: Scalar = spec("s^2/m^2", "how way against the thrust lessens it, by its square", (0.0, 100.0), default=0.0)
    sternway: Scalar = spec("s/m", "share of the thrust astern that is lost per sternway", (0.0, 100.0), default=0.0)
    low: Scalar = spec("", "least command for which the map holds", (-1.0, 0.0), default=-1.0)
    high: Scalar = spec("", "greatest command for which the map holds", (0.0, 1.0), default=1.0)

    def __post_init__(self) -> None:
        if not any(is_symbol(x) or x for x in (self.T_1, self.T_2)):
            raise ParameterError("a fixed thruster needs T_1 or T_2 above zero; without them it does not push")

    @property
    def follows(self) -> tuple[tuple[str, float], ...]:
        """The throttle obeys n_P, 1 1/s being full throttle: a convention and no physics."""
        return (("n_P", 1.0),)

    @property
    def differential(self) -> tuple[float, ...]:
        """Hard over, the side away from the turn gains full throttle and the other side loses it."""
        return unequal(self.y, 1.0)

    @property
    def tested(self) -> tuple[float, float]:
        """Commands for which the map holds."""
        return float(self.low), float(self.high)

    @property
    def effect(self) -> tuple[tuple[Scalar, Scalar, Scalar], ...]:
        """Column of B: what a force ahead does at its place."""
        return columns(self.x, self.y)[:1]

    def thrust(self, command: Scalar, u: Scalar = 0.0) -> Scalar:
        """Thrust ahead [N] at a command in [-1, 1] and a speed ahead through the water [m/s]."""
        s = clip(command, self.low, self.high)
        T = where(s < 0, self.astern, 1.0) * s * (self.T_1 + self.T_2 * magnitude(s))
        kept = clip(1.0 - where(s < 0, self.sternway, 0.0) * magnitude(u), 0.0, 1.0)
        return where(s * u < 0, T / (1.0 + self.against * u * u), T * kept)

    def inputs(self, flow: Flow, control: Scalars) -> Scalars:
        """Thrust ahead [N]."""
        return (self.thrust(control[0], flow.u),)

    def force(self, flow: Flow, control: Scalars) -> Force:
        T = self.thrust(control[0], flow.u)
        return Force(T, 0.0, -self.y * T)


@dataclass(frozen=True, kw_only=True)
class Screw(ThrusterModule):
    """Thrust ahead by the revolutions: k n |n|, less what speed ahead takes from it (T_nu |n| u).

    `astern` multiplies k for n < 0; beyond `n_max` either way the thrust stays as it is there.
    """

    prefixes: ClassVar[tuple[str, ...]] = ("n",)

    x: Scalar = spec("m", "position ahead of midship", default=0.0)
    y: Scalar = spec("m", "position to starboard of the centreline")
    k: Scalar = spec("N s^2", "thrust at rest over n |n|", (1e-12, 1e8))
    astern: Scalar = spec("", "thrust astern over that ahead at the same |n|", (0.0, 2.0), default=1.0)
    n_max: Scalar = spec("1/s", "greatest revolutions; those of full thrust", (1e-3, 1e4))
    T_nu: Scalar = spec("N s^2/m", "thrust lost per |n| and speed ahead", (0.0, 1e9), default=0.0)

    @property
    def follows(self) -> tuple[tuple[str, float], ...]:
        """Revolutions obey n_P."""
        return (("n_P", 1.0),)

    @property
    def differential(self) -> tuple[float, ...]:
        """Hard over, the side away from the turn gains `n_max` and the other side loses it."""
        return unequal(self.y, float(self.n_max))

    @property
    def tested(self) -> tuple[float, float]:
        """Revolutions [1/s] for which the law holds."""
        return -float(self.n_max), float(self.n_max)

    @property
    def effect(self) -> tuple[tuple[Scalar, Scalar, Scalar], ...]:
        """Column of B: what a force ahead does at its place."""
        return columns(self.x, self.y)[:1]

    def thrust(self, n: Scalar) -> Scalar:
        """Thrust at rest [N] at `n` [1/s]."""
        held = clip(n, -self.n_max, self.n_max)
        return where(held < 0, self.astern, 1.0) * self.k * held * magnitude(held)

    def inputs(self, flow: Flow, control: Scalars) -> Scalars:
        """Thrust at rest [N]."""
        return (self.thrust(control[0]),)

    def loss(self, flow: Flow, control: Scalars) -> tuple[Scalar, Scalar, Scalar]:
        """What speed ahead takes, per m/s [N s/m, N s/m, N s]."""
        lost = self.T_nu * magnitude(clip(control[0], -self.n_max, self.n_max))
        return lost, 0.0, -self.y * lost

    def force(self, flow: Flow, control: Scalars) -> Force:
        T = self.thrust(control[0]) - self.loss(flow, control)[0] * flow.u
        return Force(T, 0.0, -self.y * T)
