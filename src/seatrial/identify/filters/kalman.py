"""Kalman filters on the model of a ship: extended (linearised) and unscented (sigma points).

The state of a filter is that of the ship's model, then components of the current and parameters that are estimated.
These do not change by themselves; their process noise lets them walk.

Extended: the Jacobians are exact, those of the Runge-Kutta step itself.  The update is Joseph's form, which keeps the
covariance symmetric and positive whatever the gain.  Unscented: scaled sigma points (Julier 2002; weights as in Wan and
van der Merwe 2000), drawn again after each prediction.  The process noise is added, as the extended filter computes it
about the mean.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...core.symbolic import alone
from ...core.values import dataclass
from ...data import Array
from ...environment import CHANNELS, Environment
from ...ships import Ship
from ...simulate.loop import open_loop, open_loop_parameters
from .measurement import Sensor

Rows = NDArray[np.intp]


class Numeric:
    """A CasADi function called on buffers of its own, without the cost of conversion.

    Matrices come out column by column, so each buffer holds the transposed matrix.
    """

    def __init__(self, function: Any) -> None:
        """Args: function: all its inputs and outputs dense."""
        self._inputs: list[Any] = [np.zeros(_shape(function.sparsity_in(i))) for i in range(function.n_in())]
        self._outputs: list[Any] = [np.zeros(_shape(function.sparsity_out(i))) for i in range(function.n_out())]
        self._buffer, self._call = function.buffer()
        for i, values in enumerate(self._inputs):
            self._buffer.set_arg(i, memoryview(values))
        for i, values in enumerate(self._outputs):
            self._buffer.set_res(i, memoryview(values))

    def __call__(self, *inputs: Array | float) -> tuple[Array, ...]:
        """Outputs, copies: a column as shape (n,), a matrix transposed."""
        for held, given in zip(self._inputs, inputs, strict=True):
            held[...] = given
        self._call()
        return tuple(values.copy() for values in self._outputs)


def _shape(sparsity: Any) -> tuple[int, ...]:
    rows, columns = int(sparsity.size1()), int(sparsity.size2())
    return (rows,) if columns == 1 else (columns, rows)


@dataclass(frozen=True)
class FilterModel:
    """What a filter computes with; `trace` makes it.

    Attributes:
        names: of the states of the filter, shape (n,).
        channels: names of the readings, sensor by sensor, shape (m,).
        angle: which readings are angles, shape (m,).
        noise: standard deviation of the readings, shape (m,).
        delay: their age [s], shape (m,).
        step: (state, acting, dt) -> state after dt, its Jacobian transposed, that of half the step transposed.
        step_points: the same state for 2 n + 1 points, shape (points, n).
        read: (state, acting) -> readings, Jacobian transposed.
        read_points: readings of 2 n + 1 points, shape (points, m).
    """

    names: tuple[str, ...]
    channels: tuple[str, ...]
    angle: Array
    noise: Array
    delay: Array
    step: Numeric
    step_points: Numeric
    read: Numeric
    read_points: Numeric

    def wrapped(self, innovation: Array) -> Array:
        """Differences of readings with angles brought into [-pi, pi); the last axis is the reading."""
        turned = (innovation + math.pi) % (2.0 * math.pi) - math.pi
        return np.where(self.angle > 0.0, turned, innovation)


@alone
def trace(ship: Ship, more: tuple[str, ...], sensors: Sequence[Sensor]) -> FilterModel:
    """The ship with the parameters `more` as further states, and its sensors.

    Args:
        more: paths of the ship's model, or names of `CURRENT`.
    """
    system, values = open_loop(ship), open_loop_parameters(ship).tolist()
    own, controls = len(system.states), len(ship.model.controls)
    n, names = own + len(more), (*system.states, *more)
    where = [system.parameters.index(path) for path in more]
    z, a, dt = ca.SX.sym("z", n), ca.SX.sym("a", controls + len(CHANNELS)), ca.SX.sym("dt")
    acting = tuple(ca.vertsplit(a))

    def known(state: Any) -> tuple[Any, ...]:
        found = dict(enumerate(values)) | {index: state[own + k] for k, index in enumerate(where)}
        return tuple(found.values())

    def rates(state: Any) -> Any:
        moving = system.derivative(tuple(state[i] for i in range(own)), acting, known(state))
        return ca.vertcat(*moving, *([0.0] * len(more)))

    whole, half = rk4(rates, z, dt), rk4(rates, z, 0.5 * dt)
    around = Environment(*acting[controls:])
    drift = known(z)[-2:]
    around = around._replace(current_x=around.current_x + drift[0], current_y=around.current_y + drift[1])
    state = tuple(z[i] for i in range(own))
    read = ca.vertcat(*(value for sensor in sensors for value in sensor.read(state, around)))
    angle, noise, delay = np.array([(float(s.angle), s.sd, s.delay) for s in sensors for _ in s.channels]).T
    points = 2 * n + 1
    return FilterModel(
        names=names, channels=tuple(name for sensor in sensors for name in sensor.channels),
        angle=angle, noise=noise, delay=delay,
        step=Numeric(dense([z, a, dt], [whole, ca.jacobian(whole, z), ca.jacobian(half, z)])),
        step_points=Numeric(dense([z, a, dt], [whole]).map("points", "serial", points, [1, 2], [])),
        read=Numeric(dense([z, a], [read, ca.jacobian(read, z)])),
        read_points=Numeric(dense([z, a], [read]).map("points", "serial", points, [1], [])),
    )  # fmt: skip


def dense(inputs: list[Any], outputs: list[Any]) -> Any:
    """A CasADi function without structural zeros in its outputs, as `Numeric` takes it."""
    return ca.Function("f", inputs, [ca.densify(ca.SX(out)) for out in outputs], {"cse": True})


def rk4(rates: Any, z: Any, dt: Any) -> Any:
    """One step of the Runge-Kutta method, on symbols."""
    a = rates(z)
    b = rates(z + 0.5 * dt * a)
    c = rates(z + 0.5 * dt * b)
    d = rates(z + dt * c)
    return z + dt / 6.0 * (a + 2.0 * b + 2.0 * c + d)


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
class _Filter:
    """What both filters have.

    Attributes:
        model: the ship and its sensors.
        density: spectral density of the white noise on the rate of each state, shape (n,).
        step: longest Runge-Kutta step [s].
    """

    model: FilterModel
    density: Array
    step: float


@dataclass(frozen=True)
class Extended(_Filter):
    """Predictions and updates by linearisation.

    Attributes:
        iterations: how often an update is linearised again about its own result; 1 is the plain filter.
    """

    iterations: int = 1

    def predict(self, mean: Array, cov: Array, acting: Array, span: float) -> Moved:
        """The Gaussian `span` seconds later."""
        count = substeps(span, self.step)
        cross = cov
        for _ in range(count):
            mean, slope, blur = moved(self.model, mean, acting, span / count, self.density)
            cov, cross = slope @ cov @ slope.T + blur, cross @ slope.T
        return Moved(mean, _symmetric(cov), cross)

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
            first = first or (innovation, _symmetric(spread))
            gain = over(cov @ slope.T, spread)
            at = mean + gain @ (innovation - slope @ (mean - at))
        keep = np.eye(mean.size) - gain @ slope
        after = keep @ cov @ keep.T + gain @ noise @ gain.T  # Joseph's form
        return Updated(at, _symmetric(after), *(first or (reading[:0], noise)))


def _symmetric(cov: Array) -> Array:
    return 0.5 * (cov + cov.T)


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
class Unscented(_Filter):
    """Predictions and updates by sigma points.

    Attributes:
        low, high: bounds of the states; the model sees points beyond as on them, shape (n,).
        alpha, beta, kappa: spread of the points, weight of the middle one, and scaling.
    """

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
        return Moved(new, _symmetric(away @ (after - new) + noise), (away @ (before - mean)).T)

    def update(self, mean: Array, cov: Array, reading: Array, rows: Rows, acting: Array) -> Updated:
        """The Gaussian given the readings of the channels `rows`."""
        points = self._points(mean, cov)
        (found,) = self.model.read_points(np.clip(points, self.low, self.high), acting)
        middle, weights = self._weights(mean.size)
        # angles are averaged about the first point, so that they may lie on either side of the cut
        apart = self.model.wrapped(found - found[0])
        expected = found[0] + middle @ apart
        away = (apart - middle @ apart)[:, rows]
        spread = _symmetric((away.T * weights) @ away + np.diag(self.model.noise[rows] ** 2))
        innovation = self.model.wrapped(reading - expected)[rows]
        gain = over(((points - mean).T * weights) @ away, spread)
        return Updated(mean + gain @ innovation, _symmetric(cov - gain @ spread @ gain.T), innovation, spread)

    def _points(self, mean: Array, cov: Array) -> Array:
        root = self.alpha * math.sqrt(mean.size + self.kappa) * _root(cov).T
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
