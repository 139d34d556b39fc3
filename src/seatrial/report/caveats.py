"""What a report does not show, derived from what it was given.

The numbers of a ship that nobody measured: assumed in its file, and not fitted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..data import Trial
from ..validate.comparison import CONSTANT_VELOCITY
from .page import number

if TYPE_CHECKING:
    from .report import Report
from collections.abc import Collection
from dataclasses import dataclass

from ..ships import Ship


def caveats(report: Report) -> list[str]:
    """Plain sentences on the limits of the evidence, most important first."""
    if not report.comparisons:
        return ["Nothing was compared: the page says nothing about how well anything predicts."]
    trials = [next(iter(found.values())).measured for found in report.trials.values()]
    lines = [*_unseen(report), *_horizon(report), *_range(trials), *_environment(trials)]
    return [*lines, *_baselines(report), *_scales(report), *_assumed(report), *_parameters(report)]


def _unseen(report: Report) -> Iterator[str]:
    names = list(report.trials)
    seen = [name for name in names if name in report.trained_on]
    if report.trained_on and len(seen) == len(names):
        yield (
            f"None of the {len(names)} trials is unseen: all were used in the fit, so the errors show "
            "how well the model was fitted, not how well it predicts."
        )
    elif seen:
        which = ", ".join(seen)
        yield f"{len(seen)} of {len(names)} trials were used in the fit ({which}): these flatter the model."
    elif not report.trained_on:
        yield "The trials behind the ship's numbers are not on record: whether these are unseen is not known."
    if len(names) == 1:
        yield "There is one trial: nothing shows how the errors vary from run to run."


def _horizon(report: Report) -> Iterator[str]:
    restarts = sorted({c.restart for c in report.comparisons if c.restart is not None})
    if restarts:
        every = " or ".join(f"{number(value)} s" for value in restarts)
        yield (
            f"Predictions were set back to the measured state every {every}: beyond that horizon nothing is "
            "shown, and the start of each stretch is free of error by construction."
        )
    if report.forecasts:
        yield (
            "The measured states are those of a smoother, which looks ahead and leans on the untuned model: read the "
            "forecasts for what the model foresees."
        )
    if any(c.restart is None for c in report.comparisons):
        yield "Free runs from the first sample: early errors are carried along and weigh in every later row."


def _range(trials: list[Trial]) -> Iterator[str]:
    kinds = sorted({str(t.meta["kind"]) for t in trials if "kind" in t.meta})
    if kinds:
        yield f"Kinds of manoeuvre covered: {', '.join(kinds)}. Others are extrapolation."
    speeds = [v[np.isfinite(v)] for v in (t["u"] for t in trials if "u" in t)]
    if speeds and sum(v.size for v in speeds):
        u = np.concatenate(speeds)
        low, high = number(float(u.min())), number(float(u.max()))
        yield f"Forward speed lay between {low} and {high} m/s; outside it nothing is shown."
    rates = [v[np.isfinite(v)] for v in (t["r"] for t in trials if "r" in t)]
    turning = np.concatenate([v[np.abs(v) > math.radians(0.1)] for v in rates]) if rates else np.zeros(0)
    if turning.size and abs(float(np.mean(np.sign(turning)))) > 0.9:
        side = "starboard" if turning.mean() > 0 else "port"
        yield f"The ship turned almost only to {side}; the other side is untested."


def _environment(trials: list[Trial]) -> Iterator[str]:
    calm = [t.name for t in trials if "U_T" not in t and "U_A" not in t]
    if calm:
        some = "any trial" if len(calm) == len(trials) else f"{len(calm)} of {len(trials)} trials"
        yield f"No wind was recorded in {some}: its effect is part of the error."
    if all("U_C" not in t for t in trials):
        yield "No current was recorded: a current shows up as an error of position."


def _baselines(report: Report) -> Iterator[str]:
    if CONSTANT_VELOCITY not in report.labels:
        yield "There is no constant-velocity baseline: whether the model beats doing nothing is not shown."
    incomplete = [name for name, found in report.trials.items() if len(found) < len(report.labels)]
    if incomplete:
        yield f"Not every label predicts {', '.join(incomplete)}; the pooled figures leave these trials out."


def _scales(report: Report) -> Iterator[str]:
    scales = {tuple(sorted(c.sigma.items())) for c in report.comparisons}
    if len(scales) > 1:
        yield "Trials are scaled by their own standard deviations: compare labels within a trial, not trials."


def _assumed(report: Report) -> Iterator[str]:
    if report.assumptions:
        names = ", ".join(f"{a.path} = {number(a.value)}{' ' * bool(a.unit)}{a.unit}" for a in report.assumptions[:6])
        more = ", ..." if len(report.assumptions) > 6 else ""
        yield f"Assumed, neither measured nor fitted: {names}{more}."


def _parameters(report: Report) -> Iterator[str]:
    if report.fit is None:
        return
    unknown = [v.subject for v in report.fit.verdicts if v.status != "identified"]
    if unknown:
        yield (
            f"{len(unknown)} of {len(report.fit.verdicts)} parameters or combinations are not, or only weakly, "
            "identified by these data (see the fit): the model may predict well, but do not read those "
            "numbers as physics."
        )


_MARK = "assumed"


@dataclass(frozen=True)
class Assumption:
    """One number that is assumed: where, how much in its unit, and why in the words of the ship file."""

    path: str
    value: float
    unit: str
    why: str


def assumptions(ship: Ship, fitted: Collection[str] = ()) -> tuple[Assumption, ...]:
    """What the ship file calls assumed, but for the paths that were `fitted`."""
    return tuple(
        Assumption(path, entry.given, entry.unit, entry.source[len(_MARK) :].lstrip(" :,;"))
        for path, entry in ship.entries.items()
        if entry.source.lower().startswith(_MARK) and path not in fitted
    )
