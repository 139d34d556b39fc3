"""Logs of NMEA 2000: lines of candump, canboat, Actisense, Yacht Devices, iKonvert, SeaSmart, Airmar or PCAN-View.

The stamps of the lines are the time; a log that has only the hour, or seconds since its start, gets its date from
groups 126992, 129029 or 129033 where it has them.  A source is an address and a group, such as ``35/127250``; each
quantity has one, as in `nmea`.  Engines turn as 127488 says, with the sign of the gear in 127493.  Rudders above
instance 250 are those of displays, and are left out where another one is there.  A mapping file is that of `nmea`.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .. import Array, DataError, Trial
from ..instruments import Heard, each_line, trial_by
from ..n2k.groups import said
from ..n2k.layouts import Clock, Frame, Packets, frame_of
from ..nmea.sources import Series
from .nmea import Aboard, read_mapping

__all__ = ["EXAMPLE", "name", "read", "read_mapping", "suffixes"]

name = "n2k"
suffixes = (".n2k", ".candump", ".raw", ".trc")
EXAMPLE = """2026-11-26T12:00:00.000Z,2,127250,35,255,8,07,f3,42,ff,7f,ff,7f,fc
2026-11-26T12:00:00.000Z,2,127245,35,255,8,00,ff,ff,7f,7a,f7,ff,ff
2026-11-26T12:00:00.100Z,2,127250,35,255,8,08,f4,42,ff,7f,ff,7f,fc
2026-11-26T12:00:00.100Z,2,127245,35,255,8,00,ff,ff,7f,7b,f7,ff,ff
"""

_DAY, _QUARTER = 86400.0, 900.0
_BACK = 1.0
"""How far the clock of a log may go back from one line to the next [s]: frames are written as they come."""
_DISPLAYS = 250


@dataclass
class _Lines:
    """The whole messages of a log, the lines they end in, and frames of fast packets without the others."""

    frames: list[Frame] = field(default_factory=list[Frame])
    places: list[int] = field(default_factory=list[int])
    packets: Packets = field(default_factory=Packets)

    def take(self, heard: Heard, text: str) -> None:
        """One line."""
        if text[0] in "#;" or text[1:].startswith("PDGY,000000"):
            return
        frame = frame_of(text)
        if frame is None:
            heard.refuse(f"{text[:40]!r} is no frame")
        elif said(frame.pgn, b"") is None:
            heard.leave(f"PGN {frame.pgn}")
        elif (whole := self.packets.whole(frame)) is not None:
            self.frames.append(whole)
            self.places.append(heard.lines)


def read(source: Path, mapping: Aboard | None = None) -> Trial:
    """Read one log; without a mapping by the one beside it."""
    heard, lines, utc = Heard(), _Lines(), list[float]()
    each_line(source, heard, lambda text: lines.take(heard, text))
    clock = _clock(source, lines.frames)
    for t, frame in zip(_times(source, lines, clock), lines.frames, strict=True):
        values = said(frame.pgn, frame.data) or {}
        if "utc" in values:
            utc.append(values.pop("utc") - t)
        heard.add(t, f"{frame.source}/{frame.pgn}", values)
    steps = [f"{lines.packets.lost} frames of fast packets without the others"] if lines.packets.lost else []
    untimed = sum(one.clock != clock for one in lines.frames)
    if untimed:
        steps.append(f"{untimed} messages without a stamp, or with one of another clock, are left out")
    epoch = _epoch(clock, [one for one in utc if math.isfinite(one)], steps)
    return trial_by(source, heard, "NMEA 2000", mapping, epoch, steps, _finished)


def _clock(path: Path, frames: list[Frame]) -> Clock:
    """What the stamps of most messages count from.

    Raises:
        DataError: most have none.
    """
    clocks: tuple[Clock, ...] = ("epoch", "day", "start", "")
    count = Counter(one.clock for one in frames)
    found = max(clocks, key=lambda clock: count[clock])
    if frames and not found:
        raise DataError(f"{path}: its lines have no time; log with stamps, as candump -l does")
    return found


def _times(path: Path, lines: _Lines, clock: Clock) -> list[float]:
    """Times that rise, NaN for a line of another clock.

    Raises:
        DataError: a clock that goes back, naming the line.
    """
    out, last, days = list[float](), -math.inf, 0.0
    stamps = [one.t for one in lines.frames if one.clock == clock]
    if clock == "start" and 5 * sum(b < a for a, b in pairwise(stamps)) > len(stamps):
        raise DataError(f"{path}: its stamps are the times between lines (candump -td); log with candump -l")
    for one, place in zip(lines.frames, lines.places, strict=True):
        if one.clock != clock:
            out.append(math.nan)
            continue
        if clock == "day" and one.t + days < last - _DAY / 2:
            days += _DAY
        t = one.t + days
        if t < last - _BACK:
            raise DataError(f"{path}: line {place}: the clock goes back by {last - t:.6g} s; cut the log there")
        last = max(last, t)
        out.append(t)
    return out


def _epoch(clock: Clock, utc: list[float], steps: list[str]) -> float | None:
    """Seconds since 1970 at time 0."""
    if clock == "epoch":
        return 0.0
    if not utc:
        return None
    off = float(np.median(utc))
    steps.append("date by the groups that tell it (126992, 129029, 129033)")
    return _QUARTER * round(off / _QUARTER) if clock == "day" else off


def _finished(series: dict[str, Series]) -> dict[str, str]:
    """Rudders by their side and revolutions with the sign of the gear; the quantities of their readings."""
    names = {name: "rudder order" if name.endswith("_cmd") else "rudder"
             for name in series if name.startswith("delta_")}  # fmt: skip
    for end in ("", "_cmd"):
        there = {int(one.split("_")[1]): one for one in names if one.endswith("_cmd") == bool(end)}
        real = sorted((k for k in there if k <= _DISPLAYS), reverse=True) or sorted(there)[:1]
        for place, number in zip((f"delta{end}", f"delta_port{end}"), real, strict=False):
            series[place] = series[there[number]]
        for one in there.values():
            del series[one]
    for gear in [one for one in series if one.startswith("gear_")]:
        t, way = series.pop(gear)
        rpm = f"rpm_E_{gear.removeprefix('gear_')}"
        if rpm in series:
            series[rpm] = series[rpm][0], series[rpm][1] * way[_nearest(t, series[rpm][0])]
    return names


def _nearest(t: Array, wanted: Array) -> NDArray[np.intp]:
    """Places of the times that are nearest to others."""
    after = np.clip(np.searchsorted(t, wanted), 0, len(t) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(np.abs(wanted - t[before]) <= np.abs(t[after] - wanted), before, after)
