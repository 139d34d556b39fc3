"""States in which predictions start: as read, from the readings of some seconds, and with a compass that is not right.

`smoothed_starts` estimates a state from the readings before it and none after it, as a single reading carries the
sensor's noise into the whole prediction.  Over the last few seconds x, y and psi are parabolas in time; positions and
velocities are fitted together, each weighted by its own scatter, and the fit is evaluated at its end.

A compass that a fit found to err (`of_a_wrong_compass`) errs by more than the fit can say.  A speed over ground is
right where a heading is not, so a heading that is off by an angle shows a sway of the speed ahead times that, and a
prediction that begins with it turns.  What sways beyond the model, which is sailed through the seconds before, is
taken for that angle (`swung`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..data import Array, DataError, Trial
from ..environment import to_body, to_earth
from ..ships import Ship

_WRONG = "wrong_compass"
# Times in which a ship travels its length, after which its sway is that of its controls and not that of its start; and
# the speed at which the sway that a model predicts and a compass are as right as each other, over the approach speed.
_FORGOTTEN, _EVEN = 5.0, 1.0 / 3.0


def of_a_wrong_compass(trial: Trial) -> bool:
    """Whether a fit found that the compass of this trial errs, and corrected what it found (`wrong_compass`)."""
    return bool(trial.meta.get(_WRONG))


def wrong_compass(trial: Trial, wrong: bool = True) -> Trial:
    """The trial, said to be of a compass that errs beyond what its readings were corrected by; or of a right one."""
    meta = {name: value for name, value in trial.meta.items() if name != _WRONG}
    return replace(trial, meta={**meta, _WRONG: True} if wrong else meta)


def before(ship: Ship, trial: Trial, at: float) -> Trial:
    """Rows before a start at `at` [s], and that of it, by which `swung` judges."""
    span = _FORGOTTEN * ship.L_pp / ship.speed
    return trial.rows((trial.t >= at - span) & (trial.t <= at))


def swung(ship: Ship, state: Array, sway: float) -> tuple[Array, float]:
    """The state at a start whose heading is off by what the sway shows, and what it reads too little [rad].

    It is all of what sways beyond the model at speed, none at rest; the track over ground stays as it was read.

    Args:
        state: x, y, psi, u, v_m, r as read, over ground, shape (6,).
        sway: v_m there by the model, sailed through the seconds before [m/s].
    """
    u, beyond = float(state[3]), float(state[4]) - sway
    off = float(np.arctan2(beyond * u, u * u + (_EVEN * ship.speed) ** 2))
    over_ground = complex(state[3], state[4]) * np.exp(-1j * off)
    return np.array([*state[:2], state[2] + off, over_ground.real, over_ground.imag, state[5]]), off


# A parabola: over some seconds a ship has a speed and an acceleration, and noise averages over the three.
_ORDER = 2
# Fewest rows of a fit, a few more than its coefficients.
_FEWEST = 2 * (_ORDER + 1)


def smoothed_starts(t: Array, state: Array, rows: Sequence[int], span: float, order: int = _ORDER) -> Array:
    """States at `rows`, each from the readings of the last `span` seconds, shape (rows, 6).

    Args:
        t: times [s], shape (samples,).
        state: x, y, psi, u, v_m, r, psi unwrapped, shape (samples, 6); NaN is a gap.
        rows: where predictions start.
        span: length of the interval before each start [s].
        order: degree of the polynomials in time.

    Returns:
        The reading itself where fewer than six complete rows lie within the interval, as at the first row.

    Raises:
        DataError: `span` is not above zero.
    """
    if not span > 0:
        raise DataError(f"smooth_start is {span:g} s; it must be above zero")
    good = np.asarray(np.isfinite(state).all(axis=1))
    found = state[list(rows)].copy()
    for k, row in enumerate(rows):
        past = np.flatnonzero(good[: row + 1] & (t[: row + 1] > t[row] - span * (1.0 + 1e-9)))
        if past.size >= _FEWEST and past[-1] == row:
            found[k] = _read_off(t, state, past, order)
    return found


def _read_off(t: Array, state: Array, past: NDArray[np.intp], order: int) -> Array:
    tau, rows = t[past] - t[past[-1]], state[past]
    psi, r = _end(tau, rows[:, 2], rows[:, 5], order)
    north, east = to_earth(rows[:, 3], rows[:, 4], np.cos(rows[:, 2]), np.sin(rows[:, 2]))
    x, dx = _end(tau, rows[:, 0], np.asarray(north), order)
    y, dy = _end(tau, rows[:, 1], np.asarray(east), order)
    u, v_m = to_body(dx, dy, np.cos(psi), np.sin(psi))
    return np.array([x, y, psi, u, v_m, r])


def _end(tau: Array, place: Array, rate: Array, order: int) -> tuple[float, float]:
    """Value and slope at tau = 0 of the polynomial that fits places and rates best.

    Both are weighted by their scatter about a polynomial of their own.
    """
    powers = np.arange(order + 1)
    value = tau[:, None] ** powers
    slope = np.where(powers > 0, powers * tau[:, None] ** np.maximum(powers - 1, 0), 0.0)
    a, b = _scatter(value, place), _scatter(slope[:, 1:], rate)
    both = np.vstack([value / a, slope / b])
    fitted, *_ = np.linalg.lstsq(both, np.concatenate([place / a, rate / b]), rcond=None)
    return float(fitted[0]), float(fitted[1])


def _scatter(columns: Array, readings: Array) -> float:
    """Standard deviation of readings about their own polynomial; above zero, as it is a divisor."""
    fitted, *_ = np.linalg.lstsq(columns, readings, rcond=None)
    left = readings - columns @ fitted
    freedom = max(readings.size - columns.shape[1], 1)
    size = float(np.max(np.abs(readings), initial=0.0))
    return max(float(np.sqrt(left @ left / freedom)), 1e-9 * size, 1e-12)
