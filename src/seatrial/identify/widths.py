"""How freely a correction may move, chosen by trials that were left out.

A polynomial or a network beside the physics needs data in proportion to its numbers.  Its prior says how much it may
say; too wide for the data, it follows their accidents.  `Widths` fits with several widths to parts of the training
trials, judges each by the others, and fits all of them with the best: few trials shrink the correction, down to none,
without anybody's choice.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from ..data import Trial
from . import Fit, FitError, Loss, Nuisance, Problem, Progress, StudyError
from .objective import TrajectoryObjective
from .shooting import Trajectory, digest
from .widths_record import Scores
from .windows import spread


@dataclass(frozen=True)
class Widths(Trajectory):
    """Trajectory least squares, the prior widths of some parameters chosen by left-out trials.

    Attributes:
        widths: factors on the prior deviations of `vary`, one fit each for every part left out; with 0 the parameters
            stay at the mean of their prior.
        vary: shell-style patterns of the parameters whose priors are scaled together.
        parts: into how many parts the trials are dealt, by turns in the order of their names; each is left out once.
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
        if not self.widths or any(not w >= 0.0 for w in self.widths) or len(set(self.widths)) < len(self.widths):
            raise StudyError(f"estimator.widths is {list(self.widths)}; give different factors, none below zero")
        if not self.parts >= 2:
            raise StudyError(f"estimator.parts is {self.parts:g}; leave out one part of two at least")

    def fit(
        self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None
    ) -> Fit:
        """Estimate the free parameters with the width that predicts left-out trials best; see `Estimator`.

        The choice is told in `Fit.status`; with the width 0, `Fit.free` holds the other parameters only.  What each
        width has scored stands beside the checkpoint, so that a killed run does not ask again.

        Raises:
            ResumeError: what stands there belongs to another problem.
            StudyError: fewer trials than parts, or no parameter to vary.
            FitError: the model blows up at every start, or with every width.
        """
        began = time.perf_counter()
        if len(problem.trials) < self.parts:
            raise StudyError(f"estimator.parts is {self.parts}; there are {len(problem.trials)} trials to leave out")
        if not any(self._varied(f.path) for f in problem.free):
            raise StudyError(f"estimator.vary fits no free parameter: {', '.join(self.vary)}")
        alone = len(self.widths) == 1
        scores = {self.widths[0]: 0.0} if alone else self._scores(problem, checkpoint)
        best = min(scores, key=lambda w: scores[w])
        if not np.isfinite(scores[best]):
            raise FitError("left-out trials blow up with every width of the prior; give the smaller ones, 0 the least")
        fit = self._plain(problem, best).fit(self._scaled(problem, best), progress=progress, checkpoint=checkpoint)
        told = ", ".join(f"{w:g}: {score:.3g}" for w, score in scores.items())
        status = f"{fit.status}; prior width {best:g} by left-out trials ({told})"
        return replace(fit, seconds=time.perf_counter() - began, status=status)

    def _scores(self, problem: Problem, checkpoint: Path | None) -> dict[float, float]:
        """Score of each width on left-out trials, those taken from an earlier run that it has finished."""
        record = Scores.beside(checkpoint, digest(problem, self))
        for width in self.widths:
            if width not in record.found:
                record.note(width, self._left_out(problem, width))
        return {width: record.found[width] for width in self.widths}

    def _varied(self, path: str) -> bool:
        return any(fnmatchcase(path, pattern) for pattern in self.vary)

    def _plain(self, problem: Problem, width: float) -> Trajectory:
        """The estimator of one width; `later` goes where nothing would join later."""
        late = [f.path for f in self._scaled(problem, width).free if any(fnmatchcase(f.path, p) for p in self.later)]
        return Trajectory(
            self.window, self.stride, self.every, self.dt, self.method, self.iterations, self.tolerance,
            self.later if late else (), self.starts, self.seed, self.threads,
        )  # fmt: skip

    def _scaled(self, problem: Problem, width: float) -> Problem:
        kept = [f for f in problem.free if width > 0 or not self._varied(f.path)]
        free = tuple(replace(f, sigma=width * f.sigma) if self._varied(f.path) else f for f in kept)
        return replace(problem, free=free)

    def _left_out(self, problem: Problem, width: float) -> float:
        """Standardised mean squared error of all trials, each predicted by a fit that has not seen it."""
        total, samples = 0.0, 0
        ordered = sorted(problem.trials, key=lambda trial: trial.name)
        sigma = dict(problem.loss.sigma) or spread(problem.trials)
        for part in range(self.parts):
            seen = tuple(t for i, t in enumerate(ordered) if i % self.parts != part)
            out = [t for i, t in enumerate(ordered) if i % self.parts == part]
            inner = self._scaled(replace(problem, trials=seen, validation=(), loss=replace(problem.loss, sigma=sigma)),
                                 width)  # fmt: skip
            try:
                found = self._plain(problem, width).fit(inner)
            except FitError:
                return float("inf")
            judge = self._judge(inner, out, sigma)
            total += judge.standardised(found.values) * judge.windows.samples
            samples += judge.windows.samples
        return total / max(samples, 1)

    def _judge(self, inner: Problem, out: Sequence[Trial], sigma: dict[str, float]) -> TrajectoryObjective:
        plain = replace(inner, loss=Loss(sigma, inner.loss.correlation), nuisance=Nuisance())
        dt = self.dt or float(np.median([t.dt for t in inner.trials]))
        return TrajectoryObjective.build(
            plain, out, sigma, window=self.window, dt=dt, every=self.every, method=self.method, threads=self.threads,
        )  # fmt: skip
