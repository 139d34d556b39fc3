"""The extended Kalman filter: a Gaussian carried along the linearised model.

The Jacobians are exact, those of the Runge-Kutta step itself.  The update is Joseph's form, which
keeps the covariance symmetric and positive whatever the gain.

The unscented Kalman filter: a Gaussian carried by points instead of slopes.

Scaled sigma points (Julier 2002; weights as in Wan and van der Merwe 2000), drawn again after each
prediction.  The process noise is added, as the extended filter computes it about the mean.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...data import Array
from .model import FilterModel

Rows = NDArray[np.intp]


class Moved(NamedTuple):
    """A Gaussian carried to a later time: mean, covariance, and its covariance with where it was, (n, n)."""

    mean: Array
    cov: Array
    cross: Array


class Updated(NamedTuple):
    """A Gaussian after a reading, with the innovation and the covariance that it should have."""

    mean: Array
    cov: Array
    innovation: Array
    spread: Array


@dataclass(frozen=True)
class Extended:
    """Predictions and updates by linearisation.

    Attributes:
        model: the ship and its sensors.
        density: spectral density of the white noise on the rate of each state, shape (n,).
        step: longest Runge-Kutta step [s].
        iterations: how often an update is linearised again about its own result; 1 is the plain filter.
    """

    model: FilterModel
    density: Array
    step: float
    iterations: int = 1

    def predict(self, mean: Array, cov: Array, acting: Array, span: float) -> Moved:
        """The Gaussian `span` seconds later."""
        count = substeps(span, self.step)
        cross = cov
        for _ in range(count):
            mean, slope, blur = moved(self.model, mean, acting, span / count, self.density)
            cov, cross = slope @ cov @ slope.T + blur, cross @ slope.T
        return Moved(mean, 0.5 * (cov + cov.T), cross)

    def update(self, mean: Array, cov: Array, reading: Array, rows: Rows, acting: Array) -> Updated:
        """The Gaussian given the readings of the channels `rows`."""
        noise = np.diag(self.model.noise[rows] ** 2)
        at, first = mean, None
        slope = gain = np.zeros((0, 0))
        for _ in range(self.iterations):
            expected, slope = self.model.read(at, acting)
            slope = slope.T[rows]
            innovation = self.model.wrapped(reading - expected)[rows]
            spread = slope @ cov @ slope.T + noise
            first = first or (innovation, 0.5 * (spread + spread.T))
            gain = over(cov @ slope.T, spread)
            at = mean + gain @ (innovation - slope @ (mean - at))
        keep = np.eye(mean.size) - gain @ slope
        after = keep @ cov @ keep.T + gain @ noise @ gain.T  # Joseph's form
        return Updated(at, 0.5 * (after + after.T), *(first or (reading[:0], noise)))


def substeps(span: float, step: float) -> int:
    """Runge-Kutta steps, none longer than `step`, that make up `span` [s]."""
    return max(1, math.ceil(span / step - 1e-9))


def moved(model: FilterModel, mean: Array, acting: Array, dt: float, density: Array) -> tuple[Array, Array, Array]:
    """State after one step, Jacobian of the step, and covariance of the noise that came in on the way.

    The noise of each instant is carried to the end of the step by the Jacobian of what is left of it;
    the integral over the step is Simpson's.
    """
    after, slope, half = model.step(mean, acting, dt)
    blur = np.diag(density) + (slope.T * density) @ slope + 4.0 * (half.T * density) @ half
    return after, slope.T, dt / 6.0 * blur


def over(b: Array, spread: Array) -> Array:
    """What `b` times the inverse of a covariance is, whatever the units; a singular one is nudged off."""
    size = np.sqrt(np.maximum(np.diagonal(spread), 0.0))
    size = np.where(size > 0.0, size, 1.0)
    scaled = spread / np.outer(size, size)
    try:
        # a covariance has a Cholesky factor; without one it is singular to rounding
        np.linalg.cholesky(scaled)
    except np.linalg.LinAlgError:
        scaled = scaled + 1e-12 * np.eye(size.size)
    return np.linalg.solve(scaled, (b / size).T).T / size


# A pivot of a correlation matrix that is zero but for rounding.
_ZERO = 1e-12


@dataclass(frozen=True)
class Unscented:
    """Predictions and updates by sigma points.

    Attributes:
        model: the ship and its sensors.
        density: spectral density of the white noise on the rate of each state, shape (n,).
        step: longest Runge-Kutta step [s].
        low, high: bounds of the states; the model sees points beyond as on them, shape (n,).
        alpha, beta, kappa: spread of the points, weight of the middle one, and scaling.
    """

    model: FilterModel
    density: Array
    step: float
    low: Array
    high: Array
    alpha: float = 0.5
    beta: float = 2.0
    kappa: float = 0.0

    def predict(self, mean: Array, cov: Array, acting: Array, span: float) -> Moved:
        """The Gaussian `span` seconds later."""
        count = substeps(span, self.step)
        before = self._points(mean, cov)
        after = np.clip(before, self.low, self.high)
        # bounded states do not move; a spread cut off at the bound would shrink from step to step
        cut = before - after
        along, noise = mean, np.zeros_like(cov)
        for _ in range(count):
            (after,) = self.model.step_points(after, acting, span / count)
            along, slope, blur = moved(self.model, along, acting, span / count, self.density)
            noise = slope @ noise @ slope.T + blur
        after = after + cut
        middle, weights = self._weights(mean.size)
        new = middle @ after
        away = (after - new).T * weights
        spread = away @ (after - new) + noise
        return Moved(new, 0.5 * (spread + spread.T), (away @ (before - mean)).T)

    def update(self, mean: Array, cov: Array, reading: Array, rows: Rows, acting: Array) -> Updated:
        """The Gaussian given the readings of the channels `rows`."""
        points = self._points(mean, cov)
        (found,) = self.model.read_points(np.clip(points, self.low, self.high), acting)
        middle, weights = self._weights(mean.size)
        # angles are averaged about the first point, so that they may lie on either side of the cut
        apart = self.model.wrapped(found - found[0])
        expected = found[0] + middle @ apart
        away = (apart - middle @ apart)[:, rows]
        spread = (away.T * weights) @ away + np.diag(self.model.noise[rows] ** 2)
        spread = 0.5 * (spread + spread.T)
        innovation = self.model.wrapped(reading - expected)[rows]
        gain = over(((points - mean).T * weights) @ away, spread)
        after = cov - gain @ spread @ gain.T
        return Updated(mean + gain @ innovation, 0.5 * (after + after.T), innovation, spread)

    def _points(self, mean: Array, cov: Array) -> Array:
        n = mean.size
        reach = self.alpha * math.sqrt(n + self.kappa)
        root = reach * _root(cov).T
        return np.vstack([mean, mean + root, mean - root])

    def _weights(self, n: int) -> tuple[Array, Array]:
        """Weights of the points for mean and covariance, each shape (2 n + 1,)."""
        square = self.alpha**2 * (n + self.kappa)
        middle = np.full(2 * n + 1, 0.5 / square)
        weights = middle.copy()
        middle[0] = 1.0 - n / square
        weights[0] = middle[0] + 1.0 - self.alpha**2 + self.beta
        return middle, weights


def _root(cov: Array) -> Array:
    """Lower triangular square root of a covariance, also of a singular one, shape (n, n): root root^T = cov.

    Pivots of the correlation matrix at the level of rounding count as zero. Divided by the root of such a pivot,
    rounding errors would decide where the sigma points lie, and they differ from machine to machine.
    """
    size = np.sqrt(np.maximum(np.diagonal(cov), 0.0))
    scale = np.where(size > 0.0, size, 1.0)
    left = cov / np.outer(scale, scale)
    root = np.zeros_like(left)
    for k in range(len(left)):
        if left[k, k] > _ZERO:
            root[k:, k] = left[k:, k] / math.sqrt(left[k, k])
            left[k:, k:] -= np.outer(root[k:, k], root[k:, k])
    return np.asarray(scale[:, None] * root, dtype=np.float64)
