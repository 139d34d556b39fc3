"""Evidence of a report: comparisons, fit and assumptions, and the limits of what they show."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..core.values import dataclass, field
from ..data import Trial
from ..identify import Fit
from ..identify.filters import CONSTANT_VELOCITY
from ..ships import Ship
from ..validate import Comparison
from ..validate.comparison import pooled
from ..validate.fitness import Fitness
from .blocks import number
from .page import ReportError

if TYPE_CHECKING:
    from ..belief.foresight import Foresight
    from ..belief.sampling.sampled import Sampled
    from .judging.fans import BandsHeld

PUBLISHED = "published"
TIE = 0.02
"""An error counts as greater if it is so by more than this share."""


@dataclass(frozen=True)
class Assumption:
    """One assumed number: its path, its value and unit, and the reason in the words of the ship file."""

    path: str
    value: float
    unit: str
    why: str


_MARK = "assumed"


def assumptions(ship: Ship, fitted: Collection[str] = ()) -> tuple[Assumption, ...]:
    """Numbers that the ship file marks as assumed, without the paths that were `fitted`."""
    return tuple(
        Assumption(path, entry.given, entry.unit, entry.source[len(_MARK) :].lstrip(" :,;"))
        for path, entry in ship.entries.items()
        if entry.source.lower().startswith(_MARK) and path not in fitted
    )


@dataclass(frozen=True)
class Evidence:
    """What was compared, with what, and on what grounds.

    Attributes:
        title: heading of the page.
        comparisons: any number of labels and trials, in the order to show; a trial has one
            comparison for each label.
        fit: the fit of the ship, if it was fitted.
        trained_on: names of the trials that the fit used.
        findings: what the checks of the data found, one line each.
        assumptions: numbers of the ship that are neither measured nor fitted.
        forecasts: errors of forecasts from filtered states, if the trials come from a smoother.
        provenance: ship, data files, software version, digest, command, date: name to text.
        fit_first: seconds of each trial on which its start was estimated, and which are not judged; None for none.
        changes: what was done to the trials before they were compared, one line each.
        fitness: verdicts on the errors for a purpose; None where none was asked for.
        uses: verdict on the errors by purpose, of all that are judged.
        drawn: draws of the posterior of the fit; None where it was not sampled.
        bands: bands of the predictions, and how often they held; None where none were asked for.
    """

    title: str
    comparisons: tuple[Comparison, ...]
    fit: Fit | None = None
    trained_on: tuple[str, ...] = ()
    findings: tuple[str, ...] = ()
    assumptions: tuple[Assumption, ...] = ()
    forecasts: tuple[Foresight, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict[str, str])
    fit_first: float | None = None
    changes: tuple[str, ...] = ()
    fitness: Fitness | None = None
    uses: Mapping[str, str] = field(default_factory=dict[str, str])
    drawn: Sampled | None = None
    bands: BandsHeld | None = None

    def __post_init__(self) -> None:
        seen: set[tuple[str, str]] = set()
        for c in self.comparisons:
            if (c.measured.name, c.label) in seen:
                raise ReportError(f"trial {c.measured.name} has two comparisons labelled '{c.label}'")
            seen.add((c.measured.name, c.label))

    @property
    def labels(self) -> tuple[str, ...]:
        """What predicts, the subject first and the constant-velocity baseline last."""
        order = list(dict.fromkeys(c.label for c in self.comparisons))
        rank = {PUBLISHED: 1, CONSTANT_VELOCITY: 2}
        return tuple(sorted(order, key=lambda label: rank.get(label, 0)))

    @property
    def trials(self) -> dict[str, dict[str, Comparison]]:
        """Comparisons by trial, then by label."""
        out: dict[str, dict[str, Comparison]] = {}
        for c in self.comparisons:
            out.setdefault(c.measured.name, {})[c.label] = c
        return out

    @property
    def pooled(self) -> dict[str, float]:
        """Standardised mean squared error by label, over the trials that every label predicts."""
        common = [found for found in self.trials.values() if len(found) == len(self.labels)]
        return {label: pooled(found[label] for found in common) for label in self.labels}


def caveats(evidence: Evidence) -> list[str]:
    """Sentences on the limits of the evidence, most important first."""
    if not evidence.comparisons:
        return ["Nothing was compared: the page contains no error of any prediction."]
    trials = [next(iter(found.values())).measured for found in evidence.trials.values()]
    lines = [*_unseen(evidence), *_horizon(evidence), *_range(trials), *_environment(trials)]
    return [*lines, *_baselines(evidence), *_scales(evidence), *_assumed(evidence), *_parameters(evidence)]


def _unseen(evidence: Evidence) -> Iterator[str]:
    names = list(evidence.trials)
    seen = [name for name in names if name in evidence.trained_on]
    if evidence.trained_on and len(seen) == len(names):
        yield (
            f"None of the {len(names)} trials is unseen: all were used in the fit, so the errors show "
            "the quality of the fit, not of predictions."
        )
    elif seen:
        which = ", ".join(seen)
        yield f"{len(seen)} of {len(names)} trials were used in the fit ({which}): too optimistic for predictions."
    elif not evidence.trained_on:
        yield "The trials that the ship was fitted to are not recorded: whether these are unseen is unknown."
    if len(names) == 1:
        yield "There is one trial: the variation of the errors between runs is unknown."


def _horizon(evidence: Evidence) -> Iterator[str]:
    restarts = sorted({c.restart for c in evidence.comparisons if c.restart is not None})
    if restarts:
        every = " or ".join(f"{number(value)} s" for value in restarts)
        yield (
            f"Predictions were reset to the measured state every {every}: nothing is shown beyond that horizon, "
            "and each prediction starts without error by construction."
        )
    if evidence.forecasts:
        yield (
            "The measured states come from a smoother, which uses later data and the untuned model: the forecasts "
            "show what the model predicts."
        )
    if evidence.fit_first is not None:
        yield (
            "State, current and biases of each trial were estimated with this model on its first "
            f"{evidence.fit_first:g} s, which are not judged; every label starts there in the same state, in the same "
            "current."
        )
    elif any(c.restart is None for c in evidence.comparisons):
        yield "Free-running predictions from the first sample: early errors remain in every later row."


def _range(trials: list[Trial]) -> Iterator[str]:
    kinds = sorted({str(t.meta["kind"]) for t in trials if "kind" in t.meta})
    if kinds:
        yield f"Kinds of manoeuvre covered: {', '.join(kinds)}. Others are extrapolation."
    speeds = [v[np.isfinite(v)] for v in (t["u"] for t in trials if "u" in t)]
    if speeds and sum(v.size for v in speeds):
        u = np.concatenate(speeds)
        low, high = number(float(u.min())), number(float(u.max()))
        yield f"Forward speed lay between {low} and {high} m/s; nothing is shown outside that range."
    rates = [v[np.isfinite(v)] for v in (t["r"] for t in trials if "r" in t)]
    turning = np.concatenate([v[np.abs(v) > math.radians(0.1)] for v in rates]) if rates else np.zeros(0)
    if turning.size and abs(float(np.mean(np.sign(turning)))) > 0.9:
        side = "starboard" if turning.mean() > 0 else "port"
        yield f"The ship turned almost only to {side}; turns to the other side are untested."


def _environment(trials: list[Trial]) -> Iterator[str]:
    calm = [t.name for t in trials if "U_T" not in t and "U_A" not in t]
    if calm:
        some = "any trial" if len(calm) == len(trials) else f"{len(calm)} of {len(trials)} trials"
        yield f"No wind was recorded in {some}: the effect of wind is part of the error."
    if all("U_C" not in t for t in trials):
        yield "No current was recorded: a current shows up as an error of position."


def _baselines(evidence: Evidence) -> Iterator[str]:
    if CONSTANT_VELOCITY not in evidence.labels:
        yield "There is no constant-velocity baseline: whether the model is better than no model is not shown."
    incomplete = [name for name, found in evidence.trials.items() if len(found) < len(evidence.labels)]
    if incomplete:
        yield f"Not every label predicts {', '.join(incomplete)}; the pooled errors leave these trials out."


def _scales(evidence: Evidence) -> Iterator[str]:
    scales = {tuple(sorted(c.sigma.items())) for c in evidence.comparisons}
    if len(scales) > 1:
        yield "Trials are scaled by their own standard deviations: compare labels within a trial, not trials."


def _assumed(evidence: Evidence) -> Iterator[str]:
    if evidence.assumptions:
        names = ", ".join(f"{a.path} = {number(a.value)}{' ' * bool(a.unit)}{a.unit}" for a in evidence.assumptions[:6])
        more = ", ..." if len(evidence.assumptions) > 6 else ""
        yield f"Assumed, neither measured nor fitted: {names}{more}."


def _parameters(evidence: Evidence) -> Iterator[str]:
    if evidence.fit is None:
        return
    verdicts = [v for v in evidence.fit.verdicts if v.subject in evidence.fit.vector.paths]
    graded = sum(v.status == "graded" for v in verdicts)
    if graded:
        yield (
            f"{graded} of {len(verdicts)} parameters are known within their ranges only if the form of the model is "
            "right, which the residuals contradict."
        )
    unknown = [v.subject for v in verdicts if v.status not in ("identified", "graded")]
    if unknown:
        yield (
            f"{len(unknown)} of {len(verdicts)} parameters are not, or only weakly, "
            "identified by these data (see the fit): the model may predict well, but those numbers are not "
            "physics."
        )
