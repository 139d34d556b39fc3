"""An autopilot that follows a track and keeps clear: it knows only NMEA 0183, in from the ship, out to its steering.

    seatrial range examples/range/crossing.toml --nmea udp://127.0.0.1:0 --lock-step \
        --beside "python examples/keep_clear_nmea.py {address} --length 320 --track 35,139.7 35.08,139.7"

In: HDT, ROT, RMC, ZDA of the own ship, TTM of its radar, VDM of the transponders of others.  Out: HTC, a heading to
steer, once after each ZDA.  It gives way as COLREG rules 13 to 17 have it: to starboard, early and by a lot; a ship
from port is left to give way itself until that is too late.
"""

from __future__ import annotations

import argparse
import json
import math
import socket
import sys
import time
from dataclasses import dataclass

from autopilot_nmea import KNOT, MILE, Ship, Track, fields, order, sentence, wrapped

HORIZON = 1800.0  # approaches later than this do not matter yet [s]
STAND_ON = 420.0  # a ship that has to give way is left to do so until then [s]
OLD = 400.0  # a report older than this is none [s]
STEPS = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 75.0, 90.0, -20.0, -40.0, -60.0, 120.0)  # changes of heading tried
ANSWER_TO = b"ZDA"


@dataclass
class Contact:
    """Another ship on a plane about the own one at the time of its report: metres north and east, m/s."""

    time: float
    north: float
    east: float
    v_north: float
    v_east: float
    of_own: bool  # whether the place is from the own ship; else from the datum


def sixbit(payload: str) -> list[int]:
    """The bits of an AIS payload."""
    bits: list[int] = []
    for character in payload:
        value = ord(character) - 48
        value -= 8 if value > 40 else 0
        bits += [value >> k & 1 for k in range(5, -1, -1)]
    return bits


def report(payload: str) -> tuple[int, float, float, float, float] | None:
    """MMSI, latitude, longitude, speed [m/s] and course [deg] of a position report; None of any other message."""
    bits = sixbit(payload)

    def number(first: int, length: int, signed: bool = False) -> int:
        value = int("".join(map(str, bits[first : first + length])), 2)
        return value - (1 << length) if signed and bits[first] else value

    if len(bits) < 168:
        return None
    kind = number(0, 6)
    if kind not in (1, 2, 3, 18):
        return None
    speed, x, y, course = (50, 61, 89, 116) if kind < 4 else (46, 57, 85, 112)
    longitude, latitude = number(x, 28, True) / 600000.0, number(y, 27, True) / 600000.0
    if abs(longitude) > 180.0 or abs(latitude) > 90.0:
        return None
    return number(8, 30), latitude, longitude, number(speed, 10) / 10.0 * KNOT, number(course, 12) / 10.0


class Lookout:
    """What is around: reports by who made them."""

    def __init__(self) -> None:
        self.seen: dict[object, Contact] = {}
        self.datum: tuple[float, float] | None = None

    def hear(self, line: bytes, ship: Ship) -> None:
        if line.startswith(b"!"):
            said = fields(b"$" + line[1:])
            found = report(said[5]) if len(said) > 6 and said[0].endswith("VDM") and said[1] == "1" else None
            if found is not None and ship.latitude is not None:
                self._place(found, ship)
            return
        said = fields(line)
        if said and said[0].endswith("TTM") and said[12] == "T" and said[4] == said[7] == "T" and ship.latitude:
            distance, bearing = float(said[2]) * MILE, math.radians(float(said[3]))
            speed, course = float(said[5]) * KNOT, math.radians(float(said[6]))
            self.seen["radar", said[1]] = Contact(
                ship.time, distance * math.cos(bearing), distance * math.sin(bearing),
                speed * math.cos(course), speed * math.sin(course), True,
            )  # fmt: skip

    def _place(self, found: tuple[int, float, float, float, float], ship: Ship) -> None:
        mmsi, latitude, longitude, speed, course = found
        self.datum = self.datum or (ship.latitude or 0.0, ship.longitude)
        north, east = self.metres(latitude, longitude)
        angle = math.radians(course)
        self.seen[mmsi] = Contact(ship.time, north, east, speed * math.cos(angle), speed * math.sin(angle), False)

    def metres(self, latitude: float, longitude: float) -> tuple[float, float]:
        first = self.datum or (latitude, longitude)
        return ((latitude - first[0]) * 60.0 * MILE,
                wrapped(longitude - first[1]) * 60.0 * MILE * math.cos(math.radians(first[0])))  # fmt: skip

    def now(self, ship: Ship) -> list[tuple[float, float, float, float]]:
        """Place relative to the own ship and velocity of each ship now, moved on since its report."""
        own, found = self.metres(ship.latitude or 0.0, ship.longitude), []
        angle = math.radians(ship.course)
        for one in self.seen.values():
            age = ship.time - one.time
            if age > OLD:
                continue
            if one.of_own:  # the own ship has moved on as well
                north = one.north + age * (one.v_north - ship.speed * math.cos(angle))
                east = one.east + age * (one.v_east - ship.speed * math.sin(angle))
            else:
                north, east = one.north + age * one.v_north - own[0], one.east + age * one.v_east - own[1]
            found.append((north, east, one.v_north, one.v_east))
        return found


