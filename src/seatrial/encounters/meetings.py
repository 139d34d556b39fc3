"""Encounters before anybody acts: where ships begin and how they would meet.

The own ship begins at the origin and heads north.  If nobody acted, each other ship would be at the own ship's place at
the time of its meeting; that is a fixed set for regression, and covers no space (`drawn` does).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ..core.errors import RequestError
from ..core.parameters import unknown
from ..data import Array

MINUTE = 60.0
_DEG = math.pi / 180.0

IMAZU: Mapping[int, tuple[float | None, ...]] = MappingProxyType({
    1: (180,), 2: (-90,), 3: (None,), 4: (45,), 5: (180, -90), 6: (-10, -45), 7: (None, -45), 8: (180, 90),
    9: (-30, -90), 10: (-90, 15), 11: (90, -30), 12: (180, -45, -10), 13: (180, 10, 45), 14: (-10, -45, -90),
    15: (None, -45, -90), 16: (45, 90, -90), 17: (None, 10, -45), 18: (-135, -15, -30), 19: (15, -15, -135),
    20: (None, -15, -90), 21: (-15, 15, -90), 22: (None, -45, -90),
})  # fmt: skip
"""Headings of the others [deg] in Imazu's problems (1987), None for a slow one ahead on the same course.

The thesis is not at hand: headings are those of the coding by TUD_RL (after Sawada et al. 2021) but for problem 8,
which repeats 5 there and is taken with the crossing from port; 22 repeats 15 in every coding.
"""

STANDARD: Mapping[int, str] = MappingProxyType({
    1: "HO 2 1.2 15", 2: "GW 20 .8 12", 3: "SO -30 .6 17", 4: "OG 15 .5 14", 5: "OS 195 1.6 19",
    6: "HO -1 .9 11, HO 4 1.1 14", 7: "HO -4 1.4 20, GW 36 .8 10", 8: "HO 4 1.7 15, SO -36 .8 13",
    9: "HO -2 1.1 13, OG 10 .5 16", 10: "HO 0 1 17, OS 176 1.9 15", 11: "GW 18 1.3 19, GW 102 1.4 15",
    12: "GW 45 1.2 19, SO -99 1.3 16", 13: "GW 60 1.5 18, OG 35 .7 15", 14: "GW 80 1.2 12, OS -150 1.7 15",
    15: "SO -85 1.5 17, SO -100 1.6 15", 16: "SO -105 1.3 16, OS -165 1.6 15", 17: "SO -105 1.2 13, OG 30 .8 10",
    18: "OG 15 .7 15, OG 25 .6 19", 19: "OG 20 .6 20, OS 175 1.6 14", 20: "OS 160 1.8 15, OS 170 1.5 13",
})  # fmt: skip
"""The situations of one and two others in DNV's standard set (ship-traffic-generator, MIT): class, bearing [deg], speed
over that of the own ship, and time to the meeting [min] of each."""

RANGES: Mapping[str, tuple[tuple[float, float], tuple[float, float]]] = MappingProxyType({
    "HO": ((-5.0, 5.0), (0.5, 1.5)), "GW": ((0.0, 112.5), (0.5, 1.5)), "SO": ((-112.5, 0.0), (0.5, 1.5)),
    "OG": ((-67.5, 67.5), (0.25, 0.75)), "OS": ((112.5, 247.5), (1.5, 2.0)),
})  # fmt: skip
"""Bearings [deg] and speed ratios from which `drawn` takes each class, as DNV's generator does."""
TIMES = 10.0 * MINUTE, 20.0 * MINUTE


@dataclass(frozen=True, eq=False)
class Meetings:
    """Many encounters of equally many ships.

    Attributes:
        x, y, psi: place north and east [m] and heading [rad] at the start, shape (runs, ships); the first is the own.
        U: speed [m/s], same shape.
        kinds: class of each other ship as the own one has it, shape (runs, ships - 1); empty texts where none is meant.
    """

    x: Array
    y: Array
    psi: Array
    U: Array
    kinds: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.x)

    def part(self, rows: slice) -> Meetings:
        """Some of the runs."""
        return Meetings(self.x[rows], self.y[rows], self.psi[rows], self.U[rows], self.kinds[rows])


