"""A passage under an autopilot: the truth by Runge-Kutta steps of the garden's equations, and what a bridge logs of it.

Nothing of the package is in it.  A fault acts on the truth (gear, water, wind, the ship) or on the readings, from its
onset on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from garden.ships import Ship, revolutions

from .vessels import Vessel

Array = NDArray[np.float64]
Row = tuple[float, dict[str, float]]
LIMIT = math.radians(35.0)


@dataclass(frozen=True)
class Weather:
    """What the passage meets.

    Attributes:
        wind, wind_from: true wind [m/s, rad]; gusts of a tenth of it last 20 s.
        waves: of first-order motion, as a share of L / 320 m: 1 m and .5 deg at a period of 9 s by Froude's law.
        current: north and east [m/s].
        force: slow forces that no log shows, as a share of the accelerations that a twin takes as usual.
        logged: whether the wind is in the log.
    """

    wind: float = 0.0
    wind_from: float = 2.0
    waves: float = 0.0
    current: tuple[float, float] = (0.0, 0.0)
    force: float = 0.0
    logged: bool = True


@dataclass(frozen=True)
class Fault:
    """What goes wrong.

    Attributes:
        at: since when [s].
        ship: the ship from then on.
        wind, current: added from then on, by the time since then: components it comes from; those it goes to [m/s].
        gear: (time since, orders, positions, dt) -> positions a moment later; None where the gear obeys.
        read: (time since, readings as a history of rows, k) -> readings of row k.
        stamp: time of a row as logged, by the time since.
    """

    at: float = math.inf
    ship: Callable[[Ship], Ship] | None = None
    wind: Callable[[float], tuple[float, float]] = lambda since: (0.0, 0.0)
    current: Callable[[float], tuple[float, float]] = lambda since: (0.0, 0.0)
    gear: Callable[[float, Array, Array, float], Array] | None = None
    acts: Callable[[float, Array], Array] = lambda since, now: now
    read: Callable[[float, list[dict[str, float]], int], dict[str, float]] = lambda since, rows, k: rows[k]
    stamp: Callable[[float], float] = lambda since: since


@dataclass
class Passage:
    """One log.

    Attributes:
        vessel: the ship.
        duration: of the log [s].
        weather: what it meets.
        fault: what goes wrong.
        seed: of courses, noise, waves and gusts.
        turns: lengths between changes of course.
        antenna: where it truly stands, forward and to starboard of midship [m].
    """

    vessel: Vessel
    duration: float
    weather: Weather = Weather()
    fault: Fault = field(default_factory=Fault)
    seed: int = 1
    turns: float = 8.0
    antenna: tuple[float, float] = (0.0, 0.0)

    @property
    def _phase(self) -> float:
        return float(np.random.default_rng([self.seed, 2]).uniform()) * self.turns * self.vessel.own

    def change(self, after: float) -> float:
        """When the next change of course begins [s]."""
        leg = self.turns * self.vessel.own
        return leg * math.ceil((after + self._phase) / leg) - self._phase

    def rows(self) -> list[Row]:
        """The log."""
        exact = self._sailed()
        rng = np.random.default_rng([self.seed, 5])
        noisy = [self._noisy(one, rng) for one in exact]
        dt, at = self.vessel.dt, self.fault.at
        out: list[Row] = []
        for k in range(len(noisy)):
            t = k * dt
            said = noisy[k] if t < at else self.fault.read(t - at, noisy, k)
            out.append((t if t < at else at + self.fault.stamp(t - at), said))
        return out

    def _noisy(self, exact: dict[str, float], rng: np.random.Generator) -> dict[str, float]:
        noise, same = self.vessel.noise, {"y": "x", "v_east": "v_north"}
        out = {name: value + noise.get(same.get(name, name), 0.0) * float(rng.standard_normal())
               for name, value in exact.items()}  # fmt: skip
        out["psi"] %= math.tau
        return out

    def _sailed(self) -> list[dict[str, float]]:
        vessel, weather, fault = self.vessel, self.weather, self.fault
        real, own, dt = vessel.real, vessel.own, vessel.dt
        rng = np.random.default_rng([self.seed, 3])
        n_P = revolutions(real, real.speed)
        names, gear = real.controls, np.array(real.gear)
        y = np.array([0.0, 0.0, 0.0, real.speed, 0.0, 0.0, *real.steered(0.0, n_P)])
        wanted, gust, slow = 0.0, 0.0, np.zeros(3)
        sizes = weather.force * np.array([1e-3 * real.speed / own, 3e-3 * real.speed / own, 3e-3 / own**2])
        waves = self._waves(rng)
        leg, phase = self.turns * own, self._phase
        steps = max(1, math.ceil(dt / (0.03 * own)))
        out: list[dict[str, float]] = []
        for k in range(round(self.duration / dt)):
            t = k * dt
            since = t - fault.at
            ship = fault.ship(real) if since >= 0.0 and fault.ship else real
            if math.floor((t + phase) / leg) != math.floor((t - dt + phase) / leg):
                wanted += math.radians(float(rng.uniform(15.0, 45.0))) * float(rng.choice([-1.0, 1.0]))
            keep, span = math.exp(-dt / 20.0), math.exp(-dt / (20.0 * own))
            gust = keep * gust + 0.1 * math.sqrt(1.0 - keep**2) * float(rng.standard_normal())
            slow = span * slow + sizes * math.sqrt(1.0 - span**2) * rng.standard_normal(3)
            blow = weather.wind * (1.0 + gust)
            wind = (blow * math.cos(weather.wind_from), blow * math.sin(weather.wind_from))
            north, east = weather.current
            if since >= 0.0:
                more, drift = fault.wind(since), fault.current(since)
                north, east, seen = north + drift[0], east + drift[1], wind
                wind = (wind[0] + more[0], wind[1] + more[1])
            else:
                seen = wind
            rolled = waves(t)
            out.append(self._exact(y, names, (north, east), seen, rolled))
            error = math.remainder(wanted - y[2], math.tau)
            helm = min(max(1.0 * error - 1.0 * own * y[5], -0.35), 0.35)
            orders = np.array(ship.steered(helm, n_P))
            out[-1] |= {f"{name}_cmd": float(value) for name, value in zip(names, orders, strict=True)
                        if name.startswith("delta")}  # fmt: skip
            for _ in range(steps):
                h = dt / steps
                now = y[6:]
                if since >= 0.0 and fault.gear:
                    after = fault.gear(since, orders, now, h)
                else:
                    after = now + np.clip(orders - now, -gear * h, gear * h)
                acting = 0.5 * (now + after)
                if since >= 0.0:
                    acting = fault.acts(since, acting)
                y[:6] = _rk4(ship, y[:6], acting, wind, (north, east), slow, h)
                y[6:] = after
        return out

    def _waves(self, rng: np.random.Generator) -> Callable[[float], Array]:
        """First-order motion at a time: sway and heading, and the rates of both."""
        size, L = self.weather.waves, self.vessel.real.length
        if not size:
            return lambda t: np.zeros(4)
        periods = 9.0 * math.sqrt(L / 320.0) * rng.uniform(0.85, 1.2, 6)
        w, phase = math.tau / periods, rng.uniform(0.0, math.tau, (2, 6))
        aside, turn = size * L / 320.0 / math.sqrt(3.0), size * math.radians(0.5) / math.sqrt(3.0)

        def at(t: float) -> Array:
            return np.array([
                aside * float(np.sum(np.sin(w * t + phase[0]))) / math.sqrt(2.0),
                turn * float(np.sum(np.sin(w * t + phase[1]))) / math.sqrt(2.0),
                aside * float(np.sum(w * np.cos(w * t + phase[0]))) / math.sqrt(2.0),
                turn * float(np.sum(w * np.cos(w * t + phase[1]))) / math.sqrt(2.0),
            ])  # fmt: skip

        return at

    def _exact(
        self, y: Array, names: tuple[str, ...], current: tuple[float, float], wind: tuple[float, float], rolled: Array
    ) -> dict[str, float]:  # fmt: skip
        aside, turn, across, rate = rolled.tolist()
        psi, r = float(y[2]) + turn, float(y[5]) + rate
        c, s, c_0, s_0 = math.cos(psi), math.sin(psi), math.cos(y[2]), math.sin(y[2])
        ahead, beam = self.antenna
        u, v = float(y[3]), float(y[4]) + across  # of midship, along the axes of the slow motion
        north, east = u * c_0 - v * s_0 + current[0], u * s_0 + v * c_0 + current[1]
        out = {"x": float(y[0]) + ahead * c - beam * s - aside * s_0,
               "y": float(y[1]) + ahead * s + beam * c + aside * c_0, "psi": psi, "r": r, "u_w": float(y[3]),
               "v_north": north - r * (beam * c + ahead * s), "v_east": east - r * (beam * s - ahead * c)}  # fmt: skip
        out |= {name: float(value) for name, value in zip(names, y[6:], strict=True)}
        if self.vessel.real.areas is not None and self.weather.logged:
            out["U_T"], out["gamma_T"] = math.hypot(*wind), math.atan2(wind[1], wind[0])
        return out


def _rk4(
    ship: Ship, y: Array, acting: Array, wind: tuple[float, float], current: tuple[float, float], slow: Array, h: float
) -> Array:  # fmt: skip
    """One step of the motion; velocities through the water, places over ground."""
    north, east = current
    controls = tuple(acting.tolist())

    def rate(z: Array) -> Array:
        _, _, psi, u, v, r = z.tolist()
        c, s = math.cos(psi), math.sin(psi)
        from_north, from_east = wind[0] + north, wind[1] + east
        felt = (from_north * c + from_east * s + u, from_east * c - from_north * s + v)
        du, dv, dr = ship.rates(u, v, r, controls, felt)[:3]
        return np.array([u * c - v * s + north, u * s + v * c + east, r, du + slow[0], dv + slow[1], dr + slow[2]])

    k1 = rate(y)
    k2 = rate(y + 0.5 * h * k1)
    k3 = rate(y + 0.5 * h * k2)
    k4 = rate(y + h * k3)
    return np.asarray(y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))