def approach(north: float, east: float, v_north: float, v_east: float) -> tuple[float, float]:
    """Distance and time of the nearest approach from now on."""
    square = v_north * v_north + v_east * v_east
    t = max(-(north * v_north + east * v_east) / square, 0.0) if square > 1e-6 else 0.0
    return math.hypot(north + t * v_north, east + t * v_east), t


class KeepClear:
    """Chooses the heading: that of the track where it is clear, else the least change that is, starboard first."""

    def __init__(self, clear: float, lag: float) -> None:
        self.clear, self.lag, self.change = clear, lag, 0.0

    def heading(self, wanted: float, ship: Ship, others: list[tuple[float, float, float, float]]) -> float:
        # what was begun is not ended for a moment's sake: coming back needs more room than keeping on
        if self.change and not self._clear(wanted, ship, others, 1.15 * self.clear, True):
            for change in (self.change, *STEPS):
                if change and self._clear(wanted + change, ship, others, self.clear, True):
                    self.change = change
                    return wanted + change
            return wanted + self.change
        if self.change or self._clear(wanted, ship, others, self.clear, False):
            self.change = 0.0
            return wanted
        best = next((step for step in STEPS if self._clear(wanted + step, ship, others, 1.1 * self.clear, True)), 90.0)
        self.change = best
        return wanted + best

    def _clear(
        self, heading: float, ship: Ship, others: list[tuple[float, float, float, float]], room: float, all_: bool
    ) -> bool:  # fmt: skip
        angle, course = math.radians(heading), math.radians(ship.course)
        before = ship.speed * math.cos(course), ship.speed * math.sin(course)
        after = ship.speed * math.cos(angle), ship.speed * math.sin(angle)
        turning = self.lag * min(abs(wrapped(heading - ship.course)) / 30.0, 3.0)
        for north, east, v_north, v_east in others:
            # the ship goes on for a while before it is on the new course
            x = north + turning * (v_north - before[0])
            y = east + turning * (v_east - before[1])
            distance, t = approach(x, y, v_north - after[0], v_east - after[1])
            bearing = wrapped(math.degrees(math.atan2(east, north)) - (ship.heading or 0.0))
            theirs = -112.5 < bearing < -5.0 and not all_ and not self._overtaking(ship, v_north, v_east)
            if distance < room and t < (STAND_ON if theirs else HORIZON):
                return False
        return True

    @staticmethod
    def _overtaking(ship: Ship, v_north: float, v_east: float) -> bool:
        """Whether the own ship comes up with another on much the same course, and so keeps clear of it."""
        return abs(wrapped(math.degrees(math.atan2(v_east, v_north)) - ship.course)) < 67.5


def steer(link: socket.socket, given: argparse.Namespace) -> dict[str, object]:
    ship, lookout, pilot = Ship(), Lookout(), KeepClear(given.clear, given.lag)
    track = Track(given.track, 4.0 * given.length, 3.0 * given.length)
    heard, evasions, before = time.monotonic(), 0, 0.0
    link.send(sentence("AGHTC,V,,,,,,,,,,,,T,R"))  # a report, no order: here I am
    while not track.past:
        try:
            data = link.recv(4096)
        except (TimeoutError, ConnectionRefusedError):
            if time.monotonic() - heard > given.patience:
                break
            continue
        heard = time.monotonic()
        lines = data.splitlines()
        for line in lines:
            ship.hear(line)
            lookout.hear(line, ship)
        if any(line[3:6] == ANSWER_TO for line in lines):
            if ship.latitude is None or ship.heading is None:
                link.send(sentence("AGHTC,V,,,,,,,,,,,,T,R"))
                continue
            wanted = pilot.heading(track.course(ship), ship, lookout.now(ship))
            evasions += bool(pilot.change) and not before
            before = pilot.change
            link.send(order(0.0, wanted, "heading"))
    return {"arrived": track.past, "time": ship.time, "evasions": evasions}


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ship", help="HOST:PORT where the ship listens, udp")
    parser.add_argument("--track", nargs="+", required=True, help="waypoints LAT,LON [deg]")
    parser.add_argument("--length", type=float, required=True, help="of the ship [m]")
    parser.add_argument("--clear", type=float, default=1000.0, help="distance to keep from others [m]")
    parser.add_argument("--lag", type=float, default=40.0, help="time in which the ship turns by 30 deg [s]")
    parser.add_argument("--patience", type=float, default=20.0, help="give up after so long without a word [s]")
    given = parser.parse_args(arguments)
    given.track = [tuple(map(float, point.split(","))) for point in given.track]
    host, _, port = given.ship.rpartition(":")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.connect((host, int(port)))
        link.settimeout(0.5)
        print(json.dumps(steer(link, given)))  # noqa: T201


if __name__ == "__main__":
    main(sys.argv[1:])
