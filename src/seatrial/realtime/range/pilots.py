"""Pilots by line of sight: of each other ship from its true motion, of the own ship from what its instruments say."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ...manoeuvres.track import Leg
from ...sensors.instruments import Gnss
from ..conning import SteeringControl
from ..loop import Loop

_TURN = 3.0
"""Distance before a waypoint at which the next leg is taken, in ship lengths, as in the manoeuvre `track`."""


_SLOW = 8.0
"""Integral action of the line of sight: speed over this is sigma [m/s]; a quarter would be critically damped."""


class Sight:
    """Line of sight with integral action (Borhaug 2008), which takes out the offset of a steady current."""

    def __init__(self, ahead: float, speed: float) -> None:
        """Look `ahead` metres, at a `speed` [m/s]."""
        self._ahead, self._sigma = ahead, speed / _SLOW
        self.integral = 0.0

    def aim(self, across: float, dt: float) -> float:
        """The cross-track error that is to be steered for [m], with what was learned `dt` seconds ago."""
        aim = across + self._sigma * self.integral
        if abs(across) < self._ahead:  # the way to the line is no drift
            self.integral += dt * self._ahead * across / (self._ahead * self._ahead + aim * aim)
        return aim


class Guide:
    """Place on a route.

    Attributes:
        number: of the leg that is followed, the first being 0.
        past: whether the last waypoint is abeam; its leg is followed on.
    """

    def __init__(self, route: Sequence[Leg], turn: float) -> None:
        """Follow legs, the next one from `turn` metres before a waypoint."""
        self.route, self._turn = tuple(route), turn
        self.number, self.past = 0, False

    @property
    def leg(self) -> Leg:
        """The leg that is followed."""
        return self.route[self.number]

    def across(self, x: float, y: float) -> float:
        """Distance to starboard of the leg at a place [m], which may be the next one from here on."""
        while True:
            leg, last = self.leg, self.number == len(self.route) - 1
            along, across = leg.along_across(x, y)
            if along < leg.length - (0.0 if last else self._turn):
                return float(across)
            if last:
                self.past = True
                return float(across)
            self.number += 1

    def snapshot(self) -> list[Any]:
        return [self.number, self.past]

    def restore(self, saved: Sequence[Any]) -> None:
        self.number, self.past = int(saved[0]), bool(saved[1])

    def reset(self) -> None:
        self.number, self.past = 0, False


class TrafficPilot:
    """Pilot of another ship, which knows its true motion."""

    def __init__(self, loop: Loop, name: str, route: Sequence[Leg]) -> None:
        """Steer the ship `name`, which must have the order `delta`, from now on."""
        self._name, self._vessel = name, loop.vessels[name]
        plant = self._vessel.plant
        self._guide = Guide(route, _TURN * plant.ship.L_pp)
        self._control = SteeringControl.of(plant.ship, plant.ranges["delta"].high)
        self._sight = Sight(self._control.ahead, plant.ship.speed)
        self.tick(loop)
        loop.after(self.tick)
        loop.keep(f"the pilot of {name}", self)

    def tick(self, loop: Loop) -> None:
        """Order the rudder of the next tick."""
        plant = self._vessel.plant
        if self._vessel.failure is None:
            across = self._guide.across(plant["x"], plant["y"])
            self._control.steer(self._guide.leg.alpha, across=self._sight.aim(across, 1.0 / loop.rate))
            loop.order(self._name, "delta", self._control.rudder(plant["psi"], plant["r"], 1.0 / loop.rate))

    def snapshot(self) -> list[Any]:
        return [self._guide.snapshot(), self._control.snapshot(), self._sight.integral]

    def restore(self, saved: Sequence[Any]) -> None:
        self._guide.restore(saved[0])
        self._control.restore(saved[1])
        self._sight.integral = float(saved[2])

    def reset(self) -> None:
        self._guide.reset()
        self._control.let_go()
        self._sight.integral = 0.0


class OwnPilot:
    """Track pilot of the own ship: position, heading and rate of turn are those of its instruments.

    Attributes:
        active: whether it steers.
        guide: its place on the route, by the instruments.
        across: distance to starboard of the route, by the instruments [m]; None before their first readings.
        control: of its heading.
    """

    def __init__(self, loop: Loop, name: str, route: Sequence[Leg], active: bool) -> None:
        """Steer the ship `name`, which must have instruments and the order `delta`, while `active`."""
        self._name, self._vessel, self.active = name, loop.vessels[name], active
        plant, watch = self._vessel.plant, self._vessel.watch
        aboard = watch.suite.instruments if watch is not None else ()
        self._antenna = next(((one.antenna_x, one.antenna_y) for one in aboard if isinstance(one, Gnss)), (0.0, 0.0))
        self.guide = Guide(route, _TURN * plant.ship.L_pp)
        self.control = SteeringControl.of(plant.ship, plant.ranges["delta"].high)
        self._sight = Sight(self.control.ahead, plant.ship.speed)
        self._latest: dict[str, float] = {}
        self.across: float | None = None
        loop.after(self.tick)
        loop.keep(f"the pilot of {name}", self)

    def tick(self, loop: Loop) -> None:
        """Read the instruments, and order the rudder of the next tick while active."""
        latest = self._latest
        for reading in self._vessel.readings:
            latest.update(reading.values)
        if not {"x", "y", "psi", "r"} <= latest.keys():
            return
        across = self.across = self.guide.across(*self._midship(latest))
        if not self.active or self._vessel.failure is not None:
            self.control.let_go()
            self._sight.integral = 0.0
            return
        self.control.steer(self.guide.leg.alpha, across=self._sight.aim(across, 1.0 / loop.rate))
        loop.order(self._name, "delta", self.control.rudder(latest["psi"], latest["r"], 1.0 / loop.rate))

    def _midship(self, said: Mapping[str, float]) -> tuple[float, float]:
        """Place of midship from that of the antenna and the heading."""
        (ahead, aside), c, s = self._antenna, math.cos(said["psi"]), math.sin(said["psi"])
        return said["x"] - ahead * c + aside * s, said["y"] - ahead * s - aside * c

    def snapshot(self) -> list[Any]:
        sight, control = self._sight.integral, self.control.snapshot()
        return [self.active, self.guide.snapshot(), control, self._latest, self.across, sight]

    def restore(self, saved: Sequence[Any]) -> None:
        self.active, self._latest = bool(saved[0]), dict(saved[3])
        self.across, self._sight.integral = saved[4], float(saved[5])
        self.guide.restore(saved[1])
        self.control.restore(saved[2])

    def reset(self) -> None:
        """Forget readings and route; who steers stays."""
        self.guide.reset()
        self.control.let_go()
        self._latest, self.across, self._sight.integral = {}, None, 0.0
