"""Scenarios for tests, and a wire without a socket."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

from seatrial.data.geodesy import Datum
from seatrial.data.nmea.framing import split
from seatrial.realtime.range.scenario import Criteria, Fault, Limits, Other, Own, Sailing, Scenario, Weather, ordinary
from seatrial.realtime.range.stage import Line, Stage
from seatrial.realtime.wire import Intake, Message
from seatrial.ships.files import load

DEG, PLACE = math.pi / 180.0, Datum(35.0, 139.7)
FERRY = Other("ferry", ordinary("ferry", 150.0, 8.0), Sailing(3000.0, 3000.0, 1.5 * math.pi, 8.0))
"""Crosses the track of a ship that goes north from the origin at 8 m/s at the same time as that ship."""


class Strings:
    """A wire without a socket: datagrams are put in by hand, and kept as they go out."""

    def __init__(self) -> None:
        self.intake, self.t = Intake(rate=1e9), 0.0
        self.waiting: list[bytes] = []
        self.out: list[bytes] = []
        self.address, self.peers = "a wire without a socket", 1

    @property
    def counts(self) -> Counter[str]:
        return self.intake.counts

    def poll(self) -> list[Message]:
        waiting, self.waiting = self.waiting, []
        return [Message(one, "test") for data in waiting for one in self.intake.take(data, "test", 0.0)]

    def wait(self, seconds: float) -> None:
        """Nothing more will come."""

    def send(self, data: bytes) -> None:
        self.out.append(data)

    def said(self, kind: str) -> list[bytes]:
        return [line for data in self.out for line in split(data) if line[3:6] == kind.encode()]


def scene(*others: Other, name: str = "ordinary", **more: Any) -> Scenario:
    """A ship that goes north from the origin at 8 m/s."""
    ship = ordinary("own", 150.0, 8.0) if name == "ordinary" else load(name)
    route = more.pop("route", ((6000.0, 0.0),))
    own = Own(ship, Sailing(0.0, 0.0, 0.0, min(ship.speed, 8.0), route, 211000001), more.pop("usual", False),
              more.pop("piloted", True))  # fmt: skip
    return Scenario("a test", more.pop("duration", 900.0), own, tuple(others), rate=more.pop("rate", 5.0),
                    datum=PLACE, **more)  # fmt: skip


def on_wire(scenario: Scenario, page: bool = False, **more: Any) -> tuple[Stage, Strings]:
    wire: Any = Strings()
    return Stage(scenario, line=Line(wire, **more), page=page), wire


__all__ = ["DEG", "FERRY", "PLACE", "Criteria", "Fault", "Limits", "Strings", "Weather", "on_wire", "scene"]
