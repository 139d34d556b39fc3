"""Straight lines that a logger drew over gaps: readings without noise among noisy ones.

A line drawn between two readings has no second difference.  Rows of a noisy instrument have one of its digits here and
there; a run of them so long that it is no chance (1 in 10^9, by how often single ones occur) is no reading.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ....core.constants import GRAVITY
from ....core.ranks import median, quantile
from ... import Array, Trial
from ...prepare import BREAK, Remedy, Step
from ..relations import length_of
from ..sensors import COMPARED, Fault, gaps_of, stretches

_FEWEST, _CHANCE = 10, 1e-9
# Of noise the third differences are 1.8 times the second ones; of a smooth curve, as of a simulation, far less.
_NOISY = 1.0
# Part of a digit that is none, and of the steps of a rounded channel that are whole.
_WHOLE, _ROUNDED = 0.02, 0.5
_PRINTED = 4e-9
"""Digits of a trial file: nine."""

Flags = NDArray[np.bool_]


def line_faults(trial: Trial) -> tuple[list[Fault], Trial]:
    """Lines of all channels, those drawn over the same rows together, and the trial with gaps in their place."""
    groups: dict[bytes, tuple[list[str], Flags]] = {}
    for name in _names(trial):
        drawn = lines(trial.t, trial[name], math.sqrt((length_of(trial) or 0.0) / GRAVITY))
        if drawn.any():
            groups.setdefault(drawn.tobytes(), ([], drawn))[0].append(name)
    faults: list[Fault] = []
    clean = trial
    for names, drawn in groups.values():
        spans = stretches(trial.t, drawn)
        longest = max(spans, key=lambda span: span[1] - span[0])
        several = f"{len(spans)} stretches, the longest " if len(spans) > 1 else ""
        rows = f"{int(drawn.sum())} of {len(trial)} rows"
        faults.append(Fault(
            "warning", ", ".join(names), "straight lines over gaps: no instrument read them",
            f"no noise in {rows}, {several}from t = {longest[0]:g} to {longest[1]:g} s",
            _masked(trial, drawn, names), "quality", "lines",
        ))  # fmt: skip
        clean = clean.having(**{name: np.where(drawn, np.nan, clean[name]) for name in names})
    return faults, clean


def _names(trial: Trial) -> Iterator[str]:
    for name in trial.channels:
        if name in COMPARED or name.split("_")[0] == "delta" or name.startswith("n_P"):
            yield name


def _masked(trial: Trial, drawn: Flags, names: list[str]) -> Remedy:
    """Gaps in what is compared; a control that a line took the place of is unknown, so its rows are cut out."""
    if set(names) <= set(COMPARED) or int(drawn.sum()) <= BREAK:
        return gaps_of(trial, drawn, *names)
    return Remedy(steps=(Step(do="cut", where=stretches(trial.t, drawn)),))


def lines(t: Array, values: Array, least_time: float = 0.0) -> Flags:
    """Rows between the ends of straight lines that are no chance; without the ends, which were read.

    Those that last less than `least_time` [s] are left: within a ship time most motion is a line.
    """
    drawn = np.zeros(t.size, dtype=np.bool_)
    at = np.flatnonzero(np.isfinite(values))
    if at.size < 5 * _FEWEST:
        return drawn
    known, time = values[at], t[at]
    slopes = np.diff(known) / np.diff(time)
    bend = np.abs(np.diff(slopes)) * 0.5 * (time[2:] - time[:-2])
    tolerance = _PRINTED * max(float(np.max(np.abs(known))), 1e-3)
    steps = np.diff(known)
    flat = (bend <= tolerance) & (np.abs(slopes[1:]) > 0) & ~_on_grid(steps)[1:]
    if not flat.any() or not _noisy(known, ~flat):
        return drawn
    share = min(float(np.mean(flat)), 1.0 - 1e-6)
    least = max(_FEWEST, math.ceil(math.log(_CHANCE) / math.log(share)))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flat.astype(np.int8), [0]])))
    for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if b - a >= least and time[b + 1] - time[a] >= least_time:
            drawn[at[a + 1] : at[b] + 1] = True
    return drawn & np.isfinite(values)


def _on_grid(steps: Array) -> Flags:
    """Steps that are whole numbers of the digit of an instrument; none of one that shows all digits.

    A rounded reading that changes by one digit a row draws a line as well, and was read.
    """
    sizes = np.abs(steps)
    moved = sizes[sizes > 0]
    digit = quantile(moved, 0.05) if moved.size else 0.0
    if digit <= 0.0:
        return np.zeros(steps.size, dtype=np.bool_)
    count = np.round(sizes / digit)
    whole = (np.abs(sizes / digit - count) < _WHOLE) & ((count > 0) | (sizes == 0))
    return whole if float(np.mean(whole)) > _ROUNDED else np.zeros(steps.size, dtype=np.bool_)


def _noisy(values: Array, bent: Flags) -> bool:
    """Whether the rows that no line holds are those of an instrument with noise, and are no smooth curve."""
    second, third = np.diff(values, 2), np.diff(values, 3)
    whole = bent[1:] & bent[:-1]
    if whole.sum() < _FEWEST:
        return False
    return bool(median(np.abs(third[whole])) > _NOISY * median(np.abs(second[bent])))
