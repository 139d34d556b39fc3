"""One way to run a ship: what, from where, under what, kept how often, judged by what.

`Kernel` is what is run, `Lanes` have where each run starts and what acts on it, `Steps` say how far it goes and which
rows are kept, `Judge` says when it fails, and `run` integrates them all.  `given` makes lanes of a ship under given
controls, `steered` of one under a policy.  Nothing else builds a simulator.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from ..core.parameters import unknown, values
from ..core.values import dataclass, field, replace
from ..data import Array
from ..engine import Rollout, Scalars, System
from ..engine.cuda import Device
from ..engine.rollout import Packed, Sensitivity, Simulator, sensitivity, simulator
from ..engine.trace import over_rows
from ..environment import CHANNELS, through_water
from ..manoeuvres import Policy
from ..models import STATES
from ..models.settled import settled
from ..ships import Ship, ShipError
from .loop import closed_loop, loop_memory, loop_values, open_loop, open_loop_memory, open_loop_parameters
from .place import Place


@dataclass(frozen=True)
class Kernel:
    """What is run: equations, compiled when they are first needed.

    Attributes:
        system: the equations, as of `loop`.
        lanewise: parameters that differ from lane to lane; all others are shared.
        free: parameters by which `slopes` differentiates.
        device: "cpu", or "cuda" for a GPU.
        precision: "double"; a GPU also takes "single".
    """

    system: System
    lanewise: tuple[str, ...] = ()
    free: tuple[str, ...] = ()
    device: str | Device = "cpu"
    precision: str = "double"

    @cached_property
    def forward(self) -> Simulator:
        """The integrator; DeviceError: the device is not here."""
        return simulator(self.system, self.lanewise, device=self.device, precision=self.precision)

    @cached_property
    def tangent(self) -> Sensitivity:
        """The integrator with derivatives."""
        return sensitivity(self.system, self.free, self.lanewise, device=self.device, precision=self.precision)

    def pack(self, series: Array) -> Packed:
        """Series in the order of the kernel, for many runs."""
        return (self.tangent if self.free else self.forward).pack(series)

    def rates(self, state: Array, acting: Array, shared: Array, lanewise: Array | None = None) -> Array:
        """Rates of each lane, shape (lanes, states); arguments as the fields of `Lanes`, `acting` (lanes, acting)."""
        return self.forward.evaluate(state, acting, shared, lanewise)


@dataclass(frozen=True)
class Lanes:
    """Many runs of one kernel, a lane each: from where, and under what.

    Attributes:
        shared: values of `kernel.system.parameters`.
        state: shape (lanes, states).
        series: shape (lanes, steps or 1, series); or packed.
        memory: shape (lanes, memory), hidden values of a plant behind them; None is zero.
        lanewise: values of `kernel.lanewise`, shape (lanes, names); None where nothing varies.
    """

    kernel: Kernel
    shared: Array
    state: Array
    series: Any
    memory: Array | None = None
    lanewise: Array | None = None

    def part(self, rows: slice) -> Lanes:
        """Some of the lanes, their series not packed."""
        memory, lanewise = (None if one is None else one[rows] for one in (self.memory, self.lanewise))
        return replace(self, state=self.state[rows], series=self.series[rows], memory=memory, lanewise=lanewise)


@dataclass(frozen=True)
class Steps:
    """How far runs go, and which rows are kept.

    Attributes:
        dt: time step [s].
        count: samples, the first included.
        every: stride of the kept ones.
        method: "rk4" or "euler".
        t0: time of the first sample [s].
    """

    dt: float
    count: int
    every: int = 1
    method: str = "rk4"
    t0: float = 0.0

    @staticmethod
    def between(dt: float, rows: int, each: int, method: str = "rk4") -> Steps:
        """`each` steps from row to row, which are `dt` [s] apart."""
        return Steps(dt / each, (rows - 1) * each + 1, each, method)


@dataclass(frozen=True)
class Judge:
    """When a lane fails: where a state is not finite, or leaves its interval.

    Attributes:
        validity: closed interval per state; names that are no states are left out.
        told: from the kept values, what is held against the interval of a name in place of the state, each of shape
            (lanes, rows); None holds the states.
    """

    validity: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    told: Callable[[Array], Mapping[str, Array]] | None = None

    @staticmethod
    def of(ship: Ship, around: Array, every: int) -> Judge:
        """By the validity of a ship: in a current, the velocity through the water counts.

        Args:
            around: inputs per step, shape (steps or 1, series), or with a first axis of lanes.
            every: stride of the kept rows.
        """
        north, east = (around[..., ::every, CHANNELS.index(name)] for name in ("current_x", "current_y"))

        def told(rows: Array) -> Mapping[str, Array]:
            psi, u, v_m = (rows[:, :, STATES.index(name)] for name in ("psi", "u", "v_m"))
            return dict(zip(("u", "v_m"), through_water(u, v_m, north, east, np.cos(psi), np.sin(psi)), strict=True))

        return Judge(ship.validity, told if north.any() or east.any() else None)


FINITE = Judge()
"""A run ends where its states are no numbers any more."""


def run(lanes: Lanes, steps: Steps, judge: Judge | None = FINITE, threads: int | None = None) -> Rollout:
    """Integrate every lane.

    Args:
        judge: when a lane fails; None keeps the rows as they are, judged by nobody.
        threads: of the processor; None takes all of them.

    Returns:
        The kept rows; a lane that fails is NaN from there on and listed, the others continue.
    """
    code, states = lanes.kernel.forward, lanes.kernel.system.states
    arguments: dict[str, Any] = {
        "memory0": lanes.memory, "lanewise": lanes.lanewise, "dt": steps.dt, "steps": steps.count, "t0": steps.t0,
        "every": steps.every, "method": steps.method, "threads": threads,
    }  # fmt: skip
    if judge is None:
        rows = code.stored(lanes.state, lanes.series, lanes.shared, **arguments)
        return Rollout(steps.t0 + steps.dt * steps.every * np.arange(rows.shape[1]), rows)
    validity = {name: ends for name, ends in judge.validity.items() if name in states}
    return code.run(lanes.state, lanes.series, lanes.shared, **arguments, validity=validity, judged=judge.told)


def slopes(lanes: Lanes, steps: Steps, threads: int | None = None) -> tuple[Array, Array]:
    """States (lanes, rows, states), and their derivatives by `kernel.free` and the initial state in a last axis."""
    return lanes.kernel.tangent.run(
        lanes.state, lanes.series, lanes.shared, dt=steps.dt, steps=steps.count, every=steps.every,
        lanewise=lanes.lanewise, method=steps.method, threads=threads,
    )  # fmt: skip


def given(ship: Ship, state: Array, series: Array, memory: Array | None = None) -> Lanes:
    """Runs of a ship under given controls and environment.

    Args:
        state: shape (lanes, states).
        series: controls and environment, shape (lanes, steps or 1, controls + 8).
        memory: of a model in discrete time; None is as after a long time in the state.
    """
    if memory is None:
        memory = open_loop_memory(ship, state, series[:, 0, : len(ship.model.controls)])
    return Lanes(Kernel(open_loop(ship)), open_loop_parameters(ship), state, series, memory)


def steered(
    ship: Ship, policy: Policy, dt: float, vary: Mapping[str, Array], start: Array, around: Array, lanes: int,
    device: str | Device = "cpu", precision: str = "double", place: Place | None = None,
) -> Lanes:  # fmt: skip
    """Runs of a ship under a policy; a loop of the same structure is compiled once.

    Args:
        dt: time step [s].
        vary: value per lane of each parameter that differs, by the names of `loop.closed_loop`.
        start: initial x, y, psi, u, v_m, r over ground, then any of the model's own, shape (lanes or 1, 6 or more).
        around: inputs per step, shape (lanes or 1, steps or 1, series).
        lanes: number of runs.
        device, precision: as of `Kernel`.
        place: where the ship sails.
    """
    system = closed_loop(ship, policy, dt, place)
    columns = {name: np.asarray(column, dtype=np.float64) for name, column in vary.items()}
    memory = _begin(ship, policy, dt, {n: v for n, v in columns.items() if n.startswith("policy.")}, start)
    rest = _settled(ship, system, memory, around[:, 0])[:, start.shape[1] - len(STATES) :]
    rows = max(len(start), len(rest))
    state = np.hstack([np.broadcast_to(part, (rows, part.shape[1])) for part in (start, rest)])
    return Lanes(
        Kernel(system, tuple(columns), (), device, precision),
        np.array(list(loop_values(ship, policy).values()), dtype=np.float64),
        np.broadcast_to(state, (lanes, state.shape[1])), np.broadcast_to(around, (lanes, *around.shape[1:])),
        np.broadcast_to(memory, (lanes, memory.shape[1])),
        np.column_stack(list(columns.values())) if columns else None,
    )  # fmt: skip


def check_varied(ship: Ship, policy: Policy, names: Iterable[str]) -> None:
    """Refuse parameters that cannot differ by lane.

    Raises:
        ShipError: an unknown one, or one that decides which order a control follows.
    """
    known = loop_values(ship, policy)
    for name in names:
        if name not in known:
            raise ShipError(f"{ship.name}: {unknown(name, known, 'parameter')}")
        if name.startswith("ship.") and _steers(ship, name[5:]):
            raise ShipError(f"{ship.name}: {name} sets the order that a control follows; it cannot differ by lane")


def _settled(ship: Ship, system: System, memory: Array, around: Array) -> Array:
    """Initial values of a model's own memory, shape (lanes or 1, states - 6), as after a long time in these conditions.

    Args:
        around: inputs of the first step, shape (lanes or 1, series).
    """
    if len(system.states) == len(STATES):
        return np.zeros((1, 0))
    controls = memory[:, [system.memory.index(control) for control in ship.model.controls]]
    rows = max(len(controls), len(around))
    parts = (controls, around[:, : len(CHANNELS)])
    return settled(ship.model, np.hstack([np.broadcast_to(part, (rows, part.shape[1])) for part in parts]))


def _begin(ship: Ship, policy: Policy, dt: float, vary: Mapping[str, Array], start: Array) -> Array:
    """Memory at the start, shape (lanes or 1, memory); `vary` has the parameters of the policy that differ by lane."""
    shared = {name: value for name, value in loop_values(ship, policy).items() if name.startswith("policy.")}
    if not vary and len(start) == 1:
        return np.array([loop_memory(ship, policy, dt, shared, tuple(start[0].tolist()))], dtype=np.float64)

    def begin(row: Scalars) -> Scalars:
        given = shared | dict(zip(vary, row[start.shape[1] :], strict=True))
        return loop_memory(ship, policy, dt, given, row[: len(STATES)])

    lanes = max(len(start), *(len(column) for column in vary.values())) if vary else len(start)
    return over_rows(begin, np.column_stack([np.broadcast_to(start, (lanes, start.shape[1])), *vary.values()]))


def _steers(ship: Ship, path: str) -> bool:
    """Whether a parameter changes the order that a control follows, or its factor."""
    value = values(ship.model)[path]
    others = (ship.moved({path: other}).model for other in (2.0 * value + 1.0, -value))
    own = ship.model.follows, ship.model.differential
    return any((other.follows, other.differential) != own for other in others)
