"""Recordings of robots whose truth is known: a ship on a weaving course, its messages, a writer of each kind."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatrial.data.geodesy import Datum
from seatrial.data.robot.files import write_bag
from seatrial.data.robot.messages import Definitions, Message

DATUM = Datum(35.0, 139.5)
BEGAN = 1_790_000_000 * 10**9
"""Start of a recording [ns since 1970]."""

Floats = NDArray[np.float64]
_TYPES = Definitions()


@dataclass(frozen=True)
class Ship:
    """A ship that weaves: its state in closed form, north and east by sums of a millisecond's steps."""

    first: float = 0.3
    swing: float = 0.8
    period: float = 40.0
    speed: float = 2.0

    def psi(self, t: Floats) -> Floats:
        return self.first + self.swing * np.sin(2.0 * math.pi * t / self.period) + 0.02 * t

    def r(self, t: Floats) -> Floats:
        w = 2.0 * math.pi / self.period
        return self.swing * w * np.cos(w * t) + 0.02

    def velocity(self, t: Floats) -> tuple[Floats, Floats]:
        """Ahead and to starboard."""
        return self.speed + 0.1 * np.sin(0.2 * t), -0.6 * self.r(t)

    def place(self, t: Floats) -> tuple[Floats, Floats]:
        """North and east."""
        fine = np.arange(0.0, float(t[-1]) + 0.02, 0.01)
        u, v = self.velocity(fine)
        psi = self.psi(fine)
        north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
        return tuple(np.interp(t, fine, np.concatenate([[0.0], 0.005 * np.cumsum(one[1:] + one[:-1])]))
                     for one in (north, east))  # type: ignore[return-value]  # fmt: skip


def ticks(t: Floats) -> list[int]:
    """Stamps of times."""
    return [BEGAN + round(1e9 * one) for one in t.tolist()]


def pack(kind: str, message: Any, ros1: bool = False) -> bytes:
    types = _TYPES.of("ros1" if ros1 else "cdr")
    return bytes((types.serialize_ros1 if ros1 else types.serialize_cdr)(message, kind))


class Speaker:
    """Messages of ROS 2, or of ROS 1."""

    def __init__(self, ros1: bool = False) -> None:
        self.ros1 = ros1
        self.types = _TYPES.of("ros1" if ros1 else "cdr")
        for kind, text in _OTHERS.items():
            if kind not in self.types.types:
                from rosbags.typesys import get_types_from_msg

                found = get_types_from_msg(text, kind)
                self.types.register({name: one for name, one in found.items() if name not in self.types.types})
        self.T = self.types.types

    def header(self, stamp: int, frame: str) -> Any:
        time = self.T["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9))
        first = (0,) if self.ros1 else ()
        return self.T["std_msgs/msg/Header"](*first, time, frame)

    def message(self, topic: str, kind: str, stamp: int, message: Any, late: int = 0) -> Message:
        return Message(topic, kind, stamp + late, pack(kind, message, self.ros1), "ros1" if self.ros1 else "cdr")

    def turned(self, yaw: float) -> Any:
        return self.T["geometry_msgs/msg/Quaternion"](0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))

    def imu(self, topic: str, stamp: int, yaw: float, rate: float, known: float = 0.0, late: int = 0) -> Message:
        """By yaw and rate as they are on the wire."""
        vector, kind = self.T["geometry_msgs/msg/Vector3"], "sensor_msgs/msg/Imu"
        covariance = np.array([known, *([0.0] * 8)])
        said = self.T[kind](self.header(stamp, "imu"), self.turned(yaw), covariance, vector(0.0, 0.0, rate),
                            np.zeros(9), vector(0.0, 0.0, 9.8), np.zeros(9))  # fmt: skip
        return self.message(topic, kind, stamp, said, late)

    def pose(self, topic: str, stamp: int, north: float, east: float, yaw: float, frame: str = "map") -> Message:
        kind = "geometry_msgs/msg/PoseStamped"
        at = self.T["geometry_msgs/msg/Pose"](self.T["geometry_msgs/msg/Point"](east, north, 0.0), self.turned(yaw))
        return self.message(topic, kind, stamp, self.T[kind](self.header(stamp, frame), at))

    def twist(self, topic: str, stamp: int, x: float, y: float, turn: float, frame: str) -> Message:
        kind, vector = "geometry_msgs/msg/TwistStamped", self.T["geometry_msgs/msg/Vector3"]
        said = self.T["geometry_msgs/msg/Twist"](vector(x, y, 0.0), vector(0.0, 0.0, turn))
        return self.message(topic, kind, stamp, self.T[kind](self.header(stamp, frame), said))

    def fix(self, topic: str, stamp: int, north: float, east: float) -> Message:
        kind = "sensor_msgs/msg/NavSatFix"
        latitude, longitude = DATUM.place(north, east)
        said = self.T[kind](self.header(stamp, "gps"), self.T["sensor_msgs/msg/NavSatStatus"](0, 1), latitude,
                            longitude, 1.0, np.zeros(9), 0)  # fmt: skip
        return self.message(topic, kind, stamp, said)

    def number(self, topic: str, stamp: int, value: float, kind: str = "std_msgs/msg/Float64") -> Message:
        return self.message(topic, kind, stamp, self.T[kind](value))

    def sentence(self, topic: str, stamp: int, text: str) -> Message:
        kind = "nmea_msgs/msg/Sentence"
        return self.message(topic, kind, stamp, self.T[kind](self.header(stamp, "ship"), text))

    def pulses(self, topic: str, stamp: int, channels: Sequence[int]) -> Message:
        kind = "mavros_msgs/msg/RCOut"
        said = self.T[kind](self.header(stamp, ""), np.array(channels, dtype=np.uint16))
        return self.message(topic, kind, stamp, said)


