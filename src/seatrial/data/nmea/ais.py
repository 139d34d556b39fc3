"""Reports of AIS transponders (ITU-R M.1371) as encapsulated sentences, by pyais: positions and static data.

| class | position | static data |
|---|---|---|
| A | message 1; 3 while its interval is shortened, 2 where a base station assigns the interval | message 5 |
| B | message 18 | message 24, parts A and B |
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Literal

from ...core.constants import KNOT
from ...core.values import dataclass

_MOST_KNOTS = 102.2
_MOST_TURN = 708.0
"""Greatest rate of turn that is told as a figure [deg/min]."""

_NO_MANOEUVRE, _GPS = 0, 1  # not available, of which 3 is reserved; kind of receiver

Type = Literal["fishing", "towing", "dredging", "diving", "military", "sailing", "pleasure", "high-speed", "pilot",
               "rescue", "tug", "passenger", "cargo", "tanker", "other"]  # fmt: skip
TYPES: Mapping[Type, int] = MappingProxyType({
    "fishing": 30, "towing": 31, "dredging": 33, "diving": 34, "military": 35, "sailing": 36, "pleasure": 37,
    "high-speed": 40, "pilot": 50, "rescue": 51, "tug": 52, "passenger": 60, "cargo": 70, "tanker": 80, "other": 90,
})  # fmt: skip
"""Types of ship and cargo (ITU-R M.1371-5, Table 53); 0 where none is told."""
Status = Literal["under way", "at anchor", "not under command", "restricted", "constrained by draught", "moored",
                 "aground", "fishing", "sailing"]  # fmt: skip
STATUSES: Mapping[Status, int] = MappingProxyType({
    "under way": 0, "at anchor": 1, "not under command": 2, "restricted": 3, "constrained by draught": 4, "moored": 5,
    "aground": 6, "fishing": 7, "sailing": 8,
})  # fmt: skip
"""Navigational status (ITU-R M.1371-5, Table 48); a transponder of class B tells none."""

Message = Literal[1, 2, 3]


@dataclass(frozen=True)
class Transponder:
    """A transponder and what it says of its ship; lengths in m.

    Attributes:
        mmsi: nine digits.
        name, length, breadth, draught: of the ship.
        antenna: place of its receiver, forward and to starboard of midship.
        class_b: whether it is of class B.
        kind: type of ship; None: not told.
        status: what it is doing, by its watch.
    """

    mmsi: int
    name: str = ""
    length: float = 0.0
    breadth: float = 0.0
    draught: float = 0.0
    antenna: tuple[float, float] = (0.0, 0.0)
    class_b: bool = False
    kind: Type | None = None
    status: Status = "under way"


def position(by: Transponder, m: Mapping[str, float], second: int, kind: str, message: Message = 1) -> list[bytes]:
    """A position report, as VDO of the own ship or VDM of another.

    Args:
        m: latitude, longitude [deg], U [m/s], chi, psi [rad], r [rad/s].
        second: of the minute, UTC.
        kind: "VDO" or "VDM".
        message: of class A.
    """
    said = {
        "msg_type": 18 if by.class_b else message, "mmsi": by.mmsi, "speed": _tenths(min(m["U"] / KNOT, _MOST_KNOTS)),
        "lon": m["longitude"], "lat": m["latitude"], "course": _tenths(math.degrees(m["chi"]) % 360.0, 360.0),
        "heading": round(math.degrees(m["psi"])) % 360, "second": second,
    }  # fmt: skip
    if by.class_b:
        return _encoded(said, kind)
    turn = math.degrees(m["r"]) * 60.0 + 1e-9  # pyais takes 127 for the code of "more than 5 deg in 30 s"
    turning = {"turn": min(max(turn, -_MOST_TURN), _MOST_TURN), "maneuver": _NO_MANOEUVRE,
               "status": STATUSES[by.status]}  # fmt: skip
    return _encoded({**said, **turning}, kind)


def static(by: Transponder, kind: str, sequence: int = 0) -> list[bytes]:
    """Name, size about the antenna and draught, as VDO or VDM; `sequence` joins the sentences of one message."""
    forward, starboard = by.antenna
    ahead, aside = 0.5 * by.length, 0.5 * by.breadth
    name = re.sub(r"[^ -_]", " ", by.name.upper())[:20]
    number = 0 if by.kind is None else TYPES[by.kind]
    size = {
        "to_bow": _metres(ahead - forward, 511), "to_stern": _metres(ahead + forward, 511),
        "to_port": _metres(aside + starboard, 63), "to_starboard": _metres(aside - starboard, 63),
    }  # fmt: skip
    if not by.class_b:
        said = {"msg_type": 5, "mmsi": by.mmsi, "shipname": name, "ship_type": number, "epfd": _GPS,
                "draught": _tenths(min(by.draught, 25.5))}  # fmt: skip
        return _encoded({**said, **size}, kind, sequence)
    parts = ({"partno": 0, "shipname": name}, {"partno": 1, "ship_type": number, **size})
    return [line for part in parts for line in _encoded({"msg_type": 24, "mmsi": by.mmsi, **part}, kind)]


def _tenths(value: float, circle: float = math.inf) -> float:
    """A value rounded to tenths, as pyais would cut it off; `circle` itself is 0."""
    found = round(value * 10.0) / 10.0
    return 0.0 if found >= circle else found + 1e-6


def _metres(length: float, most: int) -> int:
    return min(max(round(length), 0), most)


def _encoded(values: dict[str, Any], kind: str, sequence: int = 0) -> list[bytes]:
    try:
        from pyais import encode_dict
    except ImportError:
        return []
    texts = encode_dict(values, talker_id="AI", sentence_type=kind, seq_id=sequence % 10)
    return [text.encode() + b"\r\n" for text in texts]
