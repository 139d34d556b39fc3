"""The card of a fitted model: what it was fitted to, where it holds, how well, for what use, and how to repeat it."""

from __future__ import annotations

import hashlib
import platform
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...belief.bands.ahead import ahead
from ...belief.bands.held import Windows, held
from ...belief.reading import HOW
from ...belief.reading import posterior as posterior_of
from ...choosing.purposes import PURPOSES
from ...core.errors import SeatrialError
from ...core.version import __version__
from ...data import DataError, Trial
from ...data.trialfile import read_trials
from ...engine import SimulationError
from ...identify.noise import noise
from ...report.blocks import Body, fields, joined, line, table
from ...report.judging.card import Card, page
from ...report.judging.fans import share
from ...report.page import write
from ...simulate.approach import rounded_down
from ...study.grounds import kind_of, trial_digest
from ...study.store import Summary, read_summary
from ...study.stored import load_fit
from ...study.study import read_study
from ...validate import Comparison
from ...validate.fitness import Fitness
from ...validate.metrics import scales
from .. import SILENT, Outcome, RequestError, Sink, figure
from ..asked import Predicting
from ..comparing import compared, fitness, judged, refuse
from ..request import PAGES, positive
from .carded import calibrated_of

# Draws behind the coverage: the edges of 95 % are the fifth from either end.
_DRAWS = 200
# Time between restarts, in ship lengths of way, where the study gives none.
_LENGTHS = 15.0


def card(
    model: str, *, out: Path | None = None, trials: Sequence[Path] = (), restart: float | None = None,
    sink: Sink = SILENT,
) -> Outcome[Card]:  # fmt: skip
    """Gather what is known of a fitted model on one page.

    Args:
        model: model.toml of a run.
        out: page to write (.html), with its numbers beside it.
        trials: trials that the fit has not seen; without any, those that its study keeps back.
        restart: length of the windows in which predictions are judged [s]; None takes that of the study.

    Raises:
        RequestError: no fitted model, or a page of another suffix.
        StudyError, DataError: the fit or the trials that are named cannot be read.
    """
    positive(restart=restart)
    if out is not None and out.suffix.lower() not in PAGES:
        raise RequestError(f"{out}: a card ends in .html; its numbers go beside it as .json")
    summary, where = _summary(model), Path(model)
    fit, ship = load_fit(where.parent), _posterior(model, sink)
    unseen, missing, span = _unseen(summary, trials, sink)
    seconds = restart or span or rounded_down(_LENGTHS * fit.ship.L_pp / max(fit.ship.speed, 1e-3))
    given = judged(fit.ship, model, unseen, Predicting(), sink) if unseen else None
    right = given.trials if given else ()
    sigma = scales(right, summary.scale)
    comparisons, failed = compared(fit.ship, right, seconds, sigma)
    ahead_of, lost = _ahead(ship, right, seconds)
    uses, unjudged = _uses(fit.ship, right, _names(summary))
    found = Card(
        fit, summary, seconds, held(ahead_of), _pooled(comparisons), uses,
        {**unjudged}, (*missing, *failed, *lost), tuple((t.name, kind_of(t), t.duration) for t in right),
        ship is not None, ship is not None and ship.power is not None, calibrated_of(model, ship, right, seconds, sink),
        _repeat(model, summary, trials), _versions(summary), given.changes if given else (),
    )  # fmt: skip
    made = page(found)
    if out is not None:
        sink.note(f"wrote {write(out, made)}")
    return Outcome(found, fields(made.document, _shown(found)))


def _summary(model: str) -> Summary:
    """fit.json beside the model.

    Raises:
        RequestError: there is none.
    """
    if Path(model).suffix != ".toml" or not Path(model).with_name("fit.json").is_file():
        raise RequestError(f"{model}: no fit is beside it, and only a fitted model has a card; {HOW}")
    return read_summary(Path(model).parent)


def _posterior(model: str, sink: Sink) -> Any:
    """The posterior of the model; None where its fit has no covariance, which is noted.

    Raises:
        StudyError: the ship file and the fit beside it are not of one run.
    """
    fit = load_fit(Path(model).parent)
    if not fit.free or not np.all(np.isfinite(fit.covariance)) or not np.any(fit.covariance):
        sink.note("note: the fit has no covariance: the card gives errors without bands")
        return None
    return posterior_of(model)


def _names(summary: Summary) -> tuple[str, ...]:
    return tuple(summary.provenance.get("trained_on", ()))


def _unseen(
    summary: Summary, paths: Sequence[Path], sink: Sink
) -> tuple[tuple[Trial, ...], tuple[str, ...], float | None]:
    """Trials that the fit has not seen, what is missing of them, and the time between restarts of the study."""
    if paths:
        given, span = read_trials(paths), None
        missing: tuple[str, ...] = ()
    else:
        given, missing, span = _kept_back(summary)
    digests = set(summary.grounds.digests("fit").values())
    seen = [t.name for t in given if t.name in _names(summary) or trial_digest(t) in digests]
    if seen:
        missing = (*missing, f"left out, as the fit used them: {', '.join(seen)}")
        if paths and len(seen) == len(given):
            raise RequestError(f"--trials: the model was fitted to every one of these trials ({', '.join(seen[:3])}); "
                               "give others")  # fmt: skip
    for one in missing:
        sink.note(f"warning: {one}")
    return tuple(t for t in given if t.name not in seen), missing, span


