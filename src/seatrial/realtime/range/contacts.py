"""Other ships as the own ship sees them: bearing, distance and nearest approach; the least distance of the run.

The nearest approach is that of midships on straight courses at the present speeds over ground.  Two ships touch when
their bounding rectangles do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..bridge.view import beam
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


def touching(one: Plant, other: Plant) -> bool:
    """Whether the bounding rectangles of two ships overlap: no axis of either separates them."""
    north, east = other["x"] - one["x"], other["y"] - one["y"]
    sizes = [(0.5 * plant.ship.L_pp, 0.5 * beam(plant), plant["psi"]) for plant in (one, other)]
    for _, _, psi in sizes:
        for axis in (psi, psi + 0.5 * math.pi):
            reach = sum(abs(L * math.cos(own - axis)) + abs(B * math.sin(own - axis)) for L, B, own in sizes)
            if abs(north * math.cos(axis) + east * math.sin(axis)) > reach:
                return False
    return True


@dataclass
class Passing:
    """How near another ship has come.

    Attributes:
        distance: least distance between the midships so far [m].
        t: time of it [s].
        touched: time at which the ships touched [s]; None if they did not.
        in_hand: least time to a nearest approach within the limit that was left before it was avoided [s]; None if
            there was none to avoid.
    """

    distance: float = math.inf
    t: float = 0.0
    touched: float | None = None
    in_hand: float | None = None


class Contacts:
    """All other ships of a loop, and how near each has come.

    Attributes:
        seen: each of them now, by name.
        passed: each of them so far, by name.
        cpa, tcpa: what counts as dangerous [m, s].
    """

    def __init__(self, loop: Loop, own: str, cpa: float, tcpa: float) -> None:
        """Watch all ships but `own` from now on."""
        self._own, self.cpa, self.tcpa = own, cpa, tcpa
        self._names = tuple(name for name in loop.vessels if name != own)
        self.reset()
        self.tick(loop)
        loop.after(self.tick)
        loop.keep("the contacts", self)

    def tick(self, loop: Loop) -> None:
        """Look around; a ship that blew up is a contact no more."""
        own, seen = loop.vessels[self._own], dict[str, Contact]()
        if own.failure is not None:
            return
        for name in self._names:
            vessel = loop.vessels[name]
            if vessel.failure is None:
                seen[name] = contact(name, own.plant, vessel.plant)
                self._note(loop.t, seen[name], own.plant, vessel.plant)
        self.seen = seen  # as a whole, since a page reads it from another thread

    def _note(self, t: float, found: Contact, own: Plant, other: Plant) -> None:
        passed = self.passed[found.name]
        if found.distance < passed.distance:
            passed.distance, passed.t = found.distance, t
        if passed.touched is None and found.distance < own.ship.L_pp + other.ship.L_pp and touching(own, other):
            passed.touched = t
        if found.cpa < self.cpa and 0.0 < found.tcpa < self.tcpa:
            passed.in_hand = found.tcpa if passed.in_hand is None else min(passed.in_hand, found.tcpa)

    def dangerous(self) -> Sequence[Contact]:
        """The contacts that come too near, the soonest first."""
        found = [one for one in self.seen.values() if one.dangerous(self.cpa, self.tcpa)]
        return sorted(found, key=lambda one: one.tcpa)

    def snapshot(self) -> dict[str, Any]:
        return {name: vars(passed) | {"distance": passed.distance if math.isfinite(passed.distance) else None}
                for name, passed in self.passed.items()}  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        self.reset()
        for name, one in saved.items():
            distance = math.inf if one["distance"] is None else float(one["distance"])
            self.passed[name] = Passing(distance, float(one["t"]), one["touched"], one["in_hand"])

    def reset(self) -> None:
        self.seen: dict[str, Contact] = {}
        self.passed = {name: Passing() for name in self._names}
