"""An irregular sea as a sum of seeded waves, and the motion of a ship in it to first order.

Contract: a `Sea` is long-crested or spread about a mean direction; `waves` gives its components, always the same ones
for the same seed.  Their phase at a place and a time is one expression of both,

    theta_j = omega_j t - k_j (x cos beta_j + y sin beta_j) + eps_j,   k_j = omega_j^2 / g,

so a ship under way meets them at the frequency of encounter without that frequency being computed; an own phase
omega_e t instead would run wild in a turn.  `spectra` has the spectra, `rao` the operators, `reading` the files.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...core.constants import GRAVITY
from ...core.errors import WeatherError
from ...core.values import dataclass, field
from ...data import Array
from .spectra import Moments, SeaSpectrum, moments

_BANDS = 300
_LOW, _HIGH = 0.5, 6.0
"""Ends of the components over the peak's frequency: 99.9 % of the variance of a developed sea lie between."""


class Waves(NamedTuple):
    """Components of a sea, each an array of the same shape.

    Attributes:
        omega: frequency from a point at rest [rad/s].
        k: wave number in deep water [rad/m].
        beta: direction it travels towards, clockwise from north [rad].
        a: amplitude [m].
        eps: phase at the origin and t = 0 [rad].
    """

    omega: Array
    k: Array
    beta: Array
    a: Array
    eps: Array

    def phase(self, t: Array, x: Array, y: Array) -> Array:
        """Phases [rad] at times and places north and east of the origin, shape (samples, components)."""
        north, east = self.k * np.cos(self.beta), self.k * np.sin(self.beta)
        return np.outer(t, self.omega) - np.outer(x, north) - np.outer(y, east) + self.eps

    def elevation(self, t: Array, x: Array, y: Array) -> Array:
        """Surface above still water [m]."""
        return np.cos(self.phase(t, x, y)) @ self.a


@dataclass(frozen=True)
class Sea:
    """An irregular sea of 300 waves.

    Each has the variance of its band of frequency; where in the middle half of the band it lies is drawn, so that the
    sea does not repeat itself after the time of one band.

    Attributes:
        spectrum: of the surface.
        gamma_W: mean direction that the waves come from, clockwise from north [rad].
        spread: exponent s of cos^2s((beta - mean)/2), the spread of directions; infinite is long-crested.
        seed: of frequencies, phases and directions.

    Raises:
        WeatherError: a direction beyond two turns, an exponent below 1, a seed below 0.
    """

    spectrum: SeaSpectrum
    gamma_W: float = 0.0
    spread: float = math.inf
    seed: int = 0
    waves: Waves = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not abs(self.gamma_W) <= 4.0 * math.pi:
            raise WeatherError(f"waves from {self.gamma_W:g} rad, beyond two turns; convert degrees to radians")
        if not self.spread >= 1.0:
            raise WeatherError(f"an exponent of spread of {self.spread:g}; give 1 or more, inf for long crests")
        if self.seed < 0:
            raise WeatherError(f"a seed of {self.seed}; give zero or above")
        object.__setattr__(self, "waves", self._drawn())

    @property
    def moments(self) -> Moments:
        """Moments of the spectrum within the components' ends."""
        return moments(self.spectrum, _LOW * self.spectrum.omega_P, _HIGH * self.spectrum.omega_P)

    def _drawn(self) -> Waves:
        edges = np.linspace(_LOW, _HIGH, _BANDS + 1) * self.spectrum.omega_P
        middle, width = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
        ends = self.spectrum.density(edges)
        variance = (ends[1:] + 4.0 * self.spectrum.density(middle) + ends[:-1]) * width / 6.0
        random = np.random.Generator(np.random.Philox(key=[self.seed, 0x5EA]))
        place, phase, side = random.random((3, _BANDS))
        omega = middle + 0.5 * (place - 0.5) * width
        beta = self.gamma_W + math.pi + _deviations(side, self.spread)
        return Waves(omega, omega**2 / GRAVITY, beta, np.sqrt(2.0 * variance), 2.0 * math.pi * phase)


def encountered(omega: Array, U: float, chi: float) -> Array:
    """Frequency of encounter [rad/s] at a speed U [m/s], chi [rad] from following (0) to head sea (pi), deep water.

    In a following sea it passes through zero and is then negative: the ship overtakes the waves.
    """
    return omega - omega**2 / GRAVITY * U * math.cos(chi)


def _deviations(share: Array, s: float) -> Array:
    """Directions about the mean [rad] below which the share of the energy lies."""
    if math.isinf(s):
        return np.zeros_like(share)
    angle = np.linspace(-math.pi, math.pi, 7201)
    below = np.cumsum(np.cos(0.5 * angle) ** (2.0 * s))
    return np.interp(share, below / below[-1], angle)
