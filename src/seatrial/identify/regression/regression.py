"""Least squares for what is linear in its parameters: one linear system, no search.

`Regression` fits a continuous model in integrated form: what the velocities change over a window is the
integral of the accelerations that the model gives along the measured motion.  Nothing is differentiated,
so noise enters by the ends of a window only.
"""

from __future__ import annotations

import hashlib
import math
import time
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core.symbolic import alone
from ...core.values import dataclass
from ...data import Array, DataError, Trial
from ...environment import CHANNELS, Environment
from ...models import STATES, Sampled
from ...simulate.replay import inputs
from .. import Fit, Problem, Progress, StudyError
from ..lint import linted
from ..posterior.verdicts import judged
from ..record import measured
from ..resume import digest
from ..trajectory.gauss_newton import Normal
from ..trajectory.shooting import OneStep, Trajectory
from ..vector import Vector
from ..watch import tell, with_values

VELOCITIES = STATES[3:]
"""The states whose rates the regression explains."""
# Passes over the weights of the channels; the second already knows the residuals.
_PASSES = 3


class Solution(NamedTuple):
    """Outcome of a linear least-squares problem.

    Attributes:
        values: the estimates, shape (n,).
        covariance: theirs, for independent errors of one size, shape (n, n).
        variance: of an error, per degree of freedom.
        rows: number of equations.
    """

    values: Array
    covariance: Array
    variance: float
    rows: int

    @property
    def sigma(self) -> Array:
        """Standard deviations of the estimates."""
        return np.sqrt(np.diag(self.covariance))


def least_squares(matrix: Array, right: Array) -> Solution:
    """The `values` that bring ``matrix @ values`` nearest to `right`.

    Raises:
        DataError: fewer equations than unknowns, or unknowns that the equations do not separate.
    """
    rows, n = matrix.shape
    if rows <= n:
        raise DataError(f"{rows} equations for {n} unknowns; give longer trials, or leave some out")
    size = np.sqrt(np.mean(matrix * matrix, axis=0))
    if np.any(size == 0.0) or np.linalg.matrix_rank(matrix / size) < n:
        raise DataError(f"the data do not separate the {n} unknowns: some are not excited, as by a control held")
    q, triangle = np.linalg.qr(matrix / size)
    values = np.linalg.solve(triangle, q.T @ right) / size
    residual = right - matrix @ values
    variance = float(residual @ residual) / (rows - n)
    inverse = np.linalg.inv(triangle)
    return Solution(values, variance * (inverse @ inverse.T) / np.outer(size, size), variance, rows)


def criteria(determinant: float, rows: int, unknowns: int) -> tuple[float, float]:
    """Akaike's and the Bayesian information criterion of a Gaussian regression; the smaller the better.

    Args:
        determinant: of the residuals' covariance (sum of squares over rows) over all equations.
        rows: samples per equation.
        unknowns: coefficients in all equations together.
    """
    fit = rows * math.log(max(determinant, 1e-300))
    return fit + 2.0 * unknowns, fit + unknowns * math.log(rows)


@dataclass(frozen=True)
class Regression:
    """Estimator for free parameters that enter the accelerations linearly (hull derivatives, not masses).

    Gaussian priors are honoured, bounds too.  Noise in the regressors themselves pulls estimates towards
    zero (smooth the trials first, or finish with `shooting:Trajectory`).

    Attributes:
        window: length of the windows over which accelerations are integrated [s].
    """

    window: float = 2.0

    def __post_init__(self) -> None:
        if not self.window > 0:
            raise StudyError(f"estimator.window is {self.window:g} s; it must be above zero")

    @property
    def compared_as(self) -> Trajectory:
        """Long predictions test it: the noise of the measured states, taken as exact, pulls the parameters."""
        return Trajectory()

    @property
    def regresses(self) -> bool:
        """As `OneStep.regresses`."""
        return True

    @linted
    def fit(self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None) -> Fit:
        """Estimate the free parameters of `problem`; there is nothing to resume, so `checkpoint` stays unused.

        Raises:
            StudyError: a free parameter does not enter linearly, or the model cannot be fitted this way.
            DataError: the trials lack a channel or hold too little.
        """
        began = time.perf_counter()
        slopes = _accelerations(problem)
        parts = zip(*(_windows(trial, problem, slopes, self.window) for trial in problem.trials), strict=True)
        matrix, right = (np.concatenate(part) for part in parts)
        return weighted_fit(problem, matrix, right, self, began, progress)


