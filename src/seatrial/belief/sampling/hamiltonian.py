"""Hamiltonian Monte Carlo of many chains in step: one call of the density a leapfrog step, for all chains.

Positions are whitened by a root of the covariance (Laplace's at first, then that of the draws of the warm-up), so that
a few long leapfrog steps make a nearly independent draw (Neal 2011, section 4).  All chains take the same number of
steps, drawn anew for each move; bounds reflect (Afshar and Domke 2015, with the speed changed in the metric of the
root), which keeps volume and reversibility.  Random numbers follow from seed and move alone, so a run that was
interrupted goes on as if it had not been.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass, replace
from ...data import Array
from .chains import Chains

Density = Callable[[Array], tuple[Array, Array]]
"""Log density (lanes,), -inf where there is none, and its gradient (lanes, free) at values (lanes, free)."""

# Acceptance aimed at; duration of a move in whitened units (half a turn of the unit Gaussian is pi); most steps of one.
_AIM, _DURATION, _MOST = 0.75, (0.5, 2.0), 16
# First step, least step; energy error beyond which a move counts as divergent.
_FIRST, _LEAST, _DIVERGENT = 0.6, 1e-4, 1000.0
# Reflections at bounds within one drift before the move is given up.
_BOUNCES = 50


@dataclass(frozen=True)
class Sampler:
    """How chains move.

    Attributes:
        density: what is drawn from.
        low, high: bounds, shape (free,).
        warm, draws: moves of each chain that adapt, and that are kept.
        seed: of all random numbers.
        groups: posterior that each lane draws from, shape (lanes,): chains of one share step and metric.
    """

    density: Density
    low: Array
    high: Array
    warm: int
    draws: int
    seed: int
    groups: NDArray[np.intp]

    def begun(self, values: Array, root: Array) -> Chains:
        """Chains at their starts, shape (lanes, free), with a root of the covariance, shape (groups, free, free)."""
        density, gradient = self.density(values)
        return Chains.begun(values, density, gradient, np.full(len(root), _FIRST), root, self.warm + self.draws)

    def run(self, chains: Chains, each: Callable[[Chains], None] | None = None) -> Chains:
        """Make the moves that are left; `each` is called after every one."""
        while chains.move < self.warm + self.draws:
            chains = self._moved(chains)
            if chains.move <= self.warm:
                chains = self._adapted(chains)
            if each:
                each(chains)
        return chains

    def _moved(self, chains: Chains) -> Chains:
        """One move of all chains."""
        rng = np.random.Generator(np.random.Philox(key=[self.seed, chains.move]))
        duration = rng.uniform(*_DURATION)
        momentum, chance = rng.standard_normal(chains.values.shape), rng.random(len(chains.values))
        steps = min(math.ceil(duration / float(chains.step.min())), _MOST)
        step = np.minimum(chains.step, duration / steps)[self.groups, None]
        values, gradient, density, after = self._trajectory(chains, momentum, step, steps)
        energy = 0.5 * (momentum**2).sum(axis=1) - chains.density
        with np.errstate(all="ignore"):
            change = 0.5 * (after**2).sum(axis=1) - density - energy
        change = np.where(np.isfinite(change), change, np.inf)
        accept = np.exp(-np.maximum(change, 0.0))
        taken = chance < accept
        at = chains.move
        chains.drawn[at] = np.where(taken[:, None], values, chains.values)
        chains.densities[at], chains.accepted[at] = np.where(taken, density, chains.density), accept
        return replace(
            chains, values=chains.drawn[at].copy(), gradient=np.where(taken[:, None], gradient, chains.gradient),
            density=chains.densities[at].copy(), move=at + 1, calls=chains.calls + steps,
            divergent=chains.divergent + ((change > _DIVERGENT) & (at >= self.warm)),
        )  # fmt: skip

    def _trajectory(
        self, chains: Chains, momentum: Array, step: Array, steps: int
    ) -> tuple[Array, Array, Array, Array]:
        """Values, gradient, density and momentum at the end of a trajectory; density -inf where it is lost."""
        root = chains.root[self.groups]
        values, gradient, density = chains.values, chains.gradient, chains.density
        lost = np.zeros(len(values), dtype=np.bool_)
        p = momentum
        for _ in range(steps):
            p = p + 0.5 * step * _times(root.transpose(0, 2, 1), gradient)
            moved, p, stuck = self._drift(values, p, step, root)
            lost |= stuck
            values = np.where(lost[:, None], values, moved)
            density, gradient = self.density(values)
            lost |= ~(np.isfinite(density) & np.isfinite(gradient).all(axis=1))
            gradient = np.where(lost[:, None], 0.0, gradient)
            p = p + 0.5 * step * _times(root.transpose(0, 2, 1), gradient)
        return values, gradient, np.where(lost, -np.inf, density), p

    def _drift(self, values: Array, p: Array, step: Array, root: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Positions after one drift, reflected at bounds, the momenta there, and where reflections do not end."""
        left, values, p = step[:, 0].copy(), values.copy(), p.copy()
        for _ in range(_BOUNCES):
            speed = _times(root, p)
            with np.errstate(all="ignore"):
                edge = np.where(speed > 0, self.high, self.low)
                times = np.where(speed != 0, (edge - values) / speed, np.inf)
            times = np.where(np.isfinite(times), np.maximum(times, 0.0), np.inf)
            first = times.argmin(axis=1)
            due = times[np.arange(len(values)), first]
            hit = due < left
            time = np.minimum(due, left)
            values = np.clip(values + time[:, None] * speed, self.low, self.high)
            left = left - time
            if not hit.any():
                return values, p, hit
            at = np.flatnonzero(hit)
            normal = root[at, first[at]]
            turn = 2.0 * (normal * p[at]).sum(axis=1) / (normal**2).sum(axis=1)
            p[at] -= turn[:, None] * normal
        return values, p, left > 0.0

    def _adapted(self, chains: Chains) -> Chains:
        """Step by the acceptance of the chains of each group; metric at a third and two thirds of the warm-up."""
        done, step = chains.move, chains.step.copy()
        count = np.bincount(self.groups, minlength=len(step))
        rate = np.bincount(self.groups, chains.accepted[done - 1], minlength=len(step)) / count
        step = np.maximum(step * np.exp((rate - _AIM) * 2.0 / (done + 3.0) ** 0.5), _LEAST)
        step = np.minimum(step, _DURATION[1])
        third = self.warm // 3
        if third and done in (third, 2 * third):
            recent = chains.drawn[done - (third - third // 3) : done]
            root = np.stack([_refined(chains.root[g], recent[:, self.groups == g]) for g in range(len(step))])
            return replace(chains, step=step, root=root)
        return replace(chains, step=step)


def _times(matrix: Array, vector: Array) -> Array:
    return (matrix @ vector[:, :, None])[:, :, 0]


def _refined(root: Array, drawn: Array) -> Array:
    """Root of the covariance of draws (moves, chains, free), drawn towards the root before by as many as is needed.

    The draws count as half as many, and the root before as ten for each parameter.
    """
    n = root.shape[0]
    flat = drawn.reshape(-1, n)
    # In units of the root before, where the draws are near a unit Gaussian.
    unit = np.linalg.solve(root, (flat - flat.mean(axis=0)).T)
    count, before = 0.5 * flat.shape[0], 10.0 * n
    mixed = (0.5 * (unit @ unit.T) + before * np.eye(n)) / (count + before)
    return root @ np.linalg.cholesky(mixed)
