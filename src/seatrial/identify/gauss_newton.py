"""Bounded Levenberg-Marquardt on normal equations, nuisances eliminated by a Schur complement.

The objective hands over normal equations, not residuals, so that a million samples cost one
small matrix.  Bounds are kept by an active set: a parameter on its bound that wants to leave is
held, the step is solved for the others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..data import Array

# Damping of Marquardt's diagonal: start, ratio up after a failed step, down after a good one.
_DAMPING, _UP, _DOWN, _LEAST = 1e-2, 4.0, 0.2, 1e-9
_TRIES = 12


@dataclass(frozen=True)
class Block:
    """Normal equations of one group of nuisances.

    Attributes:
        where: slice of the nuisance vector.
        own: their own Hessian, shape (n, n).
        cross: mixed with the parameters, shape (n, parameters).
        gradient: shape (n,).
    """

    where: slice
    own: Array
    cross: Array
    gradient: Array


@dataclass(frozen=True)
class Normal:
    """Normal equations at one point: half the objective is cost, H and g its derivatives."""

    cost: float
    H: Array
    g: Array
    blocks: tuple[Block, ...] = ()

    def reduced(self, damping: float) -> tuple[Array, Array]:
        """Damped H and g of the parameters alone, the nuisances eliminated."""
        hessian, g = self.H + np.diag(damping * np.diag(self.H)), self.g.copy()
        for block in self.blocks:
            solved = np.linalg.solve(damped(block, damping), np.column_stack([block.cross, block.gradient]))
            hessian -= block.cross.T @ solved[:, :-1]
            g -= block.cross.T @ solved[:, -1]
        return hessian, g


def damped(block: Block, damping: float) -> Array:
    """Hessian of a block with Marquardt's diagonal."""
    return block.own + np.diag(damping * np.diag(block.own))


class Objective(Protocol):
    """What is minimised; both return inf where the prediction fails."""

    def cost(self, p: Array, eta: Array) -> float:
        """Objective at parameters `p` and nuisances `eta`."""
        ...

    def normal(self, p: Array, eta: Array) -> Normal:
        """Objective and normal equations there."""
        ...


@dataclass(frozen=True)
class State:
    """Where a minimisation stands: enough to go on from."""

    p: Array
    eta: Array
    cost: float
    damping: float = _DAMPING
    iteration: int = 0
    evaluations: int = 0
    done: str = ""


def minimise(
    objective: Objective, state: State, low: Array, high: Array, *,
    iterations: int, tolerance: float, each: Callable[[State], None],
) -> State:  # fmt: skip
    """Go down from `state` until the relative decrease falls below `tolerance`.

    Args:
        each: called with the state after every iteration.

    Returns:
        The last state; `done` says in words why it stopped.
    """
    while not state.done:
        if state.iteration >= iterations:
            return replace(state, done=f"stopped after {iterations} iterations")
        state = _iterate(objective, state, low, high, tolerance)
        each(state)
    return state


def _iterate(objective: Objective, state: State, low: Array, high: Array, tolerance: float) -> State:
    normal = objective.normal(state.p, state.eta)
    damping, evaluations = state.damping, state.evaluations + 1
    for _ in range(_TRIES):
        p, eta = _step(normal, state, damping, low, high)
        cost = objective.cost(p, eta)
        evaluations += 1
        if cost <= state.cost:
            small = state.cost - cost <= tolerance * abs(cost)
            return State(
                p, eta, cost, max(damping * _DOWN, _LEAST), state.iteration + 1, evaluations,
                "converged" if small else "",
            )  # fmt: skip
        damping *= _UP
    return replace(state, iteration=state.iteration + 1, evaluations=evaluations, done="no further decrease")


def _step(normal: Normal, state: State, damping: float, low: Array, high: Array) -> tuple[Array, Array]:
    H, g = normal.reduced(damping)
    step = np.zeros_like(state.p)
    moving = np.ones(state.p.shape, dtype=np.bool_)
    while moving.any():
        index = np.flatnonzero(moving)
        step[:] = 0.0
        step[index] = -np.linalg.lstsq(H[np.ix_(index, index)], g[index], rcond=None)[0]
        pushing = moving & (
            ((state.p + step < low) & (state.p <= low)) | ((state.p + step > high) & (state.p >= high))
        )
        if not pushing.any():
            break
        moving &= ~pushing
    p = np.clip(state.p + step, low, high)
    eta = state.eta.copy()
    for block in normal.blocks:
        rhs = block.gradient + block.cross @ (p - state.p)
        eta[block.where] -= np.linalg.solve(damped(block, damping), rhs)
    return p, eta
