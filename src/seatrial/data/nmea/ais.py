"""What a transponder says of a ship: position reports and static data of ITU-R M.1371, by pyais."""

from __future__ import annotations

import math
import re
from typing import Any

from .ship import KNOT, Fittings, Measured, clock, compass

_NOT_AVAILABLE = 0
"""Manoeuvre indicator; 3 is reserved."""

_GPS = 1


def transponder(fit: Fittings, m: Measured) -> list[bytes]:
    """VDO: the position report, and before it the static data where `m` has "static"; none without pyais."""
    return [*(_static(fit) if "static" in m else ()), *position(fit, m, fit.mmsi, "VDO")]


def position(fit: Fittings, m: Measured, mmsi: int, kind: str) -> list[bytes]:
    """Message 1 of a ship with this MMSI, as VDO of the own ship or VDM of another."""
    return _lines({
        "type": 1, "mmsi": mmsi, "turn": math.degrees(m["r"]) * 60.0, "speed": min(m["U"] / KNOT, 102.2),
        "lon": m["longitude"], "lat": m["latitude"], "course": compass(m["chi"]),
        "heading": round(compass(m["psi"])) % 360, "second": clock(fit, m).second, "maneuver": _NOT_AVAILABLE,
    }, kind)  # fmt: skip


def _static(fit: Fittings) -> list[bytes]:
    """Message 5: name, size about the antenna and draught."""
    forward, starboard = fit.antenna
    ahead, aside = 0.5 * fit.length, 0.5 * fit.breadth
    return _lines({
        "type": 5, "mmsi": fit.mmsi, "shipname": re.sub(r"[^ -_]", " ", fit.name.upper())[:20], "epfd": _GPS,
        "to_bow": _metres(ahead - forward, 511), "to_stern": _metres(ahead + forward, 511),
        "to_port": _metres(aside + starboard, 63), "to_starboard": _metres(aside - starboard, 63),
        "draught": min(fit.draught, 25.5),
    }, "VDO")  # fmt: skip


def _metres(length: float, most: int) -> int:
    return min(max(round(length), 0), most)


def _lines(said: dict[str, Any], kind: str) -> list[bytes]:
    try:
        from pyais import encode_dict
    except ImportError:
        return []
    return [line.encode() + b"\r\n" for line in encode_dict(said, talker_id="AI", sentence_type=kind)]
