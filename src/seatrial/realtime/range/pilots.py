"""Pilots by line of sight, and ships that behave.

A pilot of another ship knows its true motion, that of the own ship what its instruments say.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...encounters.conduct import CONDUCTS, Scene, Watch
from ...encounters.rules import Limits
from ...encounters.sailing import LOOK
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


class Behaving:
    """Other ships that behave towards each other and the own ship, by their conducts; they see everybody as they are.

    They alter their course only: a ship of average steering holds its speed.
    """

    def __init__(self, loop: Loop, own: str, conducts: Mapping[str, str]) -> None:
        """Steer the ships of `conducts`, which must have the order `delta`, from now on."""
        names = (own, *(name for name in loop.vessels if name != own))
        self._all = [loop.vessels[name] for name in names]
        self._L = np.array([vessel.plant.ship.L_pp for vessel in self._all], dtype=np.float64)
        self._steered = {names.index(name): name for name in conducts}
        self._conducts = {k: CONDUCTS[conducts[name]] for k, name in self._steered.items()}
        self.reset()
        loop.after(self.tick)
        loop.keep("the conducts", self)

    def tick(self, loop: Loop) -> None:
        """Look around, where it is time to, and order the rudders of the next tick."""
        if loop.t >= self._next - 1e-9:
            self._next = loop.t + LOOK
            scene = self._scene(loop.t)
            for k, watch in self._watches.items():
                self._controls[k].steer(float(watch.look(scene).psi[0]))
        for k, name in self._steered.items():
            vessel = self._all[k]
            if vessel.failure is None:
                rudder = self._controls[k].rudder(vessel.plant["psi"], vessel.plant["r"], 1.0 / loop.rate)
                loop.order(name, "delta", rudder)

    def _scene(self, t: float) -> Scene:
        x, y, psi, u, v = (np.array([[one.plant[name] for one in self._all]]) for name in ("x", "y", "psi", "u", "v_m"))
        c, s = np.cos(psi), np.sin(psi)
        return Scene(t, x, y, psi, u * c - v * s, u * s + v * c, self._L)

    def snapshot(self) -> list[Any]:
        return [self._next, [one.snapshot() for one in self._controls.values()],
                [one.snapshot() for one in self._watches.values()]]  # fmt: skip

    def restore(self, saved: Sequence[Any]) -> None:
        self._next = float(saved[0])
        for kept, one in ((self._controls, saved[1]), (self._watches, saved[2])):
            for part, said in zip(kept.values(), one, strict=True):
                part.restore(said)

    def reset(self) -> None:
        """Begin anew from where the ships are."""
        scene = self._scene(0.0)
        speed = np.hypot(scene.north, scene.east)
        plants = {k: self._all[k].plant for k in self._steered}
        self._controls = {k: SteeringControl.of(one.ship, one.ranges["delta"].high) for k, one in plants.items()}
        only = np.zeros(1, dtype=np.intp)
        self._watches = {k: Watch((one,), only, k, scene, speed[:, k], Limits(), ())
                         for k, one in self._conducts.items()}  # fmt: skip
        self._next = 0.0


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
