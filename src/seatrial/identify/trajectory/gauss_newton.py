"""One bounded Levenberg-Marquardt for many problems at once, nuisances eliminated by a Schur complement.

The objective hands over normal equations, not residuals, so that a million samples cost one small matrix.  A step is
judged by the objective alone, which costs a fraction of its derivatives; these are asked for where a step was taken.
Each step is the best point of the damped quadratic within the bounds (`steps`).  `minimise` is the descent of one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass, fields, replace
from ...data import Array

Index = NDArray[np.intp]
Mask = NDArray[np.bool_]

# Damping of Marquardt's diagonal: start, ratio up after a failed step, down after a good one.
_DAMPING, _UP, _DOWN, _LEAST = 1e-2, 4.0, 0.2, 1e-9
_TRIES = 12
CONVERGED = "converged"
"""What `State.done` says of a descent that has reached its end."""
STILL = 2
"""Successive steps without effect that end a search whose digits count: one may have been short by its damping."""
# Keeps a direction that the data do not see at all from making the step's matrix singular.
_NUDGE = 1e-12


@dataclass(frozen=True)
class Block:
    """Normal equations of groups of nuisances of one size; where problems are many they are the first axis.

    Attributes:
        where: entries of the nuisance vector, shape (groups, n), the same for every problem.
        own: their own Hessians, shape (groups, n, n).
        cross: mixed with the parameters, shape (groups, n, parameters).
        gradient: shape (groups, n).
    """

    where: Index
    own: Array
    cross: Array
    gradient: Array

    def back(self, damping: Any = 0.0) -> Array:
        """Answer to the parameters, and by itself, shape (groups, n, parameters + 1)."""
        own = damped(self.own, np.asarray(damping)[..., None])
        found: Any = np.linalg.solve(own, np.concatenate([self.cross, self.gradient[..., None]], axis=-1))
        return np.asarray(found, dtype=np.float64)


@dataclass(frozen=True)
class Normal:
    """Normal equations at one point, or at one of each problem, which are then the first axis.

    Attributes:
        cost: objective, priors included, a number or shape (problems,); H and g are halves of its derivatives.
        H, g: of the parameters, shapes (parameters, parameters) and (parameters,).
        blocks: of the nuisances.
        data: part of the objective that is not prior, as `cost`; NaN where nobody asked.
    """

    cost: Any
    H: Array
    g: Array
    blocks: tuple[Block, ...] = ()
    data: Any = np.nan

    def reduced(self, damping: Any = 0.0, backs: Sequence[Array] | None = None) -> tuple[Array, Array]:
        """Damped H and g of the parameters alone, the nuisances eliminated; `backs` are those of the blocks."""
        # Schur complement: the blocks of the nuisances know nothing of each other, so each is eliminated by itself, and
        # the step of the parameters that is left is that of the whole system.
        hessian, g = damped(self.H, damping), self.g
        for k, block in enumerate(self.blocks):
            both = (np.swapaxes(block.cross, -1, -2) @ (backs[k] if backs else block.back(damping))).sum(axis=-3)
            hessian, g = hessian - both[..., :-1], g - both[..., -1]
        return hessian, g

    def step(self, p: Array, eta: Array, damping: Array, low: Array, high: Array, moving: Mask) -> tuple[Array, Array]:
        """Parameters and nuisances after a damped step within bounds, of each problem."""
        backs = [block.back(damping) for block in self.blocks]
        step = steps(*self.reduced(damping, backs), low - p, high - p, moving, _NUDGE)
        # the nuisances that belong to the step as it was taken: what a bound cuts off must not be made up for twice
        there, eta = np.clip(p + step, low, high), eta.copy()
        for block, back in zip(self.blocks, backs, strict=True):
            eta[:, block.where] -= back[..., -1] + (back[..., :-1] @ (there - p)[:, None, :, None])[..., 0]
        return there, eta

    def promised(self, p: Array, low: Array, high: Array, moving: Mask) -> Array:
        """Decrease of each objective by the step without damping, were it quadratic, shape (problems,)."""
        H, g = self.reduced(np.zeros(len(p)))
        step = steps(H, g, low - p, high - p, moving, _NUDGE)
        # H and g are halves of the derivatives, so that the quadratic falls by 2 g.s + s.H s
        return np.asarray(-((2.0 * g + (H @ step[:, :, None])[:, :, 0]) * step).sum(axis=1))

    def alone(self) -> Array:
        """Steps of the nuisances with the parameters held, shape (problems, nuisances)."""
        step = np.zeros((len(self.H), sum(block.where.size for block in self.blocks)))
        for block in self.blocks:
            step[:, block.where] = -block.back()[..., -1]
        return step

    def first(self, count: int) -> Normal:
        """Those of the first `count` parameters, everything else eliminated; as it is where there is nothing else."""
        if count == self.g.size:
            return self
        H, g = self.reduced()
        back = np.linalg.solve(H[count:, count:], np.column_stack([H[count:, :count], g[count:]]))
        return Normal(self.cost, H[:count, :count] - H[:count, count:] @ back[:, :-1],
                      g[:count] - H[:count, count:] @ back[:, -1])  # fmt: skip

    def of(self, index: Any) -> Normal:
        """One of the problems, or some."""
        blocks = (Block(b.where, b.own[index], b.cross[index], b.gradient[index]) for b in self.blocks)
        return Normal(self.cost[index], self.H[index], self.g[index], tuple(blocks), self.data[index])

    def having(self, index: Index, other: Normal) -> Normal:
        """The same with some of the problems as in `other`."""
        def put(mine: Array, its: Array) -> Array:
            out = mine.copy()
            out[index] = its
            return out

        blocks = (Block(a.where, *(put(getattr(a, x), getattr(b, x)) for x in ("own", "cross", "gradient")))
                  for a, b in zip(self.blocks, other.blocks, strict=True))  # fmt: skip
        return Normal(put(self.cost, other.cost), put(self.H, other.H), put(self.g, other.g), tuple(blocks),
                      put(self.data, other.data))  # fmt: skip

    @staticmethod
    def stacked(alone: Sequence[Normal]) -> Normal:
        """Those of several problems."""

        def rows(values: Iterable[Any]) -> Array:
            return np.array(list(values), dtype=np.float64)

        blocks = (Block(b[0].where, *(rows(getattr(one, x) for one in b) for x in ("own", "cross", "gradient")))
                  for b in zip(*(one.blocks for one in alone), strict=True))  # fmt: skip
        return Normal(rows(n.cost for n in alone), rows(n.H for n in alone), rows(n.g for n in alone), tuple(blocks),
                      rows(n.data for n in alone))  # fmt: skip


def damped(H: Array, damping: Any) -> Array:
    """A Hessian with Marquardt's diagonal, shape (..., n, n); `damping` has the shape of the leading axes."""
    return H * (1.0 + np.asarray(damping)[..., None, None] * np.eye(H.shape[-1]))


