"""Gymnasium environments: ships for reinforcement learning.

Importing this room registers six environments, each as a single one and as a vector of ships in one kernel::

    import gymnasium
    import seatrial.envs

    env = gymnasium.make("seatrial/Course-v0", ship="kvlcc2")
    envs = gymnasium.make_vec("seatrial/Berth-v0", num_envs=1024, current=(0.0, 0.05))

Contract: a task (`tasks.Task`) is plain Python over scalars, traced together with ship and actuators, so that
observation, reward and the end of an episode come out of the compiled step.  docs/robots.md lists observations and
rewards.  An environment can be pickled and copied at any step; the copy goes on from there by itself, whichever process
it is in.  Needs the extra `gym`.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy as copied
from typing import Any, cast

try:
    import gymnasium
except ImportError:
    raise ImportError("environments for learning need the extra 'gym': pip install 'seatrial[gym]'") from None

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ..data import Array
from ..engine.cuda import Device
from ..engine.cuda.named import device_of
from ..ships import Ship
from ..ships.files import load
from .device import DeviceLanes
from .episodes import Settings, settings_of
from .harbour import Canal, Quay
from .lanes import Lanes
from .picture import Painter
from .system import Work
from .tasks import Berth, Course, Task, TaskError, Track, shown
from .traffic import EncounterEnv, EncounterVectorEnv

__all__ = ["IDS", "Berth", "Canal", "Course", "EncounterEnv", "EncounterVectorEnv", "Quay", "Settings", "ShipEnv",
           "ShipVectorEnv", "Task", "TaskError", "Track"]  # fmt: skip

Observation = NDArray[np.float32]
Flags = NDArray[np.bool_]
Space = gymnasium.Space[Observation]


def ship_of(ship: str | Ship) -> Ship:
    """A ship as given, or one of the library or of a file by name; ShipError: no such ship, TaskError: neither."""
    given: Any = ship
    if not isinstance(given, Ship | str):
        raise TaskError(f"ship is {shown(given)}; give a Ship, or the name of one")
    return load(given) if isinstance(given, str) else given


def spaces_of(work: Work) -> tuple[Space, Space]:
    """Observations as the task and the ship have them, and actions from -1 to 1."""
    low, high = np.array([(one.low, one.high) for one in work.seen], dtype=np.float32).T
    actions = Box(-1.0, 1.0, (len(work.orders),), dtype=np.float32)
    return cast("Space", Box(low, high, dtype=np.float32)), cast("Space", actions)


def checked(action: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """An action of the right shape, all of it numbers; ValueError: another shape, or a value that is not finite."""
    given = np.asarray(action)
    if given.shape != shape:
        raise ValueError(f"an action of shape {given.shape}; this environment takes {shape}")
    if not np.isfinite(given).all():
        raise ValueError("an action that is not finite; entries go from -1 to 1")
    return given


class ShipEnv(gymnasium.Env[Observation, Observation]):
    """A ship at a task, one action at a time.

    Attributes:
        lanes: the ship in its kernel; `lanes.value("psi")` reads a state or a control in SI units.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012 -- as in Gymnasium

    def __init__(self, ship: str | Ship, task: Task, render_mode: str | None = None, **settings: Any) -> None:
        """Compile the step, or take it from the cache.

        Args:
            ship: a ship, or the name of one.
            task: the task.
            render_mode: "rgb_array" for pictures, or None.
            settings: fields of `Settings`.

        Raises:
            TaskError: a ship or a setting that cannot be.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise TaskError(f"render_mode is {shown(render_mode)}; it is 'rgb_array' or None")
        self.render_mode = render_mode
        self.lanes = Lanes(ship_of(ship), task, 1, settings_of(settings))
        self.observation_space, self.action_space = spaces_of(self.lanes.work)
        self._seeded, self._begun = False, False
        self._painter = Painter(task, self.lanes.work.scale)

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
        self._painter.begin()
        self._note()
        return self.lanes.observation[0].copy(), {}

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One action, held for a period; ValueError: an action of another shape, or not finite.

        Raises:
            ResetNeeded: no episode has begun, or the last one is over.
        """
        lanes = self.lanes
        if not self._begun:
            raise gymnasium.error.ResetNeeded("no episode has begun, or the last one is over; call reset first")
        lanes.step(checked(action, (len(lanes.work.orders),)))
        outcome = float(lanes.reward[0]), bool(lanes.terminated[0]), bool(lanes.truncated[0])
        self._begun = not (outcome[1] or outcome[2])
        self._note()
        return lanes.observation[0].copy(), *outcome, {}

    def __copy__(self) -> ShipEnv:
        return copied(self)  # never one that shares its ship

    def render(self) -> Any:
        """A picture of the episode, shape (400, 400, 3), north up; None without the render mode "rgb_array"."""
        if self.render_mode is None:
            return None
        x, y, psi = (float(self.lanes.value(name)[0]) for name in ("x", "y", "psi"))
        goal = [float(self.lanes.series(f"goal.{name}")[0]) for name in self.lanes.work.task.goal]
        return self._painter.picture(x, y, psi, goal)

    def _note(self) -> None:
        if self.render_mode is not None:
            self._painter.see(*(float(self.lanes.value(name)[0]) for name in ("x", "y")))


