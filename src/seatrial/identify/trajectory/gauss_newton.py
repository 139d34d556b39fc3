"""Bounded Levenberg-Marquardt on normal equations, nuisances eliminated by a Schur complement.

The objective hands over normal equations, not residuals, so that a million samples cost one
small matrix.  Each step is the best point of the damped quadratic within the bounds (`box_steps`).

Damped Newton steps within bounds, of many problems at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...data import Array

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


    def first(self, count: int) -> Normal:
        """Those of the first `count` parameters, everything else eliminated; as it is where there is nothing else."""
        if count == self.g.size:
            return self
        H, g = self.reduced(0.0)
        back = np.linalg.solve(H[count:, count:], np.column_stack([H[count:, :count], g[count:]]))
        return Normal(self.cost, H[:count, :count] - H[:count, count:] @ back[:, :-1],
                      g[:count] - H[:count, count:] @ back[:, -1])  # fmt: skip


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


Mask = NDArray[np.bool_]


def steps(H: Array, g: Array, low: Array, high: Array, moving: Mask, damping: Array) -> tuple[Array, Array]:
    """Damped Newton steps to the best point of each quadratic within bounds, and the decrease each promises.

    The active set is found by exchanging whatever violates its bound or its multiplier, all at once at
    first (Judice and Pires 1994), one by one where that does not settle.

    Args:
        H, g: shapes (problems, free, free) and (problems, free).
        low, high: bounds relative to where each problem stands, shape (problems, free).
        moving: what may move at all, shape (problems, free).
        damping: shape (problems,).
    """
    n = g.shape[1]
    d = np.sqrt(np.maximum(np.diagonal(H, axis1=1, axis2=2), 0.0))
    d = np.where(d > 0, d, 1.0)
    A = H / (d[:, :, None] * d[:, None, :]) + damping[:, None, None] * np.eye(n)
    b, low, high = g / d, low * d, high * d
    at, z = np.zeros(g.shape), np.zeros(g.shape)
    for turn in range(6 * n):
        z = _solved(A, b, np.where(moving, np.where(at < 0, low, high), 0.0), moving & (at == 0))
        slope = b + (A @ z[:, :, None])[:, :, 0]
        wanted = np.where(at == 0, np.where(z < low, -1.0, np.where(z > high, 1.0, 0.0)),
                          np.where(at * slope > 0, 0.0, at))  # fmt: skip
        wrong = moving & (wanted != at)
        if not wrong.any():
            break
        if turn >= n:
            wrong &= np.cumsum(wrong, axis=1) == 1
        at = np.where(wrong, wanted, at)
    step = np.clip(z, low, high) / d
    return step, -(2.0 * (g * step).sum(axis=1) + np.einsum("si,sij,sj->s", step, H, step))


def _solved(A: Array, b: Array, fixed: Array, moving: Mask) -> Array:
    """Minimum over what moves, the others at their `fixed` values."""
    fixed = np.where(moving, 0.0, fixed)
    rest = np.where(moving, 0.0, 1.0)[:, :, None] * np.eye(b.shape[1])
    K = np.where(moving[:, :, None] & moving[:, None, :], A, rest)
    right = np.where(moving, -(b + (A @ fixed[:, :, None])[:, :, 0]), fixed)
    solved: Array = np.linalg.solve(K, right[:, :, None])
    return solved[:, :, 0]
