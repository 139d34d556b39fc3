"""Manoeuvres of a ship of the garden, integrated tightly from one event of the helm to the next."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from .ships import Mmg

Array = NDArray[np.float64]
NAMES = ("x", "y", "psi", "u", "v_m", "r", "delta", "n_P")
BEFORE = 60.0
"""Seconds of straight approach before the first row of a log, so that late instruments have something to show."""


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

    ship: Mmg
    weather: Weather
    starts: Array
    pieces: tuple[Any, ...]

    def at(self, t: Array) -> dict[str, Array]:
        """All channels over ground at times t [s]."""
        t = np.asarray(t, dtype=float)
        which = np.clip(np.searchsorted(self.starts, t, "right") - 1, 0, len(self.pieces) - 1)
        out = np.empty((8, t.size))
        for k in np.unique(which):
            rows = which == k
            out[:, rows] = self.pieces[k](t[rows])
        values = dict(zip(NAMES, out, strict=True))
        w = self.weather
        east, north = w.current * math.sin(w.current_to), w.current * math.cos(w.current_to)
        c, s = np.cos(values["psi"]), np.sin(values["psi"])
        values["x"] = values["x"] + north * t
        values["y"] = values["y"] + east * t
        values["u"] = values["u"] + north * c + east * s
        values["v_m"] = values["v_m"] + east * c - north * s
        return values


@dataclass(frozen=True)
class Order:
    """Rudder [rad] and revolutions [1/s] ordered until `until(t, state)` crosses zero; None runs to the end."""

    rudder: float
    revolutions: float
    until: Callable[[float, Array], float] | None = None


def zigzag(rudder: float, heading: float, side: int, psi_0: float, n: float, times: int = 5) -> Iterator[Order]:
    """Orders of a zigzag: straight for 20 s, then over at every `heading` off the base course."""

    def after(t: float, y: Array) -> float:
        return t - 20.0

    yield Order(0.0, n, after)
    for k in range(times):
        now = side * (-1) ** k

        def off(t: float, y: Array, now: int = now) -> float:
            return now * (y[2] - psi_0) - heading

        yield Order(now * rudder, n, off)
    yield Order(side * (-1) ** times * rudder, n)


def turning(rudder: float, side: int, n: float) -> Iterator[Order]:
    """Orders of a turning circle from 20 s on."""
    yield Order(0.0, n, lambda t, y: t - 20.0)
    yield Order(side * rudder, n)


def acceleration(low: float, high: float) -> Iterator[Order]:
    """Straight on, from low to high revolutions at 30 s."""
    yield Order(0.0, low, lambda t, y: t - 30.0)
    yield Order(0.0, high)


def sail(
    ship: Mmg, orders: Iterator[Order], weather: Weather, psi_0: float, speed: float, n: float, duration: float
) -> Motion:
    """Integrate a manoeuvre from a straight run at `speed` [m/s] and `n` [1/s]."""
    w = weather
    east, north = w.current * math.sin(w.current_to), w.current * math.cos(w.current_to)
    from_north, from_east = w.wind * math.cos(w.wind_from), w.wind * math.sin(w.wind_from)

    def rhs(t: float, y: Array, rates: tuple[float, float]) -> list[float]:
        _, _, psi, u, v, r, delta, revolutions = y.tolist()
        c, s = math.cos(psi), math.sin(psi)
        wind = (
            (from_north + north) * c + (from_east + east) * s + u,
            (from_east + east) * c - (from_north + north) * s + v,
        )
        du, dv, dr = ship.rates(u, v, r, (revolutions, delta), wind)
        return [u * c - v * s, u * s + v * c, r, du, dv, dr, *rates]

    start = -BEFORE
    y = np.array([-speed * BEFORE * math.cos(psi_0), -speed * BEFORE * math.sin(psi_0), psi_0, speed, 0, 0, 0, n])
    starts: list[float] = []
    pieces: list[Any] = []

    def run(t: float, y: Array, rates: tuple[float, float], until: float, stop: Any) -> tuple[float, Array, bool]:
        events = []
        if stop is not None:
            stop.terminal = True
            events = [lambda t, y, *_: stop(t, y)]
            events[0].terminal = True  # type: ignore[attr-defined]
        found = solve_ivp(
            rhs, (t, until), y, "DOP853", dense_output=True, events=events, args=(rates,), rtol=1e-9, atol=1e-10
        )
        starts.append(t)
        pieces.append(found.sol)
        return float(found.t[-1]), found.y[:, -1], found.status == 1

    t = start
    for order in orders:
        reached = False
        while t < duration and not reached:
            lag_d, lag_n = order.rudder - y[6], order.revolutions - y[7]
            rates = (
                math.copysign(ship.rudder_rate, lag_d) if abs(lag_d) > 1e-12 else 0.0,
                math.copysign(ship.shaft_rate, lag_n) if abs(lag_n) > 1e-12 else 0.0,
            )
            moves = [abs(lag / rate) for lag, rate in zip((lag_d, lag_n), rates, strict=True) if rate]
            until = min([duration + 1.0, *(t + move for move in moves)])
            t, y, reached = run(t, y, rates, until, order.until)
            for k, lag, goal in ((6, lag_d, order.rudder), (7, lag_n, order.revolutions)):
                if lag and abs(y[k] - goal) < 1e-9:
                    y[k] = goal
        if t >= duration:
            break
    return Motion(ship, weather, np.array(starts), tuple(pieces))
