"""NMEA sentences over a serial line (IEC 61162-1: 4800 baud, 8 data bits, no parity); needs the extra `serial`.

An address is ``serial:///dev/ttyUSB0`` or ``serial:///dev/ttyUSB0?baud=38400``.  At 4800 baud a line carries 480
characters a second: what does not fit is dropped as whole sentences and counted, never delayed without bound.  A line
that is unplugged is opened again as soon as its device is there; what could not be sent meanwhile is counted too.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from contextlib import suppress
from typing import Any
from urllib.parse import parse_qs, urlsplit

from .wire import Intake, Message, WireError

_UNFINISHED, _WAITING = 1024, 4096
"""Largest size of an unfinished line, and of what waits to be sent [bytes]."""

_AGAIN = 0.5
"""Time between two attempts to open a line that was lost [s]."""

BAUDS = (4800, 9600, 19200, 38400, 57600, 115200)
"""Rates that NMEA 0183 (4800), its high-speed form (38400) and devices in use have."""


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
    """

    def __init__(self, text: str, intake: Intake | None = None) -> None:
        """Open the line; WireError: no such device, a wrong address, or the extra is not installed."""
        self.address, self.intake, self.t = text, intake or Intake(), 0.0
        self.path, self._baud = _parsed(text)
        try:
            import serial
        except ImportError:
            raise WireError("a serial line needs the extra 'serial': pip install 'seatrial[serial]'") from None
        self._serial: Any = serial.Serial
        try:
            self._port: Any = self._opened()
        except (OSError, ValueError) as error:
            raise WireError(f"{text}: {error}".splitlines()[0]) from None
        self._name, self._due = f"serial {self.path}", 0.0
        self._unfinished, self._unsent, self._skipping = b"", b"", False

    @property
    def counts(self) -> Counter[str]:
        """Counts of the input by outcome, of the output, and how often the line was lost and reopened."""
        return self.intake.counts

    @property
    def peers(self) -> int:
        """1: whoever is at the other end; 0 while the line is lost."""
        return int(self._port is not None)

    def poll(self) -> list[Message]:
        """Valid sentences received since the last call."""
        self._push()
        if not self._there():
            return []
        try:
            data: bytes = self._port.read(4096)
        except OSError:  # the device has gone
            self._lose()
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
        while time.monotonic() < end and not self._incoming():
            self._push()
            time.sleep(0.005)

    def send(self, data: bytes) -> None:
        """Send; whole sentences that do not fit behind what waits are dropped, and all while the line is lost."""
        lines = data.splitlines(keepends=True)
        if not self._there():
            self.counts["unsent"] += len(lines)
            return
        self.counts["sent"] += 1
        for line in lines:
            if len(self._unsent) + len(line) > _WAITING:
                self.counts["unsent"] += 1
            else:
                self._unsent += line
        self._push()

    def close(self) -> None:
        """Close the line."""
        if self._port is not None:
            with suppress(OSError):
                self._port.close()

    def _push(self) -> None:
        if self._unsent and self._port is not None:
            try:  # not by pyserial, whose write spins for ever where the other end does not read
                written = os.write(self._port.fileno(), self._unsent)
            except BlockingIOError:  # full
                return
            except OSError:
                self._lose()
                return
            self._unsent = self._unsent[written:]

    def _opened(self) -> Any:
        return self._serial(self.path, self._baud, timeout=0, write_timeout=0)

    def _there(self) -> bool:
        """Whether the line is open; one that was lost is tried again from time to time."""
        if self._port is None and time.monotonic() >= self._due:
            self._due = time.monotonic() + _AGAIN
            with suppress(Exception):  # whatever the driver of a device says that is not there, or not yet ready
                self._port = self._opened()
                self.counts["reopened"] += 1
        return self._port is not None

    def _incoming(self) -> bool:
        try:
            return self._there() and self._port.in_waiting > 0
        except OSError:
            self._lose()
            return False

    def _lose(self) -> None:
        """The device has gone: what waited for it is dropped, and counted as whole sentences."""
        self.counts["lost"] += 1
        self.counts["unsent"] += self._unsent.count(b"\n")
        self._unfinished, self._unsent, self._skipping = b"", b"", False
        self.close()
        self._port, self._due = None, time.monotonic() + _AGAIN


def _parsed(text: str) -> tuple[str, int]:
    try:
        parts = urlsplit(text)
        path, given = parts.path, parse_qs(parts.query, keep_blank_values=True)
    except ValueError:  # such as "serial://["
        path, given = "", {}
    baud = given.get("baud", ["4800"])[0]
    if not path.startswith("/") or set(given) - {"baud"} or baud not in map(str, BAUDS):
        raise WireError(f"'{text}': not a serial line; write serial:///dev/ttyUSB0 or serial:///dev/ttyUSB0?baud=38400")
    return path, int(baud)
