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

from .motion import Array, Motion, Weather, acceleration, sail, turning, zigzag
from .ships import FULL, MODEL, Mmg, truth

DEG = math.pi / 180.0
SHIPS = {"full": FULL, "model": MODEL}
WEATHERS = {
    "calm": Weather(),
    "wind": Weather(wind=10.0, wind_from=240.0 * DEG),
    "current": Weather(current=0.5, current_to=70.0 * DEG),
}
"""At full scale; a model has the same by Froude's law."""

# Standard deviation of the noise and steps of the instruments at full scale [SI].
NOISE = {
    "x": 0.5, "y": 0.5, "psi": 0.15 * DEG, "u": 0.05, "v_m": 0.05, "r": 0.1 * DEG / 60.0, "delta": 0.05 * DEG,
    "n_P": 0.001, "U_T": 0.3, "gamma_T": 3.0 * DEG,
}  # fmt: skip
STEPS = {
    "x": 0.01, "y": 0.01, "psi": 0.1 * DEG, "u": 0.01, "v_m": 0.01, "r": 0.1 * DEG / 60.0, "delta": 0.1 * DEG,
    "n_P": 0.1 / 60.0, "U_T": 0.1, "gamma_T": 1.0 * DEG,
}  # fmt: skip
UNITS = {
    "x": "m", "y": "m", "psi": "rad", "u": "m/s", "v_m": "m/s", "r": "rad/s", "delta": "rad", "n_P": "1/s",
    "U_T": "m/s", "gamma_T": "rad", "U_A": "m/s", "gamma_A": "rad", "delta_cmd": "rad",
}  # fmt: skip
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

    ship: Mmg
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
            head = ",".join(["t [s]", *(f"{name} [{UNITS[name]}]" for name in log.table)])
            _table(where / f"{log.name}.csv", head, [log.t, *log.table.values()])
            meta = {"schema": "manoeuvre-trial/1", **self.meta, "kind": log.kind, **log.meta}
            (where / f"{log.name}.yaml").write_text(yaml.safe_dump(meta), encoding="utf-8")
        return where

    def write_raw(self, where: Path) -> Path:
        """Write the tables of a bridge, and `mapping.toml` beside their folder."""
        where.mkdir(parents=True, exist_ok=True)
        for log in self.logs:
            columns = [_on_the_dial(name, values / RAW[UNITS[name]][1]) for name, values in log.table.items()]
            _table(where / f"{log.name}.csv", ",".join(["Time", *log.table]), [log.t, *columns])
        lines = ['schema = "seatrial-mapping/1"', 'time = { column = "Time", unit = "s" }']
        lines += [f"{key} = {value!r}".replace("'", '"') for key, value in self.meta.items()]
        lines.append("[channels]")
        names = self.logs[0].table
        lines += [f'{name} = {{ column = "{name}", unit = "{RAW[UNITS[name]][0]}" }}' for name in names]
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
    """Seven trials of a day: zigzags and turns to both sides, and an acceleration, on several headings."""
    published = SHIPS[ship]
    real, w = truth(published), WEATHERS[weather]
    by_speed, by_time = math.sqrt(published.length / 320.0), math.sqrt(published.length / 320.0)
    w = replace(w, wind=w.wind * by_speed, current=w.current * by_speed)
    n = real.revolutions(published.speed)
    base = float(np.random.default_rng(1000 + seed).uniform(0.0, 2.0 * math.pi))
    plans = [
        ("zigzag_10_s", "zigzag", lambda psi: zigzag(10 * DEG, 10 * DEG, 1, psi, n), 900.0),
        ("zigzag_10_p", "zigzag", lambda psi: zigzag(10 * DEG, 10 * DEG, -1, psi, n), 900.0),
        ("zigzag_20_s", "zigzag", lambda psi: zigzag(20 * DEG, 20 * DEG, 1, psi, n), 1000.0),
        ("zigzag_20_p", "zigzag", lambda psi: zigzag(20 * DEG, 20 * DEG, -1, psi, n), 1000.0),
        ("turning_35_s", "turning", lambda psi: turning(35 * DEG, 1, n), 1200.0),
        ("turning_35_p", "turning", lambda psi: turning(35 * DEG, -1, n), 1200.0),
        ("acceleration", "acceleration", lambda psi: acceleration(0.6 * n, n), 900.0),
    ]
    out: list[tuple[str, str, Motion, float]] = []
    for k, (name, kind, orders, full) in enumerate(plans):
        psi = (base + k * 100.0 * DEG) % (2.0 * math.pi)
        slow = 0.6 if kind == "acceleration" else 1.0
        made = sail(real, orders(psi), w, psi, slow * published.speed, slow * n, full * by_time)
        out.append((name, kind, made, full * by_time))
    return tuple(out)


def clean(ship: str = "full", weather: str = "calm", seed: int = 1, rate: float | None = None) -> Folder:
    """A folder without a fault: ordinary noise and steps.

    Args:
        ship: "full" or "model".
        weather: "calm", "wind" (with a noisy anemometer) or "current".
        seed: of the noise and the headings.
        rate: rows a second; 1 at full scale and 5 for the model by default.
    """
    published = SHIPS[ship]
    rate = rate or (1.0 if ship == "full" else 5.0)
    random = np.random.default_rng([seed, 77])
    logs: list[Log] = []
    for name, kind, motion, duration in motions(ship, weather, seed):
        t = np.arange(round(duration * rate) + 1) / rate
        true = motion.at(t)
        if ship == "full":
            true["U_T"] = np.full(t.size, motion.weather.wind)
            true["gamma_T"] = np.full(t.size, motion.weather.wind_from)
        table: dict[str, Array] = {}
        for channel, values in true.items():
            noise, step = NOISE[channel] * scale(published, channel), STEPS[channel] * scale(published, channel)
            if channel in ("U_T", "gamma_T") and not motion.weather.wind:
                noise = 0.0
            read = values + noise * random.standard_normal(t.size)
            table[channel] = np.round(read / step) * step
        order = ["x", "y", "psi", "u", "v_m", "r", "n_P", "delta", "U_T", "gamma_T"]
        logs.append(Log(name, kind, t, {key: table[key] for key in order if key in table}, motion))
    meta = {"ship": published.name, "L_pp": published.length, "water_density": published.rho}
    return Folder(published, tuple(logs), meta, weather)


def scale(ship: Mmg, channel: str) -> float:
    """Noise of a channel against that of the full scale, by Froude's law."""
    ratio = ship.length / 320.0
    powers = {"m": 1.0, "m/s": 0.5, "rad/s": -0.5, "1/s": -0.5, "rad": 0.0}
    return ratio ** powers[UNITS[channel]]
