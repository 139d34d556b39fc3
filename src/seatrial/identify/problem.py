"""Problem, loss, nuisance parameters, fit and verdicts of an identification; the contract of an estimator."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, ClassVar, Protocol, runtime_checkable

import numpy as np

from ..core.errors import FitError as FitError
from ..core.errors import StudyError as StudyError
from ..core.executors import Pool
from ..core.parameters import Free
from ..core.records import Limits
from ..core.values import dataclass, field, replace
from ..data import Array, Trial
from ..ships import Ship
from .diagnosis.findings import Diagnosis
from .vector import Vector


@dataclass(frozen=True)
class Loss:
    """How predictions are compared with measurements.

    Attributes:
        sigma: scale of each compared channel by name, SI units; the residual is divided by it.  Empty: see `scale`.
        correlation: correlation time of the errors of a prediction [s]; it determines how many
            samples count as independent against the prior.  0 counts every sample.  None counts every sample, and
            widens the posterior by what the residuals show (`diagnosis.findings`).
        weights: weight of the trials whose names match a shell-style pattern (the first match); others weigh 1.
        scale: without `sigma`, "noise" divides by the noise of each sensor, estimated from the logs (`noise.noise`);
            "spread" by the standard deviation of each state over the training trials, as papers do.
    """

    sigma: Mapping[str, float] = field(default_factory=dict[str, float])
    correlation: float | None = None
    weights: Mapping[str, float] = field(default_factory=dict[str, float])
    scale: str = "noise"

    def weight(self, name: str) -> float:
        """Weight of the trial of this name."""
        return next((w for pattern, w in self.weights.items() if fnmatchcase(name, pattern)), 1.0)


@dataclass(frozen=True)
class Nuisance:
    """Nuisance parameters: quantities of each window or trial that are estimated along with the parameters.

    Attributes:
        initial: standard deviation of the initial state's offset by channel; empty: as measured.  Infinite: free,
            and the first reading counts as any other.
        current: standard deviation of a constant current per trial, each component [m/s]; 0: none.
        bias: standard deviation of a constant sensor bias per trial by channel; empty: none.
        common: standard deviation of errors of instruments that are the same in every trial, by name as in `suspects`;
            inf: no prior.
        suspects: "auto" also estimates, one after the other, those errors of instruments that the residuals call for.
        begun: where the search for some of `common` begins, by name; see `TrajectoryObjective.first` for the others.
    """

    initial: Mapping[str, float] = field(default_factory=dict[str, float])
    current: float = 0.0
    bias: Mapping[str, float] = field(default_factory=dict[str, float])
    common: Mapping[str, float] = field(default_factory=dict[str, float])
    suspects: str = ""
    begun: Mapping[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True, repr=False)
class Problem:
    """The parameters of a ship to be estimated from trials.

    Attributes:
        ship: the ship, with the parameters that the search starts from.
        trials: training trials.
        free: the parameters to estimate.
        loss: how predictions are compared with measurements.
        nuisance: what else is estimated.
        validation: trials on which the fit is evaluated as it runs; they decide nothing.
        extrapolate: whether commands may leave the tested range of a thrust map, which `lint` refuses otherwise.
        linted: whether `lint` found no error in this problem or in the one it was derived from; set by estimators.
    """

    ship: Ship
    trials: tuple[Trial, ...]
    free: tuple[Free, ...]
    loss: Loss = Loss()
    nuisance: Nuisance = Nuisance()
    validation: tuple[Trial, ...] = ()
    extrapolate: bool = False
    linted: bool = field(default=False, compare=False)

    def __repr__(self) -> str:
        return (f"{type(self).__name__}({self.ship.name!r}, {len(self.free)} free parameters, "
                f"{len(self.trials)} trials, {sum(map(len, self.trials))} rows)")  # fmt: skip

    @property
    def vector(self) -> Vector:
        """The free parameters as arrays."""
        return Vector(self.free)

    def without(self, out: Sequence[Trial]) -> Problem:
        """The problem whose fit has not seen some of the trials; it watches none."""
        seen = tuple(trial for trial in self.trials if not any(trial is one for one in out))
        return replace(self, trials=seen, validation=())


@dataclass(frozen=True)
class Issue:
    """One finding of `lint`: "error" forbids the run, "warning" does not.

    Attributes:
        faint: whether it says that a free parameter hardly acts; there are often many of these.
    """

    severity: str
    where: str
    text: str
    faint: bool = False


@dataclass(frozen=True)
class Verdict:
    """What the data determine about one parameter or one combination of parameters.

    Attributes:
        subject: path of the parameter, or the combination in words.
        status: "identified", "graded" (known within a range, if the form of the model is right, which the residuals
            contradict), "weak" (the prior weighs about as much as the data), "not identified", or "at bound".
        text: the finding in words, with the manoeuvre that would help where data are missing.
        within: half width of the 95 % interval over the value; inf about zero, and of a combination.
    """

    subject: str
    status: str
    text: str
    within: Annotated[float, Limits(null=math.inf)] = math.inf


@dataclass(frozen=True, repr=False)
class Fit:
    """The outcome of an estimation.

    Attributes:
        ship: the fitted ship, ready to simulate or save.
        free: the parameters as they were declared (start, bounds, prior).
        values, sigma: estimate and posterior standard deviation, in the order of `free`.
        covariance: posterior covariance, shape (free, free).
        shrinkage: per parameter, 1 - posterior variance / prior variance: what the data added.  Without a prior it is
            the variance of a uniform density over the bounds; without bounds, the square of the larger of start and
            estimate.
        at_bound: paths that ended on a bound.
        verdicts: see `Verdict`.
        history: rows (iteration, objective, validation or NaN, seconds).
        objective: final value of the loss, prior included.
        seconds, evaluations: wall time [s] and number of evaluations of the objective.
        status: reason why the search stopped.
        digest: fingerprint of the problem.
        ends: where each run of the search ended, shape (runs, 1 + free): objective and values.
        nuisances: nuisance parameters by trial and name: current_x, current_y (north, east) [m/s], bias_CHANNEL.
        diagnosis: whether the model explains the data, and what else would; None where it was not tested.
        loss: residual weights where they were estimated from the residuals; None where they are those of the problem.
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
    diagnosis: Diagnosis | None = field(default=None, compare=False)
    loss: Loss | None = None
    details: object = field(default=None, compare=False)

    def __repr__(self) -> str:
        found = sum(one.status == "identified" for one in self.verdicts)
        return (f"{type(self).__name__}({self.ship.name!r}, {len(self.free)} parameters, {found} identified, "
                f"objective {self.objective:.4g}, {self.status!r})")  # fmt: skip

    @property
    def vector(self) -> Vector:
        """The free parameters as arrays."""
        return Vector(self.free)


Progress = Callable[[int, float, float], None]
"""Called with (iteration, objective, validation or NaN) after each iteration of a fit."""


class Estimator(Protocol):
    """Anything that turns a problem into a fit; hyper-parameters live in its fields.

    An estimator that starts predictions at measured states may have `starts_remedy`: the key of a study and what to
    write there, so that the noise of initial states does not count as information; ("", "") where there is none.  One
    that makes several fits and reports each by `watch.part` has `several = True`.  One
    that takes trials without readings of some states (`simulate.begun`) has `partial = True`.
    """

    def fit(self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None) -> Fit:
        """Estimate the free parameters; a killed run resumes from its `checkpoint` file."""
        ...


@runtime_checkable
class Spread(Protocol):
    """An `Estimator` of independent searches (starts, ranges, trials left out), which a pool may compute elsewhere."""

    spreads: ClassVar[bool]

    def fit(
        self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None,
        pool: Pool | None = None,
    ) -> Fit:  # fmt: skip
        """As `Estimator.fit`; the numbers are the same with any pool and without one (None)."""
        ...
