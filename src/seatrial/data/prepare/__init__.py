"""Trials from trials: cut, resample, gaps, segments, split, axes, scale.

Nothing in here fills a gap unless it is asked to by name, and each step is noted in the trial.
"""

from __future__ import annotations

import fnmatch
import math
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import unknown
from .. import Array, DataError, Dataset, Trial, unwrapped
from ..units import standard_unit

ANGLES = ("psi", "gamma_T", "gamma_A", "gamma_C", "gamma_G")
"""Channels that may jump by a whole turn; they are made continuous before they are interpolated."""

# From one row to the next, in median steps, beyond which rows are missing between them.
_LEAP = 1.5
# Rows that a trial may have at most when its steps are chosen.
_ROWS = 10_000_000


def to_body(dx: Array, dy: Array, psi: Array) -> tuple[Array, Array]:
    """Velocities north and east [m/s] as surge and sway [m/s] of a ship heading psi [rad]."""
    c, s = np.cos(psi), np.sin(psi)
    return dx * c + dy * s, dy * c - dx * s


def to_earth(u: Array, v_m: Array, psi: Array) -> tuple[Array, Array]:
    """Surge and sway [m/s] of a ship heading psi [rad] as velocities north and east [m/s]."""
    c, s = np.cos(psi), np.sin(psi)
    return u * c - v_m * s, u * s + v_m * c


