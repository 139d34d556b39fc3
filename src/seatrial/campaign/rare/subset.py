"""Subset simulation (Au and Beck 2001, Probabilistic Engineering Mechanics 16): small probabilities from few runs.

A rare event is reached in levels: each keeps the tenth of its points nearest to the event, and the next level samples
the normal distribution inside the bound that they set, by Markov chains that start from them.  The probability is the
product of the shares.  Chains move by conditional sampling (Papaioannou et al. 2015, Probabilistic Engineering
Mechanics 41), which does not degrade with the number of inputs.  Their step is adapted from level to level, to the rate
of acceptance; a step that is adapted to the points of its own level biases the probability by some per cent.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from ...data import Array
from ..designs import uniform

SHARE = 10
"""One in so many points of a level starts a chain of the next; a chain has as many points."""

MOST = 12
"""Levels after which the search ends: beyond 1e-12 the quantiles of the inputs run out of digits."""

Limit = Callable[[Array], Array]
"""Margin of points in standard normal space, shape (points, dims): below zero in the event, NaN where unknown."""

Asking = Generator[Array, Array, "Level"]
"""A level under way: yields points, takes their margins, so that several searches can ask for theirs at once."""

# Streams of the Philox counters: beside those of a campaign's points and gusts.
_STREAM = 2**32
_WANTED, _START, _GAIN = 0.44, 0.6, 2.0  # rate of acceptance (Papaioannou 2015), first step, its adaptation


@dataclass(frozen=True)
class Level:
    """Points of one level.

    Attributes:
        points: in standard normal space, shape (runs, dims); the first tenth are seeds, then one step of all chains
            after the other.
        margins: shape (runs,), infinite where unknown.
        bound: margins of the level are at or below it; infinite for the first level.
        accepted: share of the moves that stayed inside; 1 for the first level.
        step: size of the moves of the next level, 1 for independent points.
    """

    points: Array
    margins: Array
    bound: float = math.inf
    accepted: float = 1.0
    step: float = _START

    @property
    def next_bound(self) -> float:
        """Margin that one point in ten is at or below; 0 where as many are in the event."""
        tenth = len(self.margins) // SHARE
        return max(float(np.partition(self.margins, tenth - 1)[tenth - 1]), 0.0)

    @property
    def inside(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Whether each point is inside the next bound; the event itself is below zero."""
        bound = self.next_bound
        return self.margins <= bound if bound > 0 else self.margins < 0

    @property
    def share(self) -> float:
        """Probability of the next level, given this one."""
        return float(self.inside.mean())

    @property
    def last(self) -> bool:
        """Whether a tenth of the points is in the event, so that no other level is needed."""
        return self.next_bound == 0.0

    @property
    def seeds(self) -> NDArray[np.intp]:
        """Rows where the chains of the next level start, a tenth of all; each once unless margins are equal."""
        members, chains = np.flatnonzero(self.inside), len(self.margins) // SHARE
        return members[np.arange(chains) * len(members) // chains]

    @property
    def stalled(self) -> bool:
        """Whether the next level would be no smaller: equal margins, or too few that are known."""
        return not self.next_bound < self.bound


def first_level(limit: Limit, seed: int, runs: int, dims: int) -> Level:
    """Independent points."""
    return _answered(limit, beginning(seed, runs, dims))


def next_level(limit: Limit, seed: int, number: int, above: Level) -> Level:
    """The level within the bound of the one `above`; `number` counts from 1."""
    return _answered(limit, onward(seed, number, above))


def _answered(limit: Limit, level: Asking) -> Level:
    points = next(level)
    while True:
        try:
            points = level.send(limit(points))
        except StopIteration as ended:
            return ended.value  # type: ignore[no-any-return]


def beginning(seed: int, runs: int, dims: int) -> Asking:
    """The level of `first_level`, under way."""
    points = _normal(seed, runs, dims, 0, 0)
    return Level(points, _known((yield points)))


def onward(seed: int, number: int, above: Level) -> Asking:
    """The level of `next_level`, under way."""
    bound, chosen = above.next_bound, above.seeds
    chains, dims = len(chosen), above.points.shape[1]
    points, margins, sigma, moved = [above.points[chosen]], [above.margins[chosen]], above.step, list[float]()
    for move in range(1, SHARE):
        proposed = math.sqrt(1.0 - sigma**2) * points[-1] + sigma * _normal(seed, chains, dims, number, move)
        there = _known((yield proposed))
        stays = there <= bound
        points.append(np.where(stays[:, None], proposed, points[-1]))
        margins.append(np.where(stays, there, margins[-1]))
        moved.append(float(stays.mean()))
    accepted = float(np.mean(moved))
    step = min(sigma * math.exp(_GAIN * (accepted - _WANTED)), 1.0)
    return Level(np.concatenate(points), np.concatenate(margins), bound, accepted, step)


def _normal(seed: int, runs: int, dims: int, level: int, move: int) -> Array:
    from scipy.special import ndtri

    return ndtri(uniform(seed, dims, 0, runs, _STREAM + level * SHARE + move))


def _known(margins: Array) -> Array:
    return np.where(np.isnan(margins), np.inf, margins)


@dataclass(frozen=True)
class Estimate:
    """Probability of the event.

    Attributes:
        probability: product of the shares of the levels; 0 where the search ended without a point in the event.
        variation: coefficient of variation: its standard deviation over itself, the greater of that by chains (Au and
            Beck 2001, Eqs. 27-30, with the levels taken as independent) and that by lineages (Chan and Lai 2013, Annals
            of Statistics 41(6)), which has what levels have in common.
    """

    probability: float
    variation: float

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of confidence 0.95 of a lognormal distribution of the estimate; (0, 1) where it is unknown."""
        if not (self.probability > 0 and math.isfinite(self.variation)):
            return 0.0, 1.0
        wide = math.exp(1.959963984540054 * math.sqrt(math.log1p(self.variation**2)))
        return self.probability / wide, min(self.probability * wide, 1.0)


def estimate(levels: Sequence[Level]) -> Estimate:
    """Probability from levels of which the last holds the event."""
    shares = [level.share for level in levels]
    if not all(shares):
        return Estimate(0.0, math.nan)
    by_chains = sum(_variance(level) for level in levels)
    return Estimate(math.prod(shares), math.sqrt(max(by_chains, _by_lineages(levels))))


def _by_lineages(levels: Sequence[Level]) -> float:
    """Squared coefficient of variation of the estimate, by which points of the first level the event descends from.

    The sum of the squared shares of the event, less what it is where all points are in the event.
    """
    first = np.arange(len(levels[0].margins))
    for above in levels[:-1]:
        first = np.tile(first[above.seeds], SHARE)
    share = np.bincount(first[levels[-1].inside]) / levels[-1].inside.sum()
    return float(share @ share) - 1.0 / len(first)


def _variance(level: Level) -> float:
    """Squared coefficient of variation of the share of a level: that of independent points, times 1 + gamma."""
    inside, n, p = level.inside, len(level.margins), level.share
    single = (1.0 - p) / (p * n)
    if not math.isfinite(level.bound) or p == 1.0:
        return single
    chains = inside.reshape(SHARE, -1).astype(np.float64)
    gamma = 0.0
    for lag in range(1, SHARE):
        together = float((chains[:-lag] * chains[lag:]).mean())
        gamma += 2.0 * (1.0 - lag / SHARE) * (together - p * p) / (p * (1.0 - p))
    return single * (1.0 + max(gamma, 0.0))
