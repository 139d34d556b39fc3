"""The engine without a compiler: CasADi's virtual machine steps all lanes from Python.

Same numbers as the SIMD kernels to rounding, some thirty times slower; chosen where there is no C
compiler or no vector mathematics library.  A plant that cannot be traced (a network) moves on arrays, its actuators
and its policy on CasADi's machine.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..core.symbolic import Function
from ..core.values import dataclass
from . import Array, System, Untraced, trace

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


def _moved(slope: Callable[[Array], Array], z: Array, dt: float, rk4: bool) -> Array:
    """`z` one step later, by the classical Runge-Kutta method or Euler's."""
    k1 = slope(z)
    if not rk4:
        return z + dt * k1
    k2 = slope(z + 0.5 * dt * k1)
    k3 = slope(z + 0.5 * dt * k2)
    k4 = slope(z + dt * k3)
    return z + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@dataclass(frozen=True)
class VirtualRollout:
    """A system for plain integration; one with a plant moves all lanes together by Euler's rule.

    Attributes:
        rhs: right-hand side; None of a system with a plant.
        before: actuators and policy; None where the series themselves act.
    """

    system: System
    lanewise: tuple[str, ...]
    rhs: Function | None
    before: Function | None
    kicks: tuple[Function, Function, Function] | None = None

    pack = staticmethod(pack)

    @staticmethod
    def compile(system: System, lanewise: tuple[str, ...]) -> VirtualRollout:
        """Trace what can be traced; there is nothing to compile."""
        rhs = trace.right_hand_side(system) if system.plant is None else None
        return VirtualRollout(system, lanewise, rhs, trace.preparation(system), trace.kicks(system))

    def evaluate(self, state: Array, acting: Array, lanewise: Array, shared: Array) -> Array:
        """Rates of every lane for one call of the right-hand side, shape (lanes, states).

        A plant answers as if the sample had held for ever.
        """
        if self.rhs is None:
            return self._plant(np.zeros((state.shape[0], len(self.system.hidden)))).rates(state, acting)
        P = parameters_of(self.system, self.lanewise, lanewise, shared)
        return np.array(self.rhs.map(state.shape[0])(rows_of(state), rows_of(acting), P)).T

    def run(
        self, state0: Array, memory0: Array, series: Packed, lanewise: Array, shared: Array, *,
        t0: float, dt: float, steps: int, every: int, rk4: bool, threads: int,
    ) -> Array:  # fmt: skip
        """Stored rows of every lane, shape (lanes, rows, stored).

        `threads` are those of a plant's products of matrices; `rk4` has no effect on a plant.
        """
        P = parameters_of(self.system, self.lanewise, lanewise, shared)
        with np.errstate(over="ignore", invalid="ignore"):  # the engine reports a lane that blows up
            if self.rhs is not None:
                rhs = self.rhs.map(state0.shape[0])
                return self._stepped(
                    lambda z, a: self._kicked(lambda x: np.array(rhs(x.T, rows_of(a), P)).T, z, a, P, dt, rk4),
                    state0, memory0, series, P, t0, dt, steps, every,
                )  # fmt: skip
            plant = self._plant(memory0[:, len(self.system.memory) :])
            from threadpoolctl import ThreadpoolController  # looks at every library of the process

            with ThreadpoolController().limit(limits=1 if state0.shape[0] < _FEW else threads, user_api="blas"):
                return self._stepped(
                    lambda z, a: z + dt * plant.rates(z, a), state0, memory0, series, P, t0, dt, steps, every
                )

    def _kicked(
        self, slope: Callable[[Array], Array], z: Array, a: Array, P: Array, dt: float, rk4: bool
    ) -> Array:
        """`z` one step later, with the impulses of contact around each part of the step."""
        if self.kicks is None or self.system.kicks is None:
            return _moved(slope, z, dt, rk4)
        touch, first, last = (one.map(z.shape[0]) for one in self.kicks)
        steps = self.system.kicks.substeps
        h = np.full((1, z.shape[0]), dt / steps)
        touched = touch(z.T, a.T)
        for _ in range(steps):
            start = np.array(first(h, z.T, slope(z).T, a.T, touched, P))
            z = _moved(slope, start[:-1].T, dt / steps, rk4)
            touched = touch(z.T, a.T)
            z = np.array(last(h, z.T, start[-1:], a.T, touched, P)).T
        return z

    def _stepped(
        self, moved: Callable[[Array, Array], Array], state0: Array, memory0: Array, series: Packed, P: Array,
        t0: float, dt: float, steps: int, every: int,
    ) -> Array:  # fmt: skip
        system, lanes = self.system, state0.shape[0]
        nm, na = len(system.memory), len(system.acting or system.series)
        z, m = state0.copy(), memory0[:, :nm]
        before = self.before.map(lanes) if self.before is not None else None
        out, one = np.empty((lanes, (steps - 1) // every + 1, len(system.stored))), np.ones((1, lanes))
        for k in range(steps):
            acting, after, logged = series.series[:, min(k, series.steps - 1)], m, m[:, :0]
            if system.field is not None:
                acting = np.hstack([acting, system.field.look(z[:, 0], z[:, 1])[0]])
            if before is not None:
                y = np.array(before((t0 + k * dt) * one, dt * one, rows_of(z), rows_of(m), rows_of(acting), P)).T
                acting, after, logged = y[:, :na], y[:, na : na + nm], y[:, na + nm :]
            if k % every == 0:  # state and gear of this moment, before the step that the orders now begin
                out[:, k // every] = np.concatenate([z, m, logged], axis=1)
            if k < steps - 1:
                z, m = moved(z, acting), after
        return out

    def _plant(self, hidden: Array) -> Untraced:
        if self.system.plant is None:
            raise ValueError("a system without a plant is traced, not stepped")
        return self.system.plant(hidden)


@dataclass(frozen=True)
class VirtualSensitivity:
    """An open-loop system with exact forward sensitivities."""

    system: System
    free: tuple[str, ...]
    lanewise: tuple[str, ...]
    jacobian: trace.Jacobian

    pack = staticmethod(pack)

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
        z = np.zeros((lanes, ns, 1 + len(self.free) + ns))  # per state: its value, then its derivatives
        z[:, :, 0] = state0
        # dz/dp begins at zero, dz/dz0 with one on the diagonal; both obey d(dz)/dt = A dz + df/dp
        z[:, range(ns), range(1 + len(self.free), z.shape[2])] = 1.0
        out = np.empty((lanes, (steps - 1) // every + 1, *z.shape[1:]))
        for k in range(steps):
            if k % every == 0:
                out[:, k // every] = z
            if k < steps - 1:
                a = rows_of(series.series[:, min(k, series.steps - 1)])
                z = _moved(lambda x, a=a: self._slope(x, a, P), z, dt, rk4)
        return out[..., 0], out[..., 1:]

    def _slope(self, z: Array, a: Array, P: Array) -> Array:
        ns, nf = z.shape[1], len(self.free)
        y = np.array(self.jacobian.function.map(z.shape[0])(z[:, :, 0].T, a, P)).T
        slope = np.zeros_like(z)
        slope[:, :, 0] = y[:, :ns]
        for n, (i, k) in enumerate(self.jacobian.A):  # structural non-zeros of A alone
            slope[:, i, 1:] += y[:, ns + n, None] * z[:, k, 1:]
        first = ns + len(self.jacobian.A)
        for n, i in enumerate(self.jacobian.rows):
            slope[:, i, 1 : 1 + nf] += y[:, first + n * nf : first + (n + 1) * nf]
        return slope
