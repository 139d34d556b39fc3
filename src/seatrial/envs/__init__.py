"""Gymnasium environments: ships for reinforcement learning.

Importing this room registers three environments, each as a single one and as a vector of ships in one kernel::

    import gymnasium
    import seatrial.envs

    env = gymnasium.make("seatrial/Course-v0", ship="kvlcc2")
    envs = gymnasium.make_vec("seatrial/Berth-v0", num_envs=1024, current=(0.0, 0.05))

Contract: a task (`tasks.Task`) is plain Python over scalars, traced together with ship and actuators, so that
observation, reward and the end of an episode come out of the compiled step.  docs/robots.md lists observations and
rewards.  Needs the extra `gym`.
"""

from __future__ import annotations

try:
    import gymnasium
except ImportError:
    raise ImportError("environments for learning need the extra 'gym': pip install 'seatrial[gym]'") from None

from .environments import ShipEnv, ShipVectorEnv
from .lanes import Settings
from .tasks import Berth, Course, Task, TaskError, Track

__all__ = ["IDS", "Berth", "Course", "Settings", "ShipEnv", "ShipVectorEnv", "Task", "TaskError", "Track"]

IDS = {"seatrial/Course-v0": ("kvlcc2_l7", Course()), "seatrial/Track-v0": ("kvlcc2_l7", Track()),
       "seatrial/Berth-v0": ("esso_osaka_3m_harbour", Berth())}  # fmt: skip
"""Registered environments: the default ship and the task."""

for _id, (_ship, _task) in IDS.items():
    if _id not in gymnasium.registry:
        gymnasium.register(
            _id, entry_point="seatrial.envs:ShipEnv", vector_entry_point="seatrial.envs:ShipVectorEnv",
            kwargs={"ship": _ship, "task": _task}, order_enforce=True,
        )  # fmt: skip
