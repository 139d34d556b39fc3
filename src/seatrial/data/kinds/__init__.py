"""Kinds of manoeuvre, recognised from the data of a trial, with evidence and doubt.

Contract: `recognised(trial)` looks at what moved (speed, heading, rudder, revolutions), never at the name of the file
or at `kind` in its sidecar; `compared` puts the result beside the latter.  A kind is a plain word of `ABOUT`; what is
set in it (rudder, heading, side) is in `settings`, SI and radians.  What speaks for the kind is `evidence`, what speaks
against it `doubts`: without any doubt the kind is to be relied on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from .. import Trial

__all__ = ["ABOUT", "Kind", "compared", "recognised"]

ABOUT: Mapping[str, str] = MappingProxyType({
    "straight": "rudder midships at a steady speed",
    "acceleration": "from rest or slow ahead to a steady speed, rudder midships",
    "stopping": "the way is lost with the engine stopped or astern, rudder midships",
    "course-keeping": "courses held by a working rudder",
    "initial-turning": "one rudder angle until the heading has changed a little",
    "turning": "one rudder angle held through a turn",
    "pull-out": "rudder midships out of a steady turn, engine unchanged",
    "recovery": "hard over to one side, then to the other: back to the own track",
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

_OTHER_NAMES = MappingProxyType({
    "random": "mixed", "pseudo-random": "mixed", "free": "mixed", "thrust-steps": "mixed", "crash-astern": "stopping",
    "reverse-spiral": "spiral", "williamson": "recovery", "scharnow": "recovery", "single-turn": "turning",
    "track": "course-keeping", "crabbing": "sideways", "station-keeping": "station", "dp": "station",
})  # fmt: skip
"""Kinds of sidecars, mostly names of manoeuvres, by what they are here."""

_CLOSE = (("turning", "initial-turning"), ("turning", "pull-out"), ("straight", "course-keeping"),
          ("turning", "recovery"), ("straight", "acceleration"), ("berthing", "mixed"), ("stopping", "astern"),
          ("stopping", "berthing"))  # fmt: skip
"""Kinds of which one is a part of the other: no contradiction."""


@dataclass(frozen=True)
class Kind:
    """What kind of manoeuvre a trial is.

    Attributes:
        name: a key of `ABOUT`.
        settings: of what is set in it: `rudder`, `heading` [rad], magnitudes; `side`, +1 starboard first, -1 port.
        evidence: what was seen, in words and the units of reports.
        doubts: what speaks against it.
    """

    name: str
    settings: Mapping[str, float] = field(default_factory=dict[str, float])
    evidence: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()

    def doubting(self, *doubts: str) -> Kind:
        """The same with more doubts; empty ones are left out."""
        return replace(self, doubts=(*self.doubts, *(one for one in doubts if one)))

    @property
    def label(self) -> str:
        """The kind with what is set, in degrees: ``zigzag 20/10 port``."""
        angles = [f"{math.degrees(self.settings[name]):.0f}" for name in ("rudder", "heading") if name in self.settings]
        side = {1.0: "starboard", -1.0: "port"}.get(self.settings.get("side", 0.0), "")
        return " ".join(part for part in (self.name, "/".join(angles), side) if part)


def recognised(trial: Trial) -> Kind:
    """The kind of manoeuvre of a trial, by the first description that fits it."""
    from .motion import MOTION
    from .signals import signals
    from .steering import STEERING

    seen = signals(trial)
    if isinstance(seen, str):
        return Kind("unknown", doubts=(seen,))
    for look in (*MOTION[:2], *STEERING, *MOTION[2:]):
        if (found := look(seen)) is not None:
            return found.doubting(*seen.doubts)
    return Kind("mixed", evidence=seen.activity).doubting(*seen.doubts)


def compared(trial: Trial, found: Kind) -> str:
    """Whether the kind "agrees" with `kind` in the sidecar, is "close" or "differs"; "" where none is told."""
    told = trial.meta.get("kind")
    if not isinstance(told, str) or not told or found.name == "unknown":
        return ""
    meant = _OTHER_NAMES.get(told.lower(), told.lower())
    if meant not in ABOUT:
        return ""
    if meant == found.name:
        return "agrees"
    return "close" if (meant, found.name) in _CLOSE or (found.name, meant) in _CLOSE else "differs"
