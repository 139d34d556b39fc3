"""The tracks of all ships of a run, kept as it goes, and how the own ship passed each of the others by them.

Distances, contact of hulls and the rules of the road are those of `encounters.rules`, which judges a safety case too.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from ...core.values import dataclass
from ...encounters import Tracks
from ...encounters.rules import Judged, judge
from ...encounters.rules.geometry import Array, Motion, Pair, clearance, closest
from ..bridge.view import beam
from ..fleet import Vessel
from ..loop import Loop

_EVERY, _MOST = 1.0, 5000
"""Time between two rows [s], and how many are kept: of a longer run every second one, and so on."""

_STATES = ("x", "y", "psi", "u", "v_m")


@dataclass(frozen=True, eq=False)
class Passed:
    """How another ship was passed.

    Attributes:
        distance, t: least distance of the midships [m] and when [s].
        touched: when the hulls touched first [s]; None if they did not.
        in_hand: least time to a nearest approach within the limits that was left before it was avoided [s]; None if
            there was none to avoid.
        judged: the own ship towards it by the rules of the road.
    """

    distance: float
    t: float
    touched: float | None
    in_hand: float | None
    judged: Judged

    @property
    def margins(self) -> Mapping[str, float]:
        """Of each rule that applied."""
        return {rule: float(one) for rule, one in self.judged.margins.items() if np.isfinite(one)}


class Wakes:
    """The tracks of a loop.

    A row is kept each second, and each tick while hulls may touch; none where nobody else is there.

    Attributes:
        begun: which ships touch at the start; empty where none do.
    """

    def __init__(self, loop: Loop, own: str) -> None:
        """Keep the tracks of all ships from now on, the own one first."""
        self._vessels = {own: loop.vessels[own]} | {n: one for n, one in loop.vessels.items() if n != own}
        plants = [vessel.plant for vessel in self._vessels.values()]
        self._L = np.array([plant.ship.L_pp for plant in plants], dtype=np.float64)
        self._B = np.array([beam(plant) for plant in plants], dtype=np.float64)
        self.reset()
        self.begun = ""
        if len(plants) > 1:
            self.begun = _touching(self._vessels, self._L, self._B)
            self.tick(loop)
            loop.after(self.tick)
            loop.keep("the tracks", self)

    def tick(self, loop: Loop) -> None:
        """Keep a row, if one is due; a ship that blew up has no tracks."""
        own, *others = self._vessels.items()
        if own[1].failure is not None:
            return
        self._lost |= {name for name, vessel in others if vessel.failure is not None}
        x, y = own[1].plant["x"], own[1].plant["y"]
        near = any(abs(one.plant["x"] - x) + abs(one.plant["y"] - y) < 1.5 * (self._L[0] + self._L[k])
                   for k, (_, one) in enumerate(others, 1))  # fmt: skip
        if not near and loop.t < self._next - 1e-9:
            return
        self._rows.append([loop.t, *(one.plant[name] for one in self._vessels.values() for name in _STATES)])
        self._next = loop.t + self._every
        if len(self._rows) > _MOST:
            self._rows, self._every = self._rows[::2], 2.0 * self._every

    @property
    def tracks(self) -> Tracks | None:
        """So far, of those ships that did not blow up; None where there are less than two ships or rows."""
        kept = [k for k, name in enumerate(self._vessels) if name not in self._lost]
        if len(kept) < 2 or len(self._rows) < 2:
            return None
        rows = np.array(self._rows, dtype=np.float64)
        x, y, psi, u, v_m = rows[:, 1:].reshape(len(rows), -1, len(_STATES))[:, kept].transpose(2, 1, 0)
        names = tuple(self._vessels)
        return Tracks(rows[:, 0], x, y, psi, u, v_m, self._L[kept], self._B[kept], tuple(names[k] for k in kept))

    def passed(self, cpa: float, tcpa: float) -> dict[str, Passed]:
        """How the own ship passed each other one; `cpa` and `tcpa` are what `in_hand` counts.

        Nothing where ships touched at the start: what follows is no encounter.
        """
        tracks = self.tracks
        if tracks is None or self.begun:
            return {}
        found = judge(tracks, own=True)
        return {tracks.names[one.other]: _passed(tracks, one, cpa, tcpa) for one in found}

    def snapshot(self) -> dict[str, Any]:
        return {"rows": self._rows, "every": self._every, "next": self._next, "lost": sorted(self._lost)}

    def restore(self, saved: Mapping[str, Any]) -> None:
        self._rows, self._every, self._next = [list(row) for row in saved["rows"]], saved["every"], saved["next"]
        self._lost = set(saved["lost"])

    def reset(self) -> None:
        self._rows: list[list[float]] = []
        self._lost: set[str] = set()
        self._every, self._next = _EVERY, 0.0


def _touching(vessels: Mapping[str, Vessel], L: Array, B: Array) -> str:
    """Two ships whose hulls overlap now; empty where none do."""
    here: list[Motion] = []
    for k, vessel in enumerate(vessels.values()):
        x, y, psi, u, v_m = (np.array([vessel.plant[name]]) for name in _STATES)
        here.append(Motion(x, y, psi, u, v_m, L[k : k + 1], B[k : k + 1]))
    for (one, a), (other, b) in combinations(zip(vessels, here, strict=True), 2):
        if clearance(Pair(np.zeros(1), a, b))[0] < 0.0:
            return f"{one} and {other}"
    return ""


def _passed(tracks: Tracks, one: Judged, cpa: float, tcpa: float) -> Passed:
    at = closest(one.pair, np.ones(len(tracks.t), dtype=bool))
    near, left = one.pair.approach
    waiting = left[(near < cpa) & (left > 0.0) & (left < tcpa)]
    touched = None
    if one.contact:
        hit = np.flatnonzero(clearance(one.pair) < 0.0)
        touched = float(tracks.t[hit[0]] if hit.size else at.t)
    return Passed(float(at.distance), float(at.t), touched, float(waiting.min()) if waiting.size else None, one)
