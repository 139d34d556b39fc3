"""The trials of a stranger as a bridge's logger writes them, and the turn that nobody logged.

One row a second: ISO stamps, latitude and longitude, SOG and COG, heading, rate of turn, rudder angles that count to
port, revolutions, apparent wind.  Noise is correlated where that of the instrument is, one row in a hundred is lost.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from pathlib import Path

import numpy as np

from garden.motion import Array, Motion, Order, Weather, sail, steps, turning, zigzag
from garden.ships import revolutions

from .ships import BY_NAME, Stranger

DEG, KN = math.pi / 180.0, 1852.0 / 3600.0
LATITUDE, LONGITUDE = 54.2, 10.4
_RADIUS = 6378137.0, 6356752.3142
LOST = 0.01
JITTER = 0.5
"""How late a row of a poor receiver may be [s]."""

Orders = Callable[[float], Iterator[Order]]


@dataclass(frozen=True)
class Trial:
    """One trial: its motion, and when it began, in seconds of the day."""

    name: str
    motion: Motion
    duration: float
    began: float


def weather(stranger: Stranger) -> Weather:
    """A light wind, and a current of .2 to .5 m/s."""
    random = np.random.default_rng([stranger.seed, 1])
    wind = min(2.0 + 0.03 * stranger.ship.length, 5.0) * float(random.uniform(0.7, 1.3))
    sides = random.uniform(0.0, 2.0 * math.pi, 2)
    return Weather(wind, float(sides[0]), float(random.uniform(0.2, 0.5)), float(sides[1]))


@lru_cache(maxsize=32)
def trials(name: str) -> tuple[Trial, ...]:
    """Zigzags 10/10 and 20/20, turning circles to both sides, and half the revolutions; on several headings."""
    stranger = BY_NAME[name]
    ship, around = stranger.ship, weather(stranger)
    n, own = revolutions(ship, ship.speed), ship.length / ship.speed
    held, slow = ship.steered(0.0, n), ship.steered(0.0, 0.5 * n)

    def steer(angle: float) -> tuple[float, ...]:
        return ship.steered(angle, n)

    def zig(angle: float, side: int) -> Orders:
        return lambda psi: zigzag(steer, angle * DEG, angle * DEG, side, psi, 2.0 * own, times=12)

    def circle(angle: float, side: int) -> Orders:
        return lambda psi: turning(steer, angle * DEG, side, 2.0 * own)

    plans: tuple[tuple[str, Orders, float], ...] = (
        ("zigzag_10", zig(10, 1), 35.0), ("zigzag_20", zig(20, -1), 35.0), ("zigzag_20_again", zig(20, 1), 35.0),
        ("turn_25", circle(25, 1), 30.0), ("turn_20", circle(20, -1), 30.0),
        ("half_ahead", lambda psi: steps((0.0, held), (3.0 * own, slow)), 25.0),
    )  # fmt: skip
    base = float(np.random.default_rng([stranger.seed, 2]).uniform(0.0, 2.0 * math.pi))
    out: list[Trial] = []
    for k, (called, orders, lasts) in enumerate(plans):
        psi, duration = (base + 100.0 * DEG * k) % (2.0 * math.pi), lasts * own
        out.append(
            Trial(called, sail(ship, orders(psi), around, psi, ship.speed, held, duration), duration, 4000.0 * k)
        )
    return tuple(out)


def unseen(stranger: Stranger, angle: float = 35.0) -> dict[str, float]:
    """Advance and tactical diameter [m] of a turn to starboard in a calm, from the order on."""
    ship = stranger.ship
    n, own = revolutions(ship, ship.speed), ship.length / ship.speed
    orders = turning(lambda turn: ship.steered(turn, n), angle * DEG, 1, own)
    motion = sail(ship, orders, Weather(), 0.0, ship.speed, ship.steered(0.0, n), 25.0 * own)
    t = np.arange(own, 25.0 * own, own / 400.0)
    path = motion.at(t)
    at_90, at_180 = (float(np.interp(angle * DEG, path["psi"], t)) for angle in (90.0, 180.0))
    ahead = float(np.interp(at_90, t, path["x"]) - path["x"][0])
    return {"advance": ahead, "tactical_diameter": float(np.interp(at_180, t, path["y"]) - path["y"][0])}


def heavy(random: np.random.Generator, count: int) -> Array:
    """Noise of unit variance with the tails of Student's t of three degrees of freedom, whose variance is three."""
    return random.standard_t(3.0, count) / math.sqrt(3.0)


