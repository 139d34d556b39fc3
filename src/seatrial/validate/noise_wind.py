"""Wind that the anemometer does not catch: other winds in its place, and what motion follows the measured one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..data import Array, Trial
from ..simulate.replay import held
from .noise_windows import WIND, Cut, Predictor


def lagged(trial: Trial, lag: float) -> Trial:
    """The trial with the wind of `lag` seconds before; below zero, of after, which no prediction could know."""
    rows = np.clip(np.arange(len(trial)) - round(lag / trial.dt), 0, len(trial) - 1)
    return _blown(trial, _components(trial)[rows])


def averaged(trial: Trial, span: float) -> Trial:
    """The trial with the mean wind of the last `span` seconds; infinity takes the mean of the whole trial."""
    wind = _components(trial)
    if not np.isfinite(span):
        return _blown(trial, np.broadcast_to(wind.mean(axis=0), wind.shape))
    width = max(round(span / trial.dt), 1)
    total = np.vstack([np.zeros(2), np.cumsum(wind, axis=0)])
    last = np.arange(1, len(wind) + 1)
    first = np.maximum(last - width, 0)
    return _blown(trial, (total[last] - total[first]) / (last - first)[:, None])


def drifted(trial: Trial, share: float, span: float) -> Trial:
    """The trial with a surface current of `share` of the wind, as an exponential mean over the last `span` seconds."""
    from scipy import signal

    gain = trial.dt / (span + trial.dt)
    mean: Any = signal.lfilter([gain], [1.0, gain - 1.0], _components(trial), axis=0)
    full: Any = signal.lfilter([gain], [1.0, gain - 1.0], np.ones(len(trial)))
    north, east = (-share * mean / full[:, None]).T
    return trial.having(U_C=np.hypot(north, east), gamma_C=np.arctan2(east, north))


def _components(trial: Trial) -> Array:
    """North and east of where the true wind comes from, gaps filled with the value before, shape (rows, 2)."""
    return held(np.column_stack([trial["U_T"] * np.cos(trial["gamma_T"]), trial["U_T"] * np.sin(trial["gamma_T"])]))


def _blown(trial: Trial, wind: Array) -> Trial:
    return trial.having(U_T=np.hypot(wind[:, 0], wind[:, 1]), gamma_T=np.arctan2(wind[:, 1], wind[:, 0]))


@dataclass(frozen=True)
class Coherence:
    """How much of an acceleration follows the wind force of the model, by frequency.

    Attributes:
        bands: lower and upper end of each band [Hz].
        before: squared coherence of the wind force with the measured acceleration less all other forces of the
            model, shape (bands, 3): 1 where the anemometer and the model explain all of it.
        after: the same with what the whole model leaves over: what a gain or a delay of the wind could still mend.
        left: power that the whole model leaves over, as a share of that which is left without wind force.
        chance: squared coherence that unrelated signals would show with as many windows.
    """

    bands: tuple[tuple[float, float], ...]
    before: Array
    after: Array
    left: Array
    chance: float


def coherence(cut: Cut, predictor: Predictor, bands: Sequence[tuple[float, float]]) -> Coherence:
    """Squared coherence of the wind force with the motion, from complete windows, Hann-tapered, averaged over them."""
    whole = cut.lanes(np.flatnonzero(np.isfinite(cut.measured).all(axis=(1, 2))))
    calm = whole.adding(WIND, -whole.series[:, :, whole.at(WIND)])
    still = predictor.accelerations(calm)[:, :-1]
    force = predictor.accelerations(whole)[:, :-1] - still
    rest = np.diff(whole.measured[:, :, 3:6], axis=1) / cut.dt - still
    lanes, steps, _ = force.shape
    taper = np.hanning(steps)[None, :, None]
    wind, without, over = (
        np.fft.rfft(taper * (v - v.mean(axis=1, keepdims=True)), axis=1) for v in (force, rest, rest - force)
    )
    f = np.fft.rfftfreq(steps, cut.dt)
    inside = [np.flatnonzero((f >= low) & (f < high)) for low, high in bands]
    return Coherence(
        tuple(bands), _shared(wind, without, inside), _shared(wind, over, inside),
        np.array([_power(over[:, k]) / _power(without[:, k]) for k in inside]), 1.0 / lanes,
    )  # fmt: skip


def _power(spectrum: Any) -> Array:
    return (np.abs(spectrum) ** 2).sum(axis=(0, 1))


def _shared(a: Any, b: Any, inside: Sequence[Any]) -> Array:
    """Squared coherence at each frequency over the windows, mean over each band, weighted by the power of b."""
    cross, own, other = (np.conj(a) * b).sum(axis=0), (np.abs(a) ** 2).sum(axis=0), (np.abs(b) ** 2).sum(axis=0)
    at = np.abs(cross) ** 2 / np.maximum(own, 1e-300)
    return np.array([at[k].sum(axis=0) / other[k].sum(axis=0) for k in inside])
