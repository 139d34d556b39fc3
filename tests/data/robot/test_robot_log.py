"""Logs of robots: east, north, up outside; north, east, down within; and back."""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data import DataError, Trial
from seatrial.data.geodesy import Datum
from seatrial.data.importing import import_log
from seatrial.data.robot.files import write_bag, write_mcap
from seatrial.data.robot.messages import FIX, FRAMES, NUMBER, ODOMETRY, TWIST, Message, packed, store, unpacked
from seatrial.data.robot.topics import read_topics
from seatrial.data.robot.trial import read
from seatrial.data.trialfile import read_trial, write_trial
from seatrial.exchange.robot_log import messages, save_robot_log

FORMATS = ("mcap", "rosbag2")
DEGREE = math.pi / 180.0


def trial(n: int = 40, **meta: Any) -> Trial:
    rng, t = np.random.default_rng(7), 0.1 * np.arange(n)
    names = ("x", "y", "u", "v_m", "r", "delta", "delta_cmd", "n_P", "n_bow", "U_T")
    channels = {name: rng.normal(size=n) for name in names} | {"psi": np.linspace(-2.0, 9.0, n)}
    channels["delta"][5] = channels["u"][7] = np.nan
    return Trial("run", t, channels, {"n_bow": "1/s"}, {"ship": "kvlcc2", **meta})


def odometry(x: float, y: float, psi: float, u: float, v: float, r: float) -> Any:
    data = packed(ODOMETRY, 0, {"x": x, "y": y, "psi": psi, "u": u, "v_m": v, "r": r})
    return store().deserialize_cdr(data, ODOMETRY)


def log(path: Path, rows: int = 3, *, frames: Mapping[str, str] = FRAMES) -> Path:
    """A log of our own making, without a note about the trial."""
    at = {"x": 1.0, "y": 2.0, "psi": 0.5, "u": 1.0, "v_m": 0.1, "r": 0.01}
    found = [Message("/odom", ODOMETRY, k * 10**8, packed(ODOMETRY, k * 10**8, at, frames))
             for k in range(rows)]  # fmt: skip
    found += [Message("/helm/angle", NUMBER, k * 10**8, packed(NUMBER, 0, {"value": 10.0})) for k in range(rows)]
    write_mcap(path, found, {})
    return path


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("meta", [
    pytest.param({}, marks=pytest.mark.slow),
    {"start": "2024-05-01T12:00:00.250000+00:00", "datum": {"latitude": 35.0, "longitude": 139.0}},
])  # fmt: skip
def test_round_trip(tmp_path: Path, format: str, meta: Mapping[str, Any]) -> None:
    before = trial(**meta)
    saved = save_robot_log(before, format, tmp_path)
    [written] = import_log(format, saved, tmp_path / "back")
    after = read_trial(written)
    assert set(after.channels) == set(before.channels)
    assert after.unit("n_bow") == "1/s"
    assert np.abs(after.t - before.t).max() < 1e-12
    for name in before.channels:
        np.testing.assert_allclose(after[name], before[name], rtol=0.0, atol=4e-15, equal_nan=True)
    assert {key: after.meta[key] for key in ("ship", *meta)} == {"ship": "kvlcc2", **meta}
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


def test_north_and_east_change_places() -> None:
    position = odometry(100.0, 20.0, 0.0, 1.0, 0.0, 0.0).pose.pose.position
    assert (position.x, position.y, position.z) == (20.0, 100.0, 0.0)


@pytest.mark.parametrize(("heading", "yaw"), [(0.0, 90.0), (90.0, 0.0), (180.0, -90.0), (270.0, 180.0), (45.0, 45.0)])
def test_yaw_counts_from_east_to_the_left(heading: float, yaw: float) -> None:
    q = odometry(0.0, 0.0, heading * DEGREE, 0.0, 0.0, 0.0).pose.pose.orientation
    # the direction of the bow, which the quaternion turns the x axis to
    bow = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    assert math.remainder(bow - yaw * DEGREE, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)


