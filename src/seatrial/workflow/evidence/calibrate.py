"""Calibration of a fitted model: fits that leave trials out, and the file that its bands are taken from."""

from __future__ import annotations

import math
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

from ...belief.bands.beginnings import by_first, by_history
from ...belief.bands.calibrating import Withheld
from ...belief.bands.calibration import LEVEL, MEASURED, Calibration, Errors, beside, hardest, save
from ...belief.bands.conformal import needed, unsure
from ...belief.fit_first import between_trials
from ...belief.parts import LeftOut, left_out
from ...belief.power import LEAST
from ...belief.reading import HOW, posterior
from ...belief.weighing import power
from ...core import executors
from ...core.files import held_alone
from ...data import Array, Trial
from ...engine import SimulationError
from ...identify import StudyError
from ...identify.recordings import recordings
from ...models import STATES
from ...report.blocks import Body, fields, joined, line, table
from ...simulate.replay import replay
from ...study.folds import FOLDS, day_named, folds, supported
from ...study.grounds import trial_digest
from ...study.store import Summary, read_summary
from ...study.stored import load_fit
from ...study.study import Study, read_study
from ...validate import Comparison
from ...validate.comparison import compare, pooled
from ...validate.metrics import scales
from .. import SILENT, Outcome, RequestError, Sink, figure
from ..request import left, positive
from .fans import DEGREES

# Recordings that show 95 % are left out in so many parts; of fewer each is left out alone.
_PARTS = 5
_FOLDER = "left-out"
HARDEST, _USUAL = "hardest", "recording"


def calibrate(
    model: str, *, parts: int | None = None, by: str | None = None, horizon: float | None = None,
    history: float | None = None, first: float | None = None, dask: str | None = None, sink: Sink = SILENT,
) -> Outcome[Calibration]:  # fmt: skip
    """Fit again without some of the trials, for every part of them, and keep how well these are predicted.

    A killed run goes on where it was: parts that are done are kept in a folder beside the model until the end.

    Args:
        model: model.toml of a run of a study.
        parts: into how many parts the recordings are dealt; None leaves each of few recordings out alone.
        by: how they are dealt, of `FOLDS`; "hardest" takes each way that tells them apart, and keeps the worst.
        horizon: longest one [s]; None takes what as many recordings reach as 95 % needs.
        history, first: also calibrate predictions that begin so; a file of its own beside the first one.
        dask: as of `identify`; the parts are computed there.

    Raises:
        RequestError: no fitted model, too few parts or trials, or trials that are not those of the fit.
        StudyError, DataError: study or trials cannot be read.
        FitError: a fit without a part fails.
        BusyError: another process calibrates this model.
    """
    positive(horizon=horizon, history=history, fit_first=first)
    _asked(parts, by)
    held = posterior(model, weighed=False)
    where = Path(model).parent
    study, fit = _study(read_summary(where), model), load_fit(where)
    folder, parts = where / _FOLDER, parts or _parts(study)
    ways = _ways(study.problem.trials, by or _USUAL, parts)

    with held_alone(folder), executors.dask(dask, sink.note) if dask else nullcontext(None) as pool:
        rest = _rest(ways)

        def without(way: str, some: Sequence[Sequence[Trial]]) -> list[LeftOut]:
            each = partial(_note, sink, way, len(some), partial(rest, way))
            (folder / way).mkdir(exist_ok=True)
            return [*left_out(study.estimator, study.problem, fit, held, out=some, folder=folder / way, pool=pool,
                              each=each)]  # fmt: skip

        dealt = {way: without(way, some) for way, some in ways.items()}
        errors = {way: _errors(some, study) for way, some in dealt.items()}
        out = dealt[worst := hardest(errors)]
        try:
            held = replace(held, power=power(fit, study.problem, study.estimator, out))
        except StudyError as error:
            sink.note(f"beyond the trials of the fit no bands are known: {error}")
        withheld = Withheld.of(held, out, horizon)
        made = [withheld.measured()]
        if history is not None:
            made.append(by_history(withheld, history))
        if first is not None:
            made.append(by_first(withheld, first, between_trials(fit.nuisances)))
        made = [replace(one, errors=errors) for one in made]
        for one in made:
            sink.note(f"wrote {save(one, beside(model, one.begin))}")
    shutil.rmtree(folder, ignore_errors=True)
    document = {**_document(made[0], beside(model)),
                "folds": worst, "errors": {way: one.numbers() for way, one in errors.items()},
                **{one.begin: _document(one, beside(model, one.begin)) for one in made[1:]}}  # fmt: skip
    return Outcome(made[0], fields(document, _folds_shown(errors) + joined(map(_shown, made))))


