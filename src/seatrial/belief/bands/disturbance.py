"""What a model lacks, as random forces: accelerations of surge, sway and yaw, and a steady unlogged current.

An acceleration is an Ornstein-Uhlenbeck process, stationary from the start: standard deviation sigma, correlation time
tau (inf: constant, another in every run).  Several with different tau have a spectrum of any shape that falls with
frequency.  They are part of the compiled step: a lane carries its generator of random numbers (Park and Miller 1988:
s -> 16807 s mod 2^31 - 1, exact in doubles), so a thousand runs need no series of a thousand noises.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Annotated, Any

import numpy as np

from ...core.records import Limits
from ...core.symbolic import cos, exp, floor, root, sin
from ...core.values import dataclass
from ...data import Array
from ...engine import Scalars, System
from ...environment import to_body
from ...models import STATES

ACTS = ("u", "v_m", "r")
"""States whose rates a process may change, as `Process.on`."""

CURRENT, WIND = ("current_x", "current_y"), ("wind_x", "wind_y")
_FACTOR, _PRIME = 16807.0, 2.0**31 - 1.0
# A uniform number of variance one is so much wide.
_WIDE = math.sqrt(12.0)


@dataclass(frozen=True)
class Process:
    """A random acceleration.

    Attributes:
        on: "u", "v_m" [m/s^2] or "r" [rad/s^2].
        sigma: standard deviation; of a process with `by`, at 1 m/s.
        tau: correlation time [s]; inf holds.
        by: "water" or "air" grows with the square of the speed through it; "" does not.
    """

    on: str
    sigma: float
    tau: Annotated[float, Limits(null=math.inf)]
    by: str = ""


@dataclass(frozen=True)
class Disturbance:
    """Random accelerations, and the standard deviation of each component of a steady current [m/s]."""

    processes: tuple[Process, ...] = ()
    current: float = 0.0

    @property
    def layout(self) -> tuple[tuple[str, str], ...]:
        """What each process acts on and grows with; decides the compiled step, as the numbers do not."""
        return tuple((one.on, one.by) for one in self.processes)

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the parameters that `disturbed` adds, but for the current, which differs by run."""
        return {name: value for k, one in enumerate(self.processes)
                for name, value in zip(_named(k, ("sigma", "tau")), (one.sigma, one.tau), strict=True)}  # fmt: skip

    def begun(self, lanes: int, rng: np.random.Generator) -> Array:
        """Memory that `disturbed` adds at the start of each lane, shape (lanes, 2 processes): values, then seeds."""
        count = len(self.processes)
        values = rng.standard_normal((lanes, count))
        return np.hstack([values, rng.integers(1, int(_PRIME), (lanes, count)).astype(np.float64)])

    def currents(self, lanes: int, rng: np.random.Generator) -> Array:
        """Steady current of each lane, north and east [m/s], shape (lanes, 2)."""
        return self.current * rng.standard_normal((lanes, 2))


LANEWISE = tuple(f"disturbance.{name}" for name in CURRENT)
"""Parameters that `disturbed` adds and that differ from lane to lane."""


def _named(k: int, what: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"disturbance.{k}.{one}" for one in what)


@lru_cache(maxsize=32)
def disturbed(system: System, layout: tuple[tuple[str, str], ...]) -> System:
    """The system with random accelerations and a current, its added memory behind its own.

    Args:
        system: an open or closed loop of `simulate.loop` that can be traced.
        layout: `Disturbance.layout`.
    """
    acting, count = system.acting or system.series, len(layout)
    own, held = len(system.parameters), len(system.memory)
    flow = [system.series.index(name) for name in CURRENT]
    extra = tuple(name for k in range(count) for name in _named(k, ("sigma", "tau")))

    def derivative(state: Scalars, given: Scalars, p: Scalars) -> Scalars:
        rates: list[Any] = list(system.derivative(state, given[: len(acting)], p[:own]))
        known = dict(zip(acting, given, strict=False))
        grows = {"": 1.0, "water": _squared(state, known, CURRENT, 1.0), "air": _squared(state, known, WIND, -1.0)}
        for k, (on, by) in enumerate(layout):
            row = STATES.index(on)
            rates[row] = rates[row] + p[own + 2 * k] * grows[by] * given[len(acting) + k]
        return tuple(rates)

    def before(t: Any, dt: Any, state: Scalars, memory: Scalars, series: Scalars, p: Scalars) -> Any:
        around: list[Any] = list(series)
        for k, row in enumerate(flow):
            around[row] = around[row] + p[own + 2 * count + k]
        values, seeds = memory[held : held + count], memory[held + count :]
        if system.before is None:
            given, after, logged = tuple(around), (), ()
        else:
            given, after, logged = system.before(t, dt, state, memory[:held], tuple(around), p[:own])
        moved = [_moved(a, s, dt, p[own + 2 * k + 1]) for k, (a, s) in enumerate(zip(values, seeds, strict=True))]
        return (*given, *values), (*after, *(a for a, _ in moved), *(s for _, s in moved)), logged

    memory = (*system.memory, *(f"disturbance.{k}.{what}" for what in ("value", "seed") for k in range(count)))
    return System(
        states=system.states, memory=memory, series=system.series,
        acting=(*acting, *(f"disturbance.{k}" for k in range(count))), logged=system.logged,
        parameters=(*system.parameters, *extra, *LANEWISE), derivative=derivative, before=before,
    )  # fmt: skip


def _squared(state: Scalars, known: Mapping[str, Any], medium: tuple[str, str], sense: float) -> Any:
    """Square of the speed through a medium, of which two channels are the velocity north and east times `sense`."""
    north, east = to_body(known[medium[0]], known[medium[1]], cos(state[2]), sin(state[2]))
    u, v = state[3] - sense * north, state[4] - sense * east
    return u * u + v * v


def _moved(value: Any, seed: Any, dt: Any, tau: Any) -> tuple[Any, Any]:
    """Value of unit variance and seed a step later."""
    product = _FACTOR * seed
    seed = product - _PRIME * floor(product / _PRIME)
    kept = exp(-dt / tau)
    return kept * value + root(1.0 - kept * kept) * (_WIDE * (seed / _PRIME - 0.5)), seed


def shared(values: Array, disturbance: Disturbance) -> Array:
    """Values of the parameters of `disturbed(system, ...)` from those of the system; the current is zero."""
    found: Mapping[str, float] = disturbance.parameters
    return np.concatenate([values, list(found.values()), np.zeros(len(LANEWISE))])