def test_a_turn_to_starboard_is_negative_outside() -> None:
    twist = odometry(0.0, 0.0, 0.0, 2.0, 0.3, 0.05).twist.twist
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == (2.0, -0.3, -0.05)


def test_starboard_down_is_the_same_roll() -> None:
    data = packed(ODOMETRY, 0, {"x": 0.0, "y": 0.0, "psi": 0.5 * math.pi, "phi": 0.2})
    q = store().deserialize_cdr(data, ODOMETRY).pose.pose.orientation
    assert (q.x, q.y, q.z) == pytest.approx((math.sin(0.1), 0.0, 0.0))  # about the bow, which points east
    assert unpacked(ODOMETRY, data).values["phi"] == pytest.approx(0.2)
    assert unpacked(ODOMETRY, data).values["psi"] == pytest.approx(0.5 * math.pi)


def test_displacements_agree_with_velocities_outside() -> None:
    """Midship moves where pose and twist say, in the frames of REP 103."""
    psi, u, v = 0.7, 2.0, -0.4
    north, east = u * math.cos(psi) - v * math.sin(psi), u * math.sin(psi) + v * math.cos(psi)
    message = odometry(north, east, psi, u, v, 0.0)
    yaw = 2.0 * math.atan2(message.pose.pose.orientation.z, message.pose.pose.orientation.w)
    ahead, left = message.twist.twist.linear.x, message.twist.twist.linear.y
    assert message.pose.pose.position.x == pytest.approx(ahead * math.cos(yaw) - left * math.sin(yaw))
    assert message.pose.pose.position.y == pytest.approx(ahead * math.sin(yaw) + left * math.cos(yaw))


def test_frames_and_stamps_are_those_of_the_trial() -> None:
    given = trial(start="2024-05-01T12:00:00+00:00", frames={"earth": "world", "ship": "hull", "antenna": "mast"},
                  datum={"latitude": 35.0, "longitude": 139.0})  # fmt: skip
    first = {one.kind: unpacked(one.kind, one.data) for one in reversed([*messages(given)][:20])}
    assert first[ODOMETRY].frames == ("world", "hull")
    assert first[FIX].frames == ("mast",)
    assert first[TWIST].frames == ("hull",)
    assert first[ODOMETRY].stamp == 1714564800 * 10**9


def test_another_decoder_reads_our_definitions(tmp_path: Path) -> None:
    support = pytest.importorskip("mcap_ros2.reader")
    saved = save_robot_log(trial(), "mcap", tmp_path)
    found = {one.channel.topic: one for one in support.read_ros2_messages(str(saved))}
    assert found["/odom"].ros_msg.header.frame_id == "map"
    assert found["/odom"].ros_msg.pose.pose.position.x == trial()["y"][-1]
    assert found["/delta"].ros_msg.data == trial()["delta"][-1]


def test_a_bag_is_what_ros_2_writes(tmp_path: Path) -> None:
    saved = save_robot_log(trial(), "rosbag2", tmp_path)
    assert sorted(p.name for p in saved.iterdir()) == ["metadata.yaml", "run.db3"]
    with sqlite3.connect(saved / "run.db3") as base:
        types = dict(base.execute("select name, type from topics"))
    base.close()
    assert types["/odom"] == ODOMETRY
    assert types["/n_P"] == NUMBER


def test_positions_from_fixes_alone(tmp_path: Path) -> None:
    datum = Datum(35.0, 139.0)
    places = [datum.place(10.0 * k, -5.0 * k) for k in range(4)]
    found = [Message("/gps", FIX, k * 10**9, packed(FIX, k * 10**9, {"latitude": p[0], "longitude": p[1]}))
             for k, p in enumerate(places)]  # fmt: skip
    write_mcap(tmp_path / "gps.mcap", found, {})
    got = read(tmp_path / "gps.mcap")
    np.testing.assert_allclose(got.stack("x", "y"), [(10.0 * k, -5.0 * k) for k in range(4)], atol=1e-6)
    assert got.meta["datum"] == {"latitude": pytest.approx(35.0), "longitude": pytest.approx(139.0)}


