"""Frames of many lines together: lines that are the same but for their digits, in the layouts of most logs.

What `layouts.frame_of` tells of each such line, to the bit; other lines are left to it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import numpy as np

from ...core.values import dataclass
from .. import Array
from ..nmea.digits import HEX, Bytes, Places, Same, alike, mapped, rows_of, wholes
from .layouts import BUS, CANBOAT, CANDUMP, RAW, Clock, Frame, moment

_FEW = 16
"""Lines that are not worth columns of their own."""
_REPEATS = 8
"""Lines of one shape that differ in what is not read so often are left, too."""
_YEAR = 365 * 86400.0
_WIDE = 120
_HEXED = bytes(ord("0") if HEX[k] < 16 else k for k in range(256))
_POINTS = (ord(":"), ord("."))
_PAIR = re.compile(r"[0-9A-Fa-f]{2}")


@dataclass(frozen=True)
class Frames:
    """Frames of lines: numbers of the lines, stamps [s] and what they count from, groups, senders, bytes."""

    clock: Clock
    line: Places
    t: Array
    pgn: Places
    source: Places
    data: Bytes

    def __len__(self) -> int:
        return len(self.line)

    def one_by_one(self) -> list[tuple[int, Frame]]:
        """Each with its line."""
        parts = (part.tolist() for part in (self.line, self.t, self.pgn, self.source))
        return [(line, Frame(self.clock, t, pgn, source, data.tobytes()))
                for line, t, pgn, source, data in zip(*parts, self.data, strict=True)]  # fmt: skip

    def rows(self, some: Places) -> Frames:
        """Some of them."""
        return Frames(self.clock, self.line[some], self.t[some], self.pgn[some], self.source[some], self.data[some])


def _number(same: Same, k: int) -> Places:
    """A hexadecimal number."""
    first, end = same.found.span(k)
    return HEX[rows_of(same.data, same.start + first, end - first)] @ (16 ** np.arange(end - first)[::-1])


def _bytes(same: Same, k: int) -> Bytes:
    """Pairs of hexadecimal digits."""
    first, end = same.found.span(k)
    pairs = [first + one.start() for one in _PAIR.finditer(same.found[k])]
    table = HEX[rows_of(same.data, same.start, end or 1)]
    return (16 * table[:, pairs] + table[:, [one + 1 for one in pairs]]).astype(np.uint8)


_Read = Callable[[Same], tuple[Array, Places, Places]]


def _identified(pgn: Places) -> tuple[Places, Places]:
    """Group and source of 29 bits."""
    group = pgn >> 8 & 0x3FFFF
    return np.where((group >> 8 & 0xFF) >= 240, group, group & 0x3FF00), pgn & 0xFF


def _candump(same: Same) -> tuple[Array, Places, Places]:
    group, source = _identified(_number(same, 3))
    return same.decimal(1), group, source + BUS * int(same.found[2] or 0)


def _raw(same: Same) -> tuple[Array, Places, Places]:
    first = same.found.start(1)
    hours, minutes = (wholes(same.data, same.start + first + k, 2) for k in (0, 3))
    return 3600.0 * hours + 60.0 * minutes + same.decimal(1, 6), *_identified(_number(same, 2))


def _canboat(same: Same) -> tuple[Array, Places, Places]:
    found, first = same.found, same.found.start(2)
    hours, minutes, seconds = (wholes(same.data, same.start + first + k, 2) for k in (0, 3, 6))
    good = (hours < 24) & (minutes < 60) & (seconds < 60)
    t = moment(found[1], "00:00:00", None, found[4]) + (3600 * hours + 60 * minutes + seconds)
    t = t + same.whole(3) / 10.0 ** len(found[3]) if found[3] else t
    return np.where(good, t, np.nan), same.whole(6), same.whole(7)


@dataclass(frozen=True)
class _Layout:
    """A layout: pattern; what reads stamp, group and source; its groups of digits, hexadecimal digits and bytes."""

    pattern: re.Pattern[str]
    read: _Read
    digits: tuple[int, ...]
    hexed: tuple[int, ...]
    bytes_of: int
    clocks: tuple[Clock, Clock] = ("epoch", "epoch")
    count: int = 0


_QUICK = (
    _Layout(CANDUMP, _candump, (1,), (3,), 4, ("start", "epoch")), _Layout(RAW, _raw, (1,), (2,), 3, ("day", "day")),
    _Layout(CANBOAT, _canboat, (2, 3, 5, 6, 7, 8), (), 10, count=9),
)  # fmt: skip


def frames(data: Bytes, begin: Places, end: Places) -> Iterator[Frames]:
    """Frames of the lines of a block; lines that are in none are for `layouts.frame_of`.

    Args:
        data: the bytes, and `digits.WIDEST` more.
        begin, end: first byte of each line, and the one behind its last.
    """
    some = np.flatnonzero((end > begin) & (end - begin < _WIDE))
    for rows in alike(mapped(data, _HEXED), begin[some], (end - begin)[some], few=_FEW):
        left = some[rows]
        for _ in range(_REPEATS):
            if len(left) < _FEW:
                break
            text = data[begin[left[0]] : end[left[0]]].tobytes().decode("latin-1")
            made = next(((found, one) for one in _QUICK if (found := one.pattern.match(text))), None)
            if made is None:
                break
            found, layout = made
            fixed = np.ones(len(text), bool)
            for k in (*layout.digits, *layout.hexed, layout.bytes_of):
                fixed[slice(*found.span(k))] = False
            table = rows_of(data, begin[left], len(text))[:, fixed]
            same = (table == table[0]).all(axis=1)
            yield from _frames(Same(data, begin[left[same]], found), left[same], layout)
            left = left[~same]


def _frames(same: Same, line: Places, layout: _Layout) -> Iterator[Frames]:
    found = same.found
    table, hexed = _bytes(same, layout.bytes_of), sum(HEX[k] < 16 for k in found[layout.bytes_of].encode())
    if hexed != 2 * table.shape[1] or hexed > 16 or (layout.count and 2 * int(found[layout.count]) != hexed):
        return
    try:
        t, pgn, source = layout.read(same)
    except ValueError:  # a date that is none
        return
    good = ~np.isnan(t)
    for k in layout.digits:  # what is a digit in the first line may be a letter in another
        first, end = found.span(k)
        digits = rows_of(same.data, same.start + max(first, 0), max(end - first, 0))
        good &= (np.isin(digits, _POINTS) | ((digits >= ord("0")) & (digits <= ord("9")))).all(axis=1)
    for late, clock in enumerate(layout.clocks):
        rows = np.flatnonzero(good & ((t > _YEAR) == bool(late)))
        if len(rows):
            yield Frames(clock, line, t, pgn, source, table).rows(rows)


def joined(some: list[Frames]) -> list[Frames]:
    """Frames of one clock and one length together, in the order of their lines."""
    out = list[Frames]()
    shapes = {(one.clock, one.data.shape[1]): one for one in some}
    for shape, first in shapes.items():
        mine = [one for one in some if (one.clock, one.data.shape[1]) == shape]
        line = np.concatenate([one.line for one in mine])
        t, data = np.concatenate([one.t for one in mine]), np.concatenate([one.data for one in mine])
        pgn, source = np.concatenate([one.pgn for one in mine]), np.concatenate([one.source for one in mine])
        out.append(Frames(first.clock, line, t, pgn, source, data).rows(np.argsort(line, kind="stable")))
    return out
