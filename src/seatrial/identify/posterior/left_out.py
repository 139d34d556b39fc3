"""How much less a likelihood is worth than it claims, by trials that are left out of the fit in turn.

A model that lacks something misses an unseen trial by more than the covariance of its parameters says, however many
samples the trials of the fit have.  The likelihood is therefore raised to a power 1/T (Holmes and Walker 2017), with T
such that the errors of left-out trials are as large as the parameters then explain.  Directions that the trials fix
become wider by the root of T; those that they leave to the prior stay as wide as it.  Few trials know T badly: each
draw of the parameters has a T of its own, by as many degrees of freedom as there are trials.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import chi2

from ...core.parameters import Free
from ...data import Array
from .. import Fit, Problem, StudyError
from ..record import scales
from ..trajectory.batch import Many
from ..vector import Vector
from .ensemble import white
from .sampling.density import Posterior, posterior_of

LEAST = 3
"""Fewest trials whose errors say anything of those of another."""

# A parameter without a prior has one of so many times its own sigma.
_WIDE = 100.0
# What noise explains in so many of a hundred cases is taken for noise: that of its start bends a whole window, so that
# there are no more independent errors of this kind than windows.
_CHANCE = 0.95
# Range of the factor that is looked for, and halvings.
_GREATEST, _HALVINGS = 1e8, 60


@dataclass(frozen=True)
class Power:
    """What left-out trials say of the likelihood of a fit.

    Attributes:
        factor: T, by which the logarithm of the likelihood is divided; at least 1.
        trials: that were left out in turn: its degrees of freedom.
        errors: mean square over channels of the error of each trial over what the fit of the others expects, by name.
        left: the same over all trials where the likelihood counts by 1/T; above 1 where the priors are too narrow.
    """

    factor: float
    trials: int
    errors: Mapping[str, float]
    left: float

    def draws(
        self, free: tuple[Free, ...], mean: Array, covariance: Array, count: int, rng: np.random.Generator
    ) -> Array:  # fmt: skip
        """Draws of the parameters, each with a factor of its own, shape (count, free); bounds are not looked at."""
        factor = self.factor * self.trials / rng.chisquare(self.trials, count)
        across, fixed = directions(free, covariance)
        spread = 1.0 / np.sqrt(1.0 + fixed / np.maximum(factor, 1.0)[:, None])
        wider = np.sqrt(max(self.left, 1.0))
        return mean + wider * (spread * rng.standard_normal((count, len(mean)))) @ across.T

    def covariance(self, free: tuple[Free, ...], covariance: Array) -> Array:
        """Covariance of the parameters at T itself."""
        across, fixed = directions(free, covariance)
        return max(self.left, 1.0) * (across / (1.0 + fixed / self.factor)) @ across.T

    def shares(self, free: tuple[Free, ...], covariance: Array) -> Array:
        """Part of the variance of its prior that each parameter keeps at T, shape (free,); 0 of one without a prior."""
        sigma = Vector.of(free).sigma
        return np.where(np.isfinite(sigma), np.diag(self.covariance(free, covariance)) / sigma**2, 0.0)

    def numbers(self) -> dict[str, Any]:
        """For JSON."""
        return {"factor": self.factor, "trials": self.trials, "left": self.left, "errors": dict(self.errors),
                "words": list(self.words)}  # fmt: skip

    @staticmethod
    def read(table: Mapping[str, Any]) -> Power:
        """From what `numbers` gave.

        Raises:
            KeyError, TypeError, ValueError: it is not as that.
        """
        factor, left, trials = float(table["factor"]), float(table["left"]), int(table["trials"])
        if not (1.0 <= factor < np.inf and 0.0 <= left < np.inf and trials >= LEAST):
            raise ValueError(f"factor {factor:g}, left {left:g}, trials {trials}")
        return Power(factor, trials, {str(name): float(one) for name, one in table["errors"].items()}, left)

    @property
    def words(self) -> tuple[str, ...]:
        """What it says, one line each."""
        before = np.sqrt(np.mean(list(self.errors.values())))
        told = (f"each of {self.trials} trials is missed by {before:.2g} times what the fit to the others expects "
                f"(root mean square), so the data count by 1/{self.factor:.2g}")  # fmt: skip
        if self.left <= 1.1:
            return (told,)
        return (told, f"the priors are too narrow for these errors: draws are widened by {np.sqrt(self.left):.2g} "
                      "besides; free more parameters, or widen their priors")  # fmt: skip


def directions(free: tuple[Free, ...], covariance: Array) -> tuple[Array, Array]:
    """Directions in which prior and data are independent, and how the data fix them.

    Returns:
        Columns that are one prior sigma long, shape (free, free), and the curvature of the likelihood in each, that of
        the prior being 1, shape (free,).
    """
    sigma = Vector.of(free).sigma
    unit = np.where(np.isfinite(sigma), sigma, _WIDE * np.sqrt(np.diag(covariance)))
    weight, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    fixed = 1.0 / np.clip(weight, 1e-300, 1.0) - 1.0
    return unit[:, None] * vectors, fixed


def power(fit: Fit, problem: Problem, settings: Any) -> Power:
    """The power by which the likelihood of a fit counts, from trials left out in turn.

    Args:
        fit: of `problem` by the estimator `settings`.

    Raises:
        StudyError: too few trials, or an estimator that compares no trajectories.
    """
    if len(problem.trials) < LEAST:
        raise StudyError(f"{len(problem.trials)} trials are too few to leave each out in turn; fit {LEAST} or more")
    # Scales that are estimated from the trials stay those of all of them.
    whole = replace(problem, loss=replace(problem.loss, sigma=scales(problem)))
    variance, level = posterior_of(fit, whole, settings).variance, white(fit, whole, settings)
    sigma = np.array([level.get(name, 0.0) for name in problem.ship.model.motion])
    found = {trial.name: _told(whole, k, settings, fit.values, variance, sigma)
             for k, trial in enumerate(problem.trials)}  # fmt: skip
    missed = list(found.values())
    factor = _factor(missed)
    return Power(factor, len(found), {name: _mean([one], 1.0) for name, one in found.items()}, _mean(missed, factor))


@dataclass(frozen=True)
class _Missed:
    """A trial as the fit of the others predicts it.

    Attributes:
        squares: summed squared error of each channel, in units of its scale, shape (channels,).
        noise: what instruments add to it, at the samples and through the starts of windows, shape (channels,).
        slopes: its derivatives with respect to `across`, squared and summed, shape (channels, free).
        fixed: curvature of the likelihood of the others in these directions, shape (free,).
        windows: that the trial was cut into.
    """

    squares: Array
    noise: Array
    slopes: Array
    fixed: Array
    windows: int

    def explained(self, factor: float) -> Array:
        """What the parameters add to the squares on average, the likelihood counting by 1/factor, shape (channels,)."""
        return self.slopes @ (1.0 / (1.0 + self.fixed / factor))


def _mean(found: Sequence[_Missed], factor: float) -> float:
    """Squared errors over the expected ones: of all trials together, so that great motions count; mean of channels."""
    windows = sum(one.windows for one in found)
    sure = float(chi2.ppf(_CHANCE, windows)) / windows
    expected = np.sum([sure * one.noise + one.explained(factor) for one in found], axis=0)
    return float((np.sum([one.squares for one in found], axis=0) / expected).mean())


def _factor(missed: Sequence[_Missed]) -> float:
    """By which the likelihood is to count less, so that the errors are those that are expected."""
    low, high = 0.0, 0.0 if _mean(missed, 1.0) <= 1.0 else float(np.log(_GREATEST))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _mean(missed, float(np.exp(middle))) > 1.0 else (low, middle)
    return float(np.exp(high))


def _told(problem: Problem, left: int, settings: Any, start: Array, variance: float, sigma: Array) -> _Missed:
    """The trial at this place, as a fit to the others predicts it; `sigma` is the noise of each state."""
    parts = [[t for k, t in enumerate(problem.trials) if (k == left) is out] for out in (True, False)]
    alone, others = (Many.like(replace(problem, trials=tuple(some), validation=()), settings) for some in parts)
    values = others.descend(start[None], iterations=60, tolerance=1e-8).values
    across, fixed = directions(problem.free, Posterior(others, variance).laplace(values)[0])
    errors, slopes, begun, scale = _answer(alone, values)
    noise = ((begun * sigma) ** 2).sum(axis=(0, 2)) + ((scale * sigma[list(alone.compared)]) ** 2).sum(axis=0)
    return _Missed((errors**2).sum(axis=0), noise, ((slopes @ across) ** 2).sum(axis=0), fixed,
                   len(alone.windows.state0))  # fmt: skip


def _answer(many: Many, values: Array) -> tuple[Array, Array, Array, Array]:
    """Errors of predictions and what they depend on; estimated starts are the best ones, and answer to the parameters.

    Returns:
        Errors over their scales, shape (rows, channels), their slopes by parameter (rows, channels, free) and by
        measured state at the start (rows, channels, motion), and the inverse scales (rows, channels).
    """
    cut, states, n = many.windows, list(many.compared), values.shape[1]
    state0, answer = cut.state0.copy(), np.zeros((len(cut.state0), 0, n))
    if many.begun:
        found = many.settled(values, None)
        state0[:, list(many.begun)] += found.offset[0]
        answer = -found.back()[0, :, :, :-1]
    run, slopes = many.kernel.run(
        state0, cut.series, many.shared, lanewise=np.repeat(values, len(state0), axis=0), dt=cut.dt, steps=cut.steps,
        every=cut.every, method=many.method, threads=many.threads,
    )  # fmt: skip
    begun = slopes[:, :, states, n : n + cut.width].copy()
    own = slopes[:, :, states, :n] + np.einsum("wrcs,wsn->wrcn", begun[..., list(many.begun)], answer)
    begun[..., list(many.begun)] = 0.0
    scale = cut.scale[:, :, states]
    errors = (run[:, :, states] - cut.measured[:, :, states]) * scale
    rows = (scale > 0).all(axis=2)
    return errors[rows], (own * scale[..., None])[rows], (begun * scale[..., None])[rows], scale[rows]