def test_the_datum_is_where_the_odometry_is_zero(tmp_path: Path) -> None:
    """A fix 10 km north and east of it, at 60 deg north, where north differs between the two."""
    datum = Datum(60.0, 10.0)
    latitude, longitude = datum.place(10e3, 10e3)
    found = [Message(topic, kind, k * 10**8, packed(kind, k * 10**8, values))
             for k in range(3) for topic, kind, values in (
                 ("/odom", ODOMETRY, {"x": 10e3, "y": 10e3, "psi": 0.0}),
                 ("/gps", FIX, {"latitude": latitude, "longitude": longitude}))]  # fmt: skip
    write_mcap(tmp_path / "far.mcap", found, {})
    told_ = read(tmp_path / "far.mcap").meta["datum"]
    assert datum.north_east(told_["latitude"], told_["longitude"]) == pytest.approx((0.0, 0.0), abs=1e-5)


def twists(path: Path, frame: str, heading: float | None) -> Path:
    """A log of velocity in a frame: 2 m/s north and 1 m/s east there."""
    found = [Message("/twist", TWIST, k * 10**8, packed(TWIST, k * 10**8, {"u": 1.0, "v_m": -2.0, "r": 0.1},
                                                        {**FRAMES, "ship": frame})) for k in range(3)]  # fmt: skip
    if heading is not None:
        at = {"x": 0.0, "y": 0.0, "psi": heading}
        found += [Message("/odom", ODOMETRY, k * 10**8, packed(ODOMETRY, k * 10**8, at)) for k in range(3)]
    write_mcap(path, found, {})
    return path


@pytest.mark.slow
@pytest.mark.parametrize("frame", ["map", "odom", "earth", "world", "robot/map", "/odom_combined", "local_enu"])
def test_a_velocity_in_the_earths_frame_is_turned_by_the_heading(tmp_path: Path, frame: str) -> None:
    got = read(twists(tmp_path / "run.mcap", frame, heading=0.5 * math.pi))
    assert got["u"] == pytest.approx([1.0] * 3)
    assert got["v_m"] == pytest.approx([-2.0] * 3)
    assert got["r"] == pytest.approx([0.1] * 3)
    got = read(twists(tmp_path / "run.mcap", frame, heading=0.3))
    assert got["u"] == pytest.approx([2.0 * math.cos(0.3) + math.sin(0.3)] * 3)
    assert got["v_m"] == pytest.approx([math.cos(0.3) - 2.0 * math.sin(0.3)] * 3)
    assert got.meta["frames"]["ship"] == FRAMES["ship"]
    got = read(twists(tmp_path / "run.mcap", frame, heading=None))
    assert not {"u", "v_m", "psi"} & set(got.channels)  # nothing to turn it by
    assert got["U_G"] == pytest.approx([math.sqrt(5.0)] * 3)
    assert got["gamma_G"] == pytest.approx([math.atan2(1.0, 2.0)] * 3)


@pytest.mark.parametrize("frame", ["base_link", "hull", "", "odometry_link", "mapper", "wamv/base_link"])
def test_any_other_frame_of_a_velocity_is_the_ships(tmp_path: Path, frame: str) -> None:
    got = read(twists(tmp_path / "run.mcap", frame, heading=0.3))
    assert got["u"] == pytest.approx([1.0] * 3)
    assert got["v_m"] == pytest.approx([-2.0] * 3)