class ShipVectorEnv(VectorEnv[Observation, Observation, Any]):
    """Ships at a task side by side; where an episode is over, the next action begins another and is not obeyed.

    With `autoreset_mode=AutoresetMode.SAME_STEP` the step that ends an episode begins the next one, and its last
    observation is `final_obs` in the info, zero on other ships; `_final_obs` says on which it is.

    On a GPU (`device="cuda"`) actions and what a step returns stay there: `torch.from_dlpack(observation)` takes an
    array without a copy.  Each is overwritten by the next step, and actions that are not finite are not refused.

    Attributes:
        lanes: the ships in their kernel; `lanes.value("psi")` reads a state or a control in SI units.
    """

    def __init__(
        self, ship: str | Ship, task: Task, num_envs: int = 1, *, copy: bool = True, threads: int = 1,
        device: str | Device = "cpu", precision: str = "double", render_mode: str | None = None,
        autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP, **settings: Any,
    ) -> None:  # fmt: skip
        """Compile the step, or take it from the cache.

        Args:
            ship: a ship, or the name of one.
            task: the task.
            num_envs: number of ships.
            copy: False returns the same arrays at every step, overwritten by the next one.
            threads: number of threads.
            device: "cpu", or "cuda" for a GPU.
            precision: "double"; a GPU also takes "single".
            render_mode: None; there are no pictures.
            autoreset_mode: `NEXT_STEP`, or `SAME_STEP` on the processor.
            settings: fields of `Settings`.

        Raises:
            TaskError: a ship or a setting that cannot be.
            DeviceError: the device is not here, or cannot do this.
        """
        super().__init__()
        known = (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP)[: 2 if device == "cpu" else 1]
        if autoreset_mode not in known:
            where = "on the processor" if device == "cpu" else "on a GPU"
            raise TaskError(f"autoreset_mode is {shown(autoreset_mode)}; {where} it is "
                            f"{' or '.join(one.name for one in known)}")  # fmt: skip
        self.metadata = {"render_modes": [], "autoreset_mode": autoreset_mode}
        self.render_mode, self.num_envs = render_mode, num_envs
        self._at_once = autoreset_mode == AutoresetMode.SAME_STEP
        machine, given = device_of(device, precision), (ship_of(ship), task, num_envs, settings_of(settings))
        self._copy, self._here = copy and machine is None, machine is None
        self.lanes = Lanes(*given, threads) if machine is None else DeviceLanes(*given, machine, precision == "single")
        self.single_observation_space, self.single_action_space = spaces_of(self.lanes.work)
        self.observation_space: gymnasium.Space[Any] = batch_space(self.single_observation_space, num_envs)
        self.action_space: gymnasium.Space[Any] = batch_space(self.single_action_space, num_envs)
        self._shape, self._seeded = (num_envs, len(self.lanes.work.orders)), False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode on every ship.

        Args:
            seed: of the first ship, the others' count on from there; or one for each ship; None continues.
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

    def step(self, actions: Observation) -> tuple[Observation, Array, Flags, Flags, dict[str, Any]]:
        """One action on every ship, shape (num_envs, actions), held for a period; ValueError: not such an action."""
        lanes, out = self.lanes, self._out
        lanes.step(checked(actions, self._shape) if self._here else actions)
        info = self._over(lanes) if self._at_once and isinstance(lanes, Lanes) else {}
        return out(lanes.observation), out(lanes.reward), out(lanes.terminated), out(lanes.truncated), info

    @staticmethod
    def _over(lanes: Lanes) -> dict[str, Any]:
        """Begin anew where an episode is over, and what was last seen there, as Gymnasium has it."""
        over = lanes.terminated | lanes.truncated
        if not over.any():
            return {}
        last = np.where(over[:, None], lanes.observation, np.float32(0.0))
        lanes.begin_over()
        return {"final_obs": last, "_final_obs": over, "final_info": {}, "_final_info": over.copy()}

    def __copy__(self) -> ShipVectorEnv:
        return copied(self)

    def _out(self, values: Any) -> Any:
        return values.copy() if self._copy else values


IDS = {"seatrial/Course-v0": ("kvlcc2_l7", Course()), "seatrial/Track-v0": ("kvlcc2_l7", Track()),
       "seatrial/Berth-v0": ("esso_osaka_3m_harbour", Berth()), "seatrial/Quay-v0": ("kvlcc2_harbour", Quay()),
       "seatrial/Canal-v0": ("kvlcc2_harbour", Canal())}  # fmt: skip
"""Registered environments: the default ship and the task."""

for _id, (_ship, _task) in IDS.items():
    if _id not in gymnasium.registry:
        gymnasium.register(
            _id, entry_point="seatrial.envs:ShipEnv", vector_entry_point="seatrial.envs:ShipVectorEnv",
            kwargs={"ship": _ship, "task": _task}, order_enforce=True,
        )  # fmt: skip

AMONG = "seatrial/Encounter-v0"
"""The task among traffic, whose ships are in encounters and not in a kernel of their own."""

if AMONG not in gymnasium.registry:
    gymnasium.register(AMONG, entry_point="seatrial.envs:EncounterEnv",
                       vector_entry_point="seatrial.envs:EncounterVectorEnv")  # fmt: skip
