"""The unscented Kalman filter: a Gaussian carried by points instead of slopes.

Scaled sigma points (Julier 2002; weights as in Wan and van der Merwe 2000), drawn anew after each
prediction.  The process noise is added, as the extended filter computes it about the mean.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..data import Array
from .ekf import Moved, Rows, Updated, moved, over, substeps
from .filter_model import FilterModel

_EXACT = 1e-14
"""Variance that is rounding, of what the states before it leave over and as a share of its own."""


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
    """The lower triangular square root of a covariance, also of a singular one, shape (n, n): root root^T = cov.

    What is known exactly has a column of zeros.  Eigenvectors would do as well, but where variances are alike they
    may lie anywhere, and rounding, which differs from one processor to the next, would choose the sigma points.
    """
    size = np.sqrt(np.maximum(np.diagonal(cov), 0.0))
    scale = np.where(size > 0.0, size, 1.0)
    left = cov / np.outer(scale, scale)
    root = np.zeros_like(left)
    for k in range(size.size):
        pivot = left[k, k]
        if pivot > _EXACT:
            root[k:, k] = left[k:, k] / math.sqrt(pivot)
            left = left - np.outer(root[:, k], root[:, k])
    return np.asarray(scale[:, None] * root, dtype=np.float64)
