"""Weather that changes over a run: gusts from a named spectrum, measured series, and sums.

Each is a `Weather` (see `environment`) and wraps or joins others: a gust on a steady wind, a measured wind with a
current.  A gust on a steady wind is a function of time and seed only, whatever the order, number and step of calls: a
second run, a longer run and one with half the step have the same wind, and the stages of an integrator the wind of
their step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.errors import WeatherError as WeatherError
from ..core.parameters import unknown
from ..core.values import dataclass
from ..data import Trial
from . import CHANNELS, VECTORS, Weather

Array = NDArray[np.float64]


class Spectrum(Protocol):
    """The spectrum of gusts along the mean wind."""

    def density(self, f: Array, U: float) -> Array:
        """One-sided density [m^2/s^2/Hz] at the frequencies `f` [Hz] in a mean wind of U [m/s] at 10 m."""
        ...


@dataclass(frozen=True)
class Davenport:
    """Davenport (1961): f S = 4 kappa U^2 X^2 / (1 + X^2)^(4/3), X = 1200 m f / U; variance 6 kappa U^2.

    The drag coefficient kappa of the surface is of the order of 0.001 to 0.003 over the sea.
    """

    kappa: float = 0.003

    def density(self, f: Array, U: float) -> Array:
        X = 1200.0 * f / U
        return 4.0 * self.kappa * U * U * X * X / (1.0 + X * X) ** (4.0 / 3.0) / f


@dataclass(frozen=True)
class Harris:
    """Harris (1971): f S = 4 kappa U^2 X / (2 + X^2)^(5/6), X = 1800 m f / U; variance 6.68 kappa U^2."""

    kappa: float = 0.003  # drag coefficient of the surface

    def density(self, f: Array, U: float) -> Array:
        X = 1800.0 * f / U
        return 4.0 * self.kappa * U * U * X / (2.0 + X * X) ** (5.0 / 6.0) / f


@dataclass(frozen=True)
class Froya:
    """Froya spectrum of NORSOK N-003 and API RP 2A, for strong wind over the North Sea, at a height z above it [m].

    S = 320 (U/10)^2 (z/10)^0.45 / (1 + X^0.468)^(5 / (3 * 0.468)), X = 172 f (z/10)^(2/3) (U/10)^-0.75,
    with U the mean of an hour at 10 m.
    """

    z: float = 10.0

    def density(self, f: Array, U: float) -> Array:
        X = 172.0 * f * (self.z / 10.0) ** (2.0 / 3.0) * (U / 10.0) ** -0.75
        level = 320.0 * (U / 10.0) ** 2 * (self.z / 10.0) ** 0.45
        return level / (1.0 + X**0.468) ** (5.0 / (3.0 * 0.468))


@dataclass(frozen=True)
class OchiShin:
    """Ochi and Shin (1988), over the sea: f S / (kappa U^2) of X = 10 m f / U in three branches.

    Written from memory of the paper and checked only in that the branches join.
    """

    kappa: float = 0.003  # drag coefficient of the surface

    def density(self, f: Array, U: float) -> Array:
        X = 10.0 * f / U
        tail = (1.0 + X**0.35) ** 11.5
        middle = 420.0 * X**0.70 / tail
        shape = np.where(X <= 0.003, 583.0 * X, np.where(X <= 0.1, middle, 838.0 * X / tail))
        return self.kappa * U * U * shape / f


SPECTRA: Mapping[str, Spectrum] = {
    "davenport": Davenport(), "harris": Harris(), "froya": Froya(), "ochi-shin": OchiShin(),
}  # fmt: skip
"""Spectra of gusts by name."""
# Two in a hundred of its frequency is the width of a band, so the gusts do not repeat within a run.
_LINES = 400
_ROWS = 4096


@dataclass(frozen=True)
class Gust:
    """Gusts on the mean wind of another weather, whose other channels it leaves as they are.

    The gust is a sum of harmonics, one for each of 400 bands of frequency from `low` to `high`, equally wide in the
    logarithm.  Each has the variance of its band, so that the whole has the integral of the spectrum; its frequency
    within the band and its phase are drawn once from the seed.  Harmonics above half the sampling rate of a coarse run
    keep their variance and appear at lower frequency.

    Attributes:
        base: the weather the gusts blow on; the spectrum is that of its mean wind speed.
        spectrum: "davenport", "harris", "froya" or "ochi-shin", or a spectrum with its own constants.
        seed: seed of frequencies and phases.
        across: standard deviation across the mean wind over that along it; lets the direction wander.
        low, high: ends of the spectrum [Hz]; slower variations are mean wind.

    Raises:
        WeatherError: no such spectrum, or an impossible interval or ratio.
    """

    base: Weather
    spectrum: str | Spectrum = "davenport"
    seed: int = 0
    across: float = 0.0
    low: float = 1.0 / 3600.0
    high: float = 1.0

    def __post_init__(self) -> None:
        if isinstance(self.spectrum, str) and self.spectrum not in SPECTRA:
            raise WeatherError(unknown(self.spectrum, SPECTRA, "gust spectrum"))
        if not 0.0 < self.low < self.high < math.inf:
            raise WeatherError(f"gusts between {self.low:g} and {self.high:g} Hz; give 0 < low < high")
        if not self.across >= 0.0:
            raise WeatherError(f"gusts across the wind of {self.across:g} times those along it; give 0 or more")

    def bands(self, U: float) -> tuple[Array, Array]:
        """Edges [Hz] of the bands, shape (401,), and the variance [m^2/s^2] of each in a mean wind of U [m/s]."""
        spectrum = SPECTRA[self.spectrum] if isinstance(self.spectrum, str) else self.spectrum
        edges = np.geomspace(self.low, self.high, _LINES + 1)
        if U <= 0.0:
            return edges, np.zeros(_LINES)
        # Simpson within each band, whose width is two in a hundred of its frequency.
        middle = 0.5 * (edges[1:] + edges[:-1])
        ends = spectrum.density(edges, U)
        return edges, (ends[1:] + 4.0 * spectrum.density(middle, U) + ends[:-1]) * np.diff(edges) / 6.0

    def variance(self, U: float) -> float:
        """Variance along the wind [m^2/s^2]: the spectrum from `low` to `high` in a mean wind of U [m/s]."""
        return float(self.bands(U)[1].sum())

    def gusts(self, t: Array, U: float) -> tuple[Array, Array]:
        """Velocities along and across the mean wind [m/s] at the times `t` [s]; each of the shape of `t`."""
        edges, variance = self.bands(U)
        random = np.random.default_rng(self.seed)
        place, phase = random.random((2, _LINES)), random.uniform(0.0, 2.0 * math.pi, (2, _LINES))
        omega = 2.0 * math.pi * (edges[:-1] + place * np.diff(edges))
        amplitude = np.sqrt(2.0 * variance)
        out = np.zeros((2, t.size))
        for start in range(0, t.size, _ROWS):
            rows = slice(start, start + _ROWS)
            for axis in range(2 if self.across else 1):
                out[axis, rows] = np.cos(np.outer(t[rows], omega[axis]) + phase[axis]) @ amplitude
        return out[0], self.across * out[1]

    def series(self, dt: float, steps: int) -> Array:
        out = np.array(np.broadcast_to(self.base.series(dt, steps), (steps, len(CHANNELS))))
        speed = np.hypot(out[:, 0], out[:, 1])
        U = float(speed.mean())
        if U <= 0.0:
            return out
        calm = speed <= 0.0
        north, east = (np.where(calm, 0.0, out[:, i] / np.where(calm, 1.0, speed)) for i in (0, 1))
        along, across = self.gusts(dt * np.arange(steps, dtype=np.float64), U)
        out[:, 0] += along * north - across * east
        out[:, 1] += along * east + across * north
        return out


_MEASURABLE = ("U_T", "gamma_T", "U_C", "gamma_C", "H_S", "T_W", "gamma_W", "depth")


@dataclass(frozen=True)
class Measured:
    """Weather as it was recorded; the first sample extends to earlier times and the last to later ones.

    Gaps (NaN) are bridged by the samples on either side.  Vectors are interpolated by their components, not by their
    angle, so that a wind around north stays northerly.

    Attributes:
        t: times of the samples [s], shape (samples,), rising; the run starts at 0.
        channels: any of U_T, gamma_T, U_C, gamma_C, H_S, T_W, gamma_W, depth (SI, radians) of the shape of `t`; a
            strength needs its direction.  Missing channels are calm and deep water.
        held: hold each sample until the next instead of linear interpolation.

    Raises:
        WeatherError: an unknown channel, a strength without direction, times that do not rise, no sample.
    """

    t: Array
    channels: Mapping[str, Array]
    held: bool = False

    def __post_init__(self) -> None:
        if not self.t.size or not (np.diff(self.t) > 0.0).all():
            raise WeatherError("measured weather: times must rise; sort them and drop those that repeat")
        for name, column in self.channels.items():
            if name not in _MEASURABLE:
                raise WeatherError("measured weather: " + unknown(name, _MEASURABLE, "channel"))
            if column.shape != self.t.shape:
                raise WeatherError(f"measured weather: {name} has {column.size} samples, time has {self.t.size}")
            if not np.isfinite(column).any():
                raise WeatherError(f"measured weather: {name} has no sample; leave the channel out")
        for _, strength, direction in VECTORS:
            if (strength in self.channels) != (direction in self.channels):
                raise WeatherError(f"measured weather: {strength} and {direction} go together; give both or none")
        if "depth" in self.channels and not (self.channels["depth"][np.isfinite(self.channels["depth"])] > 0).all():
            raise WeatherError("measured weather: a depth of zero or less; give the depth of the water in m")

    @classmethod
    def of(cls, trial: Trial, held: bool = False) -> Measured:
        """The recorded weather of a trial, from its first sample on; WeatherError: it has no channel of weather."""
        there = {name: trial[name] for name in _MEASURABLE if name in trial}
        if not there:
            raise WeatherError(f"{trial.name}: no channel of weather; it needs one of {', '.join(_MEASURABLE)}")
        return cls(trial.t - trial.t[0], there, held)

    def series(self, dt: float, steps: int) -> Array:
        at = dt * np.arange(steps, dtype=np.float64)
        out = np.zeros((steps, len(CHANNELS)))
        for of, strength, direction in VECTORS:
            if strength in self.channels:
                length, angle, first = self.channels[strength], self.channels[direction], CHANNELS.index(f"{of}_x")
                out[:, first] = self._sampled(length * np.cos(angle), at)
                out[:, first + 1] = self._sampled(length * np.sin(angle), at)
        if "T_W" in self.channels:
            out[:, CHANNELS.index("wave_T")] = self._sampled(self.channels["T_W"], at)
        if "depth" in self.channels:
            out[:, CHANNELS.index("per_depth")] = 1.0 / self._sampled(self.channels["depth"], at)
        return out

    def _sampled(self, values: Array, at: Array) -> Array:
        good = np.isfinite(values)
        t, y = self.t[good], values[good]
        if not self.held:
            return np.interp(at, t, y)
        # Rounding of a step must not select the sample before.
        before = np.searchsorted(t, at + 1e-9 * max(float(t[-1]), 1.0), side="right") - 1
        return y[np.maximum(before, 0)]


@dataclass(frozen=True)
class Together:
    """Several weathers at once: winds and currents add up, waves and depth come from one of them.

    Raises (by `series`):
        WeatherError: two of them have waves, or two have a bottom.
    """

    parts: tuple[Weather, ...]

    def series(self, dt: float, steps: int) -> Array:
        each = [np.broadcast_to(part.series(dt, steps), (steps, len(CHANNELS))) for part in self.parts]
        for what, columns in (("waves", slice(4, 7)), ("depth", slice(7, 8))):
            if sum(bool(series[:, columns].any()) for series in each) > 1:
                raise WeatherError(f"two weathers give {what}, which do not add up; give them in one only")
        return np.sum(each, axis=0) if each else np.zeros((steps, len(CHANNELS)))
