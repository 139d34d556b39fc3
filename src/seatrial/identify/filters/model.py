"""Process and measurement model of a filter: step, readings and their exact Jacobians, traced once.

The state of the filter is that of the model, then whatever else is estimated: components of the
current, parameters.  These do not change by themselves; their process noise lets them walk.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ...data import Array
from ...environment import CHANNELS, Environment
from ...ships import Ship
from ...simulate.loop import open_loop, open_loop_parameters
from .measurement import Sensor


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
    acting = tuple(a[i] for i in range(controls + len(CHANNELS)))

    def known(state: Any) -> tuple[Any, ...]:
        found = list(values)
        for k, index in enumerate(where):
            found[index] = state[own + k]
        return tuple(found)

    def rates(state: Any) -> Any:
        moving = system.derivative(tuple(state[i] for i in range(own)), acting, known(state))
        return ca.vertcat(*moving, *([0.0] * len(more)))

    whole, half = _rk4(rates, z, dt), _rk4(rates, z, 0.5 * dt)
    around = Environment(*acting[controls:])
    drift = known(z)[-2:]
    around = around._replace(current_x=around.current_x + drift[0], current_y=around.current_y + drift[1])
    state = tuple(z[i] for i in range(own))
    read = ca.vertcat(*(value for sensor in sensors for value in sensor.read(state, around)))
    points = 2 * n + 1
    return FilterModel(
        names=names, channels=tuple(name for sensor in sensors for name in sensor.channels),
        angle=_each(sensors, [float(s.angle) for s in sensors]), noise=_each(sensors, [s.sd for s in sensors]),
        delay=_each(sensors, [s.delay for s in sensors]),
        step=Numeric(_function([z, a, dt], [whole, ca.jacobian(whole, z), ca.jacobian(half, z)])),
        step_points=Numeric(_function([z, a, dt], [whole]).map("points", "serial", points, [1, 2], [])),
        read=Numeric(_function([z, a], [read, ca.jacobian(read, z)])),
        read_points=Numeric(_function([z, a], [read]).map("points", "serial", points, [1], [])),
    )  # fmt: skip


def _each(sensors: Sequence[Sensor], figures: list[float]) -> Array:
    """A figure of each sensor, once for each of its channels."""
    return np.repeat(np.array(figures), [len(sensor.channels) for sensor in sensors])


def _function(inputs: list[Any], outputs: list[Any]) -> Any:
    return ca.Function("f", inputs, [ca.densify(ca.SX(out)) for out in outputs], {"cse": True})


def _rk4(rates: Any, z: Any, dt: Any) -> Any:
    a = rates(z)
    b = rates(z + 0.5 * dt * a)
    c = rates(z + 0.5 * dt * b)
    d = rates(z + dt * c)
    return z + dt / 6.0 * (a + 2.0 * b + 2.0 * c + d)
