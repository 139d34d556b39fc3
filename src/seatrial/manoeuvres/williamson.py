"""The Williamson turn: back on the own track by a swing to one side and a turn to the other.

Rudder hard over; after 60 deg hard over to the other side; 20 deg short of the reciprocal course
midships; then the ship is steered on that course (IAMSAR Manual volume III).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

from ..data import Trial
from ..parameters import Scalar, spec
from . import Index, Settings
from .recovery import MEMORY, returned, rudder, staged, way_back
from .steady import pace

_DEGREE = math.radians(1.0)
GAIN, DAMPING, SLOW = 1.0, 2.0, 0.05
"""Steering on the reciprocal course: rudder per heading, per r L/U; r L/U at which a free swing is over."""


@dataclass(frozen=True)
class Williamson:
    """Rudder `delta` to `side`, against it from a heading change of `swing` on, and back the other way round."""

    kind: ClassVar[str] = "williamson"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "heading", "side")
    memory: ClassVar[tuple[str, ...]] = MEMORY

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    delta: Scalar = spec("rad", "rudder hard over, magnitude", (0.0, math.pi))
    k_D: Scalar = spec("s", "rudder per yaw rate on the reciprocal course", (0.0, math.inf))
    slow: Scalar = spec("rad/s", "yaw rate at which the free swing is over", (0.0, math.inf))
    swing: Scalar = spec("rad", "heading change at which the rudder is reversed", (0.0, math.inf), 60.0 * _DEGREE)
    short: Scalar = spec("rad", "heading left when the rudder goes midships", (0.0, math.pi), 20.0 * _DEGREE)
    k_P: Scalar = spec("-", "rudder per heading error on the reciprocal course", (0.0, math.inf), GAIN)
    side: Scalar = spec("-", "first side: +1 starboard, -1 port", (-1.0, 1.0), default=1.0)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """35 deg, to starboard first, reversed after 60 deg, unless told otherwise."""
        clock, hard_over = pace(settings), settings.rudder_or(35.0 * _DEGREE)
        swing = settings.heading_or(60.0 * _DEGREE)
        return cls(settings.n_P, hard_over, DAMPING * clock, SLOW / clock, swing, side=settings.side)

    def begin(self, state: tuple[Scalar, ...]) -> tuple[Scalar, ...]:
        """The first stage, and the heading at execute [rad]."""
        return (0.0, state[2])

    def command(
        self, t: Scalar, state: tuple[Scalar, ...], memory: tuple[Scalar, ...]
    ) -> tuple[tuple[Scalar, ...], tuple[Scalar, ...]]:
        """Revolutions [1/s] and rudder [rad] of the stage that the heading has come to."""
        change, rate = self.side * (state[2] - memory[1]), self.side * state[5]
        stage = staged(change, rate, memory[0], self.swing, -math.pi, self.short, self.slow)
        order = rudder(stage, -math.pi - change, rate, self.delta, self.k_P, self.k_D)
        return (self.n_P, self.side * order), (stage, memory[1])

    def complete(self, trial: Trial) -> bool:
        """Whether the ship keeps the reciprocal course."""
        return returned(trial, self.delta, self.side, -math.pi)

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Time [s] to the reciprocal course (within 2 deg for good) and where the ship is then [m].

        `lateral_offset` is the distance from the original track line, positive to the first side,
        `along_track` that ahead of the execute point; `miss_distance` the least distance to the execute
        point on the way back, at `miss_time`.

        Raises:
            DataError: the rudder never leaves its initial angle, or position or heading is absent.
        """
        return way_back(trial, self.delta, self.side, -math.pi, self.swing, L_pp)
