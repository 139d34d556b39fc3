"""Comparison of a prediction with a measurement, and the constant-velocity baseline."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from ..data import Array, DataError, Trial
from ..environment import to_earth
from ..manoeuvres import Index
from ..manoeuvres.told import manoeuvre
from ..models import ROLL, STATES
from ..simulate.begun import begun
from . import Comparison
from .metrics import horizons, metrics, pairs, segments, spread, standardised


def compare(
    measured: Trial, predicted: Trial, *, label: str, restart: float | None = None,
    sigma: Mapping[str, float] | None = None, L_pp: float | None = None,
) -> Comparison:  # fmt: skip
    """Compare `predicted` with `measured` at equal times.

    Args:
        measured: measured trial.
        predicted: prediction at times of the measurement; it may have fewer rows.
        label: what predicts ("fitted", "published", ...).
        restart: seconds between restarts from the measured state, or None for one free run.
        sigma: scale of each state, SI units; None takes the standard deviation of each measured
            state over this trial.  To compare or pool trials, give one `spread` of them all.
        L_pp: length between perpendiculars [m]; without it no manoeuvre indices are read off.

    Raises:
        DataError: no common time or no common state.
    """
    truth, guess = _aligned(measured, predicted)
    both = pairs(truth, guess, restart)
    if not any(np.isfinite(a - b).any() for a, b in both.values()):
        raise DataError(f"{measured.name}: no state is in the measurement and in the prediction of {label}")
    every = sigma if sigma is not None else spread([truth])
    scale = {n: s for n, s in every.items() if n in both}
    values, units = _indices(truth, guess, restart, L_pp)
    return Comparison(
        truth, guess, label, restart, {name: metrics(a, b) for name, (a, b) in both.items()},
        horizons(truth, guess, restart), standardised(truth, guess, scale, restart=restart), values, scale, units,
    )  # fmt: skip


def constant_velocity(trial: Trial, restart: float | None, begin: Array | None = None) -> Trial:
    """The baseline: from each restart the ship keeps the u, v_m and r measured there; it knows nothing of heel.

    The kinematics are integrated exactly (an arc).  A segment begins at its first complete sample;
    rows before it are NaN.  With `begin`, a state of shape (6,), the first segment begins in that state at the first
    row.
    """
    state, segment = begun(trial)[0].copy(), segments(trial.t, restart)
    out = np.full_like(state, np.nan)
    if begin is not None:
        state[0] = begin
    for number in np.unique(segment):
        rows = np.flatnonzero(segment == number)
        whole = rows[np.isfinite(state[rows]).all(axis=1)]
        if whole.size:
            rows = rows[rows >= whole[0]]
            out[rows] = _arc(state[whole[0]], trial.t[rows] - trial.t[rows[0]])
    flat = replace(trial, channels={name: v for name, v in trial.channels.items() if name not in ROLL})
    return flat.having(**dict(zip(STATES, out.T, strict=True)))


def pooled(comparisons: Iterable[Comparison]) -> float:
    """Standardised mean squared error over several trials, each weighted by its samples."""
    parts = [(c.standardised, c.samples) for c in comparisons]
    total = sum(n for _, n in parts)
    return sum(value * n for value, n in parts) / total if total else math.nan


def _aligned(measured: Trial, predicted: Trial) -> tuple[Trial, Trial]:
    """Both on the rows whose times they share, to a hundredth of the time step."""
    if not (len(measured) and len(predicted)):
        raise DataError(f"{measured.name}: nothing to compare, one of the two trials is empty")
    last = len(measured) - 1
    after = np.clip(np.searchsorted(measured.t, predicted.t), 0, last)
    before = np.clip(after - 1, 0, last)
    nearer = np.abs(measured.t[before] - predicted.t) < np.abs(measured.t[after] - predicted.t)
    row = np.where(nearer, before, after)
    tolerance = 0.01 * measured.dt if len(measured) > 1 else 1e-6
    shared = np.abs(measured.t[row] - predicted.t) <= tolerance
    if not shared.any():
        raise DataError(
            f"{measured.name}: the prediction (t = {predicted.t[0]:g} to {predicted.t[-1]:g} s) shares no "
            f"time with the measurement ({measured.t[0]:g} to {measured.t[-1]:g} s)"
        )
    truth = measured.rows(row[shared])
    return truth, replace(predicted.rows(shared), t=truth.t)


def _arc(start: Array, tau: Array) -> Array:
    """States `tau` seconds after `start` at constant velocities, shape (rows, 6)."""
    x, y, psi, u, v_m, r = start
    half = 0.5 * r * tau
    chord = tau * np.sinc(half / math.pi)
    north, east = to_earth(u, v_m, np.cos(psi + half), np.sin(psi + half))
    same = np.ones_like(tau)
    return np.column_stack([x + north * chord, y + east * chord, psi + r * tau, u * same, v_m * same, r * same])


def _indices(
    measured: Trial, predicted: Trial, restart: float | None, L_pp: float | None
) -> tuple[dict[str, tuple[float, float]], dict[str, str]]:
    policy = manoeuvre(measured)
    # A prediction that was reset to the measured state on its way has no indices of its own.
    if policy is None or L_pp is None or segments(measured.t, restart)[-1] > 0:
        return {}, {}
    # The prediction was steered by the measured rudder, so both have one execute point.
    rudder = {name: measured[name] for name in ("delta", "delta_cmd") if name in measured}
    try:
        truth = policy.indices(measured, L_pp)
        guess: Mapping[str, Index] = policy.indices(predicted.having(**rudder), L_pp)
    except DataError:
        return {}, {}
    names = [name for name in truth if name in guess]
    return {n: (truth[n].value, guess[n].value) for n in names}, {n: truth[n].unit for n in names}
