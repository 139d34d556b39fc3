"""How ships behave in encounters: by the rules of the road, or not; for many runs at once.

A ship settles its part towards each other ship when risk of collision begins and keeps it until that one is past and
clear.  Who has to act tries alterations of course in turn, then less speed, and takes the first that keeps clear of
everybody on straight courses after its own turn; it goes back when its old course is clear and nobody of them is ahead.
The rule-based kind of target ships of Hasegawa et al. (2012): deterministic, and it explains itself.  Copies of one
method test agreement, so a case mixes conducts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..data import Array
from .rules.geometry import Bools, approach, wrapped
from .rules.limits import Limits
from .rules.roles import MUST_ACT, Role, classes

_MARGIN = 1.3
"""Passing distance that a ship aims at, over what the rules ask for: its turn takes room."""
_DEG = math.pi / 180.0
_SLOWER = (0.5, 0.0)
_TURNING = 0.25
"""Rate of turn with moderate rudder, times L/U."""


class Orders(NamedTuple):
    """What a ship is to do, shape (runs,): heading [rad], and speed over that at the start."""

    psi: Array
    speed: Array


@dataclass(frozen=True, eq=False)
class Scene:
    """All ships at one moment, shape (runs, ships), as the ship that looks knows them.

    Attributes:
        t: time [s].
        x, y, psi: place of midship [m] and heading [rad].
        north, east: velocity over ground [m/s].
        L: lengths [m], shape (ships,).
    """

    t: float
    x: Array
    y: Array
    psi: Array
    north: Array
    east: Array
    L: Array


class Master(Protocol):
    """Who steers one ship in all runs: a conduct at work, or a system under test."""

    def look(self, scene: Scene) -> Orders:
        """Orders after a look around."""
        ...


@dataclass(frozen=True)
class Conduct:
    """A way to behave.

    Attributes:
        gives_way: whether it acts where it has to.
        act: share of the horizon of Rule 7 at which it acts: 1 at once.
        helps: time to the closest approach at which it acts where it should stand on, over `alone` of the rules: 1 as
            Rule 17(a)(ii) permits, infinite at once, 0 never.
        side: 1 alters to starboard, -1 to port.
        alterations: of course, in the order in which they are tried [rad].
    """

    gives_way: bool = True
    act: float = 1.0
    helps: float = 1.0
    side: float = 1.0
    alterations: tuple[float, ...] = tuple(k * _DEG for k in (30.0, 45.0, 60.0, 75.0, 90.0, 120.0, 150.0, 180.0))


CONDUCTS: Mapping[str, Conduct] = MappingProxyType({
    "rules": Conduct(),
    "port": Conduct(side=-1.0, helps=math.inf),
    "ignores": Conduct(gives_way=False, helps=0.0),
    "late": Conduct(act=0.15, helps=0.5),
    "small": Conduct(alterations=(12.0 * _DEG,)),
    "nervous": Conduct(helps=math.inf),
})  # fmt: skip
"""By the rules; alters to port, and does not stand on; ignores everybody; acts late; too little; does not stand on."""


class Watch:
    """A conduct at work aboard one ship in many runs.

    Attributes:
        role: part towards each ship, shape (runs, ships).
        risk: whether risk of collision has begun and is not over, same shape.
    """

    def __init__(self, conduct: Conduct, ship: int, scene: Scene, speed: Array, limits: Limits) -> None:
        """Begin at a scene.

        Args:
            ship: its number in the scene.
            speed: its speed at the start [m/s], shape (runs,).
        """
        runs, ships = scene.x.shape
        self._conduct, self._ship, self._limits, self._speed = conduct, ship, limits, speed
        self._course = scene.psi[:, ship].copy()
        self._psi, self._share, self._off = self._course.copy(), np.ones(runs), np.zeros(runs, dtype=bool)
        self.role = np.full((runs, ships), int(Role.NONE))
        self.risk = np.zeros((runs, ships), dtype=bool)
        lengths = np.maximum(scene.L, scene.L[ship])
        self._passing, self._horizon = limits.passing.of(lengths), limits.horizon.of(lengths)
        self._alone = limits.alone.of(lengths)
        self._others = np.arange(ships) != ship

    def look(self, scene: Scene) -> Orders:
        """Settle parts, act, hold, or go back."""
        own = self._ship
        place = scene.x - scene.x[:, own : own + 1], scene.y - scene.y[:, own : own + 1]
        relative = scene.north - scene.north[:, own : own + 1], scene.east - scene.east[:, own : own + 1]
        dcpa, tcpa = approach(*place, *relative)
        bearing = np.arctan2(place[1], place[0])
        beta = wrapped(bearing - scene.psi[:, own : own + 1])
        alpha = wrapped(bearing + math.pi - scene.psi)
        closing = (tcpa > 0.0) & self._others
        self._settle(scene, dcpa, tcpa, beta, alpha, closing)
        abaft = np.abs(beta) > 0.5 * math.pi
        act = self._acts(tcpa, closing & (dcpa < self._passing))
        rows = np.flatnonzero(act & ~self._off | self._off & act & ~self._clear(scene, self._psi, self._share, None))
        if rows.size:
            self._choose(scene, rows)
        back = np.flatnonzero(self._off & (~self.risk | abaft | ~closing).all(axis=1))
        if back.size:
            clear = self._clear(scene, self._course, np.ones(len(self._course)), back)
            home = back[clear]
            self._psi[home], self._share[home], self._off[home] = self._course[home], 1.0, False
        return Orders(self._psi, self._share)

    def _settle(self, scene: Scene, dcpa: Array, tcpa: Array, beta: Array, alpha: Array, closing: Bools) -> None:
        """Parts towards those with whom risk begins, and an end to those that are past and clear."""
        near = closing & (dcpa < self._passing) & (tcpa <= self._horizon)
        new = near & ~self.risk
        if new.any():
            rows, ships = np.nonzero(new)
            b, a = beta[rows, ships], alpha[rows, ships]
            may = classes(b, a, wrapped(scene.psi[rows, ships] - scene.psi[rows, self._ship]), self._limits)
            doubt = [may[:, one] for one in (Role.OVERTAKING, Role.HEAD_ON, Role.OVERTAKEN)]
            crossing = np.where(b > 0.0, int(Role.GIVE_WAY), int(Role.STAND_ON))
            self.role[rows, ships] = np.select(
                doubt, [int(Role.OVERTAKING), int(Role.HEAD_ON), int(Role.OVERTAKEN)], crossing)  # fmt: skip
        past = ~closing & (np.abs(beta) > 0.5 * math.pi) & (np.abs(alpha) > 0.5 * math.pi)
        self.risk = (self.risk | near) & ~past

    def _acts(self, tcpa: Array, danger: Bools) -> Bools:
        """Runs in which it has to act now, as it sees it: for somebody who will pass too near on present courses."""
        must = np.isin(self.role, MUST_ACT) & (tcpa <= self._conduct.act * self._horizon)
        help_at = self._alone * self._conduct.helps if self._conduct.helps else np.zeros_like(self._alone)
        helps = np.isin(self.role, (Role.STAND_ON, Role.OVERTAKEN)) & (tcpa <= help_at)
        return np.asarray((self.risk & danger & (must & self._conduct.gives_way | helps)).any(axis=1))

    def _choose(self, scene: Scene, rows: NDArray[np.intp]) -> None:
        """The first manoeuvre that keeps clear of everybody, else that with the greatest distance."""
        course, conduct = self._course[rows], self._conduct
        tried = [(course + conduct.side * one, 1.0) for one in conduct.alterations]
        tried += [(course, one) for one in _SLOWER]
        best, psi, share = np.full(rows.size, -np.inf), self._psi[rows].copy(), self._share[rows].copy()
        found = np.zeros(rows.size, dtype=bool)
        for heading, factor in tried:
            room = self._room(scene, heading, np.full(rows.size, factor), rows)
            take = ~found & ((room >= 0.0) | (room > best))
            psi, share = np.where(take, heading, psi), np.where(take, factor, share)
            best, found = np.where(take, room, best), found | (room >= 0.0)
        self._psi[rows], self._share[rows], self._off[rows] = psi, share, True

    def _clear(self, scene: Scene, psi: Array, share: Array, rows: NDArray[np.intp] | None) -> Bools:
        rows = np.arange(len(psi)) if rows is None else rows
        return self._room(scene, psi[rows], share[rows], rows) >= 0.0

    def _room(self, scene: Scene, psi: Array, share: Array, rows: NDArray[np.intp]) -> Array:
        """Least distance to anybody beyond the passing distance that it aims at [m], after a turn of its own."""
        own = self._ship
        now = wrapped(psi - scene.psi[rows, own])
        speed = self._speed[rows]
        t = np.abs(now) * scene.L[own] / (_TURNING * np.maximum(speed, 1e-3))
        middle = scene.psi[rows, own] + 0.5 * now
        ahead_n, ahead_e = speed * t * np.cos(middle), speed * t * np.sin(middle)
        north = scene.x[rows] + scene.north[rows] * t[:, None] - (scene.x[rows, own] + ahead_n)[:, None]
        east = scene.y[rows] + scene.east[rows] * t[:, None] - (scene.y[rows, own] + ahead_e)[:, None]
        v_north = scene.north[rows] - (share * speed * np.cos(psi))[:, None]
        v_east = scene.east[rows] - (share * speed * np.sin(psi))[:, None]
        dcpa, tcpa = approach(north, east, v_north, v_east)
        far = (tcpa > 1.5 * self._horizon) | ~self._others
        return np.where(far, np.inf, dcpa - _MARGIN * self._passing).min(axis=1)