def test_a_mapping_names_topics_and_signs(tmp_path: Path) -> None:
    path = tmp_path / "two.mcap"
    found = [Message(topic, ODOMETRY, k * 10**8, packed(ODOMETRY, k * 10**8, {"x": x * k, "y": 0.0, "psi": 0.0}))
             for k in range(3) for topic, x in (("/odom", 100.0), ("/ekf", -100.0))]  # fmt: skip
    found += [Message("/helm/angle", NUMBER, k * 10**8, packed(NUMBER, 0, {"value": 10.0})) for k in range(3)]
    write_mcap(path, found, {})
    with pytest.raises(DataError, match=r"Odometry on /ekf, /odom, which differ in x; name one"):
        read(path)
    mapping = tmp_path / "map.toml"
    mapping.write_text('schema = "seatrial-robot/1"\nodometry = "/ekf"\n[numbers]\n'
                       '"/helm/angle" = { channel = "delta", unit = "deg", sign = -1 }\n')  # fmt: skip
    got = read(path, read_topics(mapping))
    assert got["delta"] == pytest.approx([-10.0 * DEGREE] * 3)
    assert got["x"].tolist() == [0.0, -100.0, -200.0]
    mapping.write_text('schema = "seatrial-robot/1"\nodometri = "/ekf"\n')
    with pytest.raises(DataError, match="odometri"):
        read_topics(mapping)


def test_other_axes_are_refused(tmp_path: Path) -> None:
    path = log(tmp_path / "ned.mcap", frames={**FRAMES, "earth": "world_ned"})
    with pytest.raises(DataError, match="frame 'world_ned'"):
        read(path)


def test_a_log_of_seconds_since_1970_begins_at_zero(tmp_path: Path) -> None:
    first = 1714564800 * 10**9
    found = [Message("/odom", ODOMETRY, first + k, packed(ODOMETRY, first + k, {"x": 0.0, "y": 0.0, "psi": 0.0}))
             for k in (0, 10**8, 2 * 10**8)]  # fmt: skip
    write_mcap(tmp_path / "a.mcap", found, {})
    got = read(tmp_path / "a.mcap")
    assert got.t.tolist() == [0.0, 0.1, 0.2]
    assert got.meta["start"].startswith("2024-05-01T12:00:00")


