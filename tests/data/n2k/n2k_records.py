"""Records of a Voyage Recorder of Yacht Devices."""

from __future__ import annotations

import struct

from seatrial.realtime.links.n2k import identifier

NOON = 1795694400.0


def record(t: float, body: bytes, step: float = 60.0) -> bytes:
    return struct.pack("<H", round(t % step * 1000.0)) + body


def heading(units: int) -> bytes:
    return struct.pack("<I", identifier(127250)) + struct.pack("<BHhhB", 1, units, 0x7FFF, 0x7FFF, 0xFC)


def clock(t: float) -> bytes:
    now = NOON + t
    data = struct.pack("<BBHI", 1, 0xF0, int(now // 86400), round(now % 86400 * 1e4))
    return struct.pack("<I", identifier(126992)) + data


def fix(latitude: float, longitude: float, t: float) -> bytes:
    """129029 as a recorder has it: the sequence, the length and all bytes."""
    now = NOON + t
    data = struct.pack("<BHIqqqBBBhhiB", 1, int(now // 86400), round(now % 86400 * 1e4), round(latitude * 1e16),
                       round(longitude * 1e16), 0, 0x10, 0xFC, 12, 90, 150, 0, 0)  # fmt: skip
    return struct.pack("<I", identifier(129029)) + bytes([0x40, len(data)]) + data
