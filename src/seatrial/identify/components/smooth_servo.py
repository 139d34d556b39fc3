"""The law of an azimuth servo that slows down smoothly (You 2023 Eq. 9), from logs of ordered and actual angle.

d alpha/dt = K e / sqrt(e^2 + epsilon^2), e the order less the angle.  With epsilon = 0 it is the servo of `servo`, that
turns at its rate until it is there; with e << epsilon it is a lag of epsilon/K.  Between two rows the order holds, and
the step has a closed form, so that no fixed step makes it chatter:
s - epsilon ln((s + epsilon)/|e|) falls by K dt, where s = sqrt(e^2 + epsilon^2).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.values import dataclass
from ...data import Array, DataError, Trial
from .servo import wrapped

# Below this epsilon [rad] the law is that of epsilon = 0 to all digits that a log can show.
_NONE = 1e-6
# Newton's steps at most, and the error of ln e at which they end; ln e of an error that no log shows.
_NEWTON, _CLOSE, _GONE = 30, 1e-7, -18.0
# Where the search for epsilon may begin [rad].
_STARTS = (0.002, 0.01, 0.05, 0.2)


@dataclass(frozen=True)
class SmoothServo:
    """K [rad/s] and epsilon [rad] of one azimuth.

    Attributes:
        sigma: standard deviations of both for white noise; that of epsilon tells what the logs can see of it.
        rmse: root mean square misfit of the angle [rad].
        R2: share of the variance of the angle that the law explains.
        samples: angles compared.
    """

    rate: float
    epsilon: float
    sigma: tuple[float, float]
    rmse: float
    R2: float
    samples: int


def advanced(error: Array, rate: float, epsilon: float, dt: float) -> Array:
    """What is left of each error [rad] after `dt` seconds under a constant order; shape as given."""
    size = np.abs(error)
    if epsilon < _NONE:
        return np.sign(error) * np.maximum(size - rate * dt, 0.0)
    begun = np.maximum(size, 1e-12)

    def fallen(e: Array) -> Array:
        s = np.hypot(e, epsilon)
        return s - epsilon * np.log((s + epsilon) / e)

    goal, q = fallen(begun) - rate * dt, np.log(begun)
    for _ in range(_NEWTON):  # rising and convex in ln e: from the right, Newton's steps fall towards the root
        e = np.exp(q)
        step = (fallen(e) - goal) / np.hypot(e, epsilon)
        moved, q = q, np.maximum(q - step, _GONE)
        if float(np.abs(moved - q).max()) < _CLOSE:
            break
    return np.where(size > 1e-12, np.sign(error) * np.exp(q), error)


def fit_smooth_servo(trials: Sequence[Trial], control: str) -> SmoothServo:
    """K and epsilon from logs with `control` and its order ``control_cmd`` [rad], complete and of the same even step.

    Least squares on the whole logs; the first angle of each is free within the search.

    Raises:
        DataError: no log, or a log has gaps.
    """
    if not trials:
        raise DataError(f"{control}: no trial to fit the servo to")
    dt, rows = trials[0].dt, max(len(trial) for trial in trials)
    actual, order = (_padded(trials, name, rows) for name in (control, f"{control}_cmd"))
    known = np.arange(rows) < np.array([len(trial) for trial in trials])[:, None]
    count = int(known.sum())

    def angles(values: Array) -> Array:
        out = np.empty_like(actual)
        at = actual[:, 0] + values[2:]
        for k in range(rows):
            out[:, k] = at
            at = order[:, k] - advanced(wrapped(order[:, k] - at), float(values[0]), float(values[1]), dt)
        return out

    def errors(values: Array) -> Array:
        return wrapped(angles(values) - actual)[known]

    fast = float(np.quantile(np.abs(np.diff(actual, axis=1)[known[:, 1:]]) / dt, 0.95))
    free = np.zeros(len(trials))
    starts = [np.array([fast, epsilon, *free]) for epsilon in _STARTS]
    from scipy.optimize import least_squares  # half a second

    found = least_squares(
        errors, min(starts, key=lambda one: float((errors(one) ** 2).sum())), diff_step=1e-4, max_nfev=20, xtol=1e-6,
        bounds=([1e-6, 0.0, *(free - 0.5)], [10.0 * fast + 1e-3, 1.0, *(free + 0.5)]),
        x_scale=[fast, 0.01, *(free + 0.01)],
    )  # fmt: skip
    J, e = np.asarray(found.jac), found.fun
    spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(J.T @ J)), 0.0) * float(e @ e) / max(count - found.x.size, 1))
    turned = actual[known]
    return SmoothServo(
        float(found.x[0]), float(found.x[1]), (float(spread[0]), float(spread[1])), float(np.sqrt(np.mean(e**2))),
        1.0 - float(e @ e) / float(((turned - turned.mean()) ** 2).sum()), count,
    )  # fmt: skip


def _padded(trials: Sequence[Trial], name: str, rows: int) -> Array:
    """One channel of all logs, shape (logs, rows), the last value held."""
    if any(not np.isfinite(trial[name]).all() for trial in trials):
        raise DataError(f"{name}: the smooth law needs logs without gaps")
    return np.array([np.pad(trial[name], (0, rows - len(trial)), mode="edge") for trial in trials])
