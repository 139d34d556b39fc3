"""Checks of positions, velocities, heading and rudder against each other: axes, signs, units, scale, time step.

Comparisons run over windows, displacement against integral, so that noise averages out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import Array, Trial, unwrapped
from ..prepare import integral, segments, to_earth
from .sensors import Fault

_G = 9.81
# Controls of thrusters that can turn a ship at rest.
_ON_THE_SPOT = ("alpha", "n_bow", "n_stern", "f_")
_MEANT = {
    "earth": ("u, v_m are velocities north and east, not surge and sway", "turn them into body axes by psi"),
    "earth, east first": ("u, v_m are velocities east and north", "swap and turn them into body axes by psi"),
    "sway to port": ("v_m counts to port", "change its sign"),
    "heading counterclockwise": ("psi counts counterclockwise", "change its sign"),
    "x east, y north": ("x is east and y is north", "swap them"),
}
_UNITS_APART = 40.0  # a larger ratio of two readings of one motion is one of units, not of a poor instrument

_Motion = Callable[[Array, Array, Array], tuple[Array, Array]]
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


_MOTIONS: Mapping[str, _Motion] = MappingProxyType({
    "body": to_earth,
    "earth": _north_east,
    "earth, east first": _east_north,
    "sway to port": _to_port,
    "heading counterclockwise": _mirrored,
    "x east, y north": _swapped,
})  # fmt: skip
"""Readings of u and v_m as velocities along x and y, by name."""


@dataclass(frozen=True)
class _Slope:
    """Displacement = value * integral of the rate, with the uncentred correlation of the two."""

    value: float
    correlation: float
    rms: float


def _runs(trial: Trial, *names: str) -> tuple[Trial, ...]:
    """Stretches in which the channels are complete, of at least 20 samples."""
    return tuple(run for run in segments(trial, names) if len(run) >= 20)


def _windows(run: Trial, length: float) -> tuple[Rows, Rows]:
    """First and last rows of overlapping windows of about `length` [s], at most a third of the run."""
    count = len(run)
    width = min(max(round(length / run.dt), 4), count // 3)
    first: Rows = np.arange(0, count - width, max(width // 4, 1), dtype=np.intp)
    return first, first + width


def _rate_slope(trial: Trial, position: str, rate: str, length: float) -> _Slope | None:
    """Slope of the displacement of `position` over the integral of `rate`; None without data."""
    moved, said = [], []
    for run in _runs(trial, position, rate):
        a, b = _windows(run, length)
        place = unwrapped(run[position]) if position == "psi" else run[position]
        total = integral(run.t, run[rate])
        moved.append(place[b] - place[a])
        said.append(total[b] - total[a])
    return _slope(moved, said)


def _motion_slopes(trial: Trial, length: float) -> dict[str, _Slope]:
    """For each of `_MOTIONS`, the slope of positions over u and v_m read that way."""
    moved: list[Array] = []
    said: dict[str, list[Array]] = {name: [] for name in _MOTIONS}
    for run in _runs(trial, "x", "y", "u", "v_m", "psi"):
        a, b = _windows(run, length)
        moved.append(np.concatenate([run["x"][b] - run["x"][a], run["y"][b] - run["y"][a]]))
        for name, motion in _MOTIONS.items():
            both = [integral(run.t, part) for part in motion(run["u"], run["v_m"], run["psi"])]
            said[name].append(np.concatenate([part[b] - part[a] for part in both]))
    found = {name: _slope(moved, parts) for name, parts in said.items()}
    return {name: slope for name, slope in found.items() if slope is not None}


def _slope(moved: list[Array], said: list[Array]) -> _Slope | None:
    if not moved:
        return None
    d, s = np.concatenate(moved), np.concatenate(said)
    dd, ss, ds = float(d @ d), float(s @ s), float(d @ s)
    if d.size < 4 or dd <= 0 or ss <= 0:
        return None
    return _Slope(ds / ss, ds / math.sqrt(dd * ss), float(np.sqrt(np.mean((d - s) ** 2))))


def _steady_turn(trial: Trial) -> tuple[float, float] | None:
    """Mean rudder [rad] and mean yaw rate [rad/s] of a run ahead with the rudder held over.

    With a constant rudder the yaw acceleration carries no information on its sign; the rate of turn does.

    Returns:
        None where the rudder varies, or stays near midships.
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


