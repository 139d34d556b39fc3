"""Trials of a study left out of its fit in turn: refused, done, kept in the run folder for the bands of predictions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...identify import Fit, StudyError
from ...study.store import load_fit_summary
from .. import RequestError, Sink

if TYPE_CHECKING:
    from ..plans import Job, Plan


def check_left_out(plan: Plan) -> None:
    """Refuse what cannot leave trials out, before anything is fitted.

    Raises:
        RequestError: a table of fits, an estimator with a report of its own, or too few trials.
    """
    from ...identify.posterior.left_out import LEAST

    if plan.partial:
        raise RequestError(f"{plan.path}: --left-out is for one study, not for a table of fits ('seatrial-series/1')")
    (job,) = plan.jobs()
    if job.several:
        raise RequestError(f"{plan.path}: --left-out: {type(job.estimator).__name__} makes several fits; "
                           "use shooting:Trajectory")  # fmt: skip
    if (count := len(job.problem.trials)) < LEAST:
        raise RequestError(f"{plan.path}: --left-out: {count} trials are too few to leave each out in turn; "
                           f"train on {LEAST} or more")  # fmt: skip


def leave_out(job: Job, fits: Mapping[str, Fit], sink: Sink) -> None:
    """Leave each trial out in turn, and keep what that says of the posterior in the fit.json of the job.

    Args:
        fits: made in this run; one that is not among them is read from its folder.
    """
    from ...identify.posterior.left_out import power
    from ...study.drawn import LEFT_OUT, save_power
    from ...study.stored import load_fit

    if LEFT_OUT in load_fit_summary(job.where):
        sink.note(f"{job.where}: trials were left out in turn already")
        return
    fit = fits.get(job.name) or load_fit(job.where)
    try:
        found = power(fit, job.problem, job.estimator)
    except StudyError as error:
        raise StudyError(f"--left-out: {error}") from None
    save_power(found, job.where)
    for line in found.words:
        sink.note(f"left out: {line}")
