"""Uncertainty of predictions: an ensemble of fits to repetitions of the trials, and prediction bands.

A parametric bootstrap (Efron and Tibshirani 1993, chapter 6): the trials are simulated again with the fitted ship,
every repetition with its own noise on the samples and on the initial states of the predictions, and all are
fitted in one batch.  The spread of these fits within the box is the uncertainty that the data leave.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core.executors import Pool, parted
from ..core.parameters import Free
from ..core.values import dataclass, replace
from ..data import Array, DataError, Trial
from ..identify import Fit, FitError, Loss, Problem
from ..identify.posterior.misfit import white
from ..identify.record import Settings, windows
from ..identify.trajectory.objective import Data, Ends, TrajectoryObjective
from ..identify.vector import Vector
from ..models import STATES
from ..ships import Ship
from ..simulate.approach import substeps
from ..simulate.lanes import Kernel, Lanes, run
from ..simulate.loop import open_loop, open_loop_parameters

_TOLERANCE = 1e-7


@dataclass(frozen=True)
class Ensemble:
    """Fits to repetitions of the data.

    Attributes:
        ship: the fitted one.
        free: the parameters.
        values: shape (members, free).
        objectives: of each member on its own repetition, shape (members,).
        objective: of the fit on the data.
        noise: deviation of each state's noise.
        settings: how trajectories are integrated.
    """

    ship: Ship
    free: tuple[Free, ...]
    values: Array
    objectives: Array
    objective: float
    noise: Mapping[str, float]
    settings: Settings

    @property
    def excess(self) -> float:
        """Objective of the fit over that of a typical repetition: 1 where the model is as good as its fit."""
        return self.objective / max(float(np.median(self.objectives)), 1e-300)

    @property
    def surpassed(self) -> float:
        """Share of the repetitions whose objective is at least the fit's: small where the model lacks something."""
        return float((self.objectives >= self.objective).mean())


@dataclass(frozen=True)
class Bands:
    """A trial as simulated with every member.

    Attributes:
        trial: the trial whose controls and environment were used.
        t: shape (rows,).
        states: shape (members, rows, 6).
        best: of the fit itself, shape (rows, 6).
        indices: of each member by name, shape (members,); NaN where a member does not reach it.
        fitted: of the fit itself.
        measured: of the trial as it was recorded.
        units: of the indices.
    """

    trial: Trial
    t: Array
    states: Array
    best: Array
    indices: Mapping[str, Array]
    fitted: Mapping[str, float]
    measured: Mapping[str, float]
    units: Mapping[str, str]

    def band(self, state: str, level: float = 0.95) -> tuple[Array, Array]:
        """Lower and upper edge of a state at each row."""
        edges = np.quantile(self.states[:, :, STATES.index(state)], _edges(level), axis=0)
        return edges[0], edges[1]

    def interval(self, index: str, level: float = 0.95) -> tuple[float, float]:
        """Lower and upper edge of an index; NaN where no member reaches it."""
        values = self.indices[index][np.isfinite(self.indices[index])]
        if not values.size:
            return float("nan"), float("nan")
        low, high = np.quantile(values, _edges(level))
        return float(low), float(high)


def _edges(level: float) -> tuple[float, float]:
    return 0.5 * (1.0 - level), 0.5 * (1.0 + level)


