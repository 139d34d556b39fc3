"""Who has to do what: the class of an encounter as one ship has it, where two classes may be meant, and until when.

A ship's part is settled when risk of collision begins, and kept until the other is past and clear (Rule 13(d)).
Sectors are of headings, which lights show; the approach is of velocities over ground.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from .geometry import Array, Bools, Pair, taken, wrapped
from .limits import Limits

_ABAFT = np.radians(112.5)
"""Rule 13(b): 22.5 deg abaft the beam."""

_CLEAR = 1.05
"""Share of the range at the beginning beyond which ships that draw apart are clear."""


class Role(IntEnum):
    """The part of one ship towards one other.

    UNSEEN in restricted visibility, where there are no others (Rule 19); YIELDS to a ship that goes before it by its
    kind (Rule 18).
    """

    NONE = 0
    HEAD_ON = 1
    OVERTAKING = 2
    GIVE_WAY = 3
    STAND_ON = 4
    OVERTAKEN = 5
    UNSEEN = 6
    YIELDS = 7


MUST_ACT = (Role.HEAD_ON, Role.OVERTAKING, Role.GIVE_WAY, Role.UNSEEN, Role.YIELDS)
"""Parts that ask for action."""

KINDS: Mapping[str, int] = MappingProxyType({
    "power-driven": 0, "sailing": 1, "fishing": 2, "restricted": 3, "not under command": 3,
})  # fmt: skip
"""Rank of a ship by its kind (Rule 18(a) to (c)): who has the lower one keeps out of the way of the higher.

