"""Other ships as the own ship sees them now: bearing, distance and nearest approach; and as its sensors have them.

The nearest approach is that of midships on straight courses at the present speeds over ground.  How they passed is
judged on the tracks (`wakes`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core.values import dataclass
from ...data import Array
from ...encounters.sensing import Sensing, Tracker
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
    return _seen(name, (other["x"] - own["x"], other["y"] - own["y"]), _velocity(own), _velocity(other))


def _seen(name: str, place: tuple[float, float], a: tuple[float, float], b: tuple[float, float]) -> Contact:
    """A contact from its place relative to the own ship [m], north and east, and the velocities of both [m/s]."""
    cpa, tcpa = approach(*place, b[0] - a[0], b[1] - a[1])
    return Contact(name, math.hypot(*place), math.atan2(place[1], place[0]), math.hypot(*b), math.atan2(b[1], b[0]),
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


class Sensed:
    """Radar and transponders of all other ships as they reach the own one: `encounters.sensing` of one run.

    Attributes:
        delay: of reports of transponders [s].
    """

    def __init__(self, loop: Loop, own: str, sensing: Sensing, seed: int) -> None:
        """Sense all ships but `own` from now on; without a radar or AIS in `sensing` nothing comes from it."""
        self._own, self._sensing, self._seed = loop.vessels[own], sensing, seed
        self._others = {name: vessel for name, vessel in loop.vessels.items() if name != own}
        self.delay = 0.0 if sensing.ais is None else sensing.ais.delay
        self.reset()
        loop.after(self.tick)
        loop.keep("the sensors", self)

    def tick(self, loop: Loop) -> None:
        """Turn the radar."""
        if self._tracker is not None and self._others:
            own = self._own.plant
            x, y = (np.array([[one.plant[name] for one in self._others.values()]]) for name in ("x", "y"))
            self._tracker.sweep(loop.t, (np.array([[own["x"]]]), np.array([[own["y"]]])), (x, y), self._rng)

    def contacts(self, t: float) -> dict[str, Contact]:
        """What the tracker of the radar tells now."""
        tracks, own = self._tracker, self._own.plant
        if tracks is None:
            return {}
        here, age, found = _velocity(own), t - tracks.t, dict[str, Contact]()
        for k, name in enumerate(self._others):
            if tracks.known[0, k] and self._others[name].failure is None:
                v = float(tracks.north[0, k]), float(tracks.east[0, k])
                north, east = (float(place[0, k]) + one * age - own[axis]
                               for place, one, axis in ((tracks.x, v[0], "x"), (tracks.y, v[1], "y")))  # fmt: skip
                found[name] = _seen(name, (north, east), here, v)
        return found

    def sends(self, name: str) -> bool:
        """Whether a ship has a transponder that the own one receives at all."""
        return self._sensing.ais is not None and name not in self._silent

    def heard(self, name: str) -> tuple[float, float] | None:
        """The error of the place in a report of a ship [m]; None where the report does not arrive."""
        ais, plant, own = self._sensing.ais, self._others[name].plant, self._own.plant
        if ais is None:
            return None
        far = np.array(math.hypot(plant["x"] - own["x"], plant["y"] - own["y"]))
        if not ais.heard(far, self._rng):
            return None
        north, east = ais.place * self._rng.standard_normal(2)
        return float(north), float(east)

    def snapshot(self) -> dict[str, Any]:
        tracks = {} if self._tracker is None else self._tracker.snapshot()
        return {"random": self._rng.bit_generator.state, "tracks": tracks}

    def restore(self, saved: Mapping[str, Any]) -> None:
        self._rng.bit_generator.state = saved["random"]
        if self._tracker is not None:
            self._tracker.restore(saved["tracks"])

    def reset(self) -> None:
        self._rng = np.random.default_rng((self._seed, 3))
        radar, ais = self._sensing.radar, self._sensing.ais
        self._tracker = None if radar is None else Tracker(radar, (1, len(self._others)))
        draws: Array = self._rng.random(len(self._others))
        self._silent = {name for name, one in zip(self._others, draws, strict=True) if ais and one < ais.silent}
