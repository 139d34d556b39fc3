"""Measurement noise and single outliers of logs: what weighs the residuals of a fit, and what it leaves out.

Motions are smooth and sensor noise is not: the noise is what high differences of a channel leave, with outliers
clipped.  A difference of order k of white noise has binom(2k, k) times its variance, whatever k; that of a smooth
signal falls with k, so the order with the least result is taken (difference-based variance estimation; Hall, Kay and
Titterington 1990).  The resolution of an instrument is a floor: rounding to steps of q is noise of q / sqrt(12).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..core.once import by_identity
from ..core.ranks import median
from ..core.values import dataclass, replace
from ..data import Array, Trial
from ..data.prepare import measured
from ..environment import CHANNELS
from ..models import STATES, Model
from ..simulate.replay import wind_of

_ORDERS = range(2, 9)
# Fewest differences of an order beyond the first.
_FEWEST = 20
# Differences beyond so many standard deviations are clipped: outliers, and the kinks of a manoeuvre.
_CLIP = 4.0
# Least noise, as a share of the spread of a channel; where no channel has more than `_EXACT`, the log is a simulation
# without noise, and all of them have `_MODELLED`: what the steps of log and integrator leave.
_FLOOR, _EXACT, _MODELLED = 1e-5, 2e-4, 1e-2
# A reading is an outlier if it is so many noises off what its neighbours on both sides say.
_OUTLIER = 8.0
# A change of slope of an input is more than noise from so many noises on.
_BEND = 7.0
# Most successive readings that count as one outlier; more of them are a fault that `check` names.
_LENGTH = 3


@dataclass(frozen=True)
class Screened:
    """Trials without outliers.

    Attributes:
        trials: outliers are gaps.
        rejected: number of readings left out by trial and channel.
    """

    trials: tuple[Trial, ...]
    rejected: Mapping[str, Mapping[str, int]]


@by_identity
def sensor_noise(values: Array) -> float:
    """Standard deviation of the white noise of an evenly sampled channel; NaN gaps are allowed.

    Kept as long as the channel lives: a fit asks before it begins, in its test and in its report.
    `data.prepare.smooth` reads it off third differences, which is enough to smooth by; a weight needs it within a tenth
    at any rate of the log.

    Returns:
        NaN with fewer than three readings in a row.
    """
    found: list[float] = []
    between = np.diff(values)
    for order in _ORDERS:
        between = np.diff(between)
        left = between[np.isfinite(between)]
        # the least of several of few differences is small by chance
        if left.size >= _FEWEST or (left.size and not found):
            found.append(_clipped(left) / math.sqrt(math.comb(2 * order, order)))
    return max(min(found), resolution(values) / math.sqrt(12.0)) if found else math.nan


def _clipped(values: Array) -> float:
    """Root mean square without what lies beyond `_CLIP` times it."""
    squares, far = values**2, np.abs(values)
    size = math.sqrt(float(np.mean(squares)))
    for _ in range(20):
        near = far <= _CLIP * size
        if near.all():
            break
        inside = squares[near]
        then = math.sqrt(float(np.mean(inside))) if inside.size else 0.0
        if then >= (1.0 - 1e-3) * size:
            break
        size = then
    return size


def resolution(values: Array) -> float:
    """Step to which the readings of a channel are rounded; 0 where they take too many values to tell."""
    known = np.unique(values[np.isfinite(values)])
    if known.size < 2 or known.size > 0.5 * values.size:
        return 0.0
    steps = np.diff(known)
    return median(steps[steps <= 1.5 * steps.min()])


def channel(trial: Trial, name: str) -> Array:
    """A state of a trial, the heading unwrapped, shape (samples,)."""
    return trial.heading if name == "psi" else np.asarray(trial[name])


def noise(trials: Sequence[Trial], names: Sequence[str] = STATES) -> dict[str, float]:
    """Noise of each of these states over all trials: as a sidecar declares it (`meta["noise"]`), else `sensor_noise`.

    States that are constant in every trial are left out, as they contain no information, and so are those that are
    made from others.  A simulated log without noise
    gets that of its steps, 1 % of the spread of each state.
    """
    out: dict[str, float] = {}
    spreads: dict[str, float] = {}
    for name in names:
        parts = [(channel(t, name), t.meta.get("noise")) for t in trials if measured(t, name)]
        together = np.concatenate([values[np.isfinite(values)] for values, _ in parts]) if parts else np.zeros(0)
        spread = float(np.std(together)) if together.size else 0.0
        if not spread > 0:
            continue
        levels = [
            float(told[name]) if isinstance(told, Mapping) and name in told else sensor_noise(_at_its_rate(values))
            for values, told in parts
        ]
        sizes = np.array([values.size for values, _ in parts], dtype=np.float64)
        known = np.isfinite(levels)
        pooled = math.sqrt(float(np.average(np.square(levels)[known], weights=sizes[known]))) if known.any() else spread
        out[name], spreads[name] = max(pooled, _FLOOR * spread), spread
    exact = all(level < _EXACT * spreads[name] for name, level in out.items())
    return {name: _MODELLED * spread for name, spread in spreads.items()} if exact else out


def input_noise(trials: Sequence[Trial], model: Model) -> Array:
    """Noise of what acts on a model, row by row: its controls and the components of the wind, shape (controls + 8,)."""
    out = np.zeros(len(model.controls) + len(CHANNELS))
    for trial in trials:
        wind = wind_of(trial)
        columns = [trial[name] if name in trial else np.zeros(0) for name in model.controls]
        columns += [] if wind is None else [*wind]
        for k, values in enumerate(columns):
            level = sensor_noise(_at_its_rate(values)) if np.isfinite(values).any() and np.nanstd(values) else 0.0
            out[k] = max(out[k], np.nan_to_num(level))
    return out


def _at_its_rate(values: Array) -> Array:
    """The readings alone where a channel is read less often than the rows; else with their gaps."""
    good = np.flatnonzero(np.isfinite(values))
    return values[good] if 1 < good.size < values.size and median(np.diff(good)) > 1.0 else values


def between_rows(means: Array, level: Array, read: NDArray[np.bool_] | None = None) -> Array:
    """What two readings leave open of the mean of an input between them: its standard deviation, same shape.

    An actuator that begins or ends to move between two readings has another mean there than the straight line between
    them: by the lines on either side where they cross between the readings; by a uniform time of the move where it
    begins and ends between them.

    Args:
        means: means of two successive rows, shape (lanes, rows, inputs).
        level: noise of the readings, shape (inputs,).
        read: whether a row has a reading, same shape as `means`, or lines join others; None where each has.
    """
    out = np.zeros_like(means)
    if means.shape[1] < 6:
        return out
    # Values follow from their means but for an alternating part, which makes them least smooth.
    odd = np.where(np.arange(means.shape[1]) % 2 == 0, 1.0, -1.0)[:, None]
    value = -odd * np.concatenate([np.zeros_like(means[:, :1]), np.cumsum(-2.0 * odd * means, axis=1)[:, :-1]], axis=1)
    value = value - odd * np.median(np.diff(value, 2, axis=1) / np.diff(odd, 2, axis=0), axis=1, keepdims=True)
    out[:, :-1] = _open(np.diff(value, axis=1), np.ones((means.shape[1] - 1, 1)), level)
    if read is None:
        return out
    for lane, k in np.argwhere(~read.all(axis=1)):
        rows = np.flatnonzero(read[lane, :, k])
        span = np.diff(rows)[:, None]
        out[lane, :, k] = 0.0
        if rows.size > 2:
            found = _open(np.diff(value[lane, rows, k])[None, :, None], span, level[[k]])
            out[lane, rows[0] : rows[-1], k] = np.repeat(found[0, :, 0], span[:, 0])
    return out


def _open(moves: Array, span: Array, level: Array) -> Array:
    """The same from reading to reading, by how far an input moves in so many rows; shape of `moves`.

    Args:
        moves: shape (lanes, intervals, inputs).
        span: rows of each interval, shape (intervals, 1).
        level: shape (inputs,).
    """
    out, slope, own = np.zeros_like(moves), moves / span, span[1:-1]
    a, mid, b = slope[:, :-2], slope[:, 1:-1], slope[:, 2:]
    beyond = own * np.maximum(np.maximum(np.minimum(a, b) - mid, mid - np.maximum(a, b)), 0.0)
    apart = own * np.abs(a - b)
    share = np.clip((mid - b) / np.where(apart > 0, a - b, 1.0), 0.0, 1.0)
    kink = np.where(apart > _BEND * level, 0.5 * share * (1.0 - share) * apart, 0.0)
    out[:, 1:-1] = np.where(beyond > _BEND * level, beyond / math.sqrt(12.0), kink)
    return out


def outliers(values: Array, level: float) -> NDArray[np.bool_]:
    """Readings that jump off and back: off the cubic through their neighbours by more than eight noises.

    Up to three successive readings count as one jump.  Nothing is an outlier where more than 2 % would be: that is a
    fault of the channel, which `check` names, or a channel without noise.

    Args:
        values: one channel, shape (samples,).
        level: its noise.
    """
    out = np.zeros(values.size, dtype=np.bool_)
    if values.size < 6:
        return out
    now = values.copy()
    far = np.stack([_jumps(now, length) for length in range(1, _LENGTH + 1)])
    while out.sum() <= 0.02 * values.size + _LENGTH:
        length, at = (int(k) for k in np.unravel_index(int(np.argmax(far)), far.shape))
        if not far[length, at] > _OUTLIER * level:
            return out
        out[at : at + length + 1] = True
        now[at : at + length + 1] = np.nan
        # A run is judged by its readings and two on either side: only those that touch the new gap are judged again.
        first, last = max(at - _LENGTH - 1, 0), at + length + 3
        begin, end = max(first - 2, 0), last + _LENGTH + 1
        for k in range(_LENGTH):
            far[k, first:last] = _jumps(now[begin:end], k + 1)[first - begin : last - begin]
    return np.zeros(values.size, dtype=np.bool_)


def _jumps(values: Array, length: int) -> Array:
    """How far each run of `length` readings lies off the cubic through two neighbours on either side.

    The least distance of its readings, each divided by its own scatter under unit noise; shape (samples,), by the first
    reading of the run; 0 where a neighbour is missing.
    """
    out = np.zeros(values.size)
    count = values.size - length - 3
    if count <= 0:
        return out
    near = [values[2 + k : 2 + k + count] for k in (-2, -1, length, length + 1)]
    least = np.full(count, np.inf)
    for k, weights in enumerate(_cubic(length)):
        reading = values[2 + k : 2 + k + count]
        cubic = sum(w * part for w, part in zip(weights.tolist(), near, strict=True))
        distance = np.abs(reading - cubic) / math.sqrt(1.0 + float(weights @ weights))
        # It also lies beyond both nearest neighbours, on one side: a lasting step is no outlier.
        before, after = reading - near[1], reading - near[2]
        outside = np.where(before * after > 0, np.minimum(np.abs(before), np.abs(after)), 0.0) / math.sqrt(2.0)
        least = np.minimum(least, np.nan_to_num(np.minimum(distance, outside)))
    out[2 : 2 + count] = least
    return out


@lru_cache(maxsize=_LENGTH)
def _cubic(length: int) -> tuple[Array, ...]:
    """Weights of the two neighbours on either side in the value of their cubic at each reading of a run."""
    at, powers = np.array([-2.0, -1.0, length, length + 1.0]), np.arange(4)
    given = (float(k) ** powers for k in range(length))
    return tuple(np.linalg.solve((at[:, None] ** powers).T, one).astype(np.float64) for one in given)


def screened(trials: Sequence[Trial], level: Mapping[str, float]) -> Screened:
    """Trials with single outliers of the states turned into gaps.

    Args:
        trials: as measured, evenly sampled.
        level: noise of each state (`noise`).
    """
    kept: list[Trial] = []
    rejected: dict[str, dict[str, int]] = {}
    for trial in trials:
        changes: dict[str, Array] = {}
        for name, size in level.items():
            if name in trial:
                bad = outliers(channel(trial, name), size)
                if bad.any():
                    changes[name] = np.where(bad, np.nan, trial[name])
                    rejected.setdefault(trial.name, {})[name] = int(bad.sum())
        kept.append(replace(trial, channels={**trial.channels, **changes}) if changes else trial)
    return Screened(tuple(kept), rejected)
