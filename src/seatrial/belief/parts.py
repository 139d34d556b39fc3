"""Fits that leave trials out: the errors on those are the errors to expect, which residuals of a fit are not.

Recordings are dealt into parts (`study.folds`); every part is predicted by a fit to the others.  A fit begins where
the whole one ended, so that a part takes a few iterations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..core.executors import Pool
from ..core.files import packed, write_whole
from ..core.values import dataclass, replace
from ..data import Array, Trial
from ..identify import Fit, Problem, StudyError
from ..identify.resume import digest, kept_arrays
from .posterior import Posterior


@dataclass(frozen=True)
class LeftOut:
    """A fit and the trials that it has not seen.

    Attributes:
        held: posterior of the fit to the others.
        trials: those left out.
    """

    held: Posterior
    trials: tuple[Trial, ...]


def begun(estimator: Any, problem: Problem, fit: Fit) -> tuple[Any, Problem]:
    """Estimator and problem of a fit to fewer trials: what was chosen stays chosen, and it begins at the whole fit."""
    if hasattr(estimator, "settled"):
        estimator, problem = estimator.settled(problem, fit)
    own = dict(zip((one.path for one in fit.free), fit.values.tolist(), strict=True))
    plain = {name: value for name, value in (("later", ()), ("starts", 1)) if hasattr(estimator, name)}
    started = replace(problem, free=problem.vector.started(own), validation=(), linted=True)
    return (replace(estimator, **plain) if plain else estimator), started


def left_out(
    estimator: Any, problem: Problem, fit: Fit, held: Posterior, *, out: Sequence[Sequence[Trial]],
    folder: Path | None = None, pool: Pool | None = None,
    each: Callable[[int], object] = lambda done: None,
) -> Iterator[LeftOut]:  # fmt: skip
    """Fits to all trials but one part, for every part in turn.

    Args:
        fit: the whole one, of `problem` by `estimator`.
        out: the trials of each part (`study.folds`).
        held: its posterior; where that was sampled, those of the parts are as wide, about their own estimates.
        folder: where parts that are done are kept, so that a killed run goes on; None keeps nothing.
        pool: computes the parts; None does so here.
        each: called with the number of parts that are done.

    Raises:
        FitError: a fit fails.
    """
    who, all_of_it = begun(estimator, problem, fit)
    parts = len(out)
    inner = [all_of_it.without(some) for some in out]
    files = [None if folder is None else folder / f"part-{k + 1}-of-{parts}.npz" for k in range(parts)]
    kept = [_kept(file, who, one) for file, one in zip(files, inner, strict=True)]
    todo = [k for k in range(parts) if kept[k] is None]
    fresh = (pool.ordered if pool else _here)(_fitted, [(who, inner[k]) for k in todo])
    for k, some in enumerate(out):
        mean, covariance = kept[k] or next(fresh)
        file = files[k]
        if kept[k] is None and file is not None:
            write_whole(file, packed(digest=digest(inner[k], who), mean=mean, covariance=covariance))
        each(k + 1)
        names = inner[k].vector.paths
        ship = inner[k].ship.having(dict(zip(names, mean.tolist(), strict=True)))
        samples = None if held.samples is None else held.samples - held.mean + mean
        yield LeftOut(Posterior(ship, inner[k].free, mean, covariance, samples=samples), tuple(some))


def _here(work: Callable[..., Any], pieces: Sequence[tuple[Any, ...]]) -> Iterator[Any]:
    return (work(*piece) for piece in pieces)


def _fitted(estimator: Any, problem: Problem) -> tuple[Array, Array]:
    fit = estimator.fit(problem)
    if len(fit.values) != len(problem.free):
        raise StudyError(f"{estimator}: fits {len(fit.values)} of {len(problem.free)} parameters; it leaves none out")
    by = np.array([widened(fit, problem).get(path, 1.0) for path in problem.vector.paths])
    return fit.values, fit.covariance / np.outer(by, by)


def widened(fit: Fit, problem: Problem) -> dict[str, float]:
    """By how much residuals widen each sigma of a fit whose study states how errors last; else they are its sigmas."""
    stated = fit.diagnosis is not None and problem.loss.correlation is not None
    return dict(fit.diagnosis.widened) if stated and fit.diagnosis else {}


def _kept(path: Path | None, estimator: Any, problem: Problem) -> tuple[Array, Array] | None:
    held = kept_arrays(path, digest(problem, estimator), ("mean", "covariance"))
    return None if held is None else (np.asarray(held["mean"]), np.asarray(held["covariance"]))
