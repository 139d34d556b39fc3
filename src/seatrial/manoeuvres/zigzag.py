"""The zigzag delta/psi: the rudder is reversed whenever the heading has changed by psi.

Overshoot is the heading beyond that at a reversal; times count from the first execute
(ITTC 7.5-04-02-01, IMO MSC.137(76)).  A run that is steered by samples reverses up to one of them
late: counted from the set heading its overshoots would be too large by what the ship turns in that
time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import where
from ..core.values import dataclass
from ..data import Array, Trial
from . import Index, Manoeuvre, Settings
from .heel import either_way
from .reading import after, at, helm_channel, in_lengths, path_length, reached, turned

_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth")
# First and second overshoot (IMO) and one more, by which a limit cycle is told from a decay.
_NEEDED = 3
# The heading must have come back by this fraction of psi before a peak counts as an overshoot.
_BACK = 0.1
# A rudder within this fraction of delta has not moved.
_STILL = 1e-6


@dataclass(frozen=True)
class Zigzag(Manoeuvre):
    """Zigzag with rudder `delta` and heading change `psi`, both magnitudes; `side` is the first."""

    kind: ClassVar[str] = "zigzag"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "heading", "side")
    memory: ClassVar[tuple[str, ...]] = ("side", "psi_0")

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    delta: Scalar = spec("rad", "rudder angle, magnitude", (0.0, math.pi))
    psi: Scalar = spec("rad", "heading change at which the rudder is reversed, magnitude", (0.0, math.pi))
    side: Scalar = spec("-", "first side: +1 starboard, -1 port", (-1.0, 1.0), default=1.0)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """10/10 to starboard first by default; the modified zigzags take another heading."""
        ten = math.radians(10.0)
        return cls(settings.n_P, settings.rudder_or(ten), settings.heading_or(ten), settings.side)

    def begin(self, state: Scalars) -> Scalars:
        """The first side, and the heading at execute [rad]."""
        return (self.side, state[2])

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad]; reversed at the first sample at or beyond psi."""
        side, psi_0 = memory
        side = where(side * (state[2] - psi_0) >= self.psi, -side, side)
        return (self.n_P, side * self.delta), (side, psi_0)

    def complete(self, trial: Trial) -> bool:
        """Whether three overshoots are over, that is, the fourth execute has done its work."""
        run = after(trial, self.side * self.delta)
        heading = self.side * turned(run)
        return len(self._overshoots(run, heading, self._reversals(run, heading))) >= _NEEDED

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Overshoots [rad], executes, initial turning and period [s], initial turning distance [m], heel [rad].

        `first_overshoot` follows the first reversal, which is the second execute.  `period` runs
        from the first execute to the third: rudder out, over, and out again.  `first_reversal` and
        so on are times since the first execute; a measured run without `delta_cmd` shows them where
        its heading first passes psi.  Initial turning is from the first execute until the heading
        has changed by psi, time and distance along the track.
        """
        run = after(trial, self.side * self.delta)
        heading = self.side * turned(run)
        reversals = self._reversals(run, heading)
        peaks = self._overshoots(run, heading, reversals)
        times = [float(run.t[i] - run.t[0]) for i in reversals]
        out = {f"{name}_overshoot": Index(peak, "rad") for name, peak in zip(_ORDINALS, peaks, strict=False)}
        out |= {f"{name}_reversal": Index(t, "s") for name, t in zip(_ORDINALS, times, strict=False)}
        if len(times) > 1:
            out["period"] = Index(times[1], "s")
        return {**out, **self._initial(run, heading, L_pp), **either_way(run)}

    def _initial(self, run: Trial, heading: Array, L_pp: float) -> dict[str, Index]:
        moment = reached(heading, self.psi)
        if moment is None:
            return {}
        out = {"initial_turning_time": Index(at(run.t, moment) - float(run.t[0]), "s")}
        if "x" in run and "y" in run:
            out["initial_turning_distance"] = in_lengths(at(path_length(run), moment), L_pp)
        return out

    def _reversals(self, run: Trial, heading: Array) -> list[int]:
        """Rows of the reversals: by the order where there is one, else by the heading.

        A measured rudder angle ramps, lags and is noisy; the heading passes psi cleanly.
        """
        if "delta_cmd" in run:
            return _alternations(self.side * run["delta_cmd"], 0.5 * self.delta, -1.0)
        return _alternations(heading, self.psi, 1.0)

    def _overshoots(self, run: Trial, heading: Array, reversals: list[int]) -> list[float]:
        """Heading beyond that at each reversal, as far as the swing is over [rad]."""
        peaks: list[float] = []
        side = 1.0
        for i, row in enumerate(reversals):
            stop = reversals[i + 1] if i + 1 < len(reversals) else heading.size
            swing = side * heading[row:stop]
            peak = float(np.max(swing))
            if stop == heading.size and peak - swing[-1] < _BACK * self.psi:
                break
            peaks.append(peak - (float(swing[0]) if self._executed(run, row, side) else self.psi))
            side = -side
        return peaks

    def _executed(self, run: Trial, row: int, side: float) -> bool:
        """Whether the order is given at its row, which a log of few rows shows later than it was.

        The rudder then goes on to its old side up to that row, or jumps there from side to side.
        """
        if "delta_cmd" not in run or row == 0:
            return False
        before, now = (side * self.side * run[helm_channel(run)][row - 1 : row + 1]).tolist()
        edge = _STILL * self.delta
        return bool(now >= before - edge or (before >= self.delta - edge and now <= edge - self.delta))


def _alternations(values: Array, level: float, side: float) -> list[int]:
    """Rows at which `values` first comes up to `level` on one side, then on the other, and so on."""
    rows: list[int] = []
    row = 0
    while True:
        beyond = np.flatnonzero(side * values[row:] >= level)
        if not beyond.size:
            return rows
        row += int(beyond[0])
        rows.append(row)
        side = -side
