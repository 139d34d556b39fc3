"""An autopilot that knows nothing of seatrial: HDT, ROT and RMC in, rudder orders (ROR) or heading orders (HTC) out.

    seatrial steer kvlcc2 --nmea udp://127.0.0.1:10110 --rate 2 --factor 50 --duration 900
    python examples/autopilot_nmea.py 127.0.0.1:10110 --length 320 --course 20

It steers a course, or a track of waypoints, and prints one JSON object when it has arrived.  With a real ship behind
the port it would do the same, which is the point: nothing here depends on the ship being simulated.
"""

from __future__ import annotations

import argparse
import json
import math
import socket
import sys
import time
from dataclasses import dataclass

KNOT, MILE = 1852.0 / 3600.0, 1852.0
STRAIGHT = 0.03  # less turn than this is none [deg/s]
SETTLED, SETTLED_FOR = 0.5, 60.0  # within so many degrees of the course, for so long [s]


def wrapped(degrees: float) -> float:
    return (degrees + 180.0) % 360.0 - 180.0


def sentence(body: str) -> bytes:
    total = 0
    for byte in body.encode():
        total ^= byte
    return f"${body}*{total:02X}\r\n".encode()


def fields(line: bytes) -> list[str]:
    """The fields of a valid sentence, the address first; empty for anything else."""
    body, star, said = line.strip().partition(b"*")
    if not (star and body.startswith(b"$") and body.isascii()):
        return []
    total = 0
    for byte in body[1:]:
        total ^= byte
    return body[1:].decode().split(",") if said.upper() == b"%02X" % total else []


def degrees(text: str, side: str) -> float:
    """Latitude or longitude from ddmm.mmm and its hemisphere."""
    point = text.index(".") - 2
    value = int(text[:point]) + float(text[point:]) / 60.0
    return -value if side in "SW" else value


@dataclass
class Ship:
    """What the instruments have said so far: degrees, degrees per second, m/s, seconds."""

    heading: float | None = None
    rate: float = 0.0
    speed: float = 0.0
    course: float = 0.0
    latitude: float | None = None
    longitude: float = 0.0
    time: float = 0.0
    fresh: bool = False  # a heading that has not been steered by yet

    def hear(self, line: bytes) -> None:
        said = fields(line)
        kind = said[0][2:] if said else ""
        if kind == "HDT" and said[1]:
            self.heading, self.fresh = float(said[1]), True
        elif kind == "ROT" and said[1] and said[2] == "A":
            self.rate = float(said[1]) / 60.0
        elif kind == "RMC" and said[2] == "A":
            clock = said[1]
            now = 3600.0 * int(clock[:2]) + 60.0 * int(clock[2:4]) + float(clock[4:])
            self.time += (now - self.time + 43200.0) % 86400.0 - 43200.0  # past midnight the clock begins anew
            self.latitude, self.longitude = degrees(said[3], said[4]), degrees(said[5], said[6])
            self.speed, self.course = float(said[7]) * KNOT, float(said[8])


@dataclass
class Track:
    """Legs between waypoints (latitude, longitude); metres on a plane, which will do for a harbour's surroundings."""

    points: list[tuple[float, float]]
    ahead: float  # look-ahead [m]
    turn: float  # distance before a waypoint at which the next leg is taken [m]
    leg: int = 0
    past: bool = False
    slow: float = 60.0  # time over which drift is learned [s]
    last: float | None = None
    drift: float = 0.0
    across: float = 0.0

    def course(self, ship: Ship) -> float:
        """Heading that keeps the ship over the ground on the track [deg]."""
        here = self._metres(ship.latitude or 0.0, ship.longitude)
        while True:
            start, end = self._metres(*self.points[self.leg]), self._metres(*self.points[self.leg + 1])
            along = math.atan2(end[1] - start[1], end[0] - start[0])
            north, east = here[0] - start[0], here[1] - start[1]
            gone = north * math.cos(along) + east * math.sin(along)
            last = self.leg == len(self.points) - 2
            if gone < math.dist(start, end) - (0.0 if last else self.turn):
                break
            if last:
                self.past = True
                break
            self.leg += 1
        self.across = east * math.cos(along) - north * math.sin(along)
        # what wind and current make between heading and course, learned slowly and not while the ship turns
        dt, self.last = max(ship.time - (self.last or ship.time), 0.0), ship.time
        if abs(ship.rate) < STRAIGHT and ship.heading is not None:
            self.drift += min(dt / self.slow, 1.0) * wrapped(ship.course - ship.heading - self.drift)
        return math.degrees(along - math.atan2(self.across, self.ahead)) - self.drift

    def _metres(self, latitude: float, longitude: float) -> tuple[float, float]:
        first = self.points[0]
        return ((latitude - first[0]) * 60.0 * MILE,
                wrapped(longitude - first[1]) * 60.0 * MILE * math.cos(math.radians(first[0])))  # fmt: skip


