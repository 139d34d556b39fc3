"""Track following: two legs with a turn between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..core.parameters import Scalar
from ..core.symbolic import both, cos, sin, where
from ..data import Array
from .tasks import MOTION, Judged, Scalars, Scale, Seen, Start, any_of, motion, outside, spread


@dataclass(frozen=True)
class Track:
    """Track following; lengths are in ship lengths.

    The reward of an action is minus ``(e^2 + heading (1 - cos h) + rudder a^2) T U / L`` with the cross-track error e
    in ship lengths and the heading h against the leg.  An episode is over at the end of the second leg, and, at a cost
    of `lost`, more than `off` from the track, heading back along it, or where the model no longer holds.

    Attributes:
        first: least and greatest length of the first leg.
        second: length of the second leg.
        turn: greatest change of course between them [rad].
        reach: distance to the waypoint at which the second leg counts.
        aside: greatest distance from the track at the start.
        off: distance from the track at which the ship counts as lost.
        heading, rudder: weights.
        lost: what losing the track costs.
    """

    first: tuple[float, float] = (5.0, 10.0)
    second: float = 10.0
    turn: float = math.pi / 3.0
    reach: float = 1.5
    aside: float = 1.0
    off: float = 4.0
    heading: float = 0.5
    rudder: float = 0.1
    lost: float = 100.0

    steers: ClassVar[tuple[str, ...]] = ("delta",)
    draws: ClassVar[int] = 5
    goal: ClassVar[tuple[str, ...]] = ("cos_1", "sin_1", "cos_2", "sin_2", "length_1")
    memory: ClassVar[tuple[str, ...]] = ("leg",)
    seen: ClassVar[tuple[Seen, ...]] = (
        Seen("e / L", -5.0, 5.0), Seen("sin h", -1.0, 1.0), Seen("cos h", -1.0, 1.0), Seen("to go / L", -5.0, 50.0),
        Seen("sin turn ahead", -1.0, 1.0), Seen("cos turn ahead", -1.0, 1.0), *MOTION,
    )  # fmt: skip
    turns: ClassVar[float] = 1.0

    def begin(self, scale: Scale, draws: Array) -> Start:
        """At the approach speed near the origin, where the first leg begins in any direction."""
        chi = spread(draws[:, 0], -math.pi, math.pi)
        after = chi + spread(draws[:, 1], -self.turn, self.turn)
        aside = scale.L * spread(draws[:, 3], -self.aside, self.aside)
        state = np.zeros((len(draws), 6))
        state[:, 0], state[:, 1] = -np.sin(chi) * aside, np.cos(chi) * aside
        state[:, 2] = chi + spread(draws[:, 4], -math.pi / 9.0, math.pi / 9.0)
        state[:, 3] = scale.U
        length = scale.L * spread(draws[:, 2], *self.first)
        goal = np.column_stack([np.cos(chi), np.sin(chi), np.cos(after), np.sin(after), length])
        return Start(state, goal, np.zeros((len(draws), 1)))

    def judge(
        self, scale: Scale, state: Scalars, controls: Scalars, goal: Scalars, memory: Scalars, beyond: Scalar = 0.0
    ) -> Judged:
        """Cross-track error positive to starboard of the leg."""
        x, y, psi = state[:3]
        c1, s1, c2, s2, length = goal
        to_go_1 = length - (x * c1 + y * s1)
        leg = where(memory[0] > 0.5, 1.0, where(to_go_1 < self.reach * scale.L, 1.0, 0.0))
        dx, dy = x - length * c1, y - length * s1
        on_second = leg > 0.5
        c, s = where(on_second, c2, c1), where(on_second, s2, s1)
        e = where(on_second, dy * c2 - dx * s2, y * c1 - x * s1) / scale.L
        to_go = where(on_second, self.second * scale.L - (dx * c2 + dy * s2), to_go_1) / scale.L
        sin_h, cos_h = sin(psi) * c - cos(psi) * s, cos(psi) * c + sin(psi) * s
        ahead = (where(on_second, 0.0, c1 * s2 - s1 * c2), where(on_second, 1.0, c1 * c2 + s1 * s2))
        lost = any_of(outside(e, -self.off, self.off), outside(cos_h, 0.0, math.inf), beyond)
        arrived = where(both(on_second, to_go <= 0.0), 1.0, 0.0)
        effort = sum(a * a for a in controls)
        cost = (e * e + self.heading * (1.0 - cos_h) + self.rudder * effort) * scale.lengths
        seen = (e, sin_h, cos_h, to_go, *ahead, *motion(scale, state))
        return Judged(seen, -cost - self.lost * lost, any_of(lost, arrived), (leg,))
