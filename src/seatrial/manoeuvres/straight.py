"""The straight run: engine held, rudder midships; a speed run, and a test of what pulls the ship aside."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import Scalar, Scalars, spec
from ..core.values import dataclass
from ..data import Trial
from . import Index, Manoeuvre, Settings
from .reading import complete_rows, in_lengths, path_length, track, turned


@dataclass(frozen=True)
class Straight(Manoeuvre):
    """Constant revolutions and rudder."""

    kind: ClassVar[str] = "straight"
    timed: ClassVar[bool] = True  # whatever its length, it is whole

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    delta: Scalar = spec("rad", "rudder angle, held", (-math.pi, math.pi), default=0.0)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """Rudder midships."""
        return cls(settings.n_P)

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        return (self.n_P, self.delta), memory

    def complete(self, trial: Trial) -> bool:
        """Always: a straight run is as long as it is."""
        return len(trial) > 1

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Mean speed over ground [m/s], way [m], deviation from the initial course [m], heading change [rad].

        The mean speed is the distance between the ends over the time between them, as on a measured
        mile; deviation and heading change are positive to starboard, at the end of the run.
        """
        run = complete_rows(trial, ("x", "y", "psi"))
        along, across = track(run)
        made_good = float(np.hypot(along[-1], across[-1])) / run.duration
        return {
            "mean_speed": Index(made_good, "m/s"),
            "distance": in_lengths(float(path_length(run)[-1]), L_pp),
            "lateral_deviation": in_lengths(float(across[-1]), L_pp),
            "heading_change": Index(float(turned(run)[-1]), "rad"),
        }
