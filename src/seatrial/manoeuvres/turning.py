"""The turning circle: rudder hard over from a straight run, and the figures of the circle.

All lengths are measured from the execute point, along and across the heading *at execute*, so that
a drift during the approach does not enter (IMO MSC.137(76), MSC/Circ.1053).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import Scalar, Scalars, spec
from ..core.values import dataclass
from ..data import Array, Trial
from . import Index, Manoeuvre, Settings
from .heel import in_turn
from .reading import after, at, in_lengths, reached, through_water, track, turned

_QUARTER = 0.5 * math.pi
# The steady part is read off the last quarter turn of a run that went round at least once.
_STEADY_AFTER = 2.0 * math.pi
_COMPLETE = 3.0 * math.pi


@dataclass(frozen=True)
class Turning(Manoeuvre):
    """Rudder over at t = 0 and held there; the sign of `delta` is the side."""

    kind: ClassVar[str] = "turning"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "side")

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    delta: Scalar = spec("rad", "rudder angle, positive to starboard", (-math.pi, math.pi))

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """35 deg to starboard by default."""
        return cls(settings.n_P, settings.side * settings.rudder_or(math.radians(35.0)))

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        return (self.n_P, self.delta), memory

    def complete(self, trial: Trial) -> bool:
        """Whether the heading has changed by 540 deg or more since the execute."""
        change = self._change(after(trial, self.delta))
        return bool(change.size and np.nanmax(change) >= _COMPLETE)

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Advance, transfer, diameters [m], times [s], speed loss [-], drift angle and, of a run with phi, heel [rad].

        A figure whose heading the run never reaches, or whose channels it lacks, is left out.
        Lengths are positive towards the side of the rudder; the drift angle is positive with the
        bow inside the circle.
        """
        run = after(trial, self.delta)
        change = self._change(run)
        along, across = track(run)
        across = self._side * across
        out: dict[str, Index] = {}
        for angle, name, lengths in (
            (1.0, "time_90", {"advance": along, "transfer": across}),
            (2.0, "time_180", {"tactical_diameter": across}),
        ):
            moment = reached(change, angle * _QUARTER)
            if moment is None:
                continue
            for length, values in lengths.items():
                out[length] = in_lengths(at(values, moment), L_pp)
            out[name] = Index(at(run.t, moment) - float(run.t[0]), "s")
        last = change >= np.nanmax(change) - _QUARTER if np.nanmax(change) >= _STEADY_AFTER else None
        return {**out, **self._steady(run, last, L_pp), **in_turn(run, self._side, last)}

    def _steady(self, run: Trial, last: NDArray[np.bool_] | None, L_pp: float) -> dict[str, Index]:
        if last is None or not all(name in run for name in ("u", "v_m", "r")):
            return {}
        u, v_m = through_water(run)
        U = np.hypot(u, v_m)
        U_end = float(np.nanmean(U[last]))
        r_end = abs(float(np.nanmean(run["r"][last])))
        drift = float(np.nanmean(np.arctan2(-v_m[last], u[last])))
        start = U[np.isfinite(U)][0]
        out = {"speed_loss": Index(1.0 - U_end / float(start), "-")} if start > 0 else {}
        out["drift"] = Index(self._side * drift, "rad")
        return {"steady_diameter": in_lengths(2.0 * U_end / r_end, L_pp), **out} if r_end > 0 else out

    @property
    def _side(self) -> float:
        return math.copysign(1.0, self.delta)

    def _change(self, run: Trial) -> Array:
        """Heading change since the execute, positive towards the rudder's side [rad]."""
        return self._side * turned(run)
