"""Error measures of one prediction against one measurement; NaN samples are left out.

Heading is compared unwrapped: both courses are made continuous, and the prediction is shifted by
the whole turns that bring its first sample nearest to the measured one.  A lap too many counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ..core.once import by_identity
from ..core.ranks import median
from ..data import Array, DataError, Trial, unwrapped
from ..data.prepare import measured as is_measured
from ..models import ROLL, STATES
from . import Metrics

ESSO_OSAKA_SIGMA: Mapping[str, float] = MappingProxyType(
    {"x": 10.446, "y": 3.566, "psi": 2.859, "u": 0.1015, "v_m": 0.0416, "r": 0.0238}
)
"""Scales for the 3 m Esso Osaka set (Wakita 2022): standard deviations over its six test files
together, heading unwrapped [m, m, rad, m/s, m/s, rad/s]."""

HORIZONS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0)
"""Upper ends of the horizon bins [s since the restart]."""

# Share of a time by which a reading may be earlier.
_EARLY = 0.2
_UNITS = {"x": "m", "y": "m", "psi": "deg", "u": "m/s", "v_m": "m/s", "r": "deg/s", "phi": "deg", "p": "deg/s"}


def scale_words(sigma: Mapping[str, float]) -> str:
    """The scales of the states for a reader, angles in degrees."""
    shown = {name: math.degrees(value) if "deg" in _UNITS[name] else value for name, value in sigma.items()}
    return ", ".join(f"{name} {value:.3g} {_UNITS[name]}" for name, value in shown.items())


def scales(trials: Sequence[Trial], given: Mapping[str, float] | None) -> Mapping[str, float]:
    """Scale of each state: as given for all, that of the common evaluator for its set, or the spread of the trials."""
    if given and set(given) == set(STATES):
        return given
    if trials and all("FRT-DS-ESSO" in str(trial.meta.get("source", "")) for trial in trials):
        return ESSO_OSAKA_SIGMA
    return spread(trials)


def rmse(measured: Array, predicted: Array) -> float:
    """Root mean square error, in the unit of the channel."""
    error = _error(measured, predicted)
    return float(np.sqrt(np.mean(error**2))) if error.size else math.nan


def metrics(measured: Array, predicted: Array) -> Metrics:
    """All error measures of one channel; NaN where there is nothing to compare, or no variance to compare with."""
    error = _error(measured, predicted)
    if not error.size:
        return Metrics(math.nan, math.nan, math.nan, math.nan, 0)
    compared = measured[np.isfinite(predicted - measured)]
    total, variance = float(np.sum((compared - np.mean(compared)) ** 2)), float(np.var(compared))
    return Metrics(
        rmse(measured, predicted),
        1.0 - float(np.sum(error**2)) / total if total > 0 else math.nan,
        float(np.var(error)) / variance if variance > 0 else math.nan,
        float(np.mean(error)), error.size,
    )  # fmt: skip


def segments(t: Array, restart: float | None) -> NDArray[np.intp]:
    """Number of the prediction each row belongs to, one every `restart` seconds from t[0] on.

    Raises:
        ValueError: a restart interval that is not positive.
    """
    if restart is None or not t.size:
        return np.zeros(t.size, dtype=np.intp)
    if not restart > 0:
        raise ValueError(f"restart is {restart:g} s; give a positive time, or None for one free run")
    # The small term keeps a row that falls on the restart, but for rounding, in the new segment.
    return np.floor((t - t[0]) / restart + 1e-6).astype(np.intp)


def heading(measured: Array, predicted: Array, segment: NDArray[np.intp]) -> tuple[Array, Array]:
    """Measured and predicted heading on the same rows, unwrapped and without whole turns between them [rad].

    Args:
        segment: number of the prediction each row belongs to; each is aligned at its own start.
    """
    truth, out = unwrapped(measured), np.full_like(predicted, np.nan)
    for number in np.unique(segment):
        rows = np.flatnonzero(segment == number)
        psi = unwrapped(predicted[rows])
        gap = (psi - truth[rows])[np.isfinite(psi - truth[rows])]
        out[rows] = psi - 2.0 * math.pi * np.round(gap[0] / (2.0 * math.pi)) if gap.size else psi
    return truth, out


@by_identity
def pairs(measured: Trial, predicted: Trial, restart: float | None = None) -> dict[str, tuple[Array, Array]]:
    """Measured and predicted channel by state, heel among them, on the same rows, heading aligned; SI units.

    A state without a reading, or made from others, is left out.
    """
    out = {n: (measured[n], predicted[n]) for n in (*STATES, *ROLL) if n in predicted and is_measured(measured, n)}
    if "psi" in out:
        out["psi"] = heading(*out["psi"], segments(measured.t, restart))
    return out


def standardised(
    measured: Trial, predicted: Trial, sigma: Mapping[str, float], *, restart: float | None = None
) -> float:
    """Sum over the states of the mean squared error over sigma^2 (Wakita 2022 Eq. 25).

    Args:
        measured, predicted: on the same rows.
        sigma: scale of each state to count, SI units; `ESSO_OSAKA_SIGMA` for that data set.
        restart: seconds between restarts from the measured state, or None for one free run.

    Raises:
        DataError: a state to count is missing or has no sample; a scale that is not positive.
    """
    both = pairs(measured, predicted, restart)
    total = 0.0
    for name, scale in sigma.items():
        if not scale > 0:
            raise DataError(f"{measured.name}: sigma of {name} is {scale:g}; a scale must be positive")
        if name not in both:
            raise DataError(f"{measured.name}: {name} is missing in the measurement or the prediction")
        error = _error(*both[name])
        if not error.size:
            raise DataError(f"{measured.name}: no sample of {name} can be compared")
        total += float(np.mean(error**2)) / scale**2
    return total


def spread(trials: Iterable[Trial]) -> dict[str, float]:
    """Standard deviation of each measured state over all trials together, heading unwrapped.

    Constant states have no scale and are left out.
    """
    pools: dict[str, list[Array]] = {name: [] for name in STATES}
    for trial in trials:
        for name in STATES:
            if name in trial:
                values = trial.heading if name == "psi" else trial[name]
                pools[name].append(values[np.isfinite(values)])
    found = {n: float(np.std(np.concatenate(p))) for n, p in pools.items() if sum(v.size for v in p)}
    return {name: value for name, value in found.items() if value > 0}


def horizons(measured: Trial, predicted: Trial, restart: float | None = None) -> dict[float, dict[str, float]]:
    """RMSE by channel in bins of the time since the restart; key: upper end of the bin [s].

    A bin reaches from the end of the one before it; the restart itself, free of error, is in none.
    """
    both = pairs(measured, predicted, restart)
    segment = segments(measured.t, restart)
    _, first = np.unique(segment, return_index=True)
    since = measured.t - measured.t[first[segment - segment[0]]] if segment.size else measured.t
    bins = np.searchsorted(HORIZONS, since - 1e-6)
    out: dict[float, dict[str, float]] = {}
    for i, end in enumerate(HORIZONS):
        rows = (bins == i) & (since > 1e-6)
        found = {name: rmse(a[rows], b[rows]) for name, (a, b) in both.items()}
        if any(math.isfinite(value) for value in found.values()):
            out[end] = found
    return out


def reached(measured: Trial, predicted: Trial, restart: float | None, seconds: float) -> dict[str, Array]:
    """Errors by channel so many seconds after each restart, shape (restarts,); fewer where not all last so long.

    Each channel at its last reading until then, at most one and a half of its own intervals before, and no more than a
    fifth of the time: a receiver at 1 Hz has none on most rows of a log at 5 Hz.
    """
    both = pairs(measured, predicted, restart)
    segment = segments(measured.t, restart)
    if not segment.size:
        return {}
    _, first, of = np.unique(segment, return_index=True, return_inverse=True)
    since = measured.t - measured.t[first[of]]
    found: dict[str, Array] = {}
    for name, (a, b) in both.items():
        read = np.isfinite(a)
        step = median(np.diff(measured.t[read])) if read.sum() > 1 else measured.dt
        early = max(1.5 * measured.dt, min(1.5 * step, _EARLY * seconds))
        near = np.flatnonzero(read & (since <= seconds + 1e-6) & (since > seconds - early))
        last = near[np.append(np.diff(of[near]) > 0, True)] if near.size else near
        found[name] = (b - a)[last]
    return found


def _error(measured: Array, predicted: Array) -> Array:
    difference = predicted - measured
    return difference[np.isfinite(difference)]
