"""Recordings of random rates, gaps, clocks, axes and packing: what is read is what was written, or in doubt."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded import BEGAN, DATUM, Floats, Ship, Speaker, write_chunks, write_ros1, written
from telemetry import Link, quaternion, tlog, ulog

from seatrial.data import Trial
from seatrial.data.formats import tlog as tlogs
from seatrial.data.formats import ulog as ulogs
from seatrial.data.robot.bearings import Track, axes_of
from seatrial.data.robot.messages import Message
from seatrial.data.robot.trial import read

SECONDS = 45.0


@dataclass(frozen=True)
class Drawn:
    """A ship and the times at which its instruments speak."""

    hand: np.random.Generator
    ship: Ship

    @staticmethod
    def by(seed: int) -> Drawn:
        hand = np.random.default_rng(seed)
        ship = Ship(hand.uniform(-3.0, 3.0), hand.uniform(0.7, 1.2), hand.uniform(25.0, 60.0), hand.uniform(0.8, 4.0))
        return Drawn(hand, ship)

    def times(self, low: float, high: float) -> Floats:
        """Regular, jittered by a tenth of the interval, with a gap of some seconds or without; to the microsecond."""
        rate = self.hand.uniform(low, high)
        t = np.arange(0.0, SECONDS, 1.0 / rate) + self.hand.uniform(0.0, 0.1)
        t += self.hand.uniform(-0.1, 0.1, t.size) / rate * self.hand.integers(2)
        first = self.hand.uniform(10.0, 30.0)
        if self.hand.integers(2):
            t = t[(t < first) | (t > first + self.hand.uniform(0.5, 6.0))]
        return np.round(np.abs(t), 6)


def nearest(rows: Floats, t: Floats, values: Floats) -> Floats:
    """Value of each row by brute force: of those nearer to it than to another row, within half a median row.

    A row is infinite where two readings are as near, or one is as near to another row, to a microsecond.
    """
    reach = 0.5 * float(np.median(np.diff(rows)))
    out = np.full(rows.size, math.nan)
    apart = np.abs(rows[:, None] - t[None, :])
    owner = np.argmin(apart, axis=0)
    for k in range(rows.size):
        mine = np.flatnonzero((owner == k) & (apart[k] <= reach * (1.0 + 1e-6)))
        order = mine[np.argsort(apart[k][mine])]
        if order.size:
            out[k] = values[order[0]]
        if order.size > 1 and apart[k][order[1]] - apart[k][order[0]] < 1e-6:
            out[k] = math.inf
    for j in range(t.size):
        tied = np.flatnonzero(apart[:, j] < apart[owner[j], j] + 1e-6)
        if tied.size > 1 and apart[owner[j], j] <= reach + 1e-6:
            out[tied] = math.inf
    return out


def same(got: Floats, right: Floats, most: float, circle: bool = False) -> bool:
    """Whether they agree, gaps included, where the right one is not infinite."""
    got, right = got[~np.isinf(right)], right[~np.isinf(right)]
    off = np.abs(np.mod(got - right + math.pi, math.tau) - math.pi) if circle else np.abs(got - right)
    return bool(np.array_equal(np.isfinite(got), np.isfinite(right)) and np.nanmax(off) <= most)


def stamped(t: Floats) -> list[int]:
    return [BEGAN + round(1e6 * one) * 1000 for one in t.tolist()]


def recording(folder: Path, drawn: Drawn) -> tuple[Trial, dict[str, Any]]:
    """A recording of one of the three formats, packed in one of their ways."""
    hand, ship = drawn.hand, drawn.ship
    format = ("mcap", "rosbag2", "rosbag1")[hand.integers(3)]
    say = Speaker(format == "rosbag1")
    heading, fixed, ordered = drawn.times(4.0, 12.0), drawn.times(2.0, 8.0), drawn.times(1.0, 10.0)
    axes = ("enu", "ned", "nwu")[hand.integers(3)]
    psi = ship.psi(heading)
    yaw = {"enu": 0.5 * math.pi - psi, "ned": psi, "nwu": -psi}[axes]
    turn = float(hand.choice([-1.0, 1.0]))
    found = [say.imu("/imu", k, a, turn * b) for k, a, b in zip(stamped(heading), yaw, ship.r(heading), strict=True)]
    north, east = ship.place(np.append(fixed, SECONDS))
    found += [say.fix("/fix", k, a, b) for k, a, b in zip(stamped(fixed), north[:-1], east[:-1], strict=True)]
    force = hand.normal(size=ordered.size)
    found += [say.number("/wamv/thrusters/left/thrust", k, a) for k, a in zip(stamped(ordered), force, strict=True)]
    late = int(hand.choice([0, 86_400 * 10**9, -3 * 10**9]))
    found = sorted((Message(m.topic, m.kind, m.logged + late, m.data, m.encoding) for m in found),
                   key=lambda one: one.logged)  # fmt: skip
    path = folder / f"a.{format}"
    if format == "mcap":
        write_chunks(path, found, str(hand.choice(["ZSTD", "LZ4", "NONE"])), int(hand.choice([2_000, 50_000])))
    elif format == "rosbag1":
        write_ros1(path, found, str(hand.choice(["", "BZ2", "LZ4"])), int(hand.choice([2_000, 50_000])))
    else:
        path = written(folder, format, found)
    truth = {"heading": heading, "fixed": fixed, "place": (north[:-1], east[:-1]), "ordered": ordered, "force": force,
             "turned": math.degrees(np.ptp(ship.psi(fixed) + np.arctan2(*ship.velocity(fixed)[::-1]))),
             "doubtful": axes != "enu" or turn > 0.0}  # fmt: skip
    return read(path), truth


def check_recording(folder: Path, seed: int) -> None:
    drawn = Drawn.by(seed)
    got, truth = recording(folder, drawn)
    t = truth["heading"]
    doubts = [step for step in got.meta["processing"] if step.startswith("doubt")]
    assert bool(doubts) == truth["doubtful"], doubts
    if "psi" not in got.channels:
        # a course that turns by less than 60 deg does not tell which of the other axes are right
        assert truth["turned"] < 75.0
        assert "left out" in doubts[0]
        return
    assert np.abs(got.t - (t - t[0])).max() < 1e-9
    assert same(got["psi"], drawn.ship.psi(t), 1e-9, circle=True)
    assert same(got["r"], drawn.ship.r(t), 1e-12)
    zero = DATUM.north_east(**{k: got.meta["datum"][k] for k in ("latitude", "longitude")})
    for name, values, at in zip(("x", "y"), truth["place"], zero, strict=True):
        # the plane of another datum, some hundred metres away, is tilted by a millionth of the distance squared
        assert same(got[name] + at, nearest(t, truth["fixed"], values), 1e-3)
    assert same(got["f_port"], nearest(t, truth["ordered"], truth["force"]), 1e-12)


def check_autopilot(folder: Path, seed: int) -> None:
    """ULog in single precision, MAVLink to the millisecond, the centimetre and 1e-7 deg."""
    drawn = Drawn.by(seed)
    hand, ship = drawn.hand, drawn.ship
    boot = hand.uniform(1.0, 4000.0)
    heading, fixed = drawn.times(4.0, 12.0), drawn.times(2.0, 8.0)
    north, east = (one[:-1] for one in ship.place(np.append(fixed, SECONDS)))
    places = [DATUM.place(a, b) for a, b in zip(north, east, strict=True)]
    path = folder / "a.log"
    if hand.integers(2):
        path.write_bytes(ulog({
            "vehicle_attitude": ("float[4] q", [
                (boot + a, *quaternion(b)) for a, b in zip(heading, ship.psi(heading), strict=True)]),
            "vehicle_angular_velocity": ("float[3] xyz", [
                (boot + a, 0.0, 0.0, b) for a, b in zip(heading, ship.r(heading), strict=True)]),
            "sensor_gps": ("double latitude_deg;double longitude_deg;uint8_t fix_type", [
                (boot + a, *b, 3) for a, b in zip(fixed, places, strict=True)]),
        }))  # fmt: skip
        got, digits, metres = ulogs.read(path), 2e-6, 1e-3
    else:
        link = Link(int(hand.integers(1, 200)), int(hand.integers(1, 3)))
        heading, fixed = np.round(heading, 3), np.round(fixed, 3)
        base = round(1e3 * boot) / 1e3
        for t, psi, r in zip(heading, ship.psi(heading), ship.r(heading), strict=True):
            link.attitude(1.79e9 + t + hand.uniform(0.0, 0.2), base + t, psi, r)
        for t, place in zip(fixed, places, strict=True):
            link.place(1.79e9 + t + hand.uniform(0.0, 0.2), base + t, *place, 1.0, 0.0)
        path.write_bytes(tlog(link))
        got, digits, metres = tlogs.read(path), 2e-6, 0.02
    assert np.abs(got.t - (heading - heading[0])).max() < digits
    assert same(got["psi"], ship.psi(heading), 1e-6, circle=True)
    assert same(got["r"], ship.r(heading), 1e-6)
    zero = DATUM.north_east(**{k: got.meta["datum"][k] for k in ("latitude", "longitude")})
    for name, values, at in zip(("x", "y"), (north, east), zero, strict=True):
        assert same(got[name] + at, nearest(heading, fixed, values), metres)


CASES = [pytest.param(20, marks=pytest.mark.slow), pytest.param(1000, marks=pytest.mark.long)]


@pytest.mark.parametrize("cases", CASES)
def test_recordings_of_robots_come_back(tmp_path: Path, cases: int) -> None:
    for seed in range(cases):
        folder = tmp_path / f"{seed}"
        folder.mkdir()
        check_recording(folder, seed)


@pytest.mark.parametrize("cases", CASES)
def test_logs_of_autopilots_come_back(tmp_path: Path, cases: int) -> None:
    for seed in range(cases):
        check_autopilot(tmp_path, 10_000 + seed)


def test_a_course_that_turns_little_and_is_nearer_in_other_axes_leaves_a_heading_out() -> None:
    """Courses of 15 to 35 deg: read by REP 103 a heading from north is as far off as 90 deg less twice the course."""
    t = np.arange(0.0, 60.0, 0.5)
    for turns, axes in ((10.0, ""), (20.0, "ned"), (40.0, "ned")):
        gamma = np.radians(25.0 + turns * np.sin(t / 8.0))
        found, told, _ = axes_of(t, 0.5 * np.pi - gamma, Track(t, gamma, np.ones(t.size), "/fix"))
        assert found == axes
        assert "0 if its axes are" in told


@pytest.mark.parametrize("middle", [45.0, 225.0])
def test_a_heading_that_turns_against_the_course_is_mirrored_however_near_it_is(middle: float) -> None:
    """To the north-east a heading from north, read from east, is off by twice as much as the ship yaws: 20 deg here."""
    t = np.arange(0.0, 60.0, 0.5)
    gamma = np.radians(middle + 20.0 * np.sin(t / 8.0))
    ground = Track(t, gamma, np.ones(t.size), "/fix")
    assert axes_of(t, 0.5 * np.pi - gamma, ground)[0] == "ned"
    assert axes_of(t, gamma, ground)[0] == "enu"
    assert axes_of(t, np.full(t.size, gamma[0]), ground)[0] == "enu"
