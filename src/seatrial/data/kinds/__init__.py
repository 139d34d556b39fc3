"""Kinds of manoeuvre, recognised from the data of a trial, with evidence and doubt.

Contract: `recognised(trial)` looks at what moved (speed, heading, rudder, revolutions), never at the name of the file
or at `kind` in its sidecar; `compared` puts the result beside the latter.  A kind is a plain word of `ABOUT`; what is
set in it (rudder, heading, side) is in `settings`, SI and radians.  What speaks for the kind is `evidence`, what speaks
against it `doubts`: without any doubt the kind is to be relied on.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

from .. import Trial
from .kind import ABOUT, Kind
from .signals import driven, signals
from .speed import MOTION
from .steering import STEERING, spinning

__all__ = ["ABOUT", "Kind", "compared", "recognised"]

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


def recognised(trial: Trial) -> Kind:
    """The kind of manoeuvre of a trial, by the first description that fits it."""
    seen = signals(driven(trial))
    if isinstance(seen, str):
        return Kind("unknown", doubts=(seen,))
    for look in (spinning, *MOTION[:2], *STEERING, *MOTION[2:]):
        if (found := look(seen)) is not None:
            return replace(found.doubting(*seen.doubts), by_thrust=seen.by_thrust)
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
