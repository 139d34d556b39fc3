"""Bands of manoeuvre indices by the errors of those of left-out trials.

Bands of states at given times do not make bands of indices: what a model lacks all along a manoeuvre shifts an index
more than accelerations that come and go, although both leave states as far apart.  So indices have factors of their
own: a score is the error of an index over the spread of the draws' (`indexing.left_out`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from statistics import NormalDist

import numpy as np

from ....core.values import dataclass
from ....data import Array
from ..conformal import factors, needed


@dataclass(frozen=True)
class LeftIndices:
    """Indices of left-out manoeuvres, one row an index of a trial.

    Attributes:
        groups, kinds, names: recording, kind of manoeuvre and index.
        error: predicted minus measured, SI units, shape (rows,).
        spread: standard deviation of the draws there, of the same shape.
    """

    groups: tuple[str, ...]
    kinds: tuple[str, ...]
    names: tuple[str, ...]
    error: Array
    spread: Array

    def factor(self, kind: str, name: str, level: float) -> float | None:
        """Half width over spread of an index at a level of 0 to 1; None where left-out trials do not show it.

        Each index has a size of its own, drawn towards that of all.  The quantile is that of all indices together, or
        that of the kind of manoeuvre where it is greater: turns must not pay for zigzags.
        """
        label = f"{kind} {name}"
        if label not in self._labels or len(set(self.groups)) < needed(level):
            return None
        own = [k for k, one in enumerate(self.kinds) if one == kind]
        found = [self._factor(label, rows, level) for rows in (range(len(self.names)), own)]
        return max(one for one in found if one is not None)

    def _factor(self, label: str, rows: Sequence[int], level: float) -> float | None:
        """By some rows; None where they are too few.

        Indices of one recording depend on each other: recordings are counted by `factor`, here each index is a case.
        """
        if len(rows) < needed(level):
            return None
        score = (np.abs(self.error) / self.spread)[[*rows]]
        labels = [self._labels[k] for k in rows]
        groups = [f"{self.groups[k]} {self._labels[k]}" for k in rows]
        made = factors(score[:, None, None], groups, labels, level)
        return float(made.factor[made.kinds.index(label), 0, 0])

    @cached_property
    def _labels(self) -> list[str]:
        return [f"{kind} {name}" for kind, name in zip(self.kinds, self.names, strict=True)]

    def apart(self, kind: str, name: str, values: Array, fitted: float, level: float) -> Array | None:
        """Indices of draws put so far apart that their band is the calibrated one; None as of `factor`.

        Their order stays; those that no draw reached stay NaN.
        """
        factor, reached = self.factor(kind, name, level), np.isfinite(values)
        if factor is None or reached.sum() < 2 or not np.isfinite(fitted):
            return None
        half = factor * float(np.std(values[reached]))
        ranks = np.empty(int(reached.sum()))
        ranks[np.argsort(values[reached], kind="stable")] = (np.arange(len(ranks)) + 0.5) / len(ranks)
        normal = np.array([NormalDist().inv_cdf(share) for share in ranks])
        out = np.full(values.shape, np.nan)
        out[reached] = fitted + half / NormalDist().inv_cdf(0.5 * (1.0 + level)) * normal
        return out
