"""How ships behave in encounters: by the rules of the road, or not; for many runs at once.

A ship settles its part towards each other ship when risk of collision begins and keeps it until that one is past and
clear.  Who has to act tries alterations of course in turn, then less speed, and takes the first that keeps clear of
everybody on straight courses after its own turn; it goes back when its old course is clear and nobody of them is ahead.
The rule-based kind of target ships of Hasegawa et al. (2012): deterministic, and it explains itself.  Copies of one
method test agreement, so a case mixes conducts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.values import dataclass
from ..data import Array
from .rules.geometry import STILL, Bools, wrapped
from .rules.limits import Limits
from .rules.roles import MUST_ACT, Role, classes

_MARGIN = 1.3
"""Passing distance that a ship aims at, over what the rules ask for: its turn takes room."""
_DEG = math.pi / 180.0
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
        ranks: of the ships by their kind (Rule 18), of as many as have one above others.
    """

    t: float
    x: Array
    y: Array
    psi: Array
    north: Array
    east: Array
    L: Array
    ranks: tuple[int, ...] = ()

    def above(self, ship: int) -> NDArray[np.intp]:
        """Rank of each ship over that of one, shape (ships,)."""
        whole = np.array((*self.ranks, *[0] * (len(self.L) - len(self.ranks))), dtype=np.intp)
        return whole - whole[ship]

    @cached_property
    def bow(self) -> tuple[Array, Array]:
        """Cosine and sine of the headings."""
        return np.cos(self.psi), np.sin(self.psi)

    @cached_property
    def going(self) -> Array:
        """x, y, north and east, runs side by side: shape (4, ships, runs)."""
        return np.stack([one.T for one in (self.x, self.y, self.north, self.east)])


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


SLOWER = (0.5, 0.0)
"""Shares of the speed that are tried after all alterations, on the old course."""

_KEPT = ("role", "risk", "_psi", "_share", "_off", "_until")
"""What a watch remembers between two looks."""


