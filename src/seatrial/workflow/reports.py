"""Reports of studies: each kind of details that a fit or a study brings has its own page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import singledispatch
from pathlib import Path

from ..data import Trial
from ..data.check import check
from ..identify import Fit, Problem
from ..identify.shooting.nuisances import with_current
from ..identify.tuning.fine_tuning import FineTuning
from ..identify.tuning.tuned import Tuning
from ..report.caveats import assumptions
from ..report.report import Report
from ..ships.files import load
from ..study.store import MODEL
from ..study.study import Study
from ..validate.foresight import foreseen
from ..validate.shooting_cases import Shot, shot
from . import Sink
from .comparing import compared, scales

Provenance = Mapping[str, str]


def details(study: Study, fit: Fit, sink: Sink) -> object:
    """What the report is about beside the fit: a rival in several weathers, or what the estimator has found."""
    if study.virtual is None or not study.rival:
        return fit.details
    sink.note(f"{fit.status}; the rival, and both in other weathers")
    return shot(study, fit, study.virtual)


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


@report.register
def _(found: Tuning, study: Study, fit: Fit, page: Path, provenance: Provenance, sink: Sink) -> None:
    """Of a fine-tuning: its ranges and methods, and what the data determine."""
    from ..report.tuning import write

    estimator = study.estimator
    if not isinstance(estimator, FineTuning):
        raise TypeError(f"{type(estimator).__name__} makes no Tuning")
    sink.note("what the data determine: profiles, repetitions, bands")
    write(
        page, found, title=study.title or f"{study.problem.ship.name}: fine-tuning", method=estimator.method,
        provenance={**provenance, "data": sources(study.problem.trials)},
        sections=_identifiability(fit, study.problem, found.tests, estimator),
    )  # fmt: skip


@report.register
def _(found: Shot, study: Study, fit: Fit, page: Path, provenance: Provenance, sink: Sink) -> None:
    """Of a study with a rival on virtual trials: both beside the truth, in several weathers."""
    from ..report.shooting import write

    virtual = study.virtual
    truth = {} if virtual is None else {"truth": f"{virtual.ship.name}, seed {virtual.seed}"}
    write(page, found, provenance={**provenance, **truth})


def judged_on(study: Study) -> Sequence[Trial]:
    """The trials kept back; those of training, where none was."""
    return (*study.problem.validation, *study.test) or study.problem.trials


def sources(trials: Iterable[Trial]) -> str:
    """Where trials come from, each source once."""
    return "; ".join(dict.fromkeys(str(trial.meta.get("source", "")) for trial in trials))


def _counted(parts: Mapping[str, Sequence[Trial]]) -> str:
    return ", ".join(f"{len(trials)} {what}" for what, trials in parts.items() if trials)


def _identifiability(
    fit: Fit, problem: Problem, tests: Sequence[Trial], estimator: FineTuning
) -> list[tuple[str, str]]:  # fmt: skip
    """Sections on the chosen fit: profiles, correlations, restarts, residuals, and bands on the test trials."""
    from ..identify.posterior.ensemble import bands, ensemble
    from ..identify.posterior.misfit import misfit
    from ..identify.posterior.profile import profiles
    from ..report.identifiability import sections
    from ..validate.comparison import manoeuvre

    settings, chosen = estimator.evolution(), replace(problem, free=fit.free)
    group = ensemble(fit, chosen, settings)
    return sections(
        fit, profiles(fit, chosen, settings), group=group, left=misfit(fit, chosen, settings),
        predicted=[bands(group, trial, manoeuvre(trial)) for trial in tests],
    )  # fmt: skip