def lasting(random: np.random.Generator, t: Array, sigma: float, tau: float) -> Array:
    """Noise that forgets itself after tau [s]: exact steps of an Ornstein-Uhlenbeck process."""
    keep = np.exp(-np.diff(t, prepend=t[0]) / tau)
    drawn = random.standard_normal(t.size) * np.sqrt(1.0 - np.append(0.0, keep[1:] ** 2))
    out = np.empty(t.size)
    now = 0.0
    for k in range(t.size):
        now = keep[k] * now + drawn[k]
        out[k] = now
    return sigma * out


@dataclass(frozen=True)
class Fault:
    """What is wrong with one instrument, in the columns that it writes, and its names as a suspect or a finding."""

    culprits: tuple[str, ...]
    late: Mapping[str, float]
    change: Callable[[dict[str, Array]], dict[str, Array]]


def _only(**changes: Callable[[Array], Array]) -> Callable[[dict[str, Array]], dict[str, Array]]:
    """Every channel whose name begins so, changed."""

    def change(table: dict[str, Array]) -> dict[str, Array]:
        return {name: next((to(values) for key, to in changes.items() if name.startswith(key)), values)
                for name, values in table.items()}  # fmt: skip

    return change


FAULTS: Mapping[str, Fault] = {
    "heading": Fault(("bias.psi", "heading_bias"), {}, _only(psi=lambda psi: psi + 4.0 * DEG)),
    "rudder_offset": Fault(("offset.delta", "rudder_offset"), {}, _only(delta=lambda delta: delta + 2.5 * DEG)),
    "gyro_scale": Fault(("scale.r", "gyro_scale", "scale:r"), {}, _only(r=lambda r: 1.1 * r)),
    "speed_scale": Fault(("scale.u", "log_scale", "scale:u"), {}, _only(sog=lambda sog: 1.08 * sog)),
    "gnss_late": Fault(("delay.position", "lag:x", "lag:u"), {"x": 3.0, "y": 3.0}, dict),
    "rudder_late": Fault(("delay.delta", "lag:delta", "order_as_measured"), {"delta": 3.0}, dict),
}


def read(stranger: Stranger, trial: Trial, t: Array, random: np.random.Generator) -> dict[str, Array]:
    """What the instruments say at times t [s], SI units, the fault in it."""
    fault = FAULTS.get(stranger.fault)
    true = trial.motion.at(t)
    for name, late in fault.late.items() if fault else ():
        true[name] = trial.motion.at(t - late)[name]
    ship, w = stranger.ship, trial.motion.weather
    small = ship.length < 15.0
    if stranger.harsh:
        late = trial.motion.at(t - random.uniform(0.0, JITTER, t.size))
        true |= {name: late[name] for name in ("x", "y")}
    sway, course = np.arctan2(true["v_m"], true["u"]), true["psi"]
    A, B = (-w.wind * np.cos(w.wind_from - true["psi"]), -w.wind * np.sin(w.wind_from - true["psi"]))
    from_ahead, from_starboard = true["u"] - A, true["v_m"] - B
    fix = 1.5 if stranger.harsh else 0.05 if small else 0.4

    def white(count: int) -> Array:
        return heavy(random, count) if stranger.harsh else random.standard_normal(count)

    def noisy(values: Array, sigma: float, slow: float, tau: float) -> Array:
        return values + sigma * white(t.size) + lasting(random, t, slow, tau)

    over, rate = np.hypot(true["u"], true["v_m"]), (0.05 if small else 0.01) * DEG
    out = {
        "x": noisy(true["x"], 0.2 * fix, fix, 60.0), "y": noisy(true["y"], 0.2 * fix, fix, 60.0),
        "sog": noisy(over, 0.02, 0.02, 10.0), "cog": noisy(course + sway, 0.3 * DEG, 0.0, 1.0),
        "psi": noisy(true["psi"], 0.1 * DEG, 0.1 * DEG, 60.0), "r": noisy(true["r"], rate, 0.0, 1.0),
        "U_A": noisy(np.hypot(from_ahead, from_starboard), 0.3, 0.3, 10.0),
        "gamma_A": noisy(np.arctan2(from_starboard, from_ahead), 2.0 * DEG, 2.0 * DEG, 10.0),
    }  # fmt: skip
    for name in ship.controls:
        size = 0.1 * DEG if name.startswith("delta") else 0.002 * float(np.mean(true[name]))
        out[name] = noisy(true[name], size, 0.0, 1.0)
    return fault.change(out) if fault else out


