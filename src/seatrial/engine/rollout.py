"""The engine's two verbs: integrate many lanes, and integrate them with their derivatives."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, Protocol, cast

import numpy as np

from ..core.executors import processors as default_threads
from ..core.parameters import ParameterError, unknown
from ..core.values import dataclass
from . import Array, EngineNotice, Failure, Rollout, System, simd, virtual
from .cache import CompilerError
from .cuda import Device, DeviceError
from .cuda.named import device_of


class Packed(Protocol):
    """Series in the order of a kernel; made by `pack`."""

    @property
    def lanes(self) -> int: ...
    @property
    def steps(self) -> int: ...
    @property
    def channels(self) -> int: ...


@cache
def _notice(reason: str) -> None:
    """Warn once per process and reason that the slower back end runs."""
    warnings.warn(f"running on CasADi's virtual machine, some 30 times slower: {reason}", EngineNotice, stacklevel=5)


@dataclass(frozen=True)
class _Compiled:
    """A compiled system.

    Attributes:
        system: what was compiled.
        lanewise: parameters that differ from lane to lane; all others are shared.
        virtual: whether it runs on the virtual machine.
    """

    system: System
    lanewise: tuple[str, ...]
    kernel: Any
    virtual: bool

    def pack(self, series: Array) -> Packed:
        """Series (lanes, steps, channels) in the kernel's own order, to be used in many runs."""
        return self.kernel.pack(np.asarray(series, dtype=np.float64))

    def _fitting(self, series: Array | Packed, lanes: int, steps: int) -> Packed:
        """Packed series; those that a kernel would read past the end of are refused."""
        packed = self.pack(series) if isinstance(series, np.ndarray) else series
        if self.virtual != isinstance(packed, virtual.Packed):  # of a back end that compiled where this one did not
            packed = self.pack(cast("virtual.Packed | simd.Packed", packed).series)
        if packed.lanes != lanes or (packed.steps != 1 and packed.steps < steps):
            raise ValueError(
                f"series hold {packed.lanes} lanes of {packed.steps} steps; the run has {lanes} of {steps}, "
                "so give as many lanes, and as many steps or one"
            )
        names = self.system.given
        if packed.channels != len(names):
            raise ValueError(f"series hold {packed.channels} channels; the system takes {', '.join(names)}")
        return packed


class Simulator(_Compiled):
    """A compiled system: `run` integrates it over lanes."""

    def run(
        self, state0: Array, series: Array | Packed, parameters: Array, *, dt: float, steps: int,
        memory0: Array | None = None, lanewise: Array | None = None, t0: float = 0.0, every: int = 1,
        method: str = "rk4", threads: int | None = None,
        validity: Mapping[str, tuple[float, float]] | None = None,
        judged: Callable[[Array], Mapping[str, Array]] | None = None,
    ) -> Rollout:  # fmt: skip
        """Integrate every lane and store every `every`-th step.

        Args:
            state0: shape (lanes, states).
            series: shape (lanes, steps, series), or (lanes, 1, series) where they hold; or packed.
            parameters: shared values in the order of `system.parameters`.
            dt: time step [s].
            steps: number of samples, the first included.
            memory0: shape (lanes, memory), hidden values of a plant behind them.
            lanewise: shape (lanes, len(self.lanewise)).
            t0: time of the first sample [s].
            every: stride of the stored rows.
            method: "rk4" or "euler"; a plant that cannot be traced goes by Euler's rule.
            threads: None takes `default_threads()`.
            validity: closed interval per state; a lane that leaves it fails from there on.
            judged: from the stored values, what is held against the interval of a name in place of the state,
                each of shape (lanes, rows).
        """
        values = self.stored(
            state0, series, parameters, dt=dt, steps=steps, memory0=memory0, lanewise=lanewise, t0=t0, every=every,
            method=method, threads=threads,
        )  # fmt: skip
        t = t0 + dt * every * np.arange(values.shape[1])
        return _judged(t, values, self.system.states, validity or {}, judged(values) if judged else {})

    def stored(
        self, state0: Array, series: Array | Packed, parameters: Array, *, dt: float, steps: int,
        memory0: Array | None = None, lanewise: Array | None = None, t0: float = 0.0, every: int = 1,
        method: str = "rk4", threads: int | None = None,
    ) -> Array:  # fmt: skip
        """The stored rows as they are, shape (lanes, rows, len(system.stored)), judged by nobody; see `run`."""
        lanes = state0.shape[0]
        return self.kernel.run(
            np.asarray(state0, dtype=np.float64),
            np.zeros((lanes, len(self.system.memory) + len(self.system.hidden))) if memory0 is None else memory0,
            self._fitting(series, lanes, steps), np.zeros((lanes, 0)) if lanewise is None else lanewise, parameters,
            t0=t0, dt=dt, steps=steps, every=every, rk4=is_rk4(method), threads=threads or default_threads(),
        )  # fmt: skip

    def evaluate(self, state: Array, acting: Array, parameters: Array, lanewise: Array | None = None) -> Array:
        """Rates of each lane, one call of the right-hand side, shape (lanes, states)."""
        q = np.zeros((state.shape[0], 0)) if lanewise is None else lanewise
        return self.kernel.evaluate(state, acting, q, parameters)