class Watch:
    """Conducts at work aboard one ship in many runs.

    Attributes:
        role: part towards each ship, shape (runs, ships).
        risk: whether risk of collision has begun and is not over, same shape.
    """

    def __init__(
        self, known: Sequence[Conduct], chosen: NDArray[np.intp], ship: int, scene: Scene, speed: Array, limits: Limits,
        slower: Sequence[float] = SLOWER,
    ) -> None:  # fmt: skip
        """Begin at a scene.

        Args:
            known: conducts.
            chosen: number of the one of each run.
            ship: its number in the scene.
            speed: its speed at the start [m/s], shape (runs,).
            slower: shares of the speed that it can try; none for a ship that holds it.
        """
        runs, ships = scene.x.shape
        self._ship, self._limits, self._speed, self._slower = ship, limits, speed, tuple(slower)
        self._course = scene.psi[:, ship].copy()
        self._psi, self._share, self._off = self._course.copy(), np.ones(runs), np.zeros(runs, dtype=bool)
        self.role = np.full((runs, ships), int(Role.NONE), order="F")  # runs side by side, as those of scenes
        self.risk = np.zeros((runs, ships), dtype=bool, order="F")
        lengths = np.maximum(scene.L, scene.L[ship])
        self._passing, self._horizon = limits.passing.of(lengths), limits.horizon.of(lengths)
        act = np.array([one.act if one.gives_way else -1.0 for one in known])
        helps = np.array([one.helps or -1.0 for one in known])
        self._act_at = act[chosen, None] * self._horizon
        self._help_at = helps[chosen, None] * limits.alone.of(lengths)
        most = max(len(one.alterations) for one in known)
        tried = [[one.side * turn for turn in one.alterations] for one in known]
        # the last one again is never better than itself
        self._tried = np.array([turns + turns[-1:] * (most - len(turns)) for turns in tried])[chosen]
        self._until = np.full((runs, ships), -1.0, order="F")
        """Time left at which it acts for each ship [s]; below zero where it never does."""

    def look(self, scene: Scene) -> Orders:
        """Settle parts, act, hold, or go back."""
        own, risk = self._ship, self.risk.T
        x, y, north, east = scene.going - scene.going[:, own : own + 1]  # all of shape (ships, runs) from here
        square, toward = north * north + east * east, -(x * north + y * east)
        closing = (toward > 0.0) & (square >= STILL**2)
        tcpa = toward / np.maximum(square, STILL**2)
        danger = closing & ((x + tcpa * north) ** 2 + (y + tcpa * east) ** 2 < self._passing[:, None] ** 2)
        near = danger & (tcpa <= self._horizon[:, None])
        self._settle(scene, x, y, near & ~risk)
        cos, sin = (one.T for one in scene.bow)
        abaft = x * cos[own] + y * sin[own] < 0.0
        risk = (risk | near) & (closing | ~(abaft & (x * cos + y * sin > 0.0)))
        self.risk = risk.T
        self._alter(scene, np.asarray((risk & danger & (tcpa <= self._until.T)).any(axis=0)))
        back = np.flatnonzero(self._off)
        back = back[(~risk | abaft | ~closing).all(axis=0)[back]]
        if back.size:
            home = back[self._room(scene, self._course[back], np.ones(back.size), back) >= 0.0]
            self._psi[home], self._share[home], self._off[home] = self._course[home], 1.0, False
        return Orders(self._psi, self._share)

    def snapshot(self) -> dict[str, list[Any]]:
        return {name: getattr(self, name).tolist() for name in _KEPT}

    def restore(self, saved: Mapping[str, list[Any]]) -> None:
        for name in _KEPT:
            setattr(self, name, np.array(saved[name], dtype=getattr(self, name).dtype))

    def _settle(self, scene: Scene, x: Array, y: Array, new: Bools) -> None:
        """Parts towards those with whom risk begins, and when to act for them."""
        if not new.any():
            return
        ships, rows = np.nonzero(new)
        bearing, psi = np.arctan2(y[new], x[new]), scene.psi[rows, ships]
        own = scene.psi[rows, self._ship]
        b, a = wrapped(bearing - own), wrapped(bearing + math.pi - psi)
        may = classes(b, a, wrapped(psi - own), self._limits)
        doubt = [may[:, one] for one in (Role.OVERTAKING, Role.HEAD_ON, Role.OVERTAKEN)]
        crossing = np.where(b > 0.0, int(Role.GIVE_WAY), int(Role.STAND_ON))
        role = np.select(doubt, [int(Role.OVERTAKING), int(Role.HEAD_ON), int(Role.OVERTAKEN)], crossing)
        if scene.ranks:  # Rule 18, but for who overtakes
            above, free = scene.above(self._ship)[ships], role != Role.OVERTAKING
            role = np.where(free & (above < 0), int(Role.STAND_ON), role)
            role = np.where(free & (above > 0), int(Role.YIELDS), role)
        self.role[rows, ships] = role
        must = np.isin(role, MUST_ACT)
        self._until[rows, ships] = np.where(must, self._act_at[rows, ships], self._help_at[rows, ships])

    def _alter(self, scene: Scene, act: Bools) -> None:
        """Runs that have to act, and do not yet, or whose manoeuvre is no longer clear of everybody."""
        holding = np.flatnonzero(act & self._off)
        if holding.size:
            clear = self._room(scene, self._psi[holding], self._share[holding], holding) >= 0.0
            act[holding[clear]] = False
        rows = np.flatnonzero(act)
        if rows.size:
            self._choose(scene, rows)

    def _choose(self, scene: Scene, rows: NDArray[np.intp]) -> None:
        """The first manoeuvre that keeps clear of everybody, else that with the greatest distance."""
        best = np.full(rows.size, -np.inf)
        turns, slower = self._tried.shape[1], len(self._slower)
        for k in range(turns + slower):
            heading = self._course[rows] + (self._tried[rows, k] if k < turns else 0.0)
            share = np.full(rows.size, 1.0 if k < turns else self._slower[k - turns])
            room = self._room(scene, heading, share, rows)
            take = (room >= 0.0) | (room > best)
            at = rows[take]
            self._psi[at], self._share[at], self._off[at] = heading[take], share[take], True
            left = room < 0.0
            rows, best = rows[left], np.maximum(best, room)[left]
            if not rows.size:
                return

    def _room(self, scene: Scene, psi: Array, share: Array, rows: NDArray[np.intp]) -> Array:
        """Least distance to anybody beyond the passing distance that it aims at [m], after a turn of its own."""
        own = self._ship
        x, y, north, east = scene.going.take(rows, axis=2)
        heading, speed = scene.psi[rows, own], self._speed[rows]
        now = wrapped(psi - heading)
        t = np.abs(now) * scene.L[own] / (_TURNING * np.maximum(speed, 1e-3))
        middle, way = heading + 0.5 * now, speed * t
        ahead_n, ahead_e = way * np.cos(middle), way * np.sin(middle)
        far_n, far_e = x + north * t - (x[own] + ahead_n), y + east * t - (y[own] + ahead_e)
        over = share * speed
        north, east = north - over * np.cos(psi), east - over * np.sin(psi)
        square = north * north + east * east
        tcpa = -(far_n * north + far_e * east) / np.maximum(square, STILL**2)
        tcpa[square < STILL**2] = 0.0  # the distance stays
        left = np.maximum(tcpa, 0.0)
        dcpa = np.sqrt((far_n + left * north) ** 2 + (far_e + left * east) ** 2)
        room = dcpa - _MARGIN * self._passing[:, None]
        room[tcpa > 1.5 * self._horizon[:, None]] = np.inf
        room[own] = np.inf
        return np.asarray(room.min(axis=0))
