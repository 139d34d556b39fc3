"""How an index is distributed over the runs: quantiles with intervals, and histograms."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...core.values import dataclass
from ...data import Array

SHARES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
"""Probabilities of the quantiles that are given."""

LEVEL = 0.95
"""Confidence of all intervals."""

_BARS = 40
# The drawn range holds this share of the runs; the rest is counted beside it, so that no outlier hides the others.
_DRAWN = 0.998
# So many values tell whether all are multiples of a step.
_LOOK = 10_000


@dataclass(frozen=True)
class Quantile:
    """A quantile of an index.

    Attributes:
        share: probability below it.
        value: of the runs; linear between neighbours.
        low, high: interval of confidence 0.95 from two runs by their ranks, whatever the distribution; NaN where there
            are too few runs for a bound.
    """

    share: float
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Spread:
    """An index over the runs that reached it.

    Attributes:
        count: number of them.
        missing: number of runs that did not reach it.
        mean, sigma: mean and standard deviation; NaN where there are too few.
        least, most: range.
        quantiles: at `SHARES`.
    """

    count: int
    missing: int
    mean: float
    sigma: float
    least: float
    most: float
    quantiles: tuple[Quantile, ...]


def spread(values: Array) -> Spread:
    """Of an index per run, NaN where a run did not reach it, shape (runs,)."""
    there = np.sort(values[np.isfinite(values)])
    n = len(there)
    if not n:
        return Spread(0, len(values), math.nan, math.nan, math.nan, math.nan, ())
    sigma = float(there.std(ddof=1)) if n > 1 else math.nan
    return Spread(n, len(values) - n, float(there.mean()), sigma, float(there[0]), float(there[-1]),
                  tuple(_quantile(there, share) for share in SHARES))  # fmt: skip


def _quantile(rising: Array, share: float) -> Quantile:
    """The number of runs below a quantile is binomial, so that two ranks hold it with the confidence (David 1981)."""
    from scipy.stats import binom

    n, tail = len(rising), 0.5 * (1.0 - LEVEL)
    low, high = int(binom.ppf(tail, n, share)) - 1, int(binom.ppf(1.0 - tail, n, share))
    under, over = low >= 0, high < n
    return Quantile(share, float(np.quantile(rising, share)), float(rising[low]) if under else math.nan,
                    float(rising[high]) if over else math.nan)  # fmt: skip


@dataclass(frozen=True)
class Histogram:
    """Shares of the runs of several cases between common edges.

    Attributes:
        edges: shape (bars + 1,).
        shares: share of the runs of each case in each bar, shape (cases, bars).
        beyond: share of the runs of each case outside the edges.
    """

    edges: Array
    shares: Array
    beyond: tuple[float, ...]


def histogram(groups: Sequence[Array]) -> Histogram | None:
    """Of finite values by case; None where there are none or all are the same."""
    there = np.concatenate(groups)
    if not len(there):
        return None
    low, high = np.quantile(there, [0.5 - 0.5 * _DRAWN, 0.5 + 0.5 * _DRAWN])
    if not high - low > 1e-9 * max(abs(low), abs(high)):
        return None
    edges = _edges(float(low), float(high), np.unique(there[:_LOOK].round(9)))
    counts = np.stack([np.histogram(group, edges)[0] / max(len(group), 1) for group in groups])
    return Histogram(edges, counts, tuple(float(1.0 - row.sum()) if len(group) else 0.0
                                          for row, group in zip(counts, groups, strict=True)))  # fmt: skip


def _edges(low: float, high: float, levels: Array) -> Array:
    """Edges of bars; times that are multiples of a step fall in the middle of equal numbers of steps."""
    step = float(np.diff(levels).min()) if 1 < len(levels) < _LOOK // 10 else 0.0
    if high - low < 2 * len(levels) * step:
        width = max(round((high - low) / step / _BARS), 1) * step
        first = low - 0.5 * step
        bars = max(math.ceil((high + 0.5 * step - first) / width - 1e-6), 1)
        return np.asarray(first + width * np.arange(bars + 1), dtype=np.float64)
    margin = 0.02 * (high - low)
    return np.linspace(low - margin, high + margin, _BARS + 1, dtype=np.float64)
