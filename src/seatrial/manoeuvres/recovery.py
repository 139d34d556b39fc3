"""Turns back to one's own track: shared policy and figures (IAMSAR Manual volume III: person overboard)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import both, clip, where
from ..core.values import dataclass
from ..data import Trial
from . import Index, Manoeuvre, Settings
from .reading import after, in_lengths, track, turned

_DEGREE, TURN = math.radians(1.0), 2.0 * math.pi
GAIN, DAMPING, SLOW = 1.0, 2.0, 0.05
"""Steering on the reciprocal course: rudder per heading, per r L/U; r L/U at which a free swing is over."""

# Heading error within which a ship counts as on the reciprocal course, and for what share of the run so far.
_ON_COURSE, _KEPT = math.radians(2.0), 0.1


def staged(
    change: Scalar, rate: Scalar, stage: Scalar, swing: Scalar, goal: Scalar, short: Scalar, slow: Scalar
) -> Scalar:
    """The stage that follows from the heading change and its rate, both positive to the first side.

    Args:
        swing: heading change at which the rudder goes to the other side [rad].
        goal: heading change on the reciprocal course, half a turn to either side [rad].
        short: heading that is left when the rudder goes midships [rad].
        slow: rate of the free swing at which it counts as over [rad/s].
    """
    stage = where(both(stage < 0.5, change >= swing), 1.0, stage)
    stage = where(both(both(stage > 0.5, stage < 1.5), change <= goal + short), 2.0, stage)
    over = where(change <= goal, 1.0, where(rate >= -slow, 1.0, 0.0))
    return where(both(both(stage > 1.5, stage < 2.5), over > 0.5), 3.0, stage)


def rudder(stage: Scalar, error: Scalar, rate: Scalar, delta: Scalar, k_P: Scalar, k_D: Scalar) -> Scalar:
    """Rudder towards the first side [rad]: hard over, hard over against it, midships, then steered.

    Args:
        error: heading that is missing to the reciprocal course [rad].
        rate: rate of the heading change [rad/s].
    """
    steered = clip(k_P * error - k_D * rate, -delta, delta)
    return where(stage < 0.5, delta, where(stage < 1.5, -delta, where(stage < 2.5, 0.0, steered)))


def on_course(run: Trial, side: float, goal: float) -> int | None:
    """Row from which the ship stays on the reciprocal course; None where it does not."""
    off = np.flatnonzero(np.abs(side * turned(run) - goal) > _ON_COURSE)
    row = int(off[-1]) + 1 if off.size else 0
    return row if row < len(run) else None


def miss(run: Trial, side: float, swing: float, L_pp: float) -> dict[str, Index]:
    """Least distance to the execute point on the way back, after the heading has changed by `swing`."""
    back = np.flatnonzero(side * turned(run) >= swing)
    if not back.size:
        return {}
    distance = np.hypot(*track(run))[int(back[0]) :]
    nearest = int(np.nanargmin(distance))
    return {"miss_distance": in_lengths(float(distance[nearest]), L_pp),
            "miss_time": Index(float(run.t[int(back[0]) + nearest] - run.t[0]), "s")}  # fmt: skip


@dataclass(frozen=True)
class Recovery(Manoeuvre):
    """Rudder `delta` to `side`, against it from a heading change of `swing` on, until the course is reciprocal.

    Attributes:
        goal: heading change to the reciprocal course, positive to the first side [rad].
        usual_swing: heading change at which the rudder is usually reversed [rad].
    """

    takes: ClassVar[tuple[str, ...]] = ("rudder", "heading", "side")
    memory: ClassVar[tuple[str, ...]] = ("stage", "psi_0")
    """0 first rudder, 1 opposite rudder, 2 midships, 3 steered; heading at the execute [rad]."""
    goal: ClassVar[float]
    usual_swing: ClassVar[float]

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    delta: Scalar = spec("rad", "rudder hard over, magnitude", (0.0, math.pi))
    k_D: Scalar = spec("s", "rudder per yaw rate on the reciprocal course", (0.0, math.inf))
    slow: Scalar = spec("rad/s", "yaw rate at which the free swing is over", (0.0, math.inf))
    swing: Scalar = spec("rad", "heading change at which the rudder is reversed", (0.0, TURN))
    short: Scalar = spec("rad", "heading left when the rudder goes midships", (0.0, math.pi), 20.0 * _DEGREE)
    k_P: Scalar = spec("-", "rudder per heading error on the reciprocal course", (0.0, math.inf), GAIN)
    side: Scalar = spec("-", "first side: +1 starboard, -1 port", (-1.0, 1.0), default=1.0)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """35 deg, to starboard first, reversed after the usual swing by default."""
        hard_over = settings.rudder_or(35.0 * _DEGREE)
        swing = settings.heading_or(cls.usual_swing)
        return cls(settings.n_P, hard_over, DAMPING * settings.clock, SLOW / settings.clock, swing, side=settings.side)

    def begin(self, state: Scalars) -> Scalars:
        """The first stage, and the heading at execute [rad]."""
        return (0.0, state[2])

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad] of the stage that the heading has come to."""
        change, rate = self.side * (state[2] - memory[1]), self.side * state[5]
        stage = staged(change, rate, memory[0], self.swing, self.goal, self.short, self.slow)
        order = rudder(stage, self.goal - change, rate, self.delta, self.k_P, self.k_D)
        return (self.n_P, self.side * order), (stage, memory[1])

    def complete(self, trial: Trial) -> bool:
        """Whether the ship is back on the reciprocal course and has kept it for a while."""
        run = after(trial, self.side * self.delta)
        row = on_course(run, self.side, self.goal)
        return row is not None and bool(run.t[-1] - run.t[row] >= _KEPT * (run.t[row] - run.t[0]))

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Time [s] to the reciprocal course (within 2 deg for good) and where the ship is then [m].

        `lateral_offset` is the distance from the original track line, positive to the first side,
        `along_track` that ahead of the execute point; `miss_distance` the least distance to the execute
        point on the way back, at `miss_time`.
        """
        run = after(trial, self.side * self.delta)
        along, across = track(run)
        across = self.side * across
        furthest = float(across[int(np.nanargmax(np.abs(across)))])
        out = {"greatest_advance": in_lengths(float(np.nanmax(along)), L_pp),
               "greatest_transfer": in_lengths(furthest, L_pp)}  # fmt: skip
        row = on_course(run, self.side, self.goal)
        if row is not None:
            out["time_to_reciprocal"] = Index(float(run.t[row] - run.t[0]), "s")
            out["lateral_offset"] = in_lengths(float(across[row]), L_pp)
            out["along_track"] = in_lengths(float(along[row]), L_pp)
        return {**out, **miss(run, self.side, self.swing, L_pp)}
