"""Logs of motions: what ordinary instruments write, folders of them, and the same as files.

A fault changes a `Folder`; `Folder.write` makes trial files (CSV and sidecar), `Folder.write_raw` the tables of a
bridge in degrees, knots and rpm with the mapping file that reads them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from .fleet import DEG, FLEET, UNITS
from .motion import Array, Motion, sail
from .ships import Ship, revolutions, truth

RAW = {"m": ("m", 1.0), "rad": ("deg", DEG), "m/s": ("kn", 1852 / 3600), "rad/s": ("deg/min", DEG / 60),
       "1/s": ("rpm", 1 / 60)}  # fmt: skip


@dataclass(frozen=True)
class Log:
    """One recording: time, channels in SI as the instruments gave them, and what truly happened."""

    name: str
    kind: str
    t: Array
    table: Mapping[str, Array]
    motion: Motion
    meta: Mapping[str, Any] = field(default_factory=dict)

    def having(self, **channels: Array) -> Log:
        return replace(self, table={**self.table, **channels})

    def rows(self, index: Any) -> Log:
        return replace(self, t=self.t[index], table={name: values[index] for name, values in self.table.items()})

    def true(self, name: str, late: float = 0.0) -> Array:
        """The true values of a channel, as they were `late` seconds before each row."""
        return self.motion.at(self.t - late)[name]


@dataclass(frozen=True)
class Folder:
    """Logs of a day of trials of one ship."""

    ship: Ship
    logs: tuple[Log, ...]
    meta: Mapping[str, Any]
    weather: str = "calm"

    def each(self, change: Callable[[Log], Log], only: str = "") -> Folder:
        """The folder with every log (of the kind) changed."""
        return replace(self, logs=tuple(change(log) if only in log.name else log for log in self.logs))

    def write(self, where: Path) -> Path:
        """Write trial files."""
        where.mkdir(parents=True, exist_ok=True)
        for log in self.logs:
            head = ",".join(["t [s]", *(f"{name} [{unit(name)}]" for name in log.table)])
            _table(where / f"{log.name}.csv", head, [log.t, *log.table.values()])
            meta = {"schema": "manoeuvre-trial/1", **self.meta, "kind": log.kind, **log.meta}
            (where / f"{log.name}.yaml").write_text(yaml.safe_dump(meta), encoding="utf-8")
        return where

    def write_raw(self, where: Path) -> Path:
        """Write the tables of a bridge, and `mapping.toml` beside their folder."""
        where.mkdir(parents=True, exist_ok=True)
        for log in self.logs:
            columns = [_on_the_dial(name, values / RAW[unit(name)][1]) for name, values in log.table.items()]
            _table(where / f"{log.name}.csv", ",".join(["Time", *log.table]), [log.t, *columns])
        lines = ['schema = "seatrial-mapping/1"', 'time = { column = "Time", unit = "s" }']
        lines += [f"{key} = {value!r}".replace("'", '"') for key, value in self.meta.items()]
        lines.append("[channels]")
        names = self.logs[0].table
        lines += [f'{name} = {{ column = "{name}", unit = "{RAW[unit(name)][0]}" }}' for name in names]
        path = where.with_name(f"{where.name}.toml")
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path


def _on_the_dial(name: str, values: Array) -> Array:
    """A compass shows 0 to 360 deg; what is far beyond any number of turns is in another unit and stays."""
    return values % 360.0 if name == "psi" and np.nanmax(np.abs(values)) < 3600.0 else values


def _table(path: Path, head: str, columns: list[Array]) -> None:
    rows = zip(*(column.tolist() for column in columns), strict=True)
    text = "\n".join(",".join("" if v != v else f"{v:.9g}" for v in row) for row in rows)
    path.write_text(f"{head}\n{text}\n", encoding="utf-8")


@lru_cache(maxsize=64)
def motions(ship: str, weather: str, seed: int) -> tuple[tuple[str, str, Motion, float], ...]:
    """The trials of a day, on several headings."""
    vessel = FLEET[ship]
    real = truth(vessel.ship)
    base = float(np.random.default_rng(1000 + seed).uniform(0.0, 2.0 * math.pi))
    out: list[tuple[str, str, Motion, float]] = []
    for k, plan in enumerate(vessel.plans(vessel.ship, revolutions(real, vessel.ship.speed))):
        psi = (base + k * 100.0 * DEG) % (2.0 * math.pi)
        made = sail(real, plan.orders(psi), vessel.weathers[weather], psi, plan.speed, plan.begin, plan.duration)
        out.append((plan.name, plan.kind, made, plan.duration))
    return tuple(out)


def clean(ship: str = "full", weather: str = "calm", seed: int = 1, rate: float | None = None) -> Folder:
    """A folder without a fault: ordinary noise and steps.

    Args:
        ship: of `FLEET`.
        weather: "calm", "wind" (with a noisy anemometer) or "current".
        seed: of the noise and the headings.
        rate: rows a second; None takes that of the ship.
    """
    vessel = FLEET[ship]
    published, rate = vessel.ship, rate or vessel.rate
    random = np.random.default_rng([seed, 77])
    logs: list[Log] = []
    for name, kind, motion, duration in motions(ship, weather, seed):
        t = np.arange(round(duration * rate) + 1) / rate
        true = motion.at(t)
        if published.areas is not None:
            true["U_T"] = np.full(t.size, motion.weather.wind)
            true["gamma_T"] = np.full(t.size, motion.weather.wind_from)
        table: dict[str, Array] = {}
        order = [*true][:6] + sorted(published.controls) + [*true][6 + len(published.controls) :]
        by_froude = vessel.noise is FLEET["full"].noise
        for channel in order:
            size = scale(published, channel) if by_froude else 1.0
            noise, step = vessel.noise[_plain(channel)] * size, vessel.steps[_plain(channel)] * size
            if channel in ("U_T", "gamma_T") and not motion.weather.wind:
                noise = 0.0
            read = true[channel] + noise * random.standard_normal(t.size)
            table[channel] = np.round(read / step) * step
        logs.append(Log(name, kind, t, {key: table[key] for key in true}, motion))
    meta = {"ship": published.name, "L_pp": published.length, "water_density": published.rho}
    return Folder(published, tuple(logs), meta, weather)


def _plain(channel: str) -> str:
    """A channel without the number of its shaft, rudder or thruster."""
    return channel.removesuffix("_1").removesuffix("_2")


def unit(channel: str) -> str:
    return UNITS[_plain(channel)]


def scale(ship: Ship, channel: str) -> float:
    """Noise of a channel against that of the full scale, by Froude's law."""
    ratio = ship.length / 320.0
    powers = {"m": 1.0, "m/s": 0.5, "rad/s": -0.5, "1/s": -0.5, "rad": 0.0}
    return ratio ** powers[unit(channel)]
