"""Parts of trials: cut, segments without gaps, training, validation and test."""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import unknown
from .. import DataError, Dataset, Trial

LEAP = 1.5
"""From one row to the next, in median steps, beyond which rows are missing between them."""

BREAK = 10.5
"""From one row to the next, in median steps, beyond which the controls in between are unknown: a trial ends there."""


def complete(trial: Trial, names: Sequence[str] = ()) -> NDArray[np.bool_]:
    """Rows in which every one of the channels (all, where none is named) has a value; shape (samples,)."""
    wanted = tuple(names) or tuple(trial.channels)
    if not wanted:
        return np.ones(len(trial), dtype=np.bool_)
    return np.asarray(np.isfinite(trial.stack(*wanted)).all(axis=1))


def cut(trial: Trial, start: float = -math.inf, stop: float = math.inf) -> Trial:
    """The rows with start <= t <= stop [s]; time keeps its origin.

    Raises:
        DataError: fewer than two rows lie between.
    """
    inside = (trial.t >= start) & (trial.t <= stop)
    if inside.sum() < 2:
        span = f"{trial.t[0]:g} to {trial.t[-1]:g} s" if len(trial) else "nothing"
        raise DataError(f"{trial.name}: no rows between {start:g} and {stop:g} s; the trial covers {span}")
    return trial.rows(inside).noting(f"cut to {start:g}..{stop:g} s")


def drop_trailing_gaps(trial: Trial) -> Trial:
    """The trial without the rows at its end in which no channel has a value."""
    if not trial.channels:
        return trial
    filled = np.isfinite(trial.stack(*trial.channels)).any(axis=1)
    if not filled.any():
        raise DataError(f"{trial.name}: no row has any value")
    last = int(np.flatnonzero(filled)[-1])
    dropped = len(trial) - 1 - last
    return trial.rows(slice(0, last + 1)).noting(f"dropped {dropped} empty rows") if dropped else trial


def segments(trial: Trial, names: Sequence[str] = (), min_duration: float = 0.0) -> tuple[Trial, ...]:
    """The runs without a gap in the named channels (all, where none is named).

    A run also ends where time leaps by more than one and a half median steps.  Runs shorter than
    `min_duration` [s] or of one row are left out.  A trial that is one run comes back unchanged;
    otherwise the runs are named ``<trial>_1, _2, ...``.
    """
    good = complete(trial, names)
    leaps = np.flatnonzero(np.diff(trial.t) > LEAP * trial.dt) + 1
    edges = sorted({0, len(trial), *leaps.tolist(), *(np.flatnonzero(np.diff(good)) + 1).tolist()})
    runs = [(a, b) for a, b in pairwise(edges) if good[a] and b - a > 1]
    return _numbered(trial, [(a, b) for a, b in runs if trial.t[b - 1] - trial.t[a] >= min_duration], "without gaps")


def unbroken(trial: Trial, longest: float) -> tuple[Trial, ...]:
    """The runs between leaps of time longer than `longest` [s]: the controls in between are unknown.

    Runs of one row are left out.  A trial without such a leap comes back unchanged; otherwise the runs are
    named ``<trial>_1, _2, ...``.
    """
    edges = [0, *(np.flatnonzero(np.diff(trial.t) > longest) + 1).tolist(), len(trial)]
    if len(edges) == 2:
        return (trial,)
    return _numbered(trial, [(a, b) for a, b in pairwise(edges) if b - a > 1], "between leaps of time")


def without(trial: Trial, rows: NDArray[np.bool_], fewest: int) -> tuple[Trial, ...]:
    """The runs before, between and after some rows, of `fewest` rows at least, named as those of `segments`."""
    edges = [0, *(np.flatnonzero(np.diff(rows)) + 1).tolist(), len(trial)]
    return _numbered(trial, [(a, b) for a, b in pairwise(edges) if not rows[a] and b - a >= fewest], "without gaps")


def _numbered(trial: Trial, runs: Sequence[tuple[int, int]], what: str) -> tuple[Trial, ...]:
    """The runs from row to row, under names of their own; the trial unchanged where it is the only run."""
    if list(runs) == [(0, len(trial))]:
        return (trial,)
    return tuple(
        replace(trial.rows(slice(a, b)), name=f"{trial.name}_{k}").noting(f"run {k} {what}")
        for k, (a, b) in enumerate(runs, start=1)
    )


def split(trials: Iterable[Trial], validation: Sequence[str] = (), test: Sequence[str] = ()) -> Dataset:
    """Whole trials set aside by shell patterns over their names; what is left is for training.

    Raises:
        DataError: a pattern that fits no trial, or a trial that fits both lists.
    """
    every = tuple(trials)
    validating, testing = _matching(every, validation), _matching(every, test)
    if validating & testing:
        both = min(validating & testing)
        raise DataError(f"trial {both} fits a validation pattern and a test pattern; keep it in one")
    training = {trial.name for trial in every} - validating - testing
    parts = (tuple(trial for trial in every if trial.name in part) for part in (training, validating, testing))
    return Dataset(*parts)


def _matching(trials: Sequence[Trial], patterns: Sequence[str]) -> set[str]:
    found: set[str] = set()
    names = [trial.name for trial in trials]
    for pattern in patterns:
        fits = [name for name in names if fnmatch.fnmatchcase(name, pattern)]
        if not fits:
            raise DataError(f"pattern '{pattern}': {unknown(pattern, names, 'trial')}")
        found.update(fits)
    return found
