"""Draws of the posterior of a study's fit: refused, made, resumed, kept in the run folder."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from ...identify import Fit, StudyError
from ...identify.resume import digest_of
from .. import RequestError, Sink

if TYPE_CHECKING:
    from ...belief.drawn import Draws
    from ..plans import Job, Plan

CHECKPOINT = "checkpoint.posterior.npz"
"""Begins as the checkpoint of a fit does, with which it is removed."""

# A line of progress at most so often [s].
_PAUSE = 10.0


def check_sample(plan: Plan, count: int | None) -> None:
    """Refuse a number of draws that a run cannot have, before anything is fitted.

    Raises:
        RequestError: of a table of fits, of too few, or of an estimator with a report of its own.
    """
    from ...belief.sampling.sampling import LEAST

    if count is None:
        return
    if plan.partial:
        raise RequestError(f"{plan.path}: --sample is for one study, not for a table of fits ('seatrial-series/1')")
    if count < LEAST:
        raise RequestError(f"--sample {count}: too few to judge the chains; draw {LEAST} or more")
    (job,) = plan.jobs()
    if job.several:
        raise RequestError(f"{plan.path}: --sample: {type(job.estimator).__name__} makes several fits; "
                           "use shooting:Trajectory")  # fmt: skip


def _unreported(job: Job, kept: Draws) -> bool:
    """Whether the run that made these draws ended before its report: then it left the checkpoint of their chains."""
    path = job.where / CHECKPOINT
    return path.exists() and digest_of(path) == kept.said["digest"]


def drawn_for(job: Job, fits: Mapping[str, Fit], count: int, sink: Sink) -> dict[str, Fit]:
    """The fit of a job with its draws as details, by its name; empty where so many are in its folder already.

    Args:
        fits: made in this run; one that is not among them is read from its folder.
    """
    from ...belief.drawn import read_draws, save_draws
    from ...belief.sampling.sampling import sample
    from ...study.stored import load_fit

    fit = fits.get(job.name) or load_fit(job.where)
    kept = read_draws(job.where)
    if kept is not None and kept.fit == fit.digest and len(kept.flat) >= count and not _unreported(job, kept):
        sink.note(f"{job.where}: {len(kept.flat)} draws of the posterior are done already")
        return {}
    last = time.perf_counter()

    def told(done: int, moves: int) -> None:
        nonlocal last
        if time.perf_counter() - last > _PAUSE:
            last = time.perf_counter()
            sink.note(f"posterior: {done} of {moves} moves of each chain")

    try:
        found = sample(fit, job.problem, job.estimator, count, checkpoint=job.where / CHECKPOINT, told=told)
    except StudyError as error:
        raise StudyError(f"--sample: {error}") from None
    save_draws(found, fit.digest, job.where)
    for line in found.words:
        sink.note(f"posterior: {line}")
    return {job.name: replace(fit, details=found)}
