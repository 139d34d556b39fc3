"""What a policy that learns among traffic sees and says: numbers without dimension, the same for a model and a ship.

Of the own ship: how far it is off its old course and off its old line.  Of each of the nearest ships: distance,
bearing, course, closest approach and the time to it, as shares of what the rules of the road call near and soon
(`rules.Limits`).  It says an alteration of its old course and a share of its speed.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..data import Array
from .conduct import Orders, Scene
from .rules.geometry import approach, wrapped
from .rules.limits import Limits
from .sensing import UNSEEN

NEAREST = 3
"""Ships that are seen; where there are less, the rest are zero."""
OWN = ("sin off course", "cos off course", "off line", "speed")
OTHER = ("here", "near", "sin bearing", "cos bearing", "sin course", "cos course", "speed", "closest", "soon")
SIZE = len(OWN) + NEAREST * len(OTHER)
ACTIONS = ("course", "speed")
MOST = math.radians(120.0)
"""The greatest alteration of course."""


class Sight:
    """Observations and orders from a first scene on, which gives the old courses, lines and speeds."""

    def __init__(self, scene: Scene, limits: Limits | None = None) -> None:
        limits, longest = limits or Limits(), float(scene.L.max())
        self.course = scene.psi[:, 0].copy()
        self._x, self._y = scene.x[:, 0].copy(), scene.y[:, 0].copy()
        self._U = np.maximum(np.hypot(scene.north[:, 0], scene.east[:, 0]), 0.1)
        self.passing, self.horizon = (float(one.of(np.array(longest))) for one in (limits.passing, limits.horizon))

    def observed(self, scene: Scene) -> NDArray[np.float32]:
        """What is seen, each number within -1 and 1; shape (runs, `SIZE`)."""
        runs = len(scene.x)
        found = np.zeros((runs, SIZE))
        off = scene.psi[:, 0] - self.course
        north, east = scene.x[:, 0] - self._x, scene.y[:, 0] - self._y
        across = east * np.cos(self.course) - north * np.sin(self.course)
        speed = np.hypot(scene.north, scene.east) / self._U[:, None]
        found[:, :4] = np.column_stack([np.sin(off), np.cos(off), np.tanh(across / (4.0 * self.passing)),
                                        speed[:, 0] - 1.0])  # fmt: skip
        x, y = scene.x[:, 1:] - scene.x[:, :1], scene.y[:, 1:] - scene.y[:, :1]
        far, bearing = np.hypot(x, y), np.arctan2(y, x) - scene.psi[:, :1]
        dcpa, tcpa = approach(x, y, scene.north[:, 1:] - scene.north[:, :1], scene.east[:, 1:] - scene.east[:, :1])
        met = np.nan_to_num(tcpa, nan=-1.0) > 0.0
        turned = wrapped(scene.psi[:, 1:] - scene.psi[:, :1])
        each = np.stack([
            np.ones_like(far), np.exp(-far / (4.0 * self.passing)), np.sin(bearing), np.cos(bearing), np.sin(turned),
            np.cos(turned), np.tanh(speed[:, 1:] - 1.0), np.where(met, np.exp(-dcpa / self.passing), 0.0),
            np.where(met, np.exp(-np.where(met, tcpa, 0.0) / self.horizon), 0.0),
        ], axis=-1)  # fmt: skip
        each[far >= 0.5 * UNSEEN] = 0.0
        order = np.argsort(far, axis=1, kind="stable")[:, :NEAREST]
        kept = np.take_along_axis(each, order[..., None], axis=1)
        found[:, len(OWN) : len(OWN) + kept.shape[1] * len(OTHER)] = kept.reshape(runs, -1)
        return np.clip(found, -1.0, 1.0).astype(np.float32)

    def ordered(self, action: Array) -> Orders:
        """Orders of actions from -1 to 1, shape (runs, 2): course from port to starboard, speed from half to whole."""
        course, speed = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0).T
        return Orders(self.course + MOST * course, 0.75 + 0.25 * speed)
