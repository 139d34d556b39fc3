"""A stack that knows only NMEA 0183: it alters course to starboard for whom its radar says it will pass too near.

    seatrial case examples/cases/kvlcc2_on_the_wire.toml -o case

In: HDT, the own heading, and TTM, each contact with bearing, closest approach and the time to it; ZDA ends each second.
Out: HTC, a heading to steer, once after each ZDA.  It stands on for a ship to port until five minutes are left.
"""

from __future__ import annotations

import socket
import sys
import time

CLEAR, EARLY, LATE = 1.2, 25.0, 5.0  # closest approach to keep [nautical miles], times to it at which it acts [min]


def sentence(body: str) -> bytes:
    check = 0
    for character in body:
        check ^= ord(character)
    return f"${body}*{check:02X}\r\n".encode()


class Pilot:
    def __init__(self) -> None:
        self.heading: float | None = None
        self.course = self.order = 0.0
        self.near: dict[str, tuple[float, float, float]] = {}

    def hear(self, line: str) -> None:
        said = line.partition("*")[0].split(",")
        if said[0].endswith("HDT"):
            if self.heading is None:
                self.course = self.order = float(said[1])
            self.heading = float(said[1])
        elif said[0].endswith("TTM") and said[3] and said[8]:
            self.near[said[1]] = float(said[3]), float(said[8]), float(said[9])

    def steer(self) -> float:
        """The heading to steer: the old one once nobody is in the way of it or forward of the beam."""
        danger, ahead = False, False
        for bearing, cpa, tcpa in self.near.values():
            before = (bearing - self.course + 180.0) % 360.0 - 180.0  # its part is that on the old course
            danger |= cpa < CLEAR and 0.0 < tcpa < (LATE if -112.5 < before < -10.0 else EARLY)
            ahead |= tcpa > 0.0 and abs((bearing - (self.heading or 0.0) + 180.0) % 360.0 - 180.0) < 100.0
        if danger and self.order - self.course < 150.0:
            turned = ((self.heading or 0.0) - self.order + 180.0) % 360.0 - 180.0
            if self.order == self.course or abs(turned) < 3.0:  # the turn is over and does not suffice
                self.order += 45.0 if self.order == self.course else 20.0
        elif not danger and not ahead:
            self.order = self.course
        return self.order % 360.0


def main(address: str) -> None:
    host, _, port = address.rpartition(":")
    pilot, heard = Pilot(), time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.connect((host, int(port)))
        link.settimeout(20.0)
        link.send(sentence("AGHTC,V,,,,,,,,,,,,T,R"))  # no order yet: here I am
        while time.monotonic() - heard < 20.0:
            lines = link.recv(4096).decode().splitlines()
            heard = time.monotonic()
            for line in lines:
                pilot.hear(line)
            if any(line[3:6] == "ZDA" for line in lines):
                link.send(sentence(f"AGHTC,V,,,H,N,,,,,{pilot.steer():.1f},,,T,C"))


if __name__ == "__main__":
    main(sys.argv[1])
