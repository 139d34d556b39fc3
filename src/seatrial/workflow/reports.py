"""What a run of `identify` is reported as: its page, what it has found as JSON, and the summary for a terminal.

There are four kinds, by what a study asks for (`reporting`): a fit beside trials, a fine-tuning, a rival in several
weathers, a table of fits.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeGuard, runtime_checkable

from ..belief.corrected import as_true, of_trial, shared_by_all, words
from ..core.executors import Pool
from ..core.files import plain
from ..core.values import dataclass, replace
from ..core.version import __version__
from ..data import Trial
from ..data.prepare.made import uncounted
from ..identify import Estimator, Fit
from ..identify.posterior.verdicts import within
from ..report.answer import answered
from ..report.blocks import Body, joined, line, number, table
from ..report.evidence import assumptions
from ..report.page import Page, Section
from ..report.report import Report
from ..ships import Ship
from ..ships.files import load
from ..study.cells import FITS
from ..study.series import Series
from ..study.store import MODEL, SCHEMA, SUMMARY, read_summary
from ..study.study import Study
from ..validate.metrics import scales
from . import Document, Sink, figure
from .comparing import compared, uses
from .request import DEGREE

if TYPE_CHECKING:
    from ..identify.tuning.fine_tuning import FineTuning

# Combinations of parameters that a summary lists.
_COMBINED = 6
_VERSION = f"seatrial {__version__}"


@dataclass(frozen=True)
class Made:
    """What a run has made, and by what.

    Attributes:
        fits: made in this run, by the name of the cell.
        failed: a line for each cell that failed.
        command: that made it.
        pool: who computes what a report still needs; None does it here.
        doubts: warnings of the lint, with their remedies.
    """

    fits: Mapping[str, Fit]
    failed: Sequence[str]
    command: str
    sink: Sink
    pool: Pool | None = None
    doubts: Sequence[str] = ()


class Reporting(Protocol):
    """The page of a run and its summary."""

    def page(self, made: Made) -> Page:
        """The page and its numbers."""
        ...

    def document(self, numbers: Mapping[str, Any]) -> Document:
        """What the run has found, from the numbers of its page and the fits in its folder."""
        ...

    def shown(self, found: Mapping[str, Any]) -> Body:
        """The same for a terminal."""
        ...


def reporting(study: Study | Series, out: Path) -> Reporting:
    """How the run of a study in `out` is reported."""
    if isinstance(study, Series):
        return _Table(study, out)
    if study.rivals is not None:
        return _Rivals(study, out)
    return _Tuned(study, out) if _tunes(study.estimator) else _Fitted(study, out)


def _tunes(estimator: Estimator) -> TypeGuard[FineTuning]:
    if not getattr(estimator, "several", False):
        return False  # and that room is not imported
    from ..identify.tuning.fine_tuning import FineTuning

    return isinstance(estimator, FineTuning)


@runtime_checkable
class Paged(Protocol):
    """Details of a fit (`Fit.details`) that bring a page of their own."""

    def page(self, fit: Fit, provenance: Mapping[str, str]) -> Page:
        """The page and its numbers."""
        ...


@dataclass(frozen=True)
class _One:
    """A study: one fit, in the folder of the run."""

    study: Study
    out: Path

    def provenance(self, made: Made) -> dict[str, str]:
        """Study, digest, version and command, in words."""
        study = self.study
        return {"study": str(study.path), "digest": study.digest, "version": _VERSION, "command": made.command}

    def document(self, numbers: Mapping[str, Any]) -> Document:
        """The numbers of the page, and what the residuals say."""
        return {"diagnosis": read_summary(self.out).diagnosis, **numbers}


@dataclass(frozen=True)
class _Fitted(_One):
    """A fit, compared with the trials kept back (those of training, where none was)."""

    def page(self, made: Made) -> Page:
        fit = made.fits[self.study.name]
        if isinstance(fit.details, Paged):
            return fit.details.page(fit, self.provenance(made))
        return _compared(self.study, fit, load(self.out / MODEL), self.provenance(made), made).page

    def document(self, numbers: Mapping[str, Any]) -> Document:
        """`fit.json`, its draws and its errors."""
        from ..belief.drawn import read_draws

        kept = ("answer", "standardised", "forecasts", "worse_than_untuned")
        judged = {key: numbers[key] for key in kept if key in numbers}
        drawn = read_draws(self.out)
        posterior = {} if drawn is None else {"posterior": drawn.said}
        return {"schema": SCHEMA, **plain(read_summary(self.out)), **posterior, **judged}

    def shown(self, found: Mapping[str, Any]) -> Body:
        return _fit(found, self.out, _of(self.study.kept_back))


@dataclass(frozen=True)
class _Tuned(_One):
    """A fine-tuning: its ranges and methods, and what the data determine."""

    def page(self, made: Made) -> Page:
        from ..identify.tuning.tuned import Tuning
        from ..report.tuning import page

        study, fit = self.study, made.fits[self.study.name]
        if not _tunes(study.estimator) or not isinstance(fit.details, Tuning):
            raise TypeError(f"{type(study.estimator).__name__} makes no Tuning")
        made.sink.note("what the data determine: profiles, repetitions, bands")
        return page(
            fit.details, title=study.title or f"{study.problem.ship.name}: fine-tuning", method=study.estimator.method,
            provenance={**self.provenance(made), "data": sources(study.problem.trials)},
            sections=_identifiability(fit, study, fit.details.tests, study.estimator.evolution(), made.pool), fit=fit,
        )  # fmt: skip

    def shown(self, found: Mapping[str, Any]) -> Body:
        return _tuning(found, self.out)


def _identifiability(
    fit: Fit, study: Study, tests: Sequence[Trial], settings: Any, pool: Pool | None
) -> list[Section]:  # fmt: skip
    """Sections on the chosen fit: profiles, correlations, restarts, residuals, and bands on the test trials."""
    from ..belief.ensemble import bands, ensemble
    from ..identify.posterior.misfit import misfit
    from ..identify.posterior.profile import profiles
    from ..report.identifiability import sections
    from ..validate.comparison import manoeuvre

    chosen = replace(study.problem, free=fit.free)
    group = ensemble(fit, chosen, settings, pool=pool)
    return sections(
        fit, profiles(fit, chosen, settings, pool=pool), group=group, left=misfit(fit, chosen, settings),
        predicted=[bands(group, trial, manoeuvre(trial)) for trial in tests],
    )  # fmt: skip


@dataclass(frozen=True)
class _Rivals(_One):
    """A study with a rival on virtual trials: both beside the truth, in several weathers."""

    def page(self, made: Made) -> Page:
        from ..report.rivals import page
        from ..validate.rivals import judged

        fit, virtual = made.fits[self.study.name], self.study.rivals
        if virtual is None:
            raise TypeError(f"{self.study.name} has no rival")
        made.sink.note(f"{fit.status}; the rival, and both in other weathers")
        truth = {"truth": f"{virtual.ship.name}, seed {virtual.seed}"}
        return page(judged(self.study, fit, virtual), provenance={**self.provenance(made), **truth})

    def shown(self, found: Mapping[str, Any]) -> Body:
        return _shooting(found, self.out)


@dataclass(frozen=True)
class _Table:
    """A table of all fits that are done, made in this run or before."""

    series: Series
    out: Path

    def page(self, made: Made) -> Page:
        from ..report.series import covered, page
        from ..validate.series import judged

        series = self.series
        return page(series, judged(series, self.out), covered(series), failed=made.failed, provenance={
            "study": str(series.path), "version": _VERSION, "data": sources(series.apart), "command": made.command,
        })  # fmt: skip

    def document(self, numbers: Mapping[str, Any]) -> Document:
        """The numbers of the page, and the fits whose model does not explain the data."""
        done = [cell for cell in self.series.cells if (self.out / cell.folder / SUMMARY).exists()]
        lacking = [cell.name for cell in done if not read_summary(self.out / cell.folder).explained]
        return {**numbers, "not_explained": lacking}

    def shown(self, found: Mapping[str, Any]) -> Body:
        return _table(found, self.out)


def _compared(study: Study, fit: Fit, fitted: Ship, provenance: Mapping[str, str], made: Made) -> Report:
    """The ship as it was saved beside its baselines, on the trials that a study is judged on, and what the fit says."""
    from ..belief.foresight import foreseen
    from ..belief.sampling.sampled import Sampled

    problem, trials = study.problem, study.judged_on
    ahead, missing = foreseen(study, fit.ship)
    model = problem.ship.model
    own, made_up = partial(of_trial, found=fit.nuisances, studied=()), uncounted(problem.loss.sigma)
    right = [as_true(trial, shared_by_all(fit.nuisances), model, own=own(trial.name), made=made_up) for trial in trials]
    comparisons, failed = compared(fitted, right, study.restart, scales(trials, study.sigma), problem.ship)
    changes = _changes(fit, trials)
    for told in (*(f"error: {one}" for one in failed), *(f"note: {one}" for one in changes)):
        made.sink.note(told)
    return Report(
        study.title or f"{fit.ship.name}: {'fitted' if study.name == 'study' else f'study {study.name}'}",
        comparisons, fit, tuple(t.name for t in problem.trials),
        (*missing, *made.doubts),
        assumptions(fit.ship, [f.path for f in fit.free]), ahead,
        {**provenance, "trials": _counted({"for training": problem.trials, "for validation": problem.validation,
                                           "kept back": study.test})},
        changes=changes, uses=uses(fitted, right, [t.name for t in problem.trials]),
        drawn=fit.details if isinstance(fit.details, Sampled) else None,
    )  # fmt: skip


def _changes(fit: Fit, trials: Sequence[Trial]) -> tuple[str, ...]:
    """What the errors of instruments and the current that the fit found in all trials do to those of its report."""
    shared = shared_by_all(fit.nuisances)
    what = words(shared, fit.ship.model, trials[0]) if shared else ""
    return (f"trials are compared as corrected by {what}, as the fit estimated for all trials of the study",) if what \
        else ()


def sources(trials: Iterable[Trial]) -> str:
    """Where trials come from, each source once."""
    return "; ".join(dict.fromkeys(str(trial.meta.get("source", "")) for trial in trials))


def _counted(parts: Mapping[str, Sequence[Trial]]) -> str:
    return ", ".join(f"{len(trials)} {what}" for what, trials in parts.items() if trials)


def _of(kept_back: bool) -> str:
    return "trials kept back" if kept_back else "the training trials (none was kept back)"


def leads(found: Mapping[str, Any], out: Path, kept_back: bool) -> tuple[str, ...]:
    """What speaks against the result of the run in `out`, one short line each; empty where nothing does.

    That the model does not explain the data, with the first ground, and that it predicts worse than before the fit.
    """
    lost = found.get("worse_than_untuned")
    tested: Mapping[str, Any] = found.get("diagnosis") or {"explained": True}
    said: list[str] = []
    if not tested["explained"]:
        short = str(tested.get("cause", tested["lines"][0])).partition(";")[0]
        said.append(f"not explained: {short}; see {out}/report.html")
    if lacking := found.get("not_explained"):
        named = f"{', '.join(lacking[:3])}{', ...' * (len(lacking) > 3)}"
        said.append(f"not explained: the data of {len(lacking)} fits ({named}); see fit.json of each in {out}/{FITS}")
    if (drawn := found.get("posterior")) and not drawn["converged"]:
        said.append(drawn["words"][0])
    if lost:
        of = "trials kept back" if kept_back else "the training trials"
        mine, before = (figure(lost[label]) for label in ("fitted", "untuned"))
        said.append(f"worse than untuned: {lost.get('what', 'standardised error')} {mine} against {before} before the "
                    f"fit, on {of}")  # fmt: skip
    return tuple(said)


def summary(report: Reporting, found: Mapping[str, Any], said: Sequence[str], out: Path, details: bool) -> Body:
    """What a terminal shows of a run: of a fit its first screen, and on request the numbers below it.

    Args:
        said: what speaks against the result (`leads`), which a first screen has in its own lines.
    """
    if "answer" not in found:
        return joined(map(line, said)) + report.shown(found)
    apart = leads({"posterior": found.get("posterior")}, out, kept_back=False)
    first = answered(found["answer"]).body + joined(map(line, apart))
    return first + (report.shown(found) if details else line(f"{_ended(found, out)}; --details lists parameters"))


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
        (path, figure(p["start"]), figure(p["value"]), figure(p["sigma"], 2),
         number(100.0 * within(p["value"], p["sigma"]), 2) if p["sigma"] is not None else "–",
         figure(p["shrinkage"], 2),
         status.get(path, "at bound" if p["at_bound"] else ""))
        for path, p in found["parameters"].items()
    )  # fmt: skip
    head = ("parameter", "start", "fitted", "sigma", "± % (95 %)", "from data", "verdict")
    parameters = table(head, rows, words=(6,)) if rows else ()  # a network has weights, no parameters
    combined = [f"{v['subject']}: {v['text']}" for v in found["verdicts"] if v["subject"] not in found["parameters"]]
    return parameters + joined(map(line, (
        *combined[:_COMBINED],
        *((f"... and {len(combined) - _COMBINED} more combinations: see {out}/report.html",)
          if len(combined) > _COMBINED else ()),
        *_tested(found),
        *(f"standardised error on {of}, {label}: {figure(value)}"
          for label, value in found.get("standardised", {}).items()),
        *(f"forecast of {f['trial']} over {f['horizon']:g} s, {f['label']}: {figure(f['position'])} m, "
          f"{figure(f['heading'] / DEGREE)} deg" for f in found.get("forecasts", ())),
        _ended(found, out),
    )))  # fmt: skip


def _ended(found: Mapping[str, Any], out: Path) -> str:
    return f"{found['status']}; {found['seconds']:.1f} s; {_wrote(out)}"


def _tested(found: Mapping[str, Any]) -> Sequence[str]:
    """Whether the model explains the data, and the grounds."""
    return (found.get("diagnosis") or {"lines": ()})["lines"]


def _tuning(found: Mapping[str, Any], out: Path) -> Body:
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


def _shooting(found: Mapping[str, Any], out: Path) -> Body:
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


def _table(found: Mapping[str, Any], out: Path) -> Body:
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

