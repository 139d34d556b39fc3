"""Tables of inertial units, as their makers name the columns: what a guess reads is what was sailed."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from columns import signal
from shapes import COASTER, Sailed, Sheet, astray, sailed

from seatrial.data.guess import guess
from seatrial.data.guess.entries import _plain_entry
from seatrial.data.guess.roles import _of_a_unit
from seatrial.data.mapping.checked import read_mapping
from seatrial.data.mapping.reading import read

DEG = math.pi / 180.0
FIX = {"x": 0.01, "y": 0.01}
RATE = 6e-4 * DEG


def fixes(log: Sailed, sheet: Sheet, names: tuple[str, str] = ("Latitude", "Longitude")) -> Sheet:
    return sheet.put(names[0], log.latitude, 9, "deg").put(names[1], log.longitude, 9, "deg")


def sbg(log: Sailed, heading: str, rate: str) -> tuple[Sheet, dict[str, float]]:
    """A text export with a row of units: north and east are called X and Y."""
    sheet = fixes(log, Sheet().put("Time", log.t, 3, "s")).put("Roll", 0.1 + 0 * log.t, 2, "deg")
    sheet.put(heading, np.degrees(log["psi"]) % 360.0, 4, "deg").put("X Velocity", log.north, 4, "m/s")
    sheet.put("Y Velocity", log.east, 4, "m/s").put(rate, np.degrees(log["r"]), 5, "deg/s")
    sheet.put("Rudder", np.degrees(log["delta"]), 3, "deg")
    return sheet, {"r": RATE, "u": 2e-4, "v_m": 2e-4, "psi": 1e-4 * DEG}


def vectornav(log: Sailed, *_: str) -> tuple[Sheet, dict[str, float]]:
    """A table of its control centre: no units, yaw from -180 to 180 deg, rates in rad/s."""
    yaw = np.degrees(np.arctan2(np.sin(log["psi"]), np.cos(log["psi"])))
    sheet = fixes(log, Sheet().put("TimeStartup", 1e9 * log.t, 0).put("Yaw", yaw, 4).put("Pitch", 0.2 + 0 * log.t, 3))
    sheet.put("Roll", 0.1 + 0 * log.t, 3).put("AngularRateX", 0 * log.t, 6).put("AngularRateZ", log["r"], 7)
    sheet.put("NedVelX", log.north, 4).put("NedVelY", log.east, 4).put("NedVelZ", 0 * log.t, 4)
    return sheet.put("Rudder", np.degrees(log["delta"]), 3), {"r": 1e-6, "u": 2e-4, "v_m": 2e-4, "psi": 1e-4 * DEG}


def xsens(log: Sailed, *_: str) -> tuple[Sheet, dict[str, float]]:
    """A quaternion of east, north, up as q0 to q3, the scalar first; rates and speeds of the same axes."""
    half = 0.5 * (0.5 * math.pi - log["psi"])
    sheet = fixes(log, Sheet().put("Time (s)", log.t, 3))
    for k, part in enumerate((np.cos(half), 0 * half, 0 * half, np.sin(half))):
        sheet.put(f"Quat_q{k}", part, 8)
    sheet.put("Vel_E", log.east, 4).put("Vel_N", log.north, 4).put("Gyr_Z", -log["r"], 7)
    return sheet.put("Rudder", np.degrees(log["delta"]), 3), {"r": 1e-6, "u": 2e-4, "v_m": 2e-4, "psi": 1e-6}


def novatel(log: Sailed, *_: str) -> tuple[Sheet, dict[str, float]]:
    """A table of Convert: the heading is an azimuth, the clock a week and its seconds."""
    sheet = Sheet().put("Week", ["2416"] * log.t.size).put("Seconds of week", 464_400.0 + log.t, 3)
    fixes(log, sheet).put("North Velocity", log.north, 4).put("East Velocity", log.east, 4)
    sheet.put("Azimuth", np.degrees(log["psi"]) % 360.0, 5)
    return sheet.put("Rudder", np.degrees(log["delta"]), 3), {"u": 2e-4, "v_m": 2e-4, "psi": 1e-5 * DEG}


@pytest.mark.slow
@pytest.mark.parametrize(("make", "names"), [
    (sbg, ("Yaw", "Gyroscope Z")), (sbg, ("Heading", "Gyro Z")), (sbg, ("Yaw", "Angular Rate Z")), (vectornav, ()),
    (xsens, ()), (novatel, ()),
])  # fmt: skip
@pytest.mark.parametrize("seed", [1, 2])
def test_a_table_of_a_unit_is_read_by_its_own_guess(
    make: Callable[..., tuple[Sheet, dict[str, float]]], names: tuple[str, ...], seed: int, tmp_path: Path
) -> None:
    log = sailed(**{**COASTER, "noise": 0.0}, seed=seed)
    sheet, digits = make(log, *names)
    path = sheet.write(tmp_path / "log.csv", units=make is sbg)
    text = guess(path).text
    (tmp_path / "m.toml").write_text(text)
    (trial,) = read(path, read_mapping(tmp_path / "m.toml"))
    assert astray(trial, log, {**FIX, "delta": 1e-3 * DEG, **digits}) == {}


def test_an_azimuth_is_that_of_a_thruster_where_there_is_one() -> None:
    azimuth = signal("alpha", [10.0, 20.0, 30.0])
    assert set(_of_a_unit({"alpha": azimuth})) == {"heading"}
    for other in ("heading", "yaw", "qw", "n_P", "n_P_1", "throttle_1", "force"):
        found = {"alpha": azimuth, other: signal(other, [1.0, 2.0, 3.0])}
        assert _of_a_unit(found) == found


@pytest.mark.parametrize(("largest", "angle", "unit"), [
    (0.2, "deg", "deg"), (0.2, "rad", "rad"), (0.2, "", "rad"), (2.0, "", "deg"), (2.0, "rad", "rad"),
    (3.5, "rad", "deg"),
])  # fmt: skip
def test_a_roll_without_a_unit_is_taken_in_that_of_the_heading(largest: float, angle: str, unit: str) -> None:
    entry = _plain_entry("phi", signal("phi", [0.0, largest, -0.1]), angle)
    assert entry.keys["unit"] == f'"{unit}"'
    told = next(one for one in entry.answer.doubts if "no unit is said" in one)
    assert ("as the heading" in told) == bool(angle and unit == angle)
