"""Logs of the voyage recorders of Yacht Devices (YDVR, ``.DAT``): binary records, put into lines that are read.

A record is two bytes of milliseconds, the 29 bits of an identifier in four, and the bytes of a frame: eight, three of
an order for a group (59904), or of a fast packet, which the recorder has put together, its sequence, its length and so
many (layout of OpenVBI's reader).  The milliseconds begin anew each minute (of some devices at 65536), so minutes of
silence are not in them; the groups that tell the time of the day put them back.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Collection, Iterator

from .groups import FAST, said

_SERVICE, _LEAST, _ORDER = b"\xff\xff\xff\xff", 59392, 59904
"""Identifier of the records of the device itself, the least number of a group, and that of an order for a group."""
_RECORDS, _PAUSE = 24, 3000
"""Records that tell the format, and the longest pause between two of them [ms]."""
_AHEAD, _BLOCK = 3, 20_000
"""Records that have to follow one, as any bytes may look like one; lines that are given at a time."""
_MINUTE, _COUNTER = 60000, 65536
_LOST = 30.0
"""Seconds by which the clock of the bus is ahead where minutes are missing."""


def recorded(head: bytes) -> bool:
    """Whether the first bytes of a file are records of such a device."""
    ends, kinds = {0}, set[bytes]()
    for _ in range(_RECORDS):
        ends = {end for at in ends for end in _after(head, at)}
        kinds |= {head[at + 2 : at + 6] for at in ends}
    return bool(ends) and len(kinds - {_SERVICE}) > 1


def lines(raw: bytes) -> Iterator[bytes]:
    """The frames of a file as blocks of lines of candump and of iKonvert, stamps in seconds since the first minute."""
    step, out, days, before, off = _step(raw), list[str](), 0, -1, math.nan
    for now, number, data in _records(raw):
        days += step * (now < before - step / 2)
        before, t, group = now, (days + now) / 1000.0, _group(number)
        utc = (said(group, data) or {}).get("utc", math.nan) if group == 126992 else math.nan
        off = utc - t if math.isnan(off) else off
        if utc - t - off > _LOST:
            days += step * round((utc - t - off) * 1000.0 / step)
            t = (days + now) / 1000.0
        if len(data) > 8 or group in FAST:
            text = base64.b64encode(data).decode()
            out.append(f"!PDGY,{group},{number >> 26 & 7},{number & 255},255,{t:.3f},{text}")
        else:
            out.append(f"({t:.3f}) can0 {number:08X}#{data.hex()}")
        if len(out) == _BLOCK:
            yield "\n".join(out).encode() + b"\n"
            out.clear()
    if out:
        yield "\n".join(out).encode() + b"\n"


def _step(raw: bytes) -> int:
    """Where the milliseconds begin anew, by the first two minutes."""
    before, begun = -1, 0
    for now, _, _ in _records(raw):
        begun += now < before - _MINUTE / 2
        before = now
        if now >= _MINUTE or begun > 1:
            break
    return _COUNTER if before >= _MINUTE else _MINUTE


def _group(number: int) -> int:
    group = number >> 8 & 0x3FFFF
    return group if group >> 8 & 0xFF >= 240 else group & 0x3FF00


def _records(raw: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Milliseconds, identifier and bytes of each frame.

    Damaged bytes are passed over, up to a record of an identifier that came before: any bytes may look like one.
    """
    at, sound, known, short = 0, True, set[bytes](), set[bytes]()
    while at + 7 < len(raw):
        identifier = raw[at + 2 : at + 6]
        ends = _after(raw, at) if sound or identifier in known else []
        if identifier in short and at + 14 in ends:
            ends = [at + 14]
        elif ends == [at + 14]:
            short.add(identifier)  # a group is one of fast packets or not
        if len(ends) > 1 or not sound:
            ends = [one for one in ends if _goes_on(raw, one, _AHEAD)]
        elif not ends:  # silence follows, or damage
            ends = [one for one in _ends(raw, at) if _goes_on(raw, one, _AHEAD, known)]
        sound = bool(ends)
        if not sound:
            at += 1
            continue
        end, number = ends[0], int.from_bytes(identifier, "little")
        if identifier != _SERVICE:
            known.add(identifier)
            fast = _group(number) in FAST or end - at not in (9, 14)
            yield int.from_bytes(raw[at : at + 2], "little"), number, raw[at + 6 + 2 * fast : end]
        at = end


def _goes_on(raw: bytes, at: int, many: int, known: Collection[bytes] = ()) -> bool:
    """Whether so many records follow, of known identifiers if any are given, or the end of the file."""
    if at >= len(raw) or not many:
        return True
    if known and raw[at + 2 : at + 6] not in (*known, _SERVICE):
        return False
    return any(_goes_on(raw, end, many - 1, known) for end in _after(raw, at))


def _ends(raw: bytes, at: int) -> list[int]:
    """Where the record at a byte may end, if one may begin there."""
    service, number = raw[at + 2 : at + 6] == _SERVICE, int.from_bytes(raw[at + 2 : at + 6], "little")
    if at + 8 > len(raw) or not (service or (number >> 29 == 0 and number >> 8 & 0x3FFFF >= _LEAST)):
        return []
    group = _group(number)
    sizes = [3] if group == _ORDER else [8] if service else [8, 2 + raw[at + 7]]
    return [end for size in (sizes[::-1] if group in FAST else sizes) if (end := at + 6 + size) <= len(raw)]


def _after(raw: bytes, at: int) -> list[int]:
    """Those ends behind which the next record begins soon."""
    now = int.from_bytes(raw[at : at + 2], "little")
    follow = [(end, int.from_bytes(raw[end : end + 2], "little")) for end in _ends(raw, at)]
    return [end for end, then in follow
            if end == len(raw) or min((then - now) % _MINUTE, (then - now) % _COUNTER) < _PAUSE]  # fmt: skip
