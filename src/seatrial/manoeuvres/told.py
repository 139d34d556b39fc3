"""The manoeuvre that a trial is of, by its sidecar or by its data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..data import Trial
from ..data.kinds import recognised
from .turning import Turning
from .zigzag import Zigzag


def manoeuvre(trial: Trial) -> Turning | Zigzag | None:
    """The manoeuvre that the meta data of a trial name, or None.

    Read are `kind` ("turning", "zigzag") and `set_points`: `delta` and, for a zigzag, `psi`, in
    radians (``delta [deg]`` in degrees; `rudder` and `heading` are the same), and `side` ("port",
    "starboard" or a sign).  Without a side, the rudder's first large angle gives it.
    """
    points = trial.meta.get("set_points") or trial.meta.get("setpoints")
    kind = trial.meta.get("kind")
    if kind not in ("turning", "zigzag") or not isinstance(points, Mapping):
        return None
    delta, psi = _angle(points, "delta", "rudder"), _angle(points, "psi", "heading")
    if not delta:
        return None
    side = {"port": -1.0, "starboard": 1.0}.get(str(points.get("side")))
    if side is None:
        side = math.copysign(1.0, float(points["side"])) if "side" in points else _first_side(trial, delta)
    if kind == "turning":
        return Turning(0.0, side * abs(delta))
    return Zigzag(0.0, abs(delta), abs(psi), side) if psi else None


def _angle(points: Mapping[Any, Any], *names: str) -> float | None:
    for name in names:
        for key, factor in ((name, 1.0), (f"{name} [rad]", 1.0), (f"{name} [deg]", math.pi / 180.0)):
            if key in points:
                return float(points[key]) * factor
    return None


def _first_side(trial: Trial, delta: float) -> float:
    """+1 for starboard, -1 for port; set points often give a magnitude, so the rudder decides."""
    rudder = next((trial[name] for name in ("delta_cmd", "delta") if name in trial), np.zeros(0))
    over = rudder[np.abs(rudder) >= 0.5 * abs(delta)]
    return math.copysign(1.0, float(over[0]) if over.size else delta)


def seen(trial: Trial) -> Turning | Zigzag | None:
    """The manoeuvre of a trial by its set points where its sidecar has them, else as its data show it; or None.

    Its revolutions are the median of the first shaft [1/s].
    """
    found, told = recognised(trial), manoeuvre(trial)
    rudder, heading, side = (found.settings.get(name, 0.0) for name in ("rudder", "heading", "side"))
    shafts = [trial[name] for name in trial.channels if name.startswith("n_P") and not name.endswith("_cmd")]
    n_P = float(np.nanmedian(shafts[0])) if shafts else 0.0
    if isinstance(told, Turning):
        return Turning(n_P, told.delta)
    if isinstance(told, Zigzag):
        return Zigzag(n_P, told.delta, told.psi, told.side)
    if found.name == "turning" and rudder:
        return Turning(n_P, side * rudder)
    return Zigzag(n_P, rudder, heading, side) if found.name == "zigzag" and rudder and heading else None
