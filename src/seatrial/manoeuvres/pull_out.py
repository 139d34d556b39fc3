"""The pull-out: rudder midships out of a steady turn, to one side and then to the other.

A ship that is stable on course stops turning; an unstable one keeps turning, and differently after a turn
to port than after one to starboard (IMO MSC/Circ.1053 appendix; ITTC 7.5-04-02-01).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import smaller, where
from ..core.values import dataclass
from ..data import Trial
from . import Index, Manoeuvre, Settings
from .reading import complete_rows, holds, last_seconds, rudder_channel, yaw_rate
from .steady import MEMORY, TOLERANCE, WINDOW, waited

# A rudder within this fraction of the set angle of a hold belongs to it.
_HELD = 0.2
# Windows for which the rudder must have been midships, less what a running mean blurs.
_LAST = 2.9
_SIDES = {1.0: "starboard", -1.0: "port"}


@dataclass(frozen=True)
class PullOut(Manoeuvre):
    """A steady turn, rudder midships until the yaw rate is steady, then the same to the other side."""

    kind: ClassVar[str] = "pull-out"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "side")
    memory: ClassVar[tuple[str, ...]] = ("stage", *MEMORY)

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    delta: Scalar = spec("rad", "rudder angle of the turns, magnitude", (0.0, math.pi))
    window: Scalar = spec("s", "time over which a steady yaw rate is judged", (0.0, math.inf))
    tolerance: Scalar = spec("rad/s", "change of a steady yaw rate within the window", (0.0, math.inf))
    side: Scalar = spec("-", "first side: +1 starboard, -1 port", (-1.0, 1.0), default=1.0)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """20 deg, to starboard first by default."""
        turn = settings.rudder_or(math.radians(20.0))
        return cls(settings.n_P, turn, WINDOW * settings.clock, TOLERANCE / settings.clock, settings.side)

    def begin(self, state: Scalars) -> Scalars:
        """The first of the four stages: turn, midships, turn, midships."""
        return (0.0, 0.0, state[5], 0.0)

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad]; the next stage once the yaw rate is steady."""
        steady, wait = waited(t, state[5], memory[1:], self.window, self.tolerance)
        stage = where(steady, smaller(memory[0] + 1.0, 3.0), memory[0])
        rudder = where(stage < 0.5, self.delta, where(stage < 1.5, 0.0, where(stage < 2.5, -self.delta, 0.0)))
        return (self.n_P, self.side * rudder), (stage, *wait)

    def complete(self, trial: Trial) -> bool:
        """Whether the yaw rate has become steady after a turn to either side."""
        found = self._midships(trial)
        return len(found) == 2 and all(long for _, long in found.values())

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Residual yaw rate after a turn to starboard and to port, and their difference [rad/s].

        Positive rates turn to starboard.  The difference is zero for a ship that is stable on course.
        A side that the run does not hold is left out.
        """
        found = {side: rate for side, (rate, _) in self._midships(trial).items()}
        out = {f"residual_rate_{_SIDES[side]}": Index(rate, "rad/s") for side, rate in found.items()}
        if len(found) == 2:
            out["residual_difference"] = Index(found[1.0] - found[-1.0], "rad/s")
        return out

    def _midships(self, trial: Trial) -> dict[float, tuple[float, bool]]:
        """By side of the turn before: mean yaw rate at the end of each stretch midships, and if it was long."""
        name = rudder_channel(trial)
        run = complete_rows(trial, (name, "psi"))
        rudder, r = run[name], yaw_rate(run)
        turning, found = 0.0, dict[float, tuple[float, bool]]()
        for part in holds(run.t, rudder, _HELD * self.delta, self.window):
            angle = float(np.mean(rudder[part]))
            if abs(angle) > 0.5 * self.delta:
                turning = math.copysign(1.0, angle)
            elif turning:
                lasted = float(run.t[part.stop - 1] - run.t[part.start])
                end = last_seconds(run.t, part, self.window)
                found[turning] = (float(np.mean(r[end])), lasted >= _LAST * self.window)
                turning = 0.0
        return found