@dataclass(frozen=True)
class Sensitivity(_Compiled):
    """A compiled open-loop system with derivatives with respect to `free`; see `Simulator` for the arguments."""

    free: tuple[str, ...]

    def run(
        self, state0: Array, series: Array | Packed, parameters: Array, *, dt: float, steps: int, every: int = 1,
        lanewise: Array | None = None, method: str = "rk4", threads: int | None = None,
    ) -> tuple[Array, Array]:  # fmt: skip
        """States (lanes, rows, states) and their derivatives (lanes, rows, states, free + states).

        The last columns are the derivatives with respect to the initial state.
        """
        lanes = state0.shape[0]
        return self.kernel.run(
            np.asarray(state0, dtype=np.float64), self._fitting(series, lanes, steps),
            np.zeros((lanes, 0)) if lanewise is None else lanewise, parameters,
            dt=dt, steps=steps, every=every, rk4=is_rk4(method), threads=threads or default_threads(),
        )  # fmt: skip


def is_rk4(method: str) -> bool:
    """Whether `method` is "rk4"; False for "euler".

    Raises:
        ValueError: another name.
    """
    if method not in ("rk4", "euler"):
        raise ValueError(f"no integration method '{method}'; known: rk4, euler")
    return method == "rk4"


def _checked(system: System, names: Sequence[str]) -> tuple[str, ...]:
    for name in names:
        if name not in system.parameters:
            raise ParameterError(unknown(name, system.parameters))
    return tuple(names)


def simulator(
    system: System, lanewise: Sequence[str] = (), *, back_end: str = "auto", device: str | Device = "cpu",
    precision: str = "double",
) -> Simulator:  # fmt: skip
    """Compile `system`.

    Args:
        system: what is integrated.
        lanewise: parameters that differ from lane to lane.
        back_end: of the processor: "auto", "simd" or "virtual".
        device: "cpu", or "cuda" for a GPU, "cuda:1" for the second one.
        precision: "double"; a device also takes "single".

    Raises:
        DeviceError: the device, its driver or the extra `cuda` is missing, or it cannot do this.
    """
    names, machine = _checked(system, lanewise), _machine(device, precision, system)
    if machine is not None:
        from .cuda.lanes import CudaRollout

        return Simulator(system, names, CudaRollout.compile(system, names, machine, precision == "single"), False)
    wanted = back_end if system.plant is None else "virtual"
    fast, slow = simd.SimdRollout.compile, virtual.VirtualRollout.compile
    return Simulator(system, names, *_compiled(wanted, fast, slow, system, names))


def sensitivity(
    system: System, free: Sequence[str], lanewise: Sequence[str] = (), *, back_end: str = "auto",
    device: str | Device = "cpu", precision: str = "double",
) -> Sensitivity:  # fmt: skip
    """Compile open-loop `system` with derivatives with respect to `free` and the initial state; see `simulator`."""
    if system.before is not None:
        raise ValueError("sensitivities are for open-loop systems; this one prepares its steps")
    names, q, machine = _checked(system, free), _checked(system, lanewise), _machine(device, precision, system)
    if machine is not None:
        from .cuda.lanes import CudaSensitivity

        kernel = CudaSensitivity.compile(system, names, q, machine, precision == "single")
        return Sensitivity(system, q, kernel, False, names)
    fast, slow = simd.SimdSensitivity.compile, virtual.VirtualSensitivity.compile
    return Sensitivity(system, q, *_compiled(back_end, fast, slow, system, names, q), names)


def _machine(device: str | Device, precision: str, system: System) -> Device | None:
    """The device that is asked for, None for the processor; DeviceError: it cannot do this."""
    machine = device_of(device, precision)
    if machine is not None and system.plant is not None:
        raise DeviceError("a network of many weights runs on arrays, not in a kernel of a device; take the processor")
    if machine is not None and system.field is not None:
        raise DeviceError("a chart is read by kernels of the processor only; take the processor")
    return machine


def _compiled(
    back_end: str, fast: Callable[..., Any], slow: Callable[..., Any], *arguments: Any
) -> tuple[Any, bool]:
    """The kernel of a back end, and whether it is the virtual machine; "auto" takes that where nothing compiles."""
    if back_end != "virtual":
        try:
            return fast(*arguments), False
        except CompilerError as error:
            if back_end == "simd":
                raise
            _notice(str(error))
    return slow(*arguments), True


def _judged(
    t: Array, values: Array, states: tuple[str, ...], validity: Mapping[str, tuple[float, float]],
    instead: Mapping[str, Array],
) -> Rollout:  # fmt: skip
    """Find where lanes blew up or left their validity; blank what follows, let the others be."""
    bad = ~np.isfinite(values[:, :, : len(states)])
    for name, (low, high) in validity.items():
        column = instead.get(name, values[:, :, states.index(name)])
        bad[:, :, states.index(name)] |= (column < low) | (column > high)
    if not bad.any():
        return Rollout(t, values)
    failures: list[Failure] = []
    for lane in np.flatnonzero(bad.any(axis=(1, 2))):
        # the first row that fails is blanked with all after it: a ship beyond its validity is no ship any more
        row = int(np.argmax(bad[lane].any(axis=1)))
        state = int(np.argmax(bad[lane, row]))
        told, own = instead.get(states[state]), float(values[lane, row, state])
        value = own if told is None or not np.isfinite(own) else float(told[lane, row])
        failures.append(Failure(int(lane), float(t[row]), states[state], value))
        values[lane, row:] = np.nan
    return Rollout(t, values, tuple(failures))
