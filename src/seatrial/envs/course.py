"""Course keeping: bring the heading to the one ordered, and hold it there with little rudder."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..core.parameters import Scalar
from ..core.symbolic import atan2, cos, sin
from ..data import Array
from .tasks import MOTION, Judged, Scalars, Scale, Seen, Start, any_of, motion, outside, spread


@dataclass(frozen=True)
class Course:
    """Course keeping.

    The reward of an action is minus ``(e^2 + rudder a^2 + turning (r L/U)^2) T U / L`` with the heading error e [rad],
    the actuators a as shares of their ranges and the time T between two actions, so that its sum is an integral over
    ship lengths whatever T is.  An episode is over where the error passes `off` or the model no longer holds; that
    costs `lost` besides.

    Attributes:
        change: greatest change of course that an episode begins with [rad].
        off: heading error at which the ship counts as lost [rad].
        rudder, turning: weights of rudder and rate of turn.
        lost: what losing the course costs.
    """

    change: float = math.pi / 3.0
    off: float = math.pi / 2.0
    rudder: float = 0.1
    turning: float = 0.1
    lost: float = 100.0

    steers: ClassVar[tuple[str, ...]] = ("delta",)
    draws: ClassVar[int] = 2
    goal: ClassVar[tuple[str, ...]] = ("psi_goal",)
    memory: ClassVar[tuple[str, ...]] = ()
    seen: ClassVar[tuple[Seen, ...]] = (Seen("sin e", -1.0, 1.0), Seen("cos e", -1.0, 1.0), *MOTION)
    turns: ClassVar[float] = 1.0

    def begin(self, scale: Scale, draws: Array) -> Start:
        """Any heading, at the approach speed; the course ordered up to `change` to either side."""
        state = np.zeros((len(draws), 6))
        state[:, 2] = spread(draws[:, 0], -math.pi, math.pi)
        state[:, 3] = scale.U
        goal = state[:, 2:3] + spread(draws[:, 1:2], -self.change, self.change)
        return Start(state, goal, np.zeros((len(draws), 0)))

    def judge(
        self, scale: Scale, state: Scalars, controls: Scalars, goal: Scalars, memory: Scalars, beyond: Scalar = 0.0
    ) -> Judged:
        """Heading error positive where the ship points to starboard of the course."""
        s, c = sin(state[2] - goal[0]), cos(state[2] - goal[0])
        e, (u, v, r) = atan2(s, c), motion(scale, state)
        effort = sum(a * a for a in controls)
        over = any_of(outside(e, -self.off, self.off), beyond)
        cost = (e * e + self.rudder * effort + self.turning * r * r) * scale.lengths
        return Judged((s, c, u, v, r), -cost - self.lost * over, over)
