"""The gradient search from many starts at once."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ...core.values import dataclass
from ...data import Array
from ..vector import Vector
from .gauss_newton import STILL
from .shooting import Trajectory


@dataclass(frozen=True)
class MultiStart(Trajectory):
    """`Trajectory` from many starts, every trial run through and every row compared, to the last digits.

    A descent has converged where two steps decrease the objective by less than `tolerance` (relative).
    """

    window: float | None = None
    every: int | None = 1
    iterations: int = 60
    tolerance: float = 1e-10
    starts: int = 20
    still: ClassVar[int] = STILL

    def drawn(self, vector: Vector) -> Array:
        """Starts as of `Trajectory`, one parameter drawn after the other."""
        out = vector.drawn(self.starts, np.random.default_rng(self.seed))
        out[0] = vector.start
        return out
