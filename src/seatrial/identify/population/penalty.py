"""Box constraints of CMA-ES: penalties on samples outside the box, which are scored at its nearest point.

Positions within the box go from 0 to 1.  A penalty sees one generation after the other and belongs to one run.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Any, Protocol

import numpy as np

from ...data import Array

# Steepness of `Spread`: in units of the generation's spread of values per squared spread of samples.
_STEEP = 10.0
# Of Hansen et al. 2009: generations over which the spread of the objective is watched, deviations by which the mean
# may leave the box before a weight grows, and the factor of this growth.
_WATCHED, _OUT, _GROWTH = 20, 3.0, 1.1


class Penalty(Protocol):
    """Values that CMA-ES is given for a generation."""

    def values(self, asked: Array, inside: Array, costs: Array, strategy: Any) -> Array:
        """Objectives with penalty, shape (candidates,).

        Args:
            asked: samples, shape (candidates, free).
            inside: the nearest points of the box, which were scored.
            costs: their objectives; inf where the model blows up.
            strategy: the `cmaes.CMA` that drew the samples.
        """
        ...


def penalty(name: str, start: Array) -> Penalty:
    """The penalty of this name, of `KINDS`, for one run; `start` is the declared start of the parameters."""
    return KINDS[name](start)


def ranked(costs: Array, inside: Array, start: Array) -> Array:
    """Finite objectives: a candidate that cannot be simulated is worse than all, the more so the farther from `start`.

    Where no candidate can be simulated, only the distance counts.
    """
    good, far = np.isfinite(costs), ((inside - start) ** 2).sum(axis=1)
    if not good.any():
        return far
    worst = float(costs[good].max())
    return np.where(good, costs, worst + (1.0 + far) * max(abs(worst), 1e-300))


def spread(costs: Array) -> float:
    """Interquartile range of the objectives of a generation; zero where none is finite."""
    good = costs[np.isfinite(costs)]
    return float(np.subtract(*np.quantile(good, [0.75, 0.25]))) if good.size else 0.0


class Spread:
    """Squared distance to the box, in the generation's own spread of samples and of objectives.

    Measured so, it neither hides the objective nor lets the mean wander off, whatever their scales.
    """

    def __init__(self, start: Array) -> None:
        self.start = start

    def values(self, asked: Array, inside: Array, costs: Array, strategy: Any) -> Array:
        away = ((asked - inside) ** 2).sum(axis=1) / max(float(asked.var(axis=0).mean()), 1e-300)
        return ranked(costs, inside, self.start) + _STEEP * spread(costs) * away


class Adaptive:
    """Weights by coordinate that grow while the mean is far outside (Hansen et al. 2009, IEEE TEC 13, section IV).

    The method that Sakamoto and Akimoto (2017) revise and Suyama 2023 uses in their revision; see docs/decisions.md.
    """

    def __init__(self, start: Array) -> None:
        self.start = start
        self.gamma = np.zeros(start.size)
        self.set = False
        self.spreads = deque[float]()

    def values(self, asked: Array, inside: Array, costs: Array, strategy: Any) -> Array:
        n, size = self.start.size, len(costs)
        mean, spans = np.asarray(strategy.mean), np.diag(strategy._C)
        out = np.abs(mean - np.clip(mean, 0.0, 1.0))
        self.spreads.append(spread(costs))
        while len(self.spreads) > _WATCHED + math.ceil(3 * n / size):
            self.spreads.popleft()
        if not self.set and out.any():
            steep = float(np.median(self.spreads)) / max(float(strategy._sigma**2 * spans.mean()), 1e-300)
            self.gamma, self.set = np.full(n, 2.0 * steep), True
        elif self.set:
            far = out > _OUT * strategy._sigma * np.sqrt(spans) * max(1.0, math.sqrt(n) / strategy._mu_eff)
            self.gamma = np.where(far, self.gamma * _GROWTH ** max(1.0, strategy._mu_eff / (10.0 * n)), self.gamma)
        scale = np.exp(0.9 * (np.log(spans) - np.log(spans).mean()))
        return ranked(costs, inside, self.start) + (self.gamma * (asked - inside) ** 2 / scale).mean(axis=1)


KINDS: dict[str, type[Spread] | type[Adaptive]] = {"spread": Spread, "hansen2009": Adaptive}
"""Penalties by the name that `estimator.penalty` of a study gives."""
