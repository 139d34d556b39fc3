"""Trials cut into chains of windows for multiple shooting: each window goes on where the one before ends.

Which entries of the first state of a trial a fit may move, and what holds those that no reading does.

A position or heading that no compared channel follows from is held at its measurement: nothing else tells it.
Any other entry whose own channel is left out, as the speeds are where only positions are compared, is drawn to its
measurement by the spread of that channel over the trials, so weakly that it only decides where the data say nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...data import Array, DataError, Trial, unwrapped
from ...models import STATES, Model
from ...simulate.replay import inputs, unseen
from .. import Loss
from ..record import between, even

Index = NDArray[np.intp]
Part = tuple[Array, Array, Array, Array, Array, Index]


@dataclass(frozen=True)
class Chains:
    """Windows of all trials, one lane each, padded to one length.

    The first row of a window is the last one of the window before and counts there only; the first row of a
    trial counts in its first window.

    Attributes:
        nodes: measured state at the start of each window, gaps bridged, shape (lanes, states).
        series: controls and environment per step, shape (lanes, steps, controls + 8).
        measured: shape (lanes, rows, 6); zero where `scale` is zero.
        scale: root weight over sigma of each entry, same shape; zero marks a gap or padding.
        motion: measured states with gaps bridged, shape (lanes, rows, 6).
        length: rows of each window that lie before its end or the trial's, shape (lanes,).
        trial: index of the trial of each lane.
        levels: lanes of the first windows of all trials, of the second ones, and so on.
        samples: entries that count.
        weight: share of a compared row that counts as independent.
        dt, steps, every: time step of the integrator [s], its samples in a window, and how many of its steps lie
            between compared rows.
    """

    nodes: Array
    series: Array
    measured: Array
    scale: Array
    motion: Array
    length: Index
    trial: Index
    levels: tuple[Index, ...]
    samples: int
    weight: float
    dt: float
    steps: int
    every: int

    @property
    def trials(self) -> int:
        """Number of chains."""
        return self.levels[0].size


def chains(
    trials: Sequence[Trial], model: Model, loss: Loss, sigma: Mapping[str, float], *,
    window: float, dt: float, every: int, weights: Mapping[str, float],
    substeps: int = 1,
) -> Chains:  # fmt: skip
    """Every trial cut into windows of `window` seconds, the last one shorter.

    Args:
        weights: what the squared residuals of a trial are multiplied by, by its name; 1 where it is not named.
        substeps: equal steps of the integrator from row to row, `dt` [s] apart.

    Raises:
        DataError: a trial lacks a channel, or is shorter than two complete rows or one window.
    """
    jump = every * max(round(window / (dt * every)), 1)
    share = 1.0 if loss.correlation <= 0 else min(every * dt / loss.correlation, 1.0)
    base = np.array([np.sqrt(share) / sigma[n] if n in sigma else 0.0 for n in STATES])
    parts: list[Part] = []
    trial_of: list[int] = []
    level_of: list[int] = []
    for index, trial in enumerate(trials):
        cut = _cut(even(trial, dt), model, jump, every, base * np.sqrt(weights.get(trial.name, 1.0)))
        parts += cut
        trial_of += [index] * len(cut)
        level_of += range(len(cut))
    nodes, series, measured, scale, motion, length = (np.stack(x) for x in zip(*parts, strict=True))
    level = np.array(level_of, dtype=np.intp)
    return Chains(
        nodes, between(series, substeps), measured, scale, motion, length, np.array(trial_of, dtype=np.intp),
        tuple(np.flatnonzero(level == k) for k in range(int(level.max()) + 1)),
        int((scale > 0).sum()), share, dt / substeps,
        jump * substeps + 1, every * substeps,
    )  # fmt: skip


def _cut(trial: Trial, model: Model, jump: int, every: int, scale: Array) -> list[Part]:
    absent = [name for name in STATES if name not in trial]
    if absent:
        raise DataError(f"{trial.name}: no channel {', '.join(absent)}; shooting needs {', '.join(STATES)}")
    state = trial.stack(*STATES)
    state[:, 2] = unwrapped(state[:, 2])
    good = np.flatnonzero(np.isfinite(state).all(axis=1))
    if good.size < 2:
        raise DataError(f"{trial.name}: no two rows with all of {', '.join(STATES)}")
    first, last = int(good[0]), int(good[-1])
    if len(trial) <= jump:
        wanted = f"the {jump + 1} of one window; shorten the window"
        raise DataError(f"{trial.name}: {len(trial)} samples are fewer than {wanted}")
    series = inputs(trial, model)
    hidden = unseen(model, series, trial.dt)
    rows = np.arange(len(state), dtype=np.float64)
    bridged = np.column_stack([np.interp(rows, rows[good], column[good]) for column in state.T])
    out: list[Part] = []
    for begin in range(first, last, jump):
        at = np.minimum(np.arange(begin, begin + jump + 1), last)
        compared = np.arange(begin, begin + jump + 1, every)
        counts = (compared <= last) & ((compared > begin) | (begin == first))
        measured = state[np.minimum(compared, last)]
        scaled = np.where(np.isfinite(measured) & counts[:, None], scale, 0.0)
        node = np.append(bridged[begin], hidden[begin])
        length = np.array(np.count_nonzero(compared[:-1] < last), dtype=np.intp)
        motion = bridged[np.minimum(compared, last)]
        out.append((node, series[at], np.where(scaled > 0, measured, 0.0), scaled, motion, length))
    return out


# Channels of which one must be compared for the start of a position or of the heading to be told.
_TOLD_BY = {"x": ("x",), "y": ("y",), "psi": ("psi", "x", "y")}


@dataclass(frozen=True)
class FirstStates:
    """The free entries of the first states.

    Attributes:
        free: their indices in the state.
        weight: of the squared offset of each from its measurement; zero where its readings are compared.
        measured: measurement of each in each trial, shape (trials, free).
        lanes: first windows of all trials.
    """

    free: Index
    weight: Array
    measured: Array
    lanes: Index

    @staticmethod
    def of(cut: Chains, span: Array) -> FirstStates:
        """Those that the compared channels tell; `span` is the spread of each channel, shape (states,)."""
        compared = {STATES[k] for k in np.flatnonzero(cut.scale.max(axis=(0, 1)))}
        told = [k for k, name in enumerate(STATES) if compared & {*_TOLD_BY.get(name, STATES)}]
        free = np.array(told, dtype=np.intp)
        weight = np.array([0.0 if STATES[k] in compared else span[k] ** -2.0 for k in told])
        lanes = cut.levels[0]
        return FirstStates(free, weight, cut.nodes[np.ix_(lanes, free)], lanes)

    @staticmethod
    def none(cut: Chains) -> FirstStates:
        """Every first state as measured."""
        return FirstStates(np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros((cut.trials, 0)), cut.levels[0])

    @property
    def count(self) -> int:
        """How many there are in a trial."""
        return self.free.size

    def away(self, nodes: Array) -> Array:
        """Their offsets from the measurement, shape (trials, free)."""
        return nodes[np.ix_(self.lanes, self.free)] - self.measured

    def prior(self, nodes: Array) -> float:
        """Their part of the objective."""
        return float((self.weight * self.away(nodes) ** 2).sum())
