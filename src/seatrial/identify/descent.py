"""The descent of multiple shooting: shortened steps, judged by the objective and an exact penalty on the gaps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..data import Array
from .condensed import Condensed, Point

# Damping of Marquardt's diagonal: start, least, ratio after a full step, ratio after a refused one.
DAMPING, _LEAST, _DOWN, _UP = 1e-4, 1e-12, 0.1, 8.0
# A refused step is shortened (or, where windows need not join, damped) so often at most.
_TRIES = 16
# Share of the promised decrease that a step must bring; gaps that no longer matter, in scales of their channels.
_ARMIJO, _CLOSED = 1e-4, 1e-6
# Relative rounding of a sum over all samples.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Search:
    """Where a descent stands.

    Attributes:
        point, cost: parameters and start states, and the objective there.
        iteration, evaluations: what it took.
        closed: whether the windows join.
        done: why it stopped, in words; "converged" where it did.
    """

    point: Point
    cost: float
    damping: float = DAMPING
    iteration: int = 0
    evaluations: int = 0
    closed: bool = False
    done: str = ""


def descend(
    objective: Condensed, start: Point, low: Array, high: Array, *,
    iterations: int, tolerance: float, each: Callable[[Search], None], damping: float = DAMPING,
) -> Search:  # fmt: skip
    """Go down from `start` until steps promise less than `tolerance` of the objective and the windows join.

    An exact penalty on the gaps (with weights from the multipliers, Powell 1978) says whether a step is good.
    """
    cost, gaps = objective.cost(start)
    search = Search(start, cost, damping)
    if not np.isfinite(cost):
        return replace(search, done="the model blows up within a window")
    weights = np.zeros(gaps.shape)
    while not search.done:
        if search.iteration >= iterations:
            return replace(search, done=f"stopped after {iterations} iterations")
        # Far from the optimum a linearised trajectory may overflow; such a step is refused below.
        with np.errstate(all="ignore"):
            search, weights = _iterate(objective, search, weights, low, high, tolerance)
        each(search)
    return search


def _iterate(
    objective: Condensed, search: Search, weights: Array, low: Array, high: Array, tolerance: float
) -> tuple[Search, Array]:  # fmt: skip
    point = search.point
    linear = objective.linear(point)
    damping, evaluations = search.damping, search.evaluations + 1
    d, share = objective.step(linear, point.p, damping, low, high), 1.0
    if objective.linked:  # else there are no gaps, and multipliers of unstable windows may overflow
        force = 1.1 * np.abs(objective.multipliers(linear, d))
        weights = np.maximum(force, 0.5 * (weights + force))
    before = 0.5 * linear.cost + float((weights * np.abs(linear.gaps)).sum())
    for _ in range(_TRIES):
        to = objective.moved(linear, point, d, share, low, high)
        cost, gaps = objective.cost(to)
        evaluations += 1
        after = 0.5 * cost + float((weights * np.abs(gaps)).sum())
        slope = min(linear.slope(d, weights), 0.0)
        if after <= before + _ARMIJO * share * slope + _ROUNDING * before:
            closed = bool((np.abs(gaps) <= _CLOSED * objective.span).all())
            still = before - after <= tolerance * before
            small = closed and still and (share == 1.0 or -slope <= tolerance * before)
            damping = max(damping * _DOWN, _LEAST) if share == 1.0 else damping * (_UP if share < 0.3 else 1.0)
            done = "converged" if small else ""
            return Search(to, cost, damping, search.iteration + 1, evaluations, closed, done), weights
        share *= 0.5
        if not objective.linked:
            damping, share = damping * _UP, 1.0
            d = objective.step(linear, point.p, damping, low, high)
    closed = bool((np.abs(linear.gaps) <= _CLOSED * objective.span).all())
    return replace(search, iteration=search.iteration + 1, evaluations=evaluations, closed=closed,
                   done="no further decrease"), weights  # fmt: skip
