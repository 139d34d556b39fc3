"""A probability from counted runs, with its interval, and the number of runs that a given accuracy takes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

from ...core.values import dataclass
from .spread import LEVEL


@dataclass(frozen=True)
class Proportion:
    """A probability of which `hits` of `runs` independent runs speak; no whole numbers where they are estimated."""

    hits: float
    runs: float

    @staticmethod
    def of_parts(shares: Sequence[float], counts: Sequence[int]) -> Proportion:
        """A probability of which parts speak whose runs are alike, such as the windows of one trial.

        Runs count as many as give the variance between the parts (Korn and Graubard 1998), at most all of them and at
        least one a part.  Where every run or none hits, or of one part, nothing tells how alike they are: all count.

        Args:
            shares: of the hits in each part.
            counts: runs of each part, positive.
        """
        total, parts = sum(counts), len(counts)
        value = sum(share * count for share, count in zip(shares, counts, strict=True)) / total if total else math.nan
        off = sum((count * (share - value)) ** 2 for share, count in zip(shares, counts, strict=True))
        if parts < 2 or not 0.0 < value < 1.0 or off == 0.0:
            return Proportion(value * total if total else 0.0, total)
        variance = parts / (parts - 1) * off / total**2
        runs = min(max(value * (1.0 - value) / variance, parts), total)
        return Proportion(value * runs, runs)

    @property
    def value(self) -> float:
        """Share of the hits; NaN without runs."""
        return self.hits / self.runs if self.runs else math.nan

    @cached_property
    def interval(self) -> tuple[float, float]:
        """Interval of Clopper and Pearson (1934): holds the truth in 95 % of cases at least, also at 0 hits."""
        return self.within(LEVEL)

    def within(self, level: float) -> tuple[float, float]:
        """The same of another level."""
        if not self.runs:
            return 0.0, 1.0
        from scipy.special import betaincinv

        hits, misses, tail = self.hits, self.runs - self.hits, 0.5 * (1.0 - level)
        low = float(betaincinv(hits, misses + 1.0, tail)) if hits > 0 else 0.0
        return low, float(betaincinv(hits + 1.0, misses, 1.0 - tail)) if misses > 0 else 1.0

    def needed(self, accuracy: float = 0.1) -> int:
        """Runs for an interval of +- `accuracy` times the probability.

        Without a hit: for the upper end of the interval, so at least as many are needed.
        """
        from scipy.special import ndtri

        p = self.value if self.hits else self.interval[1]
        return math.ceil((float(ndtri(0.5 + 0.5 * LEVEL)) / accuracy) ** 2 * (1.0 - p) / p) if p > 0 else 0


def runs_to_exclude(probability: float) -> int:
    """Runs without a hit that show a probability to be below this one, with confidence 0.95."""
    return math.ceil(math.log1p(-LEVEL) / math.log1p(-probability))
