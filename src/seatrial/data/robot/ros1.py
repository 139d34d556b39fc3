"""Bags of ROS 1, record by record from their first: what a cut-off one holds is read as that of a whole one.

A record is a header of fields and data; those of a chunk are packed together.  The index at the end is not needed.
"""

from __future__ import annotations

import bz2
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from ...core import unpacking
from ...core.values import dataclass, field
from .. import DataError
from .chunks import FEW, PACKED, USUAL
from .messages import Message, extra

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7
_LENGTH, _TIME = struct.Struct("<I"), struct.Struct("<II")
_HEADER = 1 << 20
"""Bytes of the fields of a record at most: a connection has the definition of its message in its data."""


@dataclass
class Walk:
    """Reading of one bag.

    Attributes:
        definitions: text of each kind of message that it defines.
        lost: what is wrong with its end, in words; empty for a whole bag.
    """

    path: Path
    definitions: dict[str, str] = field(default_factory=dict[str, str])
    lost: str = ""
    _topics: dict[int, tuple[str, str]] = field(default_factory=dict[int, tuple[str, str]])

    def messages(self, file: BinaryIO) -> Iterator[Message]:
        """Each message in the order of the file, whose chunks are counted before.

        Raises:
            DataError: another file, a damaged one, one that holds too much, or too many messages.
        """
        if file.read(len(MAGIC)) != MAGIC:
            raise DataError(f"{self.path}: no bag of ROS 1: its first bytes are not #ROSBAG V2.0")
        self._hold(file)
        for fields, data in self._records(file):
            op = _number(fields, b"op")
            if op == _CHUNK:
                for inner, part in self._inside(fields, data):
                    yield from self._take(_number(inner, b"op"), inner, part)
            else:
                yield from self._take(op, fields, data)

    def _records(self, file: BinaryIO) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
        """Fields and data of each whole record."""
        size, at = self.path.stat().st_size, len(MAGIC)
        file.seek(at)
        while at < size:
            found = _record(file, size - at)
            if found is None:
                self.lost = f"cut off: the last {size - at} of {size} bytes are of no whole record, and are lost"
                return
            fields, data, length = found
            at += length
            yield fields, data

    def _hold(self, file: BinaryIO) -> None:
        """Count what the chunks hold.

        Raises:
            DataError: too much, or too many messages in little.
        """
        size, total, count = self.path.stat().st_size, 0, 0
        most = max(FEW, size // PACKED)
        for fields, data in self._records(file):
            if _number(fields, b"op") != _CHUNK:
                continue
            said = _number(fields, b"size")
            total += max(said, 0)
            if total > unpacking.most(size):
                raise DataError(f"{self.path}: {unpacking.told(total, size)}")
            if said > USUAL * len(data):
                count += _counted(_unpacked(self.path, fields.get(b"compression", b"none"), data, said), most - count)
            if count > most:
                raise DataError(f"{self.path}: more than {most} messages in {size} bytes; no instrument repeats itself "
                                "so often")  # fmt: skip

    def _inside(self, fields: Mapping[bytes, bytes], data: bytes) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
        """Fields and data of the records of a chunk.

        Raises:
            DataError: bytes of no record.
        """
        inside = _unpacked(self.path, fields.get(b"compression", b"none"), data, _number(fields, b"size"))
        at = 0
        while (found := _split(inside, at)) is not None:
            inner, part, at = found
            if b"op" not in inner:
                raise DataError(f"{self.path}: a damaged chunk: a record without its kind; copy the file again")
            yield inner, part

    def _take(self, op: int, fields: Mapping[bytes, bytes], data: bytes) -> Iterator[Message]:
        at = _number(fields, b"conn")
        if op == _CONNECTION:
            about = _fields(data)
            package, _, name = _text(about, b"type").rpartition("/")
            kind = f"{package}/msg/{name}"
            self._topics[at] = _text(fields, b"topic") or _text(about, b"topic"), kind
            self.definitions.setdefault(kind, _text(about, b"message_definition"))
        elif op == _MESSAGE and at in self._topics and len(fields.get(b"time", b"")) == _TIME.size:
            seconds, nanoseconds = _TIME.unpack(fields[b"time"])
            yield Message(*self._topics[at], seconds * 10**9 + nanoseconds, data, "ros1")


def _record(file: BinaryIO, left: int) -> tuple[dict[bytes, bytes], bytes, int] | None:
    """Fields, data and length of the next record; None where it is not whole."""
    head = file.read(_LENGTH.size)
    if len(head) < _LENGTH.size or (count := _LENGTH.unpack(head)[0]) > min(left - 8, _HEADER):
        return None
    fields = _fields(file.read(count))
    (length,) = _LENGTH.unpack(file.read(_LENGTH.size))
    if count + length + 8 > left:
        return None
    if _number(fields, b"op") not in (_MESSAGE, _CHUNK, _CONNECTION):
        file.seek(length, 1)
        return fields, b"", count + length + 8
    return fields, file.read(length), count + length + 8


def _counted(data: bytes, most: int) -> int:
    """Records of a chunk, by their lengths alone; one more than `most` where there are more."""
    count, at, size = 0, 0, len(data)
    while at + 8 <= size and count <= most:
        first = at + 4 + _LENGTH.unpack_from(data, at)[0]
        if first + 4 > size:
            break
        at = first + 4 + _LENGTH.unpack_from(data, first)[0]
        count += at <= size
    return count


def _split(data: bytes, at: int) -> tuple[dict[bytes, bytes], bytes, int] | None:
    """Fields and data of the record of a chunk, and where the next one begins."""
    if at + 8 > len(data):
        return None
    first = at + 4 + _LENGTH.unpack_from(data, at)[0]
    if first + 4 > len(data):
        return None
    end = first + 4 + _LENGTH.unpack_from(data, first)[0]
    return (_fields(data[at + 4 : first]), data[first + 4 : end], end) if end <= len(data) else None


def _fields(data: bytes) -> dict[bytes, bytes]:
    found: dict[bytes, bytes] = {}
    at = 0
    while at + 4 <= len(data):
        end = at + 4 + _LENGTH.unpack_from(data, at)[0]
        name, _, value = data[at + 4 : end].partition(b"=")
        found[name] = value
        at = end
    return found


def _number(fields: Mapping[bytes, bytes], name: bytes) -> int:
    """A whole number of a header, -1 for none."""
    value = fields.get(name, b"")
    return int.from_bytes(value, "little") if 0 < len(value) <= 8 else -1


def _text(fields: Mapping[bytes, bytes], name: bytes) -> str:
    return fields.get(name, b"").decode(errors="replace")


def _unpacked(path: Path, packed: bytes, data: bytes, said: int) -> bytes:
    """A chunk; of a damaged one, and of one that is larger than it says, no more than is told of it.

    Raises:
        DataError: damaged, or packed by an unknown method.
    """
    try:
        if packed == b"none":
            return data
        if packed == b"bz2":
            return bz2.BZ2Decompressor().decompress(data, max(said, 1))
        if packed == b"lz4":
            return bytes(extra("lz4.frame").LZ4FrameDecompressor().decompress(data, max_length=max(said, 1)))
    except (OSError, RuntimeError, EOFError, ValueError) as error:
        raise DataError(f"{path}: a damaged chunk ({error}); copy it again") from None
    raise DataError(f"{path}: a chunk packed by {packed.decode(errors='replace')[:20]!r}; bz2 and lz4 are read")
