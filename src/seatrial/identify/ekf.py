"""The extended Kalman filter: a Gaussian carried along the linearised model.

The Jacobians are exact, those of the Runge-Kutta step itself.  The update is Joseph's form, which
keeps the covariance symmetric and positive whatever the gain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..data import Array
from .filter_model import FilterModel

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
        iterations: how often an update linearises anew about its own result; 1 is the plain filter.
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
