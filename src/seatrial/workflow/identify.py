"""Identification from study file to report: read, lint, claim the folder, fit with a checkpoint, save, report."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path

from ..core import executors
from ..core.executors import Pool
from ..core.files import held_alone
from ..data import DataError
from ..identify import Fit, FitError, Progress, Spread, StudyError
from ..identify.posterior.verdicts import overruled
from ..identify.resume import digest, forget
from ..identify.watch import start
from ..report.blocks import fields, joined, line
from ..study.series_run import claimed, swept
from ..study.store import SUMMARY, kept, save_fit
from . import SILENT, Outcome, RequestError, Sink
from .plans import Job, Plan, read_plan
from .reports import leads, shown
from .request import Note
from .sampling.drawing import check_sample, drawn_for

CHECKPOINT = "checkpoint.npz"

_Ended = Fit | FitError | StudyError
"""A fit, or why there is none."""


def identify(
    path: Path, out: Path, *, quick: bool = False, only: Sequence[str] = (), free_suspects: bool = False,
    dask: str | None = None, sample: int | None = None,
    sink: Sink = SILENT,
) -> Outcome[Mapping[str, Fit]]:  # fmt: skip
    """Fit what a study or a table of fits asks for, save it, and write the report; a killed run resumes.

    Args:
        path: the study file.
        out: folder of the run.  What is done in it, with the same data and settings, is not run again.
        quick, only: of a table of fits: its rehearsal, and the models to fit.
        sample: draws of the posterior of a study's fit that are wanted; None draws none.
        free_suspects: as `suspects = "auto"` in [nuisance] of the study, or of the fits of a table that are asked for.
        dask: address of a Dask scheduler, or ``local:N``: the fits of a table, or the independent searches of a study
            (starts, ranges, trials left out, repetitions, profiles), are computed there, with the same numbers.

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
        for warning in plan.lint() if todo else ():
            sink.note(warning)
        _note_done(len(jobs) - len(todo), len(jobs), out, sink)
        with executors.dask(dask, sink.note) if dask and todo else nullcontext(None) as pool:
            fits, failed = _fits(plan, jobs, todo, sink, pool) if todo else ({}, [])
            drawn = drawn_for(jobs[0], fits, sample, sink) if sample else {}
            if todo or plan.partial or drawn:
                plan.report({**fits, **drawn}, failed, sink, pool)
        for job in jobs:
            if (job.where / SUMMARY).exists():
                forget(job.where / CHECKPOINT)
        document = plan.document()
        errors = (f"{len(todo) - len(fits)} of {len(todo)} fits failed, first {failed[0]}",) if failed else ()
        said = leads(document, out, plan.kept_back)
        blocks = joined(map(line, said)) + shown(document, out, plan.kept_back)
        return Outcome(fits, fields({**document, "run": str(out)}, blocks), errors, said)


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
    plan: Plan, jobs: Sequence[Job], todo: Sequence[Job], sink: Sink, pool: Pool | None
) -> tuple[dict[str, Fit], list[str]]:  # fmt: skip
    """Fit the jobs; those that lack PyTorch are reported together."""
    fits: dict[str, Fit] = {}
    failed: list[str] = []
    untrained: dict[str, list[str]] = {}
    files = {job.name: job.where / SUMMARY for job in todo} if plan.partial else {}
    before = [job.name for job in jobs if job.name not in {one.name for one in todo}]
    with sink.fitting(plan.title, files, before):
        if pool is None or not plan.partial:
            ended = _in_turn(plan, len(before), todo, sink, pool)
        else:
            ended = _spread(plan, len(before), todo, sink, pool)
        for job, found in ended:
            if isinstance(found, Fit):
                fits[job.name] = found
            elif isinstance(found, FitError):
                failed.append(f"{job.name}: {found}")
                sink.note(f"error: {failed[-1]}")
            else:
                untrained.setdefault(str(found), []).append(job.name.rpartition(", ")[0])
        for reason, keys in untrained.items():
            failed.append(f"{', '.join(dict.fromkeys(keys))}: {reason}")
            sink.note(f"error: {failed[-1]}")
    sink.reporting("" if plan.partial else next(iter(fits.values())).status)
    return fits, failed