class Objective(Protocol):
    """What is minimised, of many problems: rows of `p` and `eta` belong to the problems `which`."""

    def costs(self, p: Array, eta: Array, which: Index) -> Array:
        """Objectives at parameters `p` and nuisances `eta`, shape (problems,); inf where the prediction fails."""
        ...

    def normals(self, p: Array, eta: Array, which: Index) -> Normal:
        """Objectives and normal equations there."""
        ...


@dataclass(frozen=True)
class State:
    """Where a minimisation stands, enough to go on from; of many, each entry is an array with a row for each.

    `small` counts the last steps that hardly decreased the objective.
    """

    p: Array
    eta: Array
    cost: Any
    damping: Any = _DAMPING
    iteration: Any = 0
    evaluations: Any = 0
    done: Any = ""
    small: Any = 0

    @staticmethod
    def begin(p: Array, eta: Array, cost: Array) -> State:
        """Of many descents that have not begun; those are done that lack a finite objective."""
        alone = zip(p, eta, cost.tolist(), strict=True)
        return State.rows([State(*one, done="" if np.isfinite(one[-1]) else "the model blows up") for one in alone])

    @staticmethod
    def rows(alone: Sequence[State]) -> State:
        """The state of several."""
        columns = {f.name: [getattr(one, f.name) for one in alone] for f in fields(State)}
        done = np.array(columns.pop("done"), dtype=object)
        return State(**{name: np.array(column) for name, column in columns.items()}, done=done)

    def of(self, k: int) -> State:
        """That of one."""
        return State(self.p[k].copy(), self.eta[k].copy(), float(self.cost[k]), float(self.damping[k]),
                     int(self.iteration[k]), int(self.evaluations[k]), str(self.done[k]),
                     int(self.small[k]))  # fmt: skip


def minimise(
    objective: Objective, state: State, low: Array, high: Array, *,
    iterations: int, tolerance: float, each: Callable[[State], None],
) -> State:  # fmt: skip
    """The descent of one problem; see `descend`."""
    def told(now: State, which: Index) -> None:
        if which.size:
            each(now.of(0))

    end = descend(objective, State.rows([state]), low, high, iterations=iterations, tolerance=tolerance,
                  each=told)  # fmt: skip
    return end.of(0)


