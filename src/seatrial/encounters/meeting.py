"""Ships that would meet an own ship: Imazu's problems, DNV's standard situations, and encounters drawn by rule.

The own ship begins at (0, 0) with heading 0.  Nobody alters course before it is asked to: what is stated of a meeting
(time, distance and role) holds for the tracks as they would be.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..core.errors import RequestError
from ..core.parameters import unknown
from ..core.values import dataclass, field
from ..data import Array
from .rules import Role
from .rules.geometry import wrapped

Span = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Meeting:
    """An own ship on course north, and ships around it at t = 0; arrays may have an axis of runs before the last.

    Attributes:
        U: speed of the own ship [m/s], shape (...).
        x, y: places of the targets north and east [m], shape (..., targets).
        psi, U_target: their courses [rad] and speeds [m/s], same shape.
    """

    U: float | Array
    x: Array
    y: Array
    psi: Array
    U_target: Array

    @property
    def approach(self) -> tuple[Array, Array]:
        """Distance [m] and time [s] of the closest approach of each target; infinite time at equal velocities."""
        U = np.asarray(self.U)[..., None]
        w_x, w_y = self.U_target * np.cos(self.psi) - U, self.U_target * np.sin(self.psi)
        square = w_x**2 + w_y**2
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(square > 0.0, -(self.x * w_x + self.y * w_y) / square, np.inf)
        at = np.where(np.isfinite(t), t, 0.0)
        return np.hypot(self.x + w_x * at, self.y + w_y * at), t

    @property
    def bearings(self) -> tuple[Array, Array]:
        """Bearing of the target from the own bow, and of the own ship from the target's [rad], -pi to pi."""
        beta = np.arctan2(self.y, self.x)
        return beta, wrapped(beta + math.pi - self.psi)

    @property
    def roles(self) -> NDArray[np.intp]:
        """The role of the own ship towards each target by DNV's sectors, tested in DNV's order; NONE outside them.

        Source: ship-traffic-generator of DNV (MIT); borders 112.5, 67.5 and 5 deg.
        """
        beta, alpha = map(np.degrees, self.bearings)
        bow, aspect = np.abs(beta), np.abs(alpha)
        cases = {
            Role.OVERTAKEN: (bow > 112.5) & (aspect <= 67.5),
            Role.OVERTAKING: (aspect > 112.5) & (bow <= 67.5),
            Role.HEAD_ON: (bow <= 5.0) & (aspect <= 5.0),
            Role.GIVE_WAY: (beta > 0.0) & (beta < 112.5) & (alpha > -112.5) & (alpha <= 5.0),
            Role.STAND_ON: (beta > -112.5) & (beta < 0.0) & (alpha >= -5.0) & (alpha < 112.5),
        }
        return np.select(list(cases.values()), [int(role) for role in cases], int(Role.NONE))


def shared(meeting: Meeting, own: int) -> tuple[Meeting, Array]:
    """One meeting as each of some ships has it: the own one, and the first of the targets.

    Args:
        meeting: arrays of shape (encounters, targets).
        own: how many ships.

    Returns:
        A meeting of ``own`` runs an encounter, side by side, in which the other ones of these are the first targets,
        and from where each has it: north, east [m] and course [rad], shape (runs, 3).
    """
    count = len(meeting.x)
    ships = [np.column_stack([np.broadcast_to(first, (count,)), one]) for first, one in (
        (0.0, meeting.x), (0.0, meeting.y), (0.0, meeting.psi), (meeting.U, meeting.U_target))]  # fmt: skip
    start = np.stack([one[:, :own] for one in ships[:3]], axis=-1).reshape(-1, 3)
    x, y, psi, U = (np.stack([np.delete(one, k, axis=1) for k in range(own)], axis=1).reshape(count * own, -1)
                    for one in ships)  # fmt: skip
    north, east, course = start.T[..., None]
    c, s = np.cos(course), np.sin(course)
    return Meeting(ships[3][:, :own].ravel(), (x - north) * c + (y - east) * s, (y - east) * c - (x - north) * s,
                   psi - course, U), start  # fmt: skip


def seen_from(meeting: Meeting, north: Array, east: Array, course: Array) -> tuple[Array, Array, Array]:
    """Places north and east [m] and courses [rad] of the targets, of an own ship at a place on a course.

    Args:
        north, east, course: of the own ship, shape (runs,); targets have shape (runs, targets).
    """
    x, y, psi = (np.atleast_2d(np.asarray(one, dtype=np.float64)) for one in (meeting.x, meeting.y, meeting.psi))
    c, s = np.cos(course)[:, None], np.sin(course)[:, None]
    return north[:, None] + x * c - y * s, east[:, None] + x * s + y * c, psi + course[:, None]


