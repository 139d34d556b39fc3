"""Track reach, head reach and lateral deviation of a stop, of a coasting ship and by the engine astern."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ...core.parameters import Scalar, Scalars
from ...core.symbolic import both, cos, sin, where
from ...core.values import dataclass
from ...data import Array
from ...manoeuvres.stopping import CrashAstern, Stopping
from . import NEVER, Tally, Truth, way

_NOTED = ("x_0", "y_0", "psi_0", "u_0", "x", "y", "psi", "u", "way", "time", "reach", "ahead", "aside", "change")
_FIGURES = {
    "track_reach": "m", "head_reach": "m", "lateral_deviation": "m", "stopping_time": "s", "heading_change": "rad",
}  # fmt: skip


@dataclass(frozen=True)
class _Halt(Tally):
    """A stop that notes where the speed ahead comes down to the fraction `end` of the first one."""

    noted: ClassVar[tuple[str, ...]] = _NOTED
    figures: ClassVar[Mapping[str, str]] = _FIGURES

    def first(self, state: Scalars) -> Scalars:
        x, y, psi, u = state[:4]
        return (x, y, psi, u, x, y, psi, u, 0.0, NEVER, 0.0, 0.0, 0.0, 0.0)

    def note(
        self, t: Scalar, state: Scalars, turned: tuple[Scalars, Scalars], noted: Scalars, valid: Scalar
    ) -> Scalars:
        x_0, y_0, psi_0, u_0, x, y, psi, u, gone, time, reach, ahead, aside, change = noted
        level: Scalar = self._end() * u_0
        now = both(both(valid, both(time < 0, u_0 > 0)), state[3] <= level)
        share = (u - level) / where(now, u - state[3], 1.0)
        chord, c, s = way(x, y, state), cos(psi_0), sin(psi_0)
        north = x + share * (state[0] - x) - x_0
        east = y + share * (state[1] - y) - y_0
        return (
            x_0, y_0, psi_0, u_0, *state[:4], gone + chord,
            where(now, t - self.dt + share * self.dt, time), where(now, gone + share * chord, reach),
            where(now, c * north + s * east, ahead), where(now, c * east - s * north, aside),
            where(now, psi + share * (state[2] - psi) - psi_0, change),
        )  # fmt: skip

    def _end(self) -> Scalar:
        return vars(self)["end"]

    def read(self, noted: Mapping[str, Array], varied: Mapping[str, Array]) -> Mapping[str, Array]:
        there = noted["time"] >= 0
        own = ("reach", "ahead", "aside", "time", "change")
        return {name: np.where(there, noted[at], np.nan) for name, at in zip(_FIGURES, own, strict=True)}

    def finished(self, noted: Mapping[str, Array], varied: Mapping[str, Array]) -> Truth:
        return noted["time"] >= 0


@dataclass(frozen=True)
class StoppingTally(_Halt, Stopping):
    """Engine stopped."""

    memory: ClassVar[tuple[str, ...]] = (*Stopping.memory, "failed", *_NOTED)


@dataclass(frozen=True)
class CrashAsternTally(_Halt, CrashAstern):
    """Engine reversed; the speed of the approach stands twice in the memory, as the manoeuvre's own and the tally's."""

    memory: ClassVar[tuple[str, ...]] = (*CrashAstern.memory, "failed", *(f"noted_{name}" for name in _NOTED))
