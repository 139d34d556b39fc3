"""Reports of studies, a page for each kind of details of a fit or a study; and the summaries of runs for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial, singledispatch
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.executors import Pool
from ..data import Trial
from ..identify import Fit, Problem
from ..identify.lint import doubts
from ..report.blocks import Body, joined, line, table
from ..report.evidence import assumptions
from ..report.page import Section, write
from ..report.report import Report
from ..ships.files import load
from ..study.store import MODEL
from ..study.study import Study
from ..validate.corrected import corrected, of_trial, shared_by_all, words
from ..validate.foresight import foreseen
from . import Document, Sink, figure
from .comparing import compared, scales
from .request import DEGREE

# Combinations of parameters that a summary lists.
_COMBINED = 6

if TYPE_CHECKING:
    from ..belief.sampling.sampled import Sampled
    from ..identify.tuning.fine_tuning import FineTuning
    from ..identify.tuning.tuned import Tuning
    from ..validate.rivals import Rivals

Provenance = Mapping[str, str]


def details(study: Study, fit: Fit, sink: Sink, pool: Pool | None = None) -> object:
    """What the report is about beside the fit: a rival in several weathers, or what the estimator has found.

    Args:
        pool: who computes what the report of it still needs; None does it here.
    """
    if study.virtual is not None and study.rival:
        from ..validate.rivals import Rivals, judged

        report.register(Rivals, _rivals)
        sink.note(f"{fit.status}; the rival, and both in other weathers")
        return judged(study, fit, study.virtual)
    if fit.details is not None:
        from ..belief.sampling.sampled import Sampled
        from ..identify.tuning.tuned import Tuning

        report.register(Tuning, partial(_tuned, pool=pool))
        report.register(Sampled, _drawn)
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
    _compare(study, fit, page, provenance, sink, None)


def _drawn(found: Sampled, study: Study, fit: Fit, page: Path, provenance: Provenance, sink: Sink) -> None:
    """Of a fit whose posterior was sampled: as without, and what the draws say."""
    _compare(study, fit, page, provenance, sink, found)


def _compare(
    study: Study, fit: Fit, page: Path, provenance: Provenance, sink: Sink, drawn: Sampled | None
) -> None:  # fmt: skip
    """The fit compared with the trials kept back (those of training, where none was), and its posterior."""
    problem, trials, out = study.problem, judged_on(study), page.parent
    ahead, missing = foreseen(study, fit.ship)
    names, model = {trial.name for trial in (*problem.trials, *trials)}, problem.ship.model
    right = [corrected(trial, of_trial(trial.name, fit.nuisances, names), model) for trial in trials]
    fitted = load(out / MODEL)
    comparisons, failed = compared(fitted, right, study.restart, scales(trials, study.sigma), problem.ship)
    changes = _changes(fit, trials)
    for told in (*(f"error: {one}" for one in failed), *(f"note: {one}" for one in changes)):
        sink.note(told)
    Report(
        study.title or f"{fit.ship.name}: {'fitted' if study.name == 'study' else f'study {study.name}'}",
        comparisons, fit, tuple(t.name for t in problem.trials),
        (*missing, *map(str, doubts(problem, study.test))),
        assumptions(fit.ship, [f.path for f in fit.free]), ahead,
        {**provenance, "trials": _counted({"for training": problem.trials, "for validation": problem.validation,
                                           "kept back": study.test})},
        changes=changes, drawn=drawn,
    ).write(page)  # fmt: skip


def _changes(fit: Fit, trials: Sequence[Trial]) -> tuple[str, ...]:
    """What the errors of instruments and the current that the fit found in all trials do to those of its report."""
    shared = shared_by_all(fit.nuisances)
    what = words(shared, fit.ship.model, trials[0]) if shared else ""
    return (f"trials are compared as corrected by {what}, as the fit estimated for all trials of the study",) if what \
        else ()


def _tuned(
    found: Tuning, study: Study, fit: Fit, page: Path, provenance: Provenance, sink: Sink, pool: Pool | None = None,
) -> None:  # fmt: skip
    """Of a fine-tuning: its ranges and methods, and what the data determine."""
    from ..identify.tuning.fine_tuning import FineTuning
    from ..report.tuning import page as page_of

    estimator = study.estimator
    if not isinstance(estimator, FineTuning):
        raise TypeError(f"{type(estimator).__name__} makes no Tuning")
    sink.note("what the data determine: profiles, repetitions, bands")
    write(page, page_of(
        found, title=study.title or f"{study.problem.ship.name}: fine-tuning", method=estimator.method,
        provenance={**provenance, "data": sources(study.problem.trials)},
        sections=_identifiability(fit, study.problem, found.tests, estimator, pool), fit=fit,
    ))  # fmt: skip


def _identifiability(
    fit: Fit, problem: Problem, tests: Sequence[Trial], estimator: FineTuning, pool: Pool | None
) -> list[Section]:  # fmt: skip
    """Sections on the chosen fit: profiles, correlations, restarts, residuals, and bands on the test trials."""
    from ..belief.ensemble import bands, ensemble
    from ..identify.posterior.misfit import misfit
    from ..identify.posterior.profile import profiles
    from ..report.identifiability import sections
    from ..validate.comparison import manoeuvre

    settings, chosen = estimator.evolution(), replace(problem, free=fit.free)
    group = ensemble(fit, chosen, settings, pool=pool)
    return sections(
        fit, profiles(fit, chosen, settings, pool=pool), group=group, left=misfit(fit, chosen, settings),
        predicted=[bands(group, trial, manoeuvre(trial)) for trial in tests],
    )  # fmt: skip


def _rivals(found: Rivals, study: Study, fit: Fit, page: Path, provenance: Provenance, sink: Sink) -> None:
    """Of a study with a rival on virtual trials: both beside the truth, in several weathers."""
    from ..report.rivals import page as page_of

    virtual = study.virtual
    truth = {} if virtual is None else {"truth": f"{virtual.ship.name}, seed {virtual.seed}"}
    write(page, page_of(found, provenance={**provenance, **truth}))


def judged_on(study: Study) -> Sequence[Trial]:
    """The trials kept back; those of training, where none was."""
    return (*study.problem.validation, *study.test) or study.problem.trials


def sources(trials: Iterable[Trial]) -> str:
    """Where trials come from, each source once."""
    return "; ".join(dict.fromkeys(str(trial.meta.get("source", "")) for trial in trials))


def _counted(parts: Mapping[str, Sequence[Trial]]) -> str:
    return ", ".join(f"{len(trials)} {what}" for what, trials in parts.items() if trials)


def shown(document: Document, out: Path, kept_back: bool) -> Body:
    """The summary of the run in `out`.

    Args:
        document: what `plans.Plan.document` returns.
        kept_back: whether it is judged on trials that the fit has not seen.
    """
    of = "trials kept back" if kept_back else "the training trials (none was kept back)"
    summary = _SUMMARIES.get(str(document["schema"]))
    return line(_wrote(out)) if summary is None else summary(document, out, of)


def leads(document: Document, out: Path, kept_back: bool) -> tuple[str, ...]:
    """What speaks against the result of the run in `out`, one short line each; empty where nothing does.

    That the model does not explain the data, with the first ground, and that it predicts worse than before the fit.
    """
    found: Mapping[str, Any] = document
    lost = found.get("worse_than_untuned")
    tested: Mapping[str, Any] = found.get("diagnosis") or {"explained": True}
    said: list[str] = []
    if not tested["explained"]:
        short = str(tested.get("cause", tested["lines"][0])).partition(";")[0]
        said.append(f"not explained: {short}; see {out}/report.html")
    if lacking := found.get("not_explained"):
        named = f"{', '.join(lacking[:3])}{', ...' * (len(lacking) > 3)}"
        said.append(f"not explained: the data of {len(lacking)} fits ({named}); see fit.json of each in {out}/fits")
    if (drawn := found.get("posterior")) and not drawn["converged"]:
        said.append(drawn["words"][0])
    if lost:
        of = "trials kept back" if kept_back else "the training trials"
        mine, before = (figure(lost[label]) for label in ("fitted", "untuned"))
        said.append(f"worse than untuned: {lost.get('what', 'standardised error')} {mine} against {before} before the "
                    f"fit, on {of}")  # fmt: skip
    return tuple(said)


def comparisons(report: Report) -> Body:
    """Standardised errors by trial and label, the pooled ones last."""
    labels = report.labels
    rows = [
        (name, *(figure(found[label].standardised) if label in found else "failed" for label in labels))
        for name, found in report.trials.items()
    ]
    rows.append(("pooled", *(figure(report.pooled[label]) for label in labels)))
    return table(("standardised error", *labels), rows)


def _fit(found: Mapping[str, Any], out: Path, of: str) -> Body:
    """Parameters, standardised errors and forecasts of one fit."""
    status = {v["subject"]: v["status"] for v in found["verdicts"]}
    rows = tuple(
        (path, figure(p["start"]), figure(p["value"]), figure(p["sigma"], 2), figure(p["shrinkage"], 2),
         status.get(path, "at bound" if p["at_bound"] else ""))
        for path, p in found["parameters"].items()
    )  # fmt: skip
    head = ("parameter", "start", "fitted", "sigma", "from data", "verdict")
    parameters = table(head, rows, words=(5,)) if rows else ()  # a network has weights, no parameters
    combined = [f"{v['subject']}: {v['text']}" for v in found["verdicts"] if v["subject"] not in found["parameters"]]
    return parameters + joined(map(line, (
        *combined[:_COMBINED],
        *((f"... and {len(combined) - _COMBINED} more combinations: see {out}/report.html",)
          if len(combined) > _COMBINED else ()),
        *_tested(found),
        *(f"standardised error on {of}, {label}: {figure(value)}" for label, value in found["standardised"].items()),
        *(f"forecast of {f['trial']} over {f['horizon']:g} s, {f['label']}: {figure(f['position'])} m, "
          f"{figure(f['heading'] / DEGREE)} deg" for f in found["forecasts"]),
        f"{found['status']}; {found['seconds']:.1f} s; {_wrote(out)}",
    )))  # fmt: skip


def _tested(found: Mapping[str, Any]) -> Sequence[str]:
    """Whether the model explains the data, and the grounds."""
    return (found.get("diagnosis") or {"lines": ()})["lines"]


def _tuning(found: Mapping[str, Any], out: Path, _: str) -> Body:
    """Losses of each range of a fine-tuning, and its findings."""
    before = [figure(sum(found["untuned"][key].values())) for key in ("tune", "test")]
    rows: list[tuple[str, ...]] = [("untuned", *before, "", "", "", "")]
    for r in found["ranges"]:
        totals = [figure(sum(r[key].values())) for key in ("tune", "test", "left_out")]
        stuck = sum(p["at_bound"] for p in r["parameters"].values())
        chosen = " chosen" if r["ratio"] == found["chosen"] else ""
        seconds = " + ".join(f"{m['seconds']:.1f}" for m in r["methods"].values())
        bounds = f"{stuck} of {len(r['parameters'])}"
        rows.append((f"{r['ratio']:g}{chosen}", *totals, bounds, figure(r["apart"], 2), seconds))
    head = ("a_r", "J tuning", "J test", "J left out", "at a bound", "methods apart", "seconds, CMA-ES + gradient")
    findings = (f"{'warning: ' if f['severity'] == 'warning' else ''}{f['where']}: {f['text']}"
                for f in found["findings"])  # fmt: skip
    return table(head, rows) + joined(map(line, (*_tested(found), *findings, _wrote(out))))


def _shooting(found: Mapping[str, Any], out: Path, _: str) -> Body:
    """Relative errors of a model, its rival and the truth in each weather, and the servos."""
    rows: list[tuple[str, ...]] = []
    for name, case in found["cases"].items():
        off = max(abs(z) for z in case["sigmas_off"].values())
        for who, score in case["scores"].items():
            errors = (_percent(score["relative"][v]) for v in ("u", "v_m", "r"))
            label = f"{len(case['fits'][who]['parameters'])} parameters" if who in case["fits"] else who
            full = (figure(max(case["model_over_truth"].values())), figure(off)) if who == "full" else ("", "")
            rows.append((name, label, *errors, *full))
    head = ("weather", "model", "surge", "sway", "yaw", "50 steps / truth", "sigma off at most")
    servos = (f"{name}: {figure(servo['rate'], 5)} rad/s +- {figure(servo['sigma']['rate'], 2)}"
              for name, servo in found["servos"].items())  # fmt: skip
    return table(head, rows, words=(1,)) + joined(map(line, (*_tested(found), *servos, _wrote(out))))


def _table(found: Mapping[str, Any], out: Path, _: str) -> Body:
    """Errors of each model of a table of fits on each test, and its claims."""
    tests = [*found["tests"], "together"]
    rows = tuple(
        (key, str(len(one["seeds"])), *(_error(one, test) for test in tests)) for key, one in found["models"].items()
    )
    claims = (f"{claim['says']}: " + ", ".join(f"{row['test']}: {row['verdict']}" for row in claim["rows"])
              for claim in found["claims"])  # fmt: skip
    wrote = f"wrote {out}/report.html, {out}/report.json"
    return table(("standardised error", "seeds", *tests), rows) + joined(map(line, (*claims, wrote)))


def _wrote(out: Path) -> str:
    return f"wrote {out}/model.toml, {out}/report.html"


def _percent(share: float | None) -> str:
    return "blows up" if share is None else f"{figure(100.0 * share)} %"


def _error(one: Mapping[str, Any], test: str) -> str:
    mean, spread = one["mean"][test], one["standard_deviation"][test]
    if mean is None:
        return "no number" if one["seeds"] else ""
    return figure(mean, 3) + ("" if spread is None else f" +- {figure(spread, 2)}")


_SUMMARIES = {
    "seatrial-fit/1": _fit, "seatrial-tuning/1": _tuning, "seatrial-shooting/1": _shooting,
    "seatrial-networks/1": _table,
}  # fmt: skip
