"""Manoeuvres of a ship of the garden, integrated tightly from one event of the helm to the next."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from .ships import Ship

Array = NDArray[np.float64]
NAMES = ("x", "y", "psi", "u", "v_m", "r")
BEFORE = 1.5
"""Straight approach before the first row of a log, so that late instruments have something to show [lengths]."""


@dataclass(frozen=True)
class Weather:
    """True wind [m/s, rad from] and current [m/s, rad towards]."""

    wind: float = 0.0
    wind_from: float = 0.0
    current: float = 0.0
    current_to: float = 0.0


@dataclass(frozen=True)
class Motion:
    """What truly happened, at any time: segments of dense output, states in the moving water."""

    ship: Ship
    weather: Weather
    starts: Array
    pieces: tuple[Any, ...]

    def at(self, t: Array) -> dict[str, Array]:
        """All channels over ground at times t [s]."""
        t = np.asarray(t, dtype=float)
        which = np.clip(np.searchsorted(self.starts, t, "right") - 1, 0, len(self.pieces) - 1)
        out = np.empty((len(NAMES) + len(self.ship.inner) + len(self.ship.controls), t.size))
        for k in np.unique(which):
            rows = which == k
            out[:, rows] = self.pieces[k](t[rows])
        values = dict(zip((*NAMES, *self.ship.inner, *self.ship.controls), out, strict=True))
        w = self.weather
        east, north = w.current * math.sin(w.current_to), w.current * math.cos(w.current_to)
        c, s = np.cos(values["psi"]), np.sin(values["psi"])
        values["x"] = values["x"] + north * t
        values["y"] = values["y"] + east * t
        values["u"] = values["u"] + north * c + east * s
        values["v_m"] = values["v_m"] + east * c - north * s
        return values


Controls = tuple[float, ...]
Steer = Callable[[float], Controls]
"""Controls of the ship by the angle that it steers with, > 0 to starboard."""


@dataclass(frozen=True)
class Order:
    """Controls ordered until `until(t, state)` crosses zero; None runs to the end."""

    controls: Controls
    until: Callable[[float, Array], float] | None = None


def zigzag(steer: Steer, angle: float, heading: float, side: int, psi_0: float, straight: float = 20.0,
           times: int = 5) -> Iterator[Order]:  # fmt: skip
    """Orders of a zigzag: straight for some seconds, then over at every `heading` off the base course."""
    yield Order(steer(0.0), lambda t, y: t - straight)
    for k in range(times):
        now = side * (-1) ** k

        def off(t: float, y: Array, now: int = now) -> float:
            return now * (y[2] - psi_0) - heading

        yield Order(steer(now * angle), off)
    yield Order(steer(side * (-1) ** times * angle))


def turning(steer: Steer, angle: float, side: int, straight: float = 20.0) -> Iterator[Order]:
    """Orders of a turning circle after some seconds straight on."""
    return steps((0.0, steer(0.0)), (straight, steer(side * angle)))


def steps(*orders: tuple[float, Controls]) -> Iterator[Order]:
    """Controls, each from a time on [s]; the first from the beginning."""
    for k, (_, controls) in enumerate(orders):
        end = orders[k + 1][0] if k + 1 < len(orders) else None
        yield Order(controls, None if end is None else lambda t, y, end=end: t - end)


def sail(
    ship: Ship, orders: Iterator[Order], weather: Weather, psi_0: float, speed: float, begin: Controls, duration: float
) -> Motion:
    """Integrate a manoeuvre from a straight run at `speed` [m/s] under the controls `begin`."""
    w = weather
    east, north = w.current * math.sin(w.current_to), w.current * math.cos(w.current_to)
    hidden = len(ship.inner)
    from_north, from_east = w.wind * math.cos(w.wind_from), w.wind * math.sin(w.wind_from)

    def rhs(t: float, y: Array, rates: Controls) -> list[float]:
        _, _, psi, u, v, r, *more = y.tolist()
        inner, controls = more[:hidden], more[hidden:]
        c, s = math.cos(psi), math.sin(psi)
        wind = (
            (from_north + north) * c + (from_east + east) * s + u,
            (from_east + east) * c - (from_north + north) * s + v,
        )
        return [u * c - v * s, u * s + v * c, r, *ship.rates(u, v, r, tuple(controls), wind, *inner), *rates]

    before = BEFORE * ship.length / ship.speed
    begun = (-speed * before * math.cos(psi_0), -speed * before * math.sin(psi_0), psi_0, speed, 0, 0)
    y = np.array([*begun, *(0.0 for _ in ship.inner), *begin])
    starts: list[float] = []
    pieces: list[Any] = []

    def run(t: float, y: Array, rates: Controls, until: float, stop: Any) -> tuple[float, Array, bool]:
        events = []
        if stop is not None:
            events = [lambda t, y, *_: stop(t, y)]
            events[0].terminal = True  # type: ignore[attr-defined]
        found = solve_ivp(
            rhs, (t, until), y, "DOP853", dense_output=True, events=events, args=(rates,), rtol=1e-9, atol=1e-10
        )
        starts.append(t)
        pieces.append(found.sol)
        return float(found.t[-1]), found.y[:, -1], found.status == 1

    t, own = -before, slice(len(NAMES) + hidden, None)
    for order in orders:
        reached = False
        while t < duration and not reached:
            lags = np.array(order.controls) - y[own]
            rates = np.where(np.abs(lags) > 1e-12, np.copysign(ship.gear, lags), 0.0)
            moves = [abs(lag / rate) for lag, rate in zip(lags, rates, strict=True) if rate]
            until = min([duration + 1.0, *(t + move for move in moves)])
            t, y, reached = run(t, y, tuple(rates.tolist()), until, order.until)
            y[own] = np.where(np.abs(y[own] - order.controls) < 1e-9, order.controls, y[own])
        if t >= duration:
            break
    return Motion(ship, weather, np.array(starts), tuple(pieces))