def _asked(parts: int | None, by: str | None) -> None:
    if parts is not None and parts < 2:
        raise RequestError(f"--parts is {parts}; two or more leave trials out")
    if by is not None and by not in (*FOLDS, HARDEST):
        raise RequestError(f"--folds {by}: is none of {', '.join((*FOLDS, HARDEST))}")


def _ways(trials: Sequence[Trial], by: str, parts: int) -> dict[str, list[list[Trial]]]:
    """The parts of the way of dealing that was asked for, or of all that tell the recordings apart."""
    return supported(trials, parts) if by == HARDEST else {by: folds(trials, by, parts)}


def _errors(out: Sequence[LeftOut], study: Study) -> Errors:
    """Predictions of left-out trials as the report of the study makes them; infinite where one blows up."""
    every = [trial for one in out for trial in one.trials]
    sigma, restart = scales(every, study.sigma), study.restart
    found: list[list[Comparison]] = []
    blown: set[int] = set()
    for k, one in enumerate(out):
        found.append([])
        for trial in one.trials:
            try:
                guess = replay(one.held.ship, trial, restart=restart)
            except SimulationError:
                blown.add(k)
                continue
            found[k].append(compare(trial, guess, label="", restart=restart, sigma=sigma))
    parts = tuple(math.inf if k in blown else pooled(some) for k, some in enumerate(found))
    return Errors(math.inf if blown else pooled(one for some in found for one in some), parts)


def _rest(ways: Mapping[str, Sequence[Any]]) -> Callable[[str, int], str]:
    """What is left, in words, when so many parts of a way of dealing are done and those before it all."""
    begun, every = time.monotonic(), sum(map(len, ways.values()))
    before = dict(zip(ways, accumulate(map(len, ways.values()), initial=0), strict=False))
    return lambda way, done: left(begun, before[way] + done, every)


def _note(sink: Sink, way: str, count: int, more: Callable[[int], str], done: int) -> None:
    told = "" if way == _USUAL else f" by {way}"
    sink.note(f"{done} of {count} parts of the recordings{told} left out and fitted without{more(done)}")


def _folds_shown(errors: Mapping[str, Errors]) -> Body:
    rows = [(way, str(len(one.parts)), figure(one.mean, 3), figure(one.spread, 2), figure(max(one.parts), 3))
            for way, one in errors.items()]  # fmt: skip
    return table(("left out by", "parts", "Eq. 25", "spread", "worst part"), rows) + line(
        "error of trials that a fit has not seen, standardised, lower is better; spread: standard deviation over parts"
    )


def _parts(study: Study) -> int:
    """How many parts the recordings are dealt into.

    Raises:
        RequestError: too few of them to leave any out.
    """
    count = len(recordings(study.problem.trials))
    if count < LEAST:
        raise RequestError(f"{study.path}: {count} recordings are too few to leave each out in turn; train on {LEAST} "
                           "or more")  # fmt: skip
    return count if count < needed(LEVEL) else _PARTS


