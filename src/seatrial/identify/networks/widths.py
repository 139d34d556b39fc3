"""Prior width of a hybrid's correction, selected by cross-validation.

A correction beside the physics needs data in proportion to the number of its parameters; with a prior too wide for
the data it overfits.  `Widths` fits with several widths to parts of the training trials, evaluates each on the others,
and fits all of them with the best: with few trials the correction shrinks, down to none.

Trials cut from one recording share its weather and its errors, so none is a test of another: they are left out
together.  Scores of the widths are kept beside a checkpoint, so that a killed run does not compute them again.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import numpy as np

from ...core.errors import RequestError
from ...core.executors import Pool
from ...core.files import write_whole
from ...core.records import Limits, read_json, to_json
from ...core.values import dataclass, field, replace
from ...data import Trial
from .. import Fit, FitError, Nuisance, Problem, Progress, StudyError
from ..lint import linted
from ..record import every_of, scales, step_of
from ..recordings import dealt, recordings
from ..resume import begin_anew, digest, foreign
from ..trajectory.objective import TrajectoryObjective
from ..trajectory.shooting import Trajectory
from ..watch import stage, start

_SCHEMA = "seatrial-widths/1"


@dataclass(frozen=True)
class Widths(Trajectory):
    """Trajectory least squares, the prior widths of some parameters chosen by left-out trials.

    Attributes:
        widths: factors on the prior deviations of `vary`, one fit each for every part left out; with 0 the parameters
            stay at the mean of their prior.
        vary: shell-style patterns of the parameters whose priors are scaled together.
        parts: into how many parts the recordings are dealt, by turns in the order of their names, each left out once;
            trials that were cut from one recording go out together (`recordings`).
    """

    widths: tuple[float, ...] = (0.0, 0.3, 1.0)
    vary: tuple[str, ...] = ("residual_*", "unit_*")
    parts: int = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.vary, str):
            raise StudyError(f"estimator.vary is '{self.vary}'; write a list of patterns, [\"{self.vary}\"]")
        object.__setattr__(self, "vary", tuple(self.vary))
        object.__setattr__(self, "widths", tuple(float(w) for w in self.widths))
        if not self.widths or not all(w >= 0.0 for w in self.widths) or len(set(self.widths)) < len(self.widths):
            raise StudyError(f"estimator.widths is {list(self.widths)}; give different factors, none below zero")
        if not self.parts >= 2:
            raise StudyError(f"estimator.parts is {self.parts:g}; leave out one part of two at least")

    @property
    def estimates_common(self) -> bool:
        """It estimates no errors of instruments."""
        return False

    @property
    def weights_stay(self) -> bool:
        """It compares priors by left-out trials, at one set of weights."""
        return True

    @linted
    def fit(
        self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None,
        pool: Pool | None = None,
    ) -> Fit:  # fmt: skip
        """Estimate the free parameters with the width that predicts left-out trials best; see `Estimator`.

        `Fit.status` reports the choice; with the width 0, `Fit.free` holds the other parameters only.  The scores of
        the widths are kept beside the checkpoint.

        Raises:
            ResumeError: what stands there belongs to another problem.
            StudyError: fewer recordings than parts, no parameter to vary, or one of them without a prior.
            FitError: the model blows up at every start, or with every width.
        """
        began = time.perf_counter()
        self._check(problem)
        start(progress, problem.ship)
        alone = len(self.widths) == 1
        scores = {self.widths[0]: 0.0} if alone else self._scores(problem, checkpoint, progress, pool)
        best = min(scores, key=lambda w: scores[w])
        if not np.isfinite(scores[best]):
            raise FitError("left-out trials blow up with every width of the prior; give the smaller ones, 0 the least")
        fit = self._plain(problem, best).fit(
            self.scaled(problem, best), progress=progress, checkpoint=checkpoint, pool=pool
        )
        told = ", ".join(f"{w:g}: {score:.3g}" for w, score in scores.items())
        why = ", the only one given" if alone else f" by left-out trials ({told})"
        status = f"{fit.status}; prior width {best:g}{why}"
        return replace(fit, seconds=time.perf_counter() - began, status=status)

    def chosen(self, problem: Problem, priors: Mapping[str, float]) -> float:
        """The width that a finished fit of `problem` was made with; 0 where its correction was left out.

        Args:
            priors: the prior deviations of that fit, by path.
        """
        varied = [f for f in problem.free if self._varied(f.path)]
        return max((priors[f.path] / f.sigma for f in varied if f.path in priors), default=0.0)

    def settled(self, problem: Problem, fit: Fit) -> tuple[Trajectory, Problem]:
        """Estimator and problem of the width that a finished fit of `problem` has chosen."""
        width = self.chosen(problem, {one.path: one.sigma for one in fit.free})
        return self._plain(problem, width), self.scaled(problem, width)

    def _check(self, problem: Problem) -> None:
        """Refuse what leaves nothing to choose, or no way to."""
        count = len(recordings(problem.trials))
        if count < self.parts:
            of = "" if count == len(problem.trials) else f" (the {len(problem.trials)} trials are parts of them)"
            raise StudyError(f"estimator.parts is {self.parts}; there are {count} recordings to leave out{of}")
        self.check_varied(problem)

    def check_varied(self, problem: Problem) -> None:
        """Refuse a problem with nothing to vary.

        Raises:
            StudyError: no parameter to vary, or one of them without a prior.
        """
        varied = [f for f in problem.free if self._varied(f.path)]
        if not varied:
            raise StudyError(f"estimator.vary fits no free parameter: {', '.join(self.vary)}")
        for f in varied:
            if not np.isfinite(f.sigma):
                raise StudyError(f"estimator.vary: {f.path} has no prior whose width could be chosen; give it a sigma")

    def _scores(
        self, problem: Problem, checkpoint: Path | None, progress: Progress | None = None, pool: Pool | None = None
    ) -> dict[float, float]:
        """Score of each width on left-out trials, those taken from an earlier run that it has finished."""
        record = Scores.beside(checkpoint, f"{digest(problem, self)} by weighted recordings")
        todo = [width for width in self.widths if width not in record.found]
        wanted = [(self, problem, width, part) for width in todo for part in range(self.parts)]
        apart = None if pool is None else pool.ordered(_left_part, wanted)
        for width in todo:
            if apart is not None:
                record.note(width, _pooled(list(itertools.islice(apart, self.parts))))
            else:
                before = self.widths.index(width) * self.parts
                record.note(width, self._left_out(problem, width, before, progress))
        return {width: record.found[width] for width in self.widths}

    def _varied(self, path: str) -> bool:
        return any(fnmatchcase(path, pattern) for pattern in self.vary)

    def _plain(self, problem: Problem, width: float) -> Trajectory:
        """The estimator of one width; `later` goes where nothing would join later."""
        late = [f.path for f in self.scaled(problem, width).free if any(fnmatchcase(f.path, p) for p in self.later)]
        return Trajectory(
            self.window, self.stride, self.every, self.dt, self.method, self.iterations, self.tolerance,
            self.later if late else (), self.starts, self.seed, self.threads, self.initial,
        )  # fmt: skip

    def scaled(self, problem: Problem, width: float) -> Problem:
        """The problem with the priors of `vary` scaled by `width`; with 0 these are held at their means."""
        if width > 0:
            free = tuple(replace(f, sigma=width * f.sigma) if self._varied(f.path) else f for f in problem.free)
            return replace(problem, free=free)
        means = self.means(problem)
        kept = tuple(f for f in problem.free if f.path not in means)
        return replace(problem, ship=problem.ship.having(means), free=kept)

    def means(self, problem: Problem) -> dict[str, float]:
        """Prior means of the parameters of `vary`, by path."""
        return {f.path: f.prior if np.isfinite(f.prior) else f.start for f in problem.free if self._varied(f.path)}

    def _left_out(
        self, problem: Problem, width: float, before: int = 0, progress: Progress | None = None
    ) -> float:
        """Standardised mean squared error of all trials, weighted as the loss does, by fits that have not seen them.

        Args:
            before: fits for other widths that go before, to report how far the choice has come.
        """
        def of(part: int) -> tuple[float, float]:
            stage(progress, f"choosing widths: fit {before + part + 1} of {len(self.widths) * self.parts}")
            return self.left_part(problem, width, part)

        return _pooled(map(of, range(self.parts)))

    def left_part(self, problem: Problem, width: float, part: int) -> tuple[float, float]:
        """Squared standardised errors of a part by a fit that has not seen it, and how many, weighted as the loss does.

        They are infinite where the model blows up.
        """
        loss = replace(problem.loss, sigma=scales(problem))
        out = dealt(problem.trials, self.parts)[part]
        inner = self.scaled(replace(problem.without(out), loss=loss), width)
        try:
            found = self._plain(problem, width).fit(inner)
        except FitError:
            return float("inf"), 0.0
        judge = self._judge(inner, out, loss.sigma)
        # Each compared row counts by the weight of its trial, as it does in the error.
        rows = (judge.windows.scale > 0.0).any(axis=2).sum(axis=1)
        count = float(rows @ np.array([loss.weight(trial.name) for trial in out])[judge.windows.trial])
        return judge.standardised(found.values) * judge.windows.samples, count

    def _judge(self, inner: Problem, out: Sequence[Trial], sigma: Mapping[str, float]) -> TrajectoryObjective:
        """Predictions of the trials left out, each weighing what it weighs in the fit."""
        dt = step_of(inner.trials, self.dt)
        return TrajectoryObjective.build(
            replace(inner, nuisance=Nuisance()), out, sigma,
            window=self.window or max(trial.duration for trial in out), dt=dt,
            every=every_of(self.every, dt), method=self.method, threads=self.threads,
        )  # fmt: skip


def _left_part(own: Widths, problem: Problem, width: float, part: int) -> tuple[float, float]:
    return own.left_part(problem, width, part)


def _pooled(parts: Iterable[tuple[float, float]]) -> float:
    """Standardised mean squared error of all parts; infinite as soon as one is."""
    total, count = 0.0, 0.0
    for error, rows in parts:
        total, count = total + error, count + rows
        if math.isinf(error):
            return error
    return total / max(count, 1e-300)


@dataclass(frozen=True)
class _Kept:
    """The file of the scores: of which problem, and (width, score); infinite where the model blew up."""

    digest: str
    scores: tuple[tuple[float, Annotated[float, Limits(null=math.inf)]], ...]


@dataclass
class Scores:
    """Score of each width; the only mutable record of the selection.

    Attributes:
        path: file of the scores, or None to keep nothing.
        digest: fingerprint of the problem they belong to.
        found: score by width; infinite where the model blew up.
    """

    path: Path | None
    digest: str
    found: dict[float, float] = field(default_factory=dict[float, float])

    @staticmethod
    def beside(checkpoint: Path | None, digest: str) -> Scores:
        """Read the file beside `checkpoint` if it is of this problem; an empty record if there is none.

        Raises:
            ResumeError: the file belongs to another problem.
        """
        path = checkpoint and checkpoint.with_suffix(".widths.json")
        if path is None or not path.exists():
            return Scores(path, digest)
        try:
            kept = read_json(path, _Kept, _SCHEMA)
        except RequestError:
            begin_anew(path)
            return Scores(path, digest)
        if kept.digest != digest:
            raise foreign(path)
        return Scores(path, digest, dict(kept.scores))

    def note(self, width: float, score: float) -> None:
        """Note the score of a width, and write all in one step."""
        self.found[width] = score
        if self.path is not None:
            write_whole(self.path, to_json(_Kept(self.digest, tuple(self.found.items())), _SCHEMA))
