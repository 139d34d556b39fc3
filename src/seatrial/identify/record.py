"""Cutting trials into windows, one lane each: start state, inputs, what was measured, what it weighs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..data import Array, DataError, Trial, unwrapped
from ..data.prepare import resample
from ..models import STATES, Model
from ..simulate.replay import inputs, unseen
from . import Loss

# A step may differ from the others by this fraction before the trial counts as uneven.
_UNEVEN = 0.02


@dataclass(frozen=True)
class Windows:
    """Windows of all trials, padded to one length.

    Attributes:
        state0: measured state at the start of each window, shape (lanes, states).
        series: controls and environment per step, shape (lanes, steps, controls + 8).
        measured: shape (lanes, rows, 6); zero where `scale` is zero.
        scale: root weight over sigma of each entry, same shape; zero marks a gap or padding.
        trial: index of the trial each window comes from, shape (lanes,).
        samples: compared rows, gaps left out.
        weight: share of a compared row that counts as independent.
        dt, steps, every: time step of the integrator [s], its samples in a window, and how many of its steps lie
            between compared rows.
    """

    state0: Array
    series: Array
    measured: Array
    scale: Array
    trial: NDArray[np.intp]
    samples: int
    weight: float
    dt: float
    steps: int
    every: int


def spread(trials: Sequence[Trial]) -> dict[str, float]:
    """Standard deviation of each state over all trials together, heading unwrapped; the default sigma.

    Raises:
        DataError: a channel that never changes has no spread to measure errors by.
    """
    out: dict[str, float] = {}
    for name in STATES:
        values = np.concatenate([unwrapped(t[name]) if name == "psi" else t[name] for t in trials])
        out[name] = float(np.nanstd(values))
        if not out[name] > 0:
            raise DataError(f"channel {name} is constant in every trial; give its scale in [loss] sigma")
    return out


def even(trial: Trial, dt: float) -> Trial:
    """The trial on even steps of `dt` [s]; resampled where it is not already."""
    steps = np.diff(trial.t)
    if np.all(np.abs(steps - dt) <= _UNEVEN * dt):
        return trial
    return resample(trial, dt)


def windows(
    trials: Sequence[Trial], model: Model, loss: Loss, sigma: Mapping[str, float], *,
    window: float, dt: float, every: int, stride: float | None = None, substeps: int = 1,
) -> Windows:  # fmt: skip
    """Every trial cut into windows of `window` seconds, the last one shorter; one follows the other.

    From row to row, `dt` [s] apart, the integrator takes `substeps` equal steps (`approach.substeps`), with
    what acts held.  With a `stride` [s] a window begins every so many seconds, so that windows overlap where
    it is shorter.
    A window starts at a complete row; rows with gaps inside it weigh nothing.

    Raises:
        DataError: a trial lacks a channel, or has no window with two complete rows.
    """
    parts: list[tuple[Array, Array, Array, Array, int]] = []
    steps = max(round(window / dt), 1) + 1
    rows = (steps - 1) // every + 1
    weight = 1.0 if loss.correlation <= 0 else min(every * dt / loss.correlation, 1.0)
    scale = np.array([np.sqrt(weight) / sigma[n] if n in sigma else 0.0 for n in STATES])
    onwards = steps - 1 if stride is None else max(round(stride / dt), 1)
    for index, trial in enumerate(trials):
        found = _cut(even(trial, dt), model, steps, rows, every, onwards, scale * np.sqrt(loss.weight(trial.name)))
        if not found:
            raise DataError(f"{trial.name}: no window of {window:g} s with two complete rows of {', '.join(STATES)}")
        parts += [(*part, index) for part in found]
    state0, series, measured, scaled, trial_of = (list(x) for x in zip(*parts, strict=True))
    stacked = np.stack(scaled)
    return Windows(
        np.stack(state0), between(np.stack(series), substeps), np.stack(measured), stacked,
        np.array(trial_of, dtype=np.intp), int((stacked.any(axis=2)).sum()), weight, dt / substeps,
        (steps - 1) * substeps + 1, every * substeps,
    )  # fmt: skip


def between(series: Array, substeps: int) -> Array:
    """Inputs of every step of the integrator from those of every row, shape (lanes, steps, inputs); all hold."""
    return series if substeps == 1 else np.repeat(series, substeps, axis=1)[:, : (series.shape[1] - 1) * substeps + 1]


def _cut(
    trial: Trial, model: Model, steps: int, rows: int, every: int, onwards: int, scale: Array
) -> list[tuple[Array, Array, Array, Array]]:
    state = trial.stack(*STATES)
    state[:, 2] = unwrapped(state[:, 2])
    series = inputs(trial, model)
    remembered = unseen(model, series, trial.dt)
    good = np.asarray(np.isfinite(state).all(axis=1))
    out: list[tuple[Array, Array, Array, Array]] = []
    first, last = 0, int(np.max(np.flatnonzero(good), initial=0))
    while first < last:
        first = int(np.argmax(good[first:])) + first
        at = np.arange(first, first + steps)
        inside = at <= last
        held = np.minimum(at, last)
        compared, present = held[::every][:rows], inside[::every][:rows]
        measured = state[compared]
        scaled = np.where(np.isfinite(measured) & present[:, None], scale, 0.0)
        if present.sum() > 1:
            start = np.append(state[first], remembered[first])
            out.append((start, series[held], np.where(scaled > 0, measured, 0.0), scaled))
        first += onwards
    return out
