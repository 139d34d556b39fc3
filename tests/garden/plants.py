"""What may be wrong with logs: functions from one folder to another, from which `faults` makes its list."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np

from .fleet import BY_SHIP, DEG
from .logs import Folder, Log, scale
from .motion import Array, sail
from .others import Three, Twin
from .ships import Mmg, Ship, held_speed, truth

Plant = Callable[[Folder], Folder]
AFTER = 200.0
"""Where in a trial single rows are spoilt [s, full scale]."""


def _row(log: Log, part: float = 0.3) -> int:
    return int(part * len(log.t))


def times(factor: float, *names: str) -> Plant:
    """Channels multiplied."""
    return lambda f: f.each(lambda log: log.having(**{n: log.table[n] * factor for n in names if n in log.table}))


def plus(offset: float, name: str) -> Plant:
    """A constant added, by Froude's law for a model."""
    return lambda f: f.each(lambda log: log.having(**{name: log.table[name] + offset * scale(f.ship, name)}))


def late(seconds: float, *names: str) -> Plant:
    """Channels that show what was `seconds` ago; noise and weather as they were."""

    def plant(f: Folder) -> Folder:
        lag = seconds * math.sqrt(f.ship.length / 320.0)
        return f.each(
            lambda log: log.having(**{n: log.table[n] + log.true(n, lag) - log.true(n) for n in names})
        )  # fmt: skip

    return plant


def spikes(size: float, count: int, *names: str, only: str = "") -> Plant:
    """Single rows that are off by `size` [SI, full scale], the same rows for each channel."""

    def one(log: Log, ship: Ship) -> Log:
        rows = np.linspace(0.3, 0.8, count) * len(log.t)
        out = {}
        for n in names:
            values = log.table[n].copy()
            values[rows.astype(int)] += size * scale(ship, n)
            out[n] = values
        return log.having(**out)

    return lambda f: f.each(lambda log: one(log, f.ship), only)


def filled(value: float, share: float, *names: str, each: int = 1) -> Plant:
    """Rows that hold `value`: a stretch of `share` of the log, or single ones scattered where each > 1."""

    def one(log: Log) -> Log:
        first, count = _row(log), max(int(share * len(log.t)), 1)
        rows = np.arange(first, first + count * each, each)
        rows = rows[rows < len(log.t)]
        out = {}
        for n in names:
            values = log.table[n].copy()
            values[rows] = value
            out[n] = values
        return log.having(**out)

    return lambda f: f.each(one)


def held(share: float, *names: str) -> Plant:
    """A stretch in which channels repeat the value at its beginning."""

    def one(log: Log) -> Log:
        a, b = _row(log), _row(log) + int(share * len(log.t))
        out = {}
        for n in names:
            values = log.table[n].copy()
            values[a:b] = values[a]
            out[n] = values
        return log.having(**out)

    return lambda f: f.each(one)


def constant(value: float, *names: str) -> Plant:
    return lambda f: f.each(lambda log: log.having(**{n: np.full(log.t.size, value) for n in names}))


def without(*names: str) -> Plant:
    return lambda f: f.each(lambda log: replace(log, table={n: v for n, v in log.table.items() if n not in names}))


def clock(change: Callable[[Array], Array]) -> Plant:
    return lambda f: f.each(lambda log: replace(log, t=change(log.t)))


def coarse(step: float, *names: str) -> Plant:
    return lambda f: f.each(lambda log: log.having(**{n: np.round(log.table[n] / step) * step for n in names}))


def swapped(a: str, b: str) -> Plant:
    return lambda f: f.each(lambda log: log.having(**{a: log.table[b], b: log.table[a]}))


def rows(pick: Callable[[int], Array]) -> Plant:
    return lambda f: f.each(lambda log: log.rows(pick(len(log.t))))


def drift(speed: float, towards: float, change: float = 0.0) -> Plant:
    """A steady current, which turns by `change` [rad] from trial to trial; motion in still water plus the drift."""

    def plant(f: Folder) -> Folder:
        size = speed * math.sqrt(f.ship.length / 320.0)
        return replace(f, logs=tuple(one(log, size, towards + k * change) for k, log in enumerate(f.logs)))

    def one(log: Log, size: float, to: float) -> Log:
        north, east, psi = size * math.cos(to), size * math.sin(to), log.true("psi")
        return log.having(
            x=log.table["x"] + north * log.t, y=log.table["y"] + east * log.t,
            u=log.table["u"] + north * np.cos(psi) + east * np.sin(psi),
            v_m=log.table["v_m"] + east * np.cos(psi) - north * np.sin(psi),
        )  # fmt: skip

    return plant


def water(log: Log) -> Log:
    """Speeds through the water in place of those over ground."""
    w = log.motion.weather
    north, east, psi = w.current * math.cos(w.current_to), w.current * math.sin(w.current_to), log.true("psi")
    return log.having(
        u=log.table["u"] - north * np.cos(psi) - east * np.sin(psi),
        v_m=log.table["v_m"] - east * np.cos(psi) + north * np.sin(psi),
    )


def antenna(forward: float, starboard: float) -> Plant:
    """The fix of an antenna [m off midship at full scale]."""

    def plant(f: Folder) -> Folder:
        a, b = (part * f.ship.length / 320.0 for part in (forward, starboard))

        def one(log: Log) -> Log:
            c, s = np.cos(log.true("psi")), np.sin(log.true("psi"))
            return log.having(x=log.table["x"] + a * c - b * s, y=log.table["y"] + a * s + b * c)

        return f.each(one)

    return plant


def log_at(forward: float) -> Plant:
    """Sway measured `forward` [m at full scale] of midship."""
    return lambda f: f.each(
        lambda log: log.having(v_m=log.table["v_m"] + forward * f.ship.length / 320.0 * log.true("r"))
    )


