"""Coordinates in which ridges of products are straight: logarithms of what a force is multiplied by.

Trials fix products: the lift of a rudder by its steering deduction, its slope by the share that the hull adds, the wake
by the slope of the thrust.  Along such a product a posterior is a bent ridge, and steps of one covariance leave it.  In
the logarithms of the factors it is straight.  Which coefficients are factors is known from the equations; the names are
those of the field (MMG), and a parameter that is none is its own coordinate.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass, replace
from ...data import Array
from .chains import Chains
from .walking import Walker

# A coefficient of this name acts as the factor offset + sign value: thrust by 1 - t_P, inflow by 1 - w_P0, the rudder's
# drag by 1 - t_R, its side force by 1 + a_H, its inflow by epsilon, all of it by the slope f_alpha.
FACTORS = {"t_P": (1.0, -1.0), "w_P0": (1.0, -1.0), "t_R": (1.0, -1.0), "a_H": (1.0, 1.0), "epsilon": (0.0, 1.0),
           "f_alpha": (0.0, 1.0)}  # fmt: skip


@dataclass(frozen=True)
class Coordinates:
    """Values and coordinates, one for one.

    Attributes:
        which: parameters that act as factors, shape (factors,).
        offset, sign: of each.
        lever: parameters x_H and a_H and the value of x_R, whose moment arm x_R + a_H x_H is a factor; None without.
    """

    which: NDArray[np.intp]
    offset: Array
    sign: Array
    lever: tuple[int, int, float] | None = None

    @staticmethod
    def of(paths: tuple[str, ...], values: Array, x_R: float | None = None) -> Coordinates:
        """Of parameters by their paths; a factor that is not above zero at the values is left as it is.

        Args:
            values: shape (groups, free).
            x_R: place of the rudder, where it is not free.
        """
        found = [(k, *FACTORS[name]) for k, path in enumerate(paths) if (name := path.rpartition(".")[2]) in FACTORS
                 and (FACTORS[name][0] + FACTORS[name][1] * values[:, k] > 0.0).all()]  # fmt: skip
        which, offset, sign = (np.array([one[k] for one in found]) for k in range(3))
        arm = [paths.index(f"rudder.{name}") if f"rudder.{name}" in paths else -1 for name in ("x_H", "a_H")]
        lever = None
        if x_R is not None and min(arm) >= 0:
            x, a = (values[:, k] for k in arm)
            lever = (arm[0], arm[1], x_R) if (x_R + a * x < 0.0).all() and (a > 0.0).all() else None
        return Coordinates(which.astype(np.intp), offset.astype(np.float64), sign.astype(np.float64), lever)

    @property
    def plain(self) -> bool:
        """Whether every parameter is its own coordinate."""
        return not len(self.which) and self.lever is None

    def into(self, values: Array) -> Array:
        """Coordinates of values, shape (lanes, free); NaN where a factor is not above zero."""
        out = values.copy()
        with np.errstate(all="ignore"):
            if self.lever is not None:
                x, a, x_R = self.lever
                out[:, x] = np.log(-(x_R + values[:, a] * values[:, x]))
            out[:, self.which] = np.log(self.offset + self.sign * values[:, self.which])
        return out

    def back(self, coordinates: Array) -> tuple[Array, Array]:
        """Values at coordinates, shape (lanes, free), and the logarithm of the volume there, (lanes,)."""
        out = coordinates.copy()
        with np.errstate(all="ignore"):
            out[:, self.which] = self.sign * (np.exp(coordinates[:, self.which]) - self.offset)
            volume = coordinates[:, self.which].sum(axis=1)
            if self.lever is not None:
                x, a, x_R = self.lever
                out[:, x] = (-np.exp(coordinates[:, x]) - x_R) / out[:, a]
                volume = volume + coordinates[:, x] - np.log(np.abs(out[:, a]))
        return out, volume

    def slope(self, values: Array) -> Array:
        """Derivatives of the coordinates with respect to the values, shape (lanes, free, free)."""
        lanes, n = values.shape
        out = np.tile(np.eye(n), (lanes, 1, 1))
        if self.lever is not None:
            x, a, x_R = self.lever
            arm = x_R + values[:, a] * values[:, x]
            out[:, x, x], out[:, x, a] = values[:, a] / arm, values[:, x] / arm
        out[:, self.which, self.which] = self.sign / (self.offset + self.sign * values[:, self.which])
        return out


@dataclass(frozen=True)
class Turned:
    """A density of values as one of their coordinates; bounds are where it ends.

    Attributes:
        density: log density of values, shape (lanes,).
        low, high: bounds of the values, shape (free,).
        inside: values of any lane where it is finite, shape (free,), which stand for those outside.
    """

    density: Callable[[Array], Array]
    coordinates: Coordinates
    low: Array
    high: Array
    inside: Array

    def __call__(self, coordinates: Array) -> Array:
        """Log density at coordinates, shape (lanes,); -inf outside of the bounds."""
        values, volume = self.coordinates.back(coordinates)
        good = np.isfinite(values).all(axis=1) & np.isfinite(volume)
        with np.errstate(invalid="ignore"):
            good &= ((values >= self.low) & (values <= self.high)).all(axis=1)
        found = self.density(np.where(good[:, None], values, self.inside))
        return np.where(good, found + np.where(good, volume, 0.0), -np.inf)


@dataclass(frozen=True)
class TurnedWalk:
    """A walk in coordinates, begun at values and told in values.

    Attributes:
        walker: of a `Turned` density.
    """

    walker: Walker
    coordinates: Coordinates

    @staticmethod
    def of(walker: Walker, coordinates: Coordinates, centre: Array) -> TurnedWalk:
        """The walk of `walker`, in coordinates; the Gaussian that its steps leave becomes the one alike at its mean.

        Args:
            centre: values where the density is finite, shape (groups, free); stand in for a mean without coordinates.
        """
        mean = np.where(np.isfinite(coordinates.into(walker.mean)).all(axis=1, keepdims=True), walker.mean, centre)
        spread = np.sqrt(np.einsum("gij,gj->gi", coordinates.slope(mean) ** 2, walker.sigma**2))
        free = np.full(walker.low.shape, np.inf)
        density = Turned(walker.density, coordinates, walker.low, walker.high, centre[0])
        return TurnedWalk(replace(walker, density=density, mean=coordinates.into(mean), sigma=spread, low=-free,
                                  high=free), coordinates)  # fmt: skip

    def begun(self, values: Array, root: Array) -> Chains:
        """Chains at values, with a root of the covariance of values; see `Walker.begun`.

        Each group takes the derivatives of the coordinates at the mean of its chains.
        """
        groups = self.walker.groups
        slope = self.coordinates.slope(values)
        middle = np.stack([slope[groups == g].mean(axis=0) for g in range(len(root))])
        across = middle @ root
        turned = np.linalg.cholesky(across @ across.transpose(0, 2, 1)).astype(np.float64)
        return self.walker.begun(self.coordinates.into(values), turned)

    def run(self, chains: Chains, each: Callable[[Chains], None] | None = None) -> Chains:
        """Make the draws that are left, in coordinates; see `Walker.run`."""
        return self.walker.run(chains, each)

    def told(self, chains: Chains) -> Chains:
        """The chains in values, their density that of values."""
        drawn, densities = chains.drawn.copy(), chains.densities.copy()
        for k in range(chains.move):
            drawn[k], volume = self.coordinates.back(chains.drawn[k])
            densities[k] -= volume
        values, volume = self.coordinates.back(chains.values)
        return replace(chains, values=values, density=chains.density - volume, drawn=drawn, densities=densities)
