"""Log density of the posterior of a fit, and its gradient, of many values in one call of the kernel.

The same posterior that Laplace's covariance approximates: squared residuals over sigma, divided by one factor for all
(what the residuals of the fit say sigma was wrong by), and the prior, within the bounds.  Estimated starts of windows
are integrated out about their best for each value (Tierney and Kadane 1986).
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...data import Array
from ...identify import Fit, Problem, StudyError
from ...identify.nuisance import held
from ...identify.posterior.verdicts import posterior
from ...identify.trajectory.batch import Data, Many
from ...identify.trajectory.gauss_newton import Normal
from ...simulate.lanes import slopes

# Scaled curvature below which a direction has neither data, prior nor bounds.
_FLAT = 1e-11
# Search for the factor: its range about the start, and halvings.
_RANGE, _HALVINGS = 1e20, 80


@dataclass(frozen=True)
class Density:
    """A posterior that can be evaluated.

    Attributes:
        many: the objective.
        variance: factor that divides the squared residuals.
        data: data of each lane in place of the trials (of repetitions); None takes the trials.
    """

    many: Many
    variance: float = 1.0
    data: Data | None = None

    def __call__(self, values: Array) -> tuple[Array, Array]:
        """Log density, but for a constant, shape (lanes,), and its gradient, shape (lanes, free)."""
        vector = self.many.problem.vector
        mean, weight = vector.mean if self.data is None else self.data.mean, vector.precision
        away = values - mean
        squares, slope = self._with_starts(values) if self.many.begun else self._plain(values)
        density = -0.5 * (squares / self.variance + (weight * away**2).sum(axis=1))
        gradient = -(slope / self.variance + weight * away)
        return np.where(np.isfinite(density), density, -np.inf), gradient

    def _with_starts(self, values: Array) -> tuple[Array, Array]:
        """Squared residuals at the best starts, with the volume that these leave, and their halved slope."""
        vector = self.many.problem.vector
        away = values - (vector.mean if self.data is None else self.data.mean)
        with np.errstate(all="ignore"):
            found, _ = self.many.settled(values, self.data)
        known, volume = np.isfinite(found.cost), np.zeros(len(values))
        volume[known] = np.linalg.slogdet(found.blocks[0].own[known])[1].sum(axis=1)
        squares = found.cost - (vector.precision * away**2).sum(axis=1) + self.variance * volume
        return squares, found.reduced()[1] - vector.precision * away

    def _plain(self, values: Array) -> tuple[Array, Array]:
        """Squared residuals and their halved slope, one problem a call of the kernel; no normal equations are made."""
        many, cut = self.many, self.many.windows
        states, lanes = list(many.compared), self.many.windows.state0.shape[0]
        packed = many.kernel.pack(cut.series) if many.chunk != 1 else many.packed

        def one(k: int) -> tuple[float, Array]:
            state0 = cut.state0 if self.data is None else self.data.state0[k]
            measured = cut.measured if self.data is None else self.data.measured[k]
            runs = many.lanes(state0, packed, np.repeat(values[k : k + 1], lanes, axis=0))
            run, columns = slopes(runs, many.grid, threads=1)
            scale = cut.scale[:, :, states]
            with np.errstate(all="ignore"):
                e = np.where(scale > 0, (run[:, :, states] - measured[:, :, states]) * scale, 0.0)
                back = np.zeros(run.shape)
                back[:, :, states] = e * scale
                slope = back.ravel() @ columns.reshape(-1, columns.shape[-1])
                return float((e * e).sum()), slope[: values.shape[1]]

        with ThreadPoolExecutor(many.threads) as pool:
            found = list(pool.map(one, range(len(values))))
        return np.array([squares for squares, _ in found]), np.array([slope for _, slope in found])

    def laplace(self, values: Array) -> Array:
        """Covariance of Laplace's approximation at each value, shape (lanes, free, free)."""
        found, free = self.many.normals(values, self.data), self.many.problem.free
        return np.stack([posterior(found.of(k), free, one, self.variance)[0] for k, one in enumerate(values)])


def density_of(fit: Fit, problem: Problem, settings: Any) -> Density:
    """The posterior that the covariance of a fit approximates.

    Its factor is the one by which Laplace's sigmas at the fit are, on average, those of the fit: where the residuals
    have widened these, the likelihood counts for as much less (a power posterior, Holmes and Walker 2017).

    Raises:
        StudyError: an estimator or a problem whose posterior is not sampled; the reason and the remedy in one line.
    """
    _accept(fit, problem, settings)
    many = Many.like(problem, settings)
    found = many.normals(fit.values[None])
    if not np.isfinite(found.cost[0]):
        raise StudyError("the model blows up at the fitted values; there is no posterior to draw from")
    normal, wanted = found.of(0), np.log(fit.sigma).mean()
    check_proper(normal, problem)
    low, high = -np.log(_RANGE), np.log(_RANGE)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        covariance, _ = posterior(normal, problem.free, fit.values, float(np.exp(middle)))
        low, high = (middle, high) if 0.5 * np.log(np.diag(covariance)).mean() < wanted else (low, middle)
    return Density(many, float(np.exp(0.5 * (low + high))))


def _accept(fit: Fit, problem: Problem, settings: Any) -> None:
    """Refuse what is not sampled."""
    if not all(hasattr(settings, name) for name in ("window", "every", "dt", "method", "threads")):
        raise StudyError(f"estimator {type(settings).__name__} compares no trajectories; its posterior is not sampled; "
                         "use shooting:Trajectory")  # fmt: skip
    if getattr(settings, "stride", None) is not None:
        raise StudyError("estimator.stride: windows that overlap count samples twice; leave it out to sample")
    if held(problem) or problem.nuisance.suspects:
        raise StudyError("[nuisance] current, bias, common and suspects are not sampled; only initial is; "
                         "Laplace's covariance counts them")  # fmt: skip
    if not (np.isfinite(fit.sigma).all() and (fit.sigma > 0).all()):
        raise StudyError("the fit has no covariance, from which the chains start; use shooting:Trajectory")


def check_proper(normal: Normal, problem: Problem) -> None:
    """Refuse a posterior that cannot be normalised: a direction that nothing limits.

    A bounded parameter counts as having the prior that is as wide as its bounds.
    """
    vector = problem.vector
    with np.errstate(divide="ignore"):
        boxed = np.where(np.isfinite(vector.high - vector.low), (vector.high - vector.low) ** -2.0, 0.0)
    whole = normal.H + np.diag(boxed)
    size = np.sqrt(np.maximum(np.diag(whole), 0.0))
    scaled = whole / np.where(size > 0, size, 1.0) / np.where(size > 0, size, 1.0)[:, None]
    weight, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    if weight[0] > _FLAT:
        return
    part = np.abs(vectors[:, 0])
    names = [path for path, one in zip(vector.paths, part, strict=True) if one > 0.2 * part.max()]
    raise StudyError(f"nothing limits {' and '.join(names)}: neither data, prior nor bounds, so there is no posterior; "
                     "give a prior or bounds in [free]")  # fmt: skip


