"""Calibration of a fitted model: fits that leave trials out, and the file that its bands are taken from."""

from __future__ import annotations

import re
import shutil
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...belief.bands.beginnings import by_first, by_history
from ...belief.bands.calibrating import Withheld
from ...belief.bands.calibration import LEVEL, MEASURED, Calibration, beside, save
from ...belief.bands.conformal import needed, unsure
from ...belief.fit_first import between_trials
from ...belief.parts import left_out
from ...belief.power import LEAST
from ...belief.reading import HOW, posterior
from ...belief.weighing import power
from ...core import executors
from ...core.files import held_alone
from ...data import Array
from ...identify import StudyError
from ...identify.recordings import recordings
from ...models import STATES
from ...report.blocks import Body, fields, joined, line, table
from ...study.grounds import trial_digest
from ...study.store import Summary, read_summary
from ...study.stored import load_fit
from ...study.study import Study, read_study
from .. import SILENT, Outcome, RequestError, Sink, figure
from ..request import positive
from .fans import DEGREES

# Recordings that show 95 % are left out in so many parts; of fewer each is left out alone.
_PARTS = 5
_FOLDER = "left-out"
# A day in the name of a recording: 06-Aug-2020, 2020-08-06, 20200806.
_DAY = re.compile(r"(?<!\d)(?:\d{2}[-_.][A-Za-z]{3}[-_.]\d{4}|\d{4}[-_.]?\d{2}[-_.]?\d{2})(?!\d)")


def calibrate(
    model: str, *, parts: int | None = None, horizon: float | None = None, history: float | None = None,
    first: float | None = None, dask: str | None = None, sink: Sink = SILENT,
) -> Outcome[Calibration]:  # fmt: skip
    """Fit again without some of the trials, for every part of them, and keep how well these are predicted.

    A killed run goes on where it was: parts that are done are kept in a folder beside the model until the end.

    Args:
        model: model.toml of a run of a study.
        parts: into how many parts the recordings are dealt; None leaves each of few recordings out alone.
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
    if parts is not None and parts < 2:
        raise RequestError(f"--parts is {parts}; two or more leave trials out")
    held = posterior(model, weighed=False)
    where = Path(model).parent
    study, fit = _study(read_summary(where), model), load_fit(where)
    folder, parts = where / _FOLDER, parts or _parts(study)

    def told(done: int) -> None:
        sink.note(f"{done} of {parts} parts of the recordings left out and fitted without")

    with held_alone(folder), executors.dask(dask, sink.note) if dask else nullcontext(None) as pool:
        out = [*left_out(study.estimator, study.problem, fit, held, parts=parts, folder=folder, pool=pool, each=told)]
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
        for one in made:
            sink.note(f"wrote {save(one, beside(model, one.begin))}")
    shutil.rmtree(folder, ignore_errors=True)
    document = {**_document(made[0], beside(model)), **{one.begin: _document(one, beside(model, one.begin))
                                                        for one in made[1:]}}  # fmt: skip
    return Outcome(made[0], fields(document, joined(map(_shown, made))))


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
    return np.nanmedian(np.where(known, left.spread, 1.0), axis=0) ** found.share * left.usual ** (1.0 - found.share)


def of_one_day(found: Calibration) -> tuple[str, ...]:
    """Kinds whose recordings are all of one day, as far as their names tell it: one line each."""
    days: dict[str, set[str]] = {}
    for kind, group in zip(found.left.kinds, found.left.groups, strict=True):
        day = _DAY.search(group)
        days.setdefault(kind, set()).add(day[0] if day else "")
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
            *unsure(len(set(found.left.groups)), LEVEL),
            *(() if found.power is None else found.power.words))  # fmt: skip
    return table(head, rows) + joined(map(line, said))
