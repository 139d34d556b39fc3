"""Sentences of a ship that goes in a circle at 5 m/s, 0.5 deg/s, and the check that a trial is this."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.formats.nmea import read, read_mapping
from seatrial.data.geodesy import Datum

RATE, SPEED = math.radians(0.5), 5.0
START = Datum(59.0, 10.0)
KNOT = 1852.0 / 3600.0
Say = Callable[[float], str]


def place(t: float) -> tuple[float, float]:
    """North and east of the origin of the circle [m]."""
    return SPEED / RATE * math.sin(RATE * t), SPEED / RATE * (1.0 - math.cos(RATE * t))


def signed(content: str) -> str:
    """A sentence with its checksum, the exclusive or of its bytes."""
    total = 0
    for byte in content.encode():
        total ^= byte
    return f"${content}*{total:02X}"


def degrees(value: float, width: int, sides: str) -> str:
    minutes = abs(value) * 60.0
    return f"{int(minutes // 60):0{width}d}{minutes % 60:08.5f},{sides[int(value < 0)]}"


def clock(t: float, begun: float = 36000.0) -> str:
    now = round((begun + t) % 86400.0, 2)
    return f"{int(now // 3600):02d}{int(now // 60) % 60:02d}{now % 60:05.2f}"


def fix(t: float, north: float = 0.0) -> str:
    x, y = place(t)
    per = 111_120.0 * np.array([1.0, math.cos(math.radians(START.latitude))])
    # the datum's own plane is inverted by two steps of Newton on its track
    at = np.array([START.latitude, START.longitude]) + np.array([x + north, y]) / per
    for _ in range(3):
        off = np.array([x + north, y]) - np.ravel(START.track(at[:1], at[1:]))
        at = at + off / per
    return f"{degrees(at[0], 2, 'NS')},{degrees(at[1], 3, 'EW')}"


def course(t: float) -> float:
    return math.degrees(RATE * t) % 360.0


def rmc(t: float, talker: str = "GP", variation: str = ",", begun: float = 36000.0) -> str:
    return signed(f"{talker}RMC,{clock(t, begun)},A,{fix(t)},{SPEED / KNOT:.4f},{course(t):.3f},010526,{variation},A")


def gga(t: float, talker: str = "GP", north: float = 0.0) -> str:
    return signed(f"{talker}GGA,{clock(t)},{fix(t, north)},9,09,0.9,5.0,M,40.0,M,,")


def gll(t: float) -> str:
    return signed(f"GPGLL,{fix(t)},{clock(t)},A,A")


def hdt(t: float, talker: str = "HE", off: float = 0.0) -> str:
    return signed(f"{talker}HDT,{(course(t) + off) % 360:.3f},T")


def log(tmp_path: Path, says: Sequence[Say], times: Sequence[float], mapping: str = "", stamp: Say | None = None,
        end: str = "\r\n") -> Trial:  # fmt: skip
    path = tmp_path / "log.nmea"
    text = end.join(f"{stamp(t) if stamp else ''}{say(t)}" for t in times for say in says) + end
    path.write_bytes(text.encode("latin-1"))
    if not mapping:
        return read(path)
    (tmp_path / "log.toml").write_text(f'schema = "seatrial-nmea/1"\n{mapping}\n')
    return read(path, read_mapping(tmp_path / "log.toml"))


def true(trial: Trial, late: float = 0.0, headed: bool = True) -> None:
    """Fail where a trial is not the circle; the minutes hold 1e-5, 2 cm."""
    t = trial.t + late
    good = np.isfinite(trial["x"])
    assert good.sum() > 5
    origin = place(float(t[0]))
    for k, name in enumerate("xy"):
        truth = np.array([place(one)[k] - origin[k] for one in t.tolist()])
        assert trial[name][good] == pytest.approx(truth[good], abs=0.05)
    if headed:
        assert np.rad2deg(trial["psi"]) == pytest.approx(np.rad2deg(RATE * t), abs=0.01)


SECONDS = [float(k) for k in range(60)]
