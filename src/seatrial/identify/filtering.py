"""Kalman filters and smoothers on a ship's own model: motion, current and parameters from raw readings.

`Kalman` holds the settings, `run` gives a `Filtered`, whose `smoothed()` goes back over the same run
(Rauch-Tung-Striebel; for the unscented filter with its own covariances, Sarkka 2008).  A delayed
reading is used when it was true, so a delay costs no accuracy; a gap is a longer prediction.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..data import Array, DataError, Trial
from ..models import Sampled
from ..parameters import Free, read, specs, unknown
from ..replay import inputs
from ..ships import Ship
from . import FitError, StudyError
from .consistency import innovation_test
from .ekf import Extended, over
from .filter_model import CURRENT, FilterModel, trace
from .filter_start import Timeline, begin, timeline
from .filtered import Filtered, Pass
from .measurement import Sensor
from .ukf import Unscented
from .verdicts import prior_variance

__all__ = ["Filtered", "Kalman", "Tracker"]

# Length of a window of the innovation test in L/U, where nobody says otherwise.
_WINDOW = 2.0


@dataclass(frozen=True)
class Kalman:
    """Settings of a filter.

    Attributes:
        measurement: the sensors by name, see `measurement`.
        process: random walk of each state by its name, as the standard deviation that it gathers in one
            second: u, v_m [m/s/sqrt(s)] and r [rad/s/sqrt(s)] are random accelerations; ``current`` is that
            of each component of the current; a parameter's path lets the parameter walk.  Absent is none.
        parameters: what is estimated besides the motion: a `Free` with prior or interval, or a path alone,
            which starts at the ship's value with a standard deviation of half of it and the bounds of physics.
        current: estimate a current besides what the trial says.
        kind: "ekf" (linearised) or "ukf" (sigma points).
        start: (mean, standard deviation) of states at the first row; others are read off the first readings.
        step: longest Runge-Kutta step [s]; None takes the trial's own.
        iterations: linearisations per update of the extended filter; more than 1 is the iterated filter.
        alpha, beta, kappa: of the sigma points.
        window: of the innovation test [s]; None takes 2 L/U.
        false_alarm: probability that the test finds a right model wrong anywhere in a trial.
    """

    measurement: Mapping[str, Sensor]
    process: Mapping[str, float] = field(default_factory=dict[str, float])
    parameters: tuple[str | Free, ...] = ()
    current: bool = False
    kind: str = "ekf"
    start: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    step: float | None = None
    iterations: int = 1
    alpha: float = 0.5
    beta: float = 2.0
    kappa: float = 0.0
    window: float | None = None
    false_alarm: float = 0.01

    def __post_init__(self) -> None:
        if self.kind not in ("ekf", "ukf"):
            raise StudyError(f"kind = {self.kind!r}: a filter is 'ekf' or 'ukf'")
        if not self.measurement:
            raise StudyError("measurement: no sensor; a filter needs at least one, such as an Antenna")
        used = [name for sensor in self.measurement.values() for name in sensor.channels]
        if len(set(used)) < len(used):
            twice = next(name for name in used if used.count(name) > 1)
            raise StudyError(f"measurement: channel {twice} is read by two sensors; give each its own channel")
        for what, value in (("step", self.step), ("window", self.window), ("alpha", self.alpha)):
            if value is not None and not value > 0.0:
                raise StudyError(f"{what} = {value:g}: it must be above zero")
        if self.iterations < 1 or not 0.0 < self.false_alarm < 1.0:
            raise StudyError("iterations must be 1 or more, and false_alarm between 0 and 1")

    def run(self, ship: Ship, trial: Trial) -> Filtered:
        """Filter one trial; see `Tracker.run`."""
        return self.prepared(ship).run(trial)

    def prepared(self, ship: Ship) -> Tracker:
        """The filter of a ship, traced once for any number of trials.

        Raises:
            StudyError: a model in discrete time, or a name that is none of the filter's states.
            ParameterError: an unknown parameter.
        """
        if isinstance(ship.model, Sampled):
            raise StudyError(f"{ship.name}: a model in discrete time; a Kalman filter here needs rates, not samples")
        free = tuple(_free(ship, given) for given in self.parameters)
        more = (*(CURRENT if self.current else ()), *(f.path for f in free))
        model = trace(ship, more, tuple(self.measurement.values()))
        for name in (*self.start, *(name for name in self.process if not (name == "current" and self.current))):
            if name not in model.names:
                raise StudyError(f"{ship.name}: {unknown(name, (*model.names, 'current'), 'state of the filter')}")
        for name, value in self.process.items():
            if not value >= 0.0:
                raise StudyError(f"process: that of {name} is {value:g}; it must be zero or above")
        return Tracker(self, ship, free, model)


def _free(ship: Ship, given: str | Free) -> Free:
    if isinstance(given, Free):
        read(ship.model, given.path)
        if not np.isfinite(prior_variance((given,))[0]):
            raise StudyError(f"{given.path}: a filter starts from a prior; give a finite sigma or interval")
        return given
    value, meaning = float(read(ship.model, given)), specs(ship.model)[given]
    if value == 0.0:
        raise StudyError(f"{given} is 0, so half of it is no prior; give Free({given!r}, 0.0, prior=0.0, sigma=...)")
    return Free(given, value, meaning.low, meaning.high, value, 0.5 * abs(value))


class _Updates(NamedTuple):
    """Innovations and their normalised squares, NaN where there was none; NIS, shape (events,)."""

    innovations: Array
    squares: Array
    nis: Array


@dataclass(frozen=True)
class Tracker:
    """A filter made ready for a ship; `Kalman.prepared` makes it.  One run at a time."""

    settings: Kalman
    ship: Ship
    free: tuple[Free, ...]
    model: FilterModel

    def run(self, trial: Trial) -> Filtered:
        """Filter a trial.

        Args:
            trial: needs the ship's controls and the channels of the sensors; NaN is no reading.  Rows may
                be uneven.

        Raises:
            DataError: a channel is missing or empty.
            FitError: the filter leaves the finite; names the time.
        """
        settings, names = self.settings, self.model.names
        events, series = timeline(trial, self.model), inputs(trial, self.ship.model)
        if not np.isfinite(series).all():
            raise DataError(f"{trial.name}: a control or the environment holds no value at all")
        given: dict[str, tuple[float, float]] = {}
        for f, variance in zip(self.free, prior_variance(self.free), strict=True):
            known = np.isfinite(f.sigma) and np.isfinite(f.prior)
            given[f.path] = (f.prior if known else f.start, float(np.sqrt(variance)))
        given |= settings.start
        mean, sd = begin(self.ship, trial, tuple(settings.measurement.values()), names, given)
        run, updates = self._forward(trial, events, series, np.clip(mean, *self._bounds()), np.diag(sd**2))
        used = np.isfinite(updates.nis)
        consistency = innovation_test(
            events.t[used], updates.innovations[used], updates.squares[used], updates.nis[used], self.model.channels,
            window=settings.window or _WINDOW * self.ship.L_pp / self.ship.speed, false_alarm=settings.false_alarm,
        )  # fmt: skip
        return Filtered(
            source=trial, ship=self.ship, t=trial.t, names=names, free=self.free,
            states=run.means[events.events], covariances=run.covs[events.events], events=events.events,
            channels=self.model.channels, innovation_t=events.t[used], innovations=updates.innovations[used],
            nis=updates.nis[used], consistency=consistency, passed=run,
        )  # fmt: skip

    def _bounds(self) -> tuple[Array, Array]:
        """Lowest and highest value of each state; only parameters have any."""
        limits = {f.path: (f.low, f.high) for f in self.free}
        pairs = [limits.get(name, (-np.inf, np.inf)) for name in self.model.names]
        return np.array([low for low, _ in pairs]), np.array([high for _, high in pairs])

    def _engine(self, step: float) -> Extended | Unscented:
        s = self.settings
        walk = {**s.process, **dict.fromkeys(CURRENT, s.process.get("current", 0.0)), **s.process}
        density = np.array([walk.get(name, 0.0) ** 2 for name in self.model.names])
        if s.kind == "ekf":
            return Extended(self.model, density, s.step or step, s.iterations)
        return Unscented(self.model, density, s.step or step, *self._bounds(), s.alpha, s.beta, s.kappa)

    def _forward(
        self, trial: Trial, events: Timeline, series: Array, mean: Array, cov: Array
    ) -> tuple[Pass, _Updates]:  # fmt: skip
        engine, bounds = self._engine(trial.dt), self._bounds()
        count, n = events.t.size, mean.size
        run, none = Pass.of(count, n), np.full(events.readings.shape, np.nan)
        out = _Updates(none, none.copy(), np.full(count, np.nan))
        spans, found = np.diff(events.t), np.isfinite(events.readings)
        for k in range(count):
            if k:
                mean, cov, run.crosses[k] = engine.predict(mean, cov, series[events.row[k - 1]], float(spans[k - 1]))
            run.ahead_means[k], run.ahead_covs[k] = mean, cov
            rows = np.flatnonzero(found[k])
            if rows.size and np.isfinite(mean).all():
                mean, cov, miss, spread = engine.update(mean, cov, events.readings[k], rows, series[events.row[k]])
                mean = inside(mean, cov, *bounds)
                out.innovations[k, rows] = miss
                out.squares[k, rows] = miss**2 / np.diagonal(spread)
                out.nis[k] = float(over(miss[None], spread)[0] @ miss)
            if not np.isfinite(mean).all():
                raise FitError(
                    f"{trial.name}: the filter blows up at t = {events.t[k]:g} s; take a shorter step, a closer "
                    "start or tighter bounds"
                )
            run.means[k], run.covs[k] = mean, cov
        return run, out


def inside(mean: Array, cov: Array, low: Array, high: Array) -> Array:
    """The mean moved onto the bounds it is beyond, and the other states with it as they are correlated."""
    for _ in range(3):
        beyond = np.flatnonzero((mean < low) | (mean > high))
        if not beyond.size:
            return mean
        for i in beyond:
            to = float(np.clip(mean[i], low[i], high[i]))
            mean = mean + cov[:, i] * ((to - mean[i]) / cov[i, i]) if cov[i, i] > 0.0 else mean
    return np.clip(mean, low, high)
