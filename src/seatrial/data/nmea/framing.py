r"""Frames around sentences: plain lines, and the datagrams of IEC 61162-450.

Such a datagram is ``UdPbC`` and a zero byte, then lines of a TAG block and a sentence each::

    \s:HE0001,n:7,c:1793275200123*4A\$HEHDT,98.25,T*12

with the source ``s``, the line's number ``n`` (0 to 999, then 0 again), and the time ``c`` in seconds or
milliseconds since 1970.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from .. import Array
from .digits import HEX, NOUGHTS, Bytes, Places, alike, mapped, rows_of, wholes
from .sentences import NmeaError, checksum

TAGGED = re.compile(rb"\\[^\\]{3,200}\\\s*$")
"""A TAG block at the end of what stands before a sentence."""

TOKEN = b"UdPbC\x00"
"""What a datagram of sentences begins with."""

LARGEST = 1472
"""Bytes of a datagram at most: one Ethernet frame."""

_BLOCK = re.compile(rb"\\([ -)+-\[\]-~]{3,120})\*([0-9A-Fa-f]{2})\\")
_SOURCE = re.compile(r"[A-Za-z0-9]{1,15}")
SOURCES = "S15"
"""Sources of many TAG blocks as an array."""
Texts = NDArray[np.bytes_]
# Codes of a TAG block: time, destination, group, line number, relative time, source, text, version.
_CODES = "cdgnrstv"
_FEW = 24
"""Forms of TAG blocks of one width that are looked for one after the other."""
MILLISECONDS = 10**11
"""A time above this many is in milliseconds: in seconds it would lie beyond the year 5000."""


@dataclass(frozen=True)
class Tag:
    """A TAG block; what is not in it is None.

    Attributes:
        source: of the sender, such as "HE0001".
        number: of the line, 0 to 999.
        time: seconds since 1970.
    """

    source: str | None = None
    number: int | None = None
    time: float | None = None


@dataclass(frozen=True)
class Line:
    """A sentence as it came, and the TAG block before it."""

    sentence: bytes
    tag: Tag | None = None


def tag_block(tag: Tag) -> bytes:
    """A TAG block as it goes on the wire; time to the millisecond.

    Raises:
        NmeaError: a source or a number that it cannot hold, or an empty block.
    """
    parts: list[str] = []
    if tag.source is not None:
        if not _SOURCE.fullmatch(tag.source):
            raise NmeaError(f"TAG block: source is '{tag.source}'; it is 1 to 15 letters and digits", "field")
        parts.append(f"s:{tag.source}")
    if tag.number is not None:
        if not 0 <= tag.number <= 999:
            raise NmeaError(f"TAG block: line number is {tag.number}; it is 0 to 999", "field")
        parts.append(f"n:{tag.number}")
    if tag.time is not None:
        parts.append(f"c:{round(tag.time * 1000.0)}")
    if not parts:
        raise NmeaError("TAG block: nothing in it", "field")
    content = ",".join(parts).encode()
    return b"\\" + content + b"*" + checksum(content).encode() + b"\\"


def datagram(lines: Iterable[Line]) -> bytes:
    """Lines as one datagram of IEC 61162-450.

    Raises:
        NmeaError: more than `LARGEST` bytes.
    """
    body = b"".join((tag_block(line.tag) if line.tag else b"") + line.sentence for line in lines)
    if len(TOKEN) + len(body) > LARGEST:
        raise NmeaError(f"a datagram of {len(TOKEN) + len(body)} bytes; {LARGEST} is the most", "length")
    return TOKEN + body


def split(data: bytes) -> list[bytes]:
    """The lines of a datagram, framed or plain; a line ends in CR LF or in LF, and a CR elsewhere is a part of it.

    Raises:
        NmeaError: more than `LARGEST` bytes, or binary data.
    """
    if len(data) > LARGEST:
        raise NmeaError(f"a datagram of {len(data)} bytes; {LARGEST} is the most", "length")
    body = data.removeprefix(TOKEN)
    return [line for line in (one.removesuffix(b"\r") for one in body.split(b"\n")) if line]


def read_line(line: bytes) -> Line:
    """A line taken apart.

    Raises:
        NmeaError: a TAG block that is not whole, not known, or whose checksum is wrong.
    """
    if not line.startswith(b"\\"):
        return Line(line)
    found = _BLOCK.match(line)
    if found is None:
        raise NmeaError("a TAG block that is not whole", "form")
    if checksum(found[1]) != found[2].decode().upper():
        raise NmeaError(f"TAG block: checksum is {found[2].decode()}; it should be {checksum(found[1])}", "checksum")
    return Line(line[found.end() :], _tag(found[1].decode()))


def _tag(text: str) -> Tag:
    said: dict[str, str] = {}
    for part in text.split(","):
        code, colon, value = part.partition(":")
        if not colon or code not in _CODES or not value or code in said:
            raise NmeaError(f"TAG block: '{part}' is no parameter of it", "field")
        said[code] = value
    number, time = said.get("n"), said.get("c")
    if number is not None and not (number.isdecimal() and len(number) <= 3):
        raise NmeaError(f"TAG block: line number is '{number}'; it is 0 to 999", "field")
    if time is not None and not (time.isdecimal() and len(time) <= 15):
        raise NmeaError(f"TAG block: time is '{time}'; it is whole seconds or milliseconds since 1970", "field")
    if "s" in said and not _SOURCE.fullmatch(said["s"]):
        raise NmeaError(f"TAG block: source is '{said['s']}'; it is 1 to 15 letters and digits", "field")
    since = None if time is None else int(time) / 1000.0 if int(time) > MILLISECONDS else float(time)
    return Tag(said.get("s"), None if number is None else int(number), since)


def _templates(plain: Bytes, start: Places, width: Places) -> Iterator[Places]:
    """Texts that are the same but for what `plain` has made alike, group by group: a log has few of them."""
    for size in np.unique(width).tolist():
        left = np.flatnonzero(width == size)
        table = rows_of(plain, start[left], size)
        for _ in range(_FEW):
            same = (table == table[0]).all(axis=1)
            yield left[same]
            left, table = left[~same], table[~same]
            if not len(left):
                break
        else:
            yield from (left[rows] for rows in alike(plain, start[left], width[left]))


def tag_times(data: Bytes, start: Places, width: Places) -> tuple[Array, Places, Texts]:
    """Times of the TAG blocks that texts end with, many at a time [s], where each block begins, and its source.

    Returns:
        Times, NaN where a block has none, infinite where it is wrong (then see `read_line`); first bytes; sources,
        empty where a block names none.
    """
    times, begins, sources = np.full(len(start), np.inf), start + width, np.zeros(len(start), SOURCES)
    if not len(start):
        return times, begins, sources
    plain = mapped(data, NOUGHTS).copy()
    star = np.flatnonzero(data == ord("*"))
    plain[star + 1] = plain[star + 2] = 48
    for rows in _templates(plain, start, width):
        text = data[start[rows[0]] : start[rows[0]] + width[rows[0]]].tobytes()
        block = TAGGED.search(text)
        found = block and _BLOCK.fullmatch(text, block.start(), block.end())
        try:
            said = _tag(found[1].decode()) if found else None
        except NmeaError:
            continue
        if found is None or said is None:
            continue
        at, star = start[rows] + found.start(), start[rows] + found.end(1)
        total = np.bitwise_xor.reduce(rows_of(data, at + 1, len(found[1])), axis=1)
        good = total == 16 * HEX[data[star + 1]] + HEX[data[star + 2]]
        time = re.search(rb"(?:^|,)c:(\d+)", found[1])
        if time is None:
            told = np.full(len(rows), np.nan)
        else:
            whole = wholes(data, at + 1 + time.start(1), len(time[1]))
            told = np.where(whole > MILLISECONDS, whole / 1000.0, whole)
        times[rows], begins[rows] = np.where(good, told, np.inf), at
        source = re.search(rb"(?:^|,)s:([A-Za-z0-9]+)", found[1])
        if source is not None:
            letters = rows_of(data, at + 1 + source.start(1), len(source[1]))
            sources[rows] = np.ascontiguousarray(letters).view(f"S{len(source[1])}").ravel()
    return times, begins, sources
