"""How large what a model lacks is: random accelerations and a current that explain the errors on left-out trials.

A prediction's error has, to first order, the sum of the variances that each source gives it: accelerations of several
correlation times in surge, sway and yaw, alone or growing with the dynamic pressure of water or air, and a current.
Each is sailed once at a small size; the sizes are those of greatest likelihood, of Student's t with four degrees of
freedom, as some trials are much unlike the others.  Sizes of zero are common: the spectrum is a sum of few.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass, replace
from ...data import Array, Trial
from ...identify import Loss
from ...identify.record import Record, even, windows
from ...models import STATES
from ...ships import Ship
from ...study.grounds import kind_of
from ..parts import LeftOut
from .disturbance import ACTS, Disturbance, Process
from .sailing import FreeRuns, Uncertain, sailed

TAUS = (0.3, 2.0, 12.0)
"""Correlation times over L/U."""

_MEDIA = ("", "water", "air")
# Draws that a variance is taken from; sizes at which a source is sailed, over what a ship of this size and speed has.
_DRAWS, _SMALL, _CURRENT = 12, 1e-2, 0.05
_FREEDOM, _ROUNDS, _CLOSE = 4.0, 300, 1e-3
# A source below this share of the variance everywhere is left out.
_LEAST = 1e-3
# Kinds below this share of all are not tried at other times, which have to gain so much log-likelihood.
_SHARE, _TOLD = 0.01, 0.5
# Most windows that are taken of a trial.
_MOST = 9


@dataclass(frozen=True)
class Windows:
    """Predictions of trials that their fit has not seen, at some horizons.

    Attributes:
        trials, kinds: of the windows, shape (windows,).
        lanes: what is sailed.
        horizons: [s], shape (horizons,).
        error: predicted minus measured, shape (windows, horizons, 6); NaN where a window is over or nothing measured.
        measured: shape (windows, horizons, 6), with NaN there.
        begins: row of the trial on even steps at which each begins, shape (windows,).
    """

    trials: tuple[str, ...]
    kinds: tuple[str, ...]
    lanes: FreeRuns
    horizons: Array
    error: Array
    measured: Array
    begins: NDArray[np.intp]

    @property
    def rows(self) -> NDArray[np.intp]:
        """Rows of the horizons in what is sailed."""
        return np.round(self.horizons / (self.lanes.dt * self.lanes.every)).astype(np.intp)

    def reached(self, sailed: Array) -> Array:
        """What is sailed, shape (windows, rows, ...), at the horizons; NaN at those that no window reaches."""
        out = np.full((len(sailed), len(self.horizons), *sailed.shape[2:]), np.nan)
        here = self.rows < sailed.shape[1]
        out[:, here] = sailed[:, self.rows[here]]
        return out

    def some(self, which: NDArray[np.bool_]) -> Windows:
        """Those windows."""
        lanes = replace(self.lanes, state0=self.lanes.state0[which], series=self.lanes.series[which])
        names, kinds = (tuple(one for one, here in zip(each, which, strict=True) if here)
                        for each in (self.trials, self.kinds))  # fmt: skip
        return Windows(names, kinds, lanes, self.horizons, self.error[which], self.measured[which], self.begins[which])


def windows_of(
    ship: Ship, trials: Sequence[Trial], horizons: Array, dt: float, begun: Mapping[str, Array] | None = None
) -> Windows:
    """Each trial in windows as long as the longest horizon, which begin at equal intervals, and their errors.

    Args:
        horizons: multiples of the first [s].
        dt: time step [s].
        begun: states in which the first windows of some trials begin in place of the measured ones, shape (6,).

    Raises:
        DataError: a trial lacks a channel.
    """
    every = max(round(horizons[0] / dt), 1)
    found: list[Windows] = []
    for trial in trials:
        record = even(trial, dt, ship.model)
        span = min(float(horizons[-1]), every * dt * max(int(record.duration / (every * dt) + 1e-6), 1))
        stride = max(record.duration / _MOST, every * dt)
        cut = windows([record], ship.model, Loss(correlation=0.0), dict.fromkeys(STATES, 1.0), window=span, dt=dt,
                      every=every, stride=stride)  # fmt: skip
        state0 = cut.state0.copy()
        if begun is not None and trial.name in begun:
            state0[0, : len(STATES)] = begun[trial.name]
        lanes = FreeRuns(state0, cut.series, cut.dt, cut.every)
        measured = np.where(cut.scale > 0, cut.measured, np.nan)
        error = sailed(ship, lanes, quiet(ship, 1), 0, "rk4")[0] - measured
        known = np.round(horizons / (every * dt)).astype(np.intp)
        own = np.full((len(error), len(horizons), len(STATES)), np.nan)
        read, here = own.copy(), known < error.shape[1]
        own[:, here], read[:, here] = error[:, known[here]], measured[:, known[here]]
        some = np.isfinite(own).any(axis=(1, 2))
        lanes = replace(lanes, state0=lanes.state0[some], series=lanes.series[some])
        count = int(some.sum())
        rows = _begins(Record.of(record, ship.model), max(round(stride / dt), 1), every)
        found.append(Windows((trial.name,) * count, (kind_of(trial),) * count, lanes, horizons, own[some], read[some],
                             rows[some]))  # fmt: skip
    return joined(found)


def _begins(record: Record, onwards: int, every: int) -> NDArray[np.intp]:
    """First rows of the windows that `record.windows` cuts: those with a second compared row."""
    return np.array([row for row in record.begins(onwards) if row + every <= record.last], dtype=np.intp)


def joined(parts: Sequence[Windows]) -> Windows:
    """Windows of several trials as one; shorter ones are sailed on with their last inputs."""
    steps = max(one.lanes.series.shape[1] for one in parts)
    series = [np.concatenate([one.lanes.series, np.repeat(one.lanes.series[:, -1:], steps - one.lanes.series.shape[1],
                                                          axis=1)], axis=1) for one in parts]  # fmt: skip
    lanes = FreeRuns(np.concatenate([one.lanes.state0 for one in parts]), np.concatenate(series),
                  parts[0].lanes.dt, parts[0].lanes.every)  # fmt: skip
    return Windows(tuple(name for one in parts for name in one.trials), tuple(k for one in parts for k in one.kinds),
                   lanes, parts[0].horizons, *(np.concatenate([getattr(one, name) for one in parts])
                                               for name in ("error", "measured", "begins")))  # fmt: skip


@dataclass(frozen=True)
class Variances:
    """Variances of the predictions of some windows by source.

    Attributes:
        known: of start, parameters and readings, shape (windows, horizons, 6).
        unit: of each source at unit size, shape (sources, windows, horizons, 6).
    """

    known: Array
    unit: Array


LAYOUT = tuple((on, by) for by in _MEDIA for on in ACTS)
"""What the accelerations act on and grow with, always in this order: one compiled step serves every size."""


def sources(ship: Ship) -> tuple[Disturbance, ...]:
    """Each source alone, at a size that is small for a ship of this length and speed; the current last."""
    time = ship.L_pp / max(ship.speed, 1e-3)
    size = {"u": ship.speed / time, "v_m": ship.speed / time, "r": 1.0 / time**2}
    grows = {"": 1.0, "water": ship.speed**2, "air": (5.0 * ship.speed) ** 2}
    still = [Process(on, 0.0, time, by) for on, by in LAYOUT]
    found = [Disturbance((*still[:k], Process(on, _SMALL * size[on] / grows[by], share * time, by), *still[k + 1 :]))
             for k, (on, by) in enumerate(LAYOUT) for share in TAUS]  # fmt: skip
    return (*found, Disturbance(tuple(still), _CURRENT * ship.speed))


def quiet(ship: Ship, count: int) -> Uncertain:
    """So many draws in which nothing differs, of the layout that all have."""
    still = Disturbance(tuple(replace(one, sigma=0.0) for one in sources(ship)[-1].processes))
    return Uncertain((), np.zeros((count, 0)), np.zeros(len(STATES)), still)


def variances(out: LeftOut, cut: Windows, noise: Array, seed: int = 1) -> Variances:
    """Sail every source alone.

    Args:
        noise: standard deviation of the readings of each state, at the start and at the end.
    """
    plain = sailed(out.held.ship, cut.lanes, quiet(out.held.ship, 1), 0)

    def variance(uncertain: Uncertain) -> Array:
        with np.errstate(all="ignore"):
            away = np.mean((sailed(out.held.ship, cut.lanes, uncertain, seed) - plain) ** 2, axis=0)
            away = cut.reached(away)
        return np.where(np.isfinite(away), away, np.nanmax(np.where(np.isfinite(away), away, np.nan), initial=0.0))

    none = quiet(out.held.ship, _DRAWS)
    known = variance(replace(none, start=noise)) + noise**2
    known = known + variance(replace(none, names=out.held.names, draws=out.held.draws(_DRAWS, seed)))
    unit = [variance(replace(none, disturbance=one)) / size(one) ** 2 for one in sources(out.held.ship)]
    return Variances(known, np.stack(unit))


def size(one: Disturbance) -> float:
    """Size of a single source."""
    return max((process.sigma for process in one.processes), default=0.0) or one.current


def learned(ship: Ship, error: Array, found: Variances, weights: Array) -> Disturbance:
    """What makes the errors most likely, with one correlation time for each kind of acceleration.

    Args:
        error: shape (windows, horizons, 6), NaN where unknown.
        weights: of each window, shape (windows,).
    """
    first, _ = _likely(error, found, weights, np.ones(len(found.unit), dtype=np.bool_))
    matters = (first * np.nanmean(found.unit / found.known, axis=(1, 2, 3)))[:-1].reshape(len(LAYOUT), len(TAUS))
    best, theta = _times(error, found, weights, matters)
    sizes, time = np.sqrt(theta[:-1]).reshape(len(LAYOUT), len(TAUS)), ship.L_pp / max(ship.speed, 1e-3)
    return Disturbance(tuple(Process(on, float(sizes[k, best[k]]), TAUS[best[k]] * time, by)
                             for k, (on, by) in enumerate(LAYOUT)), float(np.sqrt(theta[-1])))  # fmt: skip


def _times(error: Array, found: Variances, weights: Array, matters: Array) -> tuple[NDArray[np.intp], Array]:
    """Correlation time of each kind of acceleration, shape (kinds,), and squared sizes with those times alone.

    Begun where each kind matters most, one time is changed as long as the errors become more likely: where all times
    are free, a middle one is a sum of a short and a long one, neither of which grows with the horizon as it does.

    Args:
        matters: what each kind and time does where all are free, shape (kinds, times).
    """
    best = np.argmax(matters, axis=1)
    theta, least = _likely(error, found, weights, _alone(best))
    kinds = [k for k in np.argsort(-matters.sum(axis=1)) if matters[k].sum() > _SHARE * matters.sum()]
    moved = True
    while moved:
        moved = False
        for k, onward in product(kinds, range(1, len(TAUS))):
            other = (best + onward * (np.arange(len(best)) == k)) % len(TAUS)
            sizes, unlikely = _likely(error, found, weights, _alone(other))
            if unlikely < least - _TOLD:
                best, theta, least, moved = other, sizes, unlikely, True
    return best, theta


def _alone(best: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Sources of one time a kind, and the current, shape (sources,)."""
    return np.append((np.arange(len(TAUS)) == best[:, None]).ravel(), True)


