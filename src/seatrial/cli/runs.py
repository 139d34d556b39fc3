"""The two long commands, identify and validate: what they run, in order, and what they print."""

from __future__ import annotations

import math
import sys
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import typer

from .. import __version__
from ..core.files import held_alone
from ..data import Trial
from ..identify import Fit
from ..study.study import Study
from .cautions import cautions, trained
from .compared import compared, in_found_currents, provenance, scales, scales_asked
from .page import Watch, watching
from .spread import keep_members, spread_numbers, tell_spread
from .support import (
    DEGREE,
    Spoken,
    UsageError,
    emit,
    figure,
    fitting,
    live,
    note,
    positive,
    read_ship,
    say,
    show_table,
)

PAGE, CHECKPOINT = "report.html", "checkpoint.npz"


def identify(
    path: Path, out: Path, json: bool, quick: bool = False, only: Sequence[str] = (), page: int | None = None
) -> None:
    """Lint, fit with a checkpoint, save, report; a finished run is only told about; `page` is a port to show it at."""
    if out.exists() and not out.is_dir():
        raise UsageError(f"{out}: is a file; -o takes a folder")
    with watching(page) as watch, held_alone(out):
        _identify(path, out, json, quick, only, watch)
        watch.stay()


def _identify(path: Path, out: Path, json: bool, quick: bool, only: Sequence[str], watch: Watch) -> None:
    from ..identify.tuning.fine_tuning import FineTuning
    from ..study.series import is_series
    from ..study.study import read_study
    from .networks import compare_fits
    from .shooting import is_shot, shoot
    from .tuning import tune

    if is_series(path):
        compare_fits(path, out, json, quick, only, watch)
        return
    if quick or only:
        raise UsageError(f"{path}: is one study; --quick and --only are for a table of fits ('seatrial-series/1')")
    study = read_study(path)
    if isinstance(study.estimator, FineTuning):
        tune(study, study.estimator, out, json, watch)
        return
    if is_shot(study):
        shoot(study, out, json, watch)
        return
    _fit(study, out, json, watch)


def _fit(study: Study, out: Path, json: bool, watch: Watch) -> None:
    """One fit: lint, checkpoint, save, report."""
    from ..identify.lint import lines, lint, raise_on_errors
    from ..identify.posterior.verdicts import overruled
    from ..identify.resume import forget
    from ..study.store import SUMMARY, claim, kept, load_fit_summary, save_fit

    kept_back = bool(study.problem.validation or study.test)
    issues = lint(study.problem, study.test, study.estimator)
    raise_on_errors(issues)
    for line in (*study.notes, *lines(issues)):
        note(line)
    fresh = claim(out, study.digest, study.name)
    if (out / SUMMARY).exists() and (out / PAGE).exists():
        note(f"{out}: this study is done already, with the same data and settings; nothing was run")
        _tell_summary(load_fit_summary(out), out, json, kept_back)
        return
    with kept(out, fresh), fitting(study.path, f" to go on in {out}"), _progress() as progress:
        told = watch.alone(study, progress)
        fit = study.estimator.fit(study.problem, progress=told, checkpoint=out / CHECKPOINT)
    fit = overruled(fit, study.unidentified)
    watch.found(fit)
    kept_scale = scales(_judged_on(study), study.sigma)
    text = study.path.read_text(encoding="utf-8")
    save_fit(fit, out, study.problem, study=study.name, text=text, scale=kept_scale)
    scale = scales(study.problem.trials, study.sigma)
    keep_members(study.problem, study.estimator, fit, out, scale, study.restart)
    standardised, ahead = _report(study, fit, out)
    forget(out / CHECKPOINT)
    _tell_summary({**load_fit_summary(out), "standardised": standardised, "forecasts": ahead}, out, json, kept_back)


def validate(
    model: str, paths: Sequence[Path], out: Path | None, restart: float | None, json: bool,
    smooth_start: float | None = None, scale: str | None = None,
) -> None:  # fmt: skip
    """Compare a model and its baselines with trials; exit 1 where a prediction failed."""
    from ..data.check import check
    from ..data.trialfile import read_trials
    from ..report.caveats import assumptions
    from ..report.report import Report
    from ..validate.metrics import scale_words

    positive(restart=restart, smooth_start=smooth_start)
    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"{out}: a report ends in .html; its numbers go beside it as .json")
    ship, trials = trained(read_ship(model), model), read_trials(paths)
    for line in cautions(ship, trials):
        note(line)
    sigma, whence = scales_asked(trials, scale)
    scaled = f"{scale_words(sigma)} ({whence})"
    moved = in_found_currents(trials, model)
    comparisons, failed = compared(ship, moved, restart, sigma, smooth_start=smooth_start)
    sure = tell_spread(model, ship, trials)
    made = provenance(ship)
    report = Report(
        f"{ship.name}: validation", comparisons, trained_on=tuple(made.get("trained_on", ())),
        findings=(*(str(s) for s in sure if s.verdict != "inside"),
                  *(str(f) for t in trials for f in check(t) if f.severity != "info")),
        assumptions=assumptions(ship),
        provenance={"model": model, "version": f"seatrial {__version__}", "trials": ", ".join(map(str, paths)),
                    "errors divided by": scaled, "restart": "none" if restart is None else f"{restart:g} s",
                    **({} if smooth_start is None else {"starts": f"from the readings of {smooth_start:g} s"}),
                    **{k: str(made[k]) for k in ("study", "digest", "date") if k in made}},
    )  # fmt: skip
    if out is not None:
        note(f"wrote {report.write(out)}")
    if json:
        emit(report.numbers() | spread_numbers(sure))
    else:
        _tell_comparisons(report)
        say(f"errors divided by: {scaled}\n")
    if failed:
        raise typer.Exit(1)


