"""Lines in which loggers write frames or messages of NMEA 2000, and frames of fast packets put together."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from datetime import UTC, datetime
from functools import reduce
from operator import xor
from typing import Literal

from ...core.values import dataclass
from .groups import FAST

BUS = 256
"""Addresses of a bus."""
_MOST = 223
"""Bytes of a fast packet."""

Clock = Literal["epoch", "day", "start", ""]
"""What a stamp counts from: 1970, midnight, some start; empty where there is no stamp."""


@dataclass(frozen=True)
class Frame:
    """A frame or a whole message.

    Attributes:
        clock, t: its stamp [s]; 0 without one.
        pgn, source: parameter group and address of the sender; of a second bus (``can1``) 256 more, and so on.
        data: its bytes.
    """

    clock: Clock
    t: float
    pgn: int
    source: int
    data: bytes


def frame_of(line: str) -> Frame | None:
    """The frame of a line; None for one that is in no layout, or whose bytes are not as many as it says."""
    logged = _LOGGED.match(line)  # by a server of Signal K
    for pattern, reader in _LAYOUTS:
        found = pattern.match(line, logged.end() if logged else 0)
        if found is not None:
            try:
                frame = reader(found)
            except (ValueError, OverflowError):
                return None
            return frame if frame is not None and len(frame.data) <= _MOST else None
    return None


class Packets:
    """Fast packets put together: by group, source and sequence; one with a missing frame is left out.

    Attributes:
        lost: frames without their packet.
    """

    def __init__(self) -> None:
        self._open: dict[tuple[int, int, int], tuple[Frame, int, int]] = {}
        self.lost = 0

    def whole(self, frame: Frame) -> Frame | None:
        """The message that is whole with this frame, with the stamp of its first one; None before the last one."""
        if frame.pgn not in FAST or len(frame.data) > 8:
            return frame
        if len(frame.data) < 2:
            return None
        key, index = (frame.pgn, frame.source, frame.data[0] >> 5), frame.data[0] & 31
        if index == 0:
            self.lost += key in self._open
            first, size = Frame(frame.clock, frame.t, frame.pgn, frame.source, frame.data[2:]), frame.data[1]
        else:
            before = self._open.pop(key, None)
            if before is None or before[1] != index:
                self.lost += 1
                return None
            first, size = before[0], before[2]
            first = Frame(first.clock, first.t, first.pgn, first.source, first.data + frame.data[1:])
        if len(first.data) >= size:
            self._open.pop(key, None)
            return Frame(first.clock, first.t, first.pgn, first.source, first.data[:size]) if size <= _MOST else None
        self._open[key] = first, index + 1, size
        return None


def sender(source: int) -> str:
    """The name of a sender: its address, and its bus where this is not the first."""
    return f"{source}" if source < BUS else f"can{source // BUS}/{source % BUS}"


def _of_id(
    clock: Clock, t: float, identifier: str, data: str, count: str | None = None, bus: str = ""
) -> Frame | None:  # fmt: skip
    """A frame by its 29 bits: below 240 the second byte of the group is the address of the receiver."""
    number, raw = int(identifier, 16), bytes.fromhex(data.replace(",", " "))
    if len(raw) > 8 or (count is not None and int(count) != len(raw)):
        return None
    pgn = number >> 8 & 0x3FFFF
    pgn = pgn if (pgn >> 8 & 0xFF) >= 240 else pgn & 0x3FF00
    return Frame(clock, t, pgn, (number & 0xFF) + BUS * int(bus or 0), raw)


def moment(date: str, clock: str, fraction: str | None, zone: str | None) -> float:
    whole = datetime.fromisoformat(f"{date}T{clock}{(zone or '+00:00').replace('Z', '+00:00')}")
    return whole.astimezone(UTC).timestamp() + float(f"0.{fraction or 0}")


def _day(text: str) -> float:
    hours, minutes, seconds = (text[:2], text[2:4], text[4:]) if ":" not in text else text.split(":")
    return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)


def _canboat(m: re.Match[str]) -> Frame | None:
    raw = bytes.fromhex(m[10].replace(",", " "))
    return Frame("epoch", moment(m[1], m[2], m[3], m[4]), int(m[6]), int(m[7]), raw) if len(raw) == int(m[9]) else None


def _candump(m: re.Match[str]) -> Frame | None:
    dated = _DATED.fullmatch(m[1] or "")
    if dated:
        return _of_id("epoch", moment(dated[1], dated[2], dated[3], None), m[3], m[5], m[4], m[2])
    return _of_id(*_seconds(m[1]), m[3], m[5], m[4], m[2])


def _seconds(text: str | None) -> tuple[Clock, float]:
    """A stamp in seconds: since 1970, or since the start where it is smaller than a year."""
    t = float(text) if text else 0.0
    return ("epoch" if t > 365 * 86400.0 else "start") if text else "", t


def _ikonvert(m: re.Match[str]) -> Frame:
    return Frame("start", float(m[4]), int(m[1]), int(m[3]), base64.b64decode(m[5] + "=" * (-len(m[5]) % 4)))


def _pcdin(m: re.Match[str]) -> Frame | None:
    if m[6] and reduce(xor, m[1].encode()) != int(m[6], 16):
        return None
    return Frame("start", int(m[3], 16) / 1000.0, int(m[2], 16), int(m[4], 16), bytes.fromhex(m[5]))


_DATED = re.compile(r"(\d{4}-\d\d-\d\d)[T -](\d\d:\d\d:\d\d)(?:\.(\d{1,9}))?")
_ISO = r"(\d{4}-\d\d-\d\d)[T -](\d\d:\d\d:\d\d)(?:[.,](\d{1,9}))?(Z|[+-]\d\d:?\d\d)?"
_LOGGED = re.compile(r"\d{13};A;")
_HEX = r"((?:[0-9A-Fa-f]{2}[ ,]?)*)\s*"
_ID = r"([0-9A-Fa-f]{8})"
CANBOAT = re.compile(_ISO + r",(\d),(\d{5,6}),(\d{1,3}),(\d{1,3}),(\d{1,3}),?" + _HEX + "$")
"""A line of canboat: stamp, priority, PGN, source, destination, length, bytes."""
CANDUMP = re.compile(r"\((\d+\.\d+)\) [^\s\d]*(\d{0,3})\S* " + _ID + r"#([0-9A-Fa-f]*)(?: [RT])?\s*$")
RAW = re.compile(r"(\d\d:\d\d:\d\d(?:\.\d+)?) [RT] " + _ID + " ?" + _HEX + "$")
"""A line of Yacht Devices RAW: time of day, received or transmitted, CAN identifier, bytes."""
_LAYOUTS: tuple[tuple[re.Pattern[str], Callable[[re.Match[str]], Frame | None]], ...] = (
    # PLAIN and FAST of canboat
    (CANBOAT, _canboat),
    # candump -l; with and without stamps; as of old
    (CANDUMP, lambda m: _of_id(*_seconds(m[1]), m[3], m[4], bus=m[2])),
    (re.compile(r"\s*(?:\(?([\d:.T -]*\d)\)?\s+)?[a-z]+(\d{1,3})\s+(?:[RT]X [B-] [E-]\s+)?" + _ID + r"\s+\[(\d)\]\s*"
                + _HEX + "$"), _candump),
    (re.compile(r"<0x" + _ID + r">\s+\[(\d)\]\s*" + _HEX + "$"), lambda m: _of_id("", 0.0, m[1], m[3], m[2])),
    # Yacht Devices RAW
    (RAW, lambda m: _of_id("day", _day(m[1]), m[2], m[3])),
    # Actisense ASCII: hhmmss, source, destination and priority, group, data
    (re.compile(r"A(\d{6}(?:\.\d+)?) ([0-9A-Fa-f]{2})[0-9A-Fa-f]{3} ([0-9A-Fa-f]{4,5}) ([0-9A-Fa-f]*)\s*$"),
     lambda m: Frame("day", _day(m[1]), int(m[3], 16), int(m[2], 16), bytes.fromhex(m[4]))),
    # iKonvert, seconds since its start; SeaSmart in sentences of NMEA 0183, milliseconds since the start
    (re.compile(r"!PDGY,(\d+),(\d),(\d+),\d+,(\d+(?:\.\d*)?),([A-Za-z0-9+/]*)=*\s*$"), _ikonvert),
    (re.compile(r"\$(PCDIN,([0-9A-Fa-f]{6}),([0-9A-Fa-f]{1,8}),([0-9A-Fa-f]{2}),([0-9A-Fa-f]*))(?:\*([0-9A-Fa-f]{2}))?\s*$"),
     _pcdin),
    # Airmar; PCAN-View
    (re.compile(_ISO + r" - \d+ " + _ID + " " + _HEX + "$"),
     lambda m: _of_id("epoch", moment(m[1], m[2], m[3], m[4]), m[5], m[6])),
    (re.compile(r"\s*\d+\)\s+(\d+(?:\.\d*)?)\s+[RT]x\s+" + _ID + r"\s+(\d)\s+" + _HEX + "$"),
     lambda m: _of_id("start", float(m[1]) / 1000.0, m[2], m[4], m[3])),
    # the same from version 2 on: type, perhaps a bus, and perhaps a reserved column
    (re.compile(r"\s*\d+\s+(\d+\.\d+)\s+DT\s+(?:\d\s+)?" + _ID + r"\s+[RT]x\s+(?:-\s+)?(\d)\s+" + _HEX + "$"),
     lambda m: _of_id("start", float(m[1]) / 1000.0, m[2], m[4], m[3])),
    # Vector ASC, seconds and a bus from 1 on; GVRET of SavvyCAN, microseconds; CSV of python-can
    (re.compile(r"\s*(\d+\.\d+)\s+(\d+)\s+([0-9A-Fa-f]{7,8})x\s+[RT]x\s+d\s+(\d)"
                r"((?: +[0-9A-Fa-f]{2})*)\s*(?: [A-Z].*)?$"),
     lambda m: _of_id(*_seconds(m[1]), m[3], m[5], m[4], str(int(m[2]) - 1))),
    (re.compile(r"(\d+),(?:0x)?" + _ID + r",(?:true|1),(?:[RT]x,)?(\d),(\d),((?:[0-9A-Fa-f]{2},?)*),?\s*$", re.I),
     lambda m: _of_id(*_seconds(f"{int(m[1]) / 1e6:.6f}"), m[2], m[5], m[4], m[3])),
    (re.compile(r"(\d+\.\d+),0x([0-9a-f]{7,8}),1,0,0,(\d),([A-Za-z0-9+/]*=*)\s*$"),
     lambda m: _of_id(*_seconds(m[1]), m[2], base64.b64decode(m[4]).hex(), m[3])),
)  # fmt: skip
