"""Forecasts with bands from the present estimate, and how the earlier ones have turned out.

A forecast carries mean and covariance on without readings, to first order; the controls stay as they are now.  It is
held against what was read later with the controls that were logged in between, so that the twin is judged and not the
helm: what the log says of the controls is known, all else is forecast.  Beside it stands the same course and speed.
The first fix at or after its horizon judges a forecast, as fixes may come more seldom than rows.

Parameters that drift, current and slow forces were learnt from what has been sailed.  How long they last no model says,
but forecasts that have turned out do: of what parameters, and current and forces, add to the way of the plain model, a
forecast takes the shares by which the earlier ones over its horizon would have been best.  Its bands widen where
earlier ones held less than they state.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

import numpy as np

from ...core.parameters import values
from ...core.values import dataclass, field
from ...data import Array
from ...identify.filters.augmented import SLOW
from ...identify.filters.kalman import substeps
from ...identify.nuisance import CURRENT
from ...models import STATES
from .follow import Follower, Machine
from .settings import SPEED

HORIZONS = (30.0, 120.0, 600.0)
"""How far ahead forecasts are judged [s]."""

# Steps of a forecast are so many times those of the filter.
_LONGER = 4.0
# A fix that comes later than this share of the horizon judges no forecast.
_LATE = 0.5
# Share that the bands state, and its quantile.
LEVEL, _QUANTILE = 0.9, 1.6449
_POINTS = 40
# Forecasts that turned out one after the other, none begun before the last one had ended, count beside so many that had
# the share that shorter horizons lead to expect; no more than so many are remembered.
_DOUBT = 16.0
# By how much a band that did not hold widens, in its logarithm (Gibbs and Candes 2021, NeurIPS).
_WIDEN = 0.2


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


def forecast(
    follower: Follower, acting: Array, span: float = HORIZONS[-1], scores: Mapping[float, Score] | None = None
) -> Forecast:  # fmt: skip
    """From now on, with these controls and this environment.

    Args:
        scores: how earlier forecasts turned out, by horizon [s]; None carries all on, with the bands of the filter.
    """
    t = follower.t + span * (np.arange(_POINTS + 1) / _POINTS) ** 1.5
    known, machine = scores or {0.0: Score()}, follower.machine
    step, apart, past = _LONGER * machine.settings.step, t - follower.t, list(known)
    *shares, width = (np.interp(apart, past, one) for one in zip(*lasting(known, machine).values(), strict=True))
    mean, cov, simple = np.empty((t.size, len(STATES))), np.empty((t.size, 3, 3)), simpler(follower)
    for k, at in enumerate(t.tolist()):
        if k:
            simple = tuple(onward(machine, one, acting, at - follower.t, step) for one in simple)
            follower, _ = follower.ahead(at, acting, step)
        plain, learnt = simple
        stacked = plain + shares[0][k] * (learnt - plain) + shares[1][k] * (follower.mean - learnt)
        mean[k], cov[k] = stacked[: len(STATES)], follower.cov[:3, :3]
    return Forecast(t, mean, cov * width[:, None, None] ** 2)


def simpler(follower: Follower) -> tuple[Array, Array]:
    """The estimate of the motion with the plain model, and with what it has learnt of parameters; shape (n,) each.

    Neither has current and slow forces.
    """
    machine = follower.machine
    learnt = np.where(np.isin(machine.names, (*CURRENT, *SLOW)), 0.0, follower.mean)
    if not machine.settings.free:
        return learnt, learnt
    known = values(machine.ship.model)
    plain = [float(known[name]) if name in machine.settings.free else one
             for name, one in zip(machine.names, learnt.tolist(), strict=True)]  # fmt: skip
    return np.array(plain), learnt


def onward(machine: Machine, state: Array, acting: Array, span: float, step: float) -> Array:
    """A state so much later [s], by steps of no more than `step`."""
    count = substeps(span, step)
    for _ in range(count):
        (state,) = machine.traced.onward(state, acting, span / count)
    return state


@dataclass
class Score:
    """Forecasts over one horizon.

    Attributes:
        count: how many were judged.
        square: sum of squared distances between forecast and reading [m^2], and the same for constant velocity.
        inside: readings of x and y within their bands.
        ways: sums of products [m^2] of what parameters, and current and slow forces, add: with themselves, with each
            other, and with the error of the plain model: pp, pf, ff, pe, fe.
        wider: logarithm of the width of bands over that of the filter, no less than 0.
        alone: how many of those that `ways` remembers did not overlap.
        span: when the last of these began and ended [s].
    """

    count: int = 0
    square: list[float] = field(default_factory=lambda: [0.0, 0.0])
    inside: int = 0
    ways: list[float] = field(default_factory=lambda: [0.0] * 5)
    wider: float = 0.0
    alone: float = 0.0
    span: tuple[float, float] = (0.0, 0.0)

    def note(self, learnt: Array, carried: Array, missed: Array, held: float, span: tuple[float, float]) -> None:
        """Learn from a forecast that has turned out.

        Args:
            learnt, carried: what parameters add, and current and slow forces, north and east [m], shape (2,).
            missed: reading less the forecast of the plain model [m], same shape.
            held: share of x and y that was in its band.
            span: when it began and ended [s]; the clock may have been set back since the last one.
        """
        self.count += 1
        if not self.span[0] <= span[0] < self.span[1]:
            kept = 1.0 - 1.0 / _DOUBT
            self.ways, self.alone, self.span = [kept * one for one in self.ways], kept * self.alone + 1.0, span
        pairs = ((learnt, learnt), (learnt, carried), (carried, carried), (learnt, missed), (carried, missed))
        self.ways = [one + float(a @ b) for one, (a, b) in zip(self.ways, pairs, strict=True)]
        self.wider = max(self.wider + _WIDEN * (LEVEL - held), 0.0)

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


def lasting(scores: Mapping[float, Score], machine: Machine) -> dict[float, tuple[float, float, float]]:
    """By horizon: the share to take of the way by parameters, that of current and slow forces, and how wide bands are.

    Shares are 0 to 1 and no more than over a shorter horizon; the width of bands, over that of the filter, is no less.
    Least squares over forecasts that turned out, beside `_DOUBT` of them with the share that is expected.  Of learnt
    parameters this is what shorter horizons show to be left after so long, as it fades evenly, and nothing over a
    horizon that nothing has been shown for.  Where no log tells speed through the water, what is called current holds
    forces, too, and is taken to fade as they.
    """
    share, before, wider, found = np.ones(2), 0.0, 0.0, dict[float, tuple[float, float, float]]()
    fades = math.inf if SPEED in machine.settings.sensors else min(machine.settings.memory.get(one, math.inf)
                                                                   for one in SLOW)  # fmt: skip
    for horizon, score in scores.items():
        most, shown = share, min(score.alone / _DOUBT, 1.0)
        if before:
            share = np.array([shown * share[0] ** (horizon / before),
                              share[1] * math.exp(-(horizon - before) / fades)])  # fmt: skip
        pp, pf, ff, pe, fe = score.ways
        if pp + ff > 0.0:
            doubt = np.diag([max(one, 1e-12 * (pp + ff)) for one in (pp, ff)]) * _DOUBT / score.alone
            share = np.linalg.solve(np.array([[pp, pf], [pf, ff]]) + doubt, [pe, fe] + doubt @ share)
            share = np.minimum(share.clip(0.0, 1.0), most)
        before, wider = horizon, max(wider, score.wider)
        found[horizon] = float(share[0]), float(share[1]), math.exp(wider)
    return found


@dataclass
class _Waiting:
    """A forecast on its way: all carried on, and by the simpler models; horizons left with what `lasting` said."""

    start: Follower
    now: Follower
    simple: tuple[Array, ...]
    left: list[tuple[float, tuple[float, float, float]]]


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
            due = fixed and any(one.start.t + one.left[0][0] <= t for one in self._waiting)
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
            left = list(lasting(self.scores, follower.machine).items())
            self._waiting.append(_Waiting(follower, follower, simpler(follower), left))

    def _in_step(self, t: float) -> bool:
        """Whether a forecast that begins now has a fix near its first horizon, where fixes are rare."""
        near = _LATE * HORIZONS[0]
        rare = near < self._between < math.inf and t - self._last < 4.0 * self.every
        return not rare or -(t + HORIZONS[0] - self._fix) % self._between < near

    def _move(self, t: float, step: float) -> None:
        times, acting = zip(*self._chunk, strict=True)
        acting = np.average(acting, axis=0, weights=np.diff(times, prepend=self._waiting[0].now.t))
        for one in self._waiting:
            one.simple = tuple(onward(one.now.machine, each, acting, t - one.now.t, step) for each in one.simple)
            one.now, _ = one.now.ahead(t, acting, step)
        self._chunk.clear()

    def _judge(self, follower: Follower, acting: Array, readings: Array) -> None:
        rows, model = _places(follower), follower.machine.traced.model
        for one in list(self._waiting):
            while one.left and one.start.t + one.left[0][0] <= follower.t:
                (horizon, (first, second, width)), span = one.left.pop(0), follower.t - one.start.t
                if span > (1.0 + _LATE) * horizon:
                    continue
                c, s = math.cos(one.start.mean[2]), math.sin(one.start.mean[2])
                u, v = one.start.mean[3:5]
                steady = model.read(one.start.mean, acting)[0][rows] + span * np.array([u * c - v * s, u * s + v * c])
                mean, transposed = model.read(one.now.mean, acting)
                slope = transposed.T[rows]
                sd = np.sqrt(np.einsum("ij,jk,ik->i", slope, one.now.cov, slope) + model.noise[rows] ** 2)
                plain, learnt = (model.read(each, acting)[0][rows] for each in one.simple)
                ways, missed = (learnt - plain, mean[rows] - learnt), readings[rows] - plain
                away, score = missed - first * ways[0] - second * ways[1], self.scores[horizon]
                held = np.abs(away) <= _QUANTILE * width * sd
                score.square[0] += float(away @ away)
                score.square[1] += float(np.sum((readings[rows] - steady) ** 2))
                score.inside += int(held.sum())
                score.note(*ways, missed, float(held.mean()), (one.start.t, follower.t))
            if not one.left:
                self._waiting.remove(one)


def _places(follower: Follower) -> list[int]:
    """Where x and y are among the channels; nowhere in a log without position."""
    return [k for k, name in enumerate(follower.machine.channels) if name in ("x", "y")]


def _fixed(follower: Follower, readings: Array) -> bool:
    """Whether a row has a fix."""
    rows = _places(follower)
    return bool(rows) and bool(np.isfinite(readings[rows]).all())
