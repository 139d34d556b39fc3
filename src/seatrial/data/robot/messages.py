"""Standard messages of robots and the channels of a trial.

In a log, earth is east, north, up and the ship forward, port, up (REP 103); a position is that of the child frame in
the frame of the header.  In a trial, earth is north, east, down and the ship forward, starboard, down.  So
``yaw = pi/2 - psi``, and sway and rate of turn change their sign; the roll, about the same forward axis, does
not.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from types import MappingProxyType
from typing import Any

import numpy as np

from ...core.values import dataclass
from .. import DataError

ODOMETRY, FIX, TWIST, NUMBER = (
    "nav_msgs/msg/Odometry", "sensor_msgs/msg/NavSatFix", "geometry_msgs/msg/TwistStamped", "std_msgs/msg/Float64",
)  # fmt: skip
"""Message types that are written, and read besides those of `READ`."""

POSE = ("x", "y", "psi")
"""Channels that tell where the vessel is and points."""
VELOCITY = ("u", "v_m", "r")
"""Channels that tell how it moves, in its own axes."""

FRAMES: Mapping[str, str] = MappingProxyType({"earth": "map", "ship": "base_link", "antenna": "gnss"})
"""Default names of the frames: earth, midship, antenna."""


@dataclass(frozen=True)
class Message:
    """One message of a file.

    Attributes:
        topic, kind: its topic and its type as ROS 2 names it (`std_msgs/msg/Float64`).
        logged: time of logging [ns].
        data: packed.
        encoding: how: `cdr` or `ros1`; others are not read.
    """

    topic: str
    kind: str
    logged: int
    data: bytes
    encoding: str = "cdr"


@dataclass(frozen=True)
class Values:
    """One message, in the terms of a trial.

    Attributes:
        stamp: its own time [ns]; None where the message has none.
        values: by channel, SI; latitude and longitude [deg]; `value` of a bare number, `[0]`, `[1]` of an array.
        frames: of the header and, for an odometry, of the child.
        sentence: of NMEA 0183; empty in other messages.
    """

    stamp: int | None
    values: Mapping[str, float]
    frames: tuple[str, ...] = ()
    sentence: str = ""


_EARTH = re.compile(r"(^|/)(map|odom|earth|world|utm|local_origin)(_\w*)?$|(^|[_/])enu($|[_/])")


def earth_fixed(frame: str) -> bool:
    """Whether the name of a frame is one of the earth, such as `map` or `odom`."""
    return _EARTH.search(frame.lower()) is not None


def extra(module: str) -> Any:
    """A module of the libraries for logs of robots.

    Raises:
        DataError: the extra is not installed.
    """
    try:
        return import_module(module)
    except ImportError:
        raise DataError("logs of robots need the extra 'log': pip install 'seatrial[log]'") from None


@cache
def store() -> Any:
    """The definitions of the messages that are written.

    Raises:
        DataError: the extra is not installed.
    """
    return Definitions().of("cdr")


_DEFINED: Mapping[str, str] = MappingProxyType({
    "nmea_msgs/msg/Sentence": "std_msgs/Header header\nstring sentence",
    "mavros_msgs/msg/RCOut": "std_msgs/Header header\nuint16[] channels",
    "mavros_msgs/msg/VfrHud": "std_msgs/Header header\nfloat32 airspeed\nfloat32 groundspeed\nint16 heading\n"
                              "float32 throttle\nfloat32 altitude\nfloat32 climb",
    "mavros_msgs/msg/VFR_HUD": "std_msgs/Header header\nfloat32 airspeed\nfloat32 groundspeed\nint16 heading\n"
                               "float32 throttle\nfloat32 altitude\nfloat32 climb",
    "heron_msgs/msg/Drive": "float32 left\nfloat32 right",
    "marine_msgs/msg/Helm": "std_msgs/Header header\nfloat64 throttle\nfloat64 rudder",
    "marine_msgs/msg/DifferentialDrive": "std_msgs/Header header\nfloat64 left_thrust\nfloat64 right_thrust",
})  # fmt: skip
"""Messages that are read where a file does not define them, as a database of ROS 2 does not; others need a file that
does."""

_LONGEST = 100_000
"""Letters of a definition at most."""


class Definitions:
    """The standard messages of ROS and those that a file defines."""

    def __init__(self) -> None:
        self._stores: dict[str, Any] = {}
        self._told: dict[str, str] = {}

    def learn(self, kind: str, text: str) -> None:
        """Take the definition of a message from a file, where it is one that is read."""
        if kind in READ and len(text) <= _LONGEST:
            self._told.setdefault(kind, text)

    def of(self, encoding: str) -> Any:
        """The types of the messages that are packed so."""
        if encoding not in self._stores:
            types = extra("rosbags.typesys")
            kind = types.Stores.ROS1_NOETIC if encoding == "ros1" else types.Stores.ROS2_HUMBLE
            self._stores[encoding] = types.get_typestore(kind)
        return self._stores[encoding]

    def unpacked(self, kind: str, data: bytes, encoding: str = "cdr") -> Any:
        """A message.

        Raises:
            DataError: bytes that are no such message.
        """
        types = self.of(encoding)
        try:
            if kind not in types.types:
                self._register(types, kind)
            return (types.deserialize_ros1 if encoding == "ros1" else types.deserialize_cdr)(data, kind)
        except DataError:
            raise
        except Exception:  # the codec raises many kinds of errors on damaged bytes
            raise DataError(f"not a whole {kind}") from None

    def _register(self, types: Any, kind: str) -> None:
        text = self._told.get(kind) or _DEFINED.get(kind)
        if text is None:
            raise DataError(f"no definition of {kind} in the file")
        found = extra("rosbags.typesys").get_types_from_msg(text, kind)
        types.register({name: one for name, one in found.items() if name not in types.types})


def unpacked(kind: str, data: bytes, encoding: str = "cdr", definitions: Definitions | None = None) -> Values:
    """The values of a message of one of `READ`.

    Raises:
        DataError: bytes that are no such message.
    """
    message = (definitions or _standard()).unpacked(kind, data, encoding)
    try:
        return READ[kind][1](message)
    except AttributeError as error:
        raise DataError(f"a {kind} as its file defines it has no '{error.name}'") from None


@cache
def _standard() -> Definitions:
    return Definitions()


def _stamp(message: Any) -> int:
    return int(message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec)


def _number(message: Any) -> Values:
    return Values(None, {"value": float(message.data)})


def _numbers(message: Any) -> Values:
    return Values(None, {f"[{k}]": float(one) for k, one in enumerate(message.data[:MOST])})


MOST = 32
"""Numbers of an array that are read."""


def _odometry_of(message: Any) -> Values:
    said = {**_pose_of(message.pose.pose), **_velocities(message.twist.twist)}
    return Values(_stamp(message), said, (message.header.frame_id, message.child_frame_id))


def _pose_of(pose: Any) -> dict[str, float]:
    return {"x": pose.position.y, "y": pose.position.x, **_angles(pose.orientation)}


def _fix_of(message: Any) -> Values:
    fixed = message.status.status >= 0
    place = {"latitude": message.latitude, "longitude": message.longitude} if fixed else {}
    return Values(_stamp(message), place, (message.header.frame_id,))


def _gps_of(message: Any) -> Values:
    """A fix with course [deg] and speed."""
    place = _fix_of(message)
    moving = {"U_G": message.speed, "gamma_G": math.radians(message.track % 360.0)}
    return Values(place.stamp, {**place.values, **moving} if place.values else {}, place.frames)


def _imu_of(message: Any) -> Values:
    """Attitude and rate of turn; a covariance that begins with -1 says that one is not known."""
    said = _angles(message.orientation) if message.orientation_covariance[0] != -1.0 else {}
    if message.angular_velocity_covariance[0] != -1.0:
        said["r"] = -message.angular_velocity.z
    return Values(_stamp(message), said, (message.header.frame_id,))


def _euler_of(message: Any) -> Values:
    """Angles of an inertial unit [deg]: clockwise, starboard down, bow up."""
    angles = message.orientation
    said = {"psi": angles.heading, "phi": angles.roll, "theta": angles.pitch}
    return Values(_stamp(message), {name: math.radians(value) for name, value in said.items()})


def _drive_of(message: Any) -> Values:
    return Values(None, {"[left]": message.left, "[right]": message.right})


def _differential_of(message: Any) -> Values:
    return Values(_stamp(message), {"[left]": message.left_thrust, "[right]": message.right_thrust})


READ: Mapping[str, tuple[str, Callable[[Any], Values]]] = MappingProxyType({
    ODOMETRY: ("Odo", _odometry_of),
    "geometry_msgs/msg/PoseStamped": (
        "Pos", lambda one: Values(_stamp(one), _pose_of(one.pose), (one.header.frame_id,))),
    "geometry_msgs/msg/PoseWithCovarianceStamped": (
        "Pos", lambda one: Values(_stamp(one), _pose_of(one.pose.pose), (one.header.frame_id,))),
    TWIST: ("Twi", lambda one: Values(_stamp(one), _velocities(one.twist), (one.header.frame_id,))),
    "geometry_msgs/msg/TwistWithCovarianceStamped": (
        "Twi", lambda one: Values(_stamp(one), _velocities(one.twist.twist), (one.header.frame_id,))),
    "sensor_msgs/msg/Imu": ("Imu", _imu_of),
    FIX: ("Fix", _fix_of),
    "gps_common/msg/GPSFix": ("Fix", _gps_of), "gps_msgs/msg/GPSFix": ("Fix", _gps_of),
    "marine_msgs/msg/NavEulerStamped": ("Eul", _euler_of),
    "mavros_msgs/msg/VfrHud": (
        "Hud", lambda one: Values(_stamp(one), {"psi": math.radians(one.heading % 360)})),
    "mavros_msgs/msg/VFR_HUD": (
        "Hud", lambda one: Values(_stamp(one), {"psi": math.radians(one.heading % 360)})),
    "mavros_msgs/msg/RCOut": (
        "Out", lambda one: Values(_stamp(one), {f"[{k}]": float(v) for k, v in enumerate(one.channels[:MOST])})),
    "heron_msgs/msg/Drive": ("Out", _drive_of), "marine_msgs/msg/DifferentialDrive": ("Out", _differential_of),
    "marine_msgs/msg/Helm": (
        "Out", lambda one: Values(_stamp(one), {"[throttle]": one.throttle, "[rudder]": one.rudder})),
    "nmea_msgs/msg/Sentence": ("Sen", lambda one: Values(_stamp(one), {}, (one.header.frame_id,), one.sentence)),
    **{f"std_msgs/msg/{kind}": ("Num", _number) for kind in
       ("Float64", "Float32", "Int8", "Int16", "Int32", "UInt8", "UInt16", "UInt32")},
    **{f"std_msgs/msg/{kind}MultiArray": ("Num", _numbers) for kind in ("Float64", "Float32", "Int16", "Int32")},
})  # fmt: skip
"""Message types that are read: three letters, by which a source is named, and their values."""


def _velocities(twist: Any) -> dict[str, float]:
    return {"u": twist.linear.x, "v_m": -twist.linear.y, "r": -twist.angular.z}


def _angles(q: Any) -> dict[str, float]:
    """Heading, roll and pitch of an orientation; nothing where it is undefined (all zeros)."""
    size = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if not abs(size - 1.0) < 1e-3:
        return {}
    yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), size - 2.0 * (q.y * q.y + q.z * q.z))
    roll = math.atan2(2.0 * (q.w * q.x + q.y * q.z), size - 2.0 * (q.x * q.x + q.y * q.y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (q.w * q.y - q.x * q.z) / size)))
    psi = 0.5 * math.pi - yaw
    return {"psi": psi - 2.0 * math.pi if psi > math.pi else psi, "phi": roll, "theta": -pitch}


def packed(kind: str, stamp: int, values: Mapping[str, float], frames: Mapping[str, str] = FRAMES) -> bytes:
    """A message of one of the types that are written; a value that is absent is written as NaN.

    Args:
        kind: its type.
        stamp: its time [ns].
        values: by the names of `unpacked`.
        frames: names of the frames, by the keys of `FRAMES`.
    """
    T = store().types
    if kind == NUMBER:
        return bytes(store().serialize_cdr(T[NUMBER](values["value"]), kind))
    if kind == TWIST:
        message = T[TWIST](_header(T, stamp, frames["ship"]), _twist(T, values))
    else:
        message = (_odometry if kind == ODOMETRY else _fix)(T, stamp, values, frames)
    return bytes(store().serialize_cdr(message, kind))


def _header(T: Any, stamp: int, frame: str) -> Any:
    sec, nanosec = divmod(stamp, 1_000_000_000)
    return T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](sec, nanosec), frame)


def _twist(T: Any, values: Mapping[str, float]) -> Any:
    u, v, r = (values.get(name, math.nan) for name in VELOCITY)
    vector = T["geometry_msgs/msg/Vector3"]
    return T["geometry_msgs/msg/Twist"](vector(u, -v, 0.0), vector(0.0, 0.0, -r))


def _odometry(T: Any, stamp: int, values: Mapping[str, float], frames: Mapping[str, str]) -> Any:
    x, y, psi = (values.get(name, math.nan) for name in POSE)
    half, tilt = 0.5 * (0.5 * math.pi - psi), 0.5 * values.get("phi", 0.0)
    c, s, cp, sp = math.cos(half), math.sin(half), math.cos(tilt), math.sin(tilt)
    turned = T["geometry_msgs/msg/Quaternion"](x=c * sp, y=s * sp, z=s * cp, w=c * cp)
    pose = T["geometry_msgs/msg/Pose"](T["geometry_msgs/msg/Point"](y, x, 0.0), turned)
    unknown = np.zeros(36)
    return T[ODOMETRY](
        _header(T, stamp, frames["earth"]), frames["ship"],
        T["geometry_msgs/msg/PoseWithCovariance"](pose, unknown),
        T["geometry_msgs/msg/TwistWithCovariance"](_twist(T, values), unknown),
    )  # fmt: skip


def _fix(T: Any, stamp: int, values: Mapping[str, float], frames: Mapping[str, str]) -> Any:
    status = T["sensor_msgs/msg/NavSatStatus"](status=0, service=1)
    return T[FIX](_header(T, stamp, frames["antenna"]), status, values["latitude"], values["longitude"], math.nan,
                  np.zeros(9), 0)  # fmt: skip
