"""Identification from study file to report: read, lint, claim the folder, fit with a checkpoint, save, report."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from ..core import executors
from ..core.executors import Pool
from ..core.files import held_alone
from ..data import DataError
from ..identify import Fit, FitError, Progress, Spread, StudyError
from ..identify.lint import headlines, lines
from ..identify.posterior.verdicts import overruled
from ..identify.resume import forget
from ..identify.watch import start
from ..report.blocks import fields
from ..report.page import write
from ..study.cells import NUMBERS, PAGE, Cell, check, swept
from ..study.series import FULL, QUICK, Series, is_series, read_series
from ..study.store import SUMMARY, claim, kept, save_fit
from ..study.study import Study, read_study
from ..validate.metrics import scales
from . import SILENT, Outcome, RequestError, Sink
from .reports import Made, leads, reporting, summary
from .request import Note
from .sampling.drawing import check_sample, drawn_for

CHECKPOINT = "checkpoint.npz"
"""Where a fit that is cut off goes on."""

_Ended = Fit | FitError | StudyError
"""A fit, or why there is none."""


def identify(
    path: Path, out: Path, *, quick: bool = False, only: Sequence[str] = (), free_suspects: bool = False,
    dask: str | None = None, sample: int | None = None, details: bool = False, sink: Sink = SILENT,
) -> Outcome[Mapping[str, Fit]]:  # fmt: skip
    """Fit what a study or a table of fits asks for, save it, and write the report; a killed run resumes.

    Args:
        path: the study file.
        out: folder of the run.  What is done in it, with the same data and settings, is not run again.
        quick, only: of a table of fits: its rehearsal, and the models to fit.
        sample: draws of the posterior of a study's fit that are wanted; None draws none.
        free_suspects: as `suspects = "auto"` in [nuisance] of the study, or of the fits of a table that are asked for.
        details: whether what is shown of a fit has its parameters, residuals and standardised errors too.
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
        study = _read(path, quick, only, free_suspects)
        cells = _scaled(study)
        check_sample(study, sample)
        todo = [cell for cell in cells if not cell.done(out)]
        issues = check(todo or (cells if sample else ()), study.apart)
        for warning in (*study.notes, *(lines(issues) if details else headlines(issues))) if todo else ():
            sink.note(warning)
        _note_done(len(cells) - len(todo), len(cells), out, sink)
        report = reporting(study, out)
        with executors.dask(dask, sink.note) if dask and todo else nullcontext(None) as pool:
            fits, failed = _fits(study, out, cells, todo, sink, pool) if todo else ({}, [])
            drawn = drawn_for(cells[0], out, fits, sample, sink) if sample else {}
            if todo or study.partial or drawn:
                command = _command(path, out, quick, only, free_suspects)
                page = report.page(Made({**fits, **drawn}, failed, command, sink, pool, lines(issues)))
                write(out / PAGE, page)
                numbers = page.document
            else:
                numbers = _told(out / NUMBERS)
        for cell in cells:
            if (out / cell.folder / SUMMARY).exists():
                forget(out / cell.folder / CHECKPOINT)
        document = report.document(numbers)
        errors = (f"{len(todo) - len(fits)} of {len(todo)} fits failed, first {failed[0]}",) if failed else ()
        errors += _useless(numbers)
        said = leads(document, out, study.kept_back)
        blocks = summary(report, document, said, out, details)
        return Outcome(fits, fields({**document, "run": str(out)}, blocks), errors, said)


def _useless(numbers: Mapping[str, Any]) -> tuple[str, ...]:
    """Why nothing is to be read from a fit: its model blew up in every trial that it was to be compared with."""
    errors = numbers.get("standardised") or {}
    mine = errors.get("fitted")
    if not errors or (mine is not None and math.isfinite(mine)):
        return ()
    return ("the fitted model blows up in every trial that it is compared with: its parameters say nothing; shorten "
            "`restart`, or bound what [free] lets grow",)  # fmt: skip


