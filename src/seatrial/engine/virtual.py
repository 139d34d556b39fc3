"""The engine without a compiler: CasADi's virtual machine steps all lanes from Python.

Same numbers as the SIMD kernels to rounding, some thirty times slower; chosen where there is no C
compiler or no vector mathematics library.  A plant that cannot be traced (a network) moves on arrays, its actuators
and its policy on CasADi's machine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from threadpoolctl import ThreadpoolController

from ..core.symbolic import Function
from . import Array, Plant, System, trace

_FEW = 32
"""Lanes below which one thread is faster: threads that wait for each other's small products cost most of the time."""


@dataclass(frozen=True)
class Packed:
    """Series of shape (lanes, steps, channels)."""

    series: Array
    lanes: int

    @property
    def steps(self) -> int:
        """Steps that the series cover; one where they hold."""
        return self.series.shape[1]

    @property
    def channels(self) -> int:
        """Channels of the series."""
        return self.series.shape[2]


def pack(series: Array) -> Packed:
    """Series as they are; the counterpart of `simd.pack`."""
    return Packed(series, series.shape[0])


def parameters_of(system: System, lanewise_names: tuple[str, ...], lanewise: Array, shared: Array) -> Array:
    """Parameters of every lane, shape (max(parameters, 1), lanes)."""
    lanes = lanewise.shape[0]
    P = np.repeat(shared.reshape(-1, 1), lanes, axis=1) if shared.size else np.zeros((1, lanes))
    for k, name in enumerate(lanewise_names):
        P[system.parameters.index(name)] = lanewise[:, k]
    return P


def rows_of(values: Array) -> Array:
    """(lanes, n) -> (max(n, 1), lanes), as the traced functions take it."""
    return values.T if values.shape[1] else np.zeros((1, values.shape[0]))


