"""Reports of studies: each kind of details that a fit or a study brings has its own page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import singledispatch
from pathlib import Path

from ..data import Trial
from ..data.check import check
from ..identify import Fit
from ..identify.nuisance import with_current
from ..report.evidence import assumptions
from ..report.report import Report
from ..ships.files import load
from ..study.store import MODEL
from ..study.study import Study
from ..validate.foresight import foreseen
from . import Sink
from .comparing import compared, scales

Provenance = Mapping[str, str]


def details(study: Study, fit: Fit, sink: Sink) -> object:
    """What the report is about beside the fit: a rival in several weathers, or what the estimator has found."""
    if study.virtual is not None and study.rival:
        from .pages import rivals

        sink.note(f"{fit.status}; the rival, and both in other weathers")
        return rivals(study, fit, study.virtual)
    if fit.details is not None:
        from . import pages as pages  # registers those of the package
    return fit.details


@singledispatch
def report(found: object, study: Study, fit: Fit, page: Path, provenance: Provenance, sink: Sink) -> None:
    """Write the page of a study and its numbers beside it, by the kind of its details; register others here.

    Without any, the fit is compared with the trials kept back (those of training, where none was).

    Args:
        found: what `details` returns.
        page: the file; its folder holds the saved fit.
        provenance: study, digest, version and command, in words.
    """
    problem, trials, out = study.problem, judged_on(study), page.parent
    ahead, missing = foreseen(study, fit.ship)
    moved = [with_current(trial, fit.nuisances) for trial in trials]
    fitted = load(out / MODEL)
    comparisons, failed = compared(fitted, moved, study.restart, scales(trials, study.sigma), problem.ship)
    for line in failed:
        sink.note(f"error: {line}")
    Report(
        study.title or f"{fit.ship.name}: {'fitted' if study.name == 'study' else f'study {study.name}'}",
        comparisons, fit, tuple(t.name for t in problem.trials),
        (*missing, *(str(f) for t in (*problem.trials, *trials) for f in check(t) if f.severity == "error")),
        assumptions(fit.ship, [f.path for f in fit.free]), ahead,
        {**provenance, "trials": _counted({"for training": problem.trials, "for validation": problem.validation,
                                           "kept back": study.test})},
    ).write(page)  # fmt: skip


def judged_on(study: Study) -> Sequence[Trial]:
    """The trials kept back; those of training, where none was."""
    return (*study.problem.validation, *study.test) or study.problem.trials


def sources(trials: Iterable[Trial]) -> str:
    """Where trials come from, each source once."""
    return "; ".join(dict.fromkeys(str(trial.meta.get("source", "")) for trial in trials))


def _counted(parts: Mapping[str, Sequence[Trial]]) -> str:
    return ", ".join(f"{len(trials)} {what}" for what, trials in parts.items() if trials)
