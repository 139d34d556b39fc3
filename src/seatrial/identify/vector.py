"""Vector of the free parameters: start, bounds, prior and names as arrays, and back into a model or a ship."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import Free, ParameterError, Scalar, read, update
from ..core.values import dataclass, replace
from ..data import Array
from ..ships import Ship

# Half width of the range that a Gaussian prior stands for, in its standard deviations.
_REACH = 3.0
# Of a parameter without prior and interval, so many times its size: anything.
_UNKNOWN = 1e3
# Least eigenvalue of a matrix of correlations; below it some combination would be known for certain.
_SINGULAR = 1e-12


@dataclass(frozen=True)
class Vector:
    """The free parameters in the order of their declaration; every array has shape (free,), or is said to be a matrix.

    Raises:
        ParameterError: priors whose correlations contradict each other.
    """

    free: tuple[Free, ...]

    def __post_init__(self) -> None:
        pairs = [frozenset((f.path, path)) for f in self.free for path, _ in f.tied]
        if len(set(pairs)) < len(pairs) or any(len(pair) == 1 for pair in pairs):
            raise ParameterError("correlations of priors: state each pair of different parameters once")
        if pairs and np.linalg.eigvalsh(self.correlation)[0] <= _SINGULAR:
            tied = ", ".join(f.path for f in self.free if f.tied)
            raise ParameterError(f"correlations of priors: no covariance has those of {tied}")

    @staticmethod
    def of(free: Sequence[Free]) -> Vector:
        """The vector of these parameters."""
        return Vector(tuple(free))

    def __len__(self) -> int:
        return len(self.free)

    @property
    def paths(self) -> tuple[str, ...]:
        """Dotted paths in the model."""
        return tuple(f.path for f in self.free)

    @property
    def start(self) -> Array:
        """Values the search starts from."""
        return np.array([f.start for f in self.free])

    @property
    def low(self) -> Array:
        """Lower bounds; -inf where there is none."""
        return np.array([f.low for f in self.free])

    @property
    def high(self) -> Array:
        """Upper bounds; inf where there is none."""
        return np.array([f.high for f in self.free])

    @property
    def sigma(self) -> Array:
        """Standard deviations of the Gaussian priors; inf where there is none."""
        return np.array([f.sigma for f in self.free])

    @property
    def scale(self) -> Array:
        """Typical sizes of a change; see `Free.scale`."""
        return np.array([f.scale for f in self.free])

    @cached_property
    def correlation(self) -> Array:
        """Matrix of the correlations of the Gaussian priors; those with a parameter that is not free do not count."""
        at, out = {f.path: k for k, f in enumerate(self.free) if np.isfinite(f.sigma)}, np.eye(len(self.free))
        for k, path, c in ((at[f.path], path, c) for f in self.free for path, c in f.tied if path in at):
            out[k, at[path]] += c
            out[at[path], k] += c
        return out

    def root(self, otherwise: Array) -> Array:
        """Matrix L with L L' the covariance of the Gaussian priors; `otherwise` deviates what has none."""
        sigma = np.where(np.isfinite(self.sigma), self.sigma, otherwise)
        lower: Array = np.asarray(np.linalg.cholesky(self.correlation), dtype=np.float64)
        return sigma[:, None] * lower

    @property
    def precision(self) -> Array:
        """Inverse covariance matrix of the Gaussian priors: weights of offsets in an objective; 0 without prior."""
        weight = 1.0 / self.sigma
        return weight[:, None] * np.linalg.inv(self.correlation) * weight

    @property
    def mean(self) -> Array:
        """Means of the Gaussian priors; the start where a parameter has no prior."""
        return np.array([f.prior if np.isfinite(f.sigma) and np.isfinite(f.prior) else f.start for f in self.free])

    @property
    def variance(self) -> Array:
        """Variances before the data: of the Gaussian prior, else of a uniform one over the interval, else inf."""
        return np.where(np.isfinite(self.sigma), self.sigma**2, (self.high - self.low) ** 2 / 12.0)

    def reach(self, values: Array) -> Array:
        """How far `values` may be off where no data tell: the sigma of the prior, else the bound that is farther away.

        A parameter with neither may be off by a thousand times its size.
        """
        farther = np.maximum(self.high - values, values - self.low)
        size = self.size(values)
        wide = np.where(np.isfinite(farther), farther, _UNKNOWN * np.where(size > 0, size, 1.0))
        return np.where(np.isfinite(self.sigma), self.sigma, wide)

    def held(self, values: Array) -> Array:
        """Matrix of the information that priors and intervals give; 0 where there is neither."""
        boxed = np.isfinite(self.variance) & np.isinf(self.sigma)
        return self.precision + np.diag(np.where(boxed, self.reach(values) ** -2.0, 0.0))

    @property
    def box(self) -> tuple[Array, Array]:
        """Bounds, and three standard deviations about the prior mean where that is narrower; may be infinite."""
        reach = _REACH * self.sigma
        return np.maximum(self.low, self.mean - reach), np.minimum(self.high, self.mean + reach)

    def size(self, values: Array) -> Array:
        """Magnitude of each parameter: the largest of start, prior mean and `values`."""
        known = [max(abs(f.start), abs(f.prior) if np.isfinite(f.sigma) else 0.0) for f in self.free]
        return np.maximum(known, np.abs(values))

    def at_bound(self, values: Array) -> tuple[str, ...]:
        """Paths of the parameters that lie on or beyond a bound."""
        return tuple(f.path for f, v in zip(self.free, values, strict=True) if v <= f.low or v >= f.high)

    def by_path(self, values: Array) -> dict[str, float]:
        """Values by path."""
        return dict(zip(self.paths, (float(v) for v in values), strict=True))

    def current(self, model: Any) -> Array:
        """Values that the parameters have in `model`."""
        return np.array([float(read(model, path)) for path in self.paths])

    def model(self, model: Any, values: Scalar) -> Any:
        """`model` with these values, an array or a vector of CasADi symbols."""
        return update(model, {path: values[k] for k, path in enumerate(self.paths)})

    def ship(self, ship: Ship, values: Array) -> Ship:
        """`ship` with these values, also beyond what they can be: the outcome of a search is not refused."""
        return ship.moved(self.by_path(values))

    def positions(self, names: Sequence[str]) -> NDArray[np.intp]:
        """Positions among `names`, such as the parameters of a compiled system."""
        return np.array([names.index(path) for path in self.paths], dtype=np.intp)

    def started(self, starts: Mapping[str, float]) -> tuple[Free, ...]:
        """The free parameters with other starts, by path, within their bounds; those not named keep theirs."""
        return tuple(replace(f, start=min(max(starts.get(f.path, f.start), f.low), f.high)) for f in self.free)

    def of_prior(self, count: int, rng: np.random.Generator) -> Array:
        """Draws of the Gaussian priors whatever the bounds, shape (count, free); the mean of what has no prior."""
        unit, root = rng.standard_normal((count, len(self))), self.root(np.zeros(len(self)))
        return self.mean + np.einsum("cj,ij->ci", unit, root)

    def drawn(self, count: int, rng: np.random.Generator) -> Array:
        """Random starts, shape (count, free): uniform within the bounds, else normal about the start by `scale`.

        One parameter is drawn after the other, `count` times each.
        """
        out = np.empty((count, len(self.free)))
        for k, f in enumerate(self.free):
            boxed = np.isfinite(f.high - f.low)
            values = rng.uniform(f.low, f.high, count) if boxed else rng.normal(f.start, f.scale, count)
            out[:, k] = np.clip(values, f.low, f.high)
        return out