_OTHERS = {
    "nmea_msgs/msg/Sentence": "std_msgs/Header header\nstring sentence",
    "mavros_msgs/msg/RCOut": "std_msgs/Header header\nuint16[] channels",
}


def write_chunks(path: Path, messages: Sequence[Message], packed: str = "ZSTD", chunk: int = 1 << 20) -> None:
    """An MCAP file, by the writer of mcap, with the definitions of its messages."""
    from mcap.writer import CompressionType, Writer

    types = Speaker().types
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk, compression=CompressionType[packed])
        writer.start(profile="ros2", library="tests")
        topics: dict[str, int] = {}
        for one in messages:
            if one.topic not in topics:
                definition = types.generate_msgdef(one.kind, ros_version=2)[0].encode()
                schema = writer.register_schema(one.kind, "ros2msg", definition)
                topics[one.topic] = writer.register_channel(one.topic, "cdr", schema)
            writer.add_message(topics[one.topic], one.logged, one.data, one.logged)
        writer.finish()


def write_ros1(path: Path, messages: Sequence[Message], packed: str = "", chunk: int = 0) -> None:
    """A bag of ROS 1, by the writer of rosbags."""
    from rosbags.rosbag1 import Writer

    writer = Writer(path)
    if packed:
        writer.set_compression(Writer.CompressionFormat[packed])
    if chunk:
        writer.chunk_threshold = chunk
    with closing(writer):
        writer.open()
        topics: dict[str, Any] = {}
        for one in messages:
            if one.topic not in topics:
                topics[one.topic] = writer.add_connection(one.topic, one.kind, typestore=Speaker(True).types)
            writer.write(topics[one.topic], one.logged, one.data)


WRITERS: dict[str, tuple[str, bool, Callable[[Path, Sequence[Message]], None]]] = {
    "mcap": (".mcap", False, write_chunks),
    "rosbag2": ("", False, lambda path, messages: write_bag(path, messages, {})),
    "rosbag1": (".bag", True, write_ros1),
}
"""Suffix, whether messages are of ROS 1, and the writer of each format."""


def written(folder: Path, format: str, messages: Sequence[Message]) -> Path:
    suffix, _, write = WRITERS[format]
    path = folder / f"run{suffix}"
    write(path, sorted(messages, key=lambda one: one.logged))
    return path