def _imazu(text: str) -> tuple[tuple[float | None, ...], ...]:
    return tuple(tuple(None if one == "s" else float(one) for one in row.split()) for row in text.split(","))


_IMAZU = _imazu(
    "180,-90,s,45,180 -90,-10 -45,s -45,180 90,-30 -90,-90 15,90 -30,180 -45 -10,180 10 45,-10 -45 -90,s -45 -90,"
    "45 90 -90,s 10 -45,-135 -15 -30,15 -15 -135,s -15 -90,-15 15 -90,s -45 -90"
)
"""Headings of the targets [deg] as coded in TUD_RL after Sawada et al. (2021); s is the slow ship ahead.

The thesis (Imazu 1987) was not at hand.  Problem 8 has its crossing ship from port, as in the coding of SFI, else it
were problem 5; problem 22 is problem 15 in every coding found.
"""


IMAZU_T = 1500.0
"""Usual time to the meeting of Imazu's problems [s]."""


def imazu(U: float, T: float, slow: float = 0.5) -> tuple[Meeting, ...]:
    """Imazu's 22 problems: all ships would be at (U T, 0) at time T, with the own speed, a slow one ahead at its share.

    Args:
        U: speed [m/s].
        T: time to the meeting [s].
        slow: speed of the slow ship ahead over U.
    """
    _positive(U=U, T=T)
    if not 0.0 <= slow < 1.0:
        raise RequestError(f"the slow ship ahead has {slow:g} of the own speed; a share from 0 to below 1 is overtaken")
    return tuple(_imazu_problem(row, U, T, slow) for row in _IMAZU)


def _imazu_problem(row: tuple[float | None, ...], U: float, T: float, slow: float) -> Meeting:
    psi = np.radians([one or 0.0 for one in row])
    speed = U * np.where([one is None for one in row], slow, 1.0)
    return Meeting(U, T * (U - speed * np.cos(psi)), -T * speed * np.sin(psi), psi, speed)


_DNV = (
    "HO 2 1.2 15,GW 20 .8 12,SO -30 .6 17,OG 15 .5 14,OS 195 1.6 19,HO -1 .9 11 HO 4 1.1 14,HO -4 1.4 20 GW 36 .8 10,"
    "HO 4 1.7 15 SO -36 .8 13,HO -2 1.1 13 OG 10 .5 16,HO 0 1 17 OS 176 1.9 15,GW 18 1.3 19 GW 102 1.4 15,"
    "GW 45 1.2 19 SO -99 1.3 16,GW 60 1.5 18 OG 35 .7 15,GW 80 1.2 12 OS -150 1.7 15,SO -85 1.5 17 SO -100 1.6 15,"
    "SO -105 1.3 16 OS -165 1.6 15,SO -105 1.2 13 OG 30 .8 10,OG 15 .7 15 OG 25 .6 19,OG 20 .6 20 OS 175 1.6 14,"
    "OS 160 1.8 15 OS 170 1.5 13,"
    "HO -2 1.2 19 HO 0 1 16 HO 4 1.5 14,HO -3 1.4 19 HO 2 1 20 GW 38 .8 18,HO 5 1.5 16 HO 2 1.8 14 SO -37 .7 17,"
    "HO -3 1.2 16 HO 2 1.8 14 OG 8 .5 20,HO -4 1.7 17 HO 0 1.3 15 OS 162 1.9 12,"
    "HO 3 1.5 20 GW 20 1.4 17 GW 102 1.2 13,HO -2 1.4 20 GW 45 1.2 17 SO -99 1.4 15,"
    "HO -3 1.2 20 GW 55 1.4 17 OG 30 .6 15,HO -1 .9 18 GW 80 1.2 20 OS -150 1.7 15,"
    "HO 1 .8 17 SO -85 1.5 15 SO -100 1.6 20,HO 0 .6 20 SO -100 1.2 17 OS -155 1.7 15,"
    "HO -1 .5 20 SO -110 1.3 15 OG 35 .8 17,HO 3 1.1 17 OG 20 .5 20 OG 25 .7 18,"
    "HO -3 1.3 17 OG 20 .6 16 OS 175 1.6 14,HO 2 1.3 14 OS 155 1.9 16 OS 170 1.5 18,"
    "GW 15 1.5 14 GW 35 1.4 17 GW 102 1.2 12,GW 85 1.6 16 GW 45 1.2 18 SO -105 1.4 15,"
    "GW 9 1.2 20 GW 45 1.4 17 OG 20 .4 18,GW 10 1.8 18 GW 80 1.2 20 OS -170 1.7 16,"
    "GW 10 .6 20 SO -75 1.5 15 SO -100 1.7 29,GW 75 1.8 21 SO -35 1.4 17 OS -155 1.7 15,"
    "GW 45 .9 18 SO -50 1.6 16 OG 35 .7 10,GW 25 1.2 18 OG 15 .5 20 OG -25 .7 25,"
    "GW 65 1.4 29 OG 20 .5 20 OS 175 1.6 14,GW 25 1.2 17 OS 155 1.8 15 OS -170 1.5 20,"
    "SO -10 .6 20 SO -75 1.5 15 SO -30 1.7 19,SO -20 1.8 18 SO -50 1.4 16 OS -165 1.9 22,"
    "SO -45 .9 20 SO -60 1.6 16 OG 35 .7 18,SO -25 1.4 18 OG 15 .6 20 OG -25 .7 25,"
    "SO -65 1.4 17 OG 15 .4 25 OS 175 1.6 20,SO -25 1.3 16 OS 155 1.8 11 OS -160 1.6 20,"
    "OG -15 .7 18 OG 15 .6 20 OG -25 .5 23,OG 0 .7 17 OG 10 .4 30 OS -175 1.7 20,"
    "OG -30 .7 20 OS 155 1.8 16 OS -160 1.8 18,OS 170 1.9 16 OS 155 1.8 17 OS -160 1.7 20"
)
"""The 55 situations of DNV's set (ship-traffic-generator, MIT): role, bearing [deg], ratio of speeds, min."""

