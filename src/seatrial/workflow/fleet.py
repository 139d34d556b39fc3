"""Ships of a real-time loop: the own ship, and other ships that keep their course."""

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
from . import RequestError
from .request import DEGREE, Note, ship_of, silent, speed_of

Start = tuple[float, ...]
"""Initial (x, y, psi, u, v_m, r) [m, rad, m/s, rad/s]."""


def rate_of(ship: Ship, wanted: float) -> float:
    """Tick rate [Hz]: the wanted one, or the greatest below it that a model in discrete time allows."""
    if not isinstance(ship.model, Sampled):
        return wanted
    dt = float(ship.model.dt)
    return 1.0 / (dt * max(round(1.0 / (wanted * dt)), 1))


def plant_of(ship: Ship, rate: float, weather: Weather, start: Start, seed: int, through_water: bool = True) -> Plant:
    """A ship at a time step that divides the tick and suits the ship.

    Args:
        ship: the ship.
        rate: tick rate [Hz].
        weather: what is around it.
        start: initial state.
        seed: of the weather.
        through_water: whether the initial velocities are through water; over ground otherwise.
    """
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
        RequestError: a text of another form than ``SHIP@NORTH,EAST,HEADING[,SPEED]``.
    """
    found: dict[str, Plant] = {}
    for number, text in enumerate(texts, 1):
        ship, start = _other(text)
        found[f"{number} {ship.name}"] = plant_of(ship, rate, weather, start, seed)
    return found


def keep_course(loop: Loop, names: Iterable[str], note: Note = silent) -> None:
    """Let these ships keep their initial heading, each with an autopilot of its own."""
    for name in names:
        if "delta" in loop.vessels[name].plant.ranges:
            CourseKeeper(loop, name)
        else:
            note(f"note: --other {name.partition(' ')[2]}: it has no rudder to steer; it drifts freely")


def _other(text: str) -> tuple[Ship, Start]:
    """Another ship: NAME@NORTH,EAST,HEADING[,SPEED] [m, deg, m/s]."""
    name, _, place = text.partition("@")
    try:
        north, east, heading, *rest = (float(part) for part in place.split(","))
        (speed,) = rest or (None,)
    except ValueError:
        raise RequestError(f"--other is '{text}'; write SHIP@NORTH,EAST,HEADING such as kcs@2000,500,180") from None
    if not all(map(math.isfinite, (north, east, heading, speed or 0.0))) or (speed or 0.0) < 0.0:
        raise RequestError(f"--other is '{text}'; place and heading are numbers, the speed zero or above")
    ship = ship_of(name)
    return ship, (north, east, heading * DEGREE, speed_of(ship, speed, f"--other {name}: speed"), 0.0, 0.0)
