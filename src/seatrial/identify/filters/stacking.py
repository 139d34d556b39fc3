"""Forecasts put together from those of a model and of its rivals, weighted by what is known at the start.

A model that does not know all (a mooring, a contact) is too bold where that acts: part of its way is then better.
The forecast here is that of who stays put, plus a share of the model's way and a share of that of constant velocity.
The shares are least squares on forecasts of logs that the model has not been fitted to, linear in features of the
start, and drawn towards the model alone.  Bands are as wide as those forecasts need, by regime.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass, replace
from ...data import Array
from . import CONSTANT_VELOCITY, MODEL, STAYING
from .ahead import Ahead, joined

# Position (north and east together) and heading have shares of their own.
TARGETS = (slice(0, 2), slice(2, 3))
# Of the mean square of the regressors, as many readings' worth: draws the shares towards the model alone.
RIDGE = 0.01

Features = Callable[[Ahead], Array]
Regime = Callable[[Ahead], NDArray[np.intp]]


@dataclass(frozen=True)
class Stack:
    """Shares of the ways of model and constant velocity.

    Attributes:
        features: of the starts of some forecasts, shape (forecasts, features), the first a column of ones.
        shares: beyond the model alone, shape (targets, 2, features).
    """

    features: Features
    shares: Array

    @classmethod
    def fitted(cls, some: Ahead, features: Features) -> Stack:
        """The shares that are best for some forecasts, which the model's fit must not have seen."""
        return cls(features, np.array([_shares(some, part, features(some)) for part in TARGETS]))

    def of(self, some: Ahead) -> Ahead:
        """The forecasts with those of the model replaced by the stacked ones."""
        found, errors = self.features(some), some.errors[MODEL].copy()
        for part, shares in zip(TARGETS, self.shares, strict=True):
            errors[:, part] += sum(
                (found @ share)[:, None] * way for share, way in zip(shares, _ways(some, part), strict=True)
            )
        return replace(some, errors={**some.errors, MODEL: errors})


def _ways(some: Ahead, part: slice) -> tuple[Array, Array]:
    """The way of the model, and that of constant velocity, from where the ship is at the start."""
    still = some.errors[STAYING][:, part]
    return some.errors[MODEL][:, part] - still, some.errors[CONSTANT_VELOCITY][:, part] - still


def _shares(some: Ahead, part: slice, features: Array) -> Array:
    ways = [way.T.reshape(-1) for way in _ways(some, part)]
    rows = np.tile(features, (part.stop - part.start, 1))
    table = np.column_stack([way[:, None] * rows for way in ways])
    square = table.T @ table
    drawn = square + RIDGE * np.diag(np.diagonal(square) + 1e-12)
    found = np.linalg.solve(drawn, -table.T @ some.errors[MODEL][:, part].T.reshape(-1))
    return np.asarray(found.reshape(2, -1), dtype=np.float64)


@dataclass(frozen=True)
class Bands:
    """Standard deviations of forecasts by regime, such that bands of `share` hold what they state.

    Attributes:
        regime: number of the regime of each forecast, from 0.
        scale: by regime, of position and heading: a factor of the filter's sigma, or with `alone` the value itself.
    """

    regime: Regime
    scale: Array
    alone: bool = False

    @classmethod
    def fitted(cls, some: Ahead, regime: Regime, share: float, *, alone: bool = False) -> Bands:
        """The scales that forecasts need which the model's fit has not seen; a regime they lack has those of all."""
        from scipy.special import ndtri

        size = np.abs(some.errors[MODEL]) / (1.0 if alone else some.sigma)
        which, scale = regime(some), list[list[float]]()
        for k in range(int(which.max()) + 1):
            rows = which == k if (which == k).any() else np.ones_like(which, dtype=np.bool_)
            scale.append([float(np.quantile(size[rows, part], share)) for part in TARGETS])
        return cls(regime, np.array(scale) / float(ndtri(0.5 + 0.5 * share)), alone)

    def of(self, some: Ahead) -> Ahead:
        """The forecasts with these bands."""
        which = np.minimum(self.regime(some), len(self.scale) - 1)
        scale = self.scale[which][:, [0, 0, 1]]
        return replace(some, sigma=scale if self.alone else scale * some.sigma)


def crossed(groups: Sequence[Ahead], features: Features | None) -> tuple[Ahead, ...]:
    """Each group, stacked with shares that come from the others; without features as it is."""
    if features is None:
        return tuple(groups)
    apart = [joined([other for i, other in enumerate(groups) if i != k]) for k in range(len(groups))]
    return tuple(Stack.fitted(rest, features).of(one) for rest, one in zip(apart, groups, strict=True))


def chosen(
    horizons: Sequence[Sequence[Ahead]], candidates: Mapping[str, Features | None], trials: Sequence[str]
) -> str:
    """The candidate whose crossed forecasts are best against the rivals, in the mean of logarithms.

    Args:
        horizons: the groups of each horizon, forecast by fits that have not seen them.
        candidates: features by name; None is the model alone.
        trials: beginnings of names; each trial, horizon, position and heading counts the same.
    """

    def score(name: str) -> float:
        each = [joined(crossed(groups, candidates[name])) for groups in horizons]
        return float(np.mean([np.log(one.of(trial).ratio()) for one in each for trial in trials]))

    return min(candidates, key=score)


def banded(horizons: Sequence[Sequence[Ahead]], candidates: Mapping[str, tuple[Regime, bool]], share: float) -> str:
    """The candidate whose bands for each group, from the other groups, have the best interval score.

    Args:
        horizons: the groups of each horizon; horizons, position and heading count the same, by logarithms.
        candidates: regime by name, and whether the filter's sigma is left out.
        share: what the bands state.
    """

    def score(name: str) -> float:
        total = list[float]()
        for groups in horizons:
            for k, one in enumerate(groups):
                rest = joined([other for i, other in enumerate(groups) if i != k])
                bands = Bands.fitted(rest, candidates[name][0], share, alone=candidates[name][1])
                total.extend(np.log(interval_score(bands.of(one), share)))
        return float(np.mean(total))

    return min(candidates, key=score)


def interval_score(some: Ahead, share: float) -> tuple[float, float]:
    """Mean score of the bands of position and heading: their width, and what lies outside times 2 / (1 - share).

    Smaller is better, and least for the bands that hold their share (the interval score of Gneiting and Raftery 2007).
    """
    from scipy.special import ndtri

    half = float(ndtri(0.5 + 0.5 * share)) * some.sigma
    beyond = np.maximum(np.abs(some.errors[MODEL]) - half, 0.0)
    score = 2.0 * half + 2.0 / (1.0 - share) * beyond
    return float(score[:, :2].mean()), float(score[:, 2].mean())