def descend(
    objective: Objective, start: State, low: Array, high: Array, *, iterations: int, tolerance: float,
    still: int = 1, held: Mask | None = None, each: Callable[[State, Index], None] | None = None,
) -> State:  # fmt: skip
    """Go down with every problem until its relative decrease falls below `tolerance`; none depends on the others.

    Args:
        start: where they begin (`State.rows`); those that are done stay there.
        still: successive steps that decrease by so little.
        held: parameters that do not move, shape (problems, parameters).
        each: called after every turn with the state, whose arrays go on, and the problems that did an iteration.

    Returns:
        The last state; `done` says in words why each stopped.
    """
    now = replace(start, **{f.name: getattr(start, f.name).copy() for f in fields(start)})
    moving = np.ones(now.p.shape, dtype=np.bool_) if held is None else ~held
    tries = np.zeros(len(now.p), dtype=np.intp)
    normals: dict[int, Normal] = {}
    while True:
        now.done[(now.done == "") & (now.iteration >= iterations)] = f"stopped after {iterations} iterations"
        at = np.flatnonzero(now.done == "")
        if not at.size:
            return now
        # A step that was refused is tried again shorter from the same place: its derivatives are known, and cost most.
        if (new := at[tries[at] == 0]).size:
            fresh = objective.normals(now.p[new], now.eta[new], new)
            normals |= {int(k): fresh.of(i) for i, k in enumerate(new)}
            now.evaluations[new] += 1
        normal = Normal.stacked([normals[int(k)] for k in at])
        p, eta = normal.step(now.p[at], now.eta[at], now.damping[at], low, high, moving[at])
        cost = objective.costs(p, eta, at)
        # inf where the model blows up on the way: worse than any place, so that the damping grows and the step shrinks
        better = cost <= now.cost[at]
        little = better & (now.cost[at] - cost <= tolerance * np.abs(cost))
        little[little] = _no_more(normal.of(little), now.p[at[little]], cost[little], low, high, moving[at[little]],
                                  tolerance)  # fmt: skip
        now.small[at] = np.where(better, np.where(little, now.small[at] + 1, 0), now.small[at])
        tries[at] = np.where(better, 0, tries[at] + 1)
        # Marquardt's rule: down fast where the quadratic is right, up faster where it is not
        now.damping[at] = np.where(better, np.maximum(now.damping[at] * _DOWN, _LEAST), now.damping[at] * _UP)
        now.evaluations[at] += 1
        now.p[at[better]], now.eta[at[better]], now.cost[at[better]] = p[better], eta[better], cost[better]
        stepped = at[better | (tries[at] >= _TRIES)]
        now.iteration[stepped] += 1
        now.done[at[now.small[at] >= still]] = CONVERGED
        now.done[at[tries[at] >= _TRIES]] = "no further decrease"
        if each:
            each(now, stepped)


def _no_more(normal: Normal, p: Array, cost: Array, low: Array, high: Array, moving: Mask, tolerance: float) -> Mask:
    """Whether no step would gain more, shape (problems,): one may have gained little as its damping made it short."""
    if not len(p):
        return np.zeros(0, dtype=np.bool_)
    return np.asarray(normal.promised(p, low, high, moving) <= tolerance * np.abs(cost))


def steps(H: Array, g: Array, low: Array, high: Array, moving: Mask, nudge: float) -> Array:
    """Newton steps to the best point of each quadratic within bounds, shape (problems, free).

    The active set is found by exchanging whatever violates its bound or its multiplier, all at once at
    first (Judice and Pires 1994), one by one where that does not settle.

    Args:
        H, g: shapes (problems, free, free) and (problems, free).
        low, high: bounds relative to where each problem stands, shape (problems, free).
        moving: what may move at all, shape (problems, free).
        nudge: added to the diagonal, relative.
    """
    n = g.shape[1]
    # Scaled by its diagonal, H is a matrix of correlations: units and sizes of the parameters (1e-6 to 1e9) are out of
    # its condition, and one nudge keeps every flat direction from dividing by zero.
    d = np.sqrt(np.maximum(np.diagonal(H, axis1=1, axis2=2), 0.0))
    d = np.where(d > 0, d, 1.0)
    A = H / (d[:, :, None] * d[:, None, :]) + nudge * np.eye(n)
    b, low, high = g / d, low * d, high * d
    at, z = np.zeros(g.shape), np.zeros(g.shape)  # -1, 0, 1: at the lower bound, free, at the upper one
    for turn in range(6 * n):
        z = _solved(A, b, np.where(moving, np.where(at < 0, low, high), 0.0), moving & (at == 0))
        slope = b + (A @ z[:, :, None])[:, :, 0]
        # what is free goes to the bound that it crosses; what is at a bound comes free where the slope leads inside
        wanted = np.where(at == 0, np.where(z < low, -1.0, np.where(z > high, 1.0, 0.0)),
                          np.where(at * slope > 0, 0.0, at))  # fmt: skip
        wrong = moving & (wanted != at)
        if not wrong.any():
            break
        if turn >= n:  # exchanging all at once may go round in circles; one by one, the first of them, it ends
            wrong &= np.cumsum(wrong, axis=1) == 1
        at = np.where(wrong, wanted, at)
    return np.clip(z, low, high) / d


def _solved(A: Array, b: Array, fixed: Array, moving: Mask) -> Array:
    """Minimum over what moves, the others at their `fixed` values."""
    fixed = np.where(moving, 0.0, fixed)
    rest = np.where(moving, 0.0, 1.0)[:, :, None] * np.eye(b.shape[1])
    K = np.where(moving[:, :, None] & moving[:, None, :], A, rest)
    right = np.where(moving, -(b + (A @ fixed[:, :, None])[:, :, 0]), fixed)
    solved: Array = np.linalg.solve(K, right[:, :, None])
    return solved[:, :, 0]
