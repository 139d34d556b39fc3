"""A manoeuvre in closed loop with the random accelerations and the current of a disturbance, many draws at once."""

from __future__ import annotations

import numpy as np

from ....core.values import dataclass, replace
from ....data import Array
from ....manoeuvres import Policy
from ....ships import Ship
from ....simulate.lanes import Kernel, Steps, run, steered
from ....simulate.loop import closed_loop
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
        return closed_loop(self.ship, self.policy, self.dt).stored

    def run(self, names: tuple[str, ...], draws: Array, disturbance: Disturbance, seed: int) -> Array:
        """Stored rows, shape (draws, rows, columns of the loop)."""
        rng, count = np.random.default_rng(seed), len(draws)
        vary = {f"ship.{name}": column for name, column in zip(names, draws.T, strict=True)}
        lanes = steered(self.ship, self.policy, self.dt, vary, self.start, self.around, count)
        system = lanes.kernel.system
        memory = np.hstack([np.asarray(lanes.memory), disturbance.begun(count, rng)])
        moved = replace(
            lanes, kernel=Kernel(disturbed(system, disturbance.layout), (*lanes.kernel.lanewise, *LANEWISE)),
            shared=shared(lanes.shared, disturbance), memory=memory,
            lanewise=np.hstack([draws, disturbance.currents(count, rng)]),
        )  # fmt: skip
        with np.errstate(all="ignore"):
            rows = run(moved, Steps(self.dt, self.steps, self.every), None).values
        kept = len(system.states) + len(system.memory)
        columns = [*range(kept), *range(rows.shape[2] - len(system.logged), rows.shape[2])]
        return rows[:, :, columns]
