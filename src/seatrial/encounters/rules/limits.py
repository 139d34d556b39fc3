"""The numbers that the rules do not give: each with its value, how it grows with the ship, and where it is from.

COLREG itself has no figure but the 22.5 deg of Rule 13(b).  Values stand for a ship of `L_REFERENCE`; lengths grow with
the length of the longer ship, times with its square root (Froude's law), so that a model and its ship are judged alike.
What a ship needs to turn counts in lengths at its own speed, as MSC.137(76) has it, so that slow ships are too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

from ...core.constants import MILE
from ...core.errors import RequestError
from ...core.parameters import unknown
from ...core.values import dataclass, fields, replace
from .geometry import Array

L_REFERENCE = 300.0
"""Length of the ship that the values stand for [m]."""

DEG = math.pi / 180.0
PRACTICE = "rule of practice, no figure in COLREG"
"""The source of a threshold that no rule states in figures."""
HAGEN = "Hagen et al. 2023, Ocean Eng. 288, 115991"
"""The source of the thresholds by which manoeuvres are judged as apparent."""


@dataclass(frozen=True)
class Limit:
    """One threshold.

    Attributes:
        value: SI units and radians, for a ship of `L_REFERENCE`.
        grows: with the length, its root (times), or not at all.
        source: who says so.
    """

    value: float
    grows: Literal["length", "time", "not"]
    source: str

    def __post_init__(self) -> None:
        if not math.isfinite(self.value) or self.value <= 0.0:
            raise RequestError(f"a threshold of {self.value:g}; it is a number above zero")
        if not self.source.strip():
            raise RequestError(f"a threshold of {self.value:g} without a source; say who asks for it")

    def of(self, L: Array) -> Array:
        """For ships of length L [m]."""
        return self.value * (L / L_REFERENCE) ** {"length": 1.0, "time": 0.5, "not": 0.0}[self.grows]


@dataclass(frozen=True)
class Limits:
    """All thresholds of the checks.

    Attributes:
        passing: distance at the closest approach that is safe [m] (Rule 8(d)).
        overtaking: the same for overtaking (Rule 13) [m].
        horizon: time to a closest approach nearer than `passing` at which there is risk of collision [s] (Rule 7).
        early: share of the time to the closest approach at the beginning that may go by before action (Rules 8, 16).
        ahead, ahead_widest: bearing of the other ship on either bow that is surely, or may be, head-on [rad] (Rule 14).
        reciprocal: difference of courses from opposite that is nearly reciprocal [rad].
        doubt: tolerance at the borders of all sectors, where either class is accepted [rad].
        beginning, detectable, apparent: alteration of course with which an action begins, can be detected by
            another ship, and is apparent to it [rad] (Rule 8(b)).
        at_once: share of what is apparent that is turned within the `window`; an ordered course is reached slowly.
        slowing, halving: reduction of speed that can be detected and is apparent, as shares.
        window: way within which the alteration has to be made, in ship lengths at the speed with which the encounter
            begins: ships turn by lengths sailed, whatever their speed; a series of small alterations takes longer.
        smoothing: span of the mean that takes yawing in waves from the heading [s].
        bow: distance from the other ship within which crossing its bow line is passing ahead [m] (Rules 13, 15).
        stem: bearing from the other's bow at the closest approach that is ahead of it when overtaking [rad].
        steady, keeping: change of course [rad] and share of speed that a stand-on ship may show (Rule 17(a)(i)).
        alone: time to the closest approach after which the stand-on ship may act [s] (Rule 17(a)(ii)).
        extremis: the same at which its action has to be under way, in ship lengths at its own speed (Rule 17(b)).
        stopping: distance within which a ship stops, in its lengths (Rule 6).
        sight: share of the visibility within which it has to (Rule 6).
        channel: distance from the axis of a fairway within which a ship is in it [m] (Rule 9).
        flow: difference from the direction of traffic that goes with it or along it [rad] (Rules 9, 10).
        crossing: the least at which a lane is crossed [rad] (Rule 10(c)).
    """

    passing: Limit = Limit(0.5 * MILE, "length", f"{PRACTICE}: 0.5 NM in coastal waters, 1 NM in the open sea")
    overtaking: Limit = Limit(0.3 * MILE, "length", f"{PRACTICE}: 0.3 to 0.5 NM")
    horizon: Limit = Limit(1200.0, "time", f"{PRACTICE}: 12 min left of 20 are early")
    early: Limit = Limit(0.4, "not", f"{PRACTICE}: 12 min left of 20 are early")
    ahead: Limit = Limit(5.0 * DEG, "not", "DNV ship-traffic-generator")
    ahead_widest: Limit = Limit(13.0 * DEG, "not", "Woerner et al. 2019, as Hagen et al. 2023 use it")
    reciprocal: Limit = Limit(22.5 * DEG, "not", "Tam and Bucknall 2010, as Eriksen et al. 2020 use it")
    doubt: Limit = Limit(5.0 * DEG, "not", "DNV ship-traffic-generator, margin of crossing")
    beginning: Limit = Limit(2.0 * DEG, "not", HAGEN)
    detectable: Limit = Limit(10.0 * DEG, "not", f"{HAGEN}, Rule 14")
    apparent: Limit = Limit(30.0 * DEG, "not", HAGEN)
    at_once: Limit = Limit(0.8, "not", f"{PRACTICE}: four fifths of an alteration in one move")
    slowing: Limit = Limit(0.2, "not", f"{HAGEN}, CCTA profile")
    halving: Limit = Limit(0.5, "not", f"{HAGEN}, CCTA profile")
    window: Limit = Limit(6.0, "not", "MSC.137(76), 5.3.1: a quarter turn by hard rudder within an advance of 4.5 "
                          f"lengths; {PRACTICE}: a third more for moderate rudder")  # fmt: skip
    smoothing: Limit = Limit(20.0, "time", f"{PRACTICE}: twice the period of long waves")
    bow: Limit = Limit(1.0 * MILE, "length", f"{PRACTICE}: twice the passing distance of coastal waters")
    stem: Limit = Limit(45.0 * DEG, "not", f"{HAGEN}, Rule 13")
    steady: Limit = Limit(5.0 * DEG, "not", PRACTICE)
    keeping: Limit = Limit(0.1, "not", PRACTICE)
    alone: Limit = Limit(360.0, "time", PRACTICE)
    extremis: Limit = Limit(4.5, "not", "MSC.137(76), 5.3.1: advance of a hard turn up to 4.5 lengths")
    stopping: Limit = Limit(15.0, "not", "MSC.137(76), 5.3.4: track reach of a full astern stop up to 15 lengths")
    sight: Limit = Limit(0.5, "not", f"{PRACTICE}: stop within half the visibility")
    channel: Limit = Limit(300.0, "length", f"{PRACTICE}: a channel of two ship lengths in width")
    flow: Limit = Limit(30.0 * DEG, "not", f"{PRACTICE}: joining and leaving a lane at a small angle")
    crossing: Limit = Limit(70.0 * DEG, "not", f"{PRACTICE}: nearly at right angles")

    def changed(self, values: Mapping[str, float], source: str) -> Limits:
        """The same with other values (SI units and radians, for a ship of `L_REFERENCE`) of one source.

        Raises:
            RequestError: a threshold that is none of these, a value that cannot be one, no source.
        """
        names = [field.name for field in fields(self)]
        for name in values:
            if name not in names:
                raise RequestError(unknown(name, names, "threshold"))
        return replace(self, **{name: replace(getattr(self, name), value=value, source=source)
                                for name, value in values.items()})  # fmt: skip


OPEN_SEA = Limits().changed({"passing": MILE, "overtaking": 0.5 * MILE, "bow": 2.0 * MILE}, f"{PRACTICE}: open sea")
"""Thresholds where there is room."""
