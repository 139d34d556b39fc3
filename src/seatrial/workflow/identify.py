"""Identification from study file to report: read, lint, claim the folder, fit with a checkpoint, save, report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

from ..core.files import held_alone
from ..data import DataError
from ..identify import Fit, FitError, StudyError
from ..identify.posterior.verdicts import overruled
from ..identify.resume import forget
from ..identify.watch import start
from ..study.series_run import swept
from ..study.store import SUMMARY, kept, save_fit
from . import SILENT, Outcome, RequestError, Sink
from .plans import Job, Plan, read_plan
from .reports import leads, shown
from .sampling.drawing import check_sample, drawn_for

CHECKPOINT = "checkpoint.npz"


def identify(
    path: Path, out: Path, *, quick: bool = False, only: Sequence[str] = (), free_suspects: bool = False,
    sample: int | None = None, sink: Sink = SILENT,
) -> Outcome[Mapping[str, Fit]]:  # fmt: skip
    """Fit what a study or a table of fits asks for, save it, and write the report; a killed run resumes.

    Args:
        path: the study file.
        out: folder of the run.  What is done in it, with the same data and settings, is not run again.
        quick, only: of a table of fits: its rehearsal, and the models to fit.
        sample: draws of the posterior of a study's fit that are wanted; None draws none.
        free_suspects: as `suspects = "auto"` in [nuisance] of the study, or of the fits of a table that are asked for.

    Returns:
        The fits made in this run by name (that of the study, or "model, seed-N"), and what the run has found.

    Raises:
        RequestError, StudyError, ShipError, DataError, ParameterError: what is asked for cannot be run.
        FitError: the fit failed; of a table, the others are made and the failure is in `errors`.
        BusyError: another process works in the folder.
    """
    path, out = Path(path), Path(out)
    if out.exists() and not out.is_dir():
        raise RequestError(f"{out}: is a file; -o takes a folder")
    with held_alone(out):
        plan = read_plan(path, out, quick, only, free_suspects)
        check_sample(plan, sample)
        jobs, todo = plan.jobs(), plan.left()
        for line in plan.lint() if todo else ():
            sink.note(line)
        _note_done(len(jobs) - len(todo), len(jobs), out, sink)
        fits, failed = _fits(plan, jobs, todo, sink) if todo else ({}, [])
        drawn = drawn_for(jobs[0], fits, sample, sink) if sample else {}
        if todo or plan.partial or drawn:
            plan.report({**fits, **drawn}, failed, sink)
        for job in jobs:
            if (job.where / SUMMARY).exists():
                forget(job.where / CHECKPOINT)
        document = plan.document()
        errors = (f"{len(todo) - len(fits)} of {len(todo)} fits failed, first {failed[0]}",) if failed else ()
        said = leads(document, out, plan.kept_back)
        blocks = (*said, *shown(document, out, plan.kept_back))
        return Outcome(fits, {**document, "run": str(out)}, blocks, errors, said)


def resumes(out: Path) -> bool:
    """Whether a run in this folder continues from what an interrupted one has left."""
    return any(True for name in (f"{Path(CHECKPOINT).stem}*.npz", SUMMARY) for _ in out.rglob(name))


def _note_done(done: int, count: int, out: Path, sink: Sink) -> None:
    if done == count:
        what = "this study is done already" if count == 1 else "every fit is done already"
        sink.note(f"{out}: {what}, with the same data and settings; nothing was run")
    elif done:
        sink.note(f"{out}: {done} of {count} fits are done already")


def _fits(
    plan: Plan, jobs: Sequence[Job], todo: Sequence[Job], sink: Sink
) -> tuple[dict[str, Fit], list[str]]:  # fmt: skip
    """Fit one job after the other; those that lack PyTorch are reported together."""
    fits: dict[str, Fit] = {}
    failed: list[str] = []
    untrained: dict[str, list[str]] = {}
    files = {job.name: job.where / SUMMARY for job in todo} if plan.partial else {}
    before = [job.name for job in jobs if job.name not in {one.name for one in todo}]
    with sink.fitting(plan.title, files, before):
        for number, job in enumerate(todo, start=len(jobs) - len(todo) + 1):
            if plan.partial:
                sink.note(f"{number} of {len(jobs)}: {job.name}")
            try:
                fits[job.name] = _fit(plan, job, sink)
            except StudyError as error:
                if not (plan.partial and _lacks_torch(error)):
                    raise
                untrained.setdefault(str(error), []).append(job.name.rpartition(", ")[0])
            except FitError as error:
                if not plan.partial:
                    raise
                failed.append(f"{job.name}: {error}")
                sink.note(f"error: {failed[-1]}")
        for reason, keys in untrained.items():
            failed.append(f"{', '.join(dict.fromkeys(keys))}: {reason}")
            sink.note(f"error: {failed[-1]}")
    sink.reporting("" if plan.partial else next(iter(fits.values())).status)
    return fits, failed


def _lacks_torch(error: StudyError) -> bool:
    from ..identify.networks.training import NoTorchError

    return isinstance(error, NoTorchError)


def _fit(plan: Plan, job: Job, sink: Sink) -> Fit:
    """Fit one job and save it."""
    with ExitStack() as stack:
        stack.enter_context(swept(job.where, plan.out))
        stack.enter_context(kept(job.where, plan.claim(job)))
        progress = sink.fit(job.name, job.problem, job.restart, several=job.several)
        try:
            fit = job.estimator.fit(job.problem, progress=progress, checkpoint=job.where / CHECKPOINT)
        except StudyError as error:  # an estimator does not know the file
            if plan.partial and _lacks_torch(error):
                raise
            raise StudyError(str(error) if str(plan.path) in str(error) else f"{plan.path}: {error}") from None
    fit = overruled(fit, job.unidentified)
    start(progress, fit.ship)
    if job.spread is not None:
        _keep_members(job, fit, job.spread, sink)
    save_fit(fit, job.where, job.problem, study=job.study, text=job.text, scale=job.scale)
    return fit


def _keep_members(job: Job, fit: Fit, sigma: Mapping[str, float], sink: Sink) -> None:
    """Write the posterior members of a fitted hybrid to its folder; other families have none.

    Args:
        sigma: scale of each state.
        sink: receives why there are none, where a hybrid has none.
    """
    from ..models.hybrid import Hybrid
    from ..validate.spread import NAME, members, save_members

    if not isinstance(fit.ship.model, Hybrid):
        return
    try:
        found = members(fit, job.problem, job.estimator, sigma, restart=job.restart)
    except DataError as error:
        sink.note(f"warning: no members, so predictions cannot report their spread: {error}")
        return
    save_members(found, job.where / NAME)
