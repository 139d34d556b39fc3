"""The direct spiral (Dieudonne): steady turns at one rudder angle after another, down and up again.

Each angle is held until the yaw rate is steady; angles near midships lie closer together.  A ship
that is stable on course has one yaw rate to each angle; an unstable one keeps turning against small
angles and jumps at either end of a loop (IMO MSC/Circ.1053 appendix; ITTC 7.5-04-02-01).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import both, clip, smaller, where
from ..core.values import dataclass
from ..data import Array, Trial
from . import Index, Manoeuvre, Settings
from .reading import complete_rows, holds, last_seconds, rudder_channel, yaw_rate
from .steady import MEMORY, TOLERANCE, WINDOW, waited

_DEGREE = math.radians(1.0)
# A rudder within this fraction of the smallest increment is still held.
_HELD = 0.3
# Rudder angles of a staircase are sums of steps: what differs by rounding is one angle.
_EDGE = 1e-6
# Windows for which the last angle must have been held, less what a running mean blurs.
_LAST = 2.9
_RATE = "rad/s"


@dataclass(frozen=True)
class Spiral(Manoeuvre):
    """Rudder from `delta` on one side to `delta` on the other and back, a step per steady turn."""

    kind: ClassVar[str] = "spiral"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "side")
    memory: ClassVar[tuple[str, ...]] = ("order", "way", *MEMORY)

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    delta: Scalar = spec("rad", "greatest rudder angle, magnitude", (0.0, math.pi))
    window: Scalar = spec("s", "time over which a steady yaw rate is judged", (0.0, math.inf))
    tolerance: Scalar = spec("rad/s", "change of a steady yaw rate within the window", (0.0, math.inf))
    step: Scalar = spec("rad", "increment of the rudder", (0.0, math.pi), default=5.0 * _DEGREE)
    near: Scalar = spec("rad", "rudder angle within which the fine increment holds", (0.0, math.pi), 5.0 * _DEGREE)
    fine: Scalar = spec("rad", "increment of the rudder near midships", (0.0, math.pi), default=_DEGREE)
    side: Scalar = spec("-", "first side: +1 starboard, -1 port", (-1.0, 1.0), default=1.0)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """From 20 deg starboard by default; windows and tolerance by the ship's L/U."""
        greatest = settings.rudder_or(20.0 * _DEGREE)
        return cls(settings.n_P, greatest, WINDOW * settings.clock, TOLERANCE / settings.clock, side=settings.side)

    def begin(self, state: Scalars) -> Scalars:
        """Rudder over to the first side [rad], on its way to the other."""
        return (self.side * self.delta, -self.side, 0.0, state[5], 0.0)

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad]: the next angle once the yaw rate is steady."""
        order, way = memory[:2]
        steady, wait = waited(t, state[5], memory[2:], self.window, self.tolerance)
        ended = way * order >= self.delta * (1.0 - _EDGE)
        moving = where(ended, where(way * self.side < 0, self.side, 0.0), way)  # 0: the spiral is over
        ahead = moving * order
        inner = both(ahead >= -self.near * (1.0 + _EDGE), ahead < self.near * (1.0 - _EDGE))
        outer = where(ahead < 0, smaller(self.step, -self.near - ahead), self.step)  # stops where the fine steps begin
        after = clip(order + moving * where(inner, self.fine, outer), -self.delta, self.delta)
        way = where(both(steady, moving * moving > 0), moving, way)
        order = where(steady, after, order)
        return (self.n_P, order), (order, way, *wait)

    def curve(self, trial: Trial) -> tuple[Array, Array]:
        """Rudder [rad] and steady yaw rate [rad/s] of each turn, in the order they were made.

        Raises:
            DataError: rudder or heading is absent.
        """
        name = rudder_channel(trial)
        run = complete_rows(trial, (name, "psi"))
        found = holds(run.t, run[name], _HELD * min(self.fine, self.step), self.window)
        ends = [last_seconds(run.t, part, self.window) for part in found]
        r = yaw_rate(run)
        return (np.array([float(np.mean(run[name][part])) for part in ends]),
                np.array([float(np.nanmean(r[part])) for part in ends]))  # fmt: skip

    def complete(self, trial: Trial) -> bool:
        """Whether the rudder is back at its first angle and the ship in a steady turn there."""
        name = rudder_channel(trial)
        run = complete_rows(trial, (name, "psi"))
        last = holds(run.t, run[name], _HELD * min(self.fine, self.step), self.window)[-1:]
        delta, _ = self.curve(trial)
        if not last or delta.size < 3:
            return False
        began, ended = self.side * delta[0], self.side * delta[-1]
        there_and_back = float(np.min(self.side * delta)) < -0.9 * began and ended > 0.98 * began
        return bool(there_and_back and run.t[-1] - run.t[last[0].start] >= _LAST * self.window)

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Loop width and neutral rudder [rad], loop height and rates at the greatest rudder [rad/s].

        The loop is as wide as the two angles at which the ship changes its side of turning, going
        down and coming up, lie apart; zero (to the creep of the steady turns) where they are one.
        A ship that jumps does so anywhere between two angles: `resolution` is the greater of the two
        increments, which is that of `step` where the loop reaches beyond `near`.  The height is the
        difference between the yaw rates at rudder midships.  A figure whose part of the curve the
        run does not hold is left out.
        """
        delta, r = self.curve(trial)
        if delta.size < 3:
            return {}
        out = {"steady_rate_starboard": Index(float(r[np.argmax(delta)]), _RATE),
               "steady_rate_port": Index(float(r[np.argmin(delta)]), _RATE)}  # fmt: skip
        turn = int(np.argmin(self.side * delta))
        down, up = slice(0, turn + 1), slice(turn, None)
        crossings = [_crossing(r[part], delta[part]) for part in (down, up)]
        midships = [_crossing(delta[part], r[part]) for part in (down, up)]
        if None not in crossings:
            a, b = (float(x) for x in crossings if x is not None)
            width, apart = self.side * (b - a), max(_increment(r[part], delta[part]) for part in (down, up))
            out |= {"loop_width": Index(max(width, 0.0), "rad", helm=1, resolution=apart),
                    "neutral_rudder": Index(0.5 * (a + b), "rad", helm=1, resolution=apart),
                    "resolution": Index(apart, "rad", helm=1)}  # fmt: skip
        if None not in midships:
            a, b = (float(x) for x in midships if x is not None)
            out["loop_height"] = Index(self.side * (a - b), _RATE)
        return out


def _increment(through: Array, values: Array) -> float:
    """How far apart the values are between which `through` first changes its sign."""
    i = int(np.argmax(np.signbit(through[1:]) != np.signbit(through[:-1])))
    return abs(float(values[i + 1] - values[i]))


def _crossing(through: Array, values: Array) -> float | None:
    """Value where `through` first changes its sign, linear between the points; None where it does not."""
    if np.any(through == 0.0):
        return float(values[int(np.argmax(through == 0.0))])
    changes = np.flatnonzero(np.signbit(through[1:]) != np.signbit(through[:-1]))
    if not changes.size:
        return None
    i = int(changes[0])
    share = through[i] / (through[i] - through[i + 1])
    return float(values[i] + share * (values[i + 1] - values[i]))
