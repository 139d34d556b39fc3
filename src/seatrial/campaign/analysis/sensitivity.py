"""How much of the variance of an index is due to each input.

With design saltelli: indices of Sobol of first and total order by SALib (Saltelli 2010), with bootstrap intervals.
With other designs the first order alone, from the runs as they are ("given data"): the variance of the means over
classes of an input (Pearson's correlation ratio; Plischke et al. 2013, EJOR 226), free of the bias that few runs a
class have, with a jackknife over groups of runs; and Spearman's rank correlation, which tells the direction.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from ...core.errors import CampaignError
from ...core.values import dataclass
from ...data import Array

Method = Literal["Sobol indices (Saltelli 2010)", "first order from given data"]

# Resamples of SALib, fewer where there are many blocks: its arrays are blocks x resamples.
_RESAMPLES, _LEAST_RESAMPLES, _CELLS = 200, 20, 4_000_000
# A mean within a class is off by a fifth of the scatter with 25 runs; more classes than 50 resolve nothing that shows.
_CLASSES, _OF_A_CLASS = 50, 25
# Jackknife: an index without each twentieth of the runs in turn gives its standard error.
_GROUPS = 20
_Z = 1.959963984540054  # two-sided 95 % of a normal distribution
_SMALL = 1e-12


@dataclass(frozen=True)
class Effect:
    """What one input does to an index.

    Attributes:
        name: of the input.
        first: share of the variance that it explains alone; it may fall below zero by chance.
        first_error: half the interval of confidence 0.95.
        total: share of the variance that would remain if it alone were unknown, interactions included; NaN where the
            design does not give it.
        total_error: half the interval of confidence 0.95.
        rank: Spearman's rank correlation; NaN with design saltelli.
    """

    name: str
    first: float
    first_error: float
    total: float = math.nan
    total_error: float = math.nan
    rank: float = math.nan


@dataclass(frozen=True)
class Sensitivity:
    """Effects of all inputs on an index.

    Attributes:
        method: how they were found.
        used: blocks (saltelli) or runs that they are from.
        dropped: blocks or runs that were left out, because a run did not reach the index.
        effects: in the order of the inputs.
    """

    method: Method
    used: int
    dropped: int
    effects: tuple[Effect, ...]


def saltelli(names: tuple[str, ...], values: Array) -> Sensitivity | None:
    """Of runs in whole blocks A, AB_1 ... AB_d, B, shape (blocks * (inputs + 2),); None where nothing varies.

    A block with a run that did not reach the index is left out as a whole.

    Raises:
        CampaignError: SALib is not installed.
    """
    try:
        from SALib.analyze import sobol
    except ImportError:
        raise CampaignError("Sobol indices need the extra 'analysis': pip install 'seatrial[analysis]'") from None
    blocks = values.reshape(-1, len(names) + 2)
    kept = blocks[np.isfinite(blocks).all(axis=1)]
    if len(kept) < 2 or _still(kept):
        return None
    problem = {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}
    resamples = int(np.clip(_CELLS // len(kept), _LEAST_RESAMPLES, _RESAMPLES))
    found: Any = sobol.analyze(problem, kept.ravel(), calc_second_order=False, num_resamples=resamples, seed=1)
    columns = [found[key].tolist() for key in ("S1", "S1_conf", "ST", "ST_conf")]
    effects = tuple(Effect(name, *row) for name, *row in zip(names, *columns, strict=True))
    return Sensitivity("Sobol indices (Saltelli 2010)", len(kept), len(blocks) - len(kept), effects)


def given_data(inputs: Mapping[str, Array], values: Array) -> Sensitivity | None:
    """Of any runs; `inputs` by name and `values` have the shape (runs,).  None where nothing varies."""
    from scipy.stats import rankdata

    there = np.isfinite(values)
    y = values[there]
    if len(y) < 2 * _OF_A_CLASS or _still(y):
        return None
    ranks, effects = rankdata(y), list[Effect]()
    for name, column in inputs.items():
        x = column[there]
        if _still(x):
            effects.append(Effect(name, 0.0, 0.0, rank=0.0))
            continue
        own = rankdata(x)
        effects.append(Effect(name, *_first(own, y), rank=float(np.corrcoef(own, ranks)[0, 1])))
    return Sensitivity("first order from given data", len(y), len(values) - len(y), tuple(effects))


def _still(values: Array) -> bool:
    return float(np.ptp(values)) <= _SMALL * float(np.abs(values).max())


def _first(rank: Array, y: Array) -> tuple[float, float]:
    """Share of the variance between classes of an input, and half its interval."""
    levels, place = np.unique(rank, return_inverse=True)
    if len(levels) > _CLASSES:  # classes of equal numbers; an input of few values has these as classes
        classes = int(np.clip(len(y) // _OF_A_CLASS, 2, _CLASSES))
        place = np.minimum(((rank - 0.5) * classes / len(y)).astype(np.int64), classes - 1)
    classes = int(place.max()) + 1
    shape, cell = (_GROUPS, classes), np.arange(len(y)) % _GROUPS * classes + place
    centred = y - y.mean()
    sums = [np.bincount(cell, weight, _GROUPS * classes).reshape(shape) for weight in (None, centred, centred**2)]
    whole = [one.sum(axis=0) for one in sums]
    value = _ratio(*whole)
    parts = np.array([_ratio(*(all_ - one[k] for all_, one in zip(whole, sums, strict=True))) for k in range(_GROUPS)])
    error = math.sqrt((_GROUPS - 1) / _GROUPS * float(((parts - parts.mean()) ** 2).sum()))
    return value, _Z * error


def _ratio(count: Array, total: Array, squares: Array) -> float:
    """Variance between classes over all variance, from the numbers, sums and sums of squares of the classes."""
    full = count > 0
    n, k = float(count.sum()), int(full.sum())
    if n <= k:
        return math.nan
    within = float(squares.sum() - (total[full] ** 2 / count[full]).sum())
    whole = float(squares.sum() - total.sum() ** 2 / n)
    # the mean of a class scatters by its share of what is within: (k - 1) / (n - k) of it is no effect
    return (whole - within - (k - 1) * within / (n - k)) / whole