def integral(t: Array, rate: Array) -> Array:
    """Running integral of `rate` over t from zero, by trapezia; same shape."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])


def complete(trial: Trial, names: Sequence[str] = ()) -> NDArray[np.bool_]:
    """Rows in which every one of the channels (all, where none is named) has a value; shape (samples,)."""
    wanted = tuple(names) or tuple(trial.channels)
    if not wanted:
        return np.ones(len(trial), dtype=np.bool_)
    return np.asarray(np.isfinite(trial.stack(*wanted)).all(axis=1))


def cut(trial: Trial, start: float = -math.inf, stop: float = math.inf) -> Trial:
    """The rows with start <= t <= stop [s]; time keeps its origin.

    Raises:
        DataError: fewer than two rows lie between.
    """
    inside = (trial.t >= start) & (trial.t <= stop)
    if inside.sum() < 2:
        span = f"{trial.t[0]:g} to {trial.t[-1]:g} s" if len(trial) else "nothing"
        raise DataError(f"{trial.name}: no rows between {start:g} and {stop:g} s; the trial covers {span}")
    return trial.rows(inside).noting(f"cut to {start:g}..{stop:g} s")


def drop_trailing_gaps(trial: Trial) -> Trial:
    """The trial without the rows at its end in which no channel has a value."""
    if not trial.channels:
        return trial
    filled = np.isfinite(trial.stack(*trial.channels)).any(axis=1)
    if not filled.any():
        raise DataError(f"{trial.name}: no row has any value")
    last = int(np.flatnonzero(filled)[-1])
    dropped = len(trial) - 1 - last
    return trial.rows(slice(0, last + 1)).noting(f"dropped {dropped} empty rows") if dropped else trial


def segments(trial: Trial, names: Sequence[str] = (), min_duration: float = 0.0) -> tuple[Trial, ...]:
    """The runs without a gap in the named channels (all, where none is named).

    A run also ends where time leaps by more than one and a half median steps.  Runs shorter than
    `min_duration` [s] or of one row are left out.  A trial that is one run comes back unchanged;
    otherwise the runs are named ``<trial>_1, _2, ...``.
    """
    good = complete(trial, names)
    leaps = np.flatnonzero(np.diff(trial.t) > _LEAP * trial.dt) + 1
    edges = sorted({0, len(trial), *leaps.tolist(), *(np.flatnonzero(np.diff(good)) + 1).tolist()})
    runs = [(a, b) for a, b in pairwise(edges) if good[a] and b - a > 1]
    runs = [(a, b) for a, b in runs if trial.t[b - 1] - trial.t[a] >= min_duration]
    if runs == [(0, len(trial))]:
        return (trial,)
    return tuple(
        replace(trial.rows(slice(a, b)), name=f"{trial.name}_{k}").noting(f"run {k} without gaps")
        for k, (a, b) in enumerate(runs, start=1)
    )


def unbroken(trial: Trial, longest: float) -> tuple[Trial, ...]:
    """The runs between leaps of time longer than `longest` [s], for what was steered meanwhile nobody knows.

    Runs of one row are left out.  A trial without such a leap comes back unchanged; otherwise the runs are
    named ``<trial>_1, _2, ...``.
    """
    edges = [0, *(np.flatnonzero(np.diff(trial.t) > longest) + 1).tolist(), len(trial)]
    runs = [(a, b) for a, b in pairwise(edges) if b - a > 1]
    if len(edges) == 2:
        return (trial,)
    return tuple(
        replace(trial.rows(slice(a, b)), name=f"{trial.name}_{k}").noting(f"run {k} between leaps of time")
        for k, (a, b) in enumerate(runs, start=1)
    )


def interpolate_gaps(trial: Trial, longest: float, names: Sequence[str] = ()) -> Trial:
    """Fill gaps of at most `longest` [s] between good samples by straight lines; longer ones stay.

    Gaps at the ends stay too: there is nothing to lean on.
    """
    filled: dict[str, Array] = {}
    count = 0
    for name in tuple(names) or tuple(trial.channels):
        values = trial[name]
        good = np.flatnonzero(np.isfinite(values))
        if good.size < 2 or good.size == values.size:
            continue
        ends = pairwise(good)
        short = [(a, b) for a, b in ends if b - a > 1 and trial.t[b] - trial.t[a] <= longest]
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
    t = trial.t[0] + dt * np.arange(math.floor(trial.duration / dt + 1e-9) + 1)
    t = np.minimum(t, trial.t[-1])
    wide = dt > 1.5 * trial.dt
    channels = {
        name: _resampled(trial.t, _averaged(trial.t, smooth, dt) if wide else smooth, t)
        for name, smooth in ((name, _continuous(name, values)) for name, values in trial.channels.items())
    }
    return replace(trial, t=t, channels=channels, file=None).noting(f"resampled to {dt:g} s")


def resampling(dt: float, *trials: Trial) -> str:
    """What a user does who needs trials on steps of `dt` [s]: a command to paste, where their files are known."""
    files = [trial.file for trial in trials if trial.file is not None]
    if len(files) < len(trials):
        return f"make it a trial file (seatrial import) and resample that: seatrial resample FILE --dt {dt:g} -o DIR"
    folder = files[0].parent if files[0].parent.name else files[0].parent.resolve()
    beside = folder.with_name(f"{folder.name}_{dt:g}s")
    return f"run: {shlex.join(['seatrial', 'resample', *map(str, files), '--dt', f'{dt:g}', '-o', str(beside)])}"


def split(
    trials: Iterable[Trial], validation: Sequence[str] = (), test: Sequence[str] = ()
) -> Dataset:
    """Whole trials set aside by shell patterns over their names; what is left is for training.

    Raises:
        DataError: a pattern that fits no trial, or a trial that fits both lists.
    """
    every = tuple(trials)
    held = {name: _matching(every, patterns) for name, patterns in
            (("validation", validation), ("test", test))}  # fmt: skip
    both = held["validation"] & held["test"]
    if both:
        raise DataError(f"trial {min(both)} fits a validation pattern and a test pattern; keep it in one")
    aside = held["validation"] | held["test"]
    return Dataset(
        train=tuple(trial for trial in every if trial.name not in aside),
        validation=tuple(trial for trial in every if trial.name in held["validation"]),
        test=tuple(trial for trial in every if trial.name in held["test"]),
    )


def froude_scaled(trial: Trial, ratio: float) -> Trial:
    """The trial of a geometrically similar ship `ratio` times as long, at the same Froude number.

    Lengths grow with the ratio, times and velocities with its root; angles stay.  Channels of other
    units (forces, say) are left out: their scaling needs the water too.
    """
    if not (ratio > 0 and math.isfinite(ratio)):
        raise DataError(f"{trial.name}: a scale ratio of {ratio:g}; it must be above zero")
    root = math.sqrt(ratio)
    factors = {"m": ratio, "s": root, "m/s": root, "rad/s": 1 / root, "1/s": 1 / root, "rad": 1.0, "-": 1.0}
    channels = {
        name: values * factors[unit]
        for name, values in trial.channels.items()
        if (unit := standard_unit(name) or trial.unit(name)) in factors
    }
    units = {name: unit for name, unit in trial.units.items() if name in channels}
    meta = dict(trial.meta)
    if "L_pp" in meta:
        meta["L_pp"] = meta["L_pp"] * ratio
    if "scale" in meta:
        meta["scale"] = meta["scale"] / ratio
    out = replace(trial, t=trial.t * root, channels=channels, units=units, meta=meta, file=None)
    return out.noting(f"scaled to a ship {ratio:g} times as long at equal Froude number")


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
    return unwrapped(values) if name in ANGLES else values


def _resampled(t: Array, values: Array, new: Array) -> Array:
    """Straight lines between neighbouring samples; a gap on either side gives a gap."""
    right = np.clip(np.searchsorted(t, new), 1, t.size - 1)
    left = right - 1
    weight = (new - t[left]) / (t[right] - t[left])
    out = (1 - weight) * values[left] + weight * values[right]
    # between rows with others missing nothing is known
    out[t[right] - t[left] > _LEAP * float(np.median(np.diff(t)))] = np.nan
    # exactly on a good sample, a gap beside it does not matter
    for on, side in ((weight == 0.0, left), (weight == 1.0, right)):
        out[on] = values[side[on]]
    return out


def _averaged(t: Array, values: Array, width: float) -> Array:
    """Mean over [t - width/2, t + width/2] of what is there; a gap stays a gap."""
    good = np.isfinite(values)
    sums = np.concatenate([[0.0], np.cumsum(np.where(good, values, 0.0))])
    counts = np.concatenate([[0], np.cumsum(good)])
    # an even window about each sample, narrower at the ends, keeps straight lines straight
    k = np.arange(t.size)
    half = max(int(0.5 * width / float(np.median(np.diff(t)))), 0)
    # (and beside a leap of time, across which nothing is averaged)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(t) > _LEAP * float(np.median(np.diff(t)))) + 1, [t.size]])
    run = np.searchsorted(edges, k, "right") - 1
    half = np.minimum(np.minimum(k - edges[run], edges[run + 1] - 1 - k), half)
    a, b = k - half, k + half + 1
    count = np.maximum(counts[b] - counts[a], 1)
    return np.where(good, (sums[b] - sums[a]) / count, np.nan)


def _matching(trials: Sequence[Trial], patterns: Sequence[str]) -> set[str]:
    found: set[str] = set()
    names = [trial.name for trial in trials]
    for pattern in patterns:
        fits = [name for name in names if fnmatch.fnmatchcase(name, pattern)]
        if not fits:
            raise DataError(f"pattern '{pattern}': {unknown(pattern, names, 'trial')}")
        found.update(fits)
    return found
