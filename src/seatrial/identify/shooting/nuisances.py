"""What each trial has of its own beside its first state: a constant current and constant sensor biases.

Each is drawn to zero by a Gaussian prior, and eliminated trial by trial with the first state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...data import Array, Trial
from ...models import STATES
from ...simulate.replay import logged
from .. import Nuisance, StudyError
from ..trajectory.objective import CURRENT

Index = NDArray[np.intp]


@dataclass(frozen=True)
class Nuisances:
    """The nuisances of a trial in a row: current north and east [m/s] where there is one, then biases.

    Attributes:
        current: whether trials have a current of their own.
        bias: indices of the channels that are read with a bias.
        deviation: standard deviation of each nuisance, shape (count,).
    """

    current: bool
    bias: Index
    deviation: Array

    @staticmethod
    def of(nuisance: Nuisance) -> Nuisances:
        """Those that a problem declares.

        Raises:
            StudyError: a channel that is none, a deviation that is not above zero, or one of the first state.
        """
        if nuisance.initial:
            raise StudyError(
                "[nuisance] initial is not for logo:Shooting, which frees the first state of a trial as a whole; "
                'leave it out and say estimator.initial = "free", or use shooting:Trajectory'
            )
        for name, sigma in nuisance.bias.items():
            if name not in STATES:
                raise StudyError(f"[nuisance] bias names '{name}'; channels are {', '.join(STATES)}")
            if not sigma > 0:
                raise StudyError(f"[nuisance] bias of {name} is {sigma:g}; it must be above zero")
        sizes = [nuisance.current] * (len(CURRENT) * (nuisance.current > 0)) + list(nuisance.bias.values())
        bias = np.array([STATES.index(name) for name in nuisance.bias], dtype=np.intp)
        return Nuisances(nuisance.current > 0, bias, np.array(sizes, dtype=np.float64))

    @property
    def count(self) -> int:
        """Nuisances of a trial."""
        return self.deviation.size

    @property
    def currents(self) -> int:
        """How many of them, the first ones, are components of a current."""
        return len(CURRENT) * self.current

    @property
    def lanewise(self) -> tuple[str, ...]:
        """Parameters that differ from trial to trial."""
        return CURRENT if self.current else ()

    def drift(self, eta: Array) -> Array | None:
        """Values of `lanewise`, shape (lanes, 2), from those of all lanes, shape (lanes, count)."""
        return eta[:, : self.currents] if self.current else None

    def offset(self, eta: Array) -> Array:
        """What is added to predictions, shape (lanes, 6)."""
        out = np.zeros((len(eta), len(STATES)))
        out[:, self.bias] = eta[:, self.currents :]
        return out

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the nuisances of a trial, as in `Fit.nuisances`."""
        currents = tuple(path.rpartition(".")[2] for path in self.lanewise)
        return (*currents, *(f"bias_{STATES[k]}" for k in self.bias))

    def told(self, trials: Sequence[Trial], eta: Array) -> dict[str, dict[str, float]]:
        """Values of all trials, shape (trials, count), by trial and name; empty without nuisances."""
        if not self.count:
            return {}
        return {t.name: dict(zip(self.names, row, strict=True)) for t, row in zip(trials, eta.tolist(), strict=True)}

    def prior(self, eta: Array) -> float:
        """Its part of the objective."""
        return float(((eta / self.deviation) ** 2).sum())


def with_current(trial: Trial, found: Mapping[str, Mapping[str, float]]) -> Trial:
    """A trial with the current that a fit estimated for it on top of the one it logged; as it is where there is none.

    Args:
        found: values by trial and name, as in `Fit.nuisances`; a current is constant, north and east [m/s].
    """
    north, east = (found.get(trial.name, {}).get(path.rpartition(".")[2], 0.0) for path in CURRENT)
    if not (north or east):
        return trial
    if logged(trial, "U_C") and logged(trial, "gamma_C"):
        north = north + trial["U_C"] * np.cos(trial["gamma_C"])
        east = east + trial["U_C"] * np.sin(trial["gamma_C"])
    one = np.ones(len(trial))
    return trial.having(U_C=np.hypot(north, east) * one, gamma_C=np.arctan2(east, north) * one)
