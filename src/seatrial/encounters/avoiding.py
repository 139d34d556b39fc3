"""A reference autopilot that keeps clear of traffic by velocity obstacles and the rules of the road.

After Kuwata et al. 2014 (IEEE J. Oceanic Eng. 39(1), 110-119): of a fan of courses those are barred on which
a ship would be met within a time and nearer than a distance, and, where the rules ask to keep clear, those that leave
it to starboard; of the rest the one nearest to the course is taken.  Speed is not altered.
"""

from __future__ import annotations

import math
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..core.values import dataclass, fields, replace
from ..data import Array
from .conduct import Orders, Scene
from .rules import Limits
from .rules.geometry import Bools, wrapped

_DEG = math.pi / 180.0
_TURNS = tuple(sign * k * 10.0 * _DEG for k in range(4, 13) for sign in (1, -1))
"""Alterations to choose from: 40 deg, surely apparent (Rule 8(b)), to 120 deg, on either side."""

_STEADY = 15.0 * _DEG
"""By how much a course has to be nearer to the old one than the present alteration, so that it is changed for it."""

_BARRED = 100.0
"""Cost of a course on which a ship is met, more the nearer and the sooner; above that of any alteration [rad]."""

_AHEAD = math.cos(55.0 * _DEG)
"""Within this angle of its course a ship has another ahead of it; the check of Rule 13 has 45 deg."""

_WIDER = 1.2
"""An alteration clears the passing distance by this factor, as the ship takes time to turn."""

_MARGIN = 1.4
"""Distance that the reference autopilots keep over the one that the checks ask for."""

_MADE = 2.0 * _DEG
"""How near to an ordered course the ship has come to it."""


class KeepClear:
    """An autopilot among ships that it takes to keep course and speed.

    With rules it does what the part of the ship asks, as the ships lie in the first scene (Rule 13(d): a part is kept):
    it leaves ships that it meets or has to give way to on its port side, does not cut in before one that it overtakes,
    and holds on before others until `alone` is left to the closest approach; then it does not turn to port for a ship
    on its own port side (Rule 17(c)).  Once it has altered course it looks as far ahead for everybody, also to go back.
    """

    def __init__(self, scene: Scene, limits: Limits, *, rules: bool = True, lean: float = 0.0) -> None:
        """Begin at a scene.

        Args:
            rules: whether it keeps them, or sails as if there were none.
            lean: by how much an alteration to starboard costs more than one to port [rad].
        """
        self._course, self._lean = scene.psi[:, 0].copy(), lean
        self._turn = np.zeros(len(self._course))
        longest = scene.L.max()
        self._passing = _MARGIN * float(limits.passing.of(longest))
        x, y, beta = _place(scene, self._course)
        alpha = wrapped(np.arctan2(y, x) + math.pi - scene.psi[:, 1:] + self._course[:, None])
        # sectors of Rules 13 to 15, borders of DNV
        overtaking = np.abs(alpha) > 112.5 * _DEG
        ahead = (np.abs(beta) <= 5.0 * _DEG) & (np.abs(alpha) <= 5.0 * _DEG)
        gives = (beta > 0.0) & (beta < 112.5 * _DEG)
        before = scene.above(0)[1:] > 0  # Rule 18
        self._clear = rules & (ahead | (gives | before) & ~overtaking)
        self._overtakes, self._bow = rules & overtaking, _MARGIN * float(limits.bow.of(longest))
        stands = rules & ~overtaking & ~ahead & ~gives & ~before
        self._to_port = stands & (beta < 0.0)
        self._horizon, alone = (float(one.of(longest)) for one in (limits.horizon, limits.alone))
        self._act = np.where(stands, alone, self._horizon)

    def look(self, scene: Scene) -> Orders:
        """The cheapest course; where the old one is free, that, once an alteration is made or everybody has passed."""
        x, y, _ = _place(scene, self._course)
        c, s = np.cos(self._course)[:, None], np.sin(self._course)[:, None]
        north, east = scene.north[:, 1:], scene.east[:, 1:]
        U = np.hypot(scene.north[:, :1], scene.east[:, :1])
        act = np.where(self._turn[:, None] != 0.0, self._horizon, self._act)
        seen = Seen(x, y, north * c + east * s, east * c - north * s, U, np.full_like(x, self._passing), act,
                    np.full_like(x, self._horizon), self._clear, self._to_port, self._overtakes,
                    np.full_like(x, self._bow))  # fmt: skip
        cost = seen.barred(0.0).max(axis=1)
        # one that is taken back half made, as the other ship acts too, is none that this one could see (Rule 8(b))
        made = np.abs(wrapped(scene.psi[:, 0] - self._course)) >= np.abs(self._turn) - _MADE
        self._turn[(cost <= 0.0) & (made | (seen.left <= 0.0).all(axis=1))] = 0.0
        rows = np.flatnonzero(cost > 0.0)
        if rows.size:
            self._turn[rows] = self._cheapest(seen.of(rows), self._turn[rows], cost[rows])
        return Orders(self._course + self._turn, np.ones(len(self._course)))

    def _cheapest(self, seen: Seen, now: Array, held: Array) -> Array:
        """The alteration of least cost [rad], the first of several; `held` is that of the old course."""
        best, chosen = held - np.where(np.abs(now) < 0.01, _STEADY, 0.0), np.zeros(len(now))
        for turn in _TURNS:
            cost = abs(turn) + (self._lean if turn > 0.0 else 0.0) + seen.barred(turn).max(axis=1)
            cost -= np.where(np.abs(now - turn) < 0.01, _STEADY, 0.0)
            chosen, best = np.where(cost < best, turn, chosen), np.minimum(cost, best)
        return chosen


