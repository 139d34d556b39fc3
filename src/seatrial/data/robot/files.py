"""The files that robots log to: MCAP, and bags of ROS 2; messages in, messages out."""

from __future__ import annotations

import io
import json
import struct
import zlib
from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, cast

from .. import DataError
from ..documents import read_yaml
from ..sidecar import check_meta
from .messages import store

BAG = "metadata.yaml"
"""A folder that holds this file is a bag of ROS 2."""

NOTE = "seatrial"
"""Name under which a trial's own description goes along."""

# The last record of the data, with its checksum; the footer, with start and checksum of the summary before it, to the
# end of the file; and how many of its bytes that checksum leaves out.
_DATA_END, _FOOTER, _UNSUMMED = struct.Struct("<9xI"), struct.Struct("<9xQ8xI8x"), 12

_NEEDS = "logs of robots need the extra 'log': pip install 'seatrial[log]'"


@dataclass(frozen=True)
class Message:
    """One message as it lies in a file.

    Attributes:
        topic, kind: where and what; the kind as ROS 2 names it (`std_msgs/msg/Float64`).
        logged: when [ns].
        data: in CDR.
    """

    topic: str
    kind: str
    logged: int
    data: bytes


@dataclass(frozen=True)
class Bag:
    """What a file holds: its messages, and what `NOTE` says, where seatrial wrote it."""

    messages: Iterator[Message]
    note: Mapping[str, Any]


@contextmanager
def opened(path: Path) -> Generator[Bag]:
    """Open an MCAP file or the folder of a bag.

    Raises:
        DataError: neither of them, or damaged.
    """
    try:
        with _bag(path) if path.is_dir() else _mcap(path) as bag:
            yield bag
    except (DataError, ImportError):
        raise
    except Exception as error:  # what a damaged file makes the readers stumble over
        about = (str(error).splitlines() or [""])[0] or type(error).__name__
        whole = "a whole bag of ROS 2 (metadata.yaml and its files)" if path.is_dir() else "a whole MCAP file"
        raise DataError(f"{path}: cannot be read ({about[:120]}); give {whole}") from None


@contextmanager
def _mcap(path: Path) -> Generator[Bag]:
    try:
        from mcap.reader import make_reader
    except ImportError:
        raise DataError(_NEEDS) from None
    with path.open("rb") as file:
        _hold_checksums(path, file)
        reader = make_reader(file, validate_crcs=True)
        said = next((one.metadata for one in reader.iter_metadata() if one.name == NOTE), {})

        def messages() -> Iterator[Message]:
            for schema, channel, message in reader.iter_messages(log_time_order=True):
                if channel.message_encoding == "cdr" and schema is not None:
                    yield Message(channel.topic, schema.name, message.log_time, message.data)

        yield Bag(messages(), _noted(path, said.get("trial")))


def _hold_checksums(path: Path, file: BinaryIO) -> None:
    """Hold an MCAP file against the checksums of its two sections, as far as it has these.

    The reader does so for chunks only, and a trial's own description is in none.

    Raises:
        DataError: a section is not as it was written.
    """
    size = file.seek(0, io.SEEK_END)
    file.seek(max(size - _FOOTER.size, 0))
    tail = file.read()
    file.seek(0)
    if len(tail) < _FOOTER.size:
        return  # the reader says what is missing
    start, summed = _FOOTER.unpack(tail)
    if not _DATA_END.size < start <= size - _FOOTER.size:
        return
    data = _summed(file, start - _DATA_END.size)
    (wanted,) = _DATA_END.unpack(file.read(_DATA_END.size))
    if (wanted and data != wanted) or (summed and _summed(file, size - _UNSUMMED - start) != summed):
        raise DataError(f"{path}: damaged, as its checksum says; copy it again")
    file.seek(0)


def _summed(file: BinaryIO, count: int) -> int:
    """Checksum of the next bytes of a file."""
    found = 0
    while count > 0 and (part := file.read(min(count, 1 << 20))):
        found, count = zlib.crc32(part, found), count - len(part)
    return found


@contextmanager
def _bag(path: Path) -> Generator[Bag]:
    try:
        from rosbags.rosbag2 import Reader
    except ImportError:
        raise DataError(_NEEDS) from None
    about = read_yaml(path / BAG)
    said = about["rosbag2_bagfile_information"].get("custom_data") or {}
    with Reader(path) as reader:
        messages = (Message(at.topic, at.msgtype, logged, bytes(data)) for at, logged, data in reader.messages())
        yield Bag(messages, _noted(path, said.get(NOTE)))


def _noted(path: Path, text: str | None) -> Mapping[str, Any]:
    """What seatrial wrote of a trial, held against what it can be."""
    said = json.loads(text) if text else {}
    parts: list[Any] = [said, *(said.get(key, {}) for key in ("meta", "units"))] if isinstance(said, dict) else [said]
    if not all(isinstance(part, dict) for part in parts) or not all(isinstance(u, str) for u in parts[2].values()):
        raise DataError(f"{path}: what it says of the trial itself is damaged; copy it again")
    check_meta(path, {key: value for key, value in parts[1].items() if key != "schema"})
    return cast("dict[str, Any]", said)


def write_mcap(path: Path, messages: Iterable[Message], note: Mapping[str, Any]) -> None:
    """Write an MCAP file; the definitions of the messages are in it.

    Raises:
        DataError: the extra is not installed.
    """
    try:
        from mcap.writer import Writer
    except ImportError:
        raise DataError(_NEEDS) from None
    from ... import __version__

    with path.open("wb") as file:
        writer = Writer(file, enable_data_crcs=True)
        writer.start(profile="ros2", library=f"seatrial {__version__}")
        schemas: dict[str, int] = {}
        channels: dict[str, int] = {}
        for one in messages:
            if one.kind not in schemas:
                definition = store().generate_msgdef(one.kind, ros_version=2)[0]
                schemas[one.kind] = writer.register_schema(one.kind, "ros2msg", definition.encode())
            if one.topic not in channels:
                channels[one.topic] = writer.register_channel(one.topic, "cdr", schemas[one.kind])
            writer.add_message(channels[one.topic], one.logged, one.data, one.logged)
        writer.add_metadata(NOTE, {"trial": json.dumps(note)})
        writer.finish()


def write_bag(path: Path, messages: Iterable[Message], note: Mapping[str, Any]) -> None:
    """Write the folder of a bag, version 9, with SQLite inside.

    Raises:
        DataError: the extra is not installed.
    """
    try:
        from rosbags.rosbag2 import Writer
    except ImportError:
        raise DataError(_NEEDS) from None
    with closing(Writer(path, version=9)) as writer:
        writer.open()
        writer.set_custom_data(NOTE, json.dumps(note))
        channels: dict[str, Any] = {}
        for one in messages:
            if one.topic not in channels:
                channels[one.topic] = writer.add_connection(one.topic, one.kind, typestore=store())
            writer.write(channels[one.topic], one.logged, one.data)