def test_a_flipped_bit_changes_no_trial_without_a_word(tmp_path: Path) -> None:
    """Data, definitions, the trial's description and the summary: a bit in any of them is found, or does nothing."""
    path = save_robot_log(trial(start="2024-05-01T12:00:00+00:00"), "mcap", tmp_path)
    whole, before, found = path.read_bytes(), read(path), 0
    for bit in np.random.default_rng(3).integers(0, 8 * len(whole), 60).tolist():
        spoilt = bytearray(whole)
        spoilt[bit // 8] ^= 1 << bit % 8
        path.write_bytes(spoilt)
        try:
            after = read(path)
        except DataError:
            found += 1
            continue
        assert after.meta == before.meta
        for name in before.channels:
            np.testing.assert_array_equal(after[name], before[name])
    assert found > 50


@pytest.mark.parametrize(
    "note", [[], 1, {"meta": [1]}, {"units": {"n_P": 3}}, {"meta": {"start": 5}}, {"meta": {"L_ppp": 3.0}}]
)
def test_what_a_log_says_of_its_trial_is_no_reason_to_fall(tmp_path: Path, note: Any) -> None:
    write_mcap(tmp_path / "a.mcap", list(messages(trial())), note)
    with pytest.raises(DataError) as caught:
        read(tmp_path / "a.mcap")
    assert "a.mcap" in str(caught.value)
    assert str(caught.value).isprintable()


def test_a_message_of_no_time_is_told(tmp_path: Path) -> None:
    late = Message("/delta", NUMBER, 2**64 - 1, packed(NUMBER, 0, {"value": 1.0}))
    write_mcap(tmp_path / "a.mcap", [*messages(trial()), late], {})
    with pytest.raises(DataError, match="/delta, message 40: logged 18446744073709551615 ns after 1970"):
        read(tmp_path / "a.mcap")


def damaged(tmp_path: Path) -> list[tuple[str, Path]]:
    whole = log(tmp_path / "whole.mcap", 400).read_bytes()
    cases = {"cut": whole[: len(whole) // 10], "empty": b"", "text": b"t [s],x [m]\n0,1\n"}
    for name, data in cases.items():
        (tmp_path / f"{name}.mcap").write_bytes(data)
    write_mcap(tmp_path / "none.mcap", [Message("/a", NUMBER, 0, packed(NUMBER, 0, {"value": 1.0}))], {})
    write_mcap(tmp_path / "bad.mcap", [Message("/odom", ODOMETRY, k, b"\0\1\0\0abc") for k in range(3)], {})
    write_bag(tmp_path / "bag", [Message("/a", NUMBER, 0, packed(NUMBER, 0, {"value": 1.0}))], {})
    (tmp_path / "bag" / "bag.db3").write_bytes(b"nothing")
    return [("mcap", tmp_path / f"{name}.mcap") for name in (*cases, "none", "bad")] + [
        ("rosbag2", tmp_path / "bag"), ("rosbag2", tmp_path / "text.mcap")]  # fmt: skip


def test_what_cannot_be_read_is_told_in_a_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for format, path in damaged(tmp_path):
        assert main(["import", format, str(path), "-o", str(tmp_path / "out")]) == 2, path
        said = capsys.readouterr().err
        assert len(said.splitlines()) == 1, said
        assert path.name in said
    assert not (tmp_path / "out").exists()


def test_the_command_converts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_trial(trial(), tmp_path / "run.csv")
    out = tmp_path / "logs"
    for format in FORMATS:
        assert main(["convert", str(tmp_path / "run.csv"), "--to", format, "-o", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir()) == ["run", "run.mcap"]
    assert main(["convert", str(tmp_path / "run.csv"), "--to", "rosbag2", "-o", str(out)]) == 2
    assert "is there already" in capsys.readouterr().err
    assert main(["convert", str(tmp_path / "run.csv"), "--to", "ros", "-o", str(out)]) == 2
    assert "rosbag2" in capsys.readouterr().err


def test_topics_that_nothing_is_read_from_are_counted(tmp_path: Path) -> None:
    """A heading in a message that is not read must not be lost without a word."""
    kind = "std_msgs/msg/String"
    text = bytes(store().serialize_cdr(store().types[kind]("psi = 1"), kind))
    fixes = [Message("/fix", FIX, k * 10**9, packed(FIX, k * 10**9, {"latitude": 35.0, "longitude": 139.0 + k * 1e-5}))
             for k in range(1, 4)]  # fmt: skip
    write_mcap(tmp_path / "a.mcap", [*fixes, *(Message("/imu", kind, k, text) for k in range(5))], {})
    found = import_log("mcap", tmp_path / "a.mcap", tmp_path / "out")
    meta = read_trial(found[0]).meta
    assert meta["ignored"] == {f"/imu ({kind})": 5}
    assert "heading" in meta["missing"]


def test_numbers_of_single_precision_are_channels_too(tmp_path: Path) -> None:
    """0.1 rounds to 24 bits in such a message."""
    kind = "std_msgs/msg/Float32"
    data = bytes(store().serialize_cdr(store().types[kind](0.1), kind))
    fixes = [Message("/fix", FIX, k * 10**9, packed(FIX, k * 10**9, {"latitude": 35.0, "longitude": 139.0 + k * 1e-5}))
             for k in range(1, 4)]  # fmt: skip
    write_mcap(tmp_path / "a.mcap", [*fixes, *(Message("/delta", kind, k * 10**9, data) for k in range(1, 4))], {})
    assert set(read(tmp_path / "a.mcap")["delta"].tolist()) == {float(np.float32(0.1))}
