"""Logs of autopilots, written by hand: ULog of PX4 by its layout, telemetry of MAVLink by pymavlink's own packing."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
ULOG = b"ULog\x01\x12\x35"
CODES = {"uint64_t": "Q", "double": "d", "float": "f", "int32_t": "i", "uint8_t": "B", "bool": "?",
          "int8_t": "b", "char": "b", "int16_t": "h", "uint16_t": "H", "uint32_t": "I", "int64_t": "q"}  # fmt: skip


def part(kind: str, data: bytes) -> bytes:
    return struct.pack("<HB", len(data), ord(kind)) + data


def ulog(topics: dict[str, tuple[str, Sequence[tuple[float, ...]]]], begin: int = 0) -> bytes:
    """A log of topics: the types and names of their fields, ``double lat;float x``, and rows that begin with seconds.

    Rows of all topics are written in the order of time, as a recorder does.
    """
    out = ULOG + b"\x01" + struct.pack("<Q", begin) + part("B", bytes(40))
    for name, (fields, _) in topics.items():
        out += part("F", f"{name.partition('#')[0]}:uint64_t timestamp;{fields};".encode())
    rows: list[tuple[float, bytes]] = []
    for number, (name, (fields, values)) in enumerate(topics.items()):
        title, _, instance = name.partition("#")
        out += part("A", struct.pack("<BH", int(instance or 0), number) + title.encode())
        form = "<HQ" + "".join(_form(one) for one in fields.split(";"))
        rows += [(row[0], part("D", struct.pack(form, number, round(1e6 * row[0]), *row[1:]))) for row in values]
    return out + b"".join(data for _, data in sorted(rows, key=lambda one: one[0]))


def _form(field: str) -> str:
    kind = field.split()[0]
    stem, _, count = kind.partition("[")
    return f"{count.rstrip(']')}{CODES[stem]}" if count else CODES[stem]


def quaternion(psi: float, phi: float = 0.0) -> tuple[float, float, float, float]:
    """From forward, starboard, down to north, east, down."""
    a, b = 0.5 * psi, 0.5 * phi
    return math.cos(a) * math.cos(b), math.cos(a) * math.sin(b), math.sin(a) * math.sin(b), math.sin(a) * math.cos(b)


class Link:
    """A telemetry log as a ground station writes it."""

    def __init__(self, system: int = 1, version: int = 2) -> None:
        from pymavlink.dialects.v10 import ardupilotmega as one
        from pymavlink.dialects.v20 import ardupilotmega as two

        self.dialect = two if version == 2 else one
        self.codec: Any = self.dialect.MAVLink(None, srcSystem=system, srcComponent=1)
        self.records: list[tuple[float, bytes]] = []

    def say(self, at: float, message: Any) -> None:
        """A message at a time of the ground station [s since 1970]."""
        self.records.append((at, bytes(message.pack(self.codec))))

    def attitude(self, at: float, boot: float, psi: float, r: float) -> None:
        yaw = math.remainder(psi, math.tau)
        self.say(at, self.dialect.MAVLink_attitude_message(round(1e3 * boot), 0.01, -0.02, yaw, 0.0, 0.0, r))

    def place(self, at: float, boot: float, latitude: float, longitude: float, north: float, east: float) -> None:
        self.say(at, self.dialect.MAVLink_global_position_int_message(
            round(1e3 * boot), round(1e7 * latitude), round(1e7 * longitude), 0, 0, round(100 * north),
            round(100 * east), 0, 65535))  # fmt: skip

    def parameter(self, at: float, name: str, value: float) -> None:
        self.say(at, self.dialect.MAVLink_param_value_message(name.encode(), value, 9, 100, 0))

    def servos(self, at: float, *widths: int) -> None:
        self.say(at, self.dialect.MAVLink_servo_output_raw_message(
            round(1e6 * at) % 2**32, 0, *widths, *([0] * (8 - len(widths)))))  # fmt: skip


def tlog(*links: Link) -> bytes:
    records = sorted((one for link in links for one in link.records), key=lambda one: one[0])
    return b"".join(struct.pack(">Q", round(1e6 * at)) + frame for at, frame in records)
