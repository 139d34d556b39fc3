"""From the readings of an NMEA log to the channels of a trial: datum, lever arms, body axes.

A mapping file tells where the instruments are; all of it may be left out:

    schema = "seatrial-nmea/1"
    antenna = { forward = 12.5, starboard = -2.0 }   # m from midship
    log = { forward = 60.0 }
    datum = { latitude = 35.0, longitude = 139.5 }   # else the first fix
    L_pp = 150.0
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .. import Array, Trial, unwrapped
from ..geodesy import Datum
from ..sidecar import CONVENTIONS, check_meta
from .nmea_log import on_rows, read_told, told_meta


@dataclass(frozen=True)
class Aboard:
    """Where the instruments of a log are.

    Attributes:
        antenna: of the GNSS receiver, forward and to starboard of midship [m].
        log: of the speed log, forward of midship [m].
        datum: where x and y are zero; None for the first fix.
        meta: what goes into the sidecar.
    """

    antenna: tuple[float, float] = (0.0, 0.0)
    log: float = 0.0
    datum: Datum | None = None
    meta: Mapping[str, Any] = field(default_factory=dict[str, Any])


def read_aboard(path: Path) -> Aboard:
    """Read the mapping file of an NMEA log.

    Raises:
        DataError: not TOML, an unknown key (the near ones are named), a wrong type.
    """
    from .nmea_schema import checked

    said = checked(path)
    datum = said["datum"]
    antenna, log = said["antenna"], said["log"]
    meta = {k: v for k, v in said.items() if k not in ("antenna", "log", "datum", "schema_") and v is not None}
    check_meta(path, meta)
    return Aboard(
        (antenna["forward"], antenna["starboard"]), log["forward"],
        None if datum is None else Datum(datum["latitude"], datum["longitude"]), meta,
    )  # fmt: skip


def read(path: Path, aboard: Aboard | None = None) -> Trial:
    """Read one log.

    Raises:
        DataError: what is wrong with it, and where.
    """
    aboard = aboard or Aboard()
    told = read_told(path)
    t, raw, steps = on_rows(path, told)
    steps = [f"imported from NMEA 0183 sentences: {', '.join(sorted(raw))}", *told.steps, *steps]
    channels: dict[str, Array] = {}
    psi = unwrapped(raw["psi"]) if "psi" in raw else np.full(len(t), math.nan)
    r = raw["r"] if "r" in raw else _rate(t, psi, steps)
    if "psi" in raw:
        channels["psi"] = psi
    datum = _positions(channels, raw, psi, aboard, steps)
    _velocities(channels, raw, psi, r, aboard, steps)
    channels["r"] = r
    _controls(channels, raw, steps)
    _around(channels, raw, psi)
    where = {} if datum is None else {"datum": {"latitude": datum.latitude, "longitude": datum.longitude}}
    said = {**told_meta(told, float(t[0])), **where, **aboard.meta}
    meta = {**CONVENTIONS, **said, "lines": dict(told.lines), "processing": steps}
    known = {name: values for name, values in channels.items() if np.isfinite(values).any()}
    # seconds since 1970 are told to a quarter of a microsecond only
    return Trial(path.stem, np.round(t - t[0], 6), known, {}, meta)


def _rate(t: Array, psi: Array, steps: list[str]) -> Array:
    if np.isfinite(psi).sum() < 2:
        return np.full(len(t), math.nan)
    steps.append("no ROT: r by central differences of psi")
    return np.gradient(psi, t)


def _positions(
    channels: dict[str, Array], raw: Mapping[str, Array], psi: Array, aboard: Aboard, steps: list[str]
) -> Datum | None:
    if "latitude" not in raw or "longitude" not in raw:
        return aboard.datum
    latitude, longitude = raw["latitude"], raw["longitude"]
    good = np.flatnonzero(np.isfinite(latitude + longitude))
    if not good.size:
        return aboard.datum
    datum = aboard.datum or Datum(float(latitude[good[0]]), float(longitude[good[0]]))
    x, y = (np.full(len(psi), math.nan) for _ in range(2))
    for k in good.tolist():
        x[k], y[k] = datum.north_east(float(latitude[k]), float(longitude[k]))
    forward, starboard = aboard.antenna
    if forward or starboard:
        c, s = np.cos(psi), np.sin(psi)
        x, y = x - (c * forward - s * starboard), y - (s * forward + c * starboard)
        steps.append(f"x, y from the antenna to midship: {forward:g} m forward, {starboard:g} m to starboard")
    else:
        steps.append("x, y are those of the antenna; midship is taken to be there")
    channels["x"], channels["y"] = x, y
    return datum


def _velocities(
    channels: dict[str, Array], raw: Mapping[str, Array], psi: Array, r: Array, aboard: Aboard, steps: list[str]
) -> None:
    """Velocities over ground at midship: by VBW, else by course and speed of the antenna."""
    if "u_log" in raw and "v_log" in raw:
        channels["u"], channels["v_m"] = raw["u_log"], raw["v_log"] - aboard.log * r if aboard.log else raw["v_log"]
    elif "U_G" in raw and "gamma_G" in raw:
        drift, (forward, starboard) = raw["gamma_G"] - psi, aboard.antenna
        u, v = raw["U_G"] * np.cos(drift), raw["U_G"] * np.sin(drift)
        channels["u"] = u + starboard * r if starboard else u
        channels["v_m"] = v - forward * r if forward else v
        steps.append("u, v_m from course and speed over ground, turned by psi")
    if "U_G" in raw and "gamma_G" in raw:
        channels["U_G"], channels["gamma_G"] = raw["U_G"], unwrapped(raw["gamma_G"])


def _controls(channels: dict[str, Array], raw: Mapping[str, Array], steps: list[str]) -> None:
    """Rudders and shafts, numbered port to starboard where there are several; engines where no shaft is told of."""
    for name in ("delta", "delta_cmd"):
        starboard, port = raw.get(name), raw.get(name.replace("delta", "delta_port"))
        suffix = name.removeprefix("delta")
        if port is not None and starboard is not None:
            channels[f"delta_1{suffix}"], channels[f"delta_2{suffix}"] = port, starboard
        elif starboard is not None:
            channels[name] = starboard
    told = [name for name in raw if name.startswith("rpm_")]
    of = "rpm_S_" if any(name.startswith("rpm_S_") for name in told) else "rpm_E_"
    numbers = [int(name.removeprefix(of)) for name in told if name.startswith(of)]
    if told and of == "rpm_E_":
        steps.append("revolutions are those of the engine; the shaft is taken to turn as fast")
    elif len(numbers) < len(told):
        steps.append("revolutions are those of the shaft; what RPM says of the engine is left out")
    for place, number in enumerate(sorted(numbers, key=lambda k: k if k % 2 else -k), 1):
        channels["n_P" if len(numbers) == 1 else f"n_P_{place}"] = raw[f"{of}{number}"] / 60.0


def _around(channels: dict[str, Array], raw: Mapping[str, Array], psi: Array) -> None:
    for name in ("U_A", "gamma_A", "U_T", "depth"):
        if name in raw:
            channels[name] = raw[name]
    if "gamma_T_bow" in raw:
        channels["gamma_T"] = np.mod(raw["gamma_T_bow"] + psi, 2.0 * math.pi)
