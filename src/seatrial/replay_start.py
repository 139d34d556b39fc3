"""The state in which a prediction starts, from the readings up to that moment and none after it.

A single reading carries the sensor's noise into the whole prediction.  Over the last few seconds x, y
and psi are parabolas in time; positions and velocities are fitted together, each as its own noise counts,
and the fit is read off at its end.  Nothing looks ahead: noise, too, is read off the same stretch.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .data import Array, DataError
from .environment import to_body, to_earth

_ORDER = 2
# A fit needs a few more rows than coefficients; a shorter past is no past.
_FEWEST = 2 * (_ORDER + 1)


def smoothed_starts(t: Array, state: Array, rows: Sequence[int], span: float, order: int = _ORDER) -> Array:
    """States at `rows`, each from the readings of the last `span` seconds, shape (rows, 6).

    Args:
        t: times [s], shape (samples,).
        state: x, y, psi, u, v_m, r, psi unwrapped, shape (samples, 6); NaN is no reading.
        rows: where predictions start.
        span: length of the past that counts [s].
        order: degree of the polynomials in time.

    Returns:
        The reading itself where fewer than six complete rows lie within the past, as at the first row.

    Raises:
        DataError: `span` is not above zero.
    """
    if not span > 0:
        raise DataError(f"the past of a start is {span:g} s; it must be above zero")
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

    Both count by the scatter each has about a polynomial of its own.
    """
    powers = np.arange(order + 1)
    value = tau[:, None] ** powers
    slope = np.where(powers > 0, powers * tau[:, None] ** np.maximum(powers - 1, 0), 0.0)
    a, b = _scatter(value, place), _scatter(slope[:, 1:], rate)
    both = np.vstack([value / a, slope / b])
    fitted, *_ = np.linalg.lstsq(both, np.concatenate([place / a, rate / b]), rcond=None)
    return float(fitted[0]), float(fitted[1])


def _scatter(columns: Array, readings: Array) -> float:
    """Standard deviation of readings about their own polynomial; not nil, so that a perfect one may be divided by."""
    fitted, *_ = np.linalg.lstsq(columns, readings, rcond=None)
    left = readings - columns @ fitted
    freedom = max(readings.size - columns.shape[1], 1)
    size = float(np.max(np.abs(readings), initial=0.0))
    return max(float(np.sqrt(left @ left / freedom)), 1e-9 * size, 1e-12)
