"""What differs from lane to lane: parameters, initial states and weather of many runs of one closed loop."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ..core.parameters import unknown, values
from ..data import Array
from ..engine import Scalars, System
from ..engine.cuda import Device
from ..engine.rollout import Simulator, simulator
from ..engine.trace import over_rows
from ..environment import CHANNELS
from ..manoeuvres import Policy
from ..models import STATES
from ..models.settled import settled
from ..ships import Ship, ShipError
from .loop import closed_loop, loop_memory, loop_values
from .place import Place


@dataclass(frozen=True)
class Lanes:
    """A compiled closed loop and all that its runs start from.

    Attributes:
        simulator: the compiled loop.
        state: shape (lanes, states).
        memory: shape (lanes, memory).
        series: shape (lanes, steps or 1, series).
        shared: values of `simulator.system.parameters`.
        lanewise: values of `simulator.lanewise`, shape (lanes, varied); None where nothing varies.
    """

    simulator: Simulator
    state: Array
    memory: Array
    series: Array
    shared: Array
    lanewise: Array | None


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


def prepare(
    ship: Ship, policy: Policy, dt: float, vary: Mapping[str, Array], start: Array, around: Array, lanes: int,
    device: str | Device = "cpu", precision: str = "double", place: Place | None = None,
) -> Lanes:  # fmt: skip
    """The compiled loop with its lanes; a loop of the same structure is compiled once.

    Args:
        dt: time step [s].
        vary: value per lane of each parameter that differs, by the names of `loop.closed_loop`.
        start: initial x, y, psi, u, v_m, r over ground, then any of the model's own, shape (lanes or 1, 6 or more).
        around: inputs per step, shape (lanes or 1, steps or 1, series).
        lanes: number of runs.
        device: "cpu", or "cuda" for a GPU.
        precision: "double"; a GPU also takes "single".
        place: where the ship sails.
    """
    system = closed_loop(ship, policy, dt, place)
    columns = {name: np.asarray(column, dtype=np.float64) for name, column in vary.items()}
    memory = _begin(ship, policy, dt, {n: v for n, v in columns.items() if n.startswith("policy.")}, start)
    rest = _settled(ship, system, memory, around[:, 0])[:, start.shape[1] - len(STATES) :]
    rows = max(len(start), len(rest))
    state = np.hstack([np.broadcast_to(part, (rows, part.shape[1])) for part in (start, rest)])
    return Lanes(
        simulator(system, tuple(columns), device=device, precision=precision),
        np.broadcast_to(state, (lanes, state.shape[1])),
        np.broadcast_to(memory, (lanes, memory.shape[1])), np.broadcast_to(around, (lanes, *around.shape[1:])),
        np.array(list(loop_values(ship, policy).values()), dtype=np.float64),
        np.column_stack(list(columns.values())) if columns else None,
    )  # fmt: skip


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
