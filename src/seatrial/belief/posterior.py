"""The parameters of a ship with their joint density, fitted or stated, and the only way to draw from it.

Draws are of the best that is known: samples of the posterior, else the normal density of the covariance; either is
widened by what trials left out of the fit say (`power`).  Bounds are respected here and nowhere
else: a draw is one of that density given that it lies within the bounds of the study and the physical ranges.
"""

from __future__ import annotations

import numpy as np

from ..core.parameters import Free, specs
from ..core.values import dataclass, field
from ..data import Array
from ..ships import Ship
from ..study.grounds import Grounds, Ranges
from .power import Power, directions

# Draws outside the bounds are thrown away, so many times over; chains make them where fewer than this share are within.
_TRIES, _RARE = 40, 0.05
# Steps of a chain, and how far within the bounds it begins, over sigma.
_STEPS, _INSIDE = 150, 0.2
# A bound so many sigmas away cuts nothing off.
_REACH = 5.0
# Of a bound's distance from the estimate, what rounding may leave.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Posterior:
    """Parameters of a fitted ship with their joint density.

    Attributes:
        ship: the fitted ship, as its file has it.
        free: the parameters as they were declared.
        mean: estimates, shape (free,).
        covariance: shape (free, free).
        digest: of the fit; empty of one that is not kept, such as a fit that leaves trials out.
        grounds: trials of the fit, their kinds and the ranges that they cover.
        power: how much less the likelihood is worth by trials left out in turn; None where none were.
        samples: draws of its sampled posterior (`identify --sample`), shape (draws, free); None where it was not.
        form: share of its variance that is of what the form of the model lacks (`Diagnosis.form`).
        fitted: whether trials stand behind it; else it is what the file of an estimated ship states, number by number.
    """

    ship: Ship
    free: tuple[Free, ...]
    mean: Array
    covariance: Array
    digest: str = ""
    grounds: Grounds = field(default_factory=Grounds)
    power: Power | None = None
    samples: Array | None = None
    form: float = 0.0
    fitted: bool = True

    @property
    def names(self) -> tuple[str, ...]:
        """Paths of the parameters."""
        return tuple(one.path for one in self.free)

    @property
    def covered(self) -> Ranges:
        """Range of each channel in the trials of the fit, SI units."""
        return self.grounds.covered

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Least and greatest value of each parameter, by the study and by physics, shape (free,) each."""
        known = specs(self.ship.model)
        ends = [(one.low, one.high) if (own := known.get(one.path)) is None
                else (max(one.low, own.low), min(one.high, own.high)) for one in self.free]  # fmt: skip
        low, high = np.array(ends, dtype=np.float64).reshape(-1, 2).T
        slack = _ROUNDING * np.abs(self.mean)  # an estimate at a bound is within it
        return np.where(np.abs(self.mean - low) <= slack, np.minimum(low, self.mean), low), \
            np.where(np.abs(self.mean - high) <= slack, np.maximum(high, self.mean), high)  # fmt: skip

    @property
    def normal(self) -> bool:
        """Whether it is just the normal density of its covariance: no samples, widening or bound within reach."""
        low, high = self.bounds
        reach = _REACH * np.sqrt(np.diag(self.covariance))
        within = bool(np.all((self.mean - low >= reach) & (high - self.mean >= reach)))
        return within and self.samples is None and self.power is None

    def draws(self, count: int, seed: int) -> Array:
        """So many draws within the bounds of the study and the physical ranges, shape (count, free).

        The same seed gives the same draws.
        """
        low, high = self.bounds
        rng, kept = np.random.default_rng(seed), np.zeros((0, len(self.free)))
        for tried in range(1, _TRIES + 1):
            drawn = self._anywhere(count, rng)
            kept = np.vstack([kept, drawn[np.all((drawn >= low) & (drawn <= high), axis=1)]])
            if len(kept) >= count:
                return kept[:count]
            if len(kept) < _RARE * tried * count:
                break
        return self._within(count, rng, low, high)

    def _axes(self, count: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
        """Independent directions of the normal density, shape (free, free), and its standard deviation in each.

        The deviations are those of each draw, shape (count, free), as it has a factor of its own where left-out trials
        have widened it; and those without that factor, shape (free,).
        """
        if self.power is None:
            weight, vectors = np.linalg.eigh(0.5 * (self.covariance + self.covariance.T))
            plain = np.sqrt(np.maximum(weight, 0.0))
            return vectors, np.broadcast_to(plain, (count, len(plain))), plain
        whole = self.covariance if self.samples is not None else self.power.of(self.free, self.covariance)
        across, fixed = directions(self.free, whole)
        return across, self.power.deviations(fixed, count, rng), 1.0 / np.sqrt(1.0 + fixed)

    def _anywhere(self, count: int, rng: np.random.Generator) -> Array:
        """Draws whatever the bounds, shape (count, free)."""
        if self.samples is not None and self.power is None:
            return self.samples[rng.integers(0, len(self.samples), count)]
        across, wide, plain = self._axes(count, rng)
        if self.samples is None:
            return self.mean + (wide * rng.standard_normal((count, len(self.mean)))) @ across.T
        drawn = self.samples[rng.integers(0, len(self.samples), count)] - self.mean
        return self.mean + (np.linalg.solve(across, drawn.T).T * wide / plain) @ across.T

    def _within(self, count: int, rng: np.random.Generator, low: Array, high: Array) -> Array:
        """Draws of the normal density given the bounds, each the end of a chain of its own.

        Elliptical slice sampling without rejection (Murray et al. 2010; Gessner et al. 2020): a point, and another of
        the density, span an ellipse about the estimate, whose parts within the bounds are known in closed form.
        """
        across, wide, _ = self._axes(count, rng)
        sigma = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        room = _INSIDE * np.minimum(sigma, np.where(high > low, high - low, 0.0))
        away = np.tile(np.clip(self.mean, low + room, high - room) - self.mean, (count, 1))
        for _ in range(_STEPS):
            other = (wide * rng.standard_normal(away.shape)) @ across.T
            angle = _angle(away, other, low - self.mean, high - self.mean, rng)[:, None]
            away = away * np.cos(angle) + other * np.sin(angle)
        return np.clip(self.mean + away, low, high)  # of what rounding leaves


def _angle(a: Array, b: Array, low: Array, high: Array, rng: np.random.Generator) -> Array:
    """An angle at which a cos + b sin lies within the bounds, all of them alike; a itself does.  Shape (draws,).

    Each bound takes one arc away: about the far side of the ellipse for a lower, about the near side for an upper one.
    """
    r, near = np.hypot(a, b), np.arctan2(b, a)
    with np.errstate(divide="ignore", invalid="ignore"):
        under, over = np.where(low > -r, np.pi - np.arccos(np.clip(low / r, -1.0, 1.0)), 0.0), \
            np.where(high < r, np.arccos(np.clip(high / r, -1.0, 1.0)), 0.0)  # fmt: skip
    half = np.hstack([under, over])
    begin = np.mod(np.hstack([near + np.pi, near]) - half, 2.0 * np.pi)
    begin = np.where(half > 0.0, begin, 0.0)
    order = np.argsort(begin, axis=1)
    begin, end = (np.take_along_axis(one, order, axis=1) for one in (begin, begin + 2.0 * half))
    last = np.hstack([np.zeros((len(a), 1)), np.maximum.accumulate(end, axis=1)])
    free = np.maximum(np.hstack([begin, np.full((len(a), 1), 2.0 * np.pi)]) - last, 0.0)  # before each arc, and after
    total = np.cumsum(free, axis=1)
    wanted = rng.random((len(a), 1)) * total[:, -1:]
    k = np.argmax(total > wanted, axis=1)[:, None]
    rest = wanted - np.take_along_axis(total - free, k, axis=1)
    return np.where(total[:, -1] > 0.0, (np.take_along_axis(last, k, axis=1) + rest)[:, 0], 0.0)
