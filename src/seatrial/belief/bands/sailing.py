"""Free runs of a ship under given inputs, many draws of each: parameters, starts, random accelerations, current."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from ...core.values import dataclass
from ...data import Array
from ...models import STATES, Sampled, Stepped
from ...ships import Ship, ShipError
from ...simulate.approach import substeps
from ...simulate.lanes import Kernel, Lanes, Steps, run
from ...simulate.loop import open_loop, open_loop_parameters
from .disturbance import LANEWISE, Disturbance, disturbed, shared

# Lanes are sailed in groups of so many stored numbers and inputs, 32 MB, which stay near the processor.
_STORED = 4_000_000
# Rows of a log are joined to steps of the integrator of so many rows at most.
_LONGER = (10, 5, 4, 3, 2)


@dataclass(frozen=True)
class FreeRuns:
    """FreeRuns to be sailed, one lane each.

    Attributes:
        state0: initial states, shape (lanes, states).
        series: controls and environment per step, shape (lanes, steps, series).
        dt: time step [s].
        every: steps between two rows of the result.
    """

    state0: Array
    series: Array
    dt: float
    every: int

    @property
    def t(self) -> Array:
        """Times of the rows of the result [s], from the start on."""
        return self.dt * self.every * np.arange((self.series.shape[1] - 1) // self.every + 1)

    def grid(self, method: str = "rk4") -> Steps:
        """Steps to the last whole row."""
        return Steps(self.dt, (len(self.t) - 1) * self.every + 1, self.every, method)

    def longer(self, ship: Ship) -> FreeRuns:
        """The same with longer steps where the integrator allows; inputs are averaged over them."""
        fits = (k for k in _LONGER if self.every % k == 0 and substeps(ship, k * self.dt) == 1)
        k = next(fits, 1)
        if k == 1:
            return self
        lanes, steps, width = self.series.shape
        whole = (steps - 1) // k
        mean = self.series[:, : whole * k].reshape(lanes, whole, k, width).mean(axis=2)
        return FreeRuns(self.state0, np.concatenate([mean, mean[:, -1:]], axis=1), k * self.dt, self.every // k)


class Begins(Protocol):
    """Disturbances at the starts of lanes."""

    def drawn(self, copies: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Values of the processes, shape (copies lanes, processes), and currents, (copies lanes, 2).

        Both over their standard deviation without a past.
        """
        ...


@dataclass(frozen=True)
class Uncertain:
    """What differs between draws.

    Attributes:
        names: paths of the uncertain parameters.
        draws: their values, shape (draws, names); none where it has no columns.
        start: standard deviation of the initial state, shape (6,).
        disturbance: what the model lacks.
        past: what is known of it at the start of each lane; None where nothing is.
    """

    names: tuple[str, ...]
    draws: Array
    start: Array
    disturbance: Disturbance
    past: Begins | None = None


def check_traced(ship: Ship) -> None:
    """Refuse a ship whose motion cannot be disturbed.

    Raises:
        ShipError: a model in discrete time, or a network.
    """
    if isinstance(ship.model, Sampled | Stepped):
        raise ShipError(f"{ship.name}: no bands of a model in discrete time or a network; take a model with forces")


def sailed(ship: Ship, lanes: FreeRuns, uncertain: Uncertain, seed: int, method: str = "euler") -> Array:
    """States of every draw, shape (draws, lanes, rows, 6), rows as of `FreeRuns.t`; NaN or inf after one blows up.

    Euler's rule, four times as fast as "rk4", serves for how far draws are apart: the steps are a fifth of what the
    fastest motion lasts at most (`substeps`), and its error is nearly the same in all draws.
    """
    check_traced(ship)
    lanes = lanes.longer(ship)
    who, rng = uncertain.disturbance, np.random.default_rng(seed)
    system = disturbed(open_loop(ship), who.layout)
    kernel = Kernel(system, (*uncertain.names, *LANEWISE))
    parameters = shared(open_loop_parameters(ship), who)
    count, steps, width = lanes.series.shape
    size = (len(lanes.t) * len(system.stored) + steps * width) * count
    group = max(_STORED // size, 1)
    out = np.empty((len(uncertain.draws), count, len(lanes.t), len(STATES)))
    packed: Any = None
    for low in range(0, len(uncertain.draws), group):
        some = uncertain.draws[low : low + group]
        many = len(some) * count
        begun = np.tile(lanes.state0, (len(some), 1))
        begun[:, : len(STATES)] += uncertain.start * rng.standard_normal((many, len(STATES)))
        if packed is None or packed.lanes != many:
            packed = kernel.pack(np.tile(lanes.series, (len(some), 1, 1)))
        memory, currents = who.begun(many, rng), who.currents(many, rng)
        if uncertain.past is not None:
            values, flow = uncertain.past.drawn(len(some), rng)
            memory[:, : values.shape[1]], currents = values, who.current * flow
        with np.errstate(all="ignore"):  # a draw that diverges does not return
            own = np.hstack([np.repeat(some, count, axis=0), currents])
            rows = run(Lanes(kernel, parameters, begun, packed, memory, own), lanes.grid(method), None).values
        out[low : low + len(some)] = rows[:, :, : len(STATES)].reshape(len(some), count, -1, len(STATES))
    return out
