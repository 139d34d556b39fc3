"""Tasks on a chart, with contact and banks: lay a ship on its fenders, hold the middle of a canal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from ..core.parameters import Scalar, Scalars
from ..core.symbolic import cos, larger, magnitude, sin, smaller, where
from ..core.values import dataclass
from ..data import Array
from .tasks import Judged, Scale, Seen, Start, any_of, outside, spread


@dataclass(frozen=True)
class Quay:
    """Berthing with contact at the quay of the chart `tanker_quay`, whose face runs north to south along east = 0.

    The reward of an action is the way made towards the fenders in breadths, heading error counting as `heading`
    breadths per radian, less `waiting` and ``effort a^2``, and less ``hard (v/limit)^2`` of the speed at which the hull
    meets the fenders.  An episode is over when the ship lies on its fenders, parallel and below `slow`, which pays
    `berthed`; when it meets them at more than `crash`, and beyond `area` or where the model no longer holds, which
    costs `berthed`.

    Attributes:
        off: least and greatest way off the fenders at the start, in breadths.
        skew: largest heading error then [rad].
        middle: midship north of the origin when berthed [m].
        height: of the fenders [m].
        limit: contact speed that is accepted [m/s]; 8 cm/s of large tankers.
        crash: contact speed that ends an episode [m/s].
        slow: speed that counts as rest [m/s].
        area: distance from the berth at which the ship has left, in breadths.
        heading, waiting, effort, hard, berthed: weights.
    """

    off: tuple[float, float] = (0.3, 1.5)
    skew: float = 0.03
    middle: float = 250.0
    height: float = 2.0
    limit: float = 0.08
    crash: float = 0.3
    slow: float = 0.01
    area: float = 4.0
    heading: float = 5.0
    waiting: float = 0.002
    effort: float = 0.002
    hard: float = 0.2
    berthed: float = 5.0

    steers: ClassVar[tuple[str, ...]] = ("f_fore", "f_aft")
    draws: ClassVar[int] = 3
    goal: ClassVar[tuple[str, ...]] = ()
    memory: ClassVar[tuple[str, ...]] = ("to_go",)
    seen: ClassVar[tuple[Seen, ...]] = (
        Seen("along / B", -10.0, 10.0), Seen("gap / B", -1.0, 10.0), Seen("psi", -1.0, 1.0),
        Seen("u / 0.1 m/s", -10.0, 10.0), Seen("v_m / 0.1 m/s", -10.0, 10.0), Seen("r L / 0.1 m/s", -10.0, 10.0),
    )  # fmt: skip
    turns: ClassVar[float] = 0.0
    chart: ClassVar[str] = "tanker_quay"

    def begin(self, scale: Scale, draws: Array) -> Start:
        """At rest off the quay, nearly parallel to it."""
        state = np.zeros((len(draws), 6), draws.dtype)
        state[:, 0] = self.middle + spread(draws[:, 0], -0.5, 0.5) * scale.B
        gap = spread(draws[:, 1], *self.off)
        state[:, 2] = spread(draws[:, 2], -self.skew, self.skew)
        # the nearer end keeps clear of the fenders
        gap = gap + 0.5 * scale.L / scale.B * np.sin(np.abs(state[:, 2]))
        state[:, 1] = -(0.5 + gap) * scale.B - self.height
        to_go = gap + self.heading * np.abs(state[:, 2])
        return Start(state, np.zeros((len(draws), 0)), to_go[:, None])

    def guide(self, scale: Scale, goal: Sequence[float], x: float, y: float) -> Sequence[Sequence[tuple[float, float]]]:
        """The quay, and the line of its fenders along the berth."""
        far, half = 7.0 * scale.L, 0.5 * scale.L
        fenders = tuple((self.middle + side * half, -self.height) for side in (-1.0, 1.0))
        return (((self.middle - far, 0.0), (self.middle + far, 0.0)), fenders)

    def judge(
        self, scale: Scale, state: Scalars, controls: Scalars, goal: Scalars, memory: Scalars, beyond: Scalar = 0.0
    ) -> Judged:
        """The gap is that of the parallel side, from the fenders; the speed of contact that of the nearer end."""
        x, y, psi, u, v, r = state
        s, c = sin(psi), cos(psi)
        gap = (-self.height - y) / scale.B - 0.5
        reach = 0.33 * scale.L
        end = gap - reach * magnitude(s) / scale.B
        towards = u * s + v * c + reach * magnitude(r)
        meets = where(end < 0.0, larger(towards, 0.0), 0.0) / self.limit
        to_go = magnitude(gap) + self.heading * magnitude(psi)
        away = (x - self.middle) / scale.B
        still = any_of(*(outside(value, -self.slow, self.slow) for value in (u, v, r * reach)))
        amiss = any_of(outside(end, -1.0, 0.01), outside(psi, -0.02, 0.02))
        done = 1.0 - any_of(still, amiss, beyond)
        gone = any_of(outside(away, -self.area, self.area), outside(gap, -0.1, self.area), beyond,
                      outside(meets, 0.0, self.crash / self.limit))  # fmt: skip
        effort = sum(a * a for a in controls)
        met = smaller(meets, 10.0)
        reward = (memory[0] - to_go - self.waiting - self.effort * effort - self.hard * met * met
                  + self.berthed * (done - gone))  # fmt: skip
        seen = (away, gap, psi, 10.0 * u, 10.0 * v, 10.0 * r * scale.L)
        return Judged(seen, reward, any_of(done, gone), (to_go,))


@dataclass(frozen=True)
class Canal:
    """Keep to the middle of the chart `canal`, whose banks draw the ship and turn its bow off.

    The reward of an action is ``-(y/B)^2 - heading (1 - cos psi) - rudder a^2`` times `pace`; beyond `off` breadths
    from the middle, turned by more than half a right angle, or where the model no longer holds, the episode is over,
    which costs `lost`.

    Attributes:
        aside: largest way off the middle at the start, in breadths.
        way: least and greatest speed then, in approach speeds.
        off, heading, rudder, pace, lost: as above.
    """

    aside: float = 1.0
    way: tuple[float, float] = (0.35, 0.5)
    off: float = 2.2
    heading: float = 4.0
    rudder: float = 0.1
    pace: float = 0.05
    lost: float = 10.0

    steers: ClassVar[tuple[str, ...]] = ("delta",)
    draws: ClassVar[int] = 3
    goal: ClassVar[tuple[str, ...]] = ()
    memory: ClassVar[tuple[str, ...]] = ()
    seen: ClassVar[tuple[Seen, ...]] = (
        Seen("y / B", -5.0, 5.0), Seen("sin psi", -1.0, 1.0), Seen("u / U", -3.0, 3.0), Seen("v_m / U", -3.0, 3.0),
        Seen("r L / U", -5.0, 5.0),
    )  # fmt: skip
    turns: ClassVar[float] = 0.45
    chart: ClassVar[str] = "canal"

    def begin(self, scale: Scale, draws: Array) -> Start:
        """Under way along the canal, off its middle."""
        state = np.zeros((len(draws), 6), draws.dtype)
        state[:, 0] = -3500.0
        state[:, 1] = scale.B * spread(draws[:, 0], -self.aside, self.aside)
        state[:, 2] = spread(draws[:, 1], -0.05, 0.05)
        state[:, 3] = scale.U * spread(draws[:, 2], *self.way)
        return Start(state, np.zeros((len(draws), 0)), np.zeros((len(draws), 0)))

    def guide(self, scale: Scale, goal: Sequence[float], x: float, y: float) -> Sequence[Sequence[tuple[float, float]]]:
        """The middle of the canal."""
        far = 7.0 * scale.L
        return (((x - far, 0.0), (x + far, 0.0)),)

    def judge(
        self, scale: Scale, state: Scalars, controls: Scalars, goal: Scalars, memory: Scalars, beyond: Scalar = 0.0
    ) -> Judged:
        """Off the middle to starboard is positive."""
        _, y, psi, u, v, r = state
        e, s, c = y / scale.B, sin(psi), cos(psi)
        gone = any_of(outside(e, -self.off, self.off), outside(c, math.sqrt(0.5), math.inf), beyond)
        effort = sum(a * a for a in controls)
        reward = -self.pace * (e * e + self.heading * (1.0 - c) + self.rudder * effort) - self.lost * gone
        return Judged((e, s, u / scale.U, v / scale.U, r * scale.L / scale.U), reward, gone)