def _in_turn(
    plan: Plan, before: int, todo: Sequence[Job], sink: Sink, pool: Pool | None
) -> Iterator[tuple[Job, _Ended]]:  # fmt: skip
    """One job after the other; a pool computes the searches that a fit is made of."""
    for number, job in enumerate(todo, start=before + 1):
        if plan.partial:
            sink.note(f"{number} of {before + len(todo)}: {job.name}")
        progress = sink.fit(job.name, job.problem, job.restart, several=job.several)
        claim = partial(plan.claim, job)
        yield job, _ended(plan.partial, job, (plan.path, plan.out), claim, sink.note, progress, pool)


def _spread(
    plan: Plan, before: int, todo: Sequence[Job], sink: Sink, pool: Pool
) -> Iterator[tuple[Job, _Ended]]:  # fmt: skip
    """All jobs through the pool, each as it ends; a job writes its own files."""
    full = [replace(job, where=job.where.absolute()) for job in todo]
    places = plan.path.absolute(), plan.out.absolute()
    ended = pool.each(_elsewhere, ((job, places, number) for number, job in enumerate(full)))
    for count, (number, found, notes) in enumerate(ended, start=before + 1):
        for told in notes:
            sink.note(told)
        sink.note(f"{count} of {before + len(todo)} done: {todo[number].name}")
        yield todo[number], found


def _elsewhere(job: Job, places: tuple[Path, Path], number: int) -> tuple[int, _Ended, list[str]]:
    """One job of a table, on a worker, with its notes."""
    notes: list[str] = []
    claim = partial(claimed, job.where, digest(job.problem, job.estimator), job.study)
    return number, _ended(True, job, places, claim, notes.append, None, None), notes


def _ended(
    several: bool, job: Job, places: tuple[Path, Path], claim: Callable[[], bool], note: Note,
    progress: Progress | None, pool: Pool | None,
) -> _Ended:  # fmt: skip
    """The fit of a job; of one of several, what it failed by too."""
    try:
        return _fit(job, places, claim, note, progress, pool)
    except (StudyError, FitError) as error:
        if several and (isinstance(error, FitError) or _lacks_torch(error)):
            return error
        raise


def _lacks_torch(error: StudyError) -> bool:
    from ..identify.networks.training import NoTorchError

    return isinstance(error, NoTorchError)


def _fit(
    job: Job, places: tuple[Path, Path], claim: Callable[[], bool], note: Note, progress: Progress | None,
    pool: Pool | None,
) -> Fit:  # fmt: skip
    """Fit one job and save it; `places` are the file of the study and the folder of the run."""
    path, out = places
    with ExitStack() as stack:
        stack.enter_context(swept(job.where, out))
        stack.enter_context(kept(job.where, claim()))
        checkpoint, who = job.where / CHECKPOINT, job.estimator
        try:
            if pool is not None and isinstance(who, Spread):
                fit = who.fit(job.problem, progress=progress, checkpoint=checkpoint, pool=pool)
            else:
                fit = who.fit(job.problem, progress=progress, checkpoint=checkpoint)
        except StudyError as error:  # an estimator does not know the file
            if _lacks_torch(error) or str(path) in str(error):
                raise
            raise StudyError(f"{path}: {error}") from None
    fit = overruled(fit, job.unidentified)
    start(progress, fit.ship)
    if job.spread is not None:
        _keep_members(job, fit, job.spread, note)
    save_fit(fit, job.where, job.problem, study=job.study, text=job.text, scale=job.scale, test=job.test, file=job.file)
    return fit


def _keep_members(job: Job, fit: Fit, sigma: Mapping[str, float], note: Note) -> None:
    """Write the posterior members of a fitted hybrid to its folder; other families have none.

    Args:
        sigma: scale of each state.
        note: receives why there are none, where a hybrid has none.
    """
    from ..belief.spread import NAME, members, save_members
    from ..models.hybrid import Hybrid

    if not isinstance(fit.ship.model, Hybrid):
        return
    try:
        found = members(fit, job.problem, job.estimator, sigma, restart=job.restart)
    except DataError as error:
        note(f"warning: no members, so predictions cannot report their spread: {error}")
        return
    save_members(found, job.where / NAME)
