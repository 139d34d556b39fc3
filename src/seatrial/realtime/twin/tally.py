"""How large the innovations are, hour by hour, against what they should be."""

from __future__ import annotations

import math

from ...core.values import dataclass, field

_HOUR = 3600.0
# The level follows the innovations with this time constant, counted in readings.
_MEMORY = 4000.0


@dataclass
class Counts:
    """What happened to rows that could not be taken in."""

    late: int = 0
    waiting: int = 0
    gaps: int = 0
    restarts: int = 0


@dataclass(frozen=True)
class Hour:
    """Innovations of one hour.

    Attributes:
        start: of the hour [s].
        nis: sum of normalised innovations squared.
        readings: how many they come from.
    """

    start: float
    nis: float = 0.0
    readings: int = 0

    @property
    def mean(self) -> float:
        """Per reading: 1 where the filter is right."""
        return self.nis / self.readings if self.readings else math.nan

    def band(self, share: float = 0.95) -> tuple[float, float]:
        """Range of the mean that holds this share of the hours of a filter that is right."""
        from scipy.special import chdtri

        m = max(self.readings, 1)
        return float(chdtri(m, 0.5 + 0.5 * share)) / m, float(chdtri(m, 0.5 - 0.5 * share)) / m

    def inside(self, share: float = 0.95) -> bool:
        """Whether the mean is in its band."""
        low, high = self.band(share)
        return low <= self.mean <= high


@dataclass
class Tally:
    """Statistics of a run.

    Attributes:
        hours: all of them, the present one last.
        level: mean NIS per reading of late, and no less than 1: by how much evidence is discounted.
    """

    hours: list[Hour] = field(default_factory=list[Hour])
    level: float = 1.0
    _mean: float = 1.0

    def note(self, t: float, nis: float, readings: int) -> None:
        """Note a row."""
        if not readings:
            return
        start = _HOUR * math.floor(t / _HOUR)
        if not self.hours or self.hours[-1].start != start:
            self.hours.append(Hour(start))
        last = self.hours[-1]
        self.hours[-1] = Hour(start, last.nis + nis, last.readings + readings)
        weight = min(readings / _MEMORY, 1.0)
        self._mean += weight * (nis / readings - self._mean)
        self.level = max(1.0, self._mean)
