"""Ships of a loop as the command line asks for them: the own one, and others that hold their course."""

from __future__ import annotations

import math
from collections.abc import Iterable

from ..environment import Weather
from ..models import Sampled
from ..realtime.conning import CourseKeeper
from ..realtime.loop import Loop
from ..realtime.plant import Plant
from ..ships import Ship
from ..simulate.approach import time_step
from .support import DEGREE, UsageError, note, read_ship, speed_of

Start = tuple[float, ...]
"""Initial (x, y, psi, u, v_m, r) [m, rad, m/s, rad/s]."""


def rate_of(ship: Ship, wanted: float) -> float:
    """Ticks a second: those wanted, or the greatest below that a model in discrete time allows."""
    if not isinstance(ship.model, Sampled):
        return wanted
    dt = float(ship.model.dt)
    return 1.0 / (dt * max(round(1.0 / (wanted * dt)), 1))


def plant_of(ship: Ship, rate: float, weather: Weather, start: Start, seed: int, through_water: bool = True) -> Plant:
    """A ship at a step that fits the rate as well as her; velocities at the start are through water or over ground."""
    fitting = 1.0 / (rate * math.ceil(1.0 / (rate * time_step(ship)) - 1e-9))
    dt = float(ship.model.dt) if isinstance(ship.model, Sampled) else fitting
    x, y, psi, u, v_m, r = start
    if through_water:
        _, _, north, east, *_ = weather.series(dt, 1)[0].tolist()
        u, v_m = u + north * math.cos(psi) + east * math.sin(psi), v_m + east * math.cos(psi) - north * math.sin(psi)
    return Plant.of(ship, dt=dt, environment=weather, start=(x, y, psi, u, v_m, r), seed=seed)


def others_of(texts: Iterable[str], rate: float, weather: Weather, seed: int) -> dict[str, Plant]:
    """Other ships, by number and name.

    Raises:
        UsageError: one that is not written as it ought to be.
    """
    found: dict[str, Plant] = {}
    for number, text in enumerate(texts, 1):
        ship, start = _other(text)
        found[f"{number} {ship.name}"] = plant_of(ship, rate, weather, start, seed)
    return found


def keep_course(loop: Loop, names: Iterable[str]) -> None:
    """Let these ships hold the heading that they have, each by an autopilot of its own."""
    for name in names:
        if "delta" in loop.vessels[name].plant.ranges:
            CourseKeeper(loop, name)
        else:
            note(f"note: --other {name.partition(' ')[2]}: nothing steers it; it sails as it will")


def _other(text: str) -> tuple[Ship, Start]:
    """Another ship: NAME@NORTH,EAST,HEADING[,SPEED] [m, deg, m/s]."""
    name, _, place = text.partition("@")
    try:
        north, east, heading, *rest = (float(part) for part in place.split(","))
        (speed,) = rest or (None,)
    except ValueError:
        raise UsageError(f"--other is '{text}'; write SHIP@NORTH,EAST,HEADING such as kcs@2000,500,180") from None
    if not all(map(math.isfinite, (north, east, heading, speed or 0.0))) or (speed or 0.0) < 0.0:
        raise UsageError(f"--other is '{text}'; place and heading are numbers, the speed zero or above")
    ship = read_ship(name)
    return ship, (north, east, heading * DEGREE, speed_of(ship, speed, f"--other {name}: speed"), 0.0, 0.0)
