"""How large the innovations are, hour by hour, against what they should be, and how rough the sea makes each sensor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from .follow import Machine, Step

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


# Waves are what changes within this share of L/U; a sensor is rougher than stated from this variance ratio on.
_WITHIN, _ROUGHER = 0.5, 1.5
_FEWEST = 30
# A glitch counts as so many times the median of the squares at most.
_MOST = 12.0


@dataclass
class Roughness:
    """What the sensors show of first-order waves, which the model does not have, while the twin settles.

    Waves change within less than a length; what a wrong model or a wrong sensor leaves lasts longer, and stays in the
    innovations.
    """

    _seen: dict[int, list[tuple[float, float, float]]] = field(
        default_factory=dict[int, list[tuple[float, float, float]]]
    )

    def note(self, step: Step) -> None:
        """Note the innovations of a row."""
        for row, off, variance in zip(step.rows, step.innovation, np.diagonal(step.spread), strict=True):
            self._seen.setdefault(int(row), []).append((step.t, float(off), float(variance)))

    def noise(self, machine: Machine) -> Mapping[str, float]:
        """Standard deviation of each sensor that is rougher than stated, by its name."""
        span, out = _WITHIN * machine.ship.L_pp / max(machine.ship.speed, 1e-3), dict[str, float]()
        for name, sensor in machine.settings.sensors.items():
            excess = [self._excess(machine.channels.index(channel), span) for channel in sensor.channels]
            if max(excess) > 0.0:
                out[name] = math.sqrt(sensor.sd**2 + max(excess))
        return out

    def _excess(self, channel: int, span: float) -> float:
        """Variance of what changes quickly beyond that of the readings; 0 where it is as stated."""
        seen = self._seen.get(channel, [])
        if len(seen) < _FEWEST:
            return 0.0
        t, off, variance = np.array(seen).T
        first, last = np.searchsorted(t, t - 0.5 * span), np.searchsorted(t, t + 0.5 * span, "right")
        sums, count = np.concatenate([[0.0], np.cumsum(off)]), last - first
        quick = off - (sums[last] - sums[first]) / count
        some = count > 2
        if some.sum() < _FEWEST:
            return 0.0
        # a mean of so many readings takes its share of their variance away
        square = quick[some] ** 2 / (1.0 - 1.0 / count[some])
        found = float(np.mean(np.minimum(square, _MOST * np.median(square))))
        stated = float(np.median(variance[some]))
        return found - stated if found > _ROUGHER * stated else 0.0
