"""Berthing: come to rest alongside a quay to starboard, without touching it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..core.parameters import Scalar
from ..core.symbolic import atan2, cos, magnitude, sin, speed, where
from ..data import Array
from .tasks import MOTION, Judged, Scalars, Scale, Seen, Start, any_of, motion, outside, spread


@dataclass(frozen=True)
class Berth:
    """Berthing; the berth is at the origin, heading north, the quay a straight wall to starboard.

    The reward of an action is the way made towards the berth in ship lengths, heading error counting as `heading`
    lengths per radian, less ``(waiting + effort a^2) T U / L``.  An episode is over when the ship lies within `within`
    of the pose and below `slow`, which pays `berthed`; when a corner of her rectangle L by B touches the quay, which
    costs `touched` times 1 plus the square of midship's speed towards it over 0.1 U; and beyond `area` or where the
    model no longer holds, which costs `touched`.

    Attributes:
        ahead, aside: least and greatest distance short of the berth and off it at the start, in ship lengths.
        way: least and greatest speed at the start, in approach speeds.
        gap: room between ship and quay when berthed, in breadths.
        within: along, in lengths; across, in gaps; heading [rad].
        slow: speed that counts as rest, in approach speeds; rates of turn by U/L.
        area: distance at which the ship has left the harbour, in ship lengths.
        heading, waiting, effort: weights.
        berthed, touched: what success pays and failure costs.
    """

    ahead: tuple[float, float] = (2.0, 4.0)
    aside: tuple[float, float] = (0.5, 1.5)
    way: tuple[float, float] = (0.2, 0.5)
    gap: float = 0.5
    within: tuple[float, float, float] = (0.1, 0.5, math.pi / 36.0)
    slow: float = 0.1
    area: float = 8.0
    heading: float = 0.5
    waiting: float = 0.02
    effort: float = 0.02
    berthed: float = 10.0
    touched: float = 10.0

    steers: ClassVar[tuple[str, ...]] = ()
    draws: ClassVar[int] = 4
    goal: ClassVar[tuple[str, ...]] = ()
    memory: ClassVar[tuple[str, ...]] = ("to_go",)
    seen: ClassVar[tuple[Seen, ...]] = (
        Seen("x / L", -10.0, 10.0), Seen("y / L", -10.0, 10.0), Seen("sin psi", -1.0, 1.0), Seen("cos psi", -1.0, 1.0),
        Seen("room to the quay / L", -2.0, 20.0), *MOTION,
    )  # fmt: skip
    turns: ClassVar[float] = 0.0

    def begin(self, scale: Scale, draws: Array) -> Start:
        """Short of the berth and off the quay, nearly parallel to it, with little way on."""
        state = np.zeros((len(draws), 6))
        state[:, 0] = -scale.L * spread(draws[:, 0], *self.ahead)
        state[:, 1] = -scale.L * spread(draws[:, 1], *self.aside)
        state[:, 2] = spread(draws[:, 2], -math.pi / 12.0, math.pi / 12.0)
        state[:, 3] = scale.U * spread(draws[:, 3], *self.way)
        to_go = np.hypot(state[:, 0], state[:, 1]) / scale.L + self.heading * np.abs(state[:, 2])
        return Start(state, np.zeros((len(draws), 0)), to_go[:, None])

    def judge(
        self, scale: Scale, state: Scalars, controls: Scalars, goal: Scalars, memory: Scalars, beyond: Scalar = 0.0
    ) -> Judged:
        """Room to the quay is that of the nearest corner."""
        x, y, psi, u, v, _ = state
        s, c = sin(psi), cos(psi)
        error = magnitude(atan2(s, c))
        away = speed(x, y) / scale.L
        to_go = away + self.heading * error
        quay = (0.5 + self.gap) * scale.B
        room = quay - y - 0.5 * (magnitude(s) * scale.L + magnitude(c) * scale.B)
        touches = outside(room, 0.0, math.inf)
        along, across, turned = self.within
        swift = any_of(*(outside(value, -self.slow, self.slow) for value in motion(scale, state)))
        amiss = any_of(outside(magnitude(x), 0.0, along * scale.L), outside(error, 0.0, turned),
                       outside(magnitude(y), 0.0, across * self.gap * scale.B))  # fmt: skip
        done = (1.0 - any_of(swift, amiss, touches, beyond))
        gone = any_of(outside(away, 0.0, self.area), beyond)
        towards = where(u * s + v * c > 0.0, u * s + v * c, 0.0) / (0.1 * scale.U)
        effort = sum(a * a for a in controls)
        reward = (memory[0] - to_go - (self.waiting + self.effort * effort) * scale.lengths + self.berthed * done
                  - self.touched * (touches * (1.0 + towards * towards) + gone))  # fmt: skip
        seen = (x / scale.L, y / scale.L, s, c, room / scale.L, *motion(scale, state))
        return Judged(seen, reward, any_of(touches, done, gone), (to_go,))
