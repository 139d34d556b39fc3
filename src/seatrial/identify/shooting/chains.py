"""Chains of windows for multiple shooting, each window starting where the one before ends, and free first states.

A position or heading that determines no compared channel is held at its measurement.  Any other entry of the first
state of a trial is free.  One whose own channel is not compared, such as a speed where only positions are, has a
prior at its measurement with the spread of that channel over the trials: so weak that it matters only where the data
do not determine the entry.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from ...data import Array, DataError, Trial
from ...models import STATES, Model
from .. import Loss
from ..record import Piece, Record, Windows, even, lanes, root_weights, share

Index = NDArray[np.intp]


@dataclass(frozen=True)
class Chains(Windows):
    """Windows of all trials that follow each other, one lane each, padded to one length.

    The first row of a window is the last one of the window before and counts there only; the first row of a
    trial counts in its first window.  Gaps are bridged in `state0`.

    Attributes:
        motion: measured states with gaps bridged, shape (lanes, rows, 6).
        length: rows of each window that lie before its end or the trial's, shape (lanes,).
        levels: lanes of the first windows of all trials, of the second ones, and so on.
    """

    motion: Array
    length: Index
    levels: tuple[Index, ...]

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
        weights: factors of the squared residuals of a trial, by its name; 1 where it is not named.
        substeps: equal steps of the integrator from row to row, `dt` [s] apart.

    Raises:
        DataError: a trial lacks a channel, or is shorter than two complete rows or one window.
    """
    jump = every * max(round(window / (dt * every)), 1)
    weight = share(loss, every * dt)
    scale = root_weights(sigma, weight, STATES)
    parts: list[tuple[int, Piece]] = []
    motion: list[Array] = []
    counts: list[tuple[int, int]] = []
    for index, trial in enumerate(trials):
        record = _whole(even(trial, dt, model), model, jump)
        bridged, own = record.bridged, scale * np.sqrt(weights.get(trial.name, 1.0))
        for level, begin in enumerate(range(int(record.complete[0]), record.last, jump)):
            piece = record.window(begin, jump + 1, every, own, joined=level > 0)
            parts.append((index, piece._replace(state0=np.append(bridged[begin], record.hidden[begin]))))
            motion.append(bridged[piece.rows])
            counts.append((level, int((begin + every * np.arange(len(piece.rows) - 1) < record.last).sum())))
    levels, length = np.array(counts, dtype=np.intp).T
    return Chains(
        **lanes(parts, weight, dt=dt, steps=jump + 1, every=every, substeps=substeps),
        motion=np.stack(motion), length=length,
        levels=tuple(np.flatnonzero(levels == k) for k in range(int(levels.max()) + 1)),
    )  # fmt: skip


def _whole(trial: Trial, model: Model, jump: int) -> Record:
    """The record of a trial that has two complete rows, and more rows than a window of `jump` steps."""
    record = Record.of(trial, model)
    if record.complete.size < 2:
        raise DataError(f"{trial.name}: no two rows with all of {', '.join(STATES)}")
    if len(trial) <= jump:
        wanted = f"the {jump + 1} of one window; shorten the window"
        raise DataError(f"{trial.name}: {len(trial)} samples are fewer than {wanted}")
    return record


# Channels of which one must be compared for an initial position or heading to be determined.
_SHOWN_BY = {"x": ("x",), "y": ("y",), "psi": ("psi", "x", "y")}


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
        """Those that the compared channels determine; `span` is the spread of each channel, shape (states,)."""
        compared = {STATES[k] for k in np.flatnonzero(cut.scale.max(axis=(0, 1)))}
        known = [k for k, name in enumerate(STATES) if compared & {*_SHOWN_BY.get(name, STATES)}]
        weight = np.array([0.0 if STATES[k] in compared else span[k] ** -2.0 for k in known])
        free, lanes = np.array(known, dtype=np.intp), cut.levels[0]
        return FirstStates(free, weight, cut.state0[np.ix_(lanes, free)], lanes)

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