def ensemble(
    fit: Fit, problem: Problem, settings: Settings, *,
    members: int = 100, noise: Mapping[str, float] | None = None, seed: int = 0, pool: Pool | None = None,
) -> Ensemble:  # fmt: skip
    """Fits of repetitions of the trials, all in one batch.

    Args:
        fit: the optimum.
        problem: the problem that was fitted, without nuisance parameters.
        settings: how trajectories were cut and compared; the estimator that made the fit.
        members: number of repetitions.
        noise: standard deviation of each measured state's noise; None estimates it (`white`).
        seed: of the noise.
        pool: who fits the members, with the same numbers; None does it here.

    Raises:
        StudyError: the problem has nuisances.
        FitError: fewer than half of the repetitions can be fitted.
    """
    objective, rng = TrajectoryObjective.plain(problem, settings), np.random.default_rng(seed)
    level = white(fit, problem, settings) if noise is None else dict(noise)
    motion = problem.ship.model.motion
    sigma = np.array([level.get(name, 0.0) for name in motion])
    clean, cut = objective.predicted(fit.values), objective.windows
    state0 = np.repeat(cut.state0[None], members, axis=0)
    shape = (members, cut.state0.shape[0], cut.width)
    state0[:, :, : cut.width] = clean[:, 0] + sigma * rng.standard_normal(shape)
    measured = clean[None] + sigma * rng.standard_normal((members, *clean.shape))
    measured[:, :, 0] = state0[:, :, : cut.width]
    vector = problem.vector
    data, starts = Data(state0, measured, vector.of_prior(members, rng)), np.repeat(fit.values[None], members, axis=0)
    if pool is None:
        ends = replace(objective, data=data).descend(starts, tolerance=_TOLERANCE)
    else:
        parts = (np.arange(part.start, part.stop) for part in parted(members, pool))
        pieces = ((problem, settings, starts[part], data.of(part)) for part in parts)
        ends = Ends.joined(list(pool.ordered(_refitted, pieces)))
    good = np.isfinite(ends.costs)
    if good.sum() < 0.5 * members:
        raise FitError(f"{int((~good).sum())} of {members} repetitions cannot be simulated with the noise given")
    return Ensemble(fit.ship, problem.free, ends.values[good], ends.data[good],
                    float(objective.best(fit.values[None]).data[0]), level, settings)  # fmt: skip


def _refitted(problem: Problem, settings: Settings, starts: Array, data: Data) -> Ends:
    objective = replace(TrajectoryObjective.plain(problem, settings), data=data)
    return objective.descend(starts, tolerance=_TOLERANCE)


def bands(group: Ensemble, trial: Trial, manoeuvre: Any = None) -> Bands:
    """A trial simulated with every member from its first complete state, under its own controls and environment.

    Args:
        group: the members.
        trial: measured, or simulated for a manoeuvre not run yet.
        manoeuvre: reads the indices off each run, as `Turning` does; None reads none.

    Raises:
        DataError: the trial has no complete rows.
    """
    dt = group.settings.dt or float(np.median(np.diff(trial.t)))
    cut = windows((trial,), group.ship.model, Loss(correlation=0.0), dict.fromkeys(STATES, 1.0),
                  window=trial.duration, dt=dt, every=1,
                  substeps=substeps(group.ship, dt, group.settings.method))  # fmt: skip
    if cut.state0.shape[0] != 1:
        raise DataError(f"{trial.name}: its complete rows fall apart into {cut.state0.shape[0]} runs; give one")
    vector, system, shared = Vector.of(group.free), open_loop(group.ship), open_loop_parameters(group.ship)
    lanes = np.vstack([shared[vector.positions(system.parameters)], group.values])
    state0, series = (np.repeat(one, len(lanes), axis=0) for one in (cut.state0, cut.series))
    many = Lanes(Kernel(system, vector.paths), shared, state0, series, lanewise=lanes)
    states = run(many, cut.grid(group.settings.method), threads=group.settings.threads).values[:, :, : len(STATES)]
    t = trial.t[0] + dt * np.arange(states.shape[1])
    read = [] if manoeuvre is None else [_indices(trial, t, one, manoeuvre, group.ship.L_pp) for one in states]
    found = sorted({name for one in read for name in one})
    values = {name: np.array([one[name].value if name in one else np.nan for one in read]) for name in found}
    return Bands(
        trial, t, states[1:], states[0],
        {name: own[1:] for name, own in values.items()}, {name: float(own[0]) for name, own in values.items()},
        {} if manoeuvre is None else {n: i.value for n, i in manoeuvre.indices(trial, group.ship.L_pp).items()},
        {name: next(one[name].unit for one in read if name in one) for name in found},
    )  # fmt: skip


def _indices(trial: Trial, t: Array, states: Array, manoeuvre: Any, L_pp: float) -> Mapping[str, Any]:
    controls = {n: np.interp(t, trial.t, trial[n]) for n in trial.channels if n not in STATES}
    channels = {name: states[:, k] for k, name in enumerate(STATES)} | controls
    return manoeuvre.indices(Trial(trial.name, t, channels, trial.units, trial.meta), L_pp)
