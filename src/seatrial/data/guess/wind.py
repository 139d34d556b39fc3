"""Wind: apparent or true, where it comes from or goes to, its units; the true wind is the one that does not turn with the ship."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from .. import Array
from .motion import SPEEDS
from .roles import Signal

_CLEAR, _FLOOR = 1.2, 0.03
_STRAINED = 1.5
_ROWS = 1500


@dataclass(frozen=True)
class WindReading:
    """One way to read a wind.

    Attributes:
        relative: apparent, from the bow; else true, from north.
        towards: the direction is where it goes to.
        side: 1 where angles grow to starboard or clockwise, else -1.
        unit, angle: of speed and direction.
        strain: how far it is from what the names say.
        miss: how much the true wind would change, as a share of it.
    """

    relative: bool
    towards: bool
    side: int
    unit: str
    angle: str
    strain: float
    miss: float = np.nan


def read_wind(
    found: Mapping[str, Signal], pair: tuple[str, str], motion: tuple[Array, Array, Array] | None,
    other: Array | None = None,
) -> tuple[WindReading, WindReading | None, list[WindReading]]:  # fmt: skip
    """The reading of a wind that fits and strains least, the best of the others, and those that fit about as well.

    Args:
        found: quantities of the log.
        pair: roles of speed and direction.
        motion: heading and speeds over ground ahead and to starboard, None where they are unknown.
        other: north and east parts of the wind by another instrument, shape (samples, 2).
    """
    readings = _readings(found, pair)
    if motion is None:
        first = min(readings, key=lambda one: one.strain)
        return first, None, [one for one in readings if one is not first and one.strain < first.strain + _STRAINED]
    speed, direction = found[pair[0]].values, _signed(found[pair[1]])
    every = max(speed.size // _ROWS, 1)
    thin = motion[0][::every], motion[1][::every], motion[2][::every]
    about = None if other is None else other[::every]
    judged = [_judged(one, speed[::every], direction[::every], thin, about) for one in readings]
    smallest = min(one.miss for one in judged)
    near = [one for one in judged if one.miss <= _CLEAR * smallest + _FLOOR]
    best = min(near, key=lambda one: (one.strain, one.miss))
    close = [one for one in near if one is not best and one.strain < best.strain + _STRAINED]
    others = [one for one in judged if one is not best]
    return best, min(others, key=lambda one: one.miss, default=None), close


def differences(best: WindReading, rival: WindReading) -> list[str]:
    """What another reading says otherwise, in words."""
    said = [
        ("apparent, from the bow" if rival.relative else "true, from north", best.relative != rival.relative),
        ("where it goes to" if rival.towards else "where it comes from", best.towards != rival.towards),
        ("positive to port" if rival.side < 0 else "positive to starboard", best.side != rival.side),
        (f"in {rival.unit}", best.unit != rival.unit),
    ]  # fmt: skip
    return [words for words, is_so in said if is_so]


def _signed(signal: Signal) -> Array:
    direction = signal.values
    if not signal.column.letters or len(signal.column.cells) != direction.size:
        return direction
    sides = [-1.0 if any(c in "PpLlBb" for c in cell if c.isalpha()) else 1.0 for cell in signal.column.cells]
    return direction * np.array(sides)


def _readings(found: Mapping[str, Signal], pair: tuple[str, str]) -> list[WindReading]:
    """Ways to read a wind; a unit that the log says is not in question, as wrong units make the wind steady too."""
    speed, direction = found[pair[0]], found[pair[1]]
    largest = float(np.nanmax(np.abs(direction.values), initial=0.0))
    units = [speed.unit] if speed.unit else [*SPEEDS]
    angles = [direction.unit] if direction.unit else ["deg"] if largest > 7.0 else ["rad"]
    towards = "towards" in frozenset[str]().union(*(one.words for one in direction.column.means[:1]))
    out: list[WindReading] = []
    for relative, to, side, unit, angle in product((True, False), (False, True), (1, -1), units, angles):
        if not relative and side < 0:
            continue
        strain = _KIND[relative].get(pair[1], 0.4 * relative) + 0.6 * (side < 0) + 1.0 * (to != towards)
        out.append(WindReading(relative, to, side, unit, angle, strain + 0.3 * units.index(unit)))
    return out


_KIND = {True: {"gamma_T": 2.0}, False: {"gamma_A": 2.0}}
"""How far apparent and true are from a name that says the other."""


def _judged(
    one: WindReading, speed: Array, direction: Array, motion: tuple[Array, Array, Array],
    other: Array | None,
) -> WindReading:  # fmt: skip
    north, east = air(one, speed, direction, motion)
    if other is not None:
        lost = np.hypot(north - other[:, 0], east - other[:, 1])
        size = np.nanmean(np.hypot(other[:, 0], other[:, 1]))
    else:
        lost = np.hypot(north - np.nanmean(north), east - np.nanmean(east))
        size = np.nanmean(np.hypot(north, east))
    miss = float(np.sqrt(np.nanmean(lost**2)) / max(float(size), 1e-6))
    return replace(one, miss=min(miss, 9.0))


def air(one: WindReading, speed: Array, direction: Array, motion: tuple[Array, Array, Array]) -> tuple[Array, Array]:
    """Velocity of the air over ground, north and east, where the wind comes from counted positive."""
    psi, u, v = motion
    size = speed * SPEEDS[one.unit]
    gamma = one.side * (np.radians(direction) if one.angle == "deg" else direction) + (np.pi if one.towards else 0.0)
    if not one.relative:
        return size * np.cos(gamma), size * np.sin(gamma)
    ahead, aside = size * np.cos(gamma) - u, size * np.sin(gamma) - v
    return ahead * np.cos(psi) - aside * np.sin(psi), ahead * np.sin(psi) + aside * np.cos(psi)
