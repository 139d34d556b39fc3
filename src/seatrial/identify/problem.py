"""Problem, loss, nuisance parameters, fit and verdicts of an identification; the contract of an estimator."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Protocol

import numpy as np

from ..core.errors import FitError as FitError
from ..core.errors import StudyError as StudyError
from ..core.parameters import Free
from ..data import Array, Trial
from ..ships import Ship
from .vector import Vector


@dataclass(frozen=True)
class Loss:
    """What a fit holds against a prediction.

    Attributes:
        sigma: scale of each compared channel by name, SI units; the residual is divided by it.
            Empty takes the standard deviation over the training trials.
        correlation: time over which the errors of a prediction are alike [s]; it says how many
            samples count as independent against the prior.  0 counts every sample.
        weights: how much the trials whose names fit a shell-style pattern count (the first that fits); others count 1.
    """

    sigma: Mapping[str, float] = field(default_factory=dict[str, float])
    correlation: float = 5.0
    weights: Mapping[str, float] = field(default_factory=dict[str, float])

    def weight(self, name: str) -> float:
        """How much the trial of this name counts."""
        return next((w for pattern, w in self.weights.items() if fnmatchcase(name, pattern)), 1.0)


@dataclass(frozen=True)
class Nuisance:
    """What differs from window to window or from trial to trial and is estimated along.

    Attributes:
        initial: standard deviation of the initial state's offset by channel; empty: as measured.  Infinite: free,
            the first reading counting as any other.
        current: standard deviation of a constant current per trial, each component [m/s]; 0: none.
        bias: standard deviation of a constant sensor bias per trial by channel; empty: none.
    """

    initial: Mapping[str, float] = field(default_factory=dict[str, float])
    current: float = 0.0
    bias: Mapping[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True)
class Problem:
    """Which parameters of which ship are to explain which trials; `validation` is only watched.

    `extrapolate` lets commands leave the tested range of a thrust map, which `lint` refuses otherwise; `linted` says
    that `lint` found no error in it or in what it was derived from, and is the estimators' own.
    """

    ship: Ship
    trials: tuple[Trial, ...]
    free: tuple[Free, ...]
    loss: Loss = Loss()
    nuisance: Nuisance = Nuisance()
    validation: tuple[Trial, ...] = ()
    extrapolate: bool = False
    linted: bool = field(default=False, compare=False, repr=False)

    @property
    def vector(self) -> Vector:
        """The free parameters as arrays."""
        return Vector(self.free)


@dataclass(frozen=True)
class Issue:
    """One finding of `lint`: "error" forbids the run, "warning" does not."""

    severity: str
    where: str
    text: str


@dataclass(frozen=True)
class Verdict:
    """What the data say about one parameter or one combination of parameters.

    Attributes:
        subject: path of the parameter, or the combination in words.
        status: "identified", "weak" (the prior speaks as loud as the data), "not identified",
            or "at bound".
        text: the same in plain words, with the manoeuvre that would help where data are missing.
    """

    subject: str
    status: str
    text: str


@dataclass(frozen=True)
class Fit:
    """The outcome of an estimation.

    Attributes:
        ship: the fitted ship, ready to simulate or save.
        free: the parameters as they were declared (start, bounds, prior).
        values, sigma: estimate and posterior standard deviation, in the order of `free`.
        covariance: posterior covariance, shape (free, free).
        shrinkage: per parameter, 1 - posterior variance / prior variance: what the data added.  Without prior an even
            spread over the bounds is one; without bounds, size^2 is, of the larger of start and estimate.
        at_bound: paths that ended on a bound.
        verdicts: plain words, see `Verdict`.
        history: rows (iteration, objective, validation or NaN, seconds).
        objective: final value of the loss, prior included.
        seconds, evaluations: what it cost.
        status: why it stopped, in words.
        digest: fingerprint of the problem.
        ends: where each run of the search ended, shape (runs, 1 + free): objective and values.
        nuisances: estimated along, by trial and name: current_x, current_y (north, east) [m/s], bias_CHANNEL.
        details: what else the estimator has found, for sections of its own in the report; None where nothing.
    """

    ship: Ship
    free: tuple[Free, ...]
    values: Array
    sigma: Array
    covariance: Array
    shrinkage: Array
    at_bound: tuple[str, ...]
    verdicts: tuple[Verdict, ...]
    history: Array
    objective: float
    seconds: float
    evaluations: int
    status: str
    digest: str
    ends: Array = field(default_factory=lambda: np.zeros((0, 0)))
    nuisances: Mapping[str, Mapping[str, float]] = field(default_factory=dict[str, Mapping[str, float]])
    details: object = field(default=None, compare=False, repr=False)

    @property
    def vector(self) -> Vector:
        """The free parameters as arrays."""
        return Vector(self.free)


Progress = Callable[[int, float, float], None]
"""Called with (iteration, objective, validation or NaN) as a fit goes on."""


class Estimator(Protocol):
    """Anything that turns a problem into a fit; hyper-parameters live in its fields.

    One that starts at measured initial states may have `starts_remedy`: the key of a study and what to write there so
    that their noise is not taken for information; ("", "") otherwise.  One that makes several fits and reports each by
    `watch.part` has `several = True`.
    """

    def fit(self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None) -> Fit:
        """Estimate the free parameters; a run killed with a `checkpoint` file goes on from it."""
        ...
