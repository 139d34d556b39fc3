"""Acceleration: engine ahead from rest or from a slow run, rudder midships, until the speed settles.

Read off: what speed is reached, and how long and how far it takes to come to nine tenths of it
(ITTC 7.5-04-02-01, acceleration test).
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
from .reading import at, complete_rows, in_lengths, path_length, reached, track, turned

# The speed has settled when it changes by this fraction of itself over the last fifth of the run.
_SETTLED, _LAST = 2e-3, 5


@dataclass(frozen=True)
class Acceleration(Manoeuvre):
    """Revolutions `n_ahead` ordered at t = 0 on a ship whose shaft turns at `n_P`."""

    kind: ClassVar[str] = "acceleration"
    by_engine: ClassVar[bool] = True
    from_rest: ClassVar[bool] = True
    """The run starts at rest unless a speed is given."""

    n_P: Scalar = spec("1/s", "propeller revolutions before the order")
    n_ahead: Scalar = spec("1/s", "propeller revolutions ordered")
    fraction: Scalar = spec("-", "speed over the final one at which time and way are read", (0.0, 1.0), default=0.9)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """From a shaft at rest to the revolutions of the approach."""
        return cls(0.0, settings.n_P)

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        return (self.n_ahead, 0.0), memory

    def complete(self, trial: Trial) -> bool:
        """Whether the speed has settled."""
        u = complete_rows(trial, ("u",))["u"]
        last = u[-max(u.size // _LAST, 2) :]
        final = float(np.mean(last))
        return bool(final > u[0] and np.ptp(last) <= _SETTLED * abs(final))

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Final speed [m/s]; time [s] and way [m] to nine tenths of it; deviation [m], heading change [rad].

        The final speed is the mean over the last twentieth of the run; deviation (to starboard) and
        heading change are those at its end.  Time and way count from the first sample.
        """
        run = complete_rows(trial, [n for n in ("u", "x", "y", "psi") if n == "u" or n in trial])
        u = run["u"]
        final = float(np.mean(u[-max(u.size // 20, 1) :]))
        out = {"final_speed": Index(final, "m/s")}
        moment = reached(u, self.fraction * final)
        if moment is not None and final > u[0]:
            name = f"{math.floor(100.0 * self.fraction + 0.5)}_percent"
            out[f"time_to_{name}"] = Index(at(run.t, moment) - float(run.t[0]), "s")
            out[f"distance_to_{name}"] = in_lengths(at(path_length(run), moment), L_pp)
        if all(n in run for n in ("x", "y", "psi")):
            out["lateral_deviation"] = in_lengths(float(track(run)[1][-1]), L_pp)
            out["heading_change"] = Index(float(turned(run)[-1]), "rad")
        return out
