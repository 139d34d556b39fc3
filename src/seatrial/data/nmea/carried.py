"""Frames of NMEA 2000 that gateways carry in sentences: MXPGN of MiniPlex and others, PCDIN of SeaSmart.

| sentence | fields |
|---|---|
| MXPGN | group (hex); a word of send bit, 3 bits of priority, 4 of length, and the source; bytes |
| PCDIN | group (hex); a counter; source (hex); bytes |

A MiniPlex sends the last byte first, other makers of MXPGN the first: the order of a log is that in which headings and
positions go on.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping

import numpy as np

from ...core.values import dataclass
from ..n2k.groups import PGNS, said
from ..n2k.layouts import Frame, Packets
from .clocks import Spoken
from .heard import Heard

KINDS = ("PGN", "PCDIN")
"""Sentences that carry frames."""

_WIDE: Mapping[str, float] = {"psi": math.tau, "psi_magnetic": math.tau, "gamma_G": math.tau, "latitude": 90.0,
                              "longitude": 180.0, "r": 67.0, "delta_0": 3.2, "U_G": 655.0}  # fmt: skip
"""Readings that go on from one to the next, and the width of their range."""

_CLEAR = 0.01
"""By so much the order of bytes that is right strains less, as a share of the range."""


@dataclass(frozen=True)
class Carried:
    """A frame of a sentence at a place in the log, with the stamp of its line; NaN where it has none."""

    place: int
    stamp: float
    frame: Frame
    turnable: bool


def carried(heard: Heard, place: int, stamp: float) -> Carried | None:
    """The frame of a sentence; None where it has none."""
    mini = heard.kind == "PGN"
    try:
        pgn, data = int(heard.text(0), 16), bytes.fromhex(heard.text(2 if mini else 3))
        source = int(heard.text(1 if mini else 2), 16) & 0xFF
    except ValueError:
        return None
    if mini and len(data) != int(heard.text(1), 16) >> 8 & 0xF:
        return None
    return Carried(place, stamp, Frame("", 0.0, pgn, source, data), mini)


def told(frames: list[Carried]) -> tuple[list[Spoken], str]:
    """What the frames of a log tell, and the order of their bytes in words; empty where there is no question."""
    turnable = any(one.turnable for one in frames)
    orders = [_spoken(frames, turned) for turned in ((True, False) if turnable else (False,))]
    strains = [_strain(one, max(map(_size, orders))) for one in orders]
    best = strains.index(min(strains))
    doubt = "doubt: nothing that moves tells the order: " if max(strains) - min(strains) < _CLEAR else ""
    return orders[best], f"{doubt}bytes of MXPGN with the {('last', 'first')[best]} one first" * turnable


def _spoken(frames: list[Carried], turned: bool) -> list[Spoken]:
    packets = Packets()
    kept: dict[tuple[str, tuple[str, ...]], list[tuple[int, float, list[float]]]] = defaultdict(list)
    for one in frames:
        frame = one.frame
        if one.turnable and turned:
            frame = Frame(frame.clock, frame.t, frame.pgn, frame.source, frame.data[::-1])
        whole = packets.whole(frame) if frame.pgn in PGNS else None
        values = (said(whole.pgn, whole.data) or {}) if whole else {}
        values.pop("utc", None)
        if values:
            kept[f"{frame.source}/{frame.pgn}", tuple(values)].append((one.place, one.stamp, list(values.values())))
    out = list[Spoken]()
    for (source, names), some in kept.items():
        place, stamp, values = zip(*some, strict=True)
        out.append(Spoken(source, names, np.array(place), np.transpose(values), np.array(stamp)))
    return out


def _size(found: list[Spoken]) -> int:
    return sum(len(one) for one in found)


def _strain(found: list[Spoken], most: int) -> float:
    """How far readings leap, as a share of their range, and how many there are less than in the other order."""
    leaps = [float(np.median(np.abs(np.diff(one[name])))) / wide for one in found if len(one) > 1
             for name, wide in _WIDE.items() if name in one.names]  # fmt: skip
    return (float(np.mean(leaps)) if leaps else 1.0) + 1.0 - _size(found) / max(most, 1)
