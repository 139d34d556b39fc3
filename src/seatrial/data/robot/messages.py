"""Standard messages of robots and the channels of a trial.

In a log, earth is east, north, up and the ship forward, port, up (REP 103); a position is that of the child frame in
the frame of the header.  In a trial, earth is north, east, down and the ship forward, starboard, down.  So
``yaw = pi/2 - psi``, and sway and rate of turn change their sign; the roll, about the same forward axis, does
not.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import MappingProxyType
from typing import Any

import numpy as np

from .. import DataError

ODOMETRY, FIX, TWIST, NUMBER = (
    "nav_msgs/msg/Odometry", "sensor_msgs/msg/NavSatFix", "geometry_msgs/msg/TwistStamped", "std_msgs/msg/Float64",
)  # fmt: skip
TYPES = (ODOMETRY, FIX, TWIST, NUMBER)
"""Message types that are read and written."""
NUMBERS = (NUMBER, "std_msgs/msg/Float32")
"""Types of bare numbers that are read."""

POSE = ("x", "y", "psi")
VELOCITY = ("u", "v_m", "r")

FRAMES: Mapping[str, str] = MappingProxyType({"earth": "map", "ship": "base_link", "antenna": "gnss"})
"""Default names of the frames: earth, midship, antenna."""


@dataclass(frozen=True)
class Values:
    """One message, in the terms of a trial.

    Attributes:
        stamp: its own time [ns]; None where the message has none.
        values: by channel, SI; latitude and longitude [deg]; `value` of a bare number.
        frames: of the header and, for an odometry, of the child.
    """

    stamp: int | None
    values: Mapping[str, float]
    frames: tuple[str, ...] = ()


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
    """The definitions of the messages.

    Raises:
        DataError: the extra is not installed.
    """
    types = extra("rosbags.typesys")
    return types.get_typestore(types.Stores.ROS2_HUMBLE)


def unpacked(kind: str, data: bytes) -> Values:
    """The values of a message of one of `TYPES`.

    Raises:
        DataError: bytes that are no such message.
    """
    try:
        message = store().deserialize_cdr(data, kind)
    except DataError:
        raise
    except Exception:  # the codec raises many kinds of errors on damaged bytes
        raise DataError(f"not a whole {kind}") from None
    if kind in NUMBERS:
        return Values(None, {"value": float(message.data)})
    header = message.header
    stamp = header.stamp.sec * 1_000_000_000 + header.stamp.nanosec
    if kind == FIX:
        fixed = message.status.status >= 0
        place = {"latitude": message.latitude, "longitude": message.longitude} if fixed else {}
        return Values(stamp, place, (header.frame_id,))
    if kind == TWIST:
        return Values(stamp, _velocities(message.twist), (header.frame_id,))
    at, psi, phi = message.pose.pose.position, *_angles(message.pose.pose.orientation)
    values = {"x": at.y, "y": at.x, "psi": psi, "phi": phi, **_velocities(message.twist.twist)}
    return Values(stamp, values, (header.frame_id, message.child_frame_id))


def _velocities(twist: Any) -> dict[str, float]:
    return {"u": twist.linear.x, "v_m": -twist.linear.y, "r": -twist.angular.z}


def _angles(q: Any) -> tuple[float, float]:
    """Heading and roll of an orientation; NaN where it is undefined (all zeros)."""
    size = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if not abs(size - 1.0) < 1e-3:
        return math.nan, math.nan
    yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), size - 2.0 * (q.y * q.y + q.z * q.z))
    roll = math.atan2(2.0 * (q.w * q.x + q.y * q.z), size - 2.0 * (q.x * q.x + q.y * q.y))
    psi = 0.5 * math.pi - yaw
    return psi - 2.0 * math.pi if psi > math.pi else psi, roll


def packed(kind: str, stamp: int, values: Mapping[str, float], frames: Mapping[str, str] = FRAMES) -> bytes:
    """A message of one of `TYPES`; a value that is absent is written as NaN.

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
