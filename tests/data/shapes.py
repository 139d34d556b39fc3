"""One truth in many shapes: logs as instruments, bridges and laboratories write them, made for tests of the guess.

`sailed` makes a trial that is right by construction; each function of `SHAPES` writes it into a folder in one shape and
gives what an import must find: channels in SI with the size of their last digit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatrial.data import Trial
from seatrial.data.geodesy import Datum
from workbooks import write_workbook

Array = NDArray[np.float64]
KN, DEG = 1852.0 / 3600.0, math.pi / 180.0
START = datetime(2024, 5, 14, 9, 30, 12, 250000, tzinfo=timezone(timedelta(hours=2)))
DATUM = Datum(63.4412, 10.4199)


@dataclass(frozen=True)
class Sailed:
    """What truly happened, and what the instruments read: channels in SI on times `t`."""

    t: Array
    values: Mapping[str, Array]
    latitude: Array
    longitude: Array

    def __getitem__(self, name: str) -> Array:
        return self.values[name]

    @property
    def sog(self) -> Array:
        return np.hypot(self["u"], self["v_m"])

    @property
    def cog(self) -> Array:
        return (self["psi"] + np.arctan2(self["v_m"], self["u"])) % (2 * math.pi)

    @property
    def north(self) -> Array:
        return self["u"] * np.cos(self["psi"]) - self["v_m"] * np.sin(self["psi"])

    @property
    def east(self) -> Array:
        return self["u"] * np.sin(self["psi"]) + self["v_m"] * np.cos(self["psi"])

    def rows(self, index: Any) -> Sailed:
        values = {name: one[index] for name, one in self.values.items()}
        return Sailed(self.t[index], values, self.latitude[index], self.longitude[index])


@dataclass(frozen=True)
class Expected:
    """What an import of a shape must find, by the name of the trial's file: channels with their last digit."""

    trials: Mapping[str, tuple[Sailed, Mapping[str, float]]]


def sailed(
    L: float = 80.0, U: float = 6.0, n: float = 2.0, seed: int = 1, duration: float = 600.0, dt: float = 0.5,
    wind: float = 0.0, current: float = 0.0, noise: float = 0.0, rudder: float = 20.0, psi_0: float = 0.7,
) -> Sailed:  # fmt: skip
    """A ship of length L under rudder orders that change at random, its revolutions in two steps."""
    hand = np.random.default_rng(seed)
    t = np.arange(0.0, duration, dt)
    unit = L / U
    orders = (
        np.repeat(hand.choice([-1.0, -0.5, 0.0, 0.5, 1.0], t.size), max(round(1.5 * unit / dt), 1))[: t.size]
        * rudder
        * DEG
    )
    delta, r = np.zeros(t.size), np.zeros(t.size)
    for k in range(t.size - 1):
        delta[k + 1] = delta[k] + np.clip(orders[k] - delta[k], -0.05 * dt * 20 / unit * 3, 0.05 * dt * 20 / unit * 3)
        r[k + 1] = r[k] + dt * (1.1 / unit * delta[k] - r[k] * (1.0 + 0.3 * abs(r[k]) * unit)) / unit
    psi = psi_0 + _sum(r, t)
    n_P = np.where(t < 0.5 * duration, n, 0.8 * n) + 0.01 * n * np.sin(t / unit)
    u_w = U * n_P / n * (1.0 - 0.25 * np.clip(np.abs(r) * unit, 0.0, 1.0)) + 0.03 * U * np.sin(t / (7 * unit))
    v_w = -0.35 * L * r
    to = 2.1
    u = u_w + current * np.cos(to - psi)
    v = v_w + current * np.sin(to - psi)
    x, y = _sum(u * np.cos(psi) - v * np.sin(psi), t), _sum(u * np.sin(psi) + v * np.cos(psi), t)
    U_T = wind * (1.0 + 0.08 * np.sin(t / (2 * unit))) + 1e-9
    gamma_T = 4.2 + 0.05 * np.sin(t / (3 * unit))
    ahead, aside = U_T * np.cos(gamma_T - psi) + u, U_T * np.sin(gamma_T - psi) + v
    values = {"x": x, "y": y, "psi": psi, "u": u, "v_m": v, "r": r, "delta": delta, "n_P": n_P, "U_T": U_T,
              "gamma_T": gamma_T, "U_A": np.hypot(ahead, aside), "gamma_A": np.arctan2(aside, ahead)}  # fmt: skip
    scatter = {"x": 0.003 * L, "y": 0.003 * L, "psi": 0.004, "u": 0.01 * U, "v_m": 0.01 * U, "r": 0.02 / unit,
               "delta": 0.004, "n_P": 0.003 * n, "U_A": 0.05 * wind, "gamma_A": 0.02}  # fmt: skip
    for name, size in scatter.items():
        values[name] = values[name] + noise * size * hand.standard_normal(t.size)
    places = np.array([DATUM.place(a, b) for a, b in zip(values["x"], values["y"], strict=True)])
    return Sailed(t, values, places[:, 0], places[:, 1])


