"""How a ship is steered and driven ahead: by angles and revolutions, or by demands in percent.

A manoeuvre orders revolutions (n_P) and the helm (delta); `Model.obey` allocates both to the actuators.  With a rudder
or an azimuth that obeys it, the helm is its angle.  Unequal thrusters, side thrusters and ordered moments have no
angle: their helm is a demand, and hard over (`HARD_OVER`) is 100 percent of it.
"""

from __future__ import annotations

import math

from ..forces import HARD_OVER
from ..models import unit
from . import Ship


def by_angle(ship: Ship) -> bool:
    """Whether the helm is an angle, or nothing at all; else a demand in percent."""
    steering = ship.model.obeying("delta")
    return not steering or any(unit(control) == "rad" for control in steering)


def helm_limit(ship: Ship) -> float:
    """Greatest helm [rad]: of what turns by it, infinite without a limit; `HARD_OVER` where it is a demand."""
    if not by_angle(ship):
        return HARD_OVER
    angles = [control for control in ship.model.obeying("delta") if unit(control) == "rad"]
    return min((abs(float(ship.actuators.of(control).high)) for control in angles), default=math.inf)


def throttled(ship: Ship) -> bool:
    """Whether the order ahead is a share of full throttle, not revolutions."""
    ahead = ship.model.obeying("n_P")
    return bool(ahead) and all(unit(control) == "-" for control in ahead)
