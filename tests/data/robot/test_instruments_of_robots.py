"""Logs of robots that others wrote: each message in our axes, by the evidence of the motion, in every kind of file."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from recorded import BEGAN, DATUM, WRITERS, Floats, Ship, Speaker, ticks, write_chunks, written

from seatrial.data import DataError, Trial
from seatrial.data.formats import reader
from seatrial.data.guess import guess
from seatrial.data.importing import import_log
from seatrial.data.robot.messages import Message
from seatrial.data.robot.topics import Number, Topics
from seatrial.data.robot.trial import read
from seatrial.data.trialfile import read_trial

SHIP, T = Ship(), 0.2 * np.arange(300)
NORTH, EAST = SHIP.place(T)
YAW = {"enu": lambda psi: 0.5 * math.pi - psi, "ned": lambda psi: psi, "nwu": lambda psi: -psi}


def fixes(say: Speaker, t: Floats = T) -> list[Message]:
    north, east = SHIP.place(t)
    return [say.fix("/gps/fix", k, a, b) for k, a, b in zip(ticks(t), north, east, strict=True)]


def imu(say: Speaker, axes: str = "enu", t: Floats = T, turn: float = -1.0, off: float = 0.0) -> list[Message]:
    yaw, rate = YAW[axes](SHIP.psi(t)) + off, turn * SHIP.r(t)
    return [say.imu("/imu/data", k, a, b) for k, a, b in zip(ticks(t), yaw, rate, strict=True)]


def off(got: Floats, right: Floats) -> float:
    return float(np.abs(np.mod(got - right + math.pi, 2.0 * math.pi) - math.pi).max())


def doubts(trial: Trial) -> list[str]:
    return [step for step in trial.meta["processing"] if step.startswith("doubt")]


@pytest.mark.slow
@pytest.mark.parametrize("format", WRITERS)
def test_fix_imu_and_thrusts_are_read_from_every_kind_of_file(tmp_path: Path, format: str) -> None:
    say = Speaker(WRITERS[format][1])
    t = T[:100]
    found = [*fixes(say, t), *imu(say, t=t)]
    found += [say.number("/delta", k, 0.01 * n) for n, k in enumerate(ticks(t))]  # by the time of logging alone
    for side, force in (("left", 120.0), ("right", 80.0)):
        found += [say.number(f"/wamv/thrusters/{side}/thrust", k, force) for k in ticks(t)]
        found += [say.number(f"/wamv/thrusters/{side}/pos", k, 0.1) for k in ticks(t)]
    got = reader(format)(written(tmp_path, format, found))
    assert not doubts(got)
    assert np.abs(got.t - t).max() < 1e-9
    assert off(got["psi"], SHIP.psi(t)) < 1e-12
    np.testing.assert_allclose(got["r"], SHIP.r(t), atol=1e-12)
    np.testing.assert_allclose(got.stack("x", "y"), np.column_stack([NORTH, EAST])[:100], atol=1e-6)
    np.testing.assert_allclose(got["delta"], 0.01 * np.arange(100), atol=1e-12)
    assert set(got["f_port"]) == {120.0}
    assert set(got["f_starboard"]) == {80.0}
    assert got["alpha_port"] == pytest.approx(-0.1)  # to the left outside, clockwise here
    assert got.unit("f_port") == "N"


@pytest.mark.parametrize("axes", YAW)
def test_the_track_tells_the_axes_of_a_heading(tmp_path: Path, axes: str) -> None:
    say = Speaker()
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *imu(say, axes)])
    got = read(tmp_path / "a.mcap")
    assert off(got["psi"], SHIP.psi(T)) < 1e-9
    assert bool(doubts(got)) == (axes != "enu")


def test_a_rate_that_is_against_the_heading_is_turned(tmp_path: Path) -> None:
    say = Speaker()
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *imu(say, turn=1.0)])
    got = read(tmp_path / "a.mcap")
    np.testing.assert_allclose(got["r"], SHIP.r(T), atol=1e-9)
    assert "opposite" in doubts(got)[0]


@pytest.mark.slow
def test_a_heading_whose_zero_nobody_knows_is_left_out(tmp_path: Path) -> None:
    say = Speaker()
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *imu(say, off=1.2)])
    got = read(tmp_path / "a.mcap")
    assert "psi" not in got.channels
    assert "left out" in doubts(got)[0]
    kept = read(tmp_path / "a.mcap", Topics(axes={"/imu/data": "enu"}))
    assert off(kept["psi"], SHIP.psi(T) - 1.2) < 1e-9


def test_a_heading_without_a_track_is_in_doubt(tmp_path: Path) -> None:
    say = Speaker()
    write_chunks(tmp_path / "a.mcap", imu(say))
    assert "no track" in doubts(read(tmp_path / "a.mcap"))[0]


@pytest.mark.parametrize("frame", ["map", "base_link", "gps_antenna"])
def test_velocities_of_the_earth_and_of_the_ship(tmp_path: Path, frame: str) -> None:
    """A frame named `gps_antenna` says nothing; the track shows that its velocities are east and north."""
    say, (u, v), psi = Speaker(), SHIP.velocity(T), SHIP.psi(T)
    x, y = (u, -v) if frame == "base_link" else (u * np.sin(psi) + v * np.cos(psi), u * np.cos(psi) - v * np.sin(psi))
    found = [say.twist("/vel", k, a, b, -c, frame) for k, a, b, c in zip(ticks(T), x, y, SHIP.r(T), strict=True)]
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *imu(say), *found])
    got = read(tmp_path / "a.mcap")
    np.testing.assert_allclose(got["u"], u, atol=1e-9)
    np.testing.assert_allclose(got["v_m"], v, atol=1e-9)


def test_an_imu_that_says_it_has_no_orientation_has_none(tmp_path: Path) -> None:
    say = Speaker()
    found = [say.imu("/imu/raw", k, 0.0, -r, known=-1.0) for k, r in zip(ticks(T), SHIP.r(T), strict=True)]
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *found])
    got = read(tmp_path / "a.mcap")
    assert "psi" not in got.channels
    np.testing.assert_allclose(got["r"], SHIP.r(T), atol=1e-12)


def test_an_orientation_that_never_changes_is_none(tmp_path: Path) -> None:
    say = Speaker()
    found = [say.imu("/imu", k, 0.0, -r) for k, r in zip(ticks(T), SHIP.r(T), strict=True)]
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *found])
    got = read(tmp_path / "a.mcap")
    assert "psi" not in got.channels
    assert "never changes" in doubts(got)[0]


@pytest.mark.slow
def test_orders_are_no_motion(tmp_path: Path) -> None:
    """What a robot is told to do has the types of what it does."""
    say = Speaker()
    found = [say.twist("/cmd_vel", k, 9.0, 0.0, 1.0, "base_link") for k in ticks(T)]
    found += [say.pose("/mavros/setpoint_position/local", k, 500.0, 0.0, 1.0) for k in ticks(T)]
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *imu(say), *found])
    [file] = import_log("mcap", tmp_path / "a.mcap", tmp_path / "out")
    got = read_trial(file)
    assert "u" not in got.channels
    assert got["x"].max() < 400.0
    assert got.meta["ignored"]["/cmd_vel (geometry_msgs/msg/TwistStamped)"] == 300


def test_poses_and_headers_before_the_clock_of_the_recorder(tmp_path: Path) -> None:
    """A recorder whose clock is a day ahead; numbers have its time only, and come to their rows."""
    say, late = Speaker(), 86_400 * 10**9 + 30_000_000
    found = [say.pose("/pose", k, a, b, 0.5 * math.pi - c)
             for k, a, b, c in zip(ticks(T), NORTH, EAST, SHIP.psi(T), strict=True)]  # fmt: skip
    found += [say.number("/delta", k, 0.01 * n) for n, k in enumerate(ticks(T))]
    write_chunks(tmp_path / "a.mcap", [Message(m.topic, m.kind, m.logged + late, m.data) for m in found])
    got = read(tmp_path / "a.mcap")
    assert got.meta["start"].startswith("2026-09-21")
    np.testing.assert_allclose(got["delta"], 0.01 * np.arange(300), atol=1e-12)
    np.testing.assert_allclose(got["x"], NORTH, atol=1e-12)
    assert not doubts(got)


def test_sentences_in_a_bag_are_read_as_those_of_a_log(tmp_path: Path) -> None:
    say = Speaker()
    found = [say.sentence("/nmea", k, f"$HEHDT,{math.degrees(psi) % 360.0:.4f},T")
             for k, psi in zip(ticks(T), SHIP.psi(T), strict=True)]  # fmt: skip
    found += [say.sentence("/nmea", BEGAN, "$IIXYZ,1")]
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *found])
    got = read(tmp_path / "a.mcap")
    assert off(got["psi"], SHIP.psi(T)) < math.radians(1e-4)
    assert got.meta["sources"]["heading"].startswith("HEHDT")
    assert got.meta["ignored"] == {"XYZ": 1}


@pytest.mark.slow
def test_pulses_are_channels_by_a_mapping_alone(tmp_path: Path) -> None:
    say = Speaker()
    found = [say.pulses("/mavros/rc/out", k, [1700, 0, 1400]) for k in ticks(T)]
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *imu(say), *found])
    got = read(tmp_path / "a.mcap")
    assert got.meta["ignored"] == {f"/mavros/rc/out[{k}] (mavros_msgs/msg/RCOut)": 300 for k in (0, 2)}
    numbers = {f"/mavros/rc/out[{k}]": Number(name, "-", scale=1 / 400, offset=-1500 / 400)
               for k, name in ((0, "throttle_port"), (2, "throttle_starboard"))}  # fmt: skip
    mapped = read(tmp_path / "a.mcap", Topics(numbers=numbers))
    assert mapped["throttle_port"] == pytest.approx(0.5)
    assert mapped["throttle_starboard"] == pytest.approx(-0.25)


def test_a_number_that_sounds_like_a_control_is_not_left_without_a_word(tmp_path: Path) -> None:
    say = Speaker()
    found = [say.number("/rudder_angle", k, 0.1, "std_msgs/msg/Float32") for k in ticks(T)]
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *imu(say), *found])
    assert "/rudder_angle looks like a control" in doubts(read(tmp_path / "a.mcap"))[0]


def test_the_place_of_the_antenna_is_taken_off(tmp_path: Path) -> None:
    say, psi = Speaker(), SHIP.psi(T)
    north, east = NORTH + 3.0 * np.cos(psi), EAST + 3.0 * np.sin(psi)
    found = [say.fix("/fix", k, a, b) for k, a, b in zip(ticks(T), north, east, strict=True)]
    write_chunks(tmp_path / "a.mcap", [*found, *imu(say)])
    mapping = tmp_path / "map.toml"
    mapping.write_text(f'schema = "seatrial-robot/1"\nantenna = {{ forward = 3.0 }}\n'
                       f"datum = {{ latitude = {DATUM.latitude}, longitude = {DATUM.longitude} }}\n")  # fmt: skip
    got = reader("mcap", mapping)(tmp_path / "a.mcap")
    np.testing.assert_allclose(got.stack("x", "y"), np.column_stack([NORTH, EAST]), atol=1e-6)


def test_mixed_axes_are_asked_for(tmp_path: Path) -> None:
    say = Speaker()
    found = [say.pose("/pose", k, a, b, c, "world_ned")
             for k, a, b, c in zip(ticks(T), EAST, NORTH, SHIP.psi(T), strict=True)]  # fmt: skip
    write_chunks(tmp_path / "a.mcap", found)
    got = read(tmp_path / "a.mcap")  # one frame, and it is north, east, down
    np.testing.assert_allclose(got["x"], NORTH, atol=1e-12)
    assert off(got["psi"], SHIP.psi(T)) < 1e-9
    with pytest.raises(DataError, match="topic"):
        read(tmp_path / "a.mcap", Topics(odometry="/none"))


def test_a_pose_alone_is_in_the_axes_that_its_topic_names(tmp_path: Path) -> None:
    """A track with its headings is as likely as its mirror image: a name is all there is, and it is doubted."""
    say = Speaker()
    for topic, wanted in (("/vessel/pose_ned", True), ("/planned/pose", False)):
        found = [say.pose(topic, *one) for one in zip(ticks(T), EAST, NORTH, SHIP.psi(T), strict=True)]
        write_chunks(tmp_path / "a.mcap", found)
        got = read(tmp_path / "a.mcap")
        assert any("by its name alone" in one for one in doubts(got)) == wanted
        np.testing.assert_allclose(got["x"], NORTH if wanted else EAST, atol=1e-12)
        assert off(got["psi"], SHIP.psi(T) if wanted else 0.5 * np.pi - SHIP.psi(T)) < 1e-9
    kept = [say.pose("/pose_ned", *one) for one in zip(ticks(T), EAST, NORTH, SHIP.psi(T), strict=True)]
    write_chunks(tmp_path / "a.mcap", kept)
    np.testing.assert_allclose(read(tmp_path / "a.mcap", Topics(axes={"/pose_ned": "enu"}))["x"], EAST, atol=1e-12)


@pytest.mark.parametrize("turn", [-1.0, 1.0])
def test_the_course_tells_the_sense_of_a_rate_without_a_heading(tmp_path: Path, turn: float) -> None:
    """REP 103 has it to port; a unit that counts to starboard is turned, as the course shows."""
    say = Speaker()
    bare = [say.imu("/imu", k, 0.0, turn * r, known=-1.0) for k, r in zip(ticks(T), SHIP.r(T), strict=True)]
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *bare])
    got = read(tmp_path / "a.mcap")
    assert "psi" not in got
    np.testing.assert_allclose(got["r"], SHIP.r(T), atol=1e-12)
    assert bool(doubts(got)) == (turn > 0.0)


def test_a_rate_that_nothing_shows_the_sense_of_is_in_doubt(tmp_path: Path) -> None:
    say = Speaker()
    noise = np.random.default_rng(1).normal(0.0, 0.05, T.size)
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *(say.imu("/imu", k, 0.0, r, known=-1.0)
                                                      for k, r in zip(ticks(T), noise, strict=True))])  # fmt: skip
    assert any("to which side its rate of turn" in one for one in doubts(read(tmp_path / "a.mcap")))


@pytest.mark.parametrize(("askew", "doubted"), [(5.0, False), (20.0, True), (-35.0, True)])
def test_a_heading_that_is_off_to_one_side_of_every_course_is_in_doubt(
    tmp_path: Path, askew: float, doubted: bool
) -> None:
    say = Speaker()
    write_chunks(tmp_path / "a.mcap", [*fixes(say), *imu(say, off=math.radians(askew))])
    assert bool(doubts(read(tmp_path / "a.mcap"))) == doubted


@pytest.mark.slow
@pytest.mark.parametrize(("topics", "channels"), [
    (["/motor_rpm"], ["n_P"]), (["/left/rpm", "/right/rpm"], ["n_P_1", "n_P_2"]), (["/rpm/a", "/rpm/b"], []),
])  # fmt: skip
def test_revolutions_are_no_share_of_the_most(tmp_path: Path, topics: list[str], channels: list[str]) -> None:
    say = Speaker()
    rpm = 400.0 + 20.0 * np.sin(0.2 * T)
    found = [say.number(topic, k, a) for topic in topics for k, a in zip(ticks(T), rpm, strict=True)]
    write_chunks(tmp_path / "a.mcap", sorted([*fixes(say), *imu(say), *found], key=lambda one: one.logged))
    guessed = guess(tmp_path / "a.mcap")
    assert "throttle" not in guessed.text
    assert [name for name in ("n_P", "n_P_1", "n_P_2") if f'"{name}"' in guessed.text] == channels
    for channel in channels:
        (tmp_path / "m.toml").write_text(guessed.text)
        got = reader("mcap", tmp_path / "m.toml")(tmp_path / "a.mcap")
        np.testing.assert_allclose(got[channel], rpm / 60.0)