def _report(study: Study, fit: Fit, out: Path) -> tuple[dict[str, float], list[dict[str, Any]]]:
    """The page of a fit on the trials kept back (those of training, where none was); pooled errors and forecasts."""
    from ..data.check import check
    from ..identify.nuisance import with_current
    from ..report.caveats import assumptions
    from ..report.report import Report
    from ..study.store import MODEL
    from ..validate.foresight import foreseen

    problem = study.problem
    trials = _judged_on(study)
    tuned = read_ship(str(out / MODEL))
    ahead, untold = foreseen(study, fit.ship)
    moved = [with_current(trial, fit.nuisances) for trial in trials]
    comparisons, _ = compared(tuned, moved, study.restart, scales(trials, study.sigma), problem.ship)
    report = Report(
        _heading(study, fit), comparisons, fit, tuple(t.name for t in problem.trials),
        (*untold, *(str(f) for t in (*problem.trials, *trials) for f in check(t) if f.severity == "error")),
        assumptions(fit.ship, [f.path for f in fit.free]), ahead,
        {"study": str(study.path), "digest": study.digest, "version": f"seatrial {__version__}",
         "trials": _counted({"for training": problem.trials, "for validation": problem.validation,
                             "kept back": study.test}),
         "command": f"seatrial identify {study.path} -o {out}"},
    )  # fmt: skip
    report.write(out / PAGE)
    return report.pooled, [asdict(f) for f in ahead]


def _judged_on(study: Study) -> Sequence[Trial]:
    return (*study.problem.validation, *study.test) or study.problem.trials


def _counted(parts: Mapping[str, Sequence[Trial]]) -> str:
    return ", ".join(f"{len(trials)} {what}" for what, trials in parts.items() if trials)


def _heading(study: Study, fit: Fit) -> str:
    """What the study calls itself, else ship and file; a file named study.toml says nothing."""
    of = "fitted" if study.name == "study" else f"study {study.name}"
    return study.title or f"{fit.ship.name}: {of}"


@contextmanager
def _progress() -> Generator[Spoken, None, None]:
    """Live state of the fit on a terminal, a line per iteration elsewhere."""
    if not sys.stderr.isatty():
        yield Spoken(note, _words)
        return
    from rich.console import Console

    with Console(stderr=True).status("compiling") as status:
        yield Spoken(live(status), _words)


def _words(iteration: int, objective: float, validation: float) -> str:
    watched = "" if math.isnan(validation) else f", validation {validation:.5g}"
    return f"iteration {iteration}: objective {objective:.6g}{watched}"


def _tell_summary(summary: Mapping[str, Any], out: Path, json: bool, kept_back: bool) -> None:
    if json:
        emit({**summary, "run": str(out)})
        return
    status = {v["subject"]: v["status"] for v in summary["verdicts"]}
    rows = [
        (path, figure(p["start"]), figure(p["value"]), figure(p["sigma"], 2), figure(p["shrinkage"], 2),
         "at bound" if p["at_bound"] else status.get(path, ""))
        for path, p in summary["parameters"].items()
    ]  # fmt: skip
    if rows:  # a network has weights, no parameters
        show_table(("parameter", "start", "fitted", "sigma", "from data", "verdict"), rows, right=(1, 2, 3, 4))
    for label, value in summary.get("standardised", {}).items():
        of = "trials kept back" if kept_back else "the training trials (none was kept back)"
        say(f"standardised error on {of}, {label}: {figure(value)}\n")
    for f in summary.get("forecasts", ()):
        say(f"forecast of {f['trial']} over {f['horizon']:g} s, {f['label']}: {figure(f['position'])} m, "
                         f"{figure(f['heading'] / DEGREE)} deg\n")  # fmt: skip
    say(f"{summary['status']}; {summary['seconds']:.1f} s; wrote {out}/model.toml, {out}/{PAGE}\n")


def _tell_comparisons(report: Any) -> None:
    labels = report.labels
    rows = [
        (name, *(figure(found[label].standardised) if label in found else "failed" for label in labels))
        for name, found in report.trials.items()
    ]
    rows.append(("pooled", *(figure(report.pooled[label]) for label in labels)))
    show_table(("standardised error", *labels), rows, right=tuple(range(1, len(labels) + 1)))
