"""NMEA 2000 on a CAN bus by python-can: what the instruments say, each at its rate; extra `can`.

| PGN | what | rate |
|---|---|---|
| 127245 | rudder angle, positive to starboard | 10 Hz |
| 127250 | heading, true | 10 Hz |
| 127251 | rate of turn, positive to starboard | 10 Hz |
| 127488 | engine speed, without a sign | 10 Hz |
| 127493 | gear: forward, neutral or reverse | 10 Hz |
| 128259 | speed ahead, through the water and over ground | 1 Hz |
| 129025 | position | 10 Hz |
| 129026 | course and speed over ground | 4 Hz |
| 130306 | wind, apparent and true | 10 Hz |
| 130578 | speeds ahead and to starboard, with signs, in two frames | 4 Hz |

A field without a reading holds the value that means "not available".  So does one that has no sign where the value is
below zero: astern, 127488 has the amount with gear Reverse in 127493, and 128259 no speed; 130578 has it.  Frames are
sent by the source address 35; the bus may be virtual (``virtual:NAME``), or any interface that python-can knows
(``socketcan:can0``).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from ...core.errors import WireError
from ...data.nmea.ship import Fittings
from ..loop import Loop
from ..range.stage import Stage

SOURCE = 35
"""Our address on the bus."""
_APPARENT, _TRUE_BOAT = 2, 3  # reference of PGN 130306: apparent; true, from the bow
_NO_ORDER = 0x7FFF
_FORWARD, _NEUTRAL, _REVERSE = range(3)


def identifier(pgn: int, source: int = SOURCE, priority: int = 2) -> int:
    """The 29 bits of a frame of this group, to all: these groups are broadcast."""
    return priority << 26 | pgn << 8 | source


Known = Mapping[str, float]
"""What the instruments say, by the names of `data.nmea.ship.Measured`."""


def _rudders(said: Known, fit: Fittings, _: int) -> Iterator[bytes]:
    for k, name in enumerate(fit.rudders):
        if name in said:
            yield struct.pack("<BBhhH", k, 0xF8 | 7, _NO_ORDER, _signed(said[name], 1e-4), 0xFFFF)


def _heading(said: Known, _: Fittings, sid: int) -> Iterator[bytes]:
    if "psi" in said:
        yield struct.pack("<BHhhB", sid, _angle(said["psi"]), 0x7FFF, 0x7FFF, 0xFC)


def _turn(said: Known, _: Fittings, sid: int) -> Iterator[bytes]:
    if "r" in said:
        yield struct.pack("<BiBH", sid, _signed(said["r"], 3.125e-8, 32), 0xFF, 0xFFFF)


def _engines(said: Known, fit: Fittings, _: int) -> Iterator[bytes]:
    for k, name in enumerate(fit.shafts):
        if name in said:
            yield struct.pack("<BHHbH", k, _unsigned(abs(said[name]) * 60.0, 0.25), 0xFFFF, 0x7F, 0xFFFF)


def _gears(said: Known, fit: Fittings, _: int) -> Iterator[bytes]:
    for k, name in enumerate(fit.shafts):
        if name in said:
            gear = _FORWARD if said[name] > 0.0 else _REVERSE if said[name] < 0.0 else _NEUTRAL
            yield struct.pack("<BBHHBB", k, 0xFC | gear, 0xFFFF, 0xFFFF, 0, 0xFF)


def _speed(said: Known, _: Fittings, sid: int) -> Iterator[bytes]:
    if "u_w" in said:
        known = {"u", "v_m"} <= said.keys() and said["u"] >= 0.0
        over = _unsigned(math.hypot(said["u"], said["v_m"]), 0.01) if known else 0xFFFF
        through = _unsigned(said["u_w"], 0.01) if said["u_w"] >= 0.0 else 0xFFFF
        yield struct.pack("<BHHBBB", sid, through, over, 0, 0xF0 | (said["u_w"] < 0.0), 0xFF)


def _speeds(said: Known, _: Fittings, sid: int) -> Iterator[bytes]:
    names = ("u_w", "v_w", "u", "v_m", "v_w_stern", "v_stern")
    if not said.keys().isdisjoint(names):
        yield from _fast(struct.pack("<6h", *(_signed(said[n], 1e-3) if n in said else 0x7FFF for n in names)), sid)


def _fast(data: bytes, sid: int) -> Iterator[bytes]:
    """A message of more than 8 bytes as frames of a fast packet: 6 bytes with the length in front, then 7 each."""
    order, parts = (sid & 7) << 5, [data[:6], *(data[k : k + 7] for k in range(6, len(data), 7))]
    for k, part in enumerate(parts):
        yield (bytes([order | k, *([len(data)] if k == 0 else [])]) + part).ljust(8, b"\xff")


def _position(said: Known, _: Fittings, __: int) -> Iterator[bytes]:
    if "latitude" in said:
        yield struct.pack("<ii", round(said["latitude"] * 1e7), round(said["longitude"] * 1e7))


def _course(said: Known, _: Fittings, sid: int) -> Iterator[bytes]:
    if "U" in said:
        yield struct.pack("<BBHHH", sid, 0xFC, _angle(said["chi"]), _unsigned(said["U"], 0.01), 0xFFFF)


def _wind(said: Known, _: Fittings, sid: int) -> Iterator[bytes]:
    for speed, angle, reference in (("U_A", "gamma_A", _APPARENT), ("U_T", "gamma_T_bow", _TRUE_BOAT)):
        if speed in said:
            yield struct.pack("<BHHBH", sid, _unsigned(said[speed], 0.01), _angle(said[angle]), 0xF8 | reference,
                              0xFFFF)  # fmt: skip


GROUPS: Mapping[int, tuple[float, Callable[[Known, Fittings, int], Iterator[bytes]]]] = {
    127245: (10.0, _rudders), 127250: (10.0, _heading), 127251: (10.0, _turn), 127488: (10.0, _engines),
    127493: (10.0, _gears), 128259: (1.0, _speed), 129025: (10.0, _position), 129026: (4.0, _course),
    130306: (10.0, _wind), 130578: (4.0, _speeds),
}  # fmt: skip
"""By PGN: its rate [Hz], and the data of its frames from readings, fittings and a sequence number, 8 bytes each."""


def _angle(value: float) -> int:
    return round((value % math.tau) / 1e-4) % 62832


def _unsigned(value: float, unit: float) -> int:
    return min(round(value / unit), 0xFFFC)


def _signed(value: float, unit: float, bits: int = 16) -> int:
    most = (1 << (bits - 1)) - 4
    return min(max(round(value / unit), -most), most)


class Bus:
    """A CAN bus on which the own ship of a stage tells what its instruments say.

    Attributes:
        sent, unsent: numbers of frames.
    """

    def __init__(self, stage: Stage, text: str) -> None:
        """Open ``INTERFACE:CHANNEL`` and send from the next tick on.

        Raises:
            WireError: no such bus, or python-can is not installed.
        """
        interface, colon, channel = text.partition(":")
        if not (interface and colon and channel):
            raise WireError(f"'{text}': not a bus; write virtual:NAME or socketcan:can0")
        try:
            import can
        except ImportError:
            raise WireError("NMEA 2000 needs the extra 'can': pip install 'seatrial[can]'") from None
        try:
            self._bus: Any = can.Bus(interface=interface, channel=channel)
        except (can.CanError, OSError, ValueError) as error:
            raise WireError(f"{text}: {error}".splitlines()[0]) from None
        self._frame, self._error = can.Message, can.CanError
        self._stage, self.sent, self.unsent = stage, 0, 0
        self._due = dict.fromkeys(GROUPS, 0)
        stage.loop.after(self.tick)

    def tick(self, loop: Loop) -> None:
        """Send what is due."""
        on_wire, fittings = self._stage.on_wire, self._stage.fittings
        if on_wire is None:
            return
        for pgn, (rate, frames) in GROUPS.items():
            number = math.floor(loop.t * rate + 1e-6)
            if number == self._due[pgn]:
                continue
            self._due[pgn] = number
            for data in frames(on_wire.latest, fittings, number % 253):
                self._send(identifier(pgn), data)

    def _send(self, arbitration: int, data: bytes) -> None:
        try:
            self._bus.send(self._frame(arbitration_id=arbitration, data=data, is_extended_id=True), timeout=0)
            self.sent += 1
        except (self._error, OSError):  # nobody listens, or the queue is full
            self.unsent += 1

    def close(self) -> None:
        """Close the bus."""
        self._bus.shutdown()
