"""Verdicts: every check of every ship towards every other, in all runs at once.

Contact fails a run whatever else it does.  Where two roles may be meant, a ship is in breach only if it is under each
of them.  Contact between other ships is told, and never the own ship's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import permutations
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ...core.errors import RequestError
from ...core.values import dataclass, replace
from ..tracks import Tracks
from .action import Action, action
from .checks import CHECKS, Check, View
from .geometry import Array, Bools, Closest, Motion, Pair, clearance, closest, touch
from .limits import Limits
from .roles import MUST_ACT, Encounter, Role, encounter


@dataclass(frozen=True, eq=False)
class Judged:
    """One ship towards one other in all runs; arrays of shape (...).

    Attributes:
        ship, other: their numbers in the tracks.
        pair, met, at, own: geometry, encounter, closest approach and action of the ship.
        role: the accepted role under which it does best.
        margins: by rule; NaN where it does not apply in that role.
        gap: least distance of the hulls [m]; below zero they touched.
    """

    ship: int
    other: int
    pair: Pair
    met: Encounter
    at: Closest
    own: Action
    role: NDArray[np.intp]
    margins: Mapping[str, Array]
    gap: Array

    @property
    def contact(self) -> Bools:
        """Whether the hulls touched."""
        return self.gap < 0.0

    @property
    def worst(self) -> Array:
        """Least margin of its rules; infinite where none applies."""
        return np.fmin.reduce([*self.margins.values(), np.full(self.role.shape, np.inf)])

    @property
    def fails(self) -> Bools:
        """Contact, or a rule that is not kept."""
        return self.contact | (self.worst < 0.0)

    def broken(self, where: tuple[int, ...] = ()) -> tuple[str, ...]:
        """Rules that are not kept in one run."""
        return tuple(rule for rule, margin in self.margins.items() if margin[where] < 0.0)


def motion(tracks: Tracks, ship: int) -> Motion:
    """One ship of the tracks."""
    x, y, psi, u, v_m = (one[..., ship, :] for one in (tracks.x, tracks.y, tracks.psi, tracks.u, tracks.v_m))
    return Motion(x, y, psi, u, v_m, tracks.L[ship : ship + 1], tracks.B[ship : ship + 1])


def judge(
    tracks: Tracks, limits: Limits | None = None, *, restricted: bool = False, own: bool = False,
    ranks: Sequence[int] = (),
) -> tuple[Judged, ...]:
    """Judge every ship towards every other, the own ship first.

    Args:
        tracks: of one run or of many.
        limits: thresholds; those of coastal waters unless given.
        restricted: whether visibility is (Rule 19 in place of Rules 11 to 18).
        own: judge the own ship only.
        ranks: of the ships (Rule 18), in order; those that are left out have none above others.

    Raises:
        RequestError: ships that touch in the first row, one of which is judged.
    """
    limits = limits or Limits()
    ships = [motion(tracks, k) for k in range(len(tracks.L))]
    pairs: dict[tuple[int, int], Pair] = {}
    gaps: dict[tuple[int, int], Array] = {}
    for i, j in ((i, j) for i, j in permutations(range(len(ships)), 2) if i == 0 or not own):
        pairs[i, j] = pairs[j, i].swapped if i > j else Pair(tracks.t, ships[i], ships[j])
        gaps[i, j] = gaps[j, i] if i > j else touch(pairs[i, j])
        apart(pairs[i, j], tracks.names[i], tracks.names[j])
    whole = (*ranks, *[0] * (len(ships) - len(ranks)))
    met = {(i, j): encounter(pair, limits, restricted=restricted, ranks=(whole[i], whole[j]))
           for (i, j), pair in pairs.items()}  # fmt: skip
    rows = len(tracks.t)
    return tuple(
        _judged(key, pairs, met, _busy(key, met, rows), gaps[key], limits) for key in sorted(pairs)
    )  # fmt: skip


def apart(pair: Pair, one: str, other: str) -> None:
    """Refuse runs that begin in contact: what follows is no encounter.

    Raises:
        RequestError: how many do.
    """
    first = replace(pair, own=pair.own.each(lambda one: one[..., :1]), other=pair.other.each(lambda one: one[..., :1]))
    touching = clearance(first) < 0.0
    if touching.any():
        count = int(touching.sum())
        raise RequestError(f"{one} and {other} touch in the first row of {count} of {touching.size} runs; "
                           "an encounter begins with ships apart")  # fmt: skip


def _busy(key: tuple[int, int], met: Mapping[tuple[int, int], Encounter], rows: int) -> Bools:
    """Rows since the ship has had to act for a third one."""
    found = np.zeros((*met[key].role.shape, rows), dtype=bool)
    for (ship, other), one in met.items():
        if ship == key[0] and other != key[1]:
            found |= one.during(rows) & np.isin(one.role, MUST_ACT)[..., None]
    return np.maximum.accumulate(found, axis=-1)


def _judged(
    key: tuple[int, int], pairs: Mapping[tuple[int, int], Pair], met: Mapping[tuple[int, int], Encounter],
    busy: Bools, gap: Array, limits: Limits,
) -> Judged:  # fmt: skip
    pair, here = pairs[key], met[key]
    rows = np.arange(len(pair.t))
    after = (rows >= here.begins[..., None]) & (rows <= np.where(here.exists, here.ends, rows[-1])[..., None])
    at = closest(pair, after)
    own, other = (action(one, pair.t, here, at.row, limits) for one in (pair.own, pair.other))
    checks = [check(View(pair, limits, here, at, own, other, busy)) for check in CHECKS]
    role = _best(checks, here)
    margins = {one.rule: np.where(one.applies & np.isin(role, one.roles), one.margin, np.nan) for one in checks}
    return Judged(*key, pair, here, at, own, role, MappingProxyType(margins), gap)


def _best(checks: list[Check], met: Encounter) -> NDArray[np.intp]:
    """The accepted role with the greatest least margin; the assumed one where roles do equally."""
    best, chosen = np.full(met.role.shape, -np.inf), met.role
    for role in (None, *Role):
        accepted = met.exists if role is None else met.accepted[..., role]
        at = met.role if role is None else np.full(met.role.shape, int(role))
        least = np.full(met.role.shape, np.inf)
        for one in checks:
            least = np.where(one.applies & np.isin(at, one.roles), np.minimum(least, one.margin), least)
        # a role that is kept is as good as another that is kept
        least = np.minimum(least, 0.0)
        better = accepted & (least > best)
        best, chosen = np.where(better, least, best), np.where(better, at, chosen)
    return chosen