def weighted_fit(
    problem: Problem, matrix: Array, right: Array, estimator: Any, began: float, progress: Progress | None
) -> Fit:
    """A `Fit` from equations per channel, each channel weighed by the size of its residuals.

    Args:
        problem: the problem; its loss gives the scale of a channel where it names it.
        matrix: shape (rows, channels, free parameters).
        right: shape (rows, channels); the channels are u, v_m, r.
        estimator: for the digest; its `repr` must list its settings.
        began: time of `perf_counter` at the start.
        progress: called after each pass.
    """
    free = problem.free
    rows, channels, n = matrix.shape
    if rows * channels <= n:
        raise DataError(f"{rows} windows for {n} free parameters; give longer trials, or shorter windows")
    scale = np.maximum(np.std(right, axis=0), 1e-12)
    scale = np.array([problem.loss.sigma.get(name, s) for name, s in zip(VELOCITIES, scale, strict=True)])
    values, history = problem.vector.start, list[tuple[float, float, float, float]]()
    hessian, cost = np.eye(n), math.inf
    for turn in range(_PASSES):
        weighed = (matrix / scale[:, None]).reshape(-1, n)
        values, hessian, cost = _solve(weighed, (right / scale).ravel(), problem.vector)
        history.append((turn + 1.0, cost, math.nan, time.perf_counter() - began))
        tell(progress, (turn + 1, cost, math.nan), with_values(problem.ship, free, values))
        # Channels that the free parameters do not affect keep their scale: they carry no information.
        left = np.sqrt(np.mean((right - matrix @ values) ** 2, axis=0))
        scale = np.where(np.isin(VELOCITIES, list(problem.loss.sigma)), scale, np.maximum(left, 1e-9 * scale))
    touched = np.any(matrix != 0.0, axis=(0, 2))
    left = ((right - matrix @ values) / scale)[:, touched]
    variance = float(np.sum(left**2)) / max(left.size - n, 1)
    mark = hashlib.sha256((digest(problem, OneStep()) + repr(estimator)).encode()).hexdigest()[:16]
    return judged(
        problem, values, Normal(cost, hessian, np.zeros(n)), variance, history=np.array(history),
        seconds=time.perf_counter() - began, evaluations=_PASSES, status="solved: linear least squares", digest=mark,
    )  # fmt: skip


def _solve(matrix: Array, right: Array, vector: Vector) -> tuple[Array, Array, float]:
    """Estimates within bounds, Hessian with the priors, and the cost."""
    from scipy.optimize import lsq_linear

    held = np.isfinite(vector.sigma)
    known = np.linalg.cholesky(vector.precision[np.ix_(held, held)]).T @ np.eye(len(vector))[held]
    joined = np.vstack([matrix, known])
    aim = np.concatenate([right, known @ vector.mean])
    size = np.maximum(np.sqrt(np.mean(joined * joined, axis=0)), 1e-300)
    low, high = vector.low, vector.high
    found: Any = lsq_linear(joined / size, aim, bounds=(low * size, high * size), method="bvls")
    values = np.clip(found.x / size, low, high)
    residual = joined @ values - aim
    return values, joined.T @ joined, float(residual @ residual)


@alone
def _accelerations(problem: Problem) -> Any:
    """CasADi function (state, control, environment) -> accelerations at zero free parameters, and their slopes."""
    import casadi as ca

    model: Any = problem.ship.model
    if isinstance(model, Sampled) or len(model.states) != len(STATES):
        raise StudyError(
            f"{problem.ship.name}: regression needs a continuous model whose states are all measured; "
            "a sampled model is fitted by arx_fit:ArxRegression, others by shooting:Trajectory"
        )
    sizes = {"z": len(STATES), "c": len(model.controls), "e": len(CHANNELS), "p": len(problem.free)}
    z, c, e, p = (ca.SX.sym(name, size) for name, size in sizes.items())
    state, control, around = (ca.vertsplit(x) for x in (z, c, e))
    rates = problem.vector.model(model, p).derivative(tuple(state), tuple(control), Environment(*around))[3:]
    y = ca.vertcat(*(ca.SX(rate) for rate in rates))
    slopes = ca.jacobian(y, p)
    curved = ca.sum1(ca.jacobian(ca.vec(slopes), p) != 0)
    names = [path for k, path in enumerate(problem.vector.paths) if curved.nnz() and curved[0, k].nnz()]
    if names:
        raise StudyError(
            f"free: the accelerations are not linear in {', '.join(names[:6])}; hold them, or take shooting:Trajectory"
        )
    still = ca.substitute(y, p, ca.SX.zeros(p.shape))
    return ca.Function("slopes", [z, c, e], [still, slopes])


def _windows(trial: Trial, problem: Problem, slopes: Any, window: float) -> tuple[Array, Array]:
    """Equations of a trial: integrated slopes (windows, 3, free) and what they have to give (windows, 3)."""
    state = measured(trial)
    acting, dt = inputs(trial, problem.ship.model)[:-1], np.diff(trial.t)
    middle = 0.5 * (state[1:] + state[:-1])
    n = len(problem.ship.model.controls)
    whole = slopes.map(len(dt))
    still, slope = (np.array(m.full()) for m in whole(middle.T, acting[:, :n].T, acting[:, n:].T))
    still = still.reshape(3, len(dt)).T
    slope = slope.reshape(3, len(dt), -1).transpose(1, 0, 2)
    edges = np.unique(np.searchsorted(trial.t, np.arange(trial.t[0], trial.t[-1], window)))
    good = np.asarray(np.isfinite(state).all(axis=1))
    spans = [(a, b) for a, b in pairwise(edges.tolist()) if good[a : b + 1].all()]
    if not spans:
        raise DataError(f"{trial.name}: no window of {window:g} s without a gap")
    matrix = np.array([np.tensordot(dt[a:b], slope[a:b], axes=1) for a, b in spans])
    right = np.array([state[b, 3:] - state[a, 3:] - dt[a:b] @ still[a:b] for a, b in spans])
    return matrix, right

