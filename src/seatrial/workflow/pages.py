"""Pages of fine-tunings and of studies with a rival; imported only where there is such a study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..data import Trial
from ..identify import Fit, Problem
from ..identify.tuning.fine_tuning import FineTuning
from ..identify.tuning.tuned import Tuning
from ..report.page import Section
from ..study.study import Study
from ..validate.rivals import Rivals
from ..validate.rivals import judged as rivals
from . import Sink
from .reports import Provenance, report, sources

__all__ = ["rivals"]


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
def _(found: Rivals, study: Study, fit: Fit, page: Path, provenance: Provenance, sink: Sink) -> None:
    """Of a study with a rival on virtual trials: both beside the truth, in several weathers."""
    from ..report.rivals import write

    virtual = study.virtual
    truth = {} if virtual is None else {"truth": f"{virtual.ship.name}, seed {virtual.seed}"}
    write(page, found, provenance={**provenance, **truth})


def _identifiability(
    fit: Fit, problem: Problem, tests: Sequence[Trial], estimator: FineTuning
) -> list[Section]:  # fmt: skip
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
