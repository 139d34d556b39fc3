"""Spread of the fits that the data allow on a manoeuvre, and whether the manoeuvre leaves the training data.

Members are drawn from the posterior of a fit: ships that explain its trials about as well.  They agree near the data
and differ away from them, so the spread of their predictions grows with the distance from the data.  It covers only
what the form of the model leaves undetermined, so it is judged against the spread over the training trials, together
with the novelty of the samples (`coverage`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import write_whole
from ..core.parameters import values
from ..core.records import read_archive, to_archive
from ..core.values import dataclass, replace
from ..data import Array, Trial
from ..identify import Fit, Loss, Problem
from ..identify.record import windows
from ..identify.trajectory.shooting import Trajectory
from ..models import STATES
from ..models.hybrid import Hybrid
from ..ships import Ship, ShipError
from ..simulate.approach import substeps
from ..simulate.lanes import Kernel, Lanes, run
from ..simulate.loop import open_loop, open_loop_parameters
from .coverage import VERDICTS, Coverage, Reference, coverage, remembered, told, usual
from .freer import UNITS, freer, with_units
from .posterior import Posterior

NAME = "spread.npz"
"""File of the members, beside model.toml."""

WIDE = 3.0
"""Spread over that of the training trials (nine in ten of them) above which a manoeuvre leaves the data."""

MEMBERS = 16
"""Ships drawn where a spread is asked for and no number: its standard error is then 18 % of it."""
_USUAL = 0.9
_SCHEMA, _REMEDY = "seatrial-spread/2", "run the study again, or remove the file"


@dataclass(frozen=True)
class Members:
    """Ships that the data are consistent with, and their spread on the training trials.

    Attributes:
        paths: the parameters that differ.
        fitted: their values in the fit itself, shape (paths,).
        drawn: shape (members, paths).
        units: seed of the random units that the members have beside the fit; None where there are none.
        sigma: scale of each state in a spread.
        restart: seconds between restarts, the same for every trial that is judged; None predicts each trial in one run.
        training: spread of each training trial by name.
        reference: the training data; None if there is nothing to compare with.
    """

    paths: tuple[str, ...]
    fitted: Array
    drawn: Array
    units: int | None
    sigma: Mapping[str, float]
    restart: float | None
    training: Mapping[str, float]
    reference: Reference | None

    @property
    def usual(self) -> float:
        """Spread that nine in ten training trials do not exceed."""
        return float(np.quantile(list(self.training.values()), _USUAL))

    def wide(self, ship: Ship) -> Ship:
        """The fitted ship with the random units, their outputs still zero."""
        return ship if self.units is None else with_units(ship, UNITS, self.units)[0]


@dataclass(frozen=True)
class Spread:
    """Spread of the members on one trial.

    Attributes:
        name: of the trial.
        deviation: standard deviation of each state between the members, SI units, shape (restarts, rows, 6), a row
            per second from each restart on; NaN where nothing was measured.
        standardised: mean over the rows of the sum of the squared deviations over sigma^2; inf if a member diverges.
        ratio: the same over what is usual on the training trials.
        coverage: novelty of the samples; None if it is unknown.
    """

    name: str
    deviation: Array
    standardised: float
    ratio: float
    coverage: Coverage | None

    @property
    def verdict(self) -> str:
        """"inside", "edge" or "leaves": the worse of spread and samples."""
        novel = self.coverage.verdict if self.coverage else "inside"
        if self.ratio > WIDE or novel == "leaves":
            return "leaves"
        return "edge" if self.ratio > math.sqrt(WIDE) or novel == "edge" else "inside"

    def __str__(self) -> str:
        words, c = VERDICTS[self.verdict], self.coverage
        if c is None and self.verdict == "inside":
            words = "moves the members no more than usual; its samples could not be compared with the training data"
        novel = "" if c is None else f", {100 * c.share:.1f} % of the samples are novel" \
            + (f" in {', '.join(c.channels)}" if c.channels else "")  # fmt: skip
        return f"{self.name}: this manoeuvre {words} (spread {self.ratio:.2g} times the usual{novel})"

    def numbers(self) -> dict[str, Any]:
        """The same for a JSON file; deviations as root mean squares over the rows."""
        rms = np.sqrt(np.nanmean(self.deviation**2, axis=(0, 1))).tolist()
        finite = math.isfinite(self.standardised)
        return {"verdict": self.verdict, "standardised": self.standardised if finite else None,
                "ratio": self.ratio if finite else None,
                "deviation": dict(zip(STATES, rms, strict=True)) if finite else None,
                "coverage": self.coverage.numbers() if self.coverage else None}  # fmt: skip


def members(
    fit: Fit, problem: Problem, estimator: Any, sigma: Mapping[str, float], *,
    restart: float | None = None, count: int = MEMBERS, seed: int = 0,
) -> Members:  # fmt: skip
    """Members drawn from the posterior of a fit, and their spread on each of its trials.

    Those of a hybrid fitted through the trajectory have random units that only the trials constrain (`freer`).

    Args:
        fit: with a covariance, of `problem` by `estimator`.
        sigma: scale of each state.
        restart: seconds between restarts of the predictions.
        count: number of members.
        seed: of the draws.

    Raises:
        DataError: the trials cannot be predicted.
    """
    free, covariance, units = fit.free, fit.covariance, None
    if isinstance(fit.ship.model, Hybrid) and isinstance(estimator, Trajectory):
        _, free, covariance = freer(fit, problem, estimator, seed=seed)
        units = seed
    middle = np.append(fit.values, np.zeros(len(free) - len(fit.values)))
    wide = fit.ship if units is None else with_units(fit.ship, UNITS, units)[0]
    drawn = Posterior(wide, free, middle, covariance).draws(count, seed)
    channels = usual(problem.trials)
    reference = Reference.of(problem.trials, remembered(problem.trials, channels)) if channels else None
    paths = tuple(f.path for f in free)
    bare = Members(paths, middle, drawn, units, dict(sigma), restart, {}, reference)
    level = [standardised for _, standardised in _drifts(bare, fit.ship, problem.trials)]
    return replace(bare, training=dict(zip((t.name for t in problem.trials), level, strict=True)))


def spreads(found: Members, ship: Ship, trials: Sequence[Trial]) -> list[Spread]:
    """How far the members drift apart on each trial.

    Raises:
        DataError: a trial lacks what the ship needs.
    """
    out: list[Spread] = []
    known = found.reference
    for trial, (deviation, level) in zip(trials, _drifts(found, ship, trials), strict=True):
        covered = coverage(known, trial) if known and told(known.channels, trial) else None
        out.append(Spread(trial.name, deviation, level, level / max(found.usual, 1e-300), covered))
    return out


def _drifts(found: Members, ship: Ship, trials: Sequence[Trial]) -> list[tuple[Array, float]]:
    """Deviations between the members on each trial, and their standardised mean square."""
    wide = found.wide(ship)
    dt = float(np.median([trial.dt for trial in trials]))
    cut = windows(
        trials, wide.model, Loss(correlation=0.0), dict.fromkeys(STATES, 1.0), dt=dt, every=max(round(1.0 / dt), 1),
        window=found.restart or max(trial.duration for trial in trials), substeps=substeps(wide, dt),
    )  # fmt: skip
    system, parameters = open_loop(wide), open_loop_parameters(wide)
    kernel, where = Kernel(system), [system.parameters.index(path) for path in found.paths]
    lanes, every = Lanes(kernel, parameters, cut.state0, kernel.pack(cut.series)), list[Array]()
    with np.errstate(all="ignore"):  # a member that diverges does not return
        for row in found.drawn:
            parameters[where] = row
            every.append(run(lanes, cut.grid("rk4")).values[:, :, : len(STATES)])
        deviation = np.nan_to_num(np.std(every, axis=0), nan=np.inf)
    deviation = np.where(cut.scale > 0, deviation, np.nan)
    square = (deviation / np.array([found.sigma[name] for name in STATES])) ** 2
    return [(deviation[cut.trial == k], float(np.nanmean(square[cut.trial == k])) * len(STATES))
            for k in range(len(trials))]  # fmt: skip


def save_members(found: Members, path: Path) -> Path:
    """Write the members beside the ship file, whole or not at all."""
    return write_whole(path, to_archive(found, _SCHEMA))


def load_members(path: Path, ship: Ship) -> Members:
    """The members of a ship as `save_members` wrote them.

    Raises:
        ShipError: the file cannot be read, or belongs to another fit than the ship.
    """
    found = read_archive(path, Members, _SCHEMA, ShipError, _REMEDY)
    paths, units = found.paths, found.units
    if found.drawn.ndim != 2 or found.drawn.shape[1] != len(paths) or found.fitted.shape != (len(paths),):
        raise ShipError(f"{path}: members of shape {found.drawn.shape} for {len(paths)} parameters; {_REMEDY}")
    known = values(ship.model)
    # The outputs of random units are in no ship file.
    same = [math.isclose(known[p], v, rel_tol=1e-9, abs_tol=1e-300) if p in known else units is not None
            for p, v in zip(paths, found.fitted.tolist(), strict=True)]  # fmt: skip
    if not all(same):
        raise ShipError(f"{path}: belongs to another fit than the ship beside it; run the study again, or remove it")
    return found