def _sum(rate: Array, t: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])


COASTER: Mapping[str, Any] = {"wind": 8.0, "current": 0.4, "noise": 0.5}
MODEL: Mapping[str, Any] = {"L": 3.0, "U": 0.55, "n": 10.0, "duration": 150.0, "dt": 0.1, "noise": 0.3, "wind": 0.7}


@dataclass
class Sheet:
    """Columns of text, and how they are put into a file."""

    heads: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    cells: list[list[str]] = field(default_factory=list)
    mark: str = "."

    def put(self, head: str, values: Array | Sequence[str], digits: int = 6, unit: str = "") -> Sheet:
        self.heads.append(head)
        self.units.append(unit)
        said = [one if isinstance(one, str) else f"{one:.{digits}f}".replace(".", self.mark) for one in values]
        self.cells.append(said)
        return self

    def lines(self, delimiter: str = ",", units: bool = False) -> list[str]:
        rows = list(zip(*self.cells, strict=True))
        return [delimiter.join(row) for row in [self.heads, *([self.units] if units else []), *rows]]

    def write(
        self, path: Path, delimiter: str = ",", encoding: str = "utf-8", above: Sequence[str] = (), units: bool = False
    ) -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join([*above, *self.lines(delimiter, units)]) + "\n", encoding=encoding)
        return path