def _study(summary: Summary, model: str) -> Study:
    """The study of a fit, held to the digests of its trials.

    Raises:
        RequestError: it has changed, or its trials have.
    """
    file = summary.study_file
    if not file or not Path(file).is_file():
        raise RequestError(f"{model}: the study of its fit ({file or 'not named'}) is not at hand; {HOW}")
    if Path(file).read_text(encoding="utf-8") != summary.study_text:
        raise RequestError(f"{file}: has changed since the fit of {model}; {HOW}")
    study = read_study(file)
    told = summary.grounds.digests("fit")
    now = {trial.name: trial_digest(trial) for trial in study.problem.trials}
    if other := sorted(name for name in {*told, *now} if told.get(name) != now.get(name)):
        raise RequestError(f"{file}: trials are not as they were when {model} was fitted: {', '.join(other[:5])}; "
                           "fit again")  # fmt: skip
    return study


def _document(found: Calibration, path: Path) -> dict[str, Any]:
    made = found.factors(LEVEL)
    return {
        "written": str(path), "fit": found.fit, "trials": len(found.trials), "recordings": len(set(found.left.groups)),
        "windows": len(found.left.trials), "kinds": sorted(set(found.left.kinds)), "level": LEVEL,
        "shown": found.level, "reach": found.reach(LEVEL), "of_one_day": list(of_one_day(found)), "share": found.share,
        "horizons": found.left.horizons.tolist(),
        "left_out": None if found.power is None else found.power.numbers(),
        "disturbance": {"current": found.disturbance.current, "accelerations": [
            vars(one) for one in found.disturbance.processes if one.sigma > 0]},
        "half_width": {kind or "any other": {name: (made.factor[k, :, c] * _usual(found)[:, c]).tolist()
                                             for c, name in enumerate(STATES)} for k, kind in enumerate(made.kinds)},
    }  # fmt: skip


def _usual(found: Calibration) -> Array:
    """The spread of a usual window at each horizon, shape (horizons, 6)."""
    left = found.left
    known = np.isfinite(left.spread).any(axis=0)  # no trial may reach the last horizons
    new = np.ones(1) if left.novelty is None else np.median(left.novelty, axis=0)[:, None] ** found.novel
    spread = np.nanmedian(np.where(known, left.spread, 1.0), axis=0)
    return spread**found.share * left.usual ** (1.0 - found.share) * new


def of_one_day(found: Calibration) -> tuple[str, ...]:
    """Kinds whose recordings are all of one day, as far as their names tell it: one line each."""
    days: dict[str, set[str]] = {}
    for kind, group in zip(found.left.kinds, found.left.groups, strict=True):
        days.setdefault(kind, set()).add(day_named(group))
    return tuple(
        f"{kind}: every recording is of {day}; what differs from day to day is not in its bands"
        for kind, some in sorted(days.items())
        if len(some) == 1 and (day := next(iter(some)))
    )


def _begun(found: Calibration) -> str:
    """How predictions begin, in words; empty where their starts are measured."""
    return "" if found.begin == MEASURED else f"; predictions by --{found.begin}"


def _shown(found: Calibration) -> Body:
    made, usual = found.factors(LEVEL), _usual(found)
    rows = [(kind or "any other", figure(float(h), 3), str(made.recordings[k, j]),
             *(figure(DEGREES.get(name, 1.0) * float(made.factor[k, j, c] * usual[j, c]), 2)
               for c, name in enumerate(STATES)))
            for k, kind in enumerate(made.kinds) for j, h in enumerate(found.left.horizons)
            if j in (0, len(found.left.horizons) // 2, len(found.left.horizons) - 1)]  # fmt: skip
    head = ("left out", "ahead [s]", "recordings", "x [m]", "y [m]", "psi [deg]", "u [m/s]", "v_m [m/s]", "r [deg/s]")
    said = (f"half widths of usual bands of {100 * LEVEL:.3g} %, by kind of manoeuvre{_begun(found)}",
            f"bands hold up to {found.reach(LEVEL):.4g} s from a start", *of_one_day(found),
            *(("bands are as much wider as a run is less like the trials of the fit"
               f"{'' if found.novel == 1.0 else ', by its root'}",) if found.novel else ()),
            *unsure(len(set(found.left.groups)), LEVEL),
            *(() if found.power is None else found.power.words))  # fmt: skip
    return table(head, rows) + joined(map(line, said))
