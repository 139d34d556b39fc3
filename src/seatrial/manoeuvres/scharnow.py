"""The Scharnow turn and the single turn: back into the own wake by turning one way round.

Scharnow: rudder hard over; after 240 deg hard over to the other side; 20 deg short of the reciprocal
course midships; then the ship is steered on that course.  Single turn (Anderson): hard over for
250 deg, then midships with the engine stopped (IAMSAR Manual volume III).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import larger, where
from ..core.values import dataclass
from ..data import Trial
from . import Index, Manoeuvre, Settings
from .reading import after, at, in_lengths, reached, track, turned
from .recovery import TURN, Recovery, miss

_DEGREE = math.radians(1.0)


@dataclass(frozen=True)
class Scharnow(Recovery):
    """Most of a circle to `side`, then against it until the course is reciprocal."""

    kind: ClassVar[str] = "scharnow"
    goal: ClassVar[float] = math.pi
    usual_swing: ClassVar[float] = math.radians(240.0)


@dataclass(frozen=True)
class SingleTurn(Manoeuvre):
    """Rudder `delta` to `side` for a heading change of `swing`, then midships and engine stopped."""

    kind: ClassVar[str] = "single-turn"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "heading", "side")
    memory: ClassVar[tuple[str, ...]] = ("over", "psi_0")

    n_P: Scalar = spec("1/s", "propeller revolutions until the turn is over")
    delta: Scalar = spec("rad", "rudder hard over, magnitude", (0.0, math.pi))
    swing: Scalar = spec("rad", "heading change at which the rudder goes midships", (0.0, TURN), 250.0 * _DEGREE)
    side: Scalar = spec("-", "+1 starboard, -1 port", (-1.0, 1.0), default=1.0)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """35 deg to starboard for 250 deg by default."""
        swing = settings.heading_or(250.0 * _DEGREE)
        return cls(settings.n_P, settings.rudder_or(35.0 * _DEGREE), swing, settings.side)

    def begin(self, state: Scalars) -> Scalars:
        """Whether the turn is over (0 or 1), and the heading at execute [rad]."""
        return (0.0, state[2])

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad]; neither from the set heading change on."""
        over = larger(memory[0], where(self.side * (state[2] - memory[1]) >= self.swing, 1.0, 0.0))
        return ((1.0 - over) * self.n_P, (1.0 - over) * self.side * self.delta), (over, memory[1])

    def complete(self, trial: Trial) -> bool:
        """Whether the set heading change was passed and the ship is as near to the execute point as it comes."""
        run = after(trial, self.side * self.delta)
        moment = reached(self.side * turned(run), self.swing)
        if moment is None:
            return False
        distance = np.hypot(*track(run))[int(moment) :]
        return int(np.nanargmin(distance)) < 0.9 * distance.size

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Time to the set heading change [s], where the ship is then, and its miss of the execute point [m]."""
        run = after(trial, self.side * self.delta)
        moment = reached(self.side * turned(run), self.swing)
        if moment is None:
            return {}
        along, across = track(run)
        return {
            "turning_time": Index(at(run.t, moment) - float(run.t[0]), "s"),
            "lateral_offset": in_lengths(self.side * at(across, moment), L_pp),
            "along_track": in_lengths(at(along, moment), L_pp),
            **miss(run, self.side, self.swing, L_pp),
        }