_DNV_ROLES = {"HO": Role.HEAD_ON, "GW": Role.GIVE_WAY, "SO": Role.STAND_ON,
              "OG": Role.OVERTAKING, "OS": Role.OVERTAKEN}  # fmt: skip


def dnv(U: float = 5.1444) -> tuple[Meeting, ...]:
    """The 55 situations of DNV's standard set, with one, two and three targets; U is 10 kn there [m/s]."""
    _positive(U=U)
    found: list[Meeting] = []
    for text in _DNV.split(","):
        words = text.split()
        rows = [words[k : k + 4] for k in range(0, len(words), 4)]
        ships = [on_bearing(_DNV_ROLES[role], math.radians(float(beta)), float(k), U, 60.0 * float(T))
                 for role, beta, k, T in rows]  # fmt: skip
        found.append(together(ships))
    return tuple(found)


def on_bearing(role: Role, beta: float, k: float, U: float, T: float) -> Meeting:
    """One target on bearing beta [rad] with k times the own speed that would meet the own ship at time T [s].

    Its distance d solves d^2 - 2 d U T cos(beta) + (U T)^2 (1 - k^2) = 0; of two roots the one of the role is taken.

    Raises:
        RequestError: no ship of that role meets the own ship so.
    """
    _positive(U=U, T=T, k=k)
    R = U * T
    rest = math.cos(beta) ** 2 - 1.0 + k**2
    roots = {math.cos(beta) + sign * math.sqrt(rest) for sign in (1.0, -1.0)} if rest >= 0.0 else set[float]()
    for d in sorted(roots):
        x, y = d * R * math.cos(beta), d * R * math.sin(beta)
        one = Meeting(U, *(np.array([v]) for v in (x, y, math.atan2(-y, R - x), k * U)))
        if d > 0.0 and one.roles[0] == role:
            return one
    raise RequestError(f"no ship at {math.degrees(beta):g} deg with {k:g} of the own speed meets it as "
                       f"{role.name.lower()}; another bearing or ratio of speeds does")  # fmt: skip


def together(ships: Iterable[Meeting]) -> Meeting:
    """The targets of several meetings around one own ship, which has the same speed in all of them."""
    ships = tuple(ships)
    if not ships or any(np.any(one.U != ships[0].U) for one in ships):
        raise RequestError("meetings put together have to be of one own ship: one speed U")
    names = ("x", "y", "psi", "U_target")
    return Meeting(ships[0].U, *(np.concatenate([getattr(one, name) for one in ships], axis=-1) for name in names))


@dataclass(frozen=True)
class Ranges:
    """From where encounters are drawn, uniformly.

    Attributes:
        T: time to the closest approach [s].
        miss: distance at the closest approach [m], on either side.
        apart: least distance at the start [m]: ships on nearly one course and speed begin beside each other.
        k: ratio of speeds for each role.  Defaults are those of DNV's generator.
    """

    T: Span = (600.0, 1200.0)
    miss: Span = (0.0, 0.0)
    apart: float = 0.0
    k: Mapping[Role, Span] = field(default_factory=lambda: {
        Role.HEAD_ON: (0.5, 1.5), Role.GIVE_WAY: (0.5, 1.5), Role.STAND_ON: (0.5, 1.5),
        Role.OVERTAKING: (0.25, 0.75), Role.OVERTAKEN: (1.5, 2.0),
    })  # fmt: skip

    def __post_init__(self) -> None:
        spans = {"T": self.T, "miss": self.miss, **{f"k of {role.name.lower()}": k for role, k in self.k.items()}}
        spans["apart"] = (self.apart, self.apart)
        for name, (low, high) in spans.items():
            if not (0.0 <= low <= high < math.inf):
                raise RequestError(f"{name} is drawn from {low:g} to {high:g}; it rises from 0 or more to a number")