@dataclass(frozen=True)
class VirtualRollout:
    """A system on the virtual machine, for plain integration."""

    system: System
    lanewise: tuple[str, ...]
    rhs: Function
    before: Function | None

    @staticmethod
    def compile(system: System, lanewise: tuple[str, ...]) -> VirtualRollout:
        """Trace; there is nothing to compile."""
        return VirtualRollout(system, lanewise, trace.right_hand_side(system), trace.preparation(system))

    def evaluate(self, state: Array, acting: Array, lanewise: Array, shared: Array) -> Array:
        """Rates of every lane for one call of the right-hand side, shape (lanes, states)."""
        P = parameters_of(self.system, self.lanewise, lanewise, shared)
        return np.array(self.rhs.map(state.shape[0])(rows_of(state), rows_of(acting), P)).T

    def run(
        self, state0: Array, memory0: Array, series: Packed, lanewise: Array, shared: Array, *,
        t0: float, dt: float, steps: int, every: int, rk4: bool, threads: int,
    ) -> Array:  # fmt: skip
        """Stored rows of every lane, shape (lanes, rows, stored); `threads` has no effect."""
        lanes, (ns, nm) = state0.shape[0], (len(self.system.states), len(self.system.memory))
        P = parameters_of(self.system, self.lanewise, lanewise, shared)
        rhs = self.rhs.map(lanes)
        before = self.before.map(lanes) if self.before is not None else None
        na = len(self.system.acting or self.system.series)
        z, m = state0.T.copy(), memory0.T.copy()
        out = np.empty((lanes, (steps - 1) // every + 1, len(self.system.stored)))
        one = np.ones((1, lanes))
        for k in range(steps):
            s = rows_of(series.series[:, min(k, series.series.shape[1] - 1)])
            y = np.array(before((t0 + k * dt) * one, dt * one, z, rows_of(m.T), s, P)) if before else s
            if k % every == 0:
                out[:, k // every] = np.concatenate([z, m, y[na + nm :] if before else y[:0]]).T
            if k < steps - 1:
                z, m = _step(rhs, z, y[:na], P, dt, rk4), (y[na : na + nm] if before else m)
        return out[:, :, : ns + nm + len(self.system.logged)]


def _step(rhs: Function, z: Array, a: Array, P: Array, dt: float, rk4: bool) -> Array:
    k1 = np.array(rhs(z, a, P))
    if not rk4:
        return z + dt * k1
    k2 = np.array(rhs(z + 0.5 * dt * k1, a, P))
    k3 = np.array(rhs(z + 0.5 * dt * k2, a, P))
    k4 = np.array(rhs(z + dt * k3, a, P))
    return z + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@dataclass(frozen=True)
class VirtualSensitivity:
    """An open-loop system on the virtual machine, with exact forward sensitivities."""

    system: System
    free: tuple[str, ...]
    lanewise: tuple[str, ...]
    jacobian: trace.Jacobian

    @staticmethod
    def compile(system: System, free: tuple[str, ...], lanewise: tuple[str, ...]) -> VirtualSensitivity:
        """Trace and differentiate."""
        return VirtualSensitivity(system, free, lanewise, trace.jacobian(system, free))

    def run(
        self, state0: Array, series: Packed, lanewise: Array, shared: Array, *,
        dt: float, steps: int, every: int, rk4: bool, threads: int,
    ) -> tuple[Array, Array]:  # fmt: skip
        """States (lanes, rows, states) and derivatives (lanes, rows, states, free + states)."""
        lanes, ns = state0.shape
        P = parameters_of(self.system, self.lanewise, lanewise, shared)
        z, d = state0.copy(), np.zeros((lanes, ns, len(self.free) + ns))
        d[:, range(ns), range(len(self.free), len(self.free) + ns)] = 1.0
        rows = (steps - 1) // every + 1
        Z, D = np.empty((lanes, rows, ns)), np.empty((lanes, rows, *d.shape[1:]))
        for k in range(steps):
            if k % every == 0:
                Z[:, k // every], D[:, k // every] = z, d
            if k < steps - 1:
                a = rows_of(series.series[:, min(k, series.series.shape[1] - 1)])
                z, d = self._step(z, d, a, P, dt, rk4)
        return Z, D

    def _slope(self, z: Array, d: Array, a: Array, P: Array) -> tuple[Array, Array]:
        ns, nf = z.shape[1], len(self.free)
        y = np.array(self.jacobian.function.map(z.shape[0])(z.T, a, P)).T
        slope = np.zeros_like(d)
        for n, (i, k) in enumerate(self.jacobian.A):
            slope[:, i] += y[:, ns + n, None] * d[:, k]
        first = ns + len(self.jacobian.A)
        for n, i in enumerate(self.jacobian.rows):
            slope[:, i, :nf] += y[:, first + n * nf : first + (n + 1) * nf]
        return y[:, :ns], slope

    def _step(self, z: Array, d: Array, a: Array, P: Array, dt: float, rk4: bool) -> tuple[Array, Array]:
        k1, s1 = self._slope(z, d, a, P)
        if not rk4:
            return z + dt * k1, d + dt * s1
        k2, s2 = self._slope(z + 0.5 * dt * k1, d + 0.5 * dt * s1, a, P)
        k3, s3 = self._slope(z + 0.5 * dt * k2, d + 0.5 * dt * s2, a, P)
        k4, s4 = self._slope(z + dt * k3, d + dt * s3, a, P)
        return z + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4), d + dt / 6 * (s1 + 2 * s2 + 2 * s3 + s4)


@dataclass(frozen=True)
class SteppedRollout:
    """A system with a `plant`, all lanes together, one step after the other by Euler's rule."""

    system: System
    lanewise: tuple[str, ...]
    before: Function | None

    @staticmethod
    def compile(system: System, lanewise: tuple[str, ...]) -> SteppedRollout:
        """Trace what is beside the plant: actuators and policy."""
        return SteppedRollout(system, lanewise, trace.preparation(system))

    def evaluate(self, state: Array, acting: Array, lanewise: Array, shared: Array) -> Array:
        """Rates of every lane for one sample, as if it had held for ever; shape (lanes, states)."""
        return self._plant(np.zeros((state.shape[0], len(self.system.hidden)))).rates(state, acting)

    def run(
        self, state0: Array, memory0: Array, series: Packed, lanewise: Array, shared: Array, *,
        t0: float, dt: float, steps: int, every: int, rk4: bool, threads: int,
    ) -> Array:  # fmt: skip
        """Stored rows of every lane, shape (lanes, rows, stored); `rk4` has no effect."""
        at_once = ThreadpoolController().limit(limits=1 if state0.shape[0] < _FEW else threads, user_api="blas")
        with at_once, np.errstate(over="ignore", invalid="ignore"):  # the engine reports a lane that blows up
            return self._stepped(state0, memory0, series, parameters_of(self.system, self.lanewise, lanewise, shared),
                                 t0, dt, steps, every)  # fmt: skip

    def _stepped(
        self, state0: Array, memory0: Array, series: Packed, P: Array, t0: float, dt: float, steps: int, every: int
    ) -> Array:
        system, lanes = self.system, state0.shape[0]
        nm, na = len(system.memory), len(system.acting or system.series)
        z, m, plant = state0.copy(), memory0[:, :nm], self._plant(memory0[:, nm:])
        before = self.before.map(lanes) if self.before is not None else None
        out, one = np.empty((lanes, (steps - 1) // every + 1, len(system.stored))), np.ones((1, lanes))
        for k in range(steps):
            acting = series.series[:, min(k, series.steps - 1)]
            after, logged = m, m[:, :0]
            if before is not None:
                y = np.array(before((t0 + k * dt) * one, dt * one, rows_of(z), rows_of(m), rows_of(acting), P)).T
                acting, after, logged = y[:, :na], y[:, na : na + nm], y[:, na + nm :]
            if k % every == 0:
                out[:, k // every] = np.concatenate([z, m, logged], axis=1)
            if k < steps - 1:
                z, m = z + dt * plant.rates(z, acting), after
        return out

    def _plant(self, hidden: Array) -> Plant:
        if self.system.plant is None:
            raise ValueError("a system without a plant is traced, not stepped")
        return self.system.plant(hidden)
