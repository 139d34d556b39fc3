"""The run of a fine-tuning study: what `identify` does where the estimator is `FineTuning`."""

from __future__ import annotations

import json
import sys
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from .. import __version__
from ..data import Trial
from ..identify import Fit, Problem
from ..identify.tuning.fine_tuning import FineTuning, Told
from ..report.page import Section
from ..study.study import Study
from .page import Watch
from .support import claimed, emit, figure, live, note, say, show_table

PAGE, CHECKPOINT = "report.html", "checkpoint.npz"
# A line for every so many iterations of a fit, where nobody watches a terminal.
_EVERY = 250


def tune(study: Study, estimator: FineTuning, out: Path, as_json: bool, watch: Watch) -> None:
    """Lint, go through the ranges with checkpoints, save the chosen fit, report; a finished run is only told about."""
    from ..identify.lint import lines, lint, raise_on_errors
    from ..report.tuning import write
    from ..study.store import kept, save_fit

    tests = (*study.problem.validation, *study.test)
    problem = replace(study.problem, validation=tests)
    issues = lint(study.problem, study.test, estimator)
    raise_on_errors(issues)
    for line in (*study.notes, *lines(issues)):
        note(line)
    fresh, done = claimed(out, PAGE, study.digest, study.name)
    if not done:
        with kept(out, fresh), _progress() as told:
            watch.begin(study.title or f"{problem.ship.name}: fine-tuning")
            told = watch.sweep(study.restart, told)
            tuning = estimator.tune(study.problem, tests, told=told, checkpoint=out / CHECKPOINT)
        watch.reporting()
        save_fit(tuning.fit, out, problem, study=study.name, text=study.path.read_text(encoding="utf-8"))
        note("what the data determine: profiles, repetitions, bands")
        write(
            out / PAGE, tuning, title=study.title or f"{problem.ship.name}: fine-tuning", method=estimator.method,
            provenance={"study": str(study.path), "digest": study.digest, "version": f"seatrial {__version__}",
                        "data": "; ".join(dict.fromkeys(str(t.meta.get("source", "")) for t in problem.trials)),
                        "command": f"seatrial identify {study.path} -o {out}"},
            sections=_identifiability(tuning.fit, study.problem, tests, estimator),
        )  # fmt: skip
        for file in out.glob(f"{Path(CHECKPOINT).stem}.*"):
            file.unlink()
    _tell(json.loads((out / PAGE).with_suffix(".json").read_text(encoding="utf-8")), out, as_json)


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


@contextmanager
def _progress() -> Generator[Told, None, None]:
    """Live state of the fits on a terminal, a line now and then elsewhere."""
    if not sys.stderr.isatty():

        def told(what: str, iteration: int, objective: float) -> None:
            if iteration == 1 or iteration % _EVERY == 0:
                note(_words(what, iteration, objective))

        yield told
        return
    from rich.console import Console

    with Console(stderr=True).status("compiling") as status:
        yield lambda what, iteration, objective: live(status)(_words(what, iteration, objective))


def _words(what: str, iteration: int, objective: float) -> str:
    return f"{what}: iteration {iteration}: objective {objective:.6g}"


def _tell(found: Mapping[str, Any], out: Path, as_json: bool) -> None:
    if as_json:
        emit({**found, "run": str(out)})
        return
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
    show_table(head, rows, right=(1, 2, 3, 4, 5, 6))
    for issue in found["findings"]:
        mark = "warning: " if issue["severity"] == "warning" else ""
        say(f"{mark}{issue['where']}: {issue['text']}\n")
    say(f"wrote {out}/model.toml, {out}/{PAGE}\n")
