"""Values at other times: even steps, nearest rows, short gaps."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...core.ranks import median
from .. import Array, DataError, Trial, unwrapped
from .cutting import LEAP

ANGLES = ("psi", "gamma_T", "gamma_A", "gamma_C", "gamma_G")
"""Channels that may jump by a whole turn; they are made continuous before they are interpolated."""

_TURNING = re.compile(r"alpha_\w+")

# A new time this part of a step from a sample is on it, as the digits of a clock have it.
_ON = 1e-6
# A channel is read at nearly every row where its mean step is at most so many rows.
_EACH = 1.2
# Readings that are farther apart than this many mean steps have a gap between them.
_REACH = 1.9
SLOWEST = 5.0
"""Steps of a channel beyond which nothing is judged on them [s]."""
# Rows that a trial may have at most when its steps are chosen.
_ROWS = 10_000_000


def turns(name: str) -> bool:
    """Whether a channel is an angle that goes round, so that it may jump by a whole turn."""
    return name in ANGLES or _TURNING.fullmatch(name) is not None


def between_readings(name: str, t: Array, values: Array, new: Array, *, held: bool) -> Array:
    """A channel at other times, by its readings alone: on the straight line between two of them, or the last one.

    A direction turns the shorter way.  Before the first reading it has that of the first, after the last that of the
    last.

    Args:
        t: times of the rows [s], rising.
        values: shape of `t`; NaN is no reading.  One at least.
        new: times that are wanted [s].
        held: whether a reading counts until the next one, as an order does.
    """
    good = np.flatnonzero(np.isfinite(values))
    if held:
        before = np.searchsorted(t[good], new, "right") - 1
        return np.asarray(values[good[np.clip(before, 0, None)]])
    return np.interp(new, t[good], _continuous(name, values)[good])


def interpolate_gaps(trial: Trial, longest: float, names: Sequence[str] = ()) -> Trial:
    """Fill gaps of at most `longest` [s] between good samples by straight lines; longer ones stay.

    Gaps at the ends stay too: they have a good sample on one side only.
    """
    filled: dict[str, Array] = {}
    count = 0
    for name in tuple(names) or tuple(trial.channels):
        values = trial[name]
        good = np.flatnonzero(np.isfinite(values))
        if good.size < 2 or good.size == values.size:
            continue
        short = [(a, b) for a, b in pairwise(good) if b - a > 1 and trial.t[b] - trial.t[a] <= longest]
        line = np.interp(trial.t, trial.t[good], _continuous(name, values)[good])
        out = values.copy()
        for a, b in short:
            out[a + 1 : b] = line[a + 1 : b]
            count += int(b - a - 1)
        filled[name] = out
    return trial.having(**filled).noting(f"{count} gap samples up to {longest:g} s filled by straight lines")


def resample(trial: Trial, dt: float) -> Trial:
    """The trial on even time steps of `dt` [s] from its first sample, by straight lines.

    A new sample next to a gap is a gap, and so is one where time leaps by more than one and a half median
    steps: rows that were not logged are not made up.  Steps longer than the trial's own average over the
    samples of each step first, so that noise above the new rate does not fold back.
    """
    if not (dt > 0 and math.isfinite(dt)):
        raise DataError(f"{trial.name}: a time step of {dt:g} s; it must be above zero")
    if dt > trial.duration:
        raise DataError(f"{trial.name}: a time step of {dt:g} s, and the trial lasts {trial.duration:g} s")
    if trial.duration / dt > _ROWS:
        about = f"{trial.duration:g} s in steps of {dt:g} s are over {_ROWS:g} rows"
        raise DataError(f"{trial.name}: {about}; cut it, or take longer steps")
    t = np.minimum(trial.t[0] + dt * np.arange(math.floor(trial.duration / dt + 1e-9) + 1), trial.t[-1])
    wide = dt > 1.5 * trial.dt
    channels = {
        name: _resampled(trial.t, _averaged(trial.t, smooth, dt) if wide else smooth, t)
        for name, smooth in ((name, _continuous(name, values)) for name, values in trial.channels.items())
    }
    return replace(trial, t=t, channels=channels, file=None).noting(f"resampled to {dt:g} s")


def shifted(trial: Trial, lag: float, *names: str) -> Trial:
    """The trial with channels that came `lag` [s] late put where they belong, by straight lines.

    Rows for which nothing was logged (at the end; at the beginning, where `lag` is below zero) are left out.

    Raises:
        DataError: a lag that is no number, or leaves fewer than two rows.
    """
    if not (math.isfinite(lag) and abs(lag) < trial.duration - trial.dt):
        raise DataError(f"{trial.name}: a shift of {lag:g} s, and the trial lasts {trial.duration:g} s")
    known = (trial.t + lag >= trial.t[0]) & (trial.t + lag <= trial.t[-1])
    moved: dict[str, Array] = {}
    for name in names:
        moved[name] = np.full(len(trial), np.nan)
        moved[name][known] = _resampled(trial.t, _continuous(name, trial[name]), (trial.t + lag)[known])
    return trial.having(**moved).rows(known).noting(f"{', '.join(names)} shifted by {-lag:g} s")


def at_one_rate(trial: Trial, names: Sequence[str]) -> Trial:
    """The trial on even steps of the channel that is read least often, all on lines between their own readings.

    A log of a compass at 10 Hz and a receiver at 1 Hz has no two rows in succession that hold both, and what compares
    them finds nothing to compare.  Nothing is put into gaps: where a channel's own readings are missing it has none.

    Args:
        trial: of any rates.
        names: channels that the steps are of; one slower than `SLOWEST` is none of them.

    Returns:
        The trial itself where each of its channels is read at nearly every row.
    """
    every = {name: _usual(trial.t[np.isfinite(values)]) for name, values in trial.channels.items()}
    slower = [step for step in every.values() if step > _EACH * trial.dt]
    step = max((every[name] for name in names if every.get(name, math.inf) <= SLOWEST), default=trial.dt)
    if not slower or step > SLOWEST:
        return trial
    t = trial.t[0] + step * np.arange(math.floor(trial.duration / step + 1e-9) + 1)
    channels = {name: _between(trial.t, _continuous(name, values), t, every[name])
                for name, values in trial.channels.items()}  # fmt: skip
    return replace(trial, t=t, channels=channels)


def _usual(at: Array) -> float:
    """Mean step between readings without those over gaps [s]; infinite for fewer than three readings."""
    steps = np.diff(at)
    return float(np.mean(steps[steps <= 2.5 * median(steps)])) if steps.size > 1 else math.inf


def _between(t: Array, values: Array, new: Array, step: float) -> Array:
    """Values on lines between readings that are about `step` apart; none elsewhere."""
    good = np.flatnonzero(np.isfinite(values))
    if good.size < 2:
        return np.full(new.size, math.nan)
    after = np.clip(np.searchsorted(t[good], new), 1, good.size - 1)
    apart = t[good][after] - t[good][after - 1]
    out = np.interp(new, t[good], values[good], left=math.nan, right=math.nan)
    near = np.minimum(np.abs(new - t[good][after - 1]), np.abs(new - t[good][after]))
    return np.where((apart <= _REACH * step) | (near <= _ON * step), out, math.nan)


def resampling(dt: float, *trials: Trial) -> str:
    """How to get trials on steps of `dt` [s]: a command to paste, where their files are known."""
    files = [trial.file for trial in trials if trial.file is not None]
    if len(files) < len(trials):
        return f"make it a trial file (seatrial import) and resample that: seatrial resample FILE --dt {dt:g} -o DIR"
    folder = files[0].parent if files[0].parent.name else files[0].parent.resolve()
    beside = folder.with_name(f"{folder.name}_{dt:g}s")
    return f"run: {shlex.join(['seatrial', 'resample', *map(str, files), '--dt', f'{dt:g}', '-o', str(beside)])}"


def nearest_rows(rows: Array, times: Array, values: Array, reach: float) -> tuple[Array, float]:
    """Values at their nearest rows, and how far the farthest of them was moved.

    Args:
        rows, times: times of the rows and of the values, rising, in one unit.
        values: of the shape of `times`; of several at one row the nearest counts.
        reach: farthest that a value is moved.

    Returns:
        A value per row, NaN where none is within reach; the longest move, in the unit of the times.
    """
    row = np.clip(np.searchsorted(rows, times), 1, len(rows) - 1)
    row = row - (times - rows[row - 1] < rows[row] - times)
    away = np.abs(times - rows[row])
    order = np.argsort(-away, kind="stable")  # the nearest value of a row is written last
    order = order[away[order] <= reach]
    out = np.full(len(rows), math.nan)
    out[row[order]] = values[order]
    return out, float(away[order].max()) if order.size else 0.0


def _continuous(name: str, values: Array) -> Array:
    return unwrapped(values) if turns(name) else values


def _resampled(t: Array, values: Array, new: Array) -> Array:
    """Straight lines between neighbouring samples; a gap on either side gives a gap."""
    right = np.clip(np.searchsorted(t, new), 1, t.size - 1)
    left = right - 1
    weight = (new - t[left]) / (t[right] - t[left])
    out = (1 - weight) * values[left] + weight * values[right]
    # nothing is known between rows with others missing
    out[t[right] - t[left] > LEAP * median(np.diff(t))] = np.nan
    # exactly on a good sample, a gap beside it does not matter
    for on, side in ((weight < _ON, left), (weight > 1.0 - _ON, right)):
        out[on] = values[side[on]]
    return out


def _averaged(t: Array, values: Array, width: float) -> Array:
    """Mean over [t - width/2, t + width/2] of what is there; a gap stays a gap."""
    good = np.isfinite(values)
    sums = np.concatenate([[0.0], np.cumsum(np.where(good, values, 0.0))])
    counts = np.concatenate([[0], np.cumsum(good)])
    # an even window about each sample, narrower at the ends, keeps straight lines straight
    k = np.arange(t.size)
    half = max(int(0.5 * width / median(np.diff(t))), 0)
    # (and beside a leap of time, across which nothing is averaged)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(t) > LEAP * median(np.diff(t))) + 1, [t.size]])
    run = np.searchsorted(edges, k, "right") - 1
    half = np.minimum(np.minimum(k - edges[run], edges[run + 1] - 1 - k), half)
    a, b = k - half, k + half + 1
    count = np.maximum(counts[b] - counts[a], 1)
    return np.where(good, (sums[b] - sums[a]) / count, np.nan)
