"""Logs of NMEA 2000: lines of candump, canboat, Actisense, Yacht Devices, iKonvert, SeaSmart, Airmar or CAN loggers.

Lines of JSON (`n2k.spoken`) and records of Yacht Devices (`n2k.recorder`) are brought into a form of lines first.

The stamps of the lines are the time; where they go back the log is cut into pieces, a trial each.  A log that has only
the hour, or seconds since its start, gets its date from groups 126992, 129029 or 129033 where it has them.  A source
is an address and a group, such as ``35/127250``; each quantity has one, as in `nmea`.  Engines turn as 127488 says,
with the sign of the gear in 127493.  Rudders above instance 250 are those of displays, and are left out where another
one is there.  A mapping file is that of `nmea`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...core.values import dataclass, field
from .. import Array, DataError, Trial
from ..instruments import Heard, trial_by
from ..n2k import recorder, spoken
from ..n2k.frames import Frames, frames, joined
from ..n2k.groups import FAST, PGNS, all_said, finished, said
from ..n2k.layouts import Clock, Frame, Packets, frame_of, sender
from ..nmea.digits import WIDEST
from ..table import existing
from .nmea import Aboard, numbered, only, read_mapping

__all__ = ["EXAMPLE", "name", "read", "read_all", "read_mapping", "suffixes"]

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
_LONG = 60.0
"""A piece of a log whose clock goes back is a trial where it is at least so long [s]."""
_MANY = 50
"""Pieces of a log at most."""
_BLOCK, _HEAD = 1_000_000, 65_536
"""Bytes that are read at a time, and those that tell records of a device from lines."""
_BOM = b"\xef\xbb\xbf \r\n"
_GLUED = re.compile(r"(?<=.)(?=[!$]PDGY,)")
"""Where an iKonvert begins a line without having ended the one before."""


@dataclass
class _Piece:
    """Readings of a time in which the clock goes on.

    Attributes:
        first, last, prior: its first, its last and its last but one time [s].
        opened, run: how long it went on without a gap of `_LONG` at first [s], and since when it does.
        utc: what times are off UTC.
    """

    heard: Heard = field(default_factory=Heard)
    first: float = math.inf
    last: float = -math.inf
    prior: float = -math.inf
    opened: float = math.inf
    run: float = math.inf
    utc: list[float] = field(default_factory=list[float])

    def at(self, t: float) -> None:
        """A message at a time [s]."""
        if t > self.last + _LONG:
            self.opened = min(self.opened, self.last - self.first if self.first < math.inf else math.inf)
            self.run = t
        self.first, self.prior, self.last = min(self.first, t), self.last, max(self.last, t)

    def enough(self, first: bool, last: bool) -> bool:
        """Whether it is long enough for a trial, on both sides that are cuts: a clock wrong for a while is none."""
        begins = min(self.opened, self.last - self.first) >= _LONG
        return (first or begins) and (last or self.last - self.run >= _LONG)


@dataclass
class _Told:
    """What the messages tell whose stamps count from one thing.

    Attributes:
        pieces: between the times at which the clock goes back.
        messages, down: how many there are, and how many of a stamp before that of the one before.
        back: where the clock goes back first, in words.
        once: whether one message alone was ahead.
        days: seconds of the midnights that a clock of the day has passed.
        before: the last stamp.
    """

    pieces: list[_Piece] = field(default_factory=lambda: [_Piece()])
    messages: int = 0
    down: int = 0
    back: str = ""
    once: bool = False
    days: float = 0.0
    before: float = -math.inf

    def all(self, quick: list[Frames], wholes: list[tuple[int, Frame]]) -> bool:
        """All messages of a block; False, and nothing taken, where the clock does not go on through it evenly."""
        line = np.concatenate([*(one.line for one in quick), np.array([k for k, _ in wholes], np.int64)])
        stamps = np.concatenate([*(one.t for one in quick), np.array([one.t for _, one in wholes])])
        stamps = stamps[np.argsort(line, kind="stable")]
        piece, t = self.pieces[-1], stamps + self.days
        last = piece.last if self.messages else float(t[0])
        top = np.maximum.accumulate(np.append(last, t))
        if np.any((t < top[:-1] - _BACK) | (t > top[:-1] + _LONG)):
            return False
        if not self.messages:
            piece.at(float(t[0]))
        self.down += int(np.count_nonzero(np.diff(np.append(self.before, stamps)) < 0.0))
        self.messages, self.before = self.messages + len(t), float(stamps[-1])
        piece.first, piece.prior, piece.last = min(piece.first, float(t.min())), float(top[-2]), float(top[-1])
        columns = [one for found in quick for one in self._columns(piece, found)]
        for k, whole in wholes:
            one = np.array([k]), np.array([whole.t]), np.array([whole.pgn]), np.array([whole.source])
            columns += self._columns(piece, Frames(whole.clock, *one, np.frombuffer(whole.data, np.uint8)[None]))
        for _, source, name, t, values in sorted(columns, key=lambda one: one[0]):  # in the order in which they begin
            piece.heard.many(source, name, t, values)
        return True

    def _columns(self, piece: _Piece, found: Frames) -> Iterator[tuple[tuple[int, int], str, str, Array, Array]]:
        """Readings of frames: line of the first and place in it, source, name, times and values."""
        for pgn in np.unique(found.pgn).tolist():
            of_group = found.rows(np.flatnonzero(found.pgn == pgn))
            for source in np.unique(of_group.source).tolist():
                mine = of_group.rows(np.flatnonzero(of_group.source == source))
                alone = len(mine) == 1  # fast packets have numbers of 8 bytes
                each = [(np.arange(1), said(pgn, mine.data.tobytes()) or {})] if alone else all_said(pgn, mine.data)
                for rows, values in each:
                    for k, (name, value) in enumerate(values.items()):
                        good = rows[np.isfinite(np.broadcast_to(value, len(rows)))]
                        known = np.broadcast_to(value, len(rows))[np.isin(rows, good)]
                        if name == "utc":
                            piece.utc += (known - (mine.t[good] + self.days)).tolist()
                        elif len(good):
                            begun = int(mine.line[good[0]]), k
                            yield begun, f"{sender(source)}/{pgn}", name, mine.t[good] + self.days, known

    def _said(self, piece: _Piece, t: float, frame: Frame) -> None:
        values = said(frame.pgn, frame.data) or {}
        if "utc" in values:
            piece.utc.append(values.pop("utc") - t)
        piece.heard.add(t, f"{sender(frame.source)}/{frame.pgn}", values)

    def take(self, frame: Frame, line: int) -> None:
        """One message."""
        self.messages += 1
        self.down += frame.t < self.before
        self.before = frame.t
        piece = self.pieces[-1]
        if frame.clock == "day" and frame.t + self.days < piece.last - _DAY / 2:
            self.days += _DAY
        t = frame.t + self.days
        if t < piece.last - _BACK:
            self.back = self.back or f"line {line}: the clock goes back by {piece.last - t:.6g} s"
            self.once |= t >= piece.prior
            if len(self.pieces) < _MANY:
                piece = _Piece()
                self.pieces.append(piece)
        piece.at(t)
        self._said(piece, t, frame)


@dataclass
class _Lines:
    """The messages of a log by what their stamps count from, and frames of fast packets without the others."""

    told: dict[Clock, _Told] = field(default_factory=dict[Clock, _Told])
    packets: Packets = field(default_factory=Packets)

    def take(self, heard: Heard, block: bytes) -> None:
        """Whole lines."""
        raw = np.frombuffer(block, np.uint8)
        end = np.flatnonzero(raw == ord("\n"))
        begin = np.append(0, end[:-1] + 1)[: len(end)]
        data = np.concatenate([raw, np.zeros(WIDEST, np.uint8)])
        left, quick, loose = np.ones(len(end), bool), list[Frames](), list[tuple[int, Frame]]()
        for found in frames(data, begin, end - ((end > begin) & (data[end - 1] == ord("\r")))):
            left[found.line] = False
            for pgn in np.unique(found.pgn).tolist():
                rows = np.flatnonzero(found.pgn == pgn)
                if pgn not in PGNS:
                    heard.leave(f"PGN {pgn}", len(rows))
                elif pgn in FAST:
                    loose += found.rows(rows).one_by_one()
                else:
                    quick.append(found.rows(rows))
        before = heard.lines
        for k in np.flatnonzero(left).tolist():
            heard.lines = before + k + 1
            loose += [(k, frame) for frame in _line(heard, block[begin[k] : end[k]])]
        heard.lines = before + len(end)
        wholes = [(k, whole) for k, frame in sorted(loose, key=lambda one: one[0])
                  if (whole := self.packets.whole(frame)) is not None]  # fmt: skip
        self._messages(before, joined(quick), wholes)

    def _messages(self, before: int, quick: list[Frames], wholes: list[tuple[int, Frame]]) -> None:
        """Messages of a block that begins behind so many lines."""
        clocks = list[Clock]()
        for one in (*quick, *(whole for _, whole in wholes)):
            if one.clock not in clocks:
                clocks.append(one.clock)
        if len(clocks) == 1 and self.told.setdefault(clocks[0], _Told()).all(quick, wholes):
            return
        each = [*wholes, *(pair for one in quick for pair in one.one_by_one())]
        for line, frame in sorted(each, key=lambda one: one[0]):
            self.told.setdefault(frame.clock, _Told()).take(frame, before + line + 1)


def _line(heard: Heard, line: bytes) -> Iterator[Frame]:
    """The frames of a line that are of groups that are read."""
    text = line.decode("utf-8-sig" if heard.lines == 1 else "utf-8", "replace").rstrip("\r\n\0 ")
    for part in _GLUED.split(text) if "PDGY" in text else (text,):
        if not part or part[0] in "#;" or part[1:].startswith("PDGY,000000"):
            continue
        frame = frame_of(part)
        if frame is None:
            heard.refuse(f"{part[:40]!r} is no frame")
        elif frame.pgn not in PGNS:
            heard.leave(f"PGN {frame.pgn}")
        else:
            yield frame


def _blocks(path: Path) -> Iterator[bytes]:
    """The file in blocks of whole lines; a line that is longer than any frame is cut.

    Raises:
        DataError: no such file, or one that may not be read.
    """
    try:
        with existing(path).open("rb") as file:
            if recorder.recorded(file.read(_HEAD)):
                file.seek(0)
                yield from recorder.lines(file.read())
                return
            file.seek(0)
            rest = b""
            while chunk := file.read(_BLOCK):
                chunk = rest + chunk
                cut = chunk.rfind(b"\n") + 1
                if not cut and len(chunk) > _BLOCK:
                    chunk, cut = chunk[:_BLOCK] + b"\n", _BLOCK + 1
                rest = chunk[cut:]
                if cut:
                    yield chunk[:cut]
            if rest:
                yield rest + b"\n"
    except OSError as error:
        raise DataError(f"{path}: not readable: {error.strerror}") from None


def read(source: Path, mapping: Aboard | None = None) -> Trial:
    """Read the only trial of one log; without a mapping by the one beside it.

    Raises:
        DataError: also for a log whose clock goes back, which is several.
    """
    return only(read_all(source, mapping), source)


def read_all(source: Path, mapping: Aboard | None = None) -> tuple[Trial, ...]:
    """Read one log; where its clock goes back, each piece is a trial."""
    heard, lines, degrees = Heard(), _Lines(), None
    for block in _blocks(source):
        if block.lstrip(_BOM).startswith(b"{"):
            degrees = spoken.degrees_by(block) if degrees is None else degrees
            block = spoken.plain(block, degrees)
        lines.take(heard, block)
    clock, told = _leading(source, lines)
    steps = [f"{lines.packets.lost} frames of fast packets without the others"] if lines.packets.lost else []
    untimed = sum(one.messages for one in lines.told.values()) - told.messages
    if untimed:
        steps.append(f"{untimed} messages without a stamp, or with one of another clock, are left out")
    out = list[Trial]()
    for k, piece in enumerate(told.pieces, 1):
        said = [*steps, f"piece {k} of {len(told.pieces)}, cut at {told.back}"] if told.back else [*steps]
        over = [
            other for other in told.pieces if other is not piece and other.first < piece.last > piece.first < other.last
        ]
        said += ["doubt: it lies over the time of another piece; what was logged twice is in both"] * bool(over)
        one = piece.heard
        one.lines, one.invalid, one.first, one.ignored = heard.lines, heard.invalid, heard.first, heard.ignored
        epoch = _epoch(clock, [off for off in piece.utc if math.isfinite(off)], said)
        out.append(trial_by(source, one, "NMEA 2000", mapping, epoch, said, finished))
    return numbered(out)


def _leading(path: Path, lines: _Lines) -> tuple[Clock, _Told]:
    """What the stamps of most messages count from, and what these tell.

    Raises:
        DataError: most have none, they are times between lines, or the clock goes back and a piece is too short.
    """
    clocks: tuple[Clock, ...] = ("epoch", "day", "start", "")
    clock = max(clocks, key=lambda one: lines.told[one].messages if one in lines.told else 0)
    told = lines.told.get(clock, _Told())
    if told.messages and not clock:
        raise DataError(f"{path}: its lines have no time; log with stamps, as candump -l does")
    if clock == "start" and 5 * told.down > told.messages:
        raise DataError(f"{path}: its stamps are the times between lines (candump -td); log with candump -l")
    some = len(told.pieces)
    enough = all(one.enough(k == 0, k == some - 1) for k, one in enumerate(told.pieces))
    if told.back and (some == _MANY or told.once or not enough):
        raise DataError(f"{path}: {told.back}; cut the log there")
    return clock, told


def _epoch(clock: Clock, utc: list[float], steps: list[str]) -> float | None:
    """Seconds since 1970 at time 0."""
    if clock == "epoch":
        return 0.0
    if not utc:
        return None
    off = float(np.median(utc))
    steps.append("date by the groups that tell it (126992, 129029, 129033)")
    return _QUARTER * round(off / _QUARTER) if clock == "day" else off