def imazu(case: int, speed: float, time: float = 25.0 * MINUTE, slow: float = 0.5) -> Meetings:
    """One of Imazu's problems: all ships would meet at one point after `time`.

    Args:
        case: 1 to 22.
        speed: of all ships but the slow one [m/s].
        time: to the meeting [s].
        slow: speed of the slow one over that of the others.

    Raises:
        RequestError: no such problem, or a speed, time or ratio that cannot be.
    """
    if case not in IMAZU:
        raise RequestError(f"Imazu's problem {case}; there are 1 to {len(IMAZU)}")
    _above_zero(speed=speed, time=time, slow=slow)
    if slow >= 1.0:
        raise RequestError(f"slow = {slow:g}: the ship ahead is overtaken, so it is below 1")
    R = speed * time
    # a ship of heading psi is at the meeting point less its own way
    ships = [(0.0, 0.0, 0.0, speed)]
    for degrees in IMAZU[case]:
        psi, U = (0.0, slow * speed) if degrees is None else (degrees * _DEG, speed)
        ships.append((R - U * time * math.cos(psi), -U * time * math.sin(psi), psi, U))
    found = np.array(ships)
    kinds = kinds_of(*seen(*found[0, :3], *found[1:, :3].T))
    return _stacked(found, kinds)


def standard(number: int, speed: float) -> Meetings:
    """A situation of DNV's standard set.

    Raises:
        RequestError: no such situation, or a speed that cannot be.
    """
    if number not in STANDARD:
        raise RequestError(f"standard situation {number}; there are 1 to {len(STANDARD)}")
    _above_zero(speed=speed)
    ships, kinds = [(0.0, 0.0, 0.0, speed)], list[str]()
    for words in STANDARD[number].split(", "):
        kind, *numbers = words.split()
        bearing, ratio, minutes = map(float, numbers)
        placed = placed_by(kind, np.array([bearing * _DEG]), np.array([ratio]), np.array([minutes * MINUTE]), speed)
        x, y, psi = (float(one[0]) for one in placed)
        ships.append((x, y, psi, ratio * speed))
        kinds.append(kind)
    return _stacked(np.array(ships), np.array(kinds))


def drawn(
    count: int, others: int, speed: float, seed: int, weights: Mapping[str, float] | None = None
) -> Meetings:  # fmt: skip
    """Encounters drawn by rule: class, bearing, speed ratio and time to the meeting of each other ship, uniformly.

    Each class has the ranges of DNV's generator; a draw whose geometry is of another class is drawn again.

    Args:
        count: runs.
        others: other ships in each.
        speed: of the own ship [m/s].
        weights: share of each class; equal unless given.  How often real ships meet so is for the user to say.

    Raises:
        RequestError: counts below one, a class that is none, or weights that are no shares.
    """
    if count < 1 or others < 1:
        raise RequestError(f"{count} encounters with {others} other ships; give one or more of each")
    _above_zero(speed=speed)
    given = dict(weights or dict.fromkeys(RANGES, 1.0))
    for kind, weight in given.items():
        if kind not in RANGES:
            raise RequestError(f"weights: {unknown(kind, RANGES, 'class of encounter')}")
        if not (math.isfinite(weight) and weight >= 0.0):
            raise RequestError(f"weights: {kind} = {weight:g}; a share is zero or above")
    total = sum(given.values())
    if total <= 0.0:
        raise RequestError("weights: all are zero; at least one class has to be above")
    rng, size = np.random.default_rng(seed), count * others
    kinds = rng.choice(list(given), size, p=[one / total for one in given.values()])
    x, y, psi, way = (np.full(size, np.nan) for _ in range(4))
    left = np.arange(size)
    while left.size:
        fractions = rng.random((3, left.size))
        for kind in np.unique(kinds[left]):
            own = kinds[left] == kind
            rows, (a, b, c) = left[own], fractions[:, own]
            (low, high), (slow, fast) = RANGES[kind]
            ratio, time = slow + b * (fast - slow), TIMES[0] + c * (TIMES[1] - TIMES[0])
            x[rows], y[rows], psi[rows] = placed_by(kind, (low + a * (high - low)) * _DEG, ratio, time, speed)
            way[rows] = ratio * speed
        left = left[np.isnan(x[left])]
    own = np.zeros((count, 1))
    x, y, psi, way = (np.hstack([first, one.reshape(count, others)])
                      for first, one in ((own, x), (own, y), (own, psi), (own + speed, way)))  # fmt: skip
    return Meetings(x, y, psi, way, kinds.reshape(count, others))


