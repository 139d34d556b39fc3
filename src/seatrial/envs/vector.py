"""Many ships as one Gymnasium vector environment, in one kernel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ..data import Array
from ..ships import Ship
from .lanes import Lanes, settings_of
from .spaces import checked, ship_of, spaces_of
from .tasks import Task

Observations = NDArray[np.float32]
Flags = NDArray[np.bool_]


class ShipVectorEnv(VectorEnv[Observations, Observations, Any]):
    """Ships at a task side by side; where an episode is over, the next action begins another and is not obeyed.

    Attributes:
        lanes: the ships in their kernel; `lanes.value("psi")` reads a state or a control in SI units.
    """

    def __init__(
        self, ship: str | Ship, task: Task, num_envs: int = 1, *, copy: bool = True, threads: int = 1,
        render_mode: str | None = None, **settings: Any,
    ) -> None:  # fmt: skip
        """Compile the step, or take it from the cache.

        Args:
            ship: a ship, or the name of one.
            task: the task.
            num_envs: how many ships.
            copy: False hands out the same arrays at every step, written over by the next one.
            threads: that share the ships.
            render_mode: None; there are no pictures.
            settings: fields of `Settings`.

        Raises:
            TaskError: a ship or a setting that cannot be.
        """
        super().__init__()
        self.metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}
        self.render_mode, self.num_envs, self._copy = render_mode, num_envs, copy
        self.lanes = Lanes(ship_of(ship), task, num_envs, settings_of(settings), threads)
        self.single_observation_space, self.single_action_space = spaces_of(self.lanes.work)
        self.observation_space: gymnasium.Space[Any] = batch_space(self.single_observation_space, num_envs)
        self.action_space: gymnasium.Space[Any] = batch_space(self.single_action_space, num_envs)
        self._shape, self._seeded = (num_envs, len(self.lanes.work.orders)), False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin an episode on every ship.

        Args:
            seed: of the first ship, the others' count on from there; or one for each ship; None goes on.
            options: none are known.
        """
        if seed is not None or not self._seeded:
            self.lanes.seed(self._seeds(seed))
            self._seeded = True
        self.lanes.reset()
        return self._out(self.lanes.observation), {}

    def _seeds(self, seed: int | Sequence[int | None] | None) -> NDArray[np.uint64]:
        super().reset(seed=seed if isinstance(seed, int) else None)
        if isinstance(seed, int):
            return np.uint64(seed) + np.arange(self.num_envs, dtype=np.uint64)
        fresh = self.np_random.integers(2**63, size=self.num_envs, dtype=np.uint64)
        if seed is None:
            return fresh
        if len(seed) != self.num_envs:
            raise ValueError(f"{len(seed)} seeds for {self.num_envs} ships; give one each, or one number")
        return np.array([int(own) if one is None else one for one, own in zip(seed, fresh, strict=True)], np.uint64)

    def step(self, actions: Observations) -> tuple[Observations, Array, Flags, Flags, dict[str, Any]]:
        """One action on every ship, held for a period; shape (num_envs, actions).

        Raises:
            ValueError: actions of another shape, or not finite.
        """
        lanes, out = self.lanes, self._out
        lanes.step(checked(actions, self._shape))
        return out(lanes.observation), out(lanes.reward), out(lanes.terminated), out(lanes.truncated), {}

    def _out(self, values: Any) -> Any:
        return values.copy() if self._copy else values
