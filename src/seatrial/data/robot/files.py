"""Messages from and to the log files of robots: MCAP, and bags of ROS 2."""

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

from ...core.errors import first_line
from .. import DataError
from ..documents import read_yaml
from ..sidecar import check_meta
from .chunks import hold_bag, hold_mcap
from .messages import extra, store

BAG = "metadata.yaml"
"""A folder that holds this file is a bag of ROS 2."""

NOTE = "seatrial"
"""Name of the record that holds the description of a trial."""

# Last record of the data, with its checksum; footer, with start and checksum of the summary before it; number of bytes
# of the footer that this checksum leaves out.
_DATA_END, _FOOTER, _UNSUMMED = struct.Struct("<9xI"), struct.Struct("<9xQ8xI8x"), 12


@dataclass(frozen=True)
class Message:
    """One message of a file.

    Attributes:
        topic, kind: its topic and its type as ROS 2 names it (`std_msgs/msg/Float64`).
        logged: time of logging [ns].
        data: in CDR.
    """

    topic: str
    kind: str
    logged: int
    data: bytes


@dataclass(frozen=True)
class Bag:
    """Contents of a file: its messages, and the record `NOTE` where seatrial wrote it."""

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
    except Exception as error:  # whatever the readers raise on a damaged file
        whole = "a whole bag of ROS 2 (metadata.yaml and its files)" if path.is_dir() else "a whole MCAP file"
        raise DataError(f"{path}: cannot be read ({first_line(error, 120)}); give {whole}") from None


@contextmanager
def _mcap(path: Path) -> Generator[Bag]:
    make_reader = extra("mcap.reader").make_reader
    with path.open("rb") as file:
        _hold_checksums(path, file)
        hold_mcap(path, file)
        reader = make_reader(file, validate_crcs=True)
        said = next((one.metadata for one in reader.iter_metadata() if one.name == NOTE), {})

        def messages() -> Iterator[Message]:
            for schema, channel, message in reader.iter_messages(log_time_order=True):
                if channel.message_encoding == "cdr" and schema is not None:
                    yield Message(channel.topic, schema.name, message.log_time, message.data)

        yield Bag(messages(), _noted(path, said.get("trial")))


def _hold_checksums(path: Path, file: BinaryIO) -> None:
    """Check the two sections of an MCAP file against their checksums, where present.

    The reader checks chunks only, and the description of a trial is not in one.

    Raises:
        DataError: a section is damaged.
    """
    size = file.seek(0, io.SEEK_END)
    file.seek(max(size - _FOOTER.size, 0))
    tail = file.read()
    file.seek(0)
    if len(tail) < _FOOTER.size:
        return  # the reader reports it
    start, summed = _FOOTER.unpack(tail)
    if not _DATA_END.size < start <= size - _FOOTER.size:
        return
    data = _summed(file, start - _DATA_END.size)
    (wanted,) = _DATA_END.unpack(file.read(_DATA_END.size))
    if (wanted and data != wanted) or (summed and _summed(file, size - _UNSUMMED - start) != summed):
        raise DataError(f"{path}: damaged, its checksum differs; copy it again")
    file.seek(0)


def _summed(file: BinaryIO, count: int) -> int:
    """Checksum of the next bytes of a file."""
    found = 0
    while count > 0 and (part := file.read(min(count, 1 << 20))):
        found, count = zlib.crc32(part, found), count - len(part)
    return found


@contextmanager
def _bag(path: Path) -> Generator[Bag]:
    Reader = extra("rosbags.rosbag2").Reader
    about = read_yaml(path / BAG)
    said = about["rosbag2_bagfile_information"].get("custom_data") or {}
    hold_bag(path, about["rosbag2_bagfile_information"])
    with Reader(path) as reader:
        messages = (Message(at.topic, at.msgtype, logged, bytes(data)) for at, logged, data in reader.messages())
        yield Bag(messages, _noted(path, said.get(NOTE)))


def _noted(path: Path, text: str | None) -> Mapping[str, Any]:
    """The description of a trial that seatrial wrote, checked."""
    said = json.loads(text) if text else {}
    parts: list[Any] = [said, *(said.get(key, {}) for key in ("meta", "units"))] if isinstance(said, dict) else [said]
    if not all(isinstance(part, dict) for part in parts) or not all(isinstance(u, str) for u in parts[2].values()):
        raise DataError(f"{path}: its description of the trial is damaged; copy it again")
    check_meta(path, {key: value for key, value in parts[1].items() if key != "schema"})
    return cast("dict[str, Any]", said)


def write_mcap(path: Path, messages: Iterable[Message], note: Mapping[str, Any]) -> None:
    """Write an MCAP file; the definitions of the messages are in it.

    Raises:
        DataError: the extra is not installed.
    """
    from ...core.version import __version__

    Writer = extra("mcap.writer").Writer

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
    Writer = extra("rosbags.rosbag2").Writer
    with closing(Writer(path, version=9)) as writer:
        writer.open()
        writer.set_custom_data(NOTE, json.dumps(note))
        channels: dict[str, Any] = {}
        for one in messages:
            if one.topic not in channels:
                channels[one.topic] = writer.add_connection(one.topic, one.kind, typestore=store())
            writer.write(channels[one.topic], one.logged, one.data)
