"""A probability from counted runs, with its interval, and the number of runs that a given accuracy takes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from .spread import LEVEL


@dataclass(frozen=True)
class Proportion:
    """A probability of which `hits` of `runs` independent runs speak."""

    hits: int
    runs: int

    @property
    def value(self) -> float:
        """Share of the hits; NaN without runs."""
        return self.hits / self.runs if self.runs else math.nan

    @cached_property
    def interval(self) -> tuple[float, float]:
        """Interval of Clopper and Pearson (1934): holds the truth in 95 % of cases at least, also at 0 hits."""
        if not self.runs:
            return 0.0, 1.0
        from scipy.stats import binomtest

        found = binomtest(self.hits, self.runs).proportion_ci(LEVEL, method="exact")
        return float(found.low), float(found.high)

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
