"""Gauss-Newton steps from a point that a search has found, on windows cut in any way, and the fit at an optimum."""

from __future__ import annotations

import numpy as np

from ...core.values import dataclass, replace
from ...data import Array
from .. import Fit, FitError, Problem
from ..nuisance import EVERY
from ..posterior.verdicts import judged
from .gauss_newton import State, minimise
from .objective import TrajectoryObjective

# Information on a parameter over that of its interval, below which noise alone has moved it.
_NONE = 1e-2
# As the defaults of `Trajectory`.
WINDOW, _ITERATIONS, _TOLERANCE = 100.0, 40, 1e-4


@dataclass(frozen=True)
class Cut:
    """How trajectories are cut, integrated and compared, as of `record.Settings`; fields as of `Trajectory`."""

    window: float | None
    every: int | None
    dt: float | None
    method: str
    threads: int | None
    initial: str


def local(problem: Problem, settings: Cut) -> Fit:
    """The fit that Gauss-Newton steps reach from the declared start.

    Raises:
        FitError: the model blows up at the start.
    """
    objective = TrajectoryObjective.like(problem, settings)
    p, eta = objective.extended(problem.vector.start, begun=True), np.zeros(objective.nuisances)
    state = State(p, eta, objective.cost(p, eta))
    if not np.isfinite(state.cost):
        raise FitError("the model blows up; " + objective.failure(state.p))
    end = minimise(
        objective, state, *objective.bounds(), iterations=_ITERATIONS, tolerance=_TOLERANCE, each=lambda _: None
    )
    fit = finished(problem, objective, end.p, end.eta, np.zeros((0, 4)), end.evaluations, end.done, "")
    return replace(fit, objective=end.cost)


def finished(
    problem: Problem, objective: TrajectoryObjective, p: Array, eta: Array, history: Array,
    evaluations: int, status: str, print_: str,
) -> Fit:  # fmt: skip
    """The fit at `p`, found by any search: covariance and verdicts from the exact normal equations there."""
    layout, count = objective.layout, len(problem.free)
    p = _without_chance(problem, objective, p, eta)
    nuisances = layout.own.by_trial(problem.trials, layout.of_trials(eta))
    if objective.common:
        nuisances = {**nuisances, EVERY: dict(zip(problem.nuisance.common, p[count:].tolist(), strict=True))}
    return judged(
        problem, p[:count], objective.normal(p, eta).first(count), objective.variance(p, eta), history=history,
        seconds=0.0, evaluations=evaluations, status=status, digest=print_, nuisances=nuisances,
    )  # fmt: skip


def _without_chance(problem: Problem, objective: TrajectoryObjective, p: Array, eta: Array) -> Array:
    """The values with those at their start on which the data have no influence: noise takes them to any bound.

    Kept as they are where the objective rises by more than one for each, the residuals being of unit variance.
    """
    vector, count = problem.vector, len(problem.free)
    variance = max(objective.variance(p, eta), 1e-200)
    H, _ = objective.normal(p, eta).first(count).reduced(0.0)
    told = np.maximum(np.diag(H - vector.precision), 0.0) / variance * vector.reach(vector.start) ** 2
    silent = np.append((told < _NONE) & np.isinf(vector.sigma), np.zeros(p.size - count, dtype=bool))
    back = np.where(silent, objective.extended(vector.start), p)
    rises = objective.cost(back, eta) - objective.cost(p, eta) if silent.any() else 0.0
    return back if rises < variance * silent.sum() else p
