"""The servo of an azimuth thruster, or of a rudder, from a log of ordered and actual angle.

Least squares on the exact model of `actuators`: a rate that is clipped to what the step needs, a lag and a
dead time, run freely through the whole log from a first angle that is estimated, one for each log: started
from its noisy reading, the whole first ramp would be late or early by that noise, which looks like a lag.
You 2023 Eq. 9, whose epsilon is 0, is the rate alone.  Lag and dead time are kept where the Bayesian
information criterion and an F-test both ask for them; what a log cannot determine is left at zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, cast

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...actuators import Actuator, Azimuth
from ...core.values import dataclass, field
from ...data import Array, DataError, Trial

_EXTRAS = ((), ("lag",), ("dead_time",), ("lag", "dead_time"))
# A lag or a dead time that is none is kept in one log of a thousand.
_DOUBT = 1e-3
# Step of a difference quotient, relative; absolute for a first angle [rad].
_DIFFERENCE = 1e-5
# Ranges of the search: this many times the greatest rate seen; lag and dead time up to this many seconds more.
_FAST = 5.0


@dataclass(frozen=True)
class ServoFit:
    """Servo identified from logs.

    Attributes:
        control: the actual angle, such as ``alpha_1``.
        servo: with rate [rad/s], lag and dead time [s].
        sigma: standard deviation of each that was fitted, and of `offset`; serial correlation is allowed for.
        offset: what the sensor shows beyond the angle that the order means [rad].
        rmse: root mean square misfit of the angle [rad].
        R2: share of the variance of the angle that the servo explains.
        samples: angles compared.
        cautions: what to know before using it, in lines.
    """

    control: str
    servo: Azimuth | Actuator
    sigma: Mapping[str, float]
    offset: float
    rmse: float
    R2: float
    samples: int
    cautions: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Log:
    """One log: angles, and the order that acts after each of the times at which an order comes."""

    t: Array
    actual: Array
    order: Array
    kept: NDArray[np.bool_] = field(repr=False)

    def angles(self, servo: Azimuth | Actuator, offset: float, ahead: float) -> Array:
        """Angle at each row as the servo gives it from `ahead` beyond the first reading, offset included."""
        t, dead = self.t, float(servo.dead_time)
        new = t[1:][np.diff(self.order) != 0.0] + dead
        moments = np.union1d(t, new[new < t[-1]]) if dead > 0 else t
        row = np.clip(np.searchsorted(t + dead, moments + 1e-9, "right") - 1, 0, None)
        # Steps of no time fill it up: the function of so many steps then serves any dead time.
        orders, steps = np.zeros((2, t.size + new.size))
        orders[: row.size], steps[: row.size - 1] = self.order[row], np.diff(moments)
        first = float(self.actual[0]) + ahead - offset
        ends = _chain(type(servo), steps.size)(first, orders[None], steps[None], float(servo.rate), float(servo.lag))
        return np.concatenate(([first], np.asarray(ends)[0]))[np.searchsorted(moments, t)] + offset

    def errors(self, servo: Azimuth | Actuator, offset: float, ahead: float) -> Array:
        """Angle of the model less the one measured, the shorter way round [rad]."""
        return wrapped(self.angles(servo, offset, ahead) - self.actual)[self.kept]


@cache
def _chain(kind: type[Azimuth] | type[Actuator], steps: int) -> ca.Function:
    """Angles at the ends of steps, each from where the last ended: of first angle, orders, steps, rate and lag."""
    y, order, dt, rate, lag = (ca.SX.sym(name) for name in ("y", "order", "dt", "rate", "lag"))
    _, (end,) = kind(rate=rate, lag=lag).advance((y,), order, dt)
    return ca.Function("servo", [y, order, dt, rate, lag], [end]).mapaccum(steps)


def wrapped(angle: Array) -> Array:
    """The same direction between -pi and pi [rad]."""
    return np.arctan2(np.sin(angle), np.cos(angle))


def servos(trials: Sequence[Trial]) -> tuple[str, ...]:
    """Angles of which every trial has the order as well, such as alpha_1 with alpha_1_cmd."""
    return tuple(
        name for name in (trials[0].channels if trials else ())
        if name.split("_")[0] in ("alpha", "delta") and all(name in t and f"{name}_cmd" in t for t in trials)
    )  # fmt: skip


def fit_servo(trials: Sequence[Trial], control: str, *, offset: bool = True) -> ServoFit:
    """The servo of one thruster from one log or several.

    Orders hold from row to row; a gap in them holds the last.  Gaps in the angle are left out.

    Args:
        trials: with the channels `control` and its order, ``control_cmd`` [rad].
        control: such as ``alpha_1``; ``delta`` gives the servo of a rudder.
        offset: whether the sensor may be off the order by a constant.

    Raises:
        DataError: a channel is missing or in degrees, or the order never changes.
    """
    logs = [_log(trial, control) for trial in trials]
    if not logs:
        raise DataError(f"{control}: no trial to fit the servo to")
    steps = np.concatenate([np.abs(wrapped(np.diff(log.order))) for log in logs])
    if not steps.max(initial=0.0) > 1e-6:
        raise DataError(f"{control}: {control}_cmd never changes; a servo needs a step of its order")
    turning = bool(control.split("_")[0] == "alpha")
    fits = [_fit(logs, extras, turning, offset) for extras in _EXTRAS]
    return _told(control, logs, _chosen(fits), steps, turning)


def lateness(trials: Sequence[Trial], control: str, servo: Azimuth | Actuator) -> float:
    """By what time the actual angle is off the one that a servo answers with, root mean square [s].

    An angle that is tau late is off by tau times its own pace: no lag or dead time beyond this one is missing.

    Raises:
        DataError: as `fit_servo`.
    """
    missed, moved = 0.0, 0.0
    for log in (_log(trial, control) for trial in trials):
        angles = log.angles(servo, 0.0, 0.0)
        missed += float(np.sum(wrapped(angles - log.actual)[log.kept] ** 2))
        moved += float(np.sum(np.gradient(angles, log.t)[log.kept] ** 2))
    return math.sqrt(missed / moved) if moved > 0 else math.inf


def answered(found: ServoFit, trial: Trial) -> Array:
    """The angle at each row as the fitted servo answers the orders of a log [rad], without noise and offset.

    As input of a fit it is better than the reading: a displacement of the ship by the noise of one sample lasts for the
    rest of the trial.  Rows before the first reading and after the last are gaps.

    Raises:
        DataError: as `fit_servo`.
    """
    from scipy.optimize import least_squares  # half a second, for a first angle alone

    log = _log(trial, found.control)

    def errors(ahead: Array) -> Array:
        return log.errors(found.servo, found.offset, float(ahead[0]))

    first = least_squares(errors, [0.0], diff_step=1e-5)
    out = np.full(len(trial), np.nan)
    begin = int(np.argmax(np.isfinite(trial[found.control])))
    out[begin : begin + log.t.size] = log.angles(found.servo, found.offset, float(first.x[0])) - found.offset
    return out


@dataclass(frozen=True)
class _Found:
    names: tuple[str, ...]
    values: Array
    errors: Array
    jacobian: Array

    @property
    def cost(self) -> float:
        return float(self.errors @ self.errors)

    @property
    def independent(self) -> float:
        """Equivalent number of readings with white noise."""
        alike = _alike(self.errors)
        return self.errors.size * (1 - alike) / (1 + alike)

    def criterion(self, floor: float) -> float:
        """The Bayesian information criterion."""
        count = self.independent
        return count * math.log(max(self.cost, floor)) + len(self.names) * math.log(max(count, 2.0))


def _alike(errors: Array) -> float:
    """Correlation of neighbouring errors, from 0 to 0.95."""
    deviations = errors - errors.mean()
    power = float(deviations @ deviations)
    return float(np.clip(deviations[1:] @ deviations[:-1] / power, 0.0, 0.95)) if power > 0 else 0.0


def _chosen(fits: Sequence[_Found]) -> _Found:
    """The fit of the least criterion, of those none of whose extras an F-test takes for chance."""
    # Where the model meets the readings to all digits, no misfit is left to divide by.
    floor = 1e-24 * max(fit.errors.size for fit in fits)
    sure = [fit for fit in fits if all(_needed(fit, less, floor) for less in fits if {*less.names} < {*fit.names})]
    return min(sure, key=lambda fit: fit.criterion(floor))


def _needed(fit: _Found, less: _Found, floor: float) -> bool:
    """Whether what `fit` has beyond `less` lowers the misfit by more than chance would."""
    more, spare = len(fit.names) - len(less.names), fit.independent - len(fit.names)
    if spare < 1:
        return False
    from scipy.special import fdtrc  # a quarter of a second, for what only commands ask

    F = (less.cost - fit.cost) / more / (max(fit.cost, floor) / spare)
    return float(fdtrc(more, spare, max(F, 0.0))) < _DOUBT


def _log(trial: Trial, control: str) -> _Log:
    actual, order = trial[control], trial[f"{control}_cmd"]
    for name, values in ((control, actual), (f"{control}_cmd", order)):
        if not np.isfinite(values).any():
            raise DataError(f"{trial.name}: {name} has no values")
        jump = float(np.max(np.abs(np.diff(values[np.isfinite(values)])), initial=0.0))
        if trial.unit(name) == "deg" or jump > 2 * math.pi + 0.1:
            raise DataError(f"{trial.name}: {name} leaps by {jump:.3g}: it is in degrees; convert it to radians")
    good = np.flatnonzero(np.isfinite(actual))
    rows = slice(int(good[0]), int(good[-1]) + 1)
    index = np.where(np.isfinite(order), np.arange(order.size), -1)
    last = np.maximum.accumulate(index)
    held = order[np.where(last < 0, int(np.argmax(index >= 0)), last)][rows]
    if good.size < 10:
        raise DataError(f"{trial.name}: {good.size} samples of {control}; a servo needs at least 10")
    return _Log(trial.t[rows] - trial.t[rows.start], actual[rows], held, np.isfinite(actual[rows]))


def _servo(names: Sequence[str], values: Array, turning: bool) -> tuple[Azimuth | Actuator, float]:
    given = dict(zip(names, (float(v) for v in values), strict=True))
    offset = given.pop("offset", 0.0)
    return (Azimuth(**given) if turning else Actuator(**given)), offset


def _fit(logs: Sequence[_Log], extras: tuple[str, ...], turning: bool, offset: bool) -> _Found:
    """Least squares with some of lag and dead time, from the best of a coarse grid of starts."""
    from scipy.optimize import least_squares  # half a second, which most logs do without

    names = ("rate", *extras, *(("offset",) if offset else ()))
    dt = float(np.median(np.concatenate([np.diff(log.t) for log in logs])))
    rates = np.concatenate([np.abs(wrapped(np.diff(log.actual[log.kept]))) / np.diff(log.t[log.kept]) for log in logs])
    # Quantised sensors leap: over ten rows a rate is one.
    slow = np.concatenate([_slow_rates(log) for log in logs])
    usual, top = max(float(np.quantile(slow, 0.95)), 1e-6), max(float(rates.max()), 1e-6)
    ranges = {"rate": (1e-6, _FAST * top), "lag": (0.0, 50 * dt + _FAST), "dead_time": (0.0, 50 * dt + _FAST),
              "offset": (-0.5, 0.5)}  # fmt: skip
    scale = np.array([{"rate": usual, "offset": 0.05}.get(name, dt) for name in names] + [0.05] * len(logs))
    low, high = (np.array([ranges[name][k] for name in names] + [(-0.5, 0.5)[k]] * len(logs)) for k in (0, 1))
    grids = {"rate": (usual, min(2 * usual, 0.99 * ranges["rate"][1])), "offset": (0.0,),
             "lag": (0.5 * dt, 4 * dt), "dead_time": (0.5 * dt, 2.5 * dt, 6.5 * dt)}  # fmt: skip
    mesh = np.stack(np.meshgrid(*(grids[name] for name in names), indexing="ij"), axis=-1).reshape(-1, len(names))
    misfit = _Misfit(logs, names, turning)
    starts = np.pad(mesh, ((0, 0), (0, len(logs))))
    start = min(starts, key=lambda values: float((misfit.errors(values) ** 2).sum()))
    found = least_squares(misfit.errors, np.clip(start, low + 1e-9, high - 1e-9), bounds=(low, high),
                          jac=cast(Any, misfit.slopes), x_scale=scale,
                          xtol=1e-12, ftol=1e-14, gtol=1e-14, max_nfev=60)  # fmt: skip
    return _Found(names, found.x[: len(names)], found.fun, np.asarray(found.jac))


@dataclass(frozen=True)
class _Misfit:
    """Errors of all logs by the named values, which all logs share, and the first angle of each log."""

    logs: Sequence[_Log]
    names: tuple[str, ...]
    turning: bool

    def errors(self, values: Array) -> Array:
        shared = len(self.names)
        return np.concatenate([self.one(k, values[:shared], values[shared + k]) for k in range(len(self.logs))])

    def one(self, k: int, shared: Array, ahead: float) -> Array:
        servo, offset = _servo(self.names, shared, self.turning)
        return self.logs[k].errors(servo, offset, float(ahead))

    def slopes(self, values: Array) -> Array:
        """Forward differences; the first angle of a log moves that log only."""
        base, shared = self.errors(values), len(self.names)
        out = np.zeros((base.size, values.size))
        for j in range(shared):
            step = _DIFFERENCE * max(abs(values[j]), 1e-3)
            moved = values.copy()
            moved[j] += step
            out[:, j] = (self.errors(moved) - base) / step
        edges = np.cumsum([int(log.kept.sum()) for log in self.logs])[:-1]
        for k, rows in enumerate(np.split(np.arange(base.size), edges)):
            moved_one = self.one(k, values[:shared], values[shared + k] + _DIFFERENCE)
            out[rows, shared + k] = (moved_one - base[rows]) / _DIFFERENCE
        return out


def _slow_rates(log: _Log) -> Array:
    t, y = log.t[log.kept], np.unwrap(log.actual[log.kept])
    k = min(10, t.size - 1)
    return np.abs(y[k:] - y[:-k]) / (t[k:] - t[:-k])


def _told(control: str, logs: Sequence[_Log], found: _Found, steps: Array, turning: bool) -> ServoFit:
    """The fit with its uncertainties and what to beware of."""
    servo, offset = _servo(found.names, found.values, turning)
    e, count = found.errors, found.errors.size
    alike = _alike(e)
    noise = found.cost / max(count - found.jacobian.shape[1], 1) * (1 + alike) / (1 - alike)
    spread = np.sqrt(np.maximum(noise * np.diag(np.linalg.pinv(found.jacobian.T @ found.jacobian)), 0.0))
    felt = np.abs(found.jacobian).max(axis=0) > 1e-9
    # Those of the first angles come last and are left out.
    sigma = {name: float(s) if f else math.inf for name, s, f in zip(found.names, spread, felt, strict=False)}
    actual = np.concatenate([np.unwrap(log.actual[log.kept]) - log.actual[log.kept][0] for log in logs])
    total = float(((actual - actual.mean()) ** 2).sum())
    cautions: list[str] = []
    if sigma["rate"] > 0.2 * float(servo.rate):
        seen = max(float(_slow_rates(log).max()) for log in logs)
        cautions.append(
            f"{control}: no order of this log keeps the servo at its rate, known to be above {seen:.3g} rad/s only; "
            "order larger steps"
        )
    if turning and (steps > math.pi - 0.1).any():
        cautions.append(f"{control}: an order half a turn away may be answered either way round; leave it out")
    return ServoFit(control, servo, sigma, offset, float(np.sqrt(np.mean(e**2))),
                    1.0 - found.cost / total if total > 0 else math.nan, count, tuple(cautions))  # fmt: skip
