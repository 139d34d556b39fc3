"""Series with times of their own, and their values at the times of common rows."""

from __future__ import annotations

from collections.abc import Mapping as Named

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass, replace
from .. import Array, DataError, unwrapped
from ..prepare import turns
from .schema import Sensor

_REACH = 2.5
"""Longest distance that is joined where a mapping states none, in median steps of the values."""

_HELD = 1.0
"""The same of values that are held: orders come when they change [s]."""


@dataclass(frozen=True)
class Series:
    """What one file holds, in SI.

    Attributes:
        t: times [s], rising, shape (rows,).
        channels: values by channel, each of shape (rows,).
        rows: numbers of the rows in the table, shape (rows,).
    """

    t: Array
    channels: Named[str, Array]
    rows: NDArray[np.intp]


def in_order(series: Series) -> tuple[Series, str]:
    """Rows in the order of their times, of those that are the same one; and that in words."""
    order = np.argsort(series.t, kind="stable")
    t, channels = series.t[order], {name: values[order] for name, values in series.channels.items()}
    same = np.diff(t) == 0.0
    for values in channels.values():
        same &= (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
    kept = np.concatenate([[True], ~same]) if t.size else np.zeros(0, dtype=bool)
    found = Series(t[kept], {name: values[kept] for name, values in channels.items()}, series.rows[order][kept])
    return found, f"sorted by time, {len(t) - int(kept.sum())} rows that repeat others left out"


def single(series: Series, which: str) -> tuple[Series, int]:
    """One row a time, of neighbours with the same: the first, the last, or their mean; and how many are left out.

    Values that are missing do not count in a mean.  Rows that are spread are all kept, see `_spread`.
    """
    first = np.concatenate([[True], np.diff(series.t) != 0.0]) if series.t.size else np.zeros(0, dtype=bool)
    starts = np.flatnonzero(first)
    again = len(series.t) - len(starts)
    if not again:
        return series, 0
    if which == "spread":
        return replace(series, t=_spread(series.t, starts)), again
    ends = np.append(starts[1:], len(series.t)) - 1
    row = starts if which == "first" else ends
    if which == "mean":
        channels = {name: _mean(_continuous(name, values), starts) for name, values in series.channels.items()}
    else:
        channels = {name: values[row] for name, values in series.channels.items()}
    return Series(series.t[row], channels, series.rows[row]), again


def _spread(t: Array, starts: NDArray[np.intp]) -> Array:
    """Times of rows whose clock is coarser than they are, evenly from each of its times to the next.

    The first and the last of these may hold fewer rows, of the end and of the beginning of their step.
    """
    counts = np.diff(np.append(starts, t.size))
    full = float(np.median(counts))
    steps = np.diff(t[starts])
    step = np.append(steps, float(np.median(steps)) if steps.size else 0.0)
    usual = float(np.median(step))
    place = np.arange(t.size) - np.repeat(starts, counts)
    many = counts.astype(np.float64)
    many[[0, -1]] = np.maximum(many[[0, -1]], full)
    place[: counts[0]] += int(many[0] - counts[0])
    # rows before a gap of the clock fill one of its usual steps
    width = np.where(step < 1.5 * usual, step, usual)
    return t + place * np.repeat(width / many, counts)


def _mean(values: Array, starts: NDArray[np.intp]) -> Array:
    good = np.isfinite(values)
    sums, counts = np.add.reduceat(np.where(good, values, 0.0), starts), np.add.reduceat(good, starts)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def reach(series: Series, name: str, sensor: Sensor) -> float:
    """Longest distance [s] that is joined of a channel, by the median step of its own values."""
    if sensor.limit is not None:
        return sensor.limit
    t = series.t[np.isfinite(series.channels[name])]
    usual = _REACH * float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    return max(usual, _HELD) if sensor.interpolate == "hold" else usual


def joined(series: Series, name: str, sensor: Sensor, rows: Array) -> Array:
    """A channel of a series at the times of the rows [s], its lag taken off; NaN where none is near enough.

    Raises:
        DataError: no value is near enough to any row.
    """
    values = _continuous(name, series.channels[name])
    good = np.isfinite(values)
    t, values, far = series.t[good] - sensor.lag, values[good], reach(series, name, sensor)
    if not t.size:
        return np.full(rows.shape, np.nan)
    left = np.clip(np.searchsorted(t, rows, side="right") - 1, 0, t.size - 1)
    right = np.minimum(left + 1, t.size - 1)
    if sensor.interpolate == "hold":
        out = np.where((rows >= t[left]) & (rows - t[left] <= far), values[left], np.nan)
    elif sensor.interpolate == "nearest":
        near = np.where(np.abs(rows - t[left]) <= np.abs(t[right] - rows), left, right)
        out = np.where(np.abs(rows - t[near]) <= far, values[near], np.nan)
    else:
        weight = (rows - t[left]) / np.where(right > left, t[right] - t[left], 1.0)
        out = np.where((t[right] - t[left] <= far) & (right > left) & (weight > 0.0),
                       (1.0 - weight) * values[left] + weight * values[right], np.nan)  # fmt: skip
        out[weight == 0.0] = values[left[weight == 0.0]]
    if not np.isfinite(out).any():
        about = f"{name} is from {t[0]:.6g} to {t[-1]:.6g} s, the rows from {rows[0]:.6g} to {rows[-1]:.6g} s"
        raise DataError(f"no row within {far:.3g} s of a value: {about}; check the clocks and limit")
    return out


def _continuous(name: str, values: Array) -> Array:
    return unwrapped(values) if turns(name) else values