def _rudder_effect(trial: Trial, length: float) -> tuple[float, float, float] | None:
    """Effect of the rudder on the yaw rate going ahead: dr/dt = a r + b delta + c, fitted over windows.

    Returns:
        b [1/s^2], b over its standard error, and the correlation of delta with r; None without data.
    """
    u = trial["u"]
    ahead = u > 0.3 * float(np.nanmax(np.abs(u), initial=0.0))
    if "n_P" in trial:
        ahead &= ~(trial["n_P"] <= 0)
    marked = trial.having(ahead_=np.where(ahead, 1.0, np.nan))
    rows, gains, pairs = [], [], []
    for run in _runs(marked, "r", "delta", "ahead_"):
        a, b = _windows(run, length)
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


def _length(trial: Trial) -> float | None:
    value: Any = trial.meta.get("L_pp")
    return float(value) if isinstance(value, int | float) and value > 0 else None


def _window(trial: Trial) -> float:
    """Length of the comparison windows [s]: ten ship times, or a part of the trial."""
    ship = _length(trial)
    wanted = 10.0 * math.sqrt(ship / _G) if ship else 0.05 * trial.duration
    return float(np.clip(wanted, 10 * trial.dt, max(0.2 * trial.duration, 10 * trial.dt)))


def _has(trial: Trial, *names: str) -> bool:
    return all(name in trial for name in names)


def motion_faults(trial: Trial) -> Iterator[Fault]:
    """Positions against velocities: axes, signs, scale, and the time step."""
    if not _has(trial, "x", "y", "u", "v_m", "psi"):
        return
    slopes = _motion_slopes(trial, _window(trial))
    if "body" not in slopes:
        return
    ours = slopes["body"]
    best = min(slopes, key=lambda name: slopes[name].rms)
    # a fault: another reading fits and that of the conventions does not
    if slopes[best].correlation > 0.97 and slopes[best].rms < 0.4 * ours.rms:
        what, remedy = _MEANT[best]
        yield Fault(
            "error", "u, v_m", what,
            f"displacement misses by {ours.rms:.3g} m rms as body velocities, by {slopes[best].rms:.3g} m so",
            remedy, "axes",
        )  # fmt: skip
    elif ours.correlation < 0.9:
        yield Fault(
            "warning", "x, y, u, v_m", "positions do not follow the velocities",
            f"correlation {ours.correlation:.3f}", "check axes, reference point and time of the sensors",
        )  # fmt: skip
    elif abs(ours.value - 1.0) > 0.04:
        yield _stretched(trial, ours.value)


def _stretched(trial: Trial, value: float) -> Fault:
    """Positions and velocities differ by a factor: the time step where heading and rate differ by the same."""
    yaw = _rate_slope(trial, "psi", "r", _window(trial)) if _has(trial, "psi", "r") else None
    same = yaw is not None and yaw.correlation > 0.9 and abs(yaw.value / value - 1.0) < 0.03
    far = "error" if abs(value - 1.0) > 0.15 or same else "warning"
    if same and yaw is not None:
        return Fault(
            far, "t", "the time step is not the true one",
            f"positions move {value:.3f} and heading turns {yaw.value:.3f} times as much as u, v_m, r give",
            f"true step about {trial.dt * value:.4g} s instead of {trial.dt:.4g} s; use the clock of the log", "step",
        )  # fmt: skip
    return Fault(
        far, "x, y, u, v_m", "positions and velocities have different scales",
        f"positions move {value:.3f} times as far as u, v_m give",
        "check units (kn, km/h), the model scale, and the time step",
    )  # fmt: skip


def _yaw(trial: Trial) -> _Slope | None:
    """Slope of psi over the integral of r; None where they correlate too little."""
    slope = _rate_slope(trial, "psi", "r", _window(trial)) if _has(trial, "psi", "r") else None
    return None if slope is None or abs(slope.correlation) < 0.8 else slope