def stamps(t: Array, form: str = "iso", start: datetime = START) -> list[str]:
    out: list[str] = []
    for one in t.tolist():
        when = start + timedelta(seconds=round(one, 6))
        if form == "iso":
            out.append(when.isoformat(timespec="milliseconds"))
        elif form == "utc":
            out.append(when.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%f")[:-3] + "Z")
        else:
            out.append(when.strftime(form)[:-3] if form.endswith("%f") else when.strftime(form))
    return out


def compass(psi: Array) -> Array:
    return np.degrees(psi) % 360.0


def ground_digits(log: Sailed, speed: float, course: float, heading: float) -> dict[str, float]:
    """Last digits of u and v_m that come from speed, course and heading."""
    most = float(log.sog.max())
    one = speed + most * (course + heading)
    return {"u": one, "v_m": one}


def bridge(log: Sailed, speed: float = 0.001 * KN) -> dict[str, float]:
    """Last digits of a log with 1 cm of position, 0.01 deg of heading and course."""
    return {"x": 0.01, "y": 0.01, "psi": 0.01 * DEG, **ground_digits(log, speed, 0.01 * DEG, 0.01 * DEG)}


def _only(path: Path, log: Sailed, digits: Mapping[str, float]) -> Expected:
    return Expected({path.stem: (log, digits)})


def astray(trial: Trial, log: Sailed, digits: Mapping[str, float]) -> dict[str, float]:
    """Channels that are not the truth within their last digits, with what they miss in these; empty where all are."""
    if len(trial) != log.t.size:
        return {"rows": float(len(trial))}
    out: dict[str, float] = {}
    for name, digit in digits.items():
        if name not in trial:
            out[name] = math.inf
            continue
        lost = trial[name] - log[name]
        if name in ("x", "y"):  # from any datum
            lost = lost - np.nanmedian(lost)
        if name in ("psi", "gamma_A", "gamma_T"):
            lost = np.arctan2(np.sin(lost), np.cos(lost))
        good = np.isfinite(lost)
        if good.mean() < 0.9 or np.abs(lost[good]).max() > digit:
            out[name] = float(np.abs(lost[good]).max() / digit) if good.mean() >= 0.9 else math.inf
    return out


SHAPES: dict[str, Callable[[Path], Expected]] = {}


def shape(make: Callable[[Path], Expected]) -> Callable[[Path], Expected]:
    SHAPES[make.__name__] = make
    return make


@shape
def iso_with_zone(folder: Path) -> Expected:
    """ISO time with zone, latitude and longitude, SOG and COG in the units of a bridge."""
    log = sailed(**COASTER)
    sheet = Sheet().put("Time", stamps(log.t)).put("Lat", log.latitude, 8).put("Lon", log.longitude, 8)
    sheet.put("HDG", compass(log["psi"]), 2).put("SOG", log.sog / KN, 3).put("COG", np.degrees(log.cog), 2)
    sheet.put("RUD", np.degrees(log["delta"]), 2).put("RPM", 60 * log["n_P"], 2)
    path = sheet.write(folder / "voyage.csv")
    return _only(path, log, {**bridge(log),
                             "delta": 0.01 * DEG, "n_P": 0.01 / 60})  # fmt: skip


@shape
def clock_of_the_day(folder: Path) -> Expected:
    """hh:mm:ss across midnight, everything else in SI with the field's symbols."""
    log = sailed(**MODEL)
    late = START.replace(hour=23, minute=59, second=20)
    sheet = Sheet().put("clock", stamps(log.t, "%H:%M:%S.%f", late))
    for name in ("x", "y", "psi", "u", "v", "r", "delta", "n"):
        sheet.put(name, log[{"v": "v_m", "n": "n_P"}.get(name, name)], 5)
    path = sheet.write(folder / "basin.csv")
    return _only(path, log, dict.fromkeys(("x", "y", "psi", "u", "v_m", "r", "delta", "n_P"), 1e-5))


@shape
def epoch_milliseconds(folder: Path) -> Expected:
    """Unix time in ms, velocities north and east, the rate of turn in deg/min."""
    log = sailed(**COASTER, seed=2)
    sheet = Sheet().put("timestamp", [f"{round((START.timestamp() + one) * 1000)}" for one in log.t])
    sheet.put("latitude", log.latitude, 8).put("longitude", log.longitude, 8).put("heading", compass(log["psi"]), 2)
    sheet.put("v_north", log.north, 4).put("v_east", log.east, 4).put("ROT", np.degrees(log["r"]) * 60, 3)
    sheet.put("rudder_deg", np.degrees(log["delta"]), 3).put("shaft_rpm", log["n_P"] * 60, 2)
    path = sheet.write(folder / "log.csv")
    one = 1e-4 + 7 * 0.01 * DEG
    return _only(path, log, {"x": 0.01, "y": 0.01, "psi": 0.01 * DEG, "u": one, "v_m": one, "r": 0.001 * DEG / 60,
                             "delta": 0.001 * DEG, "n_P": 0.01 / 60})  # fmt: skip


@shape
def gps_week(folder: Path) -> Expected:
    """GPS week and seconds, degrees and minutes in one number with letters beside them."""
    log = sailed(**COASTER, seed=3)
    sheet = Sheet().put("Week", ["2314"] * log.t.size).put("TOW", 207030.25 + log.t, 3)
    for name, letter, values, width in (("Lat", "N", log.latitude, 2), ("Lon", "E", log.longitude, 3)):
        whole = np.floor(values)
        cells = [f"{int(a):0{width}d}{60 * b:09.6f}" for a, b in zip(whole, values - whole, strict=True)]
        sheet.put(name, cells).put(f"{name} {letter}/{'S' if letter == 'N' else 'W'}", [letter] * log.t.size)
    sheet.put("Heading", compass(log["psi"]), 2).put("Speed over ground (kn)", log.sog / KN, 3)
    sheet.put("Course over ground", np.degrees(log.cog), 2).put("Rudder angle", np.degrees(log["delta"]), 2)
    path = sheet.write(folder / "survey.csv")
    return _only(path, log, {**bridge(log), "x": 0.02, "y": 0.02, "delta": 0.01 * DEG})


@shape
def norwegian(folder: Path) -> Expected:
    """Decimal commas, semicolons, Latin-1, Norwegian names."""
    log = sailed(**COASTER, seed=4)
    sheet = Sheet(mark=",").put("Tid [s]", log.t, 2).put("Nord [m]", log["x"], 2).put("Øst [m]", log["y"], 2)
    sheet.put("Kurs [grader]", compass(log["psi"]), 2).put("Fart over grunn [knop]", log.sog / KN, 3)
    sheet.put("Kurs over grunn [grader]", np.degrees(log.cog), 2).put("Rørvinkel", np.degrees(log["delta"]), 2)
    sheet.put("Turtall [o/min]", 60 * log["n_P"], 1).put("Girhastighet [grader/s]", np.degrees(log["r"]), 4)
    path = sheet.write(folder / "prøvetur.csv", ";", "cp1252")
    return _only(path, log, {**bridge(log),
                             "delta": 0.01 * DEG, "n_P": 0.1 / 60, "r": 1e-4 * DEG})  # fmt: skip


@shape
def german(folder: Path) -> Expected:
    """Tabs, decimal commas, date and time in two columns, German names."""
    log = sailed(**COASTER, seed=5)
    sheet = Sheet(mark=",").put("Datum", stamps(log.t, "%d.%m.%Y")).put("Uhrzeit", stamps(log.t, "%H:%M:%S.%f"))
    sheet.put("Breite", log.latitude, 8).put("Länge", log.longitude, 8).put("Kompasskurs", compass(log["psi"]), 2)
    sheet.put("FüG [kn]", log.sog / KN, 3).put("KüG", np.degrees(log.cog), 2).put(
        "Ruderlage", np.degrees(log["delta"]), 2
    )
    sheet.put("Drehzahl [U/min]", 60 * log["n_P"], 2).put("Drehrate [°/min]", 60 * np.degrees(log["r"]), 2)
    path = sheet.write(folder / "fahrt.tsv", "\t")
    return _only(path, log, {**bridge(log),
                             "delta": 0.01 * DEG, "n_P": 0.01 / 60, "r": 0.01 * DEG / 60})  # fmt: skip


@shape
def utf_16(folder: Path) -> Expected:
    """UTF-16 with tabs, as spreadsheets save it."""
    log = sailed(**COASTER, seed=6)
    sheet = (
        Sheet().put("Time (s)", log.t, 2).put("Northing", log["x"] + 7034000, 2).put("Easting", log["y"] + 569000, 2)
    )
    sheet.put("Gyro heading", compass(log["psi"]), 2).put("Surge speed", log["u"], 3).put("Sway speed", log["v_m"], 3)
    sheet.put("Yaw rate", np.degrees(log["r"]), 4).put("Rudder", np.degrees(log["delta"]), 2)
    path = sheet.write(folder / "mru.txt", "\t", "utf-16")
    return _only(
        path,
        log,
        {"x": 0.01, "y": 0.01, "psi": 0.01 * DEG, "u": 1e-3, "v_m": 1e-3, "r": 1e-4 * DEG, "delta": 0.01 * DEG},
    )


@shape
def workbook(folder: Path) -> Expected:
    """A workbook with a title above the header."""
    log = sailed(**COASTER, seed=7, dt=1.0)
    sheet = Sheet().put("DateTime", stamps(log.t, "%Y-%m-%d %H:%M:%S.%f")).put("Latitude", log.latitude, 8)
    sheet.put("Longitude", log.longitude, 8).put("Heading (deg)", compass(log["psi"]), 2).put("SOG (m/s)", log.sog, 3)
    sheet.put("COG (deg)", np.degrees(log.cog), 2).put("Rudder (deg)", np.degrees(log["delta"]), 2)
    rows = [list(row) for row in zip(*sheet.cells, strict=True)]
    folder.mkdir(parents=True, exist_ok=True)
    path = write_workbook(folder / "trial.xlsx", [["Sea trial of 14 May"], ["Ship: made"], sheet.heads, *rows])
    return _only(path, log, {**bridge(log, 0.001),
                             "delta": 0.01 * DEG})  # fmt: skip


@shape
def parquet(folder: Path) -> Expected:
    """Parquet with times as times and numbers as numbers."""
    import polars

    log = sailed(**COASTER, seed=8)
    when = [datetime(2024, 5, 14, 7, 30) + timedelta(seconds=one) for one in log.t.tolist()]
    frame = polars.DataFrame({
        "time_utc": when, "lat": log.latitude, "lon": log.longitude, "heading_rad": log["psi"] % (2 * math.pi),
        "sog_mps": log.sog, "cog_rad": log.cog, "rudder_rad": log["delta"], "shaft_rps": log["n_P"],
    })  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    frame.write_parquet(folder / "drive.parquet")
    return _only(
        folder / "drive.parquet", log, dict.fromkeys(("psi", "u", "v_m", "delta", "n_P"), 1e-8) | {"x": 0.01, "y": 0.01}
    )


@shape
def preamble_and_units(folder: Path) -> Expected:
    """Six lines of preamble, a row of units."""
    log = sailed(**MODEL, seed=9)
    sheet = Sheet().put("Time", log.t, 2, "s").put("X", log["x"], 4, "m").put("Y", log["y"], 4, "m")
    sheet.put("Psi", compass(log["psi"]), 3, "deg").put("U", log["u"], 4, "m/s").put("V", log["v_m"], 4, "m/s")
    sheet.put("R", np.degrees(log["r"]), 4, "deg/s").put("Delta", np.degrees(log["delta"]), 3, "deg").put(
        "N", 60 * log["n_P"], 2, "rpm"
    )
    above = ["Towing tank, free running", "Model: 123, 1:45", "Date: 14.05.2024", "Operator; NN", "", "Remarks: none"]
    path = sheet.write(folder / "run17.csv", ",", "utf-8", above, units=True)
    angles = {"psi": 1e-3 * DEG, "r": 1e-4 * DEG, "delta": 1e-3 * DEG}
    return _only(path, log, {**dict.fromkeys(("x", "y", "u", "v_m"), 1e-4), **angles, "n_P": 0.01 / 60})


@shape
def port_and_starboard(folder: Path) -> Expected:
    """Rudder and apparent wind as "12.3 S" and "4.5 P"."""
    log = sailed(**COASTER, seed=10)
    sheet = Sheet().put("UTC", stamps(log.t, "utc")).put("Latitude", log.latitude, 8).put("Longitude", log.longitude, 8)
    sheet.put("Heading", compass(log["psi"]), 2).put("SOG [kn]", log.sog / KN, 3).put("COG", np.degrees(log.cog), 2)
    for head, values in (("Rudder", np.degrees(log["delta"])), ("Apparent wind angle", np.degrees(log["gamma_A"]))):
        sheet.put(head, [f"{abs(one):.2f} {'S' if one >= 0 else 'P'}" for one in values.tolist()])
    sheet.put("Apparent wind speed [m/s]", log["U_A"], 3)
    path = sheet.write(folder / "bridge.csv")
    return _only(path, log, {**bridge(log),
                             "delta": 0.01 * DEG, "U_A": 1e-3, "gamma_A": 0.01 * DEG})  # fmt: skip


@shape
def words_of_gaps(folder: Path) -> Expected:
    """N/A and -- for gaps, stamps written twice."""
    log = sailed(**COASTER, seed=11)
    gone = np.random.default_rng(3).random(log.t.size) < 0.03
    cells = [f"{one:.2f}" for one in np.degrees(log["delta"]).tolist()]
    cells = ["N/A" if gap else cell for gap, cell in zip(gone, cells, strict=True)]
    twice = np.sort(np.concatenate([np.arange(log.t.size), np.arange(40, log.t.size, 97)]))
    sheet = Sheet().put("Time", stamps(log.t)).put("Lat", log.latitude, 8).put("Lon", log.longitude, 8)
    sheet.put("HDG", compass(log["psi"]), 2).put("SOG", log.sog / KN, 3).put("COG", np.degrees(log.cog), 2).put(
        "Rudder", cells
    )
    sheet.put("RPM", ["--" if k % 50 == 7 else f"{60 * one:.2f}" for k, one in enumerate(log["n_P"].tolist())])
    sheet.cells = [[column[k] for k in twice.tolist()] for column in sheet.cells]
    path = sheet.write(folder / "gappy.csv")
    return _only(path, log, {**bridge(log),
                             "delta": 0.01 * DEG, "n_P": 0.01 / 60})  # fmt: skip


@shape
def degrees_and_minutes(folder: Path) -> Expected:
    """Latitude and longitude as 63° 26.472' N."""
    log = sailed(**COASTER, seed=12)
    sheet = Sheet().put("Time", stamps(log.t, "utc"))
    for head, letter, values in (("Latitude", "N", log.latitude), ("Longitude", "E", log.longitude)):
        whole = np.floor(values)
        sheet.put(head, [f"{int(a)}° {60 * b:.6f}' {letter}" for a, b in zip(whole, values - whole, strict=True)])
    sheet.put("Heading", compass(log["psi"]), 2).put("SOG", log.sog, 3).put("COG", np.degrees(log.cog), 2)
    sheet.put("Rudder order", np.degrees(log["delta"]), 2).put("Rudder", np.degrees(log["delta"]), 2)
    path = sheet.write(folder / "ecdis.csv")
    return _only(
        path,
        log,
        {
            **bridge(log, 0.001),
            "delta": 0.01 * DEG,
        },
    )


@shape
def apparent_wind_only(folder: Path) -> Expected:
    """Apparent wind in knots from 0 to 360, no unit anywhere."""
    log = sailed(**COASTER, seed=13)
    sheet = Sheet().put("time", stamps(log.t, "utc")).put("lat", log.latitude, 8).put("lon", log.longitude, 8)
    sheet.put("hdg", compass(log["psi"]), 2).put("sog", log.sog / KN, 3).put("cog", np.degrees(log.cog), 2)
    sheet.put("awa", np.degrees(log["gamma_A"]) % 360.0, 2).put("aws", log["U_A"] / KN, 3).put(
        "rudder", np.degrees(log["delta"]), 2
    )
    path = sheet.write(folder / "yacht.csv")
    return _only(path, log, {**bridge(log),
                             "delta": 0.01 * DEG, "U_A": 1e-3, "gamma_A": 0.01 * DEG})  # fmt: skip


@shape
def quaternion_enu(folder: Path) -> Expected:
    """A robot's odometry: east, north, up, and forward, port, up, the attitude as a quaternion, fixes beside it."""
    log = sailed(**MODEL, seed=14)
    half = 0.5 * (0.5 * math.pi - log["psi"])
    sheet = (
        Sheet()
        .put("stamp", START.timestamp() + log.t, 4)
        .put("latitude", log.latitude, 9)
        .put("longitude", log.longitude, 9)
    )
    for name, values in (("x", 0 * half), ("y", 0 * half), ("z", np.sin(half)), ("w", np.cos(half))):
        sheet.put(f"pose.orientation.{name}", values, 7)
    sheet.put("twist.linear.x", log["u"], 5).put("twist.linear.y", -log["v_m"], 5).put("twist.angular.z", -log["r"], 6)
    sheet.put("rudder_angle", -log["delta"], 5).put("propeller_rps", log["n_P"], 4)
    path = sheet.write(folder / "odometry.csv")
    return _only(
        path, log, {"x": 1e-3, "y": 1e-3, "psi": 1e-6, "u": 1e-5, "v_m": 1e-5, "r": 1e-6, "delta": 1e-5, "n_P": 1e-4}
    )


@shape
def east_north_yaw(folder: Path) -> Expected:
    """East first, yaw anticlockwise from east in rad, velocities east and north."""
    log = sailed(**MODEL, seed=15)
    yaw = np.arctan2(np.sin(0.5 * math.pi - log["psi"]), np.cos(0.5 * math.pi - log["psi"]))
    sheet = Sheet().put("t", log.t, 2).put("east", log["y"], 4).put("north", log["x"], 4).put("yaw", yaw, 5)
    sheet.put("v_east", log.east, 5).put("v_north", log.north, 5).put("yaw_rate", -log["r"], 6).put(
        "rudder", -np.degrees(log["delta"]), 3
    )
    sheet.put("rpm", 60 * log["n_P"], 2)
    path = sheet.write(folder / "usv.csv")
    one = 1e-5 + 1e-5
    return _only(
        path,
        log,
        {"x": 1e-4, "y": 1e-4, "psi": 1e-5, "u": one, "v_m": one, "r": 1e-6, "delta": 1e-3 * DEG, "n_P": 0.01 / 60},
    )


@shape
def rudder_to_port(folder: Path) -> Expected:
    """Rudder positive to port, sway positive to port, units in the header."""
    log = sailed(**COASTER, seed=16)
    sheet = (
        Sheet()
        .put("t [s]", log.t, 2)
        .put("x [m]", log["x"], 3)
        .put("y [m]", log["y"], 3)
        .put("heading [deg]", compass(log["psi"]), 3)
    )
    sheet.put("surge [m/s]", log["u"], 4).put("sway [m/s]", -log["v_m"], 4).put(
        "rot [deg/min]", 60 * np.degrees(log["r"]), 3
    )
    sheet.put("rudder [deg]", -np.degrees(log["delta"]), 3).put("n [rpm]", 60 * log["n_P"], 2)
    sheet.put("true wind speed [m/s]", log["U_T"], 3).put("true wind direction [deg]", compass(log["gamma_T"]), 2)
    path = sheet.write(folder / "report.csv")
    angles = {"psi": 1e-3 * DEG, "r": 1e-3 * DEG / 60, "delta": 1e-3 * DEG, "gamma_T": 0.01 * DEG}
    lengths = {"x": 1e-3, "y": 1e-3, "u": 1e-4, "v_m": 1e-4, "U_T": 1e-3}
    return _only(path, log, {**angles, **lengths, "n_P": 0.01 / 60})


@shape
def no_units(folder: Path) -> Expected:
    """No unit anywhere: radians, revolutions per minute, milliseconds."""
    log = sailed(**MODEL, seed=17)
    sheet = Sheet().put("time", [f"{1000 * one:.0f}" for one in log.t]).put("x", log["x"], 4).put("y", log["y"], 4)
    sheet.put("psi", np.arctan2(np.sin(log["psi"]), np.cos(log["psi"])), 5).put("u", log["u"], 5).put(
        "v", log["v_m"], 5
    )
    sheet.put("r", log["r"], 6).put("delta", log["delta"], 5).put("n", 60 * log["n_P"], 2)
    path = sheet.write(folder / "raw.csv")
    return _only(
        path,
        log,
        {"x": 1e-4, "y": 1e-4, "psi": 1e-5, "u": 1e-5, "v_m": 1e-5, "r": 1e-6, "delta": 1e-5, "n_P": 0.01 / 60},
    )


@shape
def topics(folder: Path) -> Expected:
    """Each topic in its own file at its own rate."""
    log = sailed(**{**MODEL, "duration": 120.0, "dt": 0.05, "noise": 0.0}, seed=18)

    def stamp(k: Any) -> list[str]:
        return stamps(log.t[k], "%Y-%m-%d %H:%M:%S.%f")

    every = {
        "heading": slice(0, None, 2),
        "fix": slice(1, None, 4),
        "velocity": slice(0, None, 4),
        "rudder": slice(0, None, 5),
        "shaft": slice(3, None, 10),
    }
    Sheet().put("time", stamp(every["heading"])).put(
        "heading", np.degrees(log["psi"][every["heading"]]) % 360, 3
    ).write(folder / "nav" / "heading.csv")
    k = every["fix"]
    Sheet().put("time", stamp(k)).put("latitude", log.latitude[k], 9).put("longitude", log.longitude[k], 9).write(
        folder / "nav" / "fix.csv"
    )
    k = every["velocity"]
    Sheet().put("time", stamp(k)).put("speed_over_ground", log.sog[k], 4).put(
        "course_over_ground", np.degrees(log.cog[k]), 3
    ).write(folder / "nav" / "velocity.csv")
    k = every["rudder"]
    Sheet().put("time", stamp(k)).put("data", np.degrees(log["delta"][k]), 3).write(
        folder / "steering" / "rudder_angle.csv"
    )
    k = every["shaft"]
    Sheet().put("time", stamp(k)).put("data", 60 * log["n_P"][k], 2).write(folder / "engine" / "shaft_rpm.csv")
    # on lines between samples: the revolutions leap by 2 1/s, the rudder moves at its rate
    digits = {"x": 0.005, "y": 0.005, "psi": 1e-3 * DEG, "u": 0.06, "v_m": 0.02, "delta": 0.04, "n_P": 2.1}
    return Expected({folder.name: (log.rows(every["heading"]), digits)})


@shape
def two_files_of_one_trial(folder: Path) -> Expected:
    """One log cut in two files by its logger."""
    log = sailed(**COASTER, seed=19)
    half = log.t.size // 2
    for k, part in enumerate((slice(0, half), slice(half, None)), 1):
        some = log.rows(part)
        sheet = Sheet().put("Time", stamps(some.t)).put("Lat", some.latitude, 8).put("Lon", some.longitude, 8)
        sheet.put("HDG", compass(some["psi"]), 2).put("SOG", some.sog / KN, 3).put("COG", np.degrees(some.cog), 2)
        sheet.put("RUD", np.degrees(some["delta"]), 2).put("RPM", 60 * some["n_P"], 2).write(folder / f"part{k}.csv")
    digits = {**bridge(log),
              "delta": 0.01 * DEG, "n_P": 0.01 / 60}  # fmt: skip
    return Expected({folder.name: (log, digits)})


@shape
def japanese(folder: Path) -> Expected:
    """Romanised Japanese names, the columns in another order, Shift-JIS free."""
    log = sailed(**COASTER, seed=20)
    sheet = (
        Sheet()
        .put("dakaku(deg)", np.degrees(log["delta"]), 2)
        .put("kaitensu(rpm)", 60 * log["n_P"], 2)
        .put("jikoku", stamps(log.t, "%Y/%m/%d %H:%M:%S.%f"))
    )
    sheet.put("keido", log.longitude, 8).put("ido", log.latitude, 8).put("taichi shinro", np.degrees(log.cog), 2)
    sheet.put("taichi sokuryoku(kt)", log.sog / KN, 3).put("senshu hoi", compass(log["psi"]), 2)
    sheet.put("sotai fuko", np.degrees(log["gamma_A"]) % 360, 2).put("sotai fusoku(m/s)", log["U_A"], 3)
    path = sheet.write(folder / "shiken.csv")
    return _only(path, log, {**bridge(log),
                             "delta": 0.01 * DEG, "n_P": 0.01 / 60, "U_A": 1e-3, "gamma_A": 0.01 * DEG})  # fmt: skip


@shape
def trials_by_a_column(folder: Path) -> Expected:
    """Three trials in one file, numbered by a column, time from zero in each."""
    logs = {str(k): sailed(**MODEL, seed=20 + k) for k in (1, 2, 3)}
    sheet = Sheet()
    parts = list(logs.items())
    join: Callable[[str], Array] = lambda name: np.concatenate([log[name] for _, log in parts])  # noqa: E731
    sheet.put("run", [name for name, log in parts for _ in log.t]).put(
        "t [s]", np.concatenate([log.t for _, log in parts]), 2
    )
    for name, unit in (
        ("x", "m"),
        ("y", "m"),
        ("psi", "rad"),
        ("u", "m/s"),
        ("v", "m/s"),
        ("r", "rad/s"),
        ("delta", "rad"),
        ("n", "1/s"),
    ):
        sheet.put(f"{name} [{unit}]", join({"v": "v_m", "n": "n_P"}.get(name, name)), 6)
    path = sheet.write(folder / "runs.csv")
    digits = dict.fromkeys(("x", "y", "psi", "u", "v_m", "r", "delta", "n_P"), 1e-6)
    return Expected({f"{path.stem}_{name}": (log, digits) for name, log in parts})


@shape
def trials_by_gaps(folder: Path) -> Expected:
    """Two trials in one file with an hour between them, month before day."""
    logs = [sailed(**COASTER, seed=30 + k) for k in range(2)]
    sheet = Sheet()
    starts = [START, START + timedelta(hours=1)]
    join: Callable[[Callable[[Sailed], Array]], Array] = lambda of: np.concatenate([of(log) for log in logs])  # noqa: E731
    sheet.put(
        "Time UTC",
        [one for log, start in zip(logs, starts, strict=True) for one in stamps(log.t, "%m/%d/%Y %H:%M:%S.%f", start)],
    )
    sheet.put("Latitude", join(lambda log: log.latitude), 8).put("Longitude", join(lambda log: log.longitude), 8)
    sheet.put("Heading", join(lambda log: compass(log["psi"])), 2).put("SOG", join(lambda log: log.sog / KN), 3)
    sheet.put("COG", join(lambda log: np.degrees(log.cog)), 2).put(
        "Rudder", join(lambda log: np.degrees(log["delta"])), 2
    )
    path = sheet.write(folder / "day.csv")
    digits = {
        **bridge(logs[0]),
        "delta": 0.01 * DEG,
    }
    return Expected({f"{path.stem}_{k}": (log, digits) for k, log in enumerate(logs, 1)})


@shape
def earth_fixed(folder: Path) -> Expected:
    """White space, velocities north and east called u and v, rudder positive to port, the track in columns x and y."""
    log = sailed(**MODEL, seed=24)
    sheet = (
        Sheet().put("t", log.t, 3).put("x0", log["x"], 4).put("y0", log["y"], 4).put("psi", np.degrees(log["psi"]), 3)
    )
    sheet.put("u", log.north, 5).put("v", log.east, 5).put("r", np.degrees(log["r"]), 4).put(
        "delta", -np.degrees(log["delta"]), 3
    )
    sheet.put("n", log["n_P"], 4)
    path = sheet.write(folder / "zz_20_20.dat", "   ", above=["Zigzag 20 20"])
    one = 1e-5 + 1e-3 * DEG
    return _only(
        path,
        log,
        {
            "x": 1e-4,
            "y": 1e-4,
            "psi": 1e-3 * DEG,
            "u": one,
            "v_m": one,
            "r": 1e-4 * DEG,
            "delta": 1e-3 * DEG,
            "n_P": 1e-4,
        },
    )
