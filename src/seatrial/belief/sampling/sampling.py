"""Sampling the posterior of a fit: polish the optimum, start chains about it, move them, keep a checkpoint."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import HopelessError
from ...core.files import packed, write_whole
from ...core.parameters import values as parameters_of
from ...core.values import dataclass
from ...data import Array
from ...identify import Fit, FitError, Problem, StudyError
from ...identify.resume import kept_arrays
from .chains import Chains
from .coordinates import Coordinates, TurnedWalk
from .density import Density, density_of
from .hamiltonian import Sampler
from .sampled import Sampled, hopeless
from .walking import FINER, Walker

CHAINS = 8
LEAST = 50 * CHAINS
"""Fewest draws that R-hat and effective sizes can be read from."""

# Moves of each chain that adapt: at least so many, and as a share of those kept.
_WARM, _SHARE = 100, 0.5
# Starts lie so many of Laplace's sigmas about the optimum, and are halved where the density has fallen too far.
_SPREAD, _HALVINGS, _FALL = 1.0, 12, 1.0
# The Gaussian that a walk leaves as it is is so many times as wide as Laplace's, where a parameter has no prior.
_WIDE = 30.0
# Climbs to the greatest density: their number, the steps of each, the gain of the logarithm that ends them, the weight
# of a squared sigma beyond the bounds, and what stands for a model that blows up.
_CLIMBS, _STEPS, _GAIN, _WALL, _BLOWN = 8, 200, 0.05, 100.0, 1e12
# Time between writings of the checkpoint [s].
_PAUSE = 5.0
# Chains are judged after this share of the draws that are kept, or so many of each where that is more: of fewer R-hat
# is 1.2 by chance.
_JUDGED, _FEWEST = 0.25, 50


Told = Callable[[int, int], None]
"""Called with the moves made and all moves."""


@dataclass
class _Clock:
    """CPU time spent, that of interrupted runs included, and when the checkpoint was last written."""

    began: float
    written: float

    @property
    def spent(self) -> float:
        """CPU time [s]."""
        return time.process_time() - self.began


@dataclass
class _Watch:
    """Tells how far the chains are, keeps them, and gives them up, once, where they will not agree."""

    sampler: Sampler | Walker | TurnedWalk
    paths: tuple[str, ...]
    warm: int
    draws: int
    checkpoint: Path | None
    digest: str
    clock: _Clock
    told: Told | None
    judged: bool = False

    def __call__(self, now: Chains) -> None:
        if self.told:
            self.told(now.move, self.warm + self.draws)
        why = ""
        last = self.warm + max(round(_JUDGED * self.draws), _FEWEST)
        if not self.judged and last <= now.move < self.warm + self.draws:
            self.judged = True
            drawn = in_values(self.sampler, now).drawn[self.warm : last]  # the same draws after an interruption
            why = hopeless(drawn, self.paths, self.draws, self.clock.spent)
        if self.checkpoint is not None and (why or time.perf_counter() - self.clock.written > _PAUSE):
            _write(self.checkpoint, now, self.digest, self.clock)
        if why:
            raise HopelessError(why)


def sample(
    fit: Fit, problem: Problem, settings: Any, count: int, *,
    seed: int = 0, checkpoint: Path | None = None, told: Told | None = None,
) -> Sampled:  # fmt: skip
    """Draws from the posterior of a fit.

    Args:
        fit: of `problem` by the estimator `settings`.
        count: draws of all chains together, rounded up to the same number of each.
        seed: of all random numbers; the draws are a function of it, the fit and `count`.
        checkpoint: file from which an interrupted run goes on, with the same draws as one that was not.
        told: receives the progress.

    Raises:
        StudyError: a count below `LEAST`, or a posterior that is not sampled (`density_of`).
        HopelessError: after a quarter of the draws, where the chains will not agree; says when they would.
        FitError: no start has a finite density.
        ResumeError: the checkpoint is of another fit.
    """
    if count < LEAST:
        raise StudyError(f"{count} draws are too few to judge the chains; draw {LEAST} or more")
    posterior = density_of(fit, problem, settings)
    # An optimiser stops where a step gains a share of the objective; a density is known to a fraction of one.
    best = climbed(posterior, posterior.objective.descend(fit.values[None], iterations=100, tolerance=1e-8).values[0])
    walks = not posterior.objective.freed
    laplace, draws = posterior.laplace(best[None]), -(-count // CHAINS)
    warm = max(_WARM, round(_SHARE * draws)) * (FINER if walks else 1)
    sampler = sampler_of(posterior, best[None], laplace, warm, draws, seed, np.zeros(CHAINS, dtype=np.intp))
    print_ = hashlib.sha256(f"{fit.digest} {fit.values.tolist()} {count} {seed}".encode()).hexdigest()[:16]
    clock = _Clock(time.process_time(), time.perf_counter())
    chains = _resumed(checkpoint, print_, clock)
    if chains is None:
        root = np.linalg.cholesky(laplace).astype(np.float64)
        chains = sampler.begun(starts(posterior, best, laplace[0], CHAINS, seed), root)

    watch = _Watch(sampler, tuple(problem.vector.paths), warm, draws, checkpoint, print_, clock, told)
    chains = sampler.run(chains, watch)
    if checkpoint is not None:
        _write(checkpoint, chains, print_, clock)
    chains = in_values(sampler, chains)
    return Sampled(
        problem.free, chains.drawn[warm:], chains.densities[warm:], chains.accepted[warm:],
        int(chains.divergent.sum()), best, laplace[0], posterior.variance, tails(posterior, best), clock.spent,
        chains.calls, print_,
    )  # fmt: skip


def sampler_of(
    posterior: Density, centre: Array, laplace: Array, warm: int, draws: int, seed: int, groups: NDArray[np.intp]
) -> Sampler | Walker | TurnedWalk:
    """A walk where starts of windows are measured, so that predictions do; Hamiltonian moves where they are estimated.

    An estimated start takes derivatives of its window whatever the parameters do, and then the gradient costs no more.

    Args:
        centre, laplace: greatest density of each group and covariance there, shape (groups, free) and with another
            free.
        warm, draws, seed, groups: as `Sampler` has them.
    """
    vector = posterior.objective.problem.vector
    if posterior.objective.freed:
        return Sampler(posterior, vector.low, vector.high, warm, draws, seed, groups)
    own, data = np.isfinite(vector.sigma), posterior.objective.data
    mean = np.broadcast_to(vector.mean, centre.shape) if data is None else data.mean[np.unique(groups, True)[1]]
    wide = _WIDE * np.sqrt(np.diagonal(laplace, axis1=1, axis2=2))
    walker = Walker(posterior.value, np.where(own, mean, centre), np.where(own, vector.sigma, wide),
                    vector.low, vector.high, warm, draws, seed, groups)  # fmt: skip
    known = parameters_of(posterior.objective.problem.ship.model)
    x_R = None if "rudder.x_R" in vector.paths else known.get("rudder.x_R")
    coordinates = Coordinates.of(tuple(vector.paths), centre, None if x_R is None else float(x_R))
    return walker if coordinates.plain else TurnedWalk.of(walker, coordinates, centre)


def in_values(sampler: Sampler | Walker | TurnedWalk, chains: Chains) -> Chains:
    """Chains in values, whatever they were drawn in."""
    return sampler.told(chains) if isinstance(sampler, TurnedWalk) else chains


def climbed(posterior: Density, values: Array) -> Array:
    """The greatest density uphill of `values`, by quasi-Newton steps in the directions of Laplace's covariance.

    A fit that resists outliers ends elsewhere than this density, and where a model has branches the equations of
    Gauss and Newton hold too near: chains that begin there spend their draws on the way up.
    """
    from scipy.optimize import minimize

    vector = posterior.objective.problem.vector
    top = float(posterior(values[None])[0][0])
    for _ in range(_CLIMBS):
        root = np.linalg.cholesky(posterior.laplace(values[None])[0])
        sigma = np.sqrt((root**2).sum(axis=1))

        def downhill(z: Array, at: Array = values, root: Array = root, sigma: Array = sigma) -> tuple[float, Array]:
            wanted = at + root @ z
            inside = np.clip(wanted, vector.low, vector.high)
            out = (wanted - inside) / sigma
            density, slope = posterior(inside[None])
            if not np.isfinite(density[0]):
                return _BLOWN, np.zeros_like(z)
            back = 2.0 * _WALL * out / sigma - np.where(out == 0.0, slope[0], 0.0)
            return float(_WALL * (out**2).sum() - density[0]), root.T @ back

        found = minimize(downhill, np.zeros(values.size), jac=True, method="L-BFGS-B",
                         options={"maxiter": _STEPS, "maxfun": _STEPS, "ftol": 1e-7})  # fmt: skip
        moved = np.clip(values + root @ found.x, vector.low, vector.high)
        density = float(posterior(moved[None])[0][0])
        if not density > top:
            break
        values, gained, top = moved, density - top, density
        if gained < _GAIN:
            break
    return values


def starts(posterior: Density, best: Array, covariance: Array, count: int, seed: int) -> Array:
    """Starts of chains about the optimum, shape (count, free): spread as Laplace has it, nearer where that is wrong.

    Raises:
        FitError: the density is not finite even next to the optimum.
    """
    problem = posterior.objective.problem
    rng = np.random.Generator(np.random.Philox(key=[seed, 2**63]))
    away = _SPREAD * rng.standard_normal((count, best.size)) @ np.linalg.cholesky(covariance).T
    top = posterior(best[None])[0][0]
    for _ in range(_HALVINGS):
        values = np.clip(best + away, problem.vector.low, problem.vector.high)
        density, _ = posterior(values)
        far = ~(density > top - _FALL * (best.size + 5))
        if not far.any():
            return values
        away[far] *= 0.5
    raise FitError("the posterior has no finite density about the fit; the model blows up next to it")


def tails(posterior: Density, values: Array) -> dict[str, float]:
    """Fourth moment of the residuals over that of a Gaussian, by compared channel."""
    cut = posterior.objective.windows
    e = np.where(cut.scale > 0, (posterior.objective.predicted(values) - cut.measured) * cut.scale, np.nan)
    e[:, 0] = np.nan  # the start, which is measured or estimated
    found: dict[str, float] = {}
    for k, name in enumerate(posterior.objective.problem.ship.model.motion):
        one = e[..., k][np.isfinite(e[..., k])]
        if one.size and (one != 0).any():
            found[name] = float((one**4).mean() / (3.0 * (one**2).mean() ** 2))
    return found


_FIELDS = ("values", "gradient", "density", "step", "root", "drawn", "densities", "accepted", "divergent")


def _write(path: Path, chains: Chains, digest: str, clock: _Clock) -> None:
    arrays = {name: getattr(chains, name) for name in _FIELDS}
    counts = np.array([chains.move, chains.calls], dtype=np.int64)
    write_whole(path, packed(digest=np.array(digest), counts=counts, spent=np.array(clock.spent), **arrays))
    clock.written = time.perf_counter()


def _resumed(path: Path | None, digest: str, clock: _Clock) -> Chains | None:
    kept = kept_arrays(path, digest, (*_FIELDS, "counts", "spent"))
    if kept is None:
        return None
    clock.began -= float(kept["spent"])
    move, calls = (int(one) for one in kept["counts"])
    return Chains(**{name: kept[name] for name in _FIELDS}, move=move, calls=calls)
