"""Checks of motions by themselves: the sense of the rudder, and speed and rate of turn against the ship's length."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ... import Trial
from ...prepare import integral, segments
from ..relations import G as _G
from ..relations import length_of as _length
from ..relations import window_of as _window
from ..repairs import times
from ..sensors import Fault

# Controls of thrusters that can turn a ship at rest, and the fastest such turn, r sqrt(L/g).
_ON_THE_SPOT, _SPINS = ("alpha", "n_bow", "n_stern", "f_"), 0.8

Rows = NDArray[np.intp]


def _runs(trial: Trial, *names: str) -> tuple[Trial, ...]:
    """Stretches in which the channels are complete, of at least 20 samples."""
    return tuple(run for run in segments(trial, names) if len(run) >= 20)


def _windows(run: Trial, length: float) -> tuple[Rows, Rows]:
    """First and last rows of overlapping windows of about `length` [s], at most a third of the run."""
    count = len(run)
    width = min(max(round(length / run.dt), 4), count // 3)
    first: Rows = np.arange(0, count - width, max(width // 4, 1), dtype=np.intp)
    return first, first + width


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


def rudder_faults(trial: Trial) -> Iterator[Fault]:
    """Going ahead, a rudder above zero turns the bow to starboard."""
    if not all(name in trial for name in ("u", "r", "delta")):
        return
    witnessed = "psi" in trial
    wrong, remedy = "rudder sign: above zero turns to port", times(-1.0, "delta")
    if not witnessed:
        wrong = "rudder sign, or that of r: above zero turns to port"
        remedy = times(-1.0, "delta", text="change that of r")
    turn = _steady_turn(trial)
    if turn is not None:
        if turn[0] * turn[1] < 0:
            yield Fault(
                "error", "delta", wrong,
                f"going ahead with {turn[0]:+.3g} rad of rudder held, r is {turn[1]:+.3g} rad/s in the mean",
                remedy, "sign", "sign",
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
            remedy, "sign", "sign",
        )  # fmt: skip
    elif abs(certainty) < 2:
        yield Fault(
            "info", "delta", "rudder hardly shows in r",
            f"dr/dt changes by {gain:.3g} 1/s^2 per rad, {abs(certainty):.1f} standard errors",
            "do not expect rudder parameters from this trial", "quality", "weak_rudder",
        )  # fmt: skip


def scale_faults(trial: Trial) -> Iterator[Fault]:
    """Speed and yaw rate against the length: a model's log with a ship's length, or the reverse.

    Where thrusters turn a ship at rest its way says nothing of its rate of turn; Froude's law does.
    """
    length = _length(trial)
    if length is None or "u" not in trial:
        return
    u = np.abs(trial["u"])
    speed = float(np.nanquantile(u, 0.95)) if np.isfinite(u).any() else 0.0
    froude = speed / math.sqrt(_G * length)
    if froude > 0.6:
        yield Fault(
            "error", "u", "wrong scale or unit: too fast for its length",
            f"Froude number {froude:.2f} at {speed:.3g} m/s and L_pp {length:g} m",
            "check L_pp and scale in the sidecar and the unit of the speed", "scale", "length",
        )  # fmt: skip
    if "r" not in trial or speed <= 0:
        return
    fast = u > 0.5 * speed
    turn = np.abs(trial["r"][fast]) * length / u[fast]
    sharp = float(np.nanquantile(turn, 0.95)) if np.isfinite(turn).any() else 0.0
    spot = any(name.startswith(_ON_THE_SPOT) for name in trial.channels)
    spins = float(np.nanquantile(np.abs(trial["r"]), 0.95)) * math.sqrt(length / _G) if sharp > 3.0 else 0.0
    if sharp > 3.0 and not (spot and spins < _SPINS):
        yield Fault(
            "warning" if spot else "error", "r", "wrong scale or unit: turns too sharply for its length",
            f"r L/u is {sharp:.2g} in the fastest rows (ships stay below about 1.5), L_pp {length:g} m",
            "check L_pp and scale in the sidecar and the unit of r", "scale", "length",
        )  # fmt: skip
