"""Log density of a posterior without its gradient: predictions of many values in one call of the kernel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...data import Array
from ...simulate.lanes import run
from .density import Density

# Inputs of the windows of so many numbers are repeated for values that run together, 80 MB.
_STORED = 10_000_000


@dataclass(frozen=True)
class Plain:
    """The density of a posterior whose starts of windows are measured, for a fixed number of values.

    Attributes:
        posterior: what is evaluated.
        packed: inputs of the windows, repeated for `chunk` values.
        chunk: values that run together.
    """

    posterior: Density
    packed: Any
    chunk: int

    @staticmethod
    def of(posterior: Density, count: int) -> Plain:
        """The density of `count` values at once."""
        many = posterior.many
        chunk = min(max(_STORED // many.windows.series.size, 1), count)
        return Plain(posterior, many.kernel.pack(np.tile(many.windows.series, (chunk, 1, 1))), chunk)

    def __call__(self, values: Array) -> Array:
        """Log density, but for a constant, shape (values,); -inf where the model blows up."""
        vector, data = self.posterior.many.problem.vector, self.posterior.data
        away = values - (vector.mean if data is None else data.mean)
        squares = np.concatenate([self._squares(values, a) for a in range(0, len(values), self.chunk)])
        density = -0.5 * (squares / self.posterior.variance + (vector.precision * away**2).sum(axis=1))
        return np.where(np.isfinite(density), density, -np.inf)

    def _squares(self, values: Array, first: int) -> Array:
        """Squared residuals of the chunk of values that begins with `first`."""
        many, cut, data = self.posterior.many, self.posterior.many.windows, self.posterior.data
        index = np.minimum(np.arange(first, first + self.chunk), len(values) - 1)
        lanes = len(cut.state0)
        state0 = np.tile(cut.state0, (self.chunk, 1)) if data is None else data.state0[index].reshape(
            self.chunk * lanes, -1)  # fmt: skip
        own = np.repeat(values[index], lanes, axis=0)
        runs = many.lanes(state0, self.packed, own)
        rows = run(runs, many.grid, None, many.threads).values[:, :, : cut.scale.shape[2]]
        used = min(self.chunk, len(values) - first)
        rows = rows.reshape(self.chunk, *cut.scale.shape)[:used]
        found = np.empty(used)
        with np.errstate(all="ignore"):
            for k, one in enumerate(rows):
                e = np.where(cut.scale > 0, one - (cut.measured if data is None else data.measured[index[k]]), 0.0)
                e *= cut.scale
                found[k] = (e * e).sum()
        return found
