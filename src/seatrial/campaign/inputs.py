"""What differs from run to run: distributions by their inverse, for any design of points in the unit cube."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from ..core.parameters import ParameterError
from ..core.values import dataclass
from ..data import Array

Kind = Literal["constant", "uniform", "normal", "lognormal", "triangular", "choice", "values"]

SIZES = {"uniform": 2, "normal": 2, "lognormal": 2, "triangular": 3}
"""How many numbers define a distribution."""


@dataclass(frozen=True)
class Input:
    """One number that differs from run to run, or one that is set for all.

    Attributes:
        kind: "constant" [value]; "uniform" [low, high]; "normal" [mean, standard deviation]; "lognormal" [median,
            standard deviation of the logarithm]; "triangular" [low, mode, high]; "choice" [any, equally likely unless
            `weights`]; "values" [the levels of a grid].
        numbers: as `kind` says.
        weights: of a choice.
        within: a normal or lognormal distribution is cut off at these, and what is left has probability one.
        factor: whether the number multiplies that of the ship or manoeuvre, in place of replacing it.

    Raises:
        ParameterError: numbers that define no distribution.
    """

    kind: Kind
    numbers: tuple[float, ...]
    weights: tuple[float, ...] = ()
    within: tuple[float, float] | None = None
    factor: bool = False

    def __post_init__(self) -> None:
        wrong = self._wrong()
        if wrong is not None:
            raise ParameterError(f"{self.kind} {list(self.numbers)}: {wrong}")

    def _wrong(self) -> str | None:
        n, wanted = self.numbers, SIZES.get(self.kind)
        if not n or not all(map(math.isfinite, n)):
            return "give finite numbers"
        if wanted is not None and len(n) != wanted:
            return f"give {wanted} numbers"
        if self.kind in ("uniform", "triangular") and not (n[0] < n[-1] and list(n) == sorted(n)):
            return "give them in rising order"
        if self.kind in ("normal", "lognormal") and not n[1] > 0:
            return "the standard deviation is above zero"
        if self.kind == "lognormal" and not n[0] > 0:
            return "the median is above zero"
        if self.weights and (self.kind != "choice" or len(self.weights) != len(n) or min(self.weights) < 0
                             or sum(self.weights) <= 0):  # fmt: skip
            return "weights are for a choice, one for each number, none below zero"
        bell = self.kind in ("normal", "lognormal")
        if self.within is not None and not (bell and self.within[0] < self.within[1]):
            return "within = [low, high] cuts off a normal or lognormal distribution"
        return None

    @property
    def varies(self) -> bool:
        """Whether it takes a dimension of the design."""
        return self.kind != "constant"

    @property
    def ends(self) -> tuple[float, float]:
        """Least and greatest value; infinite of a distribution without an end."""
        if self.kind not in ("normal", "lognormal"):
            return min(self.numbers), max(self.numbers)
        low = -math.inf if self.kind == "normal" else 0.0
        return (low, math.inf) if self.within is None else (max(self.within[0], low), self.within[1])

    def of(self, share: Array) -> Array:
        """Values at cumulated probabilities in (0, 1), the same shape."""
        n = self.numbers
        if self.kind == "constant":
            return np.full_like(share, n[0])
        if self.kind == "uniform":
            return n[0] + (n[1] - n[0]) * share
        if self.kind == "triangular":
            return _triangular(n, share)
        if self.kind in ("choice", "values"):
            weights = np.array(self.weights or (1.0,) * len(n))
            edges = np.cumsum(weights / weights.sum())
            return np.array(n)[np.minimum(np.searchsorted(edges, share, side="right"), len(n) - 1)]
        return self._bell(share)

    def _bell(self, share: Array) -> Array:
        from scipy.special import ndtr, ndtri

        (middle, sigma), log = self.numbers, self.kind == "lognormal"
        if self.within is not None:
            low, high = (_standard(edge, middle, sigma, log) for edge in self.within)
            # from the nearer tail, where the probabilities are small numbers
            if low > 0:
                return self._scaled(-ndtri(ndtr(-low) + share * (ndtr(-high) - ndtr(-low))))
            share = ndtr(low) + share * (ndtr(high) - ndtr(low))
        return self._scaled(ndtri(share))

    def _scaled(self, z: Array) -> Array:
        middle, sigma = self.numbers
        return middle * np.exp(sigma * z) if self.kind == "lognormal" else middle + sigma * z


def _standard(edge: float, middle: float, sigma: float, log: bool) -> float:
    if not log:
        return (edge - middle) / sigma
    return math.log(edge / middle) / sigma if edge > 0 else -math.inf


def _triangular(n: Sequence[float], share: Array) -> Array:
    low, mode, high = n
    split = (mode - low) / (high - low)
    rising = low + np.sqrt(share * (high - low) * (mode - low))
    falling = high - np.sqrt((1.0 - share) * (high - low) * (high - mode))
    return np.where(share < split, rising, falling)
