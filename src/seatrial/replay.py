"""Free-run prediction of a measured trial from its own controls and wind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .approach import substeps
from .data import Array, DataError, Trial, unwrapped
from .data.prepare import resampling
from .engine import SimulationError
from .engine.rollout import simulator
from .environment import CHANNELS
from .models import STATES, Model, Sampled, Stepped, follows
from .models.settled import unseen
from .replay_gaps import VECTORS, logged, wind_of
from .replay_start import smoothed_starts
from .ships import Ship
from .simulate import SIMULATED
from .systems import open_loop, open_loop_memory, open_loop_parameters


def inputs(trial: Trial, model: Model) -> Array:
    """What acts from each row to the next, shape (rows, controls + 8): controls and environment.

    Controls act with the mean of the two rows, which is exact for the ramp of an actuator; those that the
    trial's `meta["held"]` names, and the environment, hold from row to row.  Gaps hold the last value
    before them (`replay_gaps` tells where).  A control that the trial lacks is taken from the order it follows
    (alpha_1 from delta).  A wind that was logged as apparent only is turned into the true one by the measured
    motion.  Wind, waves and current that were not logged, or without a value in any row, are
    none, and water without a depth is deep.

    Raises:
        DataError: the trial lacks a control, or the wind that a network takes.
    """
    n = len(model.controls)
    wind = wind_of(trial)
    lacking = [name for name in getattr(model, "needed", ()) if not logged(trial, name)] if wind is None else []
    if lacking and trial.meta.get("source") != SIMULATED:  # which says so where there was any wind
        wanted = "the network takes the wind; log it, or take a network without (wind = false)"
        raise DataError(f"{trial.name}: no values of {', '.join(lacking)}; {wanted}")
    series = np.zeros((len(trial), n + len(CHANNELS)))
    for k, (name, (order, factor)) in enumerate(zip(model.controls, follows(model), strict=True)):
        if name not in trial and order not in trial:
            raise DataError(f"{trial.name}: no channel {name}; the model needs {', '.join(model.controls)}")
        source, factor = (name, 1.0) if name in trial else (order, factor)
        if not logged(trial, source):
            raise DataError(f"{trial.name}: {source} has no value in any row; the model is steered by it")
        series[:, k] = factor * trial[source]
    around = {name: n + k for k, name in enumerate(CHANNELS)}
    for first, (size, direction) in VECTORS.items():
        if first != "wind_x" and logged(trial, size) and logged(trial, direction):
            at = around[first]
            series[:, at] = trial[size] * np.cos(trial[direction])
            series[:, at + 1] = trial[size] * np.sin(trial[direction])
    if wind is not None:
        series[:, n], series[:, n + 1] = wind
    if logged(trial, "T_W"):
        series[:, around["wave_T"]] = trial["T_W"]
    if logged(trial, "depth"):
        series[:, around["per_depth"]] = 1.0 / trial["depth"]
    series = held(series)
    kept = trial.meta.get("held", ())
    ramps = [k for k, name in enumerate(model.controls) if name not in kept and not isinstance(model, Sampled)]
    series[:-1, ramps] = 0.5 * (series[:-1, ramps] + series[1:, ramps])
    return series


def held(series: Array) -> Array:
    """Each gap filled with the last value before it (the first after it, at the start)."""
    out = series.copy()
    for column in out.T:
        good = np.flatnonzero(np.isfinite(column))
        if good.size and good.size < column.size:
            before = np.searchsorted(good, np.arange(column.size), "right") - 1
            column[:] = column[good[np.clip(before, 0, None)]]
    return out


def replay(
    ship: Ship, trial: Trial, *, restart: float | None = None, method: str = "rk4",
    smooth_start: float | None = None, threads: int | None = None,
) -> Trial:  # fmt: skip
    """Free-run prediction of `trial` from its own controls and wind, on its own rows.

    By the Runge-Kutta method unless Euler's is asked for, in as many steps from row to row as the ship needs
    (`approach.substeps`).  Every `restart` seconds the state is set back to the measured one (at the first
    complete sample from there on).  Rows run from the first complete sample to the last.  Inputs hold between rows;
    uneven time is predicted on an even grid of the median step and read off at the rows.  A network starts
    with what it remembers of the measured rows before; where there are none, as if the first had held.
    With `smooth_start` each start is estimated from the readings of so many seconds up to it (`replay_start`).

    Raises:
        DataError: a channel is missing, no row is complete, or there are fewer than a network looks back on.
        SimulationError: the prediction blows up; names time and state.
    """
    measured = trial.stack(*STATES)
    measured[:, 2] = unwrapped(measured[:, 2])
    good = np.asarray(np.isfinite(measured).all(axis=1))
    if good.sum() < 2:
        found = f"{int(good.sum())} complete rows of {', '.join(STATES)}"
        raise DataError(f"{trial.name}: {found}; two are needed")
    rows = slice(int(np.argmax(good)), int(len(good) - np.argmax(good[::-1])))
    t, state, good, series = trial.t[rows], measured[rows], good[rows], inputs(trial, ship.model)[rows]
    dt = _step(ship, t, trial)
    starts = _starts(t, good, restart, dt)
    remembered = _recalled(ship, trial, t, dt, np.column_stack([state, series]), good, starts)
    ends = [*starts[1:], t.size]
    spans = [t[min(b, t.size - 1)] - t[a] for a, b in zip(starts, ends, strict=True)]
    steps = round(max(spans) / dt) + 1
    lanes = np.empty((len(starts), steps, series.shape[1]))
    for lane, a in enumerate(starts):
        at = np.searchsorted(t, t[a] + dt * np.arange(steps) + 1e-6 * dt, "right") - 1
        lanes[lane] = series[np.clip(at, 0, t.size - 1)]
    system = open_loop(ship)
    first = state[starts] if smooth_start is None else smoothed_starts(t, state, starts, smooth_start)
    begun = np.hstack([first, unseen(ship.model, series, dt)[starts]])
    each = substeps(ship, dt, method)
    run = simulator(system).run(
        begun, np.repeat(lanes, each, axis=1), open_loop_parameters(ship), dt=dt / each, every=each,
        steps=(steps - 1) * each + 1, method=method, threads=threads,
        memory0=open_loop_memory(ship, begun, lanes[:, 0, : len(ship.model.controls)])
        if remembered is None else remembered,
    )  # fmt: skip
    out = np.empty_like(state)
    for lane, (a, b) in enumerate(zip(starts, ends, strict=True)):
        for k in range(out.shape[1]):
            out[a:b, k] = np.interp(t[a:b] - t[a], run.t, run.values[lane, :, k])
        if not np.isfinite(out[a:b]).all():
            failed = next(f for f in run.failures if f.lane == lane)
            raise SimulationError(
                f"{trial.name}: {failed.state} = {failed.value:g} at t = {t[a] + failed.time:g} s; "
                "the model blows up"
            )
    meta = {**trial.meta, "source": f"predicted by {ship.name}", "restart": restart}
    return Trial(trial.name, t, {n: out[:, k] for k, n in enumerate(STATES)}, meta=meta)


def _step(ship: Ship, t: Array, trial: Trial) -> float:
    """Time step of the prediction [s]: the trial's median one, which a sampled model must share."""
    dt = float(np.median(np.diff(t)))
    if isinstance(ship.model, Sampled) and abs(dt / ship.model.dt - 1) > 0.01:
        raise DataError(
            f"{trial.name}: sampled every {dt:g} s; {ship.name} runs at {ship.model.dt:g} s only; "
            f"fit the model at that step, or {resampling(float(ship.model.dt), trial)}"
        )
    return ship.model.dt if isinstance(ship.model, Sampled) else dt


