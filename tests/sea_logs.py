"""Logs of the tanker of the garden for a twin: motion by the independent simulator, readings as a bridge has them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from garden.motion import Motion, Order, Weather, sail
from garden.ships import FULL, Mmg, revolutions

SHIP: Mmg = replace(FULL, areas=None)
"""The tanker of the library, which no wind moves."""
NOISE = {"x": 0.5, "psi": 0.001, "r": 1e-4, "u_w": 0.03, "v_north": 0.03}
_SLOW = 40.0


def kept(ship: Mmg, n: float, angle: float, courses: tuple[float, ...], each: float) -> Iterator[Order]:
    """A helmsman with a rudder of `angle` either way, who gets a new course every `each` seconds."""

    def off(t: float, y: np.ndarray) -> float:
        course = courses[min(int(max(t, 0.0) // each), len(courses) - 1)]
        return math.remainder(y[2] - course, math.tau) + _SLOW * y[5]

    band, side = math.radians(0.5), 1.0
    while True:
        side = -side
        yield Order(ship.steered(side * angle, n), lambda t, y, side=side: off(t, y) - side * band)


@lru_cache(maxsize=8)
def sailed(
    courses: tuple[float, ...] = (0.0, 0.6, 0.0, -0.6), each: float = 300.0, current: tuple[float, float] = (0.0, 0.0),
    angle: float = 0.12, duration: float = 1500.0,
) -> Motion:  # fmt: skip
    """What truly happens; the current to the north and to the east [m/s]."""
    n = revolutions(SHIP, SHIP.speed)
    weather = Weather(current=math.hypot(*current), current_to=math.atan2(current[1], current[0]))
    return sail(SHIP, kept(SHIP, n, angle, courses, each), weather, 0.0, SHIP.speed, SHIP.steered(0.0, n), duration)


Row = tuple[float, dict[str, float]]


@dataclass(frozen=True)
class Bridge:
    """The instruments.

    Attributes:
        motion: what truly happens.
        antenna: forward and to starboard of midship [m].
        rates: readings a second of each instrument, by its first channel; rows come as often as the heading.
        spoil: changes a row: (time, readings) -> readings.
    """

    motion: Motion
    antenna: tuple[float, float] = (0.0, 0.0)
    rates: tuple[tuple[str, float], ...] = ()
    spoil: Callable[[float, dict[str, float]], dict[str, float]] = lambda t, row: row
    seed: int = 1
    noise: float = 1.0

    def rows(self, duration: float = 1500.0, rate: float = 1.0) -> list[Row]:
        """The rows, each with what was read in it."""
        t = np.arange(round(duration * rate)) / rate
        true = self.motion.at(t)
        rng = np.random.default_rng(self.seed)
        c, s = np.cos(true["psi"]), np.sin(true["psi"])
        ahead, aside = self.antenna
        u, v = true["u"] - true["r"] * aside, true["v_m"] + true["r"] * ahead
        w = self.motion.weather
        through = true["u"] - w.current * np.cos(w.current_to - true["psi"])
        exact = {"x": true["x"] + ahead * c - aside * s, "y": true["y"] + ahead * s + aside * c, "psi": true["psi"],
                 "r": true["r"], "u_w": through, "v_north": u * c - v * s, "v_east": u * s + v * c}  # fmt: skip
        same = {"y": "x", "v_east": "v_north"}
        read = {name: one + self.noise * NOISE[same.get(name, name)] * rng.standard_normal(t.size)
                for name, one in exact.items()}  # fmt: skip
        read["psi"] %= math.tau
        read |= {name: true[name] for name in ("n_P", "delta")}
        skip = {name: round(rate / often) for name, often in self.rates}
        out: list[Row] = []
        for k, at in enumerate(t.tolist()):
            row = {name: float(one[k]) for name, one in read.items() if k % skip.get(same.get(name, name), 1) == 0}
            out.append((at, self.spoil(at, row)))
        return out
