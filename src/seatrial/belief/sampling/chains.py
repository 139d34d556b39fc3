"""Chains of a sampler: where they stand, and what they have drawn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from ...data import Array


@dataclass(frozen=True)
class Chains:
    """Where all chains stand, and what they have drawn.

    Attributes:
        values: shape (lanes, free).
        gradient: of the log density, shape (lanes, free), or (lanes, 0) where none is needed.
        density: log density, shape (lanes,).
        step: of a leapfrog in whitened units, shape (groups,), or squared of a walk by kind of move, shape (groups, 2).
        root: of the covariance that is the metric, shape (groups, free, free).
        move: number of moves that were kept, warm-up included.
        calls: evaluations of the density by each chain.
        drawn: values after each kept move, warm-up included, shape (moves, lanes, free).
        densities: shape (moves, lanes).
        accepted: acceptance probability of each move, shape (moves, lanes).
        divergent: moves of each chain after the warm-up whose energy was lost, shape (lanes,).
    """

    values: Array
    gradient: Array
    density: Array
    step: Array
    root: Array
    move: int
    calls: int
    drawn: Array
    densities: Array
    accepted: Array
    divergent: NDArray[np.intp]

    @staticmethod
    def begun(values: Array, density: Array, gradient: Array, step: Array, root: Array, count: int) -> Chains:
        """Chains at their starts, with room for `count` moves."""
        lanes = len(values)
        return Chains(
            values.copy(), gradient, density, step, root, 0, 1, np.zeros((count, *values.shape)),
            np.zeros((count, lanes)), np.zeros((count, lanes)), np.zeros(lanes, dtype=np.intp),
        )  # fmt: skip
