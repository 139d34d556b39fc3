"""The head of a report: the scores as they were declared, and where the subject is not the better one."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ..models import STATES
from .page import number

if TYPE_CHECKING:
    from . import Comparison
    from .report import Report

_DEGREES = math.degrees(1.0)
# What must be worse by more than this share to be called so.
_TIE = 0.02
_GROUPS = {"position": ("x", "y"), "heading": ("psi",)}


def sentence(report: Report) -> str:
    """The scores of all labels as they were declared, and the shortest forecasts."""
    if not report.comparisons:
        return "Nothing was compared."
    errors = report.pooled
    shared = sum(len(found) == len(report.labels) for found in report.trials.values())
    restarts = {c.restart for c in report.comparisons}
    how = f"predicted anew every {' or '.join(f'{r:g}' for r in sorted(r for r in restarts if r is not None))} s"
    if None in restarts:
        how = "predicted from the first sample on" if len(restarts) == 1 else f"{how} or from the first sample on"
    scores = ", ".join(f"'{label}' {number(errors[label])}" for label in report.labels)
    return f"Standardised error over {shared} trial{'s' * (shared != 1)}, {how}: {scores}.{_foreseen(report)}"


def against(report: Report) -> list[str]:
    """A line for each of the others: in how many trials the subject is better, and where it is not."""
    subject, found = report.labels[0] if report.labels else "", list[str]()
    for other in report.labels[1:]:
        both = [f for f in report.trials.values() if subject in f and other in f]
        wins = sum(f[subject].standardised < f[other].standardised for f in both)
        lost = worse(report, other)
        line = f"'{subject}' against '{other}': the lesser standardised error in {wins} of {len(both)}"
        found.append(f"{line}; yet the greater error of {'; of '.join(lost)}" if lost else line)
    return found


def worse(report: Report, other: str) -> list[str]:
    """Where the subject's error is the greater one: position and heading by time since the restart, then by state."""
    subject = report.labels[0]
    both = [(f[subject], f[other]) for f in report.trials.values() if subject in f and other in f]
    found: list[str] = []
    for what, channels in _GROUPS.items():
        ends = [
            end
            for end in sorted({e for mine, _ in both for e in mine.horizons})
            if _more(_grown((a for a, _ in both), end, channels), _grown((b for _, b in both), end, channels))
        ]
        if ends:
            found.append(f"{what} after {', '.join(f'{end:g}' for end in ends)} s")
    for name in STATES:
        mine, yours = (_rms((pair[k] for pair in both), name) for k in (0, 1))
        if _more(mine, yours):
            factor, unit = (_DEGREES, "°") if name in ("psi", "r") else (1.0, "")
            found.append(f"{name} ({number(factor * mine)}{unit} against {number(factor * yours)}{unit})")
    return found


def _more(mine: float, yours: float) -> bool:
    return mine > (1.0 + _TIE) * yours


def _grown(comparisons: Iterable[Comparison], end: float, channels: tuple[str, ...]) -> float:
    """Root mean square at one time since the restart; not a number where nobody has it."""
    squares = [sum(c.horizons[end].get(n, math.nan) ** 2 for n in channels) for c in comparisons if end in c.horizons]
    squares = [value for value in squares if math.isfinite(value)]
    return math.sqrt(float(np.mean(squares))) if squares else math.nan


def _rms(comparisons: Iterable[Comparison], name: str) -> float:
    """Root mean square error of a state over the trials, by samples."""
    parts = [(c.metrics[name].rmse, c.metrics[name].samples) for c in comparisons if name in c.metrics]
    count = sum(n for _, n in parts)
    return math.sqrt(sum(n * e * e for e, n in parts) / count) if count else math.nan


def _foreseen(report: Report) -> str:
    """The shortest forecasts in one sentence."""
    if not report.forecasts:
        return ""
    first = min(f.horizon for f in report.forecasts)
    rows = [f for f in report.forecasts if f.horizon == first]
    told: list[str] = []
    for label in dict.fromkeys(f.label for f in rows):
        own = [f for f in rows if f.label == label]
        count = sum(f.count for f in own)
        place, turn = (math.sqrt(sum(f.count * e * e for f, e in zip(own, errors, strict=True)) / count)
                       for errors in ([f.position for f in own], [f.heading for f in own]))  # fmt: skip
        told.append(f"'{label}' {number(place, 2)} m and {number(_DEGREES * turn, 2)}°")
    return f" Forecasts over {first:g} s, from what a filter knew at their start: {', '.join(told)}."
