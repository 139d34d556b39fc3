"""The servo of an azimuth thruster, or of a rudder, from a log of ordered and actual angle.

Least squares on the exact model of `actuators`: a rate that is clipped to what the step needs, a lag and a
dead time, run freely through the whole log from its first angle.  You 2023 Eq. 9, whose epsilon is 0,
is the rate alone.  Which of lag and dead time a log can tell is decided by the Bayesian information
criterion; what it cannot tell is left at zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..actuators import Actuator, Azimuth
from ..data import Array, DataError, Trial

_EXTRAS = ((), ("lag",), ("dead_time",), ("lag", "dead_time"))
_FAST = 5.0
"""Ranges of the search: this many times the greatest rate seen; lag and dead time up to this many seconds more."""


@dataclass(frozen=True)
class ServoFit:
    """What a log says about one servo.

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

    def angles(self, servo: Azimuth | Actuator, offset: float) -> Array:
        """Angle at each row as the servo gives it, offset included."""
        t, dead = self.t, float(servo.dead_time)
        moments = np.union1d(t, (t + dead)[t + dead < t[-1]]) if dead > 0 else t
        row = np.clip(np.searchsorted(t + dead, moments + 1e-9, "right") - 1, 0, None)
        orders, steps = self.order[row].tolist(), np.diff(moments).tolist()
        y = float(self.actual[0]) - offset
        out = [y]
        for k, step in enumerate(steps):
            if step > 0:
                _, (y,) = servo.advance((y,), orders[k], step)
            out.append(y)
        return np.array(out)[np.searchsorted(moments, t)] + offset

    def errors(self, servo: Azimuth | Actuator, offset: float) -> Array:
        """Angle of the model less the one measured, the shorter way round [rad]."""
        return wrapped(self.angles(servo, offset) - self.actual)[self.kept]


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
    count = sum(int(log.kept.sum()) for log in logs)
    best = min(fits, key=lambda f: count * math.log(max(f.cost / count, 1e-24)) + len(f.names) * math.log(count))
    return _told(control, logs, best, steps, turning)


@dataclass(frozen=True)
class _Found:
    names: tuple[str, ...]
    values: Array
    errors: Array
    jacobian: Array

    @property
    def cost(self) -> float:
        return float(self.errors @ self.errors)


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
    names = ("rate", *extras, *(("offset",) if offset else ()))
    dt = float(np.median(np.concatenate([np.diff(log.t) for log in logs])))
    rates = np.concatenate([np.abs(wrapped(np.diff(log.actual[log.kept]))) / np.diff(log.t[log.kept]) for log in logs])
    # Quantised sensors leap: over ten rows a rate is one.
    slow = np.concatenate([_slow_rates(log) for log in logs])
    usual, top = max(float(np.quantile(slow, 0.95)), 1e-6), max(float(rates.max()), 1e-6)
    ranges = {"rate": (1e-6, _FAST * top), "lag": (0.0, 50 * dt + _FAST), "dead_time": (0.0, 50 * dt + _FAST),
              "offset": (-0.5, 0.5)}  # fmt: skip
    scale = np.array([{"rate": usual, "offset": 0.05}.get(name, dt) for name in names])
    low, high = (np.array([ranges[name][k] for name in names]) for k in (0, 1))

    def errors(values: Array) -> Array:
        servo, shift = _servo(names, values, turning)
        return np.concatenate([log.errors(servo, shift) for log in logs])

    grids = {"rate": (usual, min(2 * usual, 0.99 * ranges["rate"][1])), "offset": (0.0,),
             "lag": (0.5 * dt, 4 * dt), "dead_time": (0.5 * dt, 2.5 * dt, 6.5 * dt)}  # fmt: skip
    mesh = np.stack(np.meshgrid(*(grids[name] for name in names), indexing="ij"), axis=-1).reshape(-1, len(names))
    start = min(mesh, key=lambda values: float((errors(values) ** 2).sum()))
    found = least_squares(errors, np.clip(start, low + 1e-9, high - 1e-9), bounds=(low, high), x_scale=scale,
                          diff_step=1e-5, xtol=1e-12, ftol=1e-14, gtol=1e-14, max_nfev=60)  # fmt: skip
    return _Found(names, found.x, found.fun, np.asarray(found.jac))


def _slow_rates(log: _Log) -> Array:
    t, y = log.t[log.kept], np.unwrap(log.actual[log.kept])
    k = min(10, t.size - 1)
    return np.abs(y[k:] - y[:-k]) / (t[k:] - t[:-k])


def _told(
    control: str, logs: Sequence[_Log], found: _Found, steps: Array, turning: bool
) -> ServoFit:
    """The fit with its uncertainties and what to beware of."""
    servo, offset = _servo(found.names, found.values, turning)
    e, count = found.errors, found.errors.size
    deviations = e - e.mean()
    power = float(deviations @ deviations)
    alike = float(np.clip(deviations[1:] @ deviations[:-1] / power, 0.0, 0.95)) if power > 0 else 0.0
    noise = found.cost / max(count - len(found.names), 1) * (1 + alike) / (1 - alike)
    spread = np.sqrt(np.maximum(noise * np.diag(np.linalg.pinv(found.jacobian.T @ found.jacobian)), 0.0))
    felt = np.abs(found.jacobian).max(axis=0) > 1e-9
    sigma = {name: float(s) if f else math.inf for name, s, f in zip(found.names, spread, felt, strict=True)}
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
