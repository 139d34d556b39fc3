"""A turning ship in steady wind, exactly, as tests of mappings write it in many shapes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from seatrial.data import Trial
from seatrial.data.geodesy import Datum
from seatrial.data.mapping.checked import read_mapping
from seatrial.data.mapping.reading import read

DATUM = Datum(63.44, 10.42)
START = np.datetime64("2025-04-11T11:51:10", "ns")
SCHEMA = 'schema = "seatrial-mapping/1"\n'


def truth(dt: float = 0.5, duration: float = 120.0, begin: float = 0.0) -> Trial:
    """Surge 3 m/s, sway -0.4 m/s, a turn of 2 deg/s and a wind of 8 m/s from 30 deg; at midship."""
    t = begin + dt * np.arange(round(duration / dt) + 1)
    r = np.radians(2.0)
    psi = np.radians(300.0) + r * t
    c, s = (np.sin(psi) - np.sin(psi[0])) / r, (np.cos(psi[0]) - np.cos(psi)) / r
    u, v = np.full(t.size, 3.0), np.full(t.size, -0.4)
    beta = np.radians(30.0) - psi
    ahead, aside = 8.0 * np.cos(beta) + u, 8.0 * np.sin(beta) + v
    return Trial("turn", t, {
        "x": 3.0 * c + 0.4 * s, "y": 3.0 * s - 0.4 * c, "psi": psi, "u": u, "v_m": v, "r": np.full(t.size, r),
        "delta": np.radians(np.where(t < 10.0, -20.0, 20.0)), "n_P": 2.0 + 0.01 * t, "U_A": np.hypot(ahead, aside),
        "gamma_A": np.arctan2(aside, ahead), "U_T": np.full(t.size, 8.0), "gamma_T": np.full(t.size, np.radians(30.0)),
    })  # fmt: skip


def fixes(trial: Trial, forward: float = 0.0, starboard: float = 0.0) -> tuple[list[float], list[float]]:
    """Latitudes and longitudes [deg] of a point of the ship."""
    c, s = np.cos(trial["psi"]), np.sin(trial["psi"])
    x, y = trial["x"] + c * forward - s * starboard, trial["y"] + s * forward + c * starboard
    pairs = [DATUM.place(a, b) for a, b in zip(x.tolist(), y.tolist(), strict=True)]
    return [a for a, _ in pairs], [b for _, b in pairs]


def at(t: float, form: str = "iso") -> str:
    """A time of the log as text, to the nanosecond."""
    text = str(START + np.timedelta64(round(t * 1e9), "ns"))
    return text if form == "iso" else text.partition("T")[2]


def table(path: Path, columns: dict[str, Sequence[object]], separator: str = ",", encoding: str = "utf-8") -> Path:
    """A text table of columns."""
    rows = [separator.join(columns), *(separator.join(map(str, row)) for row in zip(*columns.values(), strict=True))]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(("\n".join(rows) + "\n").encode(encoding))
    return path


def trials(source: Path, mapping: str) -> tuple[Trial, ...]:
    """The trials of a recording by the text of a mapping, without its schema."""
    file = source.parent / "mapping.toml"
    file.write_text(SCHEMA + mapping, encoding="utf-8")
    return read(source, read_mapping(file))
