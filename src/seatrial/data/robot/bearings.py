"""In which axes the messages of a log are, by the motion of the ship: convention and practice differ.

REP 103 has the earth's axes east, north, up.  Drivers also give north, east, down, or count the yaw from north; a yaw
that a unit began at zero counts from anywhere.  The course over ground tells: a ship goes about where it heads.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from ...core.values import dataclass
from .. import Array

AXES: Mapping[str, tuple[float, float]] = MappingProxyType({
    "enu": (1.0, 0.0), "ned": (-1.0, 0.5 * math.pi), "nwu": (1.0, -0.5 * math.pi),
})  # fmt: skip
"""Axes of an orientation: sign and offset [rad] of the heading from what it is in those of REP 103."""

_SPAN, _ROWS, _LEAST = 4.0, 20, 0.5
"""Seconds over which a course is taken; rows that make an evidence; least way in that time [m]."""
_NEAR, _FAR = math.radians(30.0), math.radians(45.0)
_TURNED = math.radians(60.0)
_ASKEW = math.radians(12.0)
"""Off the course to one side by so much, and scattered about that by less, is no drift of a ship that turns."""


@dataclass(frozen=True)
class Track:
    """Course and speed over ground, by positions.

    Attributes:
        t: times [s].
        gamma: course [rad].
        speed: [m/s].
        by: what told the positions.
    """

    t: Array
    gamma: Array
    speed: Array
    by: str


def track(t: Array, north: Array, east: Array, by: str) -> Track | None:
    """Course and speed where the ship moves; None where it does so too little to tell."""
    good = np.isfinite(north + east)
    t, north, east = t[good], north[good], east[good]
    if t.size < _ROWS:
        return None
    after = np.searchsorted(t, t + _SPAN)
    rows = np.flatnonzero(after < t.size)
    after = after[rows]
    step = t[after] - t[rows]
    rows, after, step = rows[step < 2.0 * _SPAN], after[step < 2.0 * _SPAN], step[step < 2.0 * _SPAN]
    dx, dy = north[after] - north[rows], east[after] - east[rows]
    way = np.hypot(dx, dy)
    moving = way > max(_LEAST, 0.3 * float(np.quantile(way, 0.9))) if way.size else np.zeros(0, dtype=bool)
    if moving.sum() < _ROWS:
        return None
    middle = 0.5 * (t[after] + t[rows])
    return Track(middle[moving], np.arctan2(dy, dx)[moving], (way / step)[moving], by)


def _at(times: Array, t: Array, values: Array, circle: bool = False) -> Array:
    """Values at other times, NaN outside."""
    good = np.isfinite(values)
    if good.sum() < 2:
        return np.full(len(times), math.nan)
    steady = np.unwrap(values[good]) if circle else values[good]
    return np.interp(times, t[good], steady, left=math.nan, right=math.nan)


def _off(angles: Array) -> Array:
    return np.abs(np.mod(angles + math.pi, 2.0 * math.pi) - math.pi)


def axes_of(t: Array, psi: Array, ground: Track) -> tuple[str, str, bool]:
    """Axes of headings that were read by REP 103, by the course, what is said of that, and whether it is a doubt.

    Axes are "" where none fits.  A heading that is off the course to one side, wherever it turned, is in doubt.

    Args:
        t: times [s].
        psi: headings by REP 103 [rad].
        ground: the course over ground.
    """
    heading = _at(ground.t, t, psi, circle=True)
    there = np.isfinite(heading)
    if there.sum() < _ROWS:
        return "enu", "", False
    apart = {name: float(np.median(_off(sign * heading[there] + offset - ground.gamma[there])))
             for name, (sign, offset) in AXES.items()}  # fmt: skip
    told = (
        f"{math.degrees(apart['enu']):.0f} deg off the course by {ground.by} in the median of {int(there.sum())} rows"
    )
    best = min(apart, key=lambda one: apart[one])
    turned = float(np.ptp(np.unwrap(ground.gamma[there])))
    side = np.exp(1j * (heading[there] - ground.gamma[there]))
    # near north-east and south-west a mirrored heading is near the course too, and turns against it
    a, b = (one - one.mean() for one in map(np.unwrap, (heading[there], ground.gamma[there])))
    if turned > _NEAR and a @ b < -0.5 * math.sqrt(float((a @ a) * (b @ b))) and apart["ned"] < _NEAR and (
            apart["enu"] > apart["ned"]):  # fmt: skip
        return "ned", f"{told}, {math.degrees(apart['ned']):.0f} if its axes are {_WORDS['ned']}", False
    astray = bool(apart["enu"] > _ASKEW and turned > _TURNED and abs(np.mean(side)) > math.cos(_ASKEW))
    if apart["enu"] < _NEAR or apart["enu"] <= apart[best]:
        return ("enu" if apart["enu"] < _FAR else ""), told, astray
    if apart[best] < _NEAR and apart["enu"] > apart[best] + math.radians(15.0):
        # a course that turns little fits several axes
        told += f", {math.degrees(apart[best]):.0f} if its axes are {_WORDS[best]}"
        return (best if turned > _TURNED else ""), told, astray
    return ("enu" if apart["enu"] < _FAR else ""), told, astray


_WORDS = MappingProxyType({"ned": "north, east, down", "nwu": "north, west, up"})


def in_the_earth(t: Array, ahead: Array, aside: Array, psi: Array, ground: Track) -> bool:
    """Whether velocities that were read as ahead and to starboard are east and minus north.

    Args:
        t: times [s].
        ahead, aside: as `u` and `v_m` are read [m/s].
        psi: headings at these times [rad].
        ground: course and speed over ground.
    """
    u, v = _at(ground.t, t, ahead), _at(ground.t, t, aside)
    heading = _at(ground.t, t, psi, circle=True)
    north, east = ground.speed * np.cos(ground.gamma), ground.speed * np.sin(ground.gamma)
    body = np.hypot(u * np.cos(heading) - v * np.sin(heading) - north,
                    u * np.sin(heading) + v * np.cos(heading) - east)  # fmt: skip
    earth = np.hypot(-v - north, u - east)
    there = np.isfinite(body + earth)
    if there.sum() < _ROWS:
        return False
    size = float(np.median(ground.speed[there]))
    return float(np.median(earth[there])) < 0.25 * size and float(np.median(body[there])) > 0.5 * size


def likeness(t: Array, psi: Array, times: Array, r: Array) -> float:
    """Correlation of rates of turn with the change of a heading or course; 0 where they do not tell."""
    good = np.isfinite(psi)
    if good.sum() < _ROWS:
        return 0.0
    t, steady = t[good], np.unwrap(psi[good])
    grid = np.arange(t[0], t[-1], 0.5)
    if grid.size < _ROWS:
        return 0.0
    change = np.gradient(np.interp(grid, t, steady), grid)
    rate = _at(grid, times, r)
    there = np.isfinite(rate + change)
    if there.sum() < _ROWS or not (np.std(rate[there]) > 1e-3 and np.std(change[there]) > 1e-3):
        return 0.0
    return float(np.corrcoef(rate[there], change[there])[0, 1])
