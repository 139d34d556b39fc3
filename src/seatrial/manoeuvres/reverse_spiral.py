"""The reverse spiral (Bech): yaw rates are held one after another, and the mean rudder is recorded.

Feedback holds turns that a ship unstable on course would not keep by itself, so the whole curve of
rudder over yaw rate shows, its falling middle included (IMO MSC/Circ.1053 appendix; ITTC 7.5-04-02-01).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import clip, where
from ..core.values import dataclass
from ..data import Array, Trial
from . import Index, Manoeuvre, Settings
from .reading import complete_rows, holds, last_seconds, rudder_channel, yaw_rate
from .steady import MEMORY, WINDOW, waited

# A yaw rate within this fraction of the increment is still held.
_HELD = 0.3
# Non-dimensional set points and gains: r L/U from 0.2 in steps of 0.025; rudder over r L/U, and over its
# integral, such that ships of K' = 0.5 to 5 answer within a few L/U and do not ring.
_RATE, _STEP, _GAIN, _INTEGRAL = 0.2, 0.025, 4.0, 2.0
# Tighter than in a spiral: the speed settles slowly, and the rudder that holds a yaw rate creeps with it.
_TOLERANCE = 2e-5
# Windows for which the last yaw rate must have been held.
_LAST = 6.0


@dataclass(frozen=True)
class ReverseSpiral(Manoeuvre):
    """Yaw rate from `rate` on one side to `rate` on the other, held by the rudder, a step per steady turn."""

    kind: ClassVar[str] = "reverse-spiral"
    takes: ClassVar[tuple[str, ...]] = ("side",)
    memory: ClassVar[tuple[str, ...]] = ("target", "held", "then", *MEMORY)

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    rate: Scalar = spec("rad/s", "greatest yaw rate, magnitude", (0.0, math.inf))
    step: Scalar = spec("rad/s", "increment of the yaw rate", (0.0, math.inf))
    window: Scalar = spec("s", "time over which a steady turn is judged", (0.0, math.inf))
    tolerance: Scalar = spec("rad/s", "change within the window of a steady turn", (0.0, math.inf))
    k_P: Scalar = spec("s", "rudder per yaw rate that is missing", (0.0, math.inf))
    k_I: Scalar = spec("-", "rudder per heading that is missing", (0.0, math.inf))
    limit: Scalar = spec("rad", "greatest rudder angle", (0.0, math.pi))
    side: Scalar = spec("-", "first side: +1 starboard, -1 port", (-1.0, 1.0), default=1.0)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """From r L/U = 0.2 to starboard by default."""
        clock = settings.clock
        return cls(
            settings.n_P, _RATE / clock, _STEP / clock, WINDOW * clock, _TOLERANCE / clock, _GAIN * clock, _INTEGRAL,
            min(settings.rudder_limit, 0.5 * math.pi), settings.side,
        )  # fmt: skip

    def begin(self, state: Scalars) -> Scalars:
        """The first yaw rate [rad/s], no rudder held yet [rad], and the time [s]."""
        return (self.side * self.rate, 0.0, 0.0, 0.0, state[5], 0.0)

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad] of the feedback; the next yaw rate once the turn is steady."""
        target, held, then = memory[:3]
        missing = target - state[5]
        held = clip(held + self.k_I * missing * (t - then), -self.limit, self.limit)
        delta = clip(held + self.k_P * missing, -self.limit, self.limit)
        # Judged by yaw rate and rudder at once, the rudder as the yaw rate that k_P makes of it.
        steady, wait = waited(t, state[5] + delta / self.k_P, memory[3:], self.window, self.tolerance)
        further = clip(target - self.side * self.step, -self.rate, self.rate)
        return (self.n_P, delta), (where(steady, further, target), held, t, *wait)

    def curve(self, trial: Trial) -> tuple[Array, Array]:
        """Mean rudder [rad] and yaw rate [rad/s] of each turn, in the order they were made.

        Raises:
            DataError: rudder or heading is absent.
        """
        name = rudder_channel(trial)
        run = complete_rows(trial, (name, "psi"))
        r = yaw_rate(run)
        found = holds(run.t, r, _HELD * self.step, 2.0 * self.window)
        # The last window of a hold may reach into the next one: the rudder moves before the ship does.
        ends = [last_seconds(run.t, part, self.window, before=self.window) for part in found]
        return (np.array([float(np.mean(run[name][part])) for part in ends]),
                np.array([float(np.mean(r[part])) for part in ends]))  # fmt: skip

    def complete(self, trial: Trial) -> bool:
        """Whether the last yaw rate on the other side was held."""
        run = complete_rows(trial, (rudder_channel(trial), "psi"))
        there = np.flatnonzero(np.abs(self.side * yaw_rate(run) + self.rate) > _HELD * self.step)
        first = int(there[-1]) + 1 if there.size else 0
        return bool(first < len(run) and run.t[-1] - run.t[first] >= _LAST * self.window)

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Loop width and neutral rudder [rad], slope at r = 0 [s], loop height [rad/s].

        The slope is that of the rudder over the yaw rate: negative where the ship is unstable on
        course.  The loop of a direct spiral is as wide as the rudder falls while the yaw rate rises,
        from one turning point of the curve to the other, and as high as the outer of the yaw rates
        with the rudder midships lie apart; both are zero where the curve only climbs.  A figure whose
        part of the curve the run does not hold is left out.
        """
        delta, r = self.curve(trial)
        order = np.argsort(r)
        delta, r = delta[order], r[order]
        if r.size < 3 or r[0] > 0 or r[-1] < 0:
            return {}
        middle = int(np.clip(np.argmin(np.abs(r)), 1, r.size - 2))
        slope = float((delta[middle + 1] - delta[middle - 1]) / (r[middle + 1] - r[middle - 1]))
        out = {"neutral_rudder": Index(float(np.interp(0.0, r, delta)), "rad", helm=1),
               "slope": Index(slope, "s", helm=1)}  # fmt: skip
        # The points between which the rudder falls furthest; one point twice where it only climbs.
        bottom = int(np.argmax(np.maximum.accumulate(delta) - delta))
        top = int(np.argmax(delta[: bottom + 1]))
        width = _turning_point(r, delta, top) - _turning_point(r, delta, bottom) if bottom > top else 0.0
        out["loop_width"] = Index(width, "rad", helm=1)
        through = np.flatnonzero(np.signbit(delta[:-1]) != np.signbit(delta[1:]))
        if delta[0] < 0 < delta[-1] and (through.size >= 3 or width == 0.0):
            low, high = (_midships(delta, r, int(k)) for k in through[[0, -1]])
            out["loop_height"] = Index(high - low, "rad/s")
        return out


def _turning_point(r: Array, delta: Array, k: int) -> float:
    """Rudder at the top or bottom of the curve at point `k`, by the parabola through it and its neighbours [rad]."""
    if not 0 < k < r.size - 1:
        return float(delta[k])
    a, b, c = np.polyfit(r[k - 1 : k + 2] - r[k], delta[k - 1 : k + 2], 2)
    return float(c - b * b / (4.0 * a)) if a else float(delta[k])


def _midships(delta: Array, r: Array, k: int) -> float:
    """Yaw rate at which the rudder passes midships between two points of the curve [rad/s]."""
    return float(r[k] - delta[k] * (r[k + 1] - r[k]) / (delta[k + 1] - delta[k]))
