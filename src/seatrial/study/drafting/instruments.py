"""What recordings share that nobody recorded, and what they show of their instruments before a fit.

Current: estimated about zero, unless one is on record or all head one way.

Compass.  A heading that reads e too much turns the speed over ground that the track shows into a sway of -U e.  With
e = a + b sin(psi) + c cos(psi), a current of (c_N, c_E) and a sway that goes with the turn,

    v_m = -c_N sin(psi) + c_E cos(psi) + k r - U (a + b sin(psi) + c cos(psi)),

a current drops out by the speeds at which the recordings sail: at one speed alone the two are the same, and no
deviation is claimed.

Smoothed channels.  The noise of a sensor is read off the roughness of its log (`identify.noise`).  Where the logger has
passed the heading through a filter, little of that is left, and it would weigh hundreds of times more than the track:
the fit then follows it alone.  No compass and no gyro reads to a hundredth of a degree on a craft that turns about (the
carriage of a tank does, whose models turn little meanwhile).  Where one seems to, track and heading count as far as a
model can be right at all, a two-hundredth of what they change by in a prediction; speeds and rates of such a log are
made of them by the filter, and are no second measurement.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...data import Array, Trial
from ...data.prepare.made import measured
from ...identify.noise import channel, noise

_UNDER_WAY = 0.4
"""Share of the highest speed from which on a course is one."""

_LEFT, _LEAST = 0.75, math.radians(2.0)
"""A deviation leaves at most this share of the sway that a current leaves, and is at least so large [rad]."""

_ONE_WAY = 0.8
"""Mean of the unit vectors of all headings from which on a current cannot be told from the ship's own speed."""

_CURRENT = 0.5, 0.25
"""Prior of a current: a tide at sea [m/s], and on a pond at most a share of the speed of the ship."""

_BIAS, _DEVIATION = 0.1, 0.2
"""Priors of the heading's bias and of each half of a cycle of deviation [rad]: a compass that nobody has swung."""

_ROWS = 100
_PLACES = ("x", "y", "psi")
_FINEST, _TURNED, _RIGHT = 2e-4, 0.5, 5e-3
"""Noise of the best heading, the turn in a prediction [rad], and how right a model is, as a share of the motion."""


def shared(trials: Sequence[Trial], L_pp: float, clock: float) -> dict[str, float]:
    """Standard deviations of a current and of errors of the compass that all trials share, SI units.

    Args:
        trials: the recordings.
        L_pp: length of the ship [m].
        clock: time in which it covers its length in these trials [s].
    """
    size = _current(trials, L_pp / clock)
    out: dict[str, float] = {"current.north": size, "current.east": size} if size else {}
    if deviation(trials):
        out |= {"bias.psi": _BIAS, "deviation.north": _DEVIATION, "deviation.east": _DEVIATION}
    return out


def _current(trials: Sequence[Trial], speed: float) -> float:
    """Standard deviation of each component of a current that was not recorded [m/s].

    Zero where one is on record, and where all head one way, as in a basin: there it is a part of the speed.  Headings
    that are not on record say nothing of a current.
    """
    if any("U_C" in trial or "psi" not in trial for trial in trials):
        return 0.0
    if abs(np.nanmean(np.exp(1j * np.concatenate([trial["psi"] for trial in trials])))) > _ONE_WAY:
        return 0.0
    most, share = _CURRENT
    return min(most, share * speed)


def deviation(trials: Sequence[Trial]) -> float:
    """Amplitude of one cycle of compass error that the sway under way shows [rad]; 0 where it shows none."""
    parts = [_under_way(trial) for trial in trials if all(name in trial for name in ("psi", "u", "v_m", "r"))]
    u, v, r, psi = np.concatenate(parts, axis=1) if parts else np.zeros((4, 0))
    if u.size < _ROWS or abs(np.mean(np.exp(1j * psi))) > _ONE_WAY:
        return 0.0
    # astern the course is that of the stern: u keeps its sign
    current = [-np.sin(psi), np.cos(psi), r, u]
    without, _ = _left(current, v)
    left, found = _left([*current, -u * np.sin(psi), -u * np.cos(psi)], v)
    size = float(np.hypot(found[-2], found[-1]))
    return size if left < _LEFT * without and size > _LEAST else 0.0


def _under_way(trial: Trial) -> Array:
    """u, v_m, r, psi of the rows that make way, shape (4, rows)."""
    rows: Array = trial.stack("u", "v_m", "r", "psi").T
    rows = rows[:, np.isfinite(rows).all(axis=0)]
    fast = np.quantile(np.abs(rows[0]), 0.98) if rows.size else 0.0
    return rows[:, np.abs(rows[0]) > max(_UNDER_WAY * fast, 1e-6)]


def _left(columns: Sequence[Array], v: Array) -> tuple[float, Array]:
    """Sum of squares that these columns leave of the sway, and their factors."""
    matrix = np.stack(columns, axis=1)
    found: Array = np.asarray(np.linalg.lstsq(matrix, v)[0], dtype=np.float64)
    return float(np.sum((v - matrix @ found) ** 2)), found


def smoothed(trials: Sequence[Trial], window: float) -> dict[str, float]:
    """Scale of the errors of each state that counts where the heading was smoothed, SI units; empty where it was not.

    Args:
        trials: the recordings.
        window: length of a prediction [s].
    """
    levels = noise(trials)
    moves = {name: _moves([one for one in trials if measured(one, name)], name, window) for name in levels}
    if not levels.get("psi", math.inf) < _FINEST or moves["psi"] < _TURNED:
        return {}
    if set(_PLACES) <= set(levels):
        levels = {name: levels[name] for name in _PLACES}
    if {"x", "y"} <= set(moves):  # one receiver
        moves |= dict.fromkeys("xy", math.hypot(moves["x"], moves["y"]) / math.sqrt(2.0))
    return {name: math.hypot(level, _RIGHT * moves[name]) for name, level in levels.items()}


def _moves(trials: Sequence[Trial], name: str, window: float) -> float:
    """Root mean square of what a state changes by in a prediction."""
    changes = [np.zeros(0)]
    for trial in trials:
        values, far = channel(trial, name), max(round(window / trial.dt), 1)
        changes.append(np.asarray(values[far:] - values[:-far], dtype=np.float64))
    every = np.concatenate(changes)
    known = every[np.isfinite(every)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0