def yaw_faults(trial: Trial) -> Iterator[Fault]:
    """The heading's rate against r: sign, units, scale; which of the two is wrong remains open."""
    slope = _yaw(trial)
    if slope is None:
        return
    numbers = f"psi turns {slope.value:.3g} times as much as r gives, correlation {slope.correlation:.3f}"
    apart = max(abs(slope.value), 1.0 / abs(slope.value))
    if slope.value < 0:
        yield Fault("error", "psi, r", "psi and r have opposite signs", numbers, "change the sign of one", "sign")
    elif apart > _UNITS_APART:
        yield Fault(
            "error", "psi, r", f"heading and rate of turn disagree by a factor of {apart:.3g}", numbers,
            "one of them is in degrees or per minute: say which in its unit", "unit",
        )  # fmt: skip
    elif apart > 1.1:
        yield Fault("warning", "psi, r", "psi and r have different scales", numbers,
                    "check units and time step")  # fmt: skip


def rudder_faults(trial: Trial) -> Iterator[Fault]:
    """Going ahead, a rudder above zero turns the bow to starboard."""
    if not _has(trial, "u", "r", "delta"):
        return
    yaw = _yaw(trial)
    wrong, remedy = "rudder sign: above zero turns to port", "change the sign of delta"
    if yaw is not None and yaw.value < 0:
        return  # the direction of the turn is uncertain
    if yaw is None:
        wrong, remedy = "rudder sign, or that of r: above zero turns to port", "change the sign of delta, or of r"
    turn = _steady_turn(trial)
    if turn is not None:
        if turn[0] * turn[1] < 0:
            yield Fault(
                "error", "delta", wrong,
                f"going ahead with {turn[0]:+.3g} rad of rudder held, r is {turn[1]:+.3g} rad/s in the mean",
                remedy, "sign",
            )  # fmt: skip
        return
    effect = _rudder_effect(trial, 0.5 * _window(trial))
    if effect is None:
        return
    gain, certainty, _ = effect
    if certainty < -4:
        yield Fault(
            "error", "delta", wrong,
            f"dr/dt changes by {gain:.3g} 1/s^2 per rad of rudder going ahead, "
            f"{-certainty:.0f} standard errors below zero",
            remedy, "sign",
        )  # fmt: skip
    elif abs(certainty) < 2:
        yield Fault(
            "info", "delta", "rudder hardly shows in r",
            f"dr/dt changes by {gain:.3g} 1/s^2 per rad, {abs(certainty):.1f} standard errors",
            "do not expect rudder parameters from this trial",
        )  # fmt: skip


def scale_faults(trial: Trial) -> Iterator[Fault]:
    """Speed and yaw rate against the length: a model's log with a ship's length, or the reverse."""
    length = _length(trial)
    if length is None or not _has(trial, "u"):
        return
    u = np.abs(trial["u"])
    speed = float(np.nanquantile(u, 0.95)) if np.isfinite(u).any() else 0.0
    froude = speed / math.sqrt(_G * length)
    if froude > 0.6:
        yield Fault(
            "error", "u", "wrong scale or unit: too fast for its length",
            f"Froude number {froude:.2f} at {speed:.3g} m/s and L_pp {length:g} m",
            "check L_pp and scale in the sidecar and the unit of the speed", "scale",
        )  # fmt: skip
    if "r" not in trial or speed <= 0:
        return
    fast = u > 0.5 * speed
    turn = np.abs(trial["r"][fast]) * length / u[fast]
    sharp = float(np.nanquantile(turn, 0.95)) if np.isfinite(turn).any() else 0.0
    if sharp > 3.0:
        spot = any(name.startswith(_ON_THE_SPOT) for name in trial.channels)
        yield Fault(
            "warning" if spot else "error", "r", "wrong scale or unit: turns too sharply for its length",
            f"r L/u is {sharp:.2g} in the fastest rows (ships stay below about 1.5), L_pp {length:g} m",
            "check L_pp and scale in the sidecar and the unit of r", "scale",
        )  # fmt: skip
