"""Numbers that tell how a trial was made: what positions say against velocities, rudder against yaw.

Comparisons run over windows, displacement against integral, so that noise averages out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from .. import Array, Trial, unwrapped
from ..prepare import integral, segments, to_earth

Motion = Callable[[Array, Array, Array], tuple[Array, Array]]
Rows = NDArray[np.intp]


def _mirrored(u: Array, v_m: Array, psi: Array) -> tuple[Array, Array]:
    return to_earth(u, v_m, -psi)


def _to_port(u: Array, v_m: Array, psi: Array) -> tuple[Array, Array]:
    return to_earth(u, -v_m, psi)


def _swapped(u: Array, v_m: Array, psi: Array) -> tuple[Array, Array]:
    north, east = to_earth(u, v_m, psi)
    return east, north


def _north_east(u: Array, v_m: Array, psi: Array) -> tuple[Array, Array]:
    return u, v_m


def _east_north(u: Array, v_m: Array, psi: Array) -> tuple[Array, Array]:
    return v_m, u


MOTIONS: Mapping[str, Motion] = MappingProxyType({
    "body": to_earth,
    "earth": _north_east,
    "earth, east first": _east_north,
    "sway to port": _to_port,
    "heading counterclockwise": _mirrored,
    "x east, y north": _swapped,
})  # fmt: skip
"""Ways in which u and v_m may have been meant, as velocities along x and y."""


@dataclass(frozen=True)
class Slope:
    """Displacement = value * integral of the rate, with the uncentred correlation of the two."""

    value: float
    correlation: float
    rms: float


def runs(trial: Trial, *names: str) -> tuple[Trial, ...]:
    """Stretches in which the channels are complete, of at least 20 samples."""
    return tuple(run for run in segments(trial, names) if len(run) >= 20)


def windows(run: Trial, length: float) -> tuple[Rows, Rows]:
    """First and last rows of overlapping windows of about `length` [s], at most a third of the run."""
    count = len(run)
    width = min(max(round(length / run.dt), 4), count // 3)
    first: Rows = np.arange(0, count - width, max(width // 4, 1), dtype=np.intp)
    return first, first + width


def rate_slope(trial: Trial, position: str, rate: str, length: float) -> Slope | None:
    """How fast `position` moves for each unit that `rate` says; None without data."""
    moved, said = [], []
    for run in runs(trial, position, rate):
        a, b = windows(run, length)
        place = unwrapped(run[position]) if position == "psi" else run[position]
        total = integral(run.t, run[rate])
        moved.append(place[b] - place[a])
        said.append(total[b] - total[a])
    return _slope(moved, said)


def motion_slopes(trial: Trial, length: float) -> dict[str, Slope]:
    """For each of `MOTIONS`, how well positions follow u and v_m read that way."""
    moved: list[Array] = []
    said: dict[str, list[Array]] = {name: [] for name in MOTIONS}
    for run in runs(trial, "x", "y", "u", "v_m", "psi"):
        a, b = windows(run, length)
        moved.append(np.concatenate([run["x"][b] - run["x"][a], run["y"][b] - run["y"][a]]))
        for name, motion in MOTIONS.items():
            both = [integral(run.t, part) for part in motion(run["u"], run["v_m"], run["psi"])]
            said[name].append(np.concatenate([part[b] - part[a] for part in both]))
    found = {name: _slope(moved, parts) for name, parts in said.items()}
    return {name: slope for name, slope in found.items() if slope is not None}


def _slope(moved: list[Array], said: list[Array]) -> Slope | None:
    if not moved:
        return None
    d, s = np.concatenate(moved), np.concatenate(said)
    dd, ss, ds = float(d @ d), float(s @ s), float(d @ s)
    if d.size < 4 or dd <= 0 or ss <= 0:
        return None
    return Slope(ds / ss, ds / math.sqrt(dd * ss), float(np.sqrt(np.mean((d - s) ** 2))))


def steady_turn(trial: Trial) -> tuple[float, float] | None:
    """Mean rudder [rad] and mean yaw rate [rad/s] of a run ahead with the rudder held over.

    Where the rudder stays put, the yaw acceleration no longer answers to it and only the turn tells.

    Returns:
        None where the rudder moves about, or stays near midships.
    """
    ahead = np.asarray(trial["u"] > 0.3 * float(np.nanmax(np.abs(trial["u"]), initial=0.0)))
    if "n_P" in trial:
        ahead &= ~(trial["n_P"] <= 0)
    rudder, rate = trial["delta"][ahead], trial["r"][ahead]
    known = np.isfinite(rudder) & np.isfinite(rate)
    if known.sum() < 10:
        return None
    mean, spread = float(np.mean(rudder[known])), float(np.std(rudder[known]))
    if abs(mean) < max(2.0 * spread, 0.1):
        return None
    return mean, float(np.mean(rate[known]))


def rudder_effect(trial: Trial, length: float) -> tuple[float, float, float] | None:
    """What the rudder does to the yaw rate going ahead: dr/dt = a r + b delta + c, fitted over windows.

    Returns:
        b [1/s^2], b over its standard error, and the correlation of delta with r; None without data.
    """
    u = trial["u"]
    ahead = u > 0.3 * float(np.nanmax(np.abs(u), initial=0.0))
    if "n_P" in trial:
        ahead &= ~(trial["n_P"] <= 0)
    marked = trial.having(ahead_=np.where(ahead, 1.0, np.nan))
    rows, gains, pairs = [], [], []
    for run in runs(marked, "r", "delta", "ahead_"):
        a, b = windows(run, length)
        parts = [integral(run.t, part) for part in (run["r"], run["delta"], np.ones(len(run)))]
        rows.append(np.column_stack([part[b] - part[a] for part in parts]))
        gains.append(run["r"][b] - run["r"][a])
        pairs.append(run.stack("r", "delta"))
    if not rows or sum(map(len, rows)) < 8:
        return None
    matrix, gain, both = np.concatenate(rows), np.concatenate(gains), np.concatenate(pairs)
    if float(np.std(both[:, 1])) < 1e-3 or float(np.std(both[:, 0])) <= 0:
        return None
    factor, *_ = np.linalg.lstsq(matrix, gain, rcond=None)
    left = gain - matrix @ factor
    covariance = np.linalg.pinv(matrix.T @ matrix) * float(left @ left) / max(len(gain) - 3, 1)
    error = math.sqrt(max(float(covariance[1, 1]), 1e-300))
    return float(factor[1]), float(factor[1]) / error, float(np.corrcoef(both.T)[0, 1])
