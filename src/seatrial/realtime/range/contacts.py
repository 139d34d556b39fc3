"""Other ships as the own ship sees them now: bearing, distance and nearest approach.

The nearest approach is that of midships on straight courses at the present speeds over ground.  How they passed is
judged on the tracks (`wakes`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..loop import Loop
from ..plant import Plant

_STILL = 1e-3
"""Relative speed below which two ships keep their distance [m/s]."""


@dataclass(frozen=True)
class Contact:
    """Another ship, SI units and radians.

    Attributes:
        name: of the ship in the loop.
        distance, bearing: of its midship from that of the own ship; clockwise from north.
        U, chi: its speed and course over ground.
        cpa: distance at the nearest approach.
        tcpa: time to it; below zero when the ships draw apart; 0 where the distance does not change.
    """

    name: str
    distance: float
    bearing: float
    U: float
    chi: float
    cpa: float
    tcpa: float

    def dangerous(self, cpa: float, tcpa: float) -> bool:
        """Whether it comes nearer than `cpa` within `tcpa`, or is nearer already and does not draw apart."""
        return (self.cpa < cpa and 0.0 < self.tcpa < tcpa) or (self.distance < cpa and self.tcpa >= 0.0)


def approach(north: float, east: float, v_north: float, v_east: float) -> tuple[float, float]:
    """Distance [m] and time [s] of the nearest approach, from relative place and velocity."""
    square = v_north * v_north + v_east * v_east
    if square < _STILL * _STILL:
        return math.hypot(north, east), 0.0
    t = -(north * v_north + east * v_east) / square
    return math.hypot(north + t * v_north, east + t * v_east), t


def contact(name: str, own: Plant, other: Plant) -> Contact:
    """Another ship as seen from the own one."""
    north, east = other["x"] - own["x"], other["y"] - own["y"]
    a, b = _velocity(own), _velocity(other)
    cpa, tcpa = approach(north, east, b[0] - a[0], b[1] - a[1])
    return Contact(name, math.hypot(north, east), math.atan2(east, north), math.hypot(*b), math.atan2(b[1], b[0]),
                   cpa, tcpa)  # fmt: skip


def _velocity(plant: Plant) -> tuple[float, float]:
    c, s, u, v = math.cos(plant["psi"]), math.sin(plant["psi"]), plant["u"], plant["v_m"]
    return u * c - v * s, u * s + v * c


class Contacts:
    """All other ships of a loop, as they are now.

    Attributes:
        seen: each of them, by name.
        cpa, tcpa: what counts as dangerous [m, s].
    """

    def __init__(self, loop: Loop, own: str, cpa: float, tcpa: float) -> None:
        """Watch all ships but `own` from now on."""
        self._own, self.cpa, self.tcpa = own, cpa, tcpa
        self._names = tuple(name for name in loop.vessels if name != own)
        self.seen: dict[str, Contact] = {}
        self.tick(loop)
        loop.after(self.tick)

    def tick(self, loop: Loop) -> None:
        """Look around; a ship that blew up is a contact no more."""
        own, seen = loop.vessels[self._own], dict[str, Contact]()
        if own.failure is not None:
            return
        for name in self._names:
            vessel = loop.vessels[name]
            if vessel.failure is None:
                seen[name] = contact(name, own.plant, vessel.plant)
        self.seen = seen  # as a whole, since a page reads it from another thread

    def dangerous(self) -> Sequence[Contact]:
        """The contacts that come too near, the soonest first."""
        found = [one for one in self.seen.values() if one.dangerous(self.cpa, self.tcpa)]
        return sorted(found, key=lambda one: one.tcpa)
