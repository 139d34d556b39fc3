"""Indices of many runs: from the last row of a tally, or from stored runs by the manoeuvre itself."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..core.parameters import update
from ..data import Array, DataError, Trial
from ..manoeuvres import Index, Manoeuvre
from ..simulate.lanes import Judge, Steps, run, steered
from ..simulate.run import recorded, scheduled
from . import CampaignError, Case
from .tallies import Tally
from .tracks import Column, Tracks

# Runs are stored in groups of so many numbers: 64 MB.
_STORED = 8_000_000
# A run of fewer samples has no figures.
_LEAST = 3


def figures(tally: Tally, stored: Sequence[str], rows: Array, vary: Mapping[str, Array]) -> dict[str, Array]:
    """Indices of a tally from the last row of each run, with `failed` and `complete`.

    Args:
        stored: names of the columns of `rows`, shape (runs, columns).
        vary: inputs per run.
    """
    own = len(tally.memory) - len(tally.noted)
    first = len(stored) - _after(tally, stored)
    memory = {name: rows[:, first + own + k] for k, name in enumerate(tally.noted)}
    failed = rows[:, first + own - 1]
    varied = {name[7:]: column for name, column in vary.items() if name.startswith("policy.")}
    found = {name: np.asarray(column) for name, column in tally.read(memory, varied).items()}
    over = np.where(failed >= 0, failed, np.nan)
    return {**found, "failed": over, "complete": tally.finished(memory, varied).astype(np.float64)}


def _after(tally: Tally, stored: Sequence[str]) -> int:
    """Number of columns from the first of the manoeuvre's memory on: memory, then logged orders."""
    orders = sum(name.endswith("_cmd") for name in stored)
    return len(tally.memory) + orders


def whole_indices(
    case: Case, names: Sequence[str], vary: Mapping[str, Array], start: Array, around: Array, lanes: int, steps: int,
    threads: int, tracks: Tracks | None = None,
) -> tuple[dict[str, Array], dict[str, Column]]:  # fmt: skip
    """Indices of stored runs by `Manoeuvre.indices`, with `failed` and `complete`; their tracks, shape (lanes, rows).

    Args:
        names: of the indices, see `usual_units`.
        start: initial states, shape (lanes or 1, 6).
        around: weather, shape (lanes or 1, steps or 1, 8).
    """
    found = {name: np.full(lanes, np.nan) for name in (*names, "failed", "complete")}
    kept: dict[str, Column] = {}
    if tracks is not None:
        shape = lanes, tracks.rows(steps)
        kept = {name: np.full(shape, np.nan, tracks.type) for name in tracks.names(case.ship, case.manoeuvre)}
    group = max(_STORED // (steps * (len(case.ship.model.controls) * 4 + 16)), 1)
    for low in range(0, lanes, group):
        high = min(low + group, lanes)
        own = {name: column[low:high] for name, column in vary.items()}
        at, wind = (part[low:high] if len(part) > 1 else part for part in (start, around))
        for lane, (those, trial) in enumerate(_read(case, own, at, wind, high - low, steps, threads), low):
            for name in found.keys() & those.keys():
                found[name][lane] = those[name]
            for name, column in kept.items():
                samples = trial[name][:: tracks.every if tracks else 1]
                column[lane, : len(samples)] = samples
    return found, kept


def usual_units(case: Case, around: Array, steps: int) -> dict[str, str]:
    """Indices that a run of the case without any change has, whatever its file calls valid, with their units.

    Raises:
        CampaignError: it has none.
    """
    start, free = np.array([[0.0, 0.0, 0.0, case.speed, 0.0, 0.0]]), replace(case, ship=replace(case.ship, validity={}))
    policy, trial, _ = next(sailed(free, {}, start, around, 1, steps, 1))
    found = _figures(policy, trial, case.ship.L_pp)
    if not found:
        raise CampaignError(f"{case.name}: a run of {case.duration:g} s has no index; give a longer duration")
    return {name: index.unit for name, index in found.items()}


def _read(
    case: Case, vary: Mapping[str, Array], start: Array, around: Array, lanes: int, steps: int, threads: int
) -> Iterator[tuple[dict[str, float], Trial]]:
    """Indices of each run, with when it failed and whether it is complete, and the run."""
    for policy, trial, failed in sailed(case, vary, start, around, lanes, steps, threads):
        yield {**_indices(policy, trial, case.ship.L_pp), "failed": failed}, trial


def sailed(
    case: Case, vary: Mapping[str, Array], start: Array, around: Array, lanes: int, steps: int, threads: int
) -> Iterator[tuple[Manoeuvre, Trial, float]]:
    """Each run as a trial, up to where it failed, with its manoeuvre and when it failed [s] (NaN: it did not)."""
    policy, series = case.manoeuvre, scheduled(case.manoeuvre, around, case.dt, steps)
    ready = steered(case.ship, policy, case.dt, vary, start, series, lanes, case.device, case.precision)
    done = run(ready, Steps(case.dt, steps, method=case.method), Judge.of(case.ship, around, 1), threads)
    failed = {failure.lane: failure.time for failure in done.failures}
    for lane in range(lanes):
        changes = {name[7:]: float(column[lane]) for name, column in vary.items() if name.startswith("policy.")}
        end = round(failed[lane] / case.dt) if lane in failed else steps
        own = update(policy, changes)
        here = around[min(lane, len(around) - 1), : max(end, 1)]
        trial = recorded(case.ship, own, done.t[:end], done.values[lane, :end], here, dt=case.dt)
        yield own, trial, failed.get(lane, math.nan)


def _indices(policy: Manoeuvre, trial: Trial, L_pp: float) -> dict[str, float]:
    """Indices of one run, with `complete` (0 or 1); none of a run that is over before it began."""
    found = _figures(policy, trial, L_pp)
    if found is None:
        return {"complete": 0.0}
    return {**{name: index.value for name, index in found.items()}, "complete": float(policy.complete(trial))}


def _figures(policy: Manoeuvre, trial: Trial, L_pp: float) -> Mapping[str, Index] | None:
    """Indices of one run; None of a run that is over before it began."""
    try:
        return policy.indices(trial, L_pp) if len(trial) >= _LEAST else None
    except DataError:
        return None