def _recalled(
    ship: Ship, trial: Trial, t: Array, dt: float, rows: Array, good: NDArray[np.bool_], starts: list[int]
) -> Array | None:
    """What a stepped model remembers at each start, from the complete rows just before it; else None.

    Args:
        rows: states, controls and environment per row.
    """
    model = ship.model
    if not isinstance(model, Stepped):
        return None
    if len(t) < model.look_back + 2:
        needs = f"{ship.name} looks {model.look_back * dt:g} s back and needs {model.look_back + 2}"
        raise DataError(f"{trial.name}: {len(t)} rows are too short a record; {needs}")
    found: list[tuple[float, ...]] = []
    for a in starts:
        before = t[a] - dt * np.arange(model.look_back, 0, -1) + 1e-6 * dt
        at = np.searchsorted(t, before, "right") - 1
        broken = np.flatnonzero((at < 0) | ~good[at])
        at = at[broken[-1] + 1 :] if broken.size else at
        past = rows[at]
        found.append(model.recall(past[:, :6], past[:, 6:]) if at.size else model.begin((), ()))
    return np.array(found)


def _starts(t: Array, good: NDArray[np.bool_], restart: float | None, dt: float) -> list[int]:
    """Rows at which the prediction starts anew: the first, then the first good one of each interval."""
    if restart is None:
        return [0]
    number = np.floor((t - t[0] + 1e-6 * dt) / restart)
    edges = [0, *(np.flatnonzero(np.diff(number)) + 1).tolist()]
    found: list[int] = []
    for a in edges:
        later = np.flatnonzero(good[a:])
        row = a + int(later[0]) if later.size else a
        if row not in found and row < t.size - 1:
            found.append(row)
    return found
