"""Random walks of many chains in step, which need no gradient: one call of the density a move, for all chains.

A walk pays where a prediction is far cheaper than its derivatives, and where the density has small jumps that no
gradient tells.  Steps are preconditioned Crank-Nicolson in the directions of the learned covariance (Law 2014; Cui, Law
and Marzouk 2016), by turns in those that the data fix, which move by as much as they leave, and in those that they
leave to the prior, which are drawn anew from it as far as the data let them.  Each kind has a step of its own.  Random
numbers follow from seed and move alone, so a run that was interrupted goes on as if it had not been.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass, replace
from ...data import Array
from .chains import Chains

Value = Callable[[Array], Array]
"""Log density (lanes,), -inf where there is none, at values (lanes, free)."""

# Acceptance aimed at in many dimensions, and what one dimension adds (Roberts and Rosenthal 2001); scatter of the
# logarithm of the squared step; its limits.
_AIM, _MORE, _SCATTER, _LEAST, _GREATEST = 0.234, 0.2, 1.0, 1e-8, 10.0
# Squared step in units of the covariance is so much over the number of parameters (Gelman, Roberts and Gilks 1996).
_STEP = 2.38**2
# The metric is learned after so many draws, again whenever there are more of them by a share, and for the last time at
# a part of the warm-up; of the latter part of the draws so far, beside so many for each parameter that the metric
# before stands for.
_FIRST, _AGAIN, _LAST, _LATTER, _BEFORE = 8, 0.15, 0.8, 0.6, 0.2
# A draw of the warm-up takes as many moves as there are parameters, over this: the metric is learned of more of them.
FINER = 8
# Least curvature of the likelihood in a direction, that of the prior being 1, and from where on the data fix it.
_CURVED, _FIXED = 0.05, 1.0


class _Metric(NamedTuple):
    """Directions of each group in which its steps are independent.

    Attributes:
        there, back: from unit Gaussian coordinates to values, and back, shape (groups, free, free).
        curved: curvature of the likelihood over that of the prior, shape (groups, free).
    """

    there: Array
    back: Array
    curved: Array


@dataclass(frozen=True)
class Walker:
    """How chains walk.

    Attributes:
        density: what is drawn from.
        mean, sigma: of the Gaussian that the steps leave as it is, the prior or a wide one, shape (groups, free).
        low, high: bounds, shape (free,).
        warm, draws: draws of each chain while it adapts, and that are kept; a kept one takes as many moves as there are
            parameters, one of the warm-up a part of them.
        seed: of all random numbers.
        groups: posterior that each lane draws from, shape (lanes,): chains of one share step and metric.
    """

    density: Value
    mean: Array
    sigma: Array
    low: Array
    high: Array
    warm: int
    draws: int
    seed: int
    groups: NDArray[np.intp]

    def begun(self, values: Array, root: Array) -> Chains:
        """Chains at their starts, shape (lanes, free), with a root of the covariance, shape (groups, free, free)."""
        step, none = np.full((len(root), 2), _STEP / values.shape[1]), np.zeros((len(values), 0))
        return Chains.begun(values, self.density(values), none, step, root, self.warm + self.draws)

    def run(self, chains: Chains, each: Callable[[Chains], None] | None = None) -> Chains:
        """Make the draws that are left; `each` is called after every one."""
        metric = self._metric(chains)
        while chains.move < self.warm + self.draws:
            chains, rates = self._drawn(chains, metric)
            if chains.move <= self.warm:
                chains = self._adapted(chains, rates)
                metric = self._metric(chains)
            if each:
                each(chains)
        return chains

    @cached_property
    def _learning(self) -> frozenset[int]:
        """Draws after which the metric is learned."""
        found, done = {round(_LAST * self.warm)}, float(_FIRST)
        while done < _LAST * self.warm:
            found.add(round(done))
            done *= 1.0 + _AGAIN
        return frozenset(found)

    def _metric(self, chains: Chains) -> _Metric:
        """Directions from the covariance of each group, in units of the prior."""
        weight, vectors = np.linalg.eigh(_covariance(chains.root / self.sigma[:, :, None]))
        curved = np.maximum(1.0 / np.maximum(weight, 1e-300) - 1.0, _CURVED)
        across = self.sigma[:, :, None]
        return _Metric(across * vectors, (vectors / across).transpose(0, 2, 1), curved)

    def _drawn(self, chains: Chains, metric: _Metric) -> tuple[Chains, Array]:
        """The moves of all chains to the next draw, and the acceptance of each by kind, shape (2, lanes), or NaN."""
        lanes, n = chains.values.shape
        moves = n if chains.move >= self.warm else -(-n // FINER)
        rng = np.random.Generator(np.random.Philox(key=[self.seed, chains.move]))
        there, back = metric.there[self.groups], metric.back[self.groups]
        centre, curved = self.mean[self.groups], metric.curved[self.groups]
        values, density = chains.values, chains.density
        z, total, made = _times(back, values - centre), np.zeros((2, lanes)), np.zeros((2, 1))
        fixed = curved > _FIXED
        for move in range(chains.calls, chains.calls + moves):
            kind = move % 2
            chosen = fixed == (kind == 0)
            # where there is nothing of a kind, all move
            chosen |= ~chosen.any(axis=1, keepdims=True)
            squared = chains.step[self.groups, kind] * np.exp(_SCATTER * rng.standard_normal(lanes) - 0.5 * _SCATTER**2)
            anew = np.where(chosen, squared[:, None] / (squared[:, None] + curved), 0.0)
            then = np.sqrt(1.0 - anew) * z + np.sqrt(anew) * rng.standard_normal((lanes, n))
            moved = centre + _times(there, then)
            inside: NDArray[np.bool_] = np.all((moved >= self.low) & (moved <= self.high), axis=1)
            found = self.density(np.where(inside[:, None], moved, values))
            # The step leaves the unit Gaussian as it is, so that what the density has beyond it decides.
            change = found - density + 0.5 * ((then**2).sum(axis=1) - (z**2).sum(axis=1))
            accept = np.where(inside & np.isfinite(found), np.exp(np.minimum(change, 0.0)), 0.0)
            taken: NDArray[np.bool_] = rng.random(lanes) < accept
            total[kind] += accept
            made[kind] += 1.0
            z, values = np.where(taken[:, None], then, z), np.where(taken[:, None], moved, values)
            density = np.where(taken, found, density)
        at = chains.move
        chains.drawn[at], chains.densities[at], chains.accepted[at] = values, density, total.sum(axis=0) / moves
        with np.errstate(invalid="ignore"):
            rates = total / made
        return replace(chains, values=values, density=density, move=at + 1, calls=chains.calls + moves), rates

    def _adapted(self, chains: Chains, rates: Array) -> Chains:
        """Steps by the acceptance of the chains of each group; metric at some parts of the warm-up."""
        done, n = chains.move, chains.values.shape[1]
        aim = _AIM + _MORE / n
        rate = np.stack([[one[self.groups == g].mean() for one in rates] for g in range(len(chains.step))])
        change = np.where(np.isfinite(rate), rate - aim, 0.0) * 2.0 / (0.05 * done + 1.0) ** 0.5
        step = np.clip(chains.step * np.exp(change), _LEAST, _GREATEST)
        if done not in self._learning:
            return replace(chains, step=step)
        recent = chains.drawn[int((1.0 - _LATTER) * done) : done]
        root = np.stack([_learned(chains.root[g], recent[:, self.groups == g]) for g in range(len(step))])
        return replace(chains, step=step, root=root)


def _times(matrix: Array, vector: Array) -> Array:
    return (matrix @ vector[:, :, None])[:, :, 0]


def _covariance(root: Array) -> Array:
    return root @ root.transpose(0, 2, 1)


def _learned(root: Array, drawn: Array) -> Array:
    """Root of the covariance of draws (draws, chains, free), drawn towards the root before by as many as is needed."""
    n = root.shape[0]
    flat = drawn.reshape(-1, n)
    unit = np.linalg.solve(root, (flat - flat.mean(axis=0)).T)
    before = _BEFORE * n
    mixed = (unit @ unit.T + before * np.eye(n)) / (flat.shape[0] + before)
    return root @ np.linalg.cholesky(mixed)
