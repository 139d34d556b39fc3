"""A policy that passes on orders from outside, step by step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.parameters import Scalar, Scalars
from ..data import Array
from . import Policy


@dataclass(frozen=True)
class Given(Policy):
    """A policy that passes on the orders given to each step, one for each name in `given`."""

    given: tuple[str, ...] = ()

    @property
    def orders(self) -> tuple[str, ...]:
        """What it orders: what it is given."""
        return self.given

    def command(self, t: Scalar, state: Scalars, memory: Scalars, given: Scalars = ()) -> tuple[Scalars, Scalars]:
        """The orders as given."""
        return given, memory

    def schedule(self, dt: float, steps: int) -> Array:
        """Nothing fixed beforehand; shape (steps, orders)."""
        return np.zeros((steps, len(self.given)))
