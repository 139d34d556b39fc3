"""Initial turning ability: how far the ship goes until a small rudder has changed its heading.

IMO MSC.137(76) 5.3.2 asks for a heading change of 10 deg under 10 deg of rudder within 2.5 ship
lengths of way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import Scalar, Scalars, spec
from ..core.values import dataclass
from ..data import Trial
from . import Index, Manoeuvre, Settings
from .reading import after, at, in_lengths, path_length, reached, track, turned

_TEN = math.radians(10.0)


@dataclass(frozen=True)
class InitialTurning(Manoeuvre):
    """Rudder to `delta` and held until the heading has changed by `psi`, both magnitudes."""

    kind: ClassVar[str] = "initial-turning"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "heading", "side")

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    delta: Scalar = spec("rad", "rudder angle, magnitude", (0.0, math.pi))
    psi: Scalar = spec("rad", "heading change, magnitude", (0.0, 2.0 * math.pi))
    side: Scalar = spec("-", "+1 starboard, -1 port", (-1.0, 1.0), default=1.0)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """10 deg of rudder to starboard until 10 deg of heading by default."""
        return cls(settings.n_P, settings.rudder_or(_TEN), settings.heading_or(_TEN), settings.side)

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        return (self.n_P, self.side * self.delta), memory

    def complete(self, trial: Trial) -> bool:
        """Whether the heading has changed by `psi`."""
        change = self.side * turned(after(trial, self.side * self.delta))
        return bool(change.size and np.max(change) >= self.psi)

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Time [s], way along the track, advance and transfer [m] to the heading change; quality [-].

        `turning_quality` is Norrbin's P: heading change over rudder angle after one ship length of
        way.  A figure that the run does not reach is left out.
        """
        run = after(trial, self.side * self.delta)
        change, way = self.side * turned(run), path_length(run)
        out: dict[str, Index] = {}
        one_length, moment = reached(way, L_pp), reached(change, self.psi)
        if one_length is not None:
            out["turning_quality"] = Index(at(change, one_length) / self.delta, "-", helm=-1)
        if moment is None:
            return out
        out = {"initial_turning_time": Index(at(run.t, moment) - float(run.t[0]), "s"),
               "initial_turning_distance": in_lengths(at(way, moment), L_pp), **out}  # fmt: skip
        if "x" in run and "y" in run:
            along, across = track(run)
            out["advance"] = in_lengths(at(along, moment), L_pp)
            out["transfer"] = in_lengths(self.side * at(across, moment), L_pp)
        return out
