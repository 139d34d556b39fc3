"""A manoeuvre in closed loop with the random accelerations and the current of a disturbance, many draws at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....data import Array
from ....engine.rollout import simulator
from ....manoeuvres import Policy
from ....ships import Ship
from ....simulate.lanes import prepare
from ..disturbance import LANEWISE, Disturbance, disturbed, shared


@dataclass(frozen=True)
class Loop:
    """A closed loop under given conditions.

    Attributes:
        dt: time step [s].
        around: channels of the environment per step, shape (1, steps or 1, 8).
        start: initial x, y, psi, u, v_m, r over ground, shape (1, 6).
        every: steps between stored rows; `steps` of them in all, the first row included.
    """

    ship: Ship
    policy: Policy
    dt: float
    around: Array
    start: Array
    every: int
    steps: int

    @property
    def stored(self) -> tuple[str, ...]:
        lanes = prepare(self.ship, self.policy, self.dt, {}, self.start, self.around, 1)
        return lanes.simulator.system.stored

    def run(self, names: tuple[str, ...], draws: Array, disturbance: Disturbance, seed: int) -> Array:
        """Stored rows, shape (draws, rows, columns of the loop)."""
        rng, count = np.random.default_rng(seed), len(draws)
        vary = {f"ship.{name}": column for name, column in zip(names, draws.T, strict=True)}
        lanes = prepare(self.ship, self.policy, self.dt, vary, self.start, self.around, count)
        system = lanes.simulator.system
        code = simulator(disturbed(system, disturbance.layout), (*lanes.simulator.lanewise, *LANEWISE))
        with np.errstate(all="ignore"):
            run = code.stored(
                lanes.state, lanes.series, shared(lanes.shared, disturbance),
                memory0=np.hstack([lanes.memory, disturbance.begun(count, rng)]),
                lanewise=np.hstack([draws, disturbance.currents(count, rng)]), dt=self.dt, every=self.every,
                steps=self.steps,
            )  # fmt: skip
        kept = len(system.states) + len(system.memory)
        columns = [*range(kept), *range(run.shape[2] - len(system.logged), run.shape[2])]
        return run[:, :, columns]
