"""NMEA sentences over a serial line (IEC 61162-1: 4800 baud, 8 data bits, no parity); needs the extra `serial`.

An address is ``serial:///dev/ttyUSB0`` or ``serial:///dev/ttyUSB0?baud=38400``.  At 4800 baud a line carries 480
characters a second: what does not fit is dropped as whole sentences and counted, never delayed without bound.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from typing import Any
from urllib.parse import parse_qs, urlsplit

from .wire import Intake, Message, WireError

_UNFINISHED, _WAITING = 1024, 4096
"""Largest size of an unfinished line, and of what waits to be sent [bytes]."""

BAUDS = (4800, 9600, 19200, 38400, 57600, 115200)


def is_serial(text: str) -> bool:
    """Whether an address is that of a serial line."""
    return text.startswith("serial:")


class SerialLine:
    """A serial line, polled as a `wire.Wire` is.

    Attributes:
        address: as it was given.
        path: of the device.
        intake: filter of the input.
        t: simulated time [s], set before each `poll`.
        peers: always 1: whoever is at the other end.
    """

    peers = 1

    def __init__(self, text: str, intake: Intake | None = None) -> None:
        """Open the line; WireError: no such device, a wrong address, or the extra is not installed."""
        self.address, self.intake, self.t = text, intake or Intake(), 0.0
        self.path, baud = _parsed(text)
        try:
            import serial
        except ImportError:
            raise WireError("a serial line needs the extra 'serial': pip install 'seatrial[serial]'") from None
        try:
            self._port: Any = serial.Serial(self.path, baud, timeout=0, write_timeout=0)
        except (OSError, ValueError) as error:
            raise WireError(f"{text}: {error}".splitlines()[0]) from None
        self._name = f"serial {self.path}"
        self._unfinished, self._unsent, self._skipping = b"", b"", False

    @property
    def counts(self) -> Counter[str]:
        """Counts of the input by outcome, and of the output."""
        return self.intake.counts

    def poll(self) -> list[Message]:
        """Valid sentences received since the last call."""
        self._push()
        try:
            data: bytes = self._port.read(4096)
        except OSError:  # the device has gone
            self.counts["lost"] += 1
            return []
        now = time.monotonic()
        *whole, rest = (self._unfinished + data).split(b"\n")
        found: list[Message] = []
        for line in whole:
            if not self._skipping:
                found += [Message(one, self._name) for one in self.intake.take(line, self._name, now)]
            self._skipping = False
        if len(rest) > _UNFINISHED:
            self.counts["oversized"] += not self._skipping
            self._skipping, rest = True, b""
        self._unfinished = rest
        return found

    def wait(self, seconds: float) -> None:
        """Wait for input, at most so many seconds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and not self._port.in_waiting:
            self._push()
            time.sleep(0.005)

    def send(self, data: bytes) -> None:
        """Send; whole sentences that do not fit behind what waits are dropped."""
        self.counts["sent"] += 1
        for line in data.splitlines(keepends=True):
            if len(self._unsent) + len(line) > _WAITING:
                self.counts["unsent"] += 1
            else:
                self._unsent += line
        self._push()

    def close(self) -> None:
        """Close the line."""
        self._port.close()

    def _push(self) -> None:
        if self._unsent:
            try:  # not by pyserial, whose write spins for ever where the other end does not read
                written = os.write(self._port.fileno(), self._unsent)
            except OSError:  # full, or gone
                written = 0
            self._unsent = self._unsent[written:]


def _parsed(text: str) -> tuple[str, int]:
    parts = urlsplit(text)
    given = parse_qs(parts.query, keep_blank_values=True)
    baud = given.get("baud", ["4800"])[0]
    if not parts.path.startswith("/") or set(given) - {"baud"} or not baud.isdecimal() or int(baud) not in BAUDS:
        raise WireError(f"'{text}': not a serial line; write serial:///dev/ttyUSB0 or serial:///dev/ttyUSB0?baud=38400")
    return parts.path, int(baud)