@dataclass
class Autopilot:
    """A PID law on the heading, with gains that suit most ships once length and speed are known."""

    length: float
    speed: float
    limit: float
    integral: float = 0.0
    last: float | None = None

    def rudder(self, wanted: float, ship: Ship) -> float:
        """Rudder angle [deg], starboard positive."""
        error = wrapped(wanted - (ship.heading or 0.0))
        dt = 0.0 if self.last is None else max(ship.time - self.last, 0.0)
        self.last = ship.time
        period = self.length / self.speed
        angle = 1.0 * error - 1.5 * period * ship.rate + 0.05 / period * self.integral
        if abs(angle) < self.limit and abs(error) < 3.0:  # what a turn adds up is no wind
            self.integral += error * dt
        return max(-self.limit, min(self.limit, angle))


def order(rudder: float, wanted: float, by: str) -> bytes:
    if by == "rudder":
        return sentence(f"AGROR,{rudder:.1f},A,,V,B")
    return sentence(f"AGHTC,V,,,H,N,,,,,{wanted % 360.0:.1f},,,T,C")


class Run:
    """One course or one track, steered to its end."""

    def __init__(self, given: argparse.Namespace) -> None:
        self.given, self.ship = given, Ship()
        self.pilot = Autopilot(given.length, given.speed, given.limit)
        self.track = Track(given.track, 4.0 * given.length, 3.0 * given.length) if given.track else None
        self.wanted: float | None = None
        self.begin = self.since = self.overshoot = 0.0

    def answer(self, data: bytes) -> bytes | None:
        """The order that follows from the sentences of the ship; None while there is no new heading."""
        ship = self.ship
        for line in data.splitlines():
            ship.hear(line)
        if not ship.fresh or ship.heading is None or ship.latitude is None:
            return None
        ship.fresh = False
        if self.wanted is None:
            self.wanted, self.begin, self.since = ship.heading + self.given.course, ship.time, ship.time
        if self.track is not None:
            self.wanted = self.track.course(ship)
        error = wrapped(ship.heading - self.wanted)
        self.overshoot = max(self.overshoot, math.copysign(1.0, self.given.course) * error)
        if abs(error) > SETTLED:
            self.since = ship.time
        return order(self.pilot.rudder(self.wanted, ship), self.wanted, self.given.by)

    @property
    def arrived(self) -> bool:
        return self.track.past if self.track else self.wanted is not None and self.ship.time - self.since > SETTLED_FOR

    @property
    def over(self) -> bool:
        return self.arrived or (self.wanted is not None and self.ship.time - self.begin > self.given.duration)

    def result(self) -> dict[str, object]:
        track, ship = self.track, self.ship
        about = {"overshoot": self.overshoot} if track is None else {"leg": track.leg, "across": track.across}
        error = wrapped((ship.heading or 0.0) - (self.wanted or 0.0))
        told = {"arrived": self.arrived, "heading": ship.heading, "error": error, "time": ship.time - self.begin}
        return {**told, **about}


def steer(link: socket.socket, given: argparse.Namespace) -> dict[str, object]:
    run, heard = Run(given), time.monotonic()
    while not run.over:
        try:
            data = link.recv(2048)
        except (TimeoutError, ConnectionRefusedError):
            if time.monotonic() - heard > given.patience:
                raise SystemExit("no ship there") from None
            time.sleep(0.02)
            data = b""
        if data:
            heard = time.monotonic()
        said = run.answer(data)
        if said is None and run.wanted is None:
            said = sentence("AGHTC,V,,,,,,,,,,,,T,R")  # a report, no order: here I am
        if said is not None:
            link.send(said)
    return run.result()


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ship", help="HOST:PORT where the ship listens, udp")
    parser.add_argument("--course", type=float, default=0.0, help="change of course [deg], positive to starboard")
    parser.add_argument("--track", nargs="+", help="waypoints LAT,LON [deg], the first being passed already")
    parser.add_argument("--by", choices=("rudder", "heading"), default="rudder", help="order rudder angles or headings")
    parser.add_argument("--length", type=float, required=True, help="of the ship [m]")
    parser.add_argument("--speed", type=float, default=8.0, help="of the ship [m/s]")
    parser.add_argument("--limit", type=float, default=20.0, help="greatest rudder [deg]")
    parser.add_argument("--duration", type=float, default=3600.0, help="give up after so long, by the ship's clock [s]")
    parser.add_argument("--patience", type=float, default=20.0, help="give up after so long without a word [s]")
    given = parser.parse_args(arguments)
    if given.track:
        given.track = [tuple(map(float, point.split(","))) for point in given.track]
    host, _, port = given.ship.rpartition(":")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.connect((host, int(port)))
        link.settimeout(0.2)
        print(json.dumps(steer(link, given)))  # noqa: T201


if __name__ == "__main__":
    main(sys.argv[1:])
