"""A kind of manoeuvre with its evidence, and the list of all kinds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from ...core.values import dataclass, field, replace

HARD_OVER = math.radians(35.0)
"""Angle that stands for all of a steering demand, as `forces` has it [rad]."""

ABOUT: Mapping[str, str] = MappingProxyType({
    "straight": "rudder midships at a steady speed",
    "acceleration": "from rest or slow ahead to a steady speed, rudder midships",
    "stopping": "the way is lost with the engine stopped or astern, rudder midships",
    "course-keeping": "courses held by a working rudder",
    "initial-turning": "one rudder angle until the heading has changed a little",
    "turning": "one rudder angle held through a turn",
    "pull-out": "rudder midships out of a steady turn, engine unchanged",
    "recovery": "hard over to one side, then to the other: back to the own track",
    "spinning": "turned on the spot by two opposed thrusts",
    "zigzag": "the rudder reversed at headings alike to both sides",
    "spiral": "steady turns one after another, from one side to the other",
    "astern": "going astern",
    "sideways": "going sideways",
    "berthing": "a held heading, engine both ways, and an end at little way",
    "station": "one place held",
    "at rest": "no motion beyond noise",
    "mixed": "none of the others: random or several manoeuvres",
    "unknown": "too little is recorded to tell",
})  # fmt: skip
"""Every kind in a line."""


@dataclass(frozen=True)
class Kind:
    """What kind of manoeuvre a trial is.

    Attributes:
        name: a key of `ABOUT`.
        settings: of what is set in it: `rudder`, `heading` [rad], magnitudes; `side`, +1 starboard first, -1 port.
        evidence: what was seen, in words and the units of reports.
        doubts: what speaks against it.
        by_thrust: whether `rudder` is the demand of a craft that its thrusts steer, of which `HARD_OVER` is all.
    """

    name: str
    settings: Mapping[str, float] = field(default_factory=dict[str, float])
    evidence: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    by_thrust: bool = False

    def doubting(self, *doubts: str) -> Kind:
        """The same with more doubts; empty ones are left out."""
        return replace(self, doubts=(*self.doubts, *(one for one in doubts if one)))

    @property
    def label(self) -> str:
        """The kind with what is set, in degrees or percent of a demand: ``zigzag 20/10 port``, ``turning 40% port``."""
        angles = [f"{math.degrees(self.settings[name]):.0f}" for name in ("rudder", "heading") if name in self.settings]
        if self.by_thrust and "rudder" in self.settings:
            angles[0] = f"{100.0 * self.settings['rudder'] / HARD_OVER:.0f}%"
        side = {1.0: "starboard", -1.0: "port"}.get(self.settings.get("side", 0.0), "")
        return " ".join(part for part in (self.name, "/".join(angles), side) if part)