def placed_by(kind: str, beta: Array, ratio: Array, time: Array, speed: float) -> tuple[Array, Array, Array]:
    """Where a ship on bearing `beta` begins to be at the own ship's place after `time`: north, east, heading.

    Its way is `ratio` times that of the own ship, R; its distance r solves
    r^2 - 2 r R cos(beta) + R^2 (1 - ratio^2) = 0.
    Of two roots that which is of the class is taken; NaN where none is.
    """
    R = speed * time
    with np.errstate(invalid="ignore"):
        half = np.sqrt(np.cos(beta) ** 2 - 1.0 + ratio**2)  # NaN: it would never get there
    x, y, psi = (np.full(np.shape(beta), np.nan) for _ in range(3))
    for sign in (1.0, -1.0):
        r = R * (np.cos(beta) + sign * half)
        north, east = r * np.cos(beta), r * np.sin(beta)
        heading = np.arctan2(-east, R - north)
        found = kinds_of(*seen(0.0, 0.0, 0.0, north, east, heading)) == kind
        take = np.isnan(x) & (r > 0.0) & found
        x, y, psi = np.where(take, north, x), np.where(take, east, y), np.where(take, heading, psi)
    return x, y, psi


def seen(x: Array | float, y: Array | float, psi: Array | float, north: Array | float, east: Array | float,
         heading: Array | float) -> tuple[Array, Array]:  # fmt: skip
    """Bearing of the other ship from the own bow, and of the own ship from the other's, -180 to 180 deg [rad]."""
    way = np.arctan2(np.subtract(east, y), np.subtract(north, x))
    turn = 2.0 * math.pi
    beta, alpha = way - psi, way + math.pi - heading
    return beta - turn * np.round(beta / turn), alpha - turn * np.round(alpha / turn)


def kinds_of(beta: Array, alpha: Array) -> NDArray[np.str_]:
    """Classes of encounters as DNV's generator has them: OS, OG, HO, GW, SO, or none (an empty text).

    Args:
        beta, alpha: as of `seen` [rad].
    """
    b, a = np.asarray(beta) / _DEG, np.asarray(alpha) / _DEG
    forward = np.abs(b) < 112.5
    classes = {
        "OS": (np.abs(b) > 112.5) & (np.abs(a) <= 67.5), "OG": (np.abs(a) > 112.5) & (np.abs(b) <= 67.5),
        "HO": (np.abs(b) <= 5.0) & (np.abs(a) <= 5.0),
        "GW": (b > 0.0) & forward & (a > -112.5) & (a <= 5.0), "SO": (b < 0.0) & forward & (a < 112.5) & (a >= -5.0),
    }  # fmt: skip
    return np.select(list(classes.values()), list(classes), "")


def together(parts: Sequence[Meetings]) -> Meetings:
    """Encounters one after the other, of equally many ships."""
    x, y, psi, U, kinds = (np.concatenate([getattr(one, name) for one in parts]) for name in
                           ("x", "y", "psi", "U", "kinds"))  # fmt: skip
    return Meetings(x, y, psi, U, kinds)


def _stacked(ships: Array, kinds: NDArray[np.str_]) -> Meetings:
    """One run; ships of shape (ships, 4)."""
    x, y, psi, U = (one[None] for one in ships.T)
    return Meetings(x, y, psi, U, kinds[None])


def _above_zero(**values: float) -> None:
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise RequestError(f"{name} = {value:g}; it is a number above zero")
