"""Simulation-based calibration: where the truth ranks among draws from the posterior of its own data.

Truths come from the prior, data from the truths with the noise that the loss states; then the rank of the truth is
uniform if density, gradient and sampler are right (Talts et al. 2018).  All repetitions are lanes of one batch.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..data import Array
from ..identify import FitError, Problem
from ..identify.record import Settings
from ..identify.trajectory.objective import Data, TrajectoryObjective
from .sampling.density import Density
from .sampling.sampling import in_values, sampler_of

# Moves that adapt; draws between those that are ranked, so that they are nearly independent; rounds of redrawing.
_WARM, _THIN, _ROUNDS = 120, 4, 100


def truths(problem: Problem, count: int, rng: np.random.Generator) -> Array:
    """Values from the prior within the bounds, shape (count, free): Gaussian, or uniform over the bounds.

    Raises:
        FitError: the bounds leave next to nothing of the prior.
    """
    vector, n = problem.vector, len(problem.free)
    out = np.full((count, n), np.nan)
    for _ in range(_ROUNDS):
        missing = ~((out >= vector.low) & (out <= vector.high)).all(axis=1)
        if not missing.any():
            return out
        boxed = ~np.isfinite(vector.sigma)
        gaussian = vector.of_prior(count, rng)
        gaussian[:, boxed] = rng.uniform(vector.low[boxed], vector.high[boxed], (count, int(boxed.sum())))
        out[missing] = gaussian[missing]
    raise FitError("the bounds leave next to nothing of the prior; no truths can be drawn")


def calibrate(
    problem: Problem, settings: Settings, *, repeats: int, draws: int, chains: int = 2, seed: int = 0
) -> Array:
    """Ranks of the truths among the draws, in (0, 1), shape (repeats, free).

    Args:
        problem: its trials give controls and starts; what they measured is replaced.
        settings: how trajectories are cut and compared, starts as measured; the estimator.
        repeats: number of truths, each with its own data.
        draws: of each chain, of which one in three is ranked.
    """
    objective, rng = TrajectoryObjective.plain(problem, settings), np.random.default_rng(seed)
    truth, vector, cut = truths(problem, repeats, rng), problem.vector, objective.windows
    clean = np.stack([objective.predicted(one) for one in truth])
    with np.errstate(divide="ignore"):
        sigma = np.where(cut.scale > 0, 1.0 / cut.scale, 0.0)
    measured = clean + sigma * rng.standard_normal(clean.shape)
    measured[:, :, 0] = cut.state0[:, : cut.width]  # the start is known
    mean = np.repeat(vector.mean[None], repeats, axis=0)
    data = Data(np.repeat(cut.state0[None], repeats, axis=0), measured, mean)
    each = replace(objective, data=data)
    ends = each.descend(truth, tolerance=1e-8)
    laplace = Density(each).laplace(ends.values)
    root: Array = np.linalg.cholesky(laplace).astype(np.float64)
    groups = np.repeat(np.arange(repeats), chains)
    posterior = Density(replace(objective, data=data.of(groups)))
    sampler = sampler_of(posterior, ends.values, laplace, _WARM, draws, seed, groups)
    start = ends.values[groups] + (root[groups] @ rng.standard_normal((len(groups), len(vector), 1)))[:, :, 0]
    found = in_values(sampler, sampler.run(sampler.begun(np.clip(start, vector.low, vector.high), root)))
    kept = found.drawn[_WARM::_THIN].reshape(-1, repeats, chains, len(vector))
    below = (kept < truth[:, None]).sum(axis=(0, 2))
    share: Array = (below + rng.random(below.shape)) / (kept.shape[0] * chains + 1)
    return share