def course(log: Log) -> Log:
    """The course over ground under the name of the heading."""
    true = log.motion.at(log.t)
    return log.having(psi=log.table["psi"] + np.arctan2(true["v_m"], true["u"]))


def speed_as_surge(log: Log) -> Log:
    true = log.motion.at(log.t)
    return log.having(u=log.table["u"] + np.hypot(true["u"], true["v_m"]) - true["u"], v_m=0.0 * log.t)


def earth(log: Log) -> Log:
    c, s = np.cos(log.true("psi")), np.sin(log.true("psi"))
    u, v = log.table["u"], log.table["v_m"]
    return log.having(u=u * c - v * s, v_m=u * s + v * c)


def side(port: float, starboard: float) -> Plant:
    """Rudder angles scaled to each side by itself."""

    def one(log: Log) -> Log:
        delta = log.table["delta"]
        return log.having(delta=delta * np.where(delta < 0, port, starboard))

    return lambda f: f.each(one)


def ordered(log: Log) -> Log:
    """The rudder's order under the name of its angle: where the rudder will come to rest."""
    delta, ship = log.true("delta"), log.motion.ship
    quickest = ship.gear[ship.controls.index("delta")]
    step = float(log.t[1] - log.t[0])
    moving = np.abs(log.true("delta", -step) - delta) > 0.02 * step * quickest
    rests, moves = np.flatnonzero(~moving), np.flatnonzero(moving)
    moves = moves[moves < rests[-1]]
    goal = delta.copy()
    goal[moves] = delta[rests[np.searchsorted(rests, moves)]]
    return log.having(delta=log.table["delta"] + goal - delta)


def apparent(log: Log) -> Log:
    """The apparent wind under the names of the true one."""
    true, w = log.motion.at(log.t), log.motion.weather
    ahead = w.wind * np.cos(w.wind_from - true["psi"]) + true["u"]
    aside = w.wind * np.sin(w.wind_from - true["psi"]) + true["v_m"]
    noise = log.table["U_T"] - w.wind, log.table["gamma_T"] - w.wind_from
    return log.having(U_T=np.hypot(ahead, aside) + noise[0], gamma_T=np.arctan2(aside, ahead) + noise[1])


def relative(log: Log) -> Log:
    """True speed of the wind, its direction counted from the bow."""
    return log.having(gamma_T=log.table["gamma_T"] - log.true("psi"))


def sailed_by(change: Callable[[Mmg], Mmg]) -> Plant:
    """The same orders and the same noise, aboard another ship than the papers say."""

    def plant(f: Folder) -> Folder:
        other = change(truth(f.ship))
        return replace(f, logs=tuple(_again(log, f.ship, other) for log in f.logs))

    return plant


def _again(log: Log, published: Ship, other: Ship) -> Log:
    before = log.motion.at(np.array([-1.0]))
    psi, n = float(before["psi"][0]), held_revolutions(log)
    [plan] = [one for one in BY_SHIP[published.name].plans(published, n) if one.name == log.name]
    speed = held_speed(other, plan.begin[0])
    made = sail(other, plan.orders(psi), log.motion.weather, psi, speed, plan.begin, plan.duration)
    now, then = made.at(log.t), log.motion.at(log.t)
    table = {name: log.table[name] + now[name] - then[name] if name in now else log.table[name] for name in log.table}
    return replace(log, table=table, motion=made)


def held_revolutions(log: Log) -> float:
    """Revolutions at the speed of approach [1/s]."""
    return float(np.max(log.true(log.motion.ship.controls[0])))


def jammed(ship: Twin) -> Twin:
    """Its starboard rudder stands at 5 deg, whatever is ordered."""
    return Jammed(**{each.name: getattr(ship, each.name) for each in fields(ship)})


class Jammed(Twin):
    """Twin screws, one rudder of which does not obey."""

    def rates(self, u: float, v: float, r: float, controls: tuple[float, ...], wind: tuple[float, float]) -> Three:
        return super().rates(u, v, r, (*controls[:3], 5 * DEG), wind)


def shallow(ship: Mmg) -> Mmg:
    """What 1.5 draughts of water do to the hull, roughly (Kijima and Nakiri 2003: all damping grows)."""
    grown = {"R_0": 1.1, "Y_v": 1.6, "Y_r": 1.3, "Y_vvv": 1.9, "N_v": 1.4, "N_r": 1.25, "Y_vrr": 1.5, "N_vvr": 1.5}
    return ship.altered(**{name: factor * ship.hull[name] for name, factor in grown.items()})


def lighter(ship: Mmg) -> Mmg:
    """The same hull at 85 % of the draught; primed coefficients of the sectional kind follow the draught."""
    part = 0.85
    grown = {"Y_v": part**0.7, "N_v": part, "N_r": part**0.5, "Y_vvv": 1.0 / part, "Y_r": part}
    changed = ship.altered(**{name: factor * ship.hull[name] for name, factor in grown.items()})
    return replace(changed, d=ship.d * part, volume=ship.volume * part)


def another(ship: Mmg) -> Mmg:
    """A finer, quicker ship of the same length."""
    factors = {"Y_v": 0.8, "Y_r": 0.7, "N_v": 0.6, "N_r": 1.3, "Y_vvv": 0.8, "N_vvr": 1.4, "X_vr": -20.0, "Y_vrr": 1.6}
    changed = ship.altered(**{name: factor * ship.hull[name] for name, factor in factors.items()})
    return replace(changed, volume=0.8 * ship.volume, A_R=0.8 * ship.A_R)


def chain(*plants: Plant) -> Plant:
    def plant(f: Folder) -> Folder:
        for one in plants:
            f = one(f)
        return f

    return plant
