"""Readers of the KVLCC2 free-running tests of SIMMAN 2008: HSVA (model scale) and MARIN (full scale).

Both label earth-fixed velocities as the ship's, and count a rudder to port positive; the reader
converts both and notes it in the sidecar.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from .. import Array, DataError, Trial, unwrapped
from ..prepare import integral, to_body
from ..sidecar import CONVENTIONS
from ..table import check_time, lines_of, numbers

name = "simman"
suffixes = (".dat",)
HSVA_COLUMNS = (
    "t [s]", "x0 [m]", "y0 [m]", "psi [deg]", "dx0/dt [m/s]", "dy0/dt [m/s]", "r [deg/s]", "roll [?]",
    "delta [deg]", "n [1/s]", "thrust [N]", "torque [N m]",
)  # fmt: skip
MARIN_COLUMNS = (
    "t [s]", "x0 [m]", "y0 [m]", "heel [deg]", "psi [deg]", "dx0/dt [m/s]", "dy0/dt [m/s]", "p [deg/s]",
    "r [deg/s]", "delta [deg]", "n [rpm]",
)  # fmt: skip
MARIN_STEP = 0.1353
"""Nominal logging step [s] of the MARIN files; their three digits cannot represent it after 100 s."""

_META = MappingProxyType({**CONVENTIONS, "licence": "none stated; do not redistribute"})
_HSVA_META = MappingProxyType({
    "ship": "kvlcc2_l7", "scale": 45.714, "L_pp": 7.0, **_META, "water_density": 1000.0,
    "source": "HSVA 2006, SIMMAN 2008 workshop, KVLCC2 free running (CPMC)",
})  # fmt: skip
_MARIN_META = MappingProxyType({
    "ship": "kvlcc2", "scale": 1.0, "L_pp": 320.0, **_META, "water_density": 1025.0,
    "source": "MARIN 2007, SIMMAN 2008 workshop, KVLCC2 free running, scaled to the ship",
})  # fmt: skip


def read(source: Path, mapping: None = None) -> Trial:
    """Read one .dat file of SIMMAN 2008; its first line distinguishes HSVA and MARIN."""
    here = Path(source)
    lines = lines_of(here, "cp1252")
    if lines[0].strip().startswith("HSVA"):
        return _hsva(here, lines)
    if lines[0].strip().startswith("MARIN"):
        return _marin(here, lines)
    raise DataError(f"{here}: line 1: '{lines[0].strip()[:40]}'; a SIMMAN 2008 file begins with 'HSVA' or 'MARIN'")


def _hsva(path: Path, lines: Sequence[str]) -> Trial:
    table, numbered = numbers(path, lines, 4, HSVA_COLUMNS, None)
    t, x, y, psi, dx, dy, r, _, delta, n, thrust, torque = table.T
    check_time(path, "t [s]", t, numbered)
    psi = unwrapped(np.radians(psi))
    u, v_m = to_body(dx, dy, psi)
    channels = {
        "x": x, "y": y, "psi": psi, "u": u, "v_m": v_m, "r": np.radians(r), "delta": -np.radians(delta),
        "n_P": n, "thrust": thrust, "torque": torque,
    }  # fmt: skip
    title = re.search(r"Z[_ ]?(\d+)[^/]*/(\d+)", lines[2])
    meta = {**_HSVA_META, **_zigzag(title), "processing": _steps("columns 5, 6")}
    return _trial(path, t, channels, {"thrust": "N", "torque": "N m"}, meta)


def _marin(path: Path, lines: Sequence[str]) -> Trial:
    table, _ = numbers(path, lines, 3, MARIN_COLUMNS, "\t")
    logged, _, _, heel, psi, dx, dy, p, r, delta, n = table.T
    t, step = _rebuilt(path, logged)
    psi = unwrapped(np.radians(psi))
    u, v_m = to_body(dx, dy, psi)
    channels = {
        "x": integral(t, dx), "y": integral(t, dy), "psi": psi, "u": u, "v_m": v_m, "r": np.radians(r),
        "delta": -np.radians(delta), "n_P": n / 60.0, "phi": np.radians(heel), "p": np.radians(p),
    }  # fmt: skip
    title = re.search(r"(-?\d+)\s*/\s*(-?\d+)", lines[1]) if "zig" in lines[1].lower() else None
    kind = "turning" if "turn" in lines[1].lower() else "free"
    known = _zigzag(title) if title else {"kind": kind}
    steps = [
        *_steps("columns 6, 7"),
        f"time rebuilt as k * {step:.6g} s: the column is rounded to three digits",
        "x, y integrated from the velocities: the columns are rounded to three digits",
    ]
    return _trial(path, t, channels, {}, {**_MARIN_META, **known, "processing": steps})


def _zigzag(title: re.Match[str] | None) -> dict[str, Any]:
    """Kind and set points of a zigzag by the rudder and heading [deg] in its title."""
    if title is None:
        return {"kind": "zigzag"}
    rudder, heading = (float(np.radians(abs(float(angle)))) for angle in title.groups())
    return {"kind": "zigzag", "set_points": {"rudder": rudder, "heading": heading}}


def _steps(columns: str) -> list[str]:
    return [
        f"{columns} are earth-fixed velocities: turned into body axes by psi",
        "rudder sign turned: positive to starboard",
        "degrees to radians, revolutions to 1/s, psi made continuous",
    ]


def _trial(path: Path, t: Array, channels: dict[str, Array], units: dict[str, str], meta: dict[str, Any]) -> Trial:
    own = {name: np.ascontiguousarray(values) for name, values in channels.items()}
    return Trial(path.stem, np.ascontiguousarray(t), own, units, meta)


def _rebuilt(path: Path, logged: Array) -> tuple[Array, float]:
    """Even time k * step with the step that fits the rounded column best, and that step."""
    if logged.size < 2 or not np.isfinite(logged).all():
        raise DataError(f"{path}: column 't [s]': needs a time in each of at least 2 rows")
    if (np.diff(logged) < 0).any():
        line = int(np.flatnonzero(np.diff(logged) < 0)[0]) + 5
        raise DataError(f"{path}: column 't [s]', line {line}: time goes back; it must not")
    k = np.arange(logged.size, dtype=np.float64)
    step = float(k @ logged / (k @ k))
    if not 0.9 * MARIN_STEP < step < 1.1 * MARIN_STEP and logged.size > 10:
        raise DataError(f"{path}: column 't [s]': mean step {step:.5g} s; that of the MARIN files is {MARIN_STEP} s")
    return k * step, step
