"""What a log of robots holds, counted before it is unpacked: chunks of MCAP, and databases of bags of ROS 2."""

from __future__ import annotations

import re
import sqlite3
import struct
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any, BinaryIO

from ...core import unpacking
from .. import DataError
from .messages import extra

_BLOCK = 1 << 20
_CHUNK, _MESSAGE = 6, 5
_RECORD = struct.Struct("<BQ")
# Bytes of a packed message at least, and messages that any file may have.
PACKED, FEW = 4, 200_000
# Unpacked so many times as large, a file is of what instruments measure: nobody counts its messages.
USUAL = 10
_MADE = re.compile(r"\b(?:GENERATED\s+ALWAYS|AS)\b", re.IGNORECASE)


def hold_mcap(path: Path, file: BinaryIO) -> None:
    """Count what the chunks of an MCAP file hold.

    Raises:
        DataError: too much, or too many messages.
    """
    size, total, messages = path.stat().st_size, 0, 0
    for compression, said, data in _chunks(file, size):
        unpacked = _unpacked(compression, said, data, unpacking.most(size) - total)
        total += max(said, len(unpacked))
        _hold(path, total, size)
        if len(unpacked) > USUAL * len(data):
            messages += sum(1 for code in _records(unpacked) if code == _MESSAGE)
    if messages > max(FEW, size // PACKED):
        raise DataError(f"{path}: {messages} messages in {size} bytes; no instrument repeats itself so often")
    file.seek(0)


def _hold(path: Path, total: float, size: int) -> None:
    if total > unpacking.most(size):
        raise DataError(f"{path}: {unpacking.told(total, size)}")


def _chunks(file: BinaryIO, size: int) -> Iterator[tuple[str, int, bytes]]:
    """Compression, size and packed bytes of each chunk; a damaged file ends, as its reader reports it."""
    at = 8
    while at + _RECORD.size <= size:
        file.seek(at)
        code, length = _RECORD.unpack(file.read(_RECORD.size))
        at += _RECORD.size + length
        if at > size:
            return
        if code == _CHUNK and length >= 40:
            body = file.read(length)
            said, _, named = struct.unpack_from("<QII", body, 16)
            first = 32 + named + 8
            if first <= length:
                yield body[32 : 32 + named].decode(errors="replace"), said, body[first:]


def _unpacked(compression: str, said: int, data: bytes, most: int) -> bytes:
    """A chunk, or as much of it as is over `most`."""
    if compression == "zstd":
        frame = max(extra("zstandard").frame_content_size(data), said)
        return b"" if frame > most else extra("zstandard").ZstdDecompressor().decompress(data, max(said, 1))
    if compression == "lz4":
        return extra("lz4.frame").LZ4FrameDecompressor().decompress(data, max_length=most + 1)
    return data


def _records(data: bytes) -> Iterator[int]:
    at = 0
    while at + _RECORD.size <= len(data):
        code, length = _RECORD.unpack_from(data, at)
        at += _RECORD.size + length
        yield code


def hold_bag(path: Path, about: Mapping[str, Any]) -> None:
    """Count what the files of a bag hold, packed whole or message by message.

    Raises:
        DataError: too much, or a database that makes up its rows.
    """
    names = [Path(str(name)).name for name in about.get("relative_file_paths") or ()]
    size, total = sum((path / name).stat().st_size for name in names if (path / name).is_file()), 0
    for name in names:
        file = path / name
        if not file.is_file():
            continue
        if file.suffix == ".zstd":
            with file.open("rb") as raw, extra("zstandard").ZstdDecompressor().stream_reader(raw) as stream:
                while block := stream.read(_BLOCK):
                    total += len(block)
                    _hold(path, total, size)
        elif file.suffix == ".mcap":
            with file.open("rb") as raw:
                hold_mcap(file, raw)
        elif file.suffix == ".db3":
            with closing(sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as base:
                hold_database(file, base)
                total += _rows(base) if str(about.get("compression_mode") or "").lower() == "message" else 0
            _hold(path, total, size)


def hold_database(file: Path, base: sqlite3.Connection) -> None:
    """Refuse a database that makes up its rows.

    Raises:
        DataError: it does.
    """
    for kind, name, said in base.execute("SELECT type, name, sql FROM sqlite_master"):
        made = str(said or "").upper().startswith("CREATE VIRTUAL") or _MADE.search(str(said or ""))
        if kind not in ("table", "index") or made:
            raise DataError(f"{file}: its {kind} '{name}' makes up rows; a bag has tables only")


def _rows(base: sqlite3.Connection) -> int:
    """Bytes of the messages of a database that are packed one by one."""
    size_of = extra("zstandard").frame_content_size
    return sum(size_of(bytes(data)) for (data,) in base.execute("SELECT data FROM messages"))
