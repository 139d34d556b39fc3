"""Advance, transfer and tactical diameter of a turning circle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ...core.parameters import Scalar, Scalars
from ...core.symbolic import both, cos, larger, sign, sin, where
from ...core.values import dataclass
from ...data import Array
from ...manoeuvres.turning import Turning
from . import NEVER, Tally, Truth, passed

_QUARTER = 0.5 * math.pi
_COMPLETE = 3.0 * math.pi


@dataclass(frozen=True)
class TurningTally(Tally, Turning):
    """A turning circle that notes where the heading has changed by 90 and 180 degrees.

    Its steady part (diameter, speed loss, drift) is that of the last quarter of the whole run: `indices` of the stored
    run has it.
    """

    noted: ClassVar[tuple[str, ...]] = (
        "x_0", "y_0", "psi_0", "change", "along", "across", "largest",
        "time_90", "advance", "transfer", "time_180", "tactical_diameter",
    )  # fmt: skip
    memory: ClassVar[tuple[str, ...]] = (*Turning.memory, "failed", *noted)
    figures: ClassVar[Mapping[str, str]] = {
        "advance": "m", "transfer": "m", "time_90": "s", "tactical_diameter": "m", "time_180": "s",
    }  # fmt: skip

    def first(self, state: Scalars) -> Scalars:
        return (state[0], state[1], state[2], *([0.0] * 4), NEVER, 0.0, 0.0, NEVER, 0.0)

    def note(
        self, t: Scalar, state: Scalars, turned: tuple[Scalars, Scalars], noted: Scalars, valid: Scalar
    ) -> Scalars:
        x_0, y_0, psi_0, change, along, across, largest, t_90, advance, transfer, t_180, diameter = noted
        side, c, s = sign(self.delta), cos(psi_0), sin(psi_0)
        now = side * (state[2] - psi_0)
        ahead = c * (state[0] - x_0) + s * (state[1] - y_0)
        aside = side * (c * (state[1] - y_0) - s * (state[0] - x_0))
        quarter, a = passed(both(valid, t_90 < 0), change, now, _QUARTER)
        half, b = passed(both(valid, t_180 < 0), change, now, 2.0 * _QUARTER)
        return (
            x_0, y_0, psi_0, now, ahead, aside, where(valid, larger(largest, now), largest),
            where(quarter, t - self.dt + a * self.dt, t_90), where(quarter, along + a * (ahead - along), advance),
            where(quarter, across + a * (aside - across), transfer),
            where(half, t - self.dt + b * self.dt, t_180), where(half, across + b * (aside - across), diameter),
        )  # fmt: skip

    def read(self, noted: Mapping[str, Array], varied: Mapping[str, Array]) -> Mapping[str, Array]:
        out: dict[str, Array] = {}
        for time, names in (("time_90", ("advance", "transfer")), ("time_180", ("tactical_diameter",))):
            there = noted[time] >= 0
            out |= {name: np.where(there, noted[name], np.nan) for name in (*names, time)}
        return out

    def finished(self, noted: Mapping[str, Array], varied: Mapping[str, Array]) -> Truth:
        return noted["largest"] >= _COMPLETE