def written(stranger: Stranger, where: Path) -> Path:
    """The folder of logs."""
    where.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng([stranger.seed, 3])
    for trial in trials(stranger.name):
        t = np.arange(0.0, trial.duration + 0.5)
        t = t[random.uniform(size=t.size) >= LOST]
        columns = _columns(stranger, read(stranger, trial, t, random))
        began = datetime(2025, 6, 3, 6, tzinfo=UTC) + timedelta(seconds=trial.began)
        stamps = [(began + timedelta(seconds=float(s))).strftime("%Y-%m-%dT%H:%M:%SZ") for s in t]
        rows = zip(stamps, *columns.values(), strict=True)
        text = "\n".join([",".join(["Timestamp", *columns]), *(",".join(row) for row in rows)])
        (where / f"{trial.name}.csv").write_text(text + "\n", encoding="utf-8")
    return where


def _columns(stranger: Stranger, said: Mapping[str, Array]) -> dict[str, list[str]]:
    """Headers with what is printed below them."""
    a, b = _RADIUS
    e2, s = 1.0 - b * b / (a * a), math.sin(LATITUDE * DEG)
    down = 1.0 - e2 * s * s
    north, east = a * (1.0 - e2) / down**1.5, a / math.sqrt(down) * math.cos(LATITUDE * DEG)
    out = {
        "Latitude [deg]": _printed(LATITUDE + said["x"] / north / DEG, 7),
        "Longitude [deg]": _printed(LONGITUDE + said["y"] / east / DEG, 7),
        "SOG [kn]": _printed(said["sog"] / KN, 2), "COG [deg]": _printed(said["cog"] / DEG % 360.0, 1),
        "Heading [deg]": _printed(said["psi"] / DEG % 360.0, 1), "ROT [deg/min]": _printed(said["r"] / DEG * 60.0, 1),
    }  # fmt: skip
    sides = {"_1": " port", "_2": " starboard"}
    for name in stranger.ship.controls:
        side = sides.get(name[-2:], "")
        if name.startswith("delta"):
            out[f"Rudder angle{side} [deg]"] = _printed(-said[name] / DEG, 1)
        else:
            out[f"Shaft{side} [rpm]"] = _printed(said[name] * 60.0, 1)
    out["Apparent wind speed [m/s]"] = _printed(said["U_A"], 1)
    out["Apparent wind angle [deg]"] = _printed(said["gamma_A"] / DEG % 360.0, 0)
    return out


def _printed(values: Array, digits: int) -> list[str]:
    return [f"{value:.{digits}f}" for value in values]


def sheet(stranger: Stranger, where: Path) -> Path:
    """The file of particulars."""
    lines = ['schema = "seatrial-particulars/1"', f'name = "{stranger.name}"', "[particulars]"]
    lines += [f"{key} = {value!r}" if isinstance(value, int) and key == "screws" else f"{key} = {float(value)!r}"
              for key, value in stranger.particulars.items()]  # fmt: skip
    where.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return where
