"""Figures read off any run: execute, track, moments and steady parts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..data import Array, DataError, Trial, unwrapped
from . import Index

# Departure, as a fraction of the set angle, that no noise of a rudder sensor is taken for.
_DEPARTURE = 0.05
# Half the length of the running mean that judges a hold, over the shortest hold.
_BLUR = 0.05
_RUDDERS = ("delta_cmd", "delta", "delta_1_cmd", "delta_1")


def rudder_channel(trial: Trial) -> str:
    """Where the rudder is read: its order where there is one, else its angle; the first of several."""
    return next((name for name in _RUDDERS if name in trial), "delta")


def helm_channel(trial: Trial) -> str:
    """Where the rudder's actual angle is read; of a craft without rudder the order, its helm."""
    return next((name for name in ("delta", "delta_1", "delta_cmd") if name in trial), "delta")


def after(trial: Trial, delta: float) -> Trial:
    """The run from its execute on: where the rudder first leaves its initial angle.

    The execute is the first sample with the new order; where only the rudder's answer was
    recorded, the last sample before it moves.  A run that begins with the order on, or with the
    rudder over, executes at its first sample.

    Args:
        trial: the run, with an order or an angle of a rudder (see `rudder_channel`) [rad].
        delta: set rudder angle, positive to starboard [rad].

    Raises:
        DataError: the rudder never leaves its initial angle.
    """
    name = rudder_channel(trial)
    known = np.isfinite(trial[name]) & np.isfinite(trial["psi"])
    run = trial.rows(known)
    rudder = run[name]
    side = math.copysign(1.0, delta)
    if rudder.size and side * rudder[0] >= 0.5 * abs(delta):
        return run
    departure = np.abs(rudder - rudder[:1])
    moved = np.flatnonzero(departure > _DEPARTURE * abs(delta))
    if not moved.size:
        raise DataError(f"{trial.name}: {name} never leaves its initial angle; no execute to measure from")
    first = int(moved[0])
    return run.rows(slice(first if name.endswith("_cmd") else _foot(departure, first), None))


def _foot(departure: Array, row: int) -> int:
    """Row at the foot of the ramp that climbs to `row`."""
    while row > 0 and departure[row - 1] < departure[row]:
        row -= 1
    return row


def turned(run: Trial) -> Array:
    """Heading relative to that of the first sample, positive to starboard, unwrapped [rad]."""
    psi = unwrapped(run["psi"])
    return psi - psi[0]


def track(run: Trial) -> tuple[Array, Array]:
    """Distance along and to starboard of the heading at the first sample [m]."""
    c, s = math.cos(run["psi"][0]), math.sin(run["psi"][0])
    north, east = run["x"] - run["x"][0], run["y"] - run["y"][0]
    return c * north + s * east, c * east - s * north


def reached(values: Array, level: float) -> float | None:
    """Row, as a fraction, at which `values` first comes up to `level`; None where it never does."""
    beyond = np.flatnonzero(values >= level)
    if not beyond.size:
        return None
    i = int(beyond[0])
    if i == 0:
        return 0.0
    return i - 1 + float((level - values[i - 1]) / (values[i] - values[i - 1]))


def at(values: Array, row: float) -> float:
    """Value at a fractional row, linear between samples."""
    i = min(int(row), values.size - 1)
    j = min(i + 1, values.size - 1)
    return float(values[i] + (row - i) * (values[j] - values[i]))


def rms(values: Array) -> float:
    """Root mean square of what is known."""
    return math.sqrt(float(np.nanmean(values**2)))


def in_lengths(value: float, L_pp: float) -> Index:
    """A length [m], in ship lengths too."""
    return Index(value, "m", value / L_pp)


def yaw_rate(run: Trial) -> Array:
    """Yaw rate [rad/s] as recorded, else the slope of the heading."""
    return run["r"] if "r" in run else np.gradient(unwrapped(run["psi"]), run.t)


def through_water(run: Trial) -> tuple[Array, Array]:
    """Velocities u and v_m through the water [m/s]: over ground less the current that the run has on record."""
    u, v_m = run["u"], run["v_m"]
    if "U_C" not in run or "gamma_C" not in run:
        return u, v_m
    relative = run["gamma_C"] - run["psi"]
    return u - run["U_C"] * np.cos(relative), v_m - run["U_C"] * np.sin(relative)


def path_length(run: Trial) -> Array:
    """Way along the track since the first sample [m]; from the positions, else from the speed.

    Gaps are bridged: straight where positions are missing, at an even rate where speeds are.
    """
    if "x" in run and "y" in run:
        known = np.isfinite(run["x"]) & np.isfinite(run["y"])
        steps = np.hypot(np.diff(run["x"][known]), np.diff(run["y"][known]))
    else:
        U = np.hypot(run["u"], run["v_m"]) if "v_m" in run else np.abs(run["u"])
        known = np.isfinite(U)
        steps = 0.5 * (U[known][1:] + U[known][:-1]) * np.diff(run.t[known])
    way = np.concatenate([[0.0], np.cumsum(steps)])
    return np.interp(run.t, run.t[known], way) if known.any() else np.full(len(run), np.nan)


def complete_rows(trial: Trial, names: Sequence[str]) -> Trial:
    """The samples in which all of these channels are known.

    Raises:
        DataError: a channel is absent, or fewer than two samples are left.
    """
    known = np.all(np.isfinite(trial.stack(*names)), axis=1)
    if known.sum() < 2:
        raise DataError(f"{trial.name}: fewer than two samples know all of {', '.join(names)}")
    return trial.rows(known)


def holds(t: Array, values: Array, width: float, shortest: float) -> list[slice]:
    """Stretches in which `values` stays within `width` of its own mean, for `shortest` seconds or more.

    Judged on a short running mean, so that one noisy sample does not end a stretch; what that mean
    blurs at either end is left out.
    """
    if t.size < 2:
        return []
    half = int(_BLUR * shortest / float(np.median(np.diff(t))))
    listed: list[float] = _running_mean(values, half).tolist()
    edges = [0]
    first, total = 0, 0.0
    for i, value in enumerate(listed):
        if i > first and abs(value - total / (i - first)) > width:
            edges.append(i)
            first, total = i, 0.0
        total += value
    last = len(listed)
    inner = [
        slice(a + half if a else 0, b - half if b < last else last)
        for a, b in zip(edges, [*edges[1:], last], strict=True)
    ]
    return [s for s in inner if s.stop > s.start and t[s.stop - 1] - t[s.start] >= shortest * (1.0 - 2.0 * _BLUR)]


def _running_mean(values: Array, half: int) -> Array:
    """Mean over `half` samples to either side, over fewer at the ends."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    i = np.arange(values.size)
    low, high = np.maximum(i - half, 0), np.minimum(i + half + 1, values.size)
    return (sums[high] - sums[low]) / (high - low)


def last_seconds(t: Array, part: slice, seconds: float, before: float = 0.0) -> slice:
    """The rows of `part` within `seconds` of the moment that lies `before` seconds ahead of its last one."""
    end = float(t[part.stop - 1]) - before
    first, last = np.searchsorted(t, [end - seconds, end])
    return slice(max(part.start, int(first)), max(min(int(last) + 1, part.stop), part.start + 1))
