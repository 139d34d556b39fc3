"""Forecasts with bands from the present estimate, and how the earlier ones have turned out.

A forecast carries mean and covariance on without readings, to first order; the controls stay as they are now.  It is
held against what was read later with the controls that were logged in between, so that the twin is judged and not the
helm: what the log says of the controls is known, all else is forecast.  Beside it stands the same course and speed.
The first fix at or after its horizon judges a forecast, as fixes may come more seldom than rows.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from ...data import Array
from ...models import STATES
from .follow import Follower

HORIZONS = (30.0, 120.0, 600.0)
"""How far ahead forecasts are judged [s]."""

# Steps of a forecast are so many times those of the filter.
_LONGER = 4.0
# A fix that comes later than this share of the horizon judges no forecast.
_LATE = 0.5
# Share that the bands state, and its quantile.
LEVEL, _QUANTILE = 0.9, 1.6449
_POINTS = 40


@dataclass(frozen=True)
class Forecast:
    """Motion ahead.

    Attributes:
        t: times [s], shape (points,), the first is now.
        mean: x, y, psi, u, v_m, r, shape (points, 6).
        cov: covariance of x, y, psi, shape (points, 3, 3).
    """

    t: Array
    mean: Array
    cov: Array

    @property
    def half(self) -> Array:
        """Half widths of the bands of x, y [m] and psi [rad], shape (points, 3)."""
        return _QUANTILE * np.sqrt(np.diagonal(self.cov, axis1=1, axis2=2))


def forecast(follower: Follower, acting: Array, span: float = HORIZONS[-1]) -> Forecast:
    """From now on, with these controls and this environment."""
    t = follower.t + span * (np.arange(_POINTS + 1) / _POINTS) ** 1.5
    step = _LONGER * follower.machine.settings.step
    mean, cov = np.empty((t.size, len(STATES))), np.empty((t.size, 3, 3))
    for k, at in enumerate(t.tolist()):
        if k:
            follower, _ = follower.ahead(at, acting, step)
        mean[k], cov[k] = follower.mean[: len(STATES)], follower.cov[:3, :3]
    return Forecast(t, mean, cov)


@dataclass
class Score:
    """Forecasts over one horizon.

    Attributes:
        count: how many were judged.
        square: sum of squared distances between forecast and reading [m^2], and the same for constant velocity.
        inside: readings of x and y within their bands.
    """

    count: int = 0
    square: list[float] = field(default_factory=lambda: [0.0, 0.0])
    inside: int = 0

    @property
    def rms(self) -> float:
        """Root mean square distance [m]."""
        return math.sqrt(self.square[0] / self.count) if self.count else math.nan

    @property
    def rival(self) -> float:
        """The same for constant course and speed [m]."""
        return math.sqrt(self.square[1] / self.count) if self.count else math.nan

    @property
    def held(self) -> float:
        """Share of the readings of x and y within bands of `LEVEL`."""
        return self.inside / (2.0 * self.count) if self.count else math.nan


@dataclass
class _Waiting:
    """A forecast on its way."""

    start: Follower
    now: Follower
    left: list[float]


@dataclass
class Trust:
    """How forecasts turn out.

    Attributes:
        every: time between two of them [s].
        scores: by horizon [s].
    """

    every: float = 60.0
    scores: dict[float, Score] = field(default_factory=lambda: {h: Score() for h in HORIZONS})
    _waiting: deque[_Waiting] = field(default_factory=deque[_Waiting])
    _chunk: list[tuple[float, Array]] = field(default_factory=list[tuple[float, Array]])
    _last: float = -math.inf
    _fix: float = -math.inf
    _between: float = math.inf

    def clear(self) -> None:
        """Drop what is on its way: a fault was found, or the motion began anew."""
        self._waiting.clear()
        self._chunk.clear()

    def note(self, follower: Follower, acting: Array, readings: Array) -> None:
        """Note a row that the filter has taken in; forecasts that end here are judged by its readings.

        Args:
            acting: controls and environment since the row before.
        """
        t, step, fixed = follower.t, _LONGER * follower.machine.settings.step, _fixed(follower, readings)
        if self._waiting:
            self._chunk.append((t, acting))
            due = fixed and any(one.start.t + one.left[0] <= t for one in self._waiting)
            if due or t - self._waiting[0].now.t > 0.75 * step:
                self._move(t, step)
            if due:
                self._judge(follower, acting, readings)
        if fixed:
            self._between, self._fix = t - self._fix, t
        if t - self._last >= self.every and self._in_step(t):
            self._last = t
            if self._chunk:
                self._move(t, step)
            self._waiting.append(_Waiting(follower, follower, list(HORIZONS)))

    def _in_step(self, t: float) -> bool:
        """Whether a forecast that begins now has a fix near its first horizon, where fixes are rare."""
        near = _LATE * HORIZONS[0]
        rare = near < self._between < math.inf and t - self._last < 4.0 * self.every
        return not rare or -(t + HORIZONS[0] - self._fix) % self._between < near

    def _move(self, t: float, step: float) -> None:
        times, acting = zip(*self._chunk, strict=True)
        acting = np.average(acting, axis=0, weights=np.diff(times, prepend=self._waiting[0].now.t))
        for one in self._waiting:
            one.now, _ = one.now.ahead(t, acting, step)
        self._chunk.clear()

    def _judge(self, follower: Follower, acting: Array, readings: Array) -> None:
        rows, model = _places(follower), follower.machine.traced.model
        for one in list(self._waiting):
            while one.left and one.start.t + one.left[0] <= follower.t:
                horizon, span = one.left.pop(0), follower.t - one.start.t
                if span > (1.0 + _LATE) * horizon:
                    continue
                c, s = math.cos(one.start.mean[2]), math.sin(one.start.mean[2])
                u, v = one.start.mean[3:5]
                steady = model.read(one.start.mean, acting)[0][rows] + span * np.array([u * c - v * s, u * s + v * c])
                mean, transposed = model.read(one.now.mean, acting)
                slope = transposed.T[rows]
                sd = np.sqrt(np.einsum("ij,jk,ik->i", slope, one.now.cov, slope) + model.noise[rows] ** 2)
                away, score = readings[rows] - mean[rows], self.scores[horizon]
                score.count += 1
                score.square[0] += float(away @ away)
                score.square[1] += float(np.sum((readings[rows] - steady) ** 2))
                score.inside += int((np.abs(away) <= _QUANTILE * sd).sum())
            if not one.left:
                self._waiting.remove(one)


def _places(follower: Follower) -> list[int]:
    """Where x and y are among the channels; nowhere in a log without position."""
    return [k for k, name in enumerate(follower.machine.channels) if name in ("x", "y")]


def _fixed(follower: Follower, readings: Array) -> bool:
    """Whether a row has a fix."""
    rows = _places(follower)
    return bool(rows) and bool(np.isfinite(readings[rows]).all())
