"""Kalman filters and smoothers on a ship's own model: motion, current and parameters from raw readings.

`Kalman` holds the settings, `run` gives a `Filtered`, whose `smoothed()` goes back over the same run
(Rauch-Tung-Striebel; for the unscented filter with its own covariances, Sarkka 2008).  A delayed
reading is used when it was true, so a delay costs no accuracy; a gap is a longer prediction.
`begin` gives the initial state and covariance, `timeline` the order of rows and readings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import Free, read, specs, unknown
from ...core.values import dataclass, field
from ...data import Array, DataError, Trial, unwrapped
from ...data.prepare import to_body
from ...environment import CALM
from ...models import Sampled
from ...ships import Ship
from ...simulate.replay import inputs
from .. import FitError, StudyError
from ..nuisance import CURRENT
from ..vector import Vector
from .filtered import Filtered, Pass, innovation_test
from .kalman import Extended, FilterModel, Unscented, over, trace
from .measurement import Antenna, Heading, Rate, Sensor

__all__ = ["Filtered", "Kalman", "Tracker"]

# Default length of a window of the innovation test in L/U.
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
        more = (*(CURRENT if self.current else ()), *Vector(free).paths)
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
        if not np.isfinite(Vector.of((given,)).variance[0]):
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
        vector = Vector(self.free)
        prior = zip(vector.mean.tolist(), np.sqrt(vector.variance).tolist(), strict=True)
        given: Gauss = {**dict(zip(vector.paths, prior, strict=True)), **settings.start}
        along, at = np.eye(len(names)), vector.positions(names)
        along[np.ix_(at, at)] = vector.correlation
        mean, sd = begin(self.ship, trial, tuple(settings.measurement.values()), names, given)
        run, updates = self._forward(trial, events, series, np.clip(mean, *self._bounds()), sd[:, None] * along * sd)
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
        low, high = np.array([limits.get(name, (-np.inf, np.inf)) for name in self.model.names]).T
        return low, high

    def _engine(self, step: float) -> Extended | Unscented:
        s = self.settings
        walk = {**s.process, **dict.fromkeys(CURRENT, s.process.get("current", 0.0)), **s.process}
        density = np.array([walk.get(name, 0.0) ** 2 for name in self.model.names])
        if s.kind == "ekf":
            return Extended(self.model, density, s.step or step, s.iterations)
        return Unscented(self.model, density, s.step or step, *self._bounds(), s.alpha, s.beta, s.kappa)

    def _forward(self, trial: Trial, events: Timeline, series: Array, mean: Array, cov: Array) -> tuple[Pass, _Updates]:
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
    """The mean moved onto the bounds that it exceeds, the other states following by their correlation."""
    for _ in range(3):
        beyond = np.flatnonzero((mean < low) | (mean > high))
        if not beyond.size:
            return mean
        for i in beyond:
            to = float(np.clip(mean[i], low[i], high[i]))
            mean = mean + cov[:, i] * ((to - mean[i]) / cov[i, i]) if cov[i, i] > 0.0 else mean
    return np.clip(mean, low, high)


# The first speed and rate of turn are slopes over this many L/U, and over this many readings at least.
_STRETCH, _FIRST = 0.2, 5
# The first readings set the mean and are used again as readings, so they count little as the former.
_WIDE = 10.0

Gauss = dict[str, tuple[float, float]]


class Timeline(NamedTuple):
    """The instants at which a filter stops: every row of the trial, and when each reading was true.

    Attributes:
        t: times [s], shape (events,).
        row: the row of the trial whose inputs act from there on, shape (events,).
        readings: shape (events, channels); NaN where there is none.
        events: the event of each row of the trial, shape (rows,).
    """

    t: Array
    row: NDArray[np.intp]
    readings: Array
    events: NDArray[np.intp]


def timeline(trial: Trial, model: FilterModel) -> Timeline:
    """Rows and readings in the order in which they were true; readings from before the first row are left out.

    Raises:
        DataError: a channel is missing or holds no reading, or time does not rise.
    """
    if len(trial) < 2 or not (np.diff(trial.t) > 0.0).all():
        raise DataError(f"{trial.name}: a filter needs two rows at least, and a time that rises from row to row")
    near = 1e-6 * trial.dt
    true = [trial.t - delay for delay in model.delay]
    good = [np.isfinite(trial[name]) & (at >= trial.t[0] - near) for name, at in zip(model.channels, true, strict=True)]
    for name, some in zip(model.channels, good, strict=True):
        if not some.any():
            raise DataError(f"{trial.name}: channel {name} holds no reading from t = {trial.t[0]:g} s on")
    found = np.sort(np.concatenate([trial.t, *(at[some] for at, some in zip(true, good, strict=True))]))
    t = found[np.concatenate([[True], np.diff(found) > near])]
    readings = np.full((t.size, len(model.channels)), np.nan)
    for k, (name, at, some) in enumerate(zip(model.channels, true, good, strict=True)):
        readings[np.searchsorted(t, at[some] + near, "right") - 1, k] = trial[name][some]
    row = np.clip(np.searchsorted(trial.t, t + near, "right") - 1, 0, len(trial) - 1)
    return Timeline(t, row, readings, np.searchsorted(t, trial.t + near, "right") - 1)


def begin(
    ship: Ship, trial: Trial, sensors: Sequence[Sensor], names: Sequence[str], given: Gauss
) -> tuple[Array, Array]:
    """Mean and standard deviation of each state at the first row, each shape (names,).

    Args:
        given: what is known beforehand by name; the rest is read off the first readings, widely.

    Raises:
        DataError: the heading is neither given nor read.
    """
    guess: Gauss = {name: (0.0, 0.0) for name in names if name != "psi"}
    guess |= {name: (0.0, 0.2 * ship.speed) for name in CURRENT if name in names}
    guess |= {"x": (0.0, ship.L_pp), "y": (0.0, ship.L_pp), "u": (ship.speed, ship.speed), "v_m": (0.0, ship.speed)}
    guess |= _turning(ship, trial, sensors) | {name: pair for name, pair in given.items() if name in ("psi", "r")}
    if "psi" not in guess:
        raise DataError(f"{trial.name}: no sensor reads the heading; give it in `start` as psi = (value, sd)")
    guess |= _moving(ship, trial, sensors, guess["psi"][0]) | given
    mean, sd = np.array([guess[name] for name in names]).T
    return mean, sd


def _turning(ship: Ship, trial: Trial, sensors: Sequence[Sensor]) -> Gauss:
    """Heading and rate of turn from the first readings."""
    quick = ship.speed / ship.L_pp
    found: Gauss = {"r": (0.0, quick)}
    for sensor in (s for s in sensors if isinstance(s, Heading)):
        t, psi, late = _first(ship, trial, sensor)
        rate, rough = _slope(t, psi[:, 0], sensor.sd)
        found["psi"] = (psi[0, 0] - rate * late, _WIDE * sensor.sd + quick * abs(late))
        found["r"] = (rate, 0.5 * quick + 3.0 * rough)
    for sensor in (s for s in sensors if isinstance(s, Rate)):
        found["r"] = (_first(ship, trial, sensor)[1][0, 0], 0.5 * quick + _WIDE * sensor.sd)
    return found


def _moving(ship: Ship, trial: Trial, sensors: Sequence[Sensor], psi: float) -> Gauss:
    """Position and velocity over ground from the first fixes."""
    for sensor in sensors:
        if isinstance(sensor, Antenna):
            t, fixes, late = _first(ship, trial, sensor)
            (north, rough), (east, _) = (_slope(t, fixes[:, k], sensor.sd) for k in (0, 1))
            arm = sensor.read((0.0, 0.0, psi, 0.0, 0.0, 0.0), CALM)
            u, v_m = to_body(np.array([north]), np.array([east]), np.array([psi]))
            wide, unsure = _WIDE * sensor.sd + ship.speed * abs(late), 0.25 * ship.speed + 3.0 * rough
            return {
                "x": (fixes[0, 0] - arm[0] - north * late, wide), "y": (fixes[0, 1] - arm[1] - east * late, wide),
                "u": (float(u[0]), unsure), "v_m": (float(v_m[0]), unsure),
            }  # fmt: skip
    return {}


def _first(ship: Ship, trial: Trial, sensor: Sensor) -> tuple[Array, Array, float]:
    """Times and values of the first complete readings, and when the first was true [s after the first row]."""
    values = trial.stack(*sensor.channels)
    if sensor.angle:
        values = np.column_stack([unwrapped(column) for column in values.T])
    rows = np.flatnonzero(np.isfinite(values).all(axis=1))
    if rows.size == 0:
        raise DataError(f"{trial.name}: no row holds a reading of {', '.join(sensor.channels)}")
    near = int(np.searchsorted(trial.t[rows], trial.t[rows[0]] + _STRETCH * ship.L_pp / ship.speed))
    rows = rows[: max(near, _FIRST)]
    return trial.t[rows], values[rows], float(trial.t[rows[0]] - sensor.delay - trial.t[0])


def _slope(t: Array, values: Array, sd: float) -> tuple[float, float]:
    """Rate of the first readings by least squares, and its standard deviation."""
    away = t - t.mean()
    weight = float(away @ away)
    return (float(away @ values) / weight, sd / float(np.sqrt(weight))) if weight > 0.0 else (0.0, 0.0)
