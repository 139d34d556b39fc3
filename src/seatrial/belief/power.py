"""How much less a likelihood is worth than it claims, by trials that are left out of the fit in turn.

A model that lacks something misses an unseen trial by more than the covariance of its parameters says, however many
samples the trials of the fit have.  The likelihood is therefore raised to a power 1/T (Holmes and Walker 2017), with T
such that the errors of left-out trials are as large as the parameters then explain.  Directions that the trials fix
become wider by the root of T; those that they leave to the prior stay as wide as it.  Few trials know T badly: each
draw of the parameters has a T of its own, by as many degrees of freedom as there are trials.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np

from ..core.parameters import Free
from ..core.records import Limits
from ..core.values import dataclass, field
from ..data import Array
from ..identify.vector import Vector

LEAST = 3
"""Fewest trials whose errors say anything of those of another."""

# A parameter without a prior has one of so many times its own sigma.
_WIDE = 100.0

@dataclass(frozen=True)
class Power:
    """What left-out trials say of the likelihood of a fit.

    Attributes:
        factor: T, by which the logarithm of the likelihood is divided; at least 1.
        trials: that were left out in turn: its degrees of freedom.
        errors: mean square over channels of the error of each trial over what the fit of the others expects, by name.
        left: the same over all trials where the likelihood counts by 1/T; above 1 where the priors are too narrow.
        widened: factor by path of sigmas of the fit by its own residuals, in whose place T stands.
    """

    factor: Annotated[float, Limits(least=1.0)]
    trials: Annotated[int, Limits(least=LEAST)]
    errors: Mapping[str, float]
    left: Annotated[float, Limits(least=0.0)]
    widened: Mapping[str, Annotated[float, Limits(least=1.0)]] = field(default_factory=dict[str, float])

    def of(self, free: tuple[Free, ...], covariance: Array) -> Array:
        """The covariance that T is of, from that of the fit: errors of the form count once."""
        by = np.array([self.widened.get(one.path, 1.0) for one in free])
        return covariance / np.outer(by, by)

    def deviations(self, fixed: Array, count: int, rng: np.random.Generator) -> Array:
        """Standard deviation in each of `directions` of so many draws, each with a factor of its own, (count, free)."""
        factor = self.factor * self.trials / rng.chisquare(self.trials, count)
        return np.sqrt(max(self.left, 1.0)) / np.sqrt(1.0 + fixed / np.maximum(factor, 1.0)[:, None])

    def covariance(self, free: tuple[Free, ...], covariance: Array) -> Array:
        """Covariance of the parameters at T itself."""
        across, fixed = directions(free, self.of(free, covariance))
        return max(self.left, 1.0) * (across / (1.0 + fixed / self.factor)) @ across.T

    def shares(self, free: tuple[Free, ...], covariance: Array) -> Array:
        """Part of the variance of its prior that each parameter keeps at T, shape (free,); 0 of one without a prior."""
        sigma = Vector.of(free).sigma
        return np.where(np.isfinite(sigma), np.diag(self.covariance(free, covariance)) / sigma**2, 0.0)

    def numbers(self) -> dict[str, Any]:
        """For JSON."""
        return {"factor": self.factor, "trials": self.trials, "left": self.left, "errors": dict(self.errors),
                "words": list(self.words)}  # fmt: skip

    @property
    def words(self) -> tuple[str, ...]:
        """What it says, one line each."""
        before = np.sqrt(np.mean(list(self.errors.values())))
        told = (f"each of {self.trials} trials is missed by {before:.2g} times what the fit to the others expects "
                f"(root mean square), so the data count by 1/{self.factor:.2g}")  # fmt: skip
        if self.left <= 1.1:
            return (told,)
        return (told, f"the priors are too narrow for these errors: draws are widened by {np.sqrt(self.left):.2g} "
                      "besides; free more parameters, or widen their priors")  # fmt: skip


def directions(free: tuple[Free, ...], covariance: Array) -> tuple[Array, Array]:
    """Directions in which prior and data are independent, and how the data fix them.

    Returns:
        Columns that are one prior sigma long, shape (free, free), and the curvature of the likelihood in each, that of
        the prior being 1, shape (free,).
    """
    root = Vector.of(free).root(_WIDE * np.sqrt(np.diag(covariance)))
    back = np.linalg.inv(root)
    weight, vectors = np.linalg.eigh(back @ covariance @ back.T)
    fixed = 1.0 / np.clip(weight, 1e-300, 1.0) - 1.0
    return root @ vectors, fixed
