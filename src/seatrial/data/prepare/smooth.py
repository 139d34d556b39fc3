"""Motion from noisy positions and headings: a Kalman smoother over the whole recording.

Each of north, east and heading is a position driven by white jerk: state (position, velocity,
acceleration), measured position, and measured velocity where the trial has it.  The filter runs
forward, the Rauch-Tung-Striebel pass back, so that velocities have no lag.  The noise of the sensors
is read off the third differences, the jerk is the one under which the record is most likely.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...core.ranks import median
from .. import Array, DataError, Trial, unwrapped
from .axes import to_body, to_earth
from .made import SOURCES, marked

_SEARCH_ROWS = 1500


_Axis = tuple[Array, Array]
"""Smoothed states, shape (samples, 3), and their variances, same shape."""

_WILD = {"psi": 0.5, "r": 0.5}
"""Standard deviations of angles and rates beyond which they were meant in degrees [rad, rad/s]."""


def smooth(trial: Trial, noise: Mapping[str, float] | None = None, velocities: bool = False) -> Trial:
    """Smooth `x, y, psi` and derive `u, v_m, r`, each with its standard deviation ``<name>_sd``.

    Args:
        trial: needs x, y [m] and psi [rad].
        noise: standard deviation of sensors by channel (x, y, psi, u, v_m, r); estimated where absent.
        velocities: use the measured u, v_m and r too, not only positions and heading.

    Returns:
        The trial with these channels replaced; those that no sensor measured are marked as derived, the others have
        the noise of their sensors in `meta["noise"]`.  Rows in which x, y or psi is a gap stay gaps.

    Raises:
        DataError: a channel is missing, or fewer than 8 rows are complete.
    """
    given = dict(noise or {})
    good = np.isfinite(trial.stack("x", "y", "psi")).all(axis=1)
    if good.sum() < 8:
        raise DataError(f"{trial.name}: {good.sum()} rows with x, y and psi; smoothing needs at least 8")
    bad = [name for name, sd in given.items() if not (sd > 0 and math.isfinite(sd))]
    if bad:
        raise DataError(f"{trial.name}: noise of {bad[0]} is {given[bad[0]]:g}; it must be above zero")
    wild = [name for name, most in _WILD.items() if given.get(name, 0.0) > most]
    if wild:
        raise DataError(
            f"{trial.name}: noise of {wild[0]} is {given[wild[0]]:g} {trial.unit(wild[0])}; no instrument is so poor, "
            f"{_WILD[wild[0]]:g} is the most: is it in degrees?"
        )
    none = np.full(len(trial), np.nan)
    measured_r = trial["r"] if velocities and "r" in trial else none
    angle, angle_var = _axis(trial.t, unwrapped(trial["psi"]), measured_r, given.get("psi"), given.get("r"))
    psi = angle[:, 0]
    north, east = none, none
    if velocities and "u" in trial and "v_m" in trial:
        north, east = to_earth(trial["u"], trial["v_m"], psi)
    speed_sd = given.get("u", given.get("v_m"))
    x, x_var = _axis(trial.t, trial["x"], north, given.get("x"), speed_sd)
    y, y_var = _axis(trial.t, trial["y"], east, given.get("y"), speed_sd)
    u, v_m = to_body(x[:, 1], y[:, 1], psi)
    c2, s2 = np.cos(psi) ** 2, np.sin(psi) ** 2
    found = {
        "x": (x[:, 0], x_var[:, 0]), "y": (y[:, 0], y_var[:, 0]), "psi": (psi, angle_var[:, 0]),
        "u": (u, c2 * x_var[:, 1] + s2 * y_var[:, 1]), "v_m": (v_m, s2 * x_var[:, 1] + c2 * y_var[:, 1]),
        "r": (angle[:, 1], angle_var[:, 1]),
    }  # fmt: skip
    channels = {name: np.where(good, value, np.nan) for name, (value, _) in found.items()}
    channels |= {f"{name}_sd": np.where(good, np.sqrt(variance), np.nan) for name, (_, variance) in found.items()}
    units = {**trial.units, **{f"{name}_sd": trial.unit(name) for name in found}}
    out = _counted(trial, Trial(trial.name, trial.t, {**trial.channels, **channels}, units, trial.meta), given,
                   ("x", "y", "psi", "u", "v_m", "r") if velocities else ("x", "y", "psi"))  # fmt: skip
    return out.noting("x, y, psi, u, v_m, r from a Kalman smoother (white jerk)")


def _counted(raw: Trial, out: Trial, given: Mapping[str, float], read: Sequence[str]) -> Trial:
    """Smoothed channels with what they weigh: together they hold what the raw readings did, so each has their noise."""
    level = {name: given.get(name) or sensor_noise(unwrapped(raw[name]) if name == "psi" else raw[name])
             for name in read if name in raw}  # fmt: skip
    noise = {**out.meta.get("noise", {}), **{name: sd for name, sd in level.items() if sd > 0}}
    made = {name: ", ".join(of) for name, of in SOURCES.items() if name not in read or name not in raw}
    return marked(replace(out, meta={**out.meta, "noise": noise}), made)


def sensor_noise(values: Array) -> float:
    """Standard deviation of white noise on a smooth signal, from its third differences (robust)."""
    third = np.diff(values, 3)
    third = third[np.isfinite(third)]
    if third.size == 0:
        return math.nan
    # the variance of the third difference of white noise is 20 times its own
    return float(1.4826 * median(np.abs(third)) / math.sqrt(20.0))


def _axis(t: Array, position: Array, velocity: Array, sd: float | None, rate_sd: float | None) -> _Axis:
    span = float(np.nanmax(position) - np.nanmin(position)) or 1.0
    floor = 1e-6 * span
    spread = sd or max(np.nan_to_num(sensor_noise(position)), floor)
    rate = rate_sd or max(np.nan_to_num(sensor_noise(velocity)), floor / max(float(t[-1] - t[0]), 1.0))
    z = np.column_stack([position, velocity])
    r = (spread**2, rate**2)
    return _back(t, *_forward(t, z, r, _likely_jerk(t, z, r))[1:])


def _likely_jerk(t: Array, z: Array, r: tuple[float, float]) -> float:
    """Jerk intensity [m^2/s^5 or rad^2/s^5] under which the first rows are most likely."""
    from scipy.optimize import minimize_scalar

    rows = slice(0, _SEARCH_ROWS)
    span = float(np.nanstd(z[rows, 0])) or 1.0
    # a signal that swings by `span` in a time s has a jerk intensity of span^2/s^5
    part = t[rows]
    slow, fast = float(part[-1] - part[0]), 3.0 * median(np.diff(part))
    low, high = (2.0 * math.log10(span) - 5.0 * math.log10(s) for s in (slow, fast))

    def unlikely(log_q: float) -> float:
        return -_forward(t[rows], z[rows], r, 10.0**log_q)[0]

    # far from its peak the likelihood is flat or has steps: look coarsely before the fine search
    coarse = np.linspace(low, high, 10)
    peak = int(np.argmin([unlikely(float(q)) for q in coarse]))
    low, high = float(coarse[max(peak - 1, 0)]), float(coarse[min(peak + 1, coarse.size - 1)])
    found = minimize_scalar(unlikely, bounds=(low, high), method="bounded", options={"xatol": 0.1, "maxiter": 12})
    return 10.0 ** float(found.x)


def _model(s: float, q: float) -> tuple[Array, Array]:
    move = np.array([[1.0, s, 0.5 * s**2], [0.0, 1.0, s], [0.0, 0.0, 1.0]])
    blur = q * np.array([
        [s**5 / 20, s**4 / 8, s**3 / 6], [s**4 / 8, s**3 / 3, s**2 / 2], [s**3 / 6, s**2 / 2, s],
    ])  # fmt: skip
    return move, blur


def _forward(t: Array, z: Array, r: tuple[float, float], q: float) -> tuple[float, Array, Array, float]:
    """Log likelihood, filtered means (samples, 3), covariances (samples, 3, 3), and q handed on."""
    first = int(np.flatnonzero(np.isfinite(z[:, 0]))[0])
    mean = np.array([z[first, 0], 0.0, 0.0])
    reach = float(np.nanstd(z[:, 0])) + math.sqrt(r[0])
    cov = np.diag([r[0] * 10.0, reach**2, reach**2])
    means, covs = np.empty((t.size, 3)), np.empty((t.size, 3, 3))
    total, step = 0.0, -1.0
    move, blur = np.eye(3), np.zeros((3, 3))
    for k in range(t.size):
        if k:
            now = float(t[k] - t[k - 1])
            if abs(now - step) > 1e-9:
                step = now
                move, blur = _model(step, q)
            mean, cov = move @ mean, move @ cov @ move.T + blur
        for i in (0, 1):
            if math.isfinite(z[k, i]):
                spread = cov[i, i] + r[i]
                miss = z[k, i] - mean[i]
                gain = cov[:, i] / spread
                mean = mean + gain * miss
                cov = cov - np.outer(gain, cov[i])
                total -= 0.5 * (math.log(spread) + miss * miss / spread)
        cov = 0.5 * (cov + cov.T)  # rounding must not grow into an asymmetry
        means[k], covs[k] = mean, cov
    return total, means, covs, q


def _back(t: Array, means: Array, covs: Array, q: float) -> _Axis:
    mean, cov = means.copy(), covs.copy()
    for k in range(t.size - 2, -1, -1):
        move, blur = _model(float(t[k + 1] - t[k]), q)
        ahead = move @ covs[k] @ move.T + blur
        gain = np.linalg.solve(ahead, move @ covs[k]).T
        mean[k] = means[k] + gain @ (mean[k + 1] - move @ means[k])
        smoothed = covs[k] + gain @ (cov[k + 1] - ahead) @ gain.T
        cov[k] = 0.5 * (smoothed + smoothed.T)
    return mean, np.maximum(np.diagonal(cov, axis1=1, axis2=2), 0.0)
