"""Parts of trials in which something has acted that no model of the ship holds: a hand, a rope, a quay, a slip.

Logs of free-running tests end with the model being caught, and a position that jumps makes a speed that never was.  A
prediction that runs through such seconds ends far off whatever the coefficients are, and bends them.  They show in
surge, where a ship has the least force to change its speed by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...data import Array, Trial
from ...ships import Ship
from ...simulate.carried import beyond
from ...simulate.lanes import Kernel
from ...simulate.loop import open_loop, open_loop_parameters
from ..record import Record

# Means beyond so many robust deviations of all means are no error of a model.
_LIMIT = 12.0
_ROBUST = 1.4826
# Left out with them, before and after, and the shortest part that is kept, in spans of the mean.
_BEFORE, _AFTER, _LEAST = 0.35, 0.7, 8.0


def undisturbed(ship: Ship, trials: Sequence[Trial], span: float) -> tuple[Trial, ...]:
    """The trials without the seconds in which something else has pushed the ship, cut where they were.

    Args:
        ship: a ship that explains the trials about as well as it can.
        span: seconds over which its missing surge acceleration is averaged.

    Returns:
        A trial with nothing to leave out as it is; the parts of another as NAME_1, NAME_2, ...
    """
    kernel, parameters = Kernel(open_loop(ship)), open_loop_parameters(ship)
    missing: list[Array] = []
    for trial in trials:
        record = Record.of(trial, ship.model)
        state = np.hstack([record.state, record.hidden])
        surge = np.nan_to_num(beyond(kernel, parameters, trial.t, state, record.series)[:, 0])
        missing.append(_mean(np.append(0.0, surge), round(span / trial.dt)))
    usual = _ROBUST * float(np.median(np.abs(np.concatenate(missing))))
    return tuple(part for trial, mean in zip(trials, missing, strict=True)
                 for part in _parts(trial, np.abs(mean) > _LIMIT * usual, span))  # fmt: skip


def _mean(values: Array, rows: int) -> Array:
    return np.convolve(values, np.ones(max(rows, 1)) / max(rows, 1), "same")[: values.size]


def _parts(trial: Trial, pushed: NDArray[np.bool_], span: float) -> list[Trial]:
    """What is left of a trial, in parts that are long enough."""
    if not pushed.any():
        return [trial]
    out = np.zeros(len(trial), dtype=bool)
    for at in trial.t[pushed]:
        out |= (trial.t >= at - _BEFORE * span) & (trial.t <= at + _AFTER * span)
    edges = np.flatnonzero(np.diff(np.concatenate([[True], out, [True]]).astype(int)))
    runs = [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    kept = [trial.rows(run) for run in runs if trial.t[run.stop - 1] - trial.t[run.start] >= _LEAST * span]
    return [replace(part, name=f"{trial.name}_{k + 1}") for k, part in enumerate(kept)]