def _place(scene: Scene, course: Array) -> tuple[Array, Array, Array]:
    """Other ships from the own one, along and across its old course [m], and their bearings from that [rad]."""
    c, s = np.cos(course)[:, None], np.sin(course)[:, None]
    north, east = scene.x[:, 1:] - scene.x[:, :1], scene.y[:, 1:] - scene.y[:, :1]
    x, y = north * c + east * s, east * c - north * s
    return x, y, np.arctan2(y, x)


@dataclass(frozen=True, eq=False)
class Seen:
    """Other ships as the own one sees them now, along and across its old course; arrays of shape (runs, others).

    Attributes:
        x, y: places from the own ship [m].
        north, east: velocities over ground [m/s].
        U: own speed [m/s], shape (runs, 1).
        passing: distance at which they are passed [m].
        act: time to a closest approach nearer than that at which the old course is left [s].
        horizon: the same from which another course is no way out [s].
        clear: whether the rules ask to keep clear.
        to_port: whether it stands on for a ship on its port side.
        overtakes: whether it overtakes the ship.
        bow: distance within which it does not pass ahead of one that it overtakes [m].
    """

    x: Array
    y: Array
    north: Array
    east: Array
    U: Array
    passing: Array
    act: Array
    horizon: Array
    clear: Bools
    to_port: Bools
    overtakes: Bools
    bow: Array

    def of(self, rows: NDArray[np.intp]) -> Self:
        """Some of the runs."""
        return replace(self, **{field.name: getattr(self, field.name)[rows] for field in fields(self)})

    def barred(self, turn: float) -> Array:
        """Cost of an alteration of course [rad] for each ship; 0 where it is free."""
        distance, t = self._approach(turn)
        wide, until = (self.passing * _WIDER, self.horizon) if turn else (self.passing, self.act)
        soon = (t > 0.0) & (t < until)
        # of courses that all meet somebody the one that leaves room: time alone chose a collision that is far off
        near = 2.0 - np.clip(distance / wide, 0.0, 1.0) - 0.5 * np.clip(t / self.horizon, 0.0, 1.0)
        cost = np.where(soon & (distance < wide), _BARRED * near, 0.0)
        cost += np.where(soon & self.overtakes & self._cuts_in(turn), 0.5 * _BARRED, 0.0)
        return cost + self._wrong(turn)

    @property
    def left(self) -> Array:
        """Time to the closest approach on the old course [s]; zero or less where it is past."""
        return self._approach(0.0)[1]

    def _wrong(self, turn: float) -> Array | float:
        """Cost of a course against the rules, while the old course would meet the ship."""
        if not turn:
            return 0.0
        distance, t = self._approach(0.0)
        risk = (distance < self.passing) & (t > 0.0) & (t < self.horizon)
        if turn < 0.0:  # to port: neither when keeping clear nor for a ship on the port side
            return np.where(risk & (self.clear | self.to_port), 0.5 * _BARRED, 0.0)
        w_x, w_y = self._relative(turn)
        starboard = self.x * w_y - self.y * w_x > 0.0
        return np.where(risk & self.clear & starboard, 0.25 * _BARRED, 0.0)

    def _cuts_in(self, turn: float) -> Bools:
        """Whether the ship is passed close before its bow."""
        (w_x, w_y), (distance, t) = self._relative(turn), self._approach(turn)
        past = np.maximum(t, 0.0)
        ahead = -(self.x + w_x * past) * self.north - (self.y + w_y * past) * self.east
        return (distance < self.bow) & (ahead > _AHEAD * distance * np.hypot(self.north, self.east))

    def _relative(self, turn: float) -> tuple[Array, Array]:
        return self.north - self.U * math.cos(turn), self.east - self.U * math.sin(turn)

    def _approach(self, turn: float) -> tuple[Array, Array]:
        """DCPA [m] and TCPA [s] on a course; 0 s, and the present distance, where the distance does not change."""
        w_x, w_y = self._relative(turn)
        t = -(self.x * w_x + self.y * w_y) / (w_x * w_x + w_y * w_y + 1e-6)
        past = np.maximum(t, 0.0)
        return np.hypot(self.x + w_x * past, self.y + w_y * past), t


def good(scene: Scene) -> KeepClear:
    """The reference autopilot that keeps the rules, from the first scene on."""
    return KeepClear(scene, Limits())


def bad(scene: Scene) -> KeepClear:
    """The reference autopilot that fails Rules 14 and 17: it turns to port, and as soon for ships that give way."""
    return KeepClear(scene, Limits(), rules=False, lean=20.0 * _DEG)
