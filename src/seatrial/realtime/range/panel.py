"""What the page shows of a stage and what its buttons do; SI and radians, times in simulated seconds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from ...core.errors import RefusalError
from ..bridge.deck import Request, number
from ..bridge.view import OWN, plain
from .contacts import Contact
from .handover import CALLED
from .stage import Stage


class Panel:
    """A `bridge.deck.Companion`: data for the page and requests of it beyond those of the bridge."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self.doing: Mapping[str, Callable[[Request], None]] = {
            "hand": self._hand, "acknowledge": self._acknowledge, "fault": self._fault,
        }  # fmt: skip

    def hello(self) -> dict[str, Any]:
        """Constant data."""
        stage, scenario = self._stage, self._stage.scenario
        sailing = scenario.own.sailing
        return {
            "title": scenario.title, "known": stage.handover.known,
            "datum": None if scenario.datum is None else [scenario.datum.latitude, scenario.datum.longitude],
            "epoch": scenario.epoch, "variation": scenario.variation,
            "route": [[sailing.x, sailing.y], *map(list, sailing.route)] if sailing.route else [],
            "faults": [fault.label for fault in scenario.faults],
            "limits": {"cpa": stage.contacts.cpa, "tcpa": stage.contacts.tcpa},
            "mmsi": {one.name: one.sailing.mmsi for one in scenario.others},
            "draught": stage.fittings.draught,
        }  # fmt: skip

    def frame(self) -> dict[str, Any]:
        """Data that change."""
        stage, own = self._stage, self._stage.loop.vessels[OWN].plant
        on_wire, dangerous = stage.on_wire, {one.name for one in stage.contacts.dangerous()}
        return {
            "steers": stage.handover.holder,
            "wire": None if on_wire is None else
            [on_wire.conning.commander, on_wire.conning.mode, on_wire.conning.stale, on_wire.wire.peers],
            "contacts": [_row(one, one.name in dangerous) for one in _nearest(stage)],
            "alarms": [[one.cause.identifier, one.cause.instance, one.cause.priority, one.state, one.cause.text,
                        round(one.changed, 2)] for one in stage.alarms.standing()],
            "faults": [k in stage.faults.since for k in range(len(stage.faults.faults))],
            "place": _place(stage), "depth": None if own["per_depth"] <= 0.0 else plain(1.0 / own["per_depth"]),
            "leg": None if stage.pilot is None else [stage.pilot.guide.number, plain(stage.pilot.across or 0.0)],
            "arrived": stage.judge.arrived,
        }  # fmt: skip

    def refusal(self) -> str:
        """Why the page may not steer now; empty if it may."""
        holder = self._stage.handover.holder
        return "" if holder == "page" else f"{CALLED[holder]} steers; take over first"

    def weather(self) -> None:
        """The weather has been set from the page."""
        self._stage.sky.hold()

    def _hand(self, said: Request) -> None:
        self._stage.handover.hand(self._stage.loop, str(said.get("to")))

    def _acknowledge(self, said: Request) -> None:
        identifier, instance = number(said, "identifier"), number(said, "instance")
        self._stage.alarms.acknowledge(int(identifier), int(instance), self._stage.loop.t)

    def _fault(self, said: Request) -> None:
        on = said.get("on")
        if not isinstance(on, bool):
            raise RefusalError("on must be true or false")
        self._stage.faults.set(self._stage.loop, int(number(said, "number")), on)


def _nearest(stage: Stage) -> list[Contact]:
    return sorted(stage.contacts.seen.values(), key=lambda one: one.distance)


def _row(one: Contact, dangerous: bool) -> list[Any]:
    """Name, distance, bearing, speed, course, nearest approach, time to it, whether it is dangerous."""
    values = (one.distance, one.bearing % math.tau, one.U, one.chi % math.tau, one.cpa, one.tcpa)
    return [one.name, *map(plain, values), dangerous]


def _place(stage: Stage) -> list[float] | None:
    """Latitude and longitude of midship [deg], by the truth; None without a place on earth."""
    own, datum = stage.loop.vessels[OWN].plant, stage.scenario.datum
    if datum is None or not math.isfinite(own["x"] + own["y"]):
        return None
    return [round(value, 7) for value in datum.place(own["x"], own["y"])]
