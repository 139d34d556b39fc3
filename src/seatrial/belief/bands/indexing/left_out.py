"""Errors of manoeuvre indices on left-out trials.

The manoeuvre of each left-out turn and zigzag is sailed again in closed loop by the fit that has not seen it, from its
measured state at the execute, and its indices are held against those of the trial.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ....data import Array, DataError, Trial
from ....manoeuvres import Manoeuvre
from ....manoeuvres.reading import after
from ....manoeuvres.told import seen
from ....manoeuvres.zigzag import Zigzag
from ....models import STATES
from ....ships import Ship
from ....ships.steering import by_angle
from ....simulate.approach import time_step
from ....simulate.replay import prepared
from ...parts import LeftOut
from ..disturbance import Disturbance
from .loop import Loop
from .scores import LeftIndices

_DRAWS, _ROWS, _SEED = 100, 400, 1
# Indices that a wind on the day or the start of the logger does not decide.
_READ = ("advance", "transfer", "tactical_diameter", "steady_diameter", "first_overshoot", "second_overshoot",
         "third_overshoot", "fourth_overshoot", "initial_turning_distance", "initial_turning_time", "period", "time_90",
         "time_180", "speed_loss", "drift", "heel")  # fmt: skip
# A manoeuvre gets so much more time than its trial took: draws may be slower.
_MARGIN = 1.3


def left_indices(parts: Sequence[tuple[LeftOut, Disturbance]], of: dict[str, str]) -> LeftIndices | None:
    """Errors and spreads of all indices of the left-out trials; None where no trial has any.

    Args:
        parts: fits with the trials that they have not seen, and what the model lacks by the trials of the others.
        of: recording of each trial by name.
    """
    rows = [(of[trial.name], *row) for out, lacks in parts for trial in out.trials for row in _rows(out, lacks, trial)]
    if not rows:
        return None
    groups, kinds, names, error, spread = zip(*rows, strict=True)
    return LeftIndices(groups, kinds, names, np.array(error), np.array(spread))


def _rows(out: LeftOut, lacks: Disturbance, trial: Trial) -> Iterator[tuple[str, str, float, float]]:
    """Kind, index, error and spread of one left-out trial."""
    policy = seen(trial) if by_angle(out.held.ship) else None
    if policy is None:
        return
    angle = float(policy.delta) * (float(policy.side) if isinstance(policy, Zigzag) else 1.0)
    try:
        run = after(trial, angle)
        measured = _read(policy, run, out.held.ship.L_pp)
    except DataError:
        return
    predicted, drawn = _sailed(out, lacks, policy, run)
    for name, value in measured.items():
        own = np.array([one.get(name, np.nan) for one in drawn])
        reached = own[np.isfinite(own)]
        if name in predicted and len(reached) > len(own) // 2 and (spread := float(np.std(reached))) > 0.0:
            yield policy.kind, name, predicted[name] - value, spread


def _sailed(
    out: LeftOut, lacks: Disturbance, policy: Manoeuvre, run: Trial
) -> tuple[dict[str, float], list[dict[str, float]]]:
    """Indices by the fit itself, and by draws of it."""
    ship = out.held.ship
    ready = prepared(ship, run, restart=None)
    channels = ready.lanes.shape[2] - len(ship.model.controls)
    around = np.nanmean(ready.lanes[:1, :, -channels:], axis=1, keepdims=True)
    dt = time_step(ship)
    steps = max(round(_MARGIN * run.duration / dt), 10)
    every = max(steps // _ROWS, 1)
    start = np.array([ready.begun[0, : len(STATES)]])
    loop = Loop(ship, policy, dt, around, start, every, every * (steps // every) + 1)
    calm = Disturbance(tuple(replace(one, sigma=0.0) for one in lacks.processes))
    middle = loop.run(out.held.names, out.held.mean[None], calm, _SEED)
    drawn = loop.run(out.held.names, out.held.draws(_DRAWS, _SEED), lacks, _SEED)
    t = dt * every * np.arange(middle.shape[1])
    (own,), each = ([_figures(policy, ship, loop.stored, t, rows) for rows in some] for some in (middle, drawn))
    return own, each


def _figures(policy: Manoeuvre, ship: Ship, stored: Sequence[str], t: Array, rows: Array) -> dict[str, float]:
    """Indices of one run of the loop, as far as it stayed finite."""
    good = np.isfinite(rows).all(axis=1)
    last = len(t) if good.all() else int(good.argmin())
    if last < 3:
        return {}
    columns: dict[str, Any] = {name: rows[:last, k] for k, name in enumerate(stored)}
    orders = {name: columns[name] for name in ("delta", "delta_cmd") if name in columns}
    states = {name: columns[name] for name in STATES}
    return _read(policy, Trial("run", t[:last], {**states, **orders}), ship.L_pp)


def _read(policy: Manoeuvre, run: Trial, L_pp: float) -> dict[str, float]:
    try:
        found = policy.indices(run, L_pp)
    except DataError:
        return {}
    return {name: one.value for name, one in found.items() if name in _READ and np.isfinite(one.value)}