def _likely(error: Array, found: Variances, weights: Array, allowed: NDArray[np.bool_]) -> tuple[Array, float]:
    """Squared sizes of the sources of greatest likelihood, shape (sources,), and its negative logarithm.

    Sizes are zero of sources that are not allowed, or that are next to nothing.
    """
    known, unit = np.isfinite(error), found.unit[allowed]
    square, weight = np.where(known, error, 0.0) ** 2, weights[:, None, None] * known
    usual = (weight * square).sum(axis=(0, 1)) / np.maximum(weight.sum(axis=(0, 1)), 1e-300)
    usual = np.where(usual > 0, usual, 1.0)
    means = np.array([float((weight * one / usual).sum()) for one in unit])
    theta = (weight * square / usual).sum() / len(found.unit) / np.maximum(means, 1e-300)
    for _ in range(_ROUNDS):  # each step raises the likelihood: a majorisation, as for mixtures of variances
        total = found.known + np.tensordot(theta, unit, 1)
        pull = weight * square * (_FREEDOM + 1.0) / (_FREEDOM + square / total) / total**2
        up, down = np.tensordot(unit, pull, 3), np.tensordot(unit, weight / total, 3)
        before, theta = theta, theta * np.sqrt(up / np.maximum(down, 1e-300))
        if np.abs(theta - before) @ means <= _CLOSE * (theta @ means):
            break
    total = found.known + np.tensordot(theta, unit, 1)
    most = (theta[:, None, None, None] * unit / total).max(axis=(1, 2, 3))
    out = np.zeros(len(found.unit))
    out[allowed] = np.where(most > _LEAST, theta, 0.0)
    tail = (_FREEDOM + 1.0) * np.log1p(square / (_FREEDOM * total))
    return out, 0.5 * float((weight * (np.log(total) + tail)).sum())


def by_trial(trials: Sequence[str]) -> Array:
    """Weights of windows such that each trial counts once, shape (windows,)."""
    return np.array([1.0 / trials.count(name) for name in trials])