One that is constrained by its draught (18(d)) is not impeded, which is no part of its own: it counts as power-driven.
"""

STATUS: Mapping[int, str] = MappingProxyType({2: "not under command", 3: "restricted", 7: "fishing", 8: "sailing"})
"""Kinds by the navigational status of AIS (ITU-R M.1371-5, table 45); all others are power-driven."""


@dataclass(frozen=True, eq=False)
class Encounter:
    """An encounter as the own ship has it; arrays of shape (...), one for each run.

    Attributes:
        exists: whether there was risk of collision at all.
        begins, ends: rows at which the risk begins and the other ship is past and clear (the last row if never).
        over: whether it was past and clear before the record ended.
        tcpa: time to the closest approach at the beginning [s].
        accepted: of each role whether it may be meant, shape (..., roles).
        role: the one to assume: by Rules 13(c) and 14(c) where there is doubt, else by the side of the other ship.
        alike: whether both are of one rank, so that Rules 14 and 15 hold.
    """

    exists: Bools
    begins: NDArray[np.intp]
    ends: NDArray[np.intp]
    over: Bools
    tcpa: Array
    accepted: Bools
    role: NDArray[np.intp]
    alike: bool = True

    def during(self, rows: int) -> Bools:
        """Rows of the encounter, shape (..., rows)."""
        k = np.arange(rows)
        return (k >= self.begins[..., None]) & (k <= self.ends[..., None]) & self.exists[..., None]


def encounter(
    pair: Pair, limits: Limits, *, restricted: bool = False, ranks: tuple[int, int] = (0, 0)
) -> Encounter:  # fmt: skip
    """When risk of collision begins between two ships, the role of the own ship in it, and when it is over.

    Risk (Rule 7): on the present velocities the ships pass nearer than `passing` within `horizon`.  Past and clear:
    they draw apart, each abaft the beam of the other, or farther off than at the beginning by a twentieth, so that a
    ship that turns away and comes back is in the same encounter.
    """
    dcpa, tcpa = pair.approach
    passing, horizon = limits.passing.of(pair.lengths), limits.horizon.of(pair.lengths)
    closing = tcpa > 0.0  # False where the distance does not change
    risk = (dcpa < passing) & closing & (tcpa <= horizon)
    abaft = (np.abs(pair.beta) > 0.5 * np.pi) & (np.abs(pair.alpha) > 0.5 * np.pi)
    exists, begins = np.asarray(risk.any(axis=-1)), risk.argmax(axis=-1)
    away = pair.range >= np.maximum(passing, _CLEAR * taken(pair.range, begins)[..., None])
    past = ~closing & (abaft | away) & (np.arange(len(pair.t)) > begins[..., None])
    over = np.asarray(past.any(axis=-1))
    ends = np.where(over, past.argmax(axis=-1), len(pair.t) - 1)
    beta, alpha, psi, other = (taken(one, begins) for one in (pair.beta, pair.alpha, pair.own.psi, pair.other.psi))
    accepted = classes(beta, alpha, wrapped(other - psi), limits)
    alike = restricted or ranks[0] == ranks[1]
    if restricted:
        accepted = np.broadcast_to(np.arange(len(Role)) == Role.UNSEEN, accepted.shape)
    elif not alike:
        accepted = by_rank(accepted, ranks[0] < ranks[1])
    accepted = accepted & exists[..., None]
    crossing = np.where(beta > 0.0, int(Role.GIVE_WAY), int(Role.STAND_ON))
    if not alike:
        crossing = np.full_like(crossing, int(Role.YIELDS if ranks[0] < ranks[1] else Role.STAND_ON))
    assumed = (Role.UNSEEN, Role.OVERTAKING, Role.HEAD_ON, Role.OVERTAKEN)
    cases = [~exists, *(accepted[..., one] for one in assumed)]
    role = np.select(cases, [int(Role.NONE), *map(int, assumed)], crossing)
    return Encounter(exists, begins, ends, over & exists, taken(tcpa, begins), accepted, role, alike)


def by_rank(accepted: Bools, yields: bool) -> Bools:
    """Roles that may be meant between ships of two ranks (Rule 18), of those between ships of one."""
    found = np.zeros_like(accepted)
    found[..., Role.OVERTAKING], found[..., Role.OVERTAKEN] = (accepted[..., one] for one in (
        Role.OVERTAKING, Role.OVERTAKEN))  # fmt: skip
    met = accepted[..., [Role.HEAD_ON, Role.GIVE_WAY, Role.STAND_ON]].any(axis=-1)
    found[..., Role.YIELDS if yields else Role.STAND_ON] = met
    return found


def classes(beta: Array, alpha: Array, turned: Array, limits: Limits) -> Bools:
    """Of each role whether it may be meant, all borders moved out by the tolerance; shape (..., roles).

    `turned` is the other's heading less the own one.  The other ship sees the same with `beta` and `alpha` exchanged.

    - overtaking: the own ship is in the other's stern sector (more than 112.5 deg from its bow);
    - overtaken: the other ship is in the own stern sector;
    - head-on: each has the other ahead, or they are on nearly reciprocal courses with each other on the same side;
    - crossing: the ship that has the other on its starboard side gives way.

    The tolerance lets a class in beside another; it drives none out.
    """
    doubt, sure, widest = limits.doubt.value, limits.ahead.value, limits.ahead_widest.value
    bow, aspect = np.abs(beta), np.abs(alpha)
    forward, facing = bow <= _ABAFT + doubt, aspect <= _ABAFT + doubt
    opposite = np.abs(wrapped(turned - np.pi)) <= limits.reciprocal.value
    same_side = (beta * alpha > 0.0) & opposite & (bow < 0.5 * np.pi) & (aspect < 0.5 * np.pi)
    crosses = forward & facing & ~((bow <= sure) & (aspect <= sure)) & ~same_side
    found = np.zeros((*np.shape(beta), len(Role)), dtype=bool)
    found[..., Role.HEAD_ON] = ((bow <= widest) & (aspect <= widest)) | same_side
    found[..., Role.OVERTAKING] = (aspect > _ABAFT - doubt) & forward
    found[..., Role.OVERTAKEN] = (bow > _ABAFT - doubt) & facing
    found[..., Role.GIVE_WAY] = crosses & (beta > -doubt)
    found[..., Role.STAND_ON] = crosses & (beta < doubt)
    return found
