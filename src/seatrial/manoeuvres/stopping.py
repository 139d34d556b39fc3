"""Stopping: the engine is stopped, or reversed, on a straight course, with the rudder midships.

Track reach is the way along the track, head reach the way along the initial course, lateral deviation
that across it, all from the order to the stop (IMO MSC.137(76) 4.2.9 and 5.3.4; ITTC 7.5-04-02-01).
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import larger, where
from ..core.values import dataclass
from ..data import Array, Trial
from . import Index, Manoeuvre, Settings
from .reading import at, complete_rows, in_lengths, path_length, track, turned

_SHAFTS = ("n_P_cmd", "n_P", "n_P_1_cmd", "n_P_1")
# Change of the revolutions, as a fraction of the ordered one, that no noise is taken for.
_DEPARTURE = 0.05
# Coasting never ends by itself, as resistance falls with the square of the speed; a fifth of it is left at its end.
_COASTED, _DEAD = 0.2, 0.01


class _Halt(Manoeuvre):
    """A run from the order to the engine on until the speed has fallen to the fraction `end` of the approach."""

    by_engine: ClassVar[bool] = True
    n_P: Scalar
    end: Scalar

    @property
    @abstractmethod
    def n_after(self) -> Scalar:
        """Revolutions that the order asks for [1/s]."""

    def complete(self, trial: Trial) -> bool:
        """Whether the speed has fallen to its end."""
        return _moment(_from_order(trial, self.n_P, self.n_after), self.end) is not None

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Track reach, head reach, lateral deviation [m], time [s] and heading change [rad] to the end.

        Empty where the run is over before; positive deviation and heading change are to starboard.
        """
        run = _from_order(trial, self.n_P, self.n_after)
        moment = _moment(run, self.end)
        if moment is None:
            return {}
        along, across = track(run)
        return {
            "track_reach": in_lengths(at(path_length(run), moment), L_pp),
            "head_reach": in_lengths(at(along, moment), L_pp),
            "lateral_deviation": in_lengths(at(across, moment), L_pp),
            "stopping_time": Index(at(run.t, moment) - float(run.t[0]), "s"),
            "heading_change": Index(at(turned(run), moment), "rad"),
        }


@dataclass(frozen=True)
class Stopping(_Halt):
    """Engine stopped at t = 0; the run is over at the fraction `end` of the approach speed.

    The resistance fades with the speed, so a coasting ship never comes to rest: the trial ends at a
    speed agreed beforehand, here a fifth of the approach.
    """

    kind: ClassVar[str] = "stopping"

    n_P: Scalar = spec("1/s", "propeller revolutions of the approach")
    end: Scalar = spec("-", "speed over that of the approach at which the run is over", (0.0, 1.0), default=_COASTED)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """From the approach."""
        return cls(settings.n_P)

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """No revolutions, rudder midships."""
        return (0.0 * self.n_P, 0.0), memory

    @property
    def n_after(self) -> float:
        return 0.0


@dataclass(frozen=True)
class CrashAstern(_Halt):
    """Engine reversed at t = 0 until the ship lies dead in the water, then stopped.

    Dead in the water is the fraction `end` of the approach speed: under reverse thrust hardly any way
    is left then, and the run does not reach beyond what the ship's model is made for.
    """

    kind: ClassVar[str] = "crash-astern"
    memory: ClassVar[tuple[str, ...]] = ("stopped", "u_0")

    n_P: Scalar = spec("1/s", "propeller revolutions of the approach")
    n_astern: Scalar = spec("1/s", "revolutions astern, as a negative number", (-math.inf, 0.0))
    end: Scalar = spec("-", "speed over that of the approach at which the ship has stopped", (0.0, 1.0), default=_DEAD)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """Full astern is taken as the revolutions of the approach, reversed."""
        return cls(settings.n_P, -abs(settings.n_P))

    def begin(self, state: Scalars) -> Scalars:
        """Whether the ship has stopped (0 or 1), and the speed of the approach [m/s]."""
        return (0.0, state[3])

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] astern until the ship has stopped, rudder midships."""
        stopped = larger(memory[0], where(state[3] <= self.end * memory[1], 1.0, 0.0))
        return (where(stopped > 0, 0.0, self.n_astern), 0.0), (stopped, memory[1])

    @property
    def n_after(self) -> Scalar:
        return self.n_astern


def _from_order(trial: Trial, approach: float, order: float) -> Trial:
    """The run from the order to the engine on; the whole run where no revolutions were recorded.

    A run that begins with the order on begins at its first sample.
    """
    run = complete_rows(trial, ("u", "x", "y", "psi"))
    name = next((n for n in _SHAFTS if n in run), None)
    if name is None:
        return run
    n_P, change = run[name], abs(approach - order)
    if abs(n_P[0] - order) < 0.5 * change:
        return run
    moved = np.flatnonzero(np.abs(n_P - n_P[0]) > _DEPARTURE * change)
    if not moved.size:
        return run
    first = int(moved[0])
    return run.rows(slice(first if name.endswith("_cmd") else max(first - 1, 0), None))


def _moment(run: Trial, end: float) -> float | None:
    """Row, as a fraction, at which the speed ahead comes down to `end` of the first one."""
    u: Array = run["u"]
    below = np.flatnonzero(u <= end * u[0])
    if not below.size or u[0] <= 0:
        return None
    i = int(below[0])
    return i - float((end * u[0] - u[i]) / (u[i - 1] - u[i]))