def _kept_back(summary: Summary) -> tuple[tuple[Trial, ...], tuple[str, ...], float | None]:
    """What the study of the fit keeps back, read again and held to its digests."""
    file = summary.study_file
    remedy = "nothing is judged; name trials with --trials"
    if not file:
        return (), (f"the fit names no study file: {remedy}",), None
    try:
        text = Path(file).read_text(encoding="utf-8")
        if text != summary.study_text:
            return (), (f"{file} has changed since the fit: {remedy}",), None
        study = read_study(file)
    except FileNotFoundError:
        return (), (f"{file}, the study of the fit, is not in this folder: {remedy}",), None
    except (SeatrialError, OSError) as error:
        return (), (f"the trials of the study cannot be read ({error}): {remedy}",), None
    found = (*study.problem.validation, *study.test)
    told = {one.name: one.digest for one in summary.grounds.trials}
    now = {trial.name: trial_digest(trial) for trial in (*study.problem.trials, *found)}
    gone = [name for name in told if name not in now]
    other = [name for name, digest in now.items() if name in told and told[name] != digest]
    lines = [f"no more at hand: {', '.join(gone)}"] * bool(gone)
    lines += [f"not as they were when the model was fitted: {', '.join(other)}"] * bool(other)
    lines += [f"the study keeps no trials back: {remedy}"] * (not found)
    kept = tuple(trial for trial in found if trial.name not in other)
    return kept, tuple(lines), study.restart


def _ahead(held: Any, trials: Sequence[Trial], seconds: float) -> tuple[list[Windows], list[str]]:
    """Errors and bands of each trial, and a line on each that has none."""
    if held is None or not trials:
        return [], []
    names, draws, level = [one.path for one in held.free], held.draws(_DRAWS, 1), noise(trials)
    found: list[Windows] = []
    lost: list[str] = []
    for trial in trials:
        try:
            found.append(ahead(held.ship, trial, kind_of(trial), names, draws, seconds, level))
        except (DataError, SimulationError) as error:
            lost.append(str(error))
    return found, lost


def _uses(
    ship: Any, trials: Sequence[Trial], trained_on: Sequence[str]
) -> tuple[tuple[Fitness, ...], dict[str, str]]:  # fmt: skip
    """Verdicts for each purpose that has limits, and why the others have none."""
    found: list[Fitness] = []
    why: dict[str, str] = {}
    for purpose in PURPOSES:
        if not purpose.accuracy:
            continue
        try:
            if not trials:
                raise RequestError("no unseen trial is at hand")
            refuse(purpose, ship, trials, trained_on)
            found.append(fitness(purpose, ship, trials, trained_on, None))
        except RequestError as error:
            why[purpose.title] = str(error).removeprefix(f"--for {purpose.key}: ")
    return tuple(found), why


def _pooled(comparisons: Sequence[Comparison]) -> dict[str, float]:
    """Standardised error by label."""
    from ...validate.comparison import pooled

    labels = dict.fromkeys(one.label for one in comparisons)
    return {label: pooled([one for one in comparisons if one.label == label]) for label in labels}


def _repeat(model: str, summary: Summary, trials: Sequence[Path]) -> dict[str, str]:
    """Commands that give the fit and this card again, by what they give."""
    file, folder, text = summary.study_file, str(Path(model).parent), summary.study_text
    given = [word for path in trials for word in ("--trials", str(path))]
    fit = shlex.join(["seatrial", "identify", file, "-o", folder]) if file else f"study {summary.study}: no file"
    return {"the fit": fit, "this card": shlex.join(["seatrial", "card", model, *given, "-o", "card.html"]),
            "digest of the study": hashlib.sha256(text.encode()).hexdigest()[:16] if text else "–",
            "digest of the fit": summary.digest,
            "digest of the model": hashlib.sha256(Path(model).read_bytes()).hexdigest()[:16]}  # fmt: skip


def _versions(summary: Summary) -> dict[str, str]:
    from importlib.metadata import version

    used = f"Python {platform.python_version()}, NumPy {np.__version__}, CasADi {version('casadi')}"
    return {"fitted by": f"seatrial {summary.version or 'of before versions were kept'}",
            "fitted on": str(summary.provenance.get("date", "–")), "card by": f"seatrial {__version__}",
            "with": used}  # fmt: skip


def _shown(found: Card) -> Body:
    """The summary for a terminal."""
    rows = tuple(
        (row.kind, figure(row.horizon, 3), str(row.trials), str(row.windows), figure(row.distance, 3),
         *(share(row, name) for name in row.inside)) for row in found.rows
    )  # fmt: skip
    head = ("unseen trials", "ahead [s]", "trials", "windows", "error [m]", "position held", "heading", "speeds")
    said = [f"for {use.title}: {use.verdict}" for use in found.uses]
    said += [f"for {title}: not judged: {why}" for title, why in found.unjudged.items()]
    return (table(head, rows) if rows else ()) + joined(
        map(line, (*said, *(f"warning: {one}" for one in found.missing))))  # fmt: skip


