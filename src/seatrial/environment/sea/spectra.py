"""Spectra of the sea: how the variance of the surface is spread over the frequencies.

All densities are one-sided, in m^2 s/rad, over the frequency `omega` [rad/s] seen from a point at rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from ...core.constants import GRAVITY
from ...core.errors import WeatherError
from ...core.values import dataclass
from ...data import Array

_MOST = 40.0


class SeaSpectrum(Protocol):
    """A spectrum with one peak."""

    @property
    def omega_P(self) -> float:
        """Frequency of the peak [rad/s]."""
        ...

    def density(self, omega: Array) -> Array:
        """Density [m^2 s/rad] at the frequencies `omega` [rad/s], all above zero; of their shape."""
        ...


@dataclass(frozen=True)
class PiersonMoskowitz:
    """Pierson and Moskowitz (1964), a fully developed sea: S = A omega^-5 exp(-B omega^-4).

    A = 8.1e-3 g^2, B = 0.74 (g/V)^4 with V the wind at 19.5 m, for which that at 20 m is often taken.

    Raises:
        WeatherError: a wind that is not above 0, or beyond 60 m/s.
    """

    V: float

    def __post_init__(self) -> None:
        if not 0.0 < self.V <= 60.0:
            raise WeatherError(f"a wind of {self.V:g} m/s under a developed sea; give one above 0 and up to 60")

    @property
    def omega_P(self) -> float:
        return (0.8 * 0.74) ** 0.25 * GRAVITY / self.V

    def density(self, omega: Array) -> Array:
        return _two(omega, 8.1e-3 * GRAVITY**2, 0.74 * (GRAVITY / self.V) ** 4)


@dataclass(frozen=True)
class Ittc:
    """ITTC's (1978) spectrum of two parameters, also Bretschneider's: the shape of Pierson and Moskowitz.

    Attributes:
        H_S: significant height [m].
        T_P: period of the peak [s].

    Raises:
        WeatherError: a height or a period that no sea has.
    """

    H_S: float
    T_P: float

    def __post_init__(self) -> None:
        _possible(self.H_S, self.T_P)

    @property
    def omega_P(self) -> float:
        return 2.0 * math.pi / self.T_P

    def density(self, omega: Array) -> Array:
        return _two(omega, 0.3125 * self.H_S**2 * self.omega_P**4, 1.25 * self.omega_P**4)


@dataclass(frozen=True)
class Jonswap:
    """JONSWAP (Hasselmann 1973) in the form of DNV-RP-C205: the shape of a developed sea with a higher peak.

    The factor 1 - 0.287 ln gamma keeps the variance within 0.2 % up to gamma = 5 and 0.9 % at 7.

    Attributes:
        H_S: significant height [m].
        T_P: period of the peak [s].
        gamma: height of the peak over that of a developed sea; None is DNV's by T_P / sqrt(H_S), from 1 to 5.

    Raises:
        WeatherError: a height, a period or a gamma that no sea has.
    """

    H_S: float
    T_P: float
    gamma: float | None = None

    def __post_init__(self) -> None:
        _possible(self.H_S, self.T_P)
        if self.gamma is not None and not 1.0 <= self.gamma <= 10.0:
            raise WeatherError(f"a peak factor gamma of {self.gamma:g}; give one from 1 to 10, often 3.3")

    @property
    def omega_P(self) -> float:
        return 2.0 * math.pi / self.T_P

    @property
    def peak(self) -> float:
        """gamma, or DNV's where none is given."""
        if self.gamma is not None or self.H_S == 0.0:
            return self.gamma or 1.0
        steep = self.T_P / math.sqrt(self.H_S)
        return min(max(math.exp(5.75 - 1.15 * steep), 1.0), 5.0)

    def density(self, omega: Array) -> Array:
        omega_P, gamma = self.omega_P, self.peak
        sigma = np.where(omega <= omega_P, 0.07, 0.09)
        higher = gamma ** np.exp(-0.5 * ((omega - omega_P) / (sigma * omega_P)) ** 2)
        return (1.0 - 0.287 * math.log(gamma)) * Ittc(self.H_S, self.T_P).density(omega) * higher


class Moments(NamedTuple):
    """Moments of a spectrum: m_n is the integral of omega^n S [m^2 (rad/s)^n]."""

    m0: float
    m1: float
    m2: float

    @property
    def H_S(self) -> float:
        """Significant height, four standard deviations [m]."""
        return 4.0 * math.sqrt(self.m0)

    @property
    def T_01(self) -> float:
        """Mean period [s]."""
        return 2.0 * math.pi * self.m0 / self.m1

    @property
    def T_z(self) -> float:
        """Mean period between upward crossings of zero [s]."""
        return 2.0 * math.pi * math.sqrt(self.m0 / self.m2)


def moments(spectrum: SeaSpectrum, low: float = 0.05, high: float = 12.0) -> Moments:
    """m0, m1, m2 between two frequencies [rad/s]; m2 grows with `high` as the tail is slow."""
    omega = np.geomspace(low, high, 8001)
    S = spectrum.density(omega)
    return Moments(*(float(np.trapezoid(S * omega**n, omega)) for n in range(3)))


def _two(omega: Array, A: float, B: float) -> Array:
    return A * omega**-5.0 * np.exp(-B * omega**-4.0)


def _possible(H_S: float, T_P: float) -> None:
    if not 0.0 <= H_S <= _MOST:
        raise WeatherError(f"a significant height of {H_S:g} m; give one from 0 to {_MOST:g}")
    if not 0.5 <= T_P <= 40.0:
        raise WeatherError(f"a peak period of {T_P:g} s; give one from 0.5 to 40")
    if 2.0 * math.pi * H_S > 0.1 * GRAVITY * T_P * T_P:
        raise WeatherError(f"waves of {H_S:g} m at a peak period of {T_P:g} s would break; give a longer period")
