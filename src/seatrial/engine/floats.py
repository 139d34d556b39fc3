"""The engine on Python floats: slow, step by step, for reading, debugging and tests.

One lane, the same protocol as the kernels, the same order of operations.
"""

from __future__ import annotations

import numpy as np

from . import Array, Scalars, System


def rollout(
    system: System, state0: Scalars, series: Array, parameters: Scalars, *, dt: float, steps: int,
    memory0: Scalars = (), t0: float = 0.0, rk4: bool = True,
) -> Array:  # fmt: skip
    """Every row of one lane, shape (steps, stored).

    Args:
        state0: initial state, in the order of `system.states`.
        series: shape (steps, series), or (1, series) where they hold.
        parameters: values in the order of `system.parameters`.
        dt: time step [s].
        steps: number of samples, the first included.
        memory0: initial memory, in the order of `system.memory`.
        t0: time of the first sample [s].
        rk4: the classical Runge-Kutta method; False for Euler's.
    """
    z, m = tuple(map(float, state0)), tuple(map(float, memory0))
    p, logged = tuple(map(float, parameters)), ()
    out = np.empty((steps, len(system.stored)))
    for k in range(steps):
        acting: Scalars = tuple(map(float, series[min(k, len(series) - 1)]))
        after = m
        if system.before is not None:
            acting, after, logged = system.before(t0 + k * dt, dt, z, m, acting, p)
        out[k] = (*z, *m, *logged)
        if k < steps - 1:
            z, m = step(system, z, acting, p, dt, rk4), after
    return out


def step(system: System, z: Scalars, acting: Scalars, parameters: Scalars, dt: float, rk4: bool = True) -> Scalars:
    """The state one step later."""

    def slope(x: Scalars) -> Scalars:
        return system.derivative(x, acting, parameters)

    def moved(k: Scalars, by: float) -> Scalars:
        return tuple(a + by * b for a, b in zip(z, k, strict=True))

    k1 = slope(z)
    if not rk4:
        return moved(k1, dt)
    k2 = slope(moved(k1, 0.5 * dt))
    k3 = slope(moved(k2, 0.5 * dt))
    k4 = slope(moved(k3, dt))
    return moved(tuple(a + 2.0 * b + 2.0 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)), dt / 6.0)
