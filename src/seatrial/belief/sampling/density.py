"""Log density of the posterior of a fit, and its gradient, of many values in one call of the kernel.

The same posterior that Laplace's covariance approximates: squared residuals over sigma, divided by one factor for all
(what the residuals of the fit say sigma was wrong by), and the prior, within the bounds.  Estimated starts of windows
are integrated out about their best for each value (Tierney and Kadane 1986).
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from ...core.values import dataclass
from ...data import Array
from ...engine.rollout import default_threads
from ...identify import Fit, Problem, StudyError
from ...identify.nuisance import held
from ...identify.posterior.verdicts import posterior
from ...identify.trajectory.gauss_newton import Normal
from ...identify.trajectory.objective import TrajectoryObjective

# Scaled curvature below which a direction has neither data, prior nor bounds.
_FLAT = 1e-11
# Search for the factor: its range about the start, and halvings.
_RANGE, _HALVINGS = 1e20, 80


@dataclass(frozen=True)
class Density:
    """A posterior that can be evaluated.

    Attributes:
        objective: of the trials, or of the data of repetitions, a lane each.
        variance: factor that divides the squared residuals.
    """

    objective: TrajectoryObjective
    variance: float = 1.0

    def __call__(self, values: Array) -> tuple[Array, Array]:
        """Log density, but for a constant, shape (lanes,), and its gradient, shape (lanes, free)."""
        away, drawn = self.objective.away(values, np.arange(len(values)))
        squares, slope = self._with_starts(values) if self.objective.freed else self._plain(values)
        density = -0.5 * (squares / self.variance + (drawn * away).sum(axis=1))
        gradient = -(slope / self.variance + drawn)
        return np.where(np.isfinite(density), density, -np.inf), gradient

    def value(self, values: Array) -> Array:
        """The density alone where starts are measured, shape (lanes,); predictions without derivatives."""
        none, every = np.zeros((len(values), 0)), np.arange(len(values))
        prior = self.objective.priors(values, none, every)
        density = -0.5 * ((self.objective.costs(values, none, every) - prior) / self.variance + prior)
        return np.where(np.isfinite(density), density, -np.inf)

    def _with_starts(self, values: Array) -> tuple[Array, Array]:
        """Squared residuals at the best starts, with the volume that these leave, and their halved slope."""
        away, drawn = self.objective.away(values, np.arange(len(values)))
        with np.errstate(all="ignore"):
            found, _ = self.objective.settled(values)
        known, volume = np.isfinite(found.cost), np.zeros(len(values))
        volume[known] = np.linalg.slogdet(found.blocks[0].own[known])[1].sum(axis=1)
        squares = found.cost - (drawn * away).sum(axis=1) + self.variance * volume
        return squares, found.reduced()[1] - drawn

    def _plain(self, values: Array) -> tuple[Array, Array]:
        """Squared residuals and their halved slope, one problem a call of the kernel; no normal equations are made."""
        objective, scale, n = self.objective, self.objective.windows.scale, values.shape[1]
        none = np.zeros((1, 0))

        def one(k: int) -> tuple[float, Array]:
            which = np.array([k])
            lanes, bias = objective.lanes(values[which], none, which)
            states, columns = objective.slopes(lanes, 1)
            with np.errstate(all="ignore"):
                e = objective.weighted(objective.read(states, values[which], bias), which)
                slope = (e * scale).ravel() @ columns.reshape(-1, columns.shape[-1])
                return float((e * e).sum()), slope[:n]

        with ThreadPoolExecutor(objective.threads or default_threads()) as pool:
            found = list(pool.map(one, range(len(values))))
        return np.array([squares for squares, _ in found]), np.array([slope for _, slope in found])

    def laplace(self, values: Array) -> Array:
        """Covariance of Laplace's approximation at each value, shape (lanes, free, free)."""
        found, free = self.objective.best(values), self.objective.problem.free
        return np.stack([posterior(found.of(k), free, one, self.variance)[0] for k, one in enumerate(values)])


def density_of(fit: Fit, problem: Problem, settings: Any) -> Density:
    """The posterior that the covariance of a fit approximates.

    Its factor is the one by which Laplace's sigmas at the fit are, on average, those of the fit: where the residuals
    have widened these, the likelihood counts for as much less (a power posterior, Holmes and Walker 2017).

    Raises:
        StudyError: an estimator or a problem whose posterior is not sampled; the reason and the remedy in one line.
    """
    _accept(fit, problem, settings)
    objective = TrajectoryObjective.plain(problem, settings)
    found = objective.best(fit.values[None])
    if not np.isfinite(found.cost[0]):
        raise StudyError("the model blows up at the fitted values; there is no posterior to draw from")
    normal, wanted = found.of(0), np.log(fit.sigma).mean()
    check_proper(normal, problem)
    low, high = -np.log(_RANGE), np.log(_RANGE)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        covariance, _ = posterior(normal, problem.free, fit.values, float(np.exp(middle)))
        low, high = (middle, high) if 0.5 * np.log(np.diag(covariance)).mean() < wanted else (low, middle)
    return Density(objective, float(np.exp(0.5 * (low + high))))


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


