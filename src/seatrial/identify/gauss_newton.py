"""Bounded Levenberg-Marquardt on normal equations, nuisances eliminated by a Schur complement.

The objective hands over normal equations, not residuals, so that a million samples cost one
small matrix.  Each step is the best point of the damped quadratic within the bounds (`box_steps`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..data import Array
from .box_steps import steps

# Damping of Marquardt's diagonal: start, ratio up after a failed step, down after a good one.
_DAMPING, _UP, _DOWN, _LEAST = 1e-2, 4.0, 0.2, 1e-9
_TRIES = 12
# Keeps a direction that the data do not see at all from making the step's matrix singular.
_NUDGE = np.full(1, 1e-12)


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
    everything = np.ones((1, g.size), dtype=np.bool_)
    (step,), _ = steps(H[None], g[None], (low - state.p)[None], (high - state.p)[None], everything, _NUDGE)
    p = np.clip(state.p + step, low, high)
    eta = state.eta.copy()
    for block in normal.blocks:
        rhs = block.gradient + block.cross @ (p - state.p)
        eta[block.where] -= np.linalg.solve(damped(block, damping), rhs)
    return p, eta