def _read(path: Path, quick: bool, only: Sequence[str], suspects: bool) -> Study | Series:
    """What a file asks for: a study, which is a table of one cell, or a table of fits."""
    if is_series(path):
        return read_series(path, QUICK if quick else FULL, suspects=suspects, only=only)
    if quick or only:
        raise RequestError(f"{path}: is one study; --quick and --only are for a table of fits ('seatrial-series/1')")
    study = read_study(path, suspects=suspects)
    if study.rivals and not study.test:
        raise StudyError(f"{path}: [rival] is judged on trials kept back, of a truth that is known; name some in "
                         "data.test, of [virtual]")  # fmt: skip
    return study


def _scaled(study: Study | Series) -> tuple[Cell, ...]:
    """The cells with the scales by which the fits are judged; none where a report scales by itself."""
    if isinstance(study, Series):
        scale = scales(study.apart, study.sigma)
        return tuple(replace(cell, scale=scale, spread=scale) for cell in study.cells)
    (cell,) = study.cells
    if cell.several or study.rivals:
        return (cell,)
    return (replace(cell, scale=scales(study.judged_on, study.sigma),
                    spread=scales(study.problem.trials, study.sigma)),)  # fmt: skip


def _told(path: Path) -> Mapping[str, Any]:
    """What the report of a finished run says: it is not made twice, as what it took minutes to find is in no fit.

    Raises:
        StudyError: it was damaged since.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StudyError(f"{path}: cannot be read: {error}; delete it, and the study is fitted anew") from None
    if not isinstance(found, dict):
        raise StudyError(f"{path}: holds no report; delete it, and the study is fitted anew")
    return cast("dict[str, Any]", found)


def _command(path: Path, out: Path, quick: bool, only: Sequence[str], suspects: bool) -> str:
    """What made a run, for its report."""
    options = " --quick" * quick + "".join(f" --only {name}" for name in only) + " --free-suspects" * suspects
    return f"seatrial identify {path}{options} -o {out}"


def _heading(study: Study | Series) -> str:
    """The title of a study; where it has none, ship and file."""
    return study.title if study.title or isinstance(study, Series) else f"{study.problem.ship.name}: {study.name}"


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
    study: Study | Series, out: Path, cells: Sequence[Cell], todo: Sequence[Cell], sink: Sink, pool: Pool | None
) -> tuple[dict[str, Fit], list[str]]:  # fmt: skip
    """Fit the cells that are left; those that lack PyTorch are reported together."""
    fits: dict[str, Fit] = {}
    failed: list[str] = []
    untrained: dict[str, list[str]] = {}
    files = {cell.name: out / cell.folder / SUMMARY for cell in todo} if study.partial else {}
    left = {cell.name for cell in todo}
    before = [cell.name for cell in cells if cell.name not in left]
    with sink.fitting(_heading(study), files, before):
        way = _in_turn if pool is None or not study.partial else _spread
        for cell, found in way(study, out, len(before), todo, sink, pool):
            if isinstance(found, Fit):
                fits[cell.name] = found
            elif isinstance(found, FitError):
                failed.append(f"{cell.name}: {found}")
                sink.note(f"error: {failed[-1]}")
            else:
                untrained.setdefault(str(found), []).append(cell.key)
        for reason, keys in untrained.items():
            failed.append(f"{', '.join(dict.fromkeys(keys))}: {reason}")
            sink.note(f"error: {failed[-1]}")
    sink.reporting("" if study.partial else next(iter(fits.values())).status)
    return fits, failed


def _in_turn(
    study: Study | Series, out: Path, before: int, todo: Sequence[Cell], sink: Sink, pool: Pool | None
) -> Iterator[tuple[Cell, _Ended]]:  # fmt: skip
    """One cell after the other; a pool computes the searches that a fit is made of."""
    for number, cell in enumerate(todo, start=before + 1):
        if study.partial:
            sink.note(f"{number} of {before + len(todo)}: {cell.name}")
        progress = sink.fit(cell.name, cell.posed.problem, cell.restart, several=cell.several)
        yield cell, _ended(cell, (study.path, out), sink.note, progress, pool)


def _spread(
    study: Study | Series, out: Path, before: int, todo: Sequence[Cell], sink: Sink, pool: Pool | None
) -> Iterator[tuple[Cell, _Ended]]:  # fmt: skip
    """All cells through the pool, each as it ends; a cell writes its own files."""
    if pool is None:
        raise TypeError("cells are spread over a pool")
    places = study.path.absolute(), out.absolute()
    ended = pool.each(_elsewhere, ((cell, places, number) for number, cell in enumerate(todo)))
    for count, (number, found, notes) in enumerate(ended, start=before + 1):
        for told in notes:
            sink.note(told)
        sink.note(f"{count} of {before + len(todo)} done: {todo[number].name}")
        yield todo[number], found


def _elsewhere(cell: Cell, places: tuple[Path, Path], number: int) -> tuple[int, _Ended, list[str]]:
    """One cell of a table, on a worker, with its notes."""
    notes: list[str] = []
    return number, _ended(cell, places, notes.append, None, None), notes


def _ended(
    cell: Cell, places: tuple[Path, Path], note: Note, progress: Progress | None, pool: Pool | None
) -> _Ended:  # fmt: skip
    """The fit of a cell; of one of a table, what it failed by too."""
    try:
        return _fit(cell.posed, places, note, progress, pool)
    except (StudyError, FitError) as error:
        if cell.key and (isinstance(error, FitError) or _lacks_torch(error)):
            return error
        raise


def _lacks_torch(error: StudyError) -> bool:
    from ..identify.networks.training import NoTorchError

    return isinstance(error, NoTorchError)


def _fit(
    cell: Cell, places: tuple[Path, Path], note: Note, progress: Progress | None, pool: Pool | None
) -> Fit:  # fmt: skip
    """Fit one cell and save it; `places` are the file of the study and the folder of the run."""
    path, out = places
    where, who = out / cell.folder, cell.estimator
    with ExitStack() as stack:
        stack.enter_context(swept(where, out))
        stack.enter_context(kept(where, claim(where, cell.digest, cell.study)))
        checkpoint = where / CHECKPOINT
        try:
            if pool is not None and isinstance(who, Spread):
                fit = who.fit(cell.problem, progress=progress, checkpoint=checkpoint, pool=pool)
            else:
                fit = who.fit(cell.problem, progress=progress, checkpoint=checkpoint)
        except StudyError as error:  # an estimator does not know the file
            if _lacks_torch(error) or str(path) in str(error):
                raise
            raise StudyError(f"{path}: {error}") from None
    fit = overruled(fit, cell.unidentified)
    start(progress, fit.ship)
    if cell.spread is not None:
        _keep_members(cell, where, fit, cell.spread, note)
    save_fit(fit, where, cell.problem, study=cell.study, text=cell.text, scale=cell.scale, test=cell.test,
             file=cell.file)  # fmt: skip
    return fit


def _keep_members(cell: Cell, where: Path, fit: Fit, sigma: Mapping[str, float], note: Note) -> None:
    """Write the posterior members of a fitted hybrid to its folder; other families have none.

    Args:
        sigma: scale of each state.
        note: receives why there are none, where a hybrid has none.
    """
    from ..models.hybrid import Hybrid

    if not isinstance(fit.ship.model, Hybrid):
        return
    from ..belief.spread import NAME, members, save_members

    try:
        found = members(fit, cell.problem, cell.estimator, sigma, restart=cell.restart)
    except DataError as error:
        note(f"warning: no members, so predictions cannot report their spread: {error}")
        return
    save_members(found, where / NAME)
