"""One ship as a Gymnasium environment."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from ..ships import Ship
from .lanes import Lanes, settings_of
from .spaces import checked, ship_of, spaces_of
from .tasks import Task

Observation = NDArray[np.float32]


class ShipEnv(gymnasium.Env[Observation, Observation]):
    """A ship at a task, one action at a time.

    Attributes:
        lanes: the ship in her kernel; `lanes.value("psi")` reads a state or a control in SI units.
    """

    def __init__(self, ship: str | Ship, task: Task, render_mode: str | None = None, **settings: Any) -> None:
        """Compile the step, or take it from the cache.

        Args:
            ship: a ship, or the name of one.
            task: the task.
            render_mode: None; there are no pictures.
            settings: fields of `Settings`.

        Raises:
            TaskError: a ship or a setting that cannot be.
        """
        self.render_mode = render_mode
        self.lanes = Lanes(ship_of(ship), task, 1, settings_of(settings))
        self.observation_space, self.action_space = spaces_of(self.lanes.work)
        self._seeded, self._begun = False, False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode: with a seed the first one of that seed, else the next one."""
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            own = int(self.np_random.integers(2**63)) if seed is None else seed
            self.lanes.seed(np.array([own], dtype=np.uint64))
            self._seeded = True
        self.lanes.reset()
        self._begun = True
        return self.lanes.observation[0].copy(), {}

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One action, held for a period.

        Raises:
            ValueError: an action of another shape, or not finite.
            ResetNeeded: no episode has begun, or the last one is over.
        """
        lanes = self.lanes
        if not self._begun:
            raise gymnasium.error.ResetNeeded("no episode to go on with; call reset first")
        lanes.step(checked(action, (len(lanes.work.orders),)))
        told = float(lanes.reward[0]), bool(lanes.terminated[0]), bool(lanes.truncated[0])
        self._begun = not (told[1] or told[2])
        return lanes.observation[0].copy(), *told, {}