_BLOCK, _BARREN = 4096, 64
"""Candidates drawn at once, and how many such blocks without a single encounter are the end of the search."""


def drawn(roles: Iterable[Role], count: int, U: float, seed: int, ranges: Ranges | None = None) -> Meeting:
    """Encounters in which the own ship has these roles, one target each: arrays of shape (count, targets).

    Time, miss, ratio of speeds and course are drawn uniformly; those of another role at the start are left out.  The
    miss is perpendicular to the relative velocity, so the closest approach is at T and as far as drawn, exactly.  The
    first rows are the same for any greater count.

    Raises:
        RequestError: nothing of a role is found within the ranges, or a role has none.
    """
    _positive(U=U)
    if count < 1 or seed < 0:
        raise RequestError(f"{count} encounters from seed {seed}: one or more are drawn, from a seed of 0 or more")
    ranges = ranges or Ranges()
    return together([_of_role(role, count, U, np.random.default_rng((seed, target)), ranges)
                     for target, role in enumerate(roles)])  # fmt: skip


def _of_role(role: Role, count: int, U: float, rng: np.random.Generator, ranges: Ranges) -> Meeting:
    if role not in ranges.k:
        raise RequestError(f"no ratio of speeds is given for {role.name.lower()}")
    kept: list[Array] = []
    found, barren = 0, 0
    while found < count and barren < _BARREN:  # blocks of one size: the first rows do not depend on the count
        rows = _candidates(ranges.k[role], U, rng, ranges)
        is_one = Meeting(U, *(row[:, None] for row in rows)).roles[:, 0] == role
        kept.append(rows[:, is_one & (np.hypot(rows[0], rows[1]) >= ranges.apart)])
        found, barren = found + kept[-1].shape[1], 0 if kept[-1].size else barren + 1
    if found < count:
        raise RequestError(f"no encounter of {role.name.lower()} is found within these ranges; "
                           "another ratio of speeds or a smaller miss has some")  # fmt: skip
    return Meeting(U, *(row[:count, None] for row in np.concatenate(kept, axis=1)))


def _candidates(k: Span, U: float, rng: np.random.Generator, ranges: Ranges) -> Array:
    """Place, course and speed of a block of targets of any role, shape (4, block)."""
    T, miss, ratio = (rng.uniform(*span, _BLOCK) for span in (ranges.T, ranges.miss, k))
    psi, side = rng.uniform(-math.pi, math.pi, _BLOCK), rng.choice((-1.0, 1.0), _BLOCK)
    speed = ratio * U
    w_x, w_y = speed * np.cos(psi) - U, speed * np.sin(psi)
    along = side * miss / np.maximum(np.hypot(w_x, w_y), 1e-9 * U)
    return np.stack([-along * w_y - w_x * T, along * w_x - w_y * T, psi, speed])


def named(text: str, U: float, seed: int = 1) -> Meeting:
    """One encounter by its name: "imazu:7", "dnv:3", or "drawn:give-way+stand-on" from a seed.

    Args:
        U: speed of the own ship [m/s].

    Raises:
        RequestError: no such encounter.
    """
    which, _, rest = text.partition(":")
    if which == "drawn":
        one = drawn([role(name) for name in rest.split("+")], 1, U, seed)
        return Meeting(U, *(getattr(one, name)[0] for name in ("x", "y", "psi", "U_target")))
    some = {"imazu": lambda: imazu(U, IMAZU_T), "dnv": lambda: dnv(U)}
    if which not in some:
        raise RequestError(f"'{text}': {unknown(which, (*some, 'drawn'), 'set of encounters')}")
    known = some[which]()
    number = int(rest) if rest.isascii() and rest.isdigit() else 0
    if not 1 <= number <= len(known):
        raise RequestError(f"'{text}': {which} has the numbers 1 to {len(known)}, such as {which}:7")
    return known[number - 1]


def role(name: str) -> Role:
    """A role by its name, such as "give-way".

    Raises:
        RequestError: none of that name is drawn.
    """
    known = {one.name.lower().replace("_", "-"): one for one in Ranges().k}
    if name not in known:
        raise RequestError(unknown(name, known, "role"))
    return known[name]


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not 0.0 < value < math.inf:
            raise RequestError(f"{name} is {value:g}; it is a number above zero")
