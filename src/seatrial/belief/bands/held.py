"""How often bands held on trials, and how wide they were, by kind of manoeuvre and time since the start."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...campaign.analysis.proportion import Proportion
from ...core.values import dataclass
from ...data import Array, Trial, unwrapped
from ...models import STATES
from .prediction import Fan

GROUPS: Mapping[str, tuple[str, ...]] = {"position": ("x", "y"), "heading": ("psi",), "speeds": ("u", "v_m", "r")}
"""States that are counted together."""

ALL = "all kinds"
"""The row of a table that pools the kinds of manoeuvre."""
_STATES = np.arange(len(STATES))
# Share of a horizon by which the reading that stands for it may be earlier.
_EARLY = 0.2
SHARES = (0.1, 0.5, 1.0)
"""Horizons as shares of the longest one."""


@dataclass(frozen=True)
class Held:
    """Windows of one kind at one horizon.

    Attributes:
        horizon: [s].
        windows, trials: their numbers.
        inside: share of the measurements within their bands by group.
        between: its interval of 95 %, where windows of one trial are as alike as the trials differ.
        width: mean half width of each state, SI units.
        error: root mean square error of each state, SI units.
    """

    kind: str
    horizon: float
    windows: int
    trials: int
    inside: Mapping[str, float]
    between: Mapping[str, tuple[float, float]]
    width: Mapping[str, float]
    error: Mapping[str, float]

    @property
    def distance(self) -> float:
        """Root mean square distance from the measured place [m]."""
        return math.hypot(self.error["x"], self.error["y"])


@dataclass(frozen=True)
class Windows:
    """Windows of one trial where they reach a horizon; NaN where one ends before, or nothing was measured.

    Attributes:
        kind: of manoeuvre.
        horizons: [s], shape (horizons,).
        error: predicted minus measured, shape (windows, horizons, 6).
        half: half widths of the bands, of the same shape.
        inside: whether the measurement lies within its band, 1 or 0, of the same shape.
    """

    kind: str
    horizons: Array
    error: Array
    half: Array
    inside: Array

    @staticmethod
    def of(kind: str, horizons: Sequence[float] | Array, error: Array, half: Array) -> Windows:
        """Of bands that lie alike to both sides of the prediction."""
        inside = np.where(np.isfinite(error), np.abs(error) <= half, np.nan)
        return Windows(kind, np.array(horizons, dtype=np.float64), error, half, inside)


def windows(made: Fan, measured: Trial, horizons: Sequence[float]) -> Windows:
    """The rows of a prediction that lie so many seconds after its starts; NaN where a window is over before.

    Args:
        measured: the trial that was predicted, with the rows of the prediction among its own.
    """
    off, read = differences(made, measured), _last_read(made, measured)
    starts = np.append(np.flatnonzero(made.since == 0.0), len(made.since))
    error = np.full((len(starts) - 1, len(horizons), len(STATES)), np.nan)
    half = error.copy()
    slack = 0.5 * float(np.median(np.diff(made.predicted.t))) if len(made.since) > 1 else 0.0
    for k, (a, b) in enumerate(pairwise(starts.tolist())):
        for j, h in enumerate(horizons):
            row = a + int(np.searchsorted(made.since[a:b], h - slack))
            # a restart at the horizon replaces the row that ends the window: the last one before stands for it
            row = row - 1 if row == b < len(made.since) and made.since[b - 1] > h - 4.0 * slack else row
            if row < b:
                late = made.since[row] - made.since[read[row]] <= _EARLY * h
                rows = np.where((read[row] >= a) & late, read[row], row)
                error[k, j], half[k, j] = off[rows, _STATES], made.half[rows, _STATES]
    known = np.isfinite(error) & np.isfinite(half)
    return Windows.of(made.kind, horizons, np.where(known, error, np.nan), np.where(known, half, np.nan))


def _last_read(made: Fan, measured: Trial) -> NDArray[np.intp]:
    """Row of the latest reading of each state until a row, shape (rows, 6); the row itself where that is too old."""
    off, rows = differences(made, measured), np.arange(len(made.since))
    found = np.maximum.accumulate(np.where(np.isfinite(off), rows[:, None], -1), axis=0)
    usual = np.array([_usual(made.predicted.t[np.isfinite(column)]) for column in off.T])
    age = made.predicted.t[:, None] - made.predicted.t[np.maximum(found, 0)]
    return np.where((found >= 0) & (age <= 1.5 * usual), found, rows[:, None])


def read_at(at: Array, t: Array, values: Array) -> Array:
    """What a channel read at some times, between the two readings about each; NaN in a gap and beyond the ends.

    A receiver at 1 Hz has no value on most rows of a log at 5 Hz, and is known between its readings all the same.
    """
    times = t[np.isfinite(values)]
    if times.size < 2:
        return np.full(at.shape, np.nan)
    found = np.interp(at, times, values[np.isfinite(values)], left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(times, at), 1, times.size - 1)
    return np.where(times[after] - times[after - 1] <= 1.5 * _usual(times), found, np.nan)


def _usual(times: Array) -> float:
    """Usual time between readings."""
    return float(np.median(np.diff(times))) if times.size > 1 else 0.0


def differences(made: Fan, measured: Trial) -> Array:
    """Predicted minus measured, headings by the smaller angle, shape (rows, 6); NaN where nothing was measured."""
    rows = np.clip(np.searchsorted(measured.t, made.predicted.t - 1e-9), 0, len(measured) - 1)
    off = made.predicted.stack(*STATES) - measured.rows(rows).stack(*STATES)
    off[:, 2] = off[:, 2] - 2.0 * np.pi * np.round(off[:, 2] / (2.0 * np.pi))
    return off


def held(found: Iterable[Windows]) -> tuple[Held, ...]:
    """Coverage by kind and horizon, all kinds together last; horizons that no window reaches are left out.

    Args:
        found: windows of trials, all with as many horizons.
    """
    every = list(found)
    kinds = dict.fromkeys(sorted(one.kind for one in every))
    parts = [(kind, [one for one in every if one.kind == kind]) for kind in kinds]
    parts += [(ALL, every)] if len(parts) > 1 else []
    rows = (_row(kind, some, j) for kind, some in parts for j in range(len(some[0].horizons)))
    return tuple(row for row in rows if row is not None)


def _row(kind: str, some: Sequence[Windows], j: int) -> Held | None:
    error, half, inside = (np.concatenate([vars(one)[name][:, j] for one in some])
                           for name in ("error", "half", "inside"))  # fmt: skip
    here = np.isfinite(error).any(axis=1)
    if not here.any():
        return None
    shares = {name: inside[here][:, [STATES.index(one) for one in group]] for name, group in GROUPS.items()}
    between = {name: _between([one.inside[:, j, [STATES.index(state) for state in group]] for one in some])
               for name, group in GROUPS.items()}  # fmt: skip
    return Held(
        kind, float(np.median([one.horizons[j] for one in some])), int(here.sum()),
        sum(bool(np.isfinite(one.error[:, j]).any()) for one in some),
        {name: float(_mean(share.reshape(-1, 1))[0]) for name, share in shares.items()}, between,
        dict(zip(STATES, _mean(half[here]).tolist(), strict=True)),
        dict(zip(STATES, np.sqrt(_mean(error[here] ** 2)).tolist(), strict=True)),
    )  # fmt: skip


def _between(trials: Sequence[Array]) -> tuple[float, float]:
    """Interval of a share; of each trial whether states lie within their bands, shape (windows, states)."""
    counted = [one[np.isfinite(one).any(axis=1)] for one in trials]
    some = [one for one in counted if len(one)]
    return Proportion.of_parts([float(np.nanmean(one)) for one in some], [len(one) for one in some]).interval


def _mean(found: Array) -> Array:
    """Mean of each column over its numbers; NaN of a column without any."""
    count = np.isfinite(found).sum(axis=0)
    return np.where(count > 0, np.nansum(found, axis=0), np.nan) / np.maximum(count, 1)


def unwrapped_to(made: Fan, measured: Trial) -> Array:
    """Measured headings, continuous and on the turn of the predicted ones, on the rows of the trial [rad]."""
    psi = unwrapped(measured["psi"])
    first = np.searchsorted(measured.t, made.predicted.t[0] - 1e-9)
    return psi + 2.0 * np.pi * np.round((made.predicted["psi"][0] - psi[first]) / (2.0 * np.pi))
