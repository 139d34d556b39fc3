"""Plausibility of a ship file: slips of unit or sign, refused before anything is computed."""

from __future__ import annotations

import math

from ..core.parameters import values
from ..models import Model
from . import ShipError

# Ships displace .3 to .9 of the box around them, pontoons all of it; a slip of unit is a factor of a thousand.
_BLOCK = (0.1, 1.3)
# Radius of gyration in yaw over length: .2 to .3 for ships, .29 for a box, .33 with added inertia.
_GYRATION = (0.1, 0.6)
# Nothing on board is farther from midship than this share of the length.
_REACH = 0.75
# Least share of the length ahead of midship at which a rudder is at the bow.
_BOW = 0.05


def plausible(model: Model, L_pp: float) -> None:
    """Refuse masses, inertias, places and dampings that belong to no ship.

    Raises:
        ShipError: names the number and what would be right; the caller adds the file.
    """
    known = {path: float(v) for path, v in values(model).items()}
    _mass(known, L_pp)
    for path, value in known.items():
        last = path.rpartition(".")[2]
        if last in ("x_R", "x_P", "x") and path.count(".") and abs(value) > _REACH * L_pp:
            raise ShipError(f"{path} is {value:g} m, off a ship of {L_pp:g} m: it counts from midship, ahead positive")
        if last == "x_R" and value > _BOW * L_pp:
            raise ShipError(f"{path} is {value:g} m: a rudder at the bow; aft of midship x is negative")
        if path in ("damping.X_u", "derivatives.X_u") and value > 0.0:
            raise ShipError(f"{path} is {value:g}: it drives the ship ahead; the force by u is negative, d_11 = -X_u")


def _mass(known: dict[str, float], L_pp: float) -> None:
    m, box = known.get("body.m", 0.0), math.prod(known.get(f"body.{key}", 0.0) for key in ("rho", "L_pp", "B", "d"))
    if m and box and not _BLOCK[0] <= m / box <= _BLOCK[1]:
        raise ShipError(f"body.m is {m:g} kg, {m / box:.2g} of the box L_pp B d full of water; ships have .4 to .9")
    inertia = known.get("body.I_zG", 0.0)
    if m and inertia:
        radius = math.sqrt(inertia / m) / L_pp
        if not _GYRATION[0] <= radius <= _GYRATION[1]:
            said = f"body.I_zG is {inertia:g} kg m^2, a radius of gyration of {radius:.2g} L_pp"
            raise ShipError(f"{said}; ships have some .25")
