"""Mean of a hybrid's fits with several prior widths of its correction: nothing is selected.

A correction beside the physics needs data in proportion to the number of its parameters.  `widths:Widths` selects the
width that predicts left-out trials best, and from some thirty recordings that choice is itself uncertain.  Physics
alone errs by its form and a wide correction by the accidents of its data, so their errors have little in common, and
the mean of the fits is better than the fit of any width.  So it is with fits to other windows of the same trials.  The
correction is linear in its weights: the mean of the parameters is, but for the physics between the fits, the mean of
the forces, and one model.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...core.executors import Pool
from ...core.values import dataclass, replace
from ...data import Array
from .. import Fit, FitError, Problem, Progress, StudyError
from ..lint import linted
from ..resume import digest
from ..trajectory.local import finished
from ..trajectory.shooting import Trajectory
from ..watch import stage
from .pushed import undisturbed
from .widths import Widths


@dataclass(frozen=True)
class Averaged(Trajectory):
    """Trajectory least squares with several prior widths of some parameters, and the mean of their parameters.

    The fits go from the narrowest width to the widest, each from where the one before ended: a correction should not
    learn what the physics can explain.  With `pushed` there is one more before them: physics alone on windows that do
    not overlap, which also tells what to leave out.

    Attributes:
        widths: factors on the prior deviations of `vary`, one fit each; with 0 these stay at the mean of their prior.
        vary: shell-style patterns of the parameters whose priors are scaled together.
        pushed: the fits of `widths` leave out the seconds in which something pushes the ship that a first fit of width
            0, a member of the mean too, does not hold (`pushed`), means of so many seconds being compared [s]; None
            fits to all of the trials and makes no first fit.
    """

    widths: tuple[float, ...] = (0.0, 0.3, 1.0)
    vary: tuple[str, ...] = ("residual_*", "unit_*")
    pushed: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        choice = Widths(widths=self.widths, vary=self.vary)  # refuses widths and patterns that cannot be
        object.__setattr__(self, "widths", tuple(sorted(choice.widths)))
        object.__setattr__(self, "vary", choice.vary)
        if self.pushed is not None and not self.pushed > 0.0:
            raise StudyError(f"estimator.pushed is {self.pushed:g}; it is the seconds of a mean, above zero")
        if self.later:
            raise StudyError("estimator.later: each width goes on from the one before; leave it out")

    @property
    def estimates_common(self) -> bool:
        """It estimates no errors of instruments."""
        return False

    @property
    def weights_stay(self) -> bool:
        """Fits whose parameters are averaged need one set of weights."""
        return True

    @linted
    def fit(
        self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None,
        pool: Pool | None = None,
    ) -> Fit:  # fmt: skip
        """Estimate the free parameters as the mean over the widths; see `Estimator`.

        Covariance and verdicts are those at the mean, under the priors as the problem has them.

        Raises:
            StudyError: no parameter to vary, or one of them without a prior.
            FitError: the model blows up with one of the widths, or at the mean.
        """
        began = time.perf_counter()
        Widths(widths=self.widths, vary=self.vary, parts=2).check_varied(problem)
        fits = list(self.each(problem, progress=progress, checkpoint=checkpoint, pool=pool))
        mean = np.mean([found for found, _ in fits], axis=0)
        objective, _ = self._objectives(problem)
        p = objective.extended(mean)
        starts = objective.begun(p)
        cost = objective.cost(p, starts)
        if not np.isfinite(cost):
            raise FitError("the model blows up at the mean of the widths; give widths that are closer together")
        history = np.concatenate([fit.history for _, fit in fits])
        told = ", ".join(f"{w:g} ({fit.status})" for w, (_, fit) in zip(self.rounds, fits, strict=True))
        out = finished(problem, objective, p, starts, history,
                       sum(fit.evaluations for _, fit in fits), f"mean of prior widths {told}",
                       digest(problem, self))  # fmt: skip
        return replace(out, objective=cost, seconds=time.perf_counter() - began)

    @property
    def rounds(self) -> tuple[float, ...]:
        """Width of each fit of the mean, in turn."""
        return self.widths if self.pushed is None else (0.0, *self.widths)

    def each(
        self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None,
        pool: Pool | None = None,
    ) -> Iterator[tuple[Array, Fit]]:  # fmt: skip
        """Values of all free parameters in each of `rounds`, shape (free,), and the fit."""
        choice, begun = Widths(widths=self.widths, vary=self.vary, parts=2), problem
        means, plain = choice.means(problem), self._plain()
        for k, width in enumerate(self.rounds):
            first = self.pushed is not None and k == 0
            stage(progress, f"averaging widths: fit {k + 1} of {len(self.rounds)}")
            kept = None if checkpoint is None else checkpoint.with_suffix(f".width{k}{checkpoint.suffix}")
            who = replace(plain, stride=None) if first else plain
            fit = who.fit(choice.scaled(begun, width), progress=progress, checkpoint=kept, pool=pool)
            found = means | fit.vector.by_path(fit.values)
            begun = replace(begun, free=problem.vector.started(found))
            if first and self.pushed is not None:
                begun = replace(begun, trials=undisturbed(fit.ship, problem.trials, self.pushed))
            yield np.array([found[f.path] for f in problem.free]), fit

    def _plain(self) -> Trajectory:
        return Trajectory(
            self.window, self.stride, self.every, self.dt, self.method, self.iterations, self.tolerance, (),
            self.starts, self.seed, self.threads, self.initial,
        )  # fmt: skip
