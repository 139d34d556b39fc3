"""Messages from and to the log files of robots: MCAP, and bags of ROS 2 and of ROS 1.

A recording that a loss of power cut off has no index: what comes before the cut is read, and the rest is told.
"""

from __future__ import annotations

import io
import json
import shutil
import sqlite3
import struct
import zlib
from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO, cast

from ...core.errors import first_line
from ...core.values import dataclass, field
from .. import DataError
from ..documents import read_yaml
from ..sidecar import check_meta
from .chunks import hold_bag, hold_database, hold_mcap
from .messages import Definitions, Message, extra, store
from .ros1 import MAGIC, Walk

BAG = "metadata.yaml"
"""A folder that holds this file is a bag of ROS 2."""

NOTE = "seatrial"
"""Name of the record that holds the description of a trial."""

# Last record of the data, with its checksum; footer, with start and checksum of the summary before it; number of bytes
# of the footer that this checksum leaves out.
_DATA_END, _FOOTER, _UNSUMMED = struct.Struct("<9xI"), struct.Struct("<9xQ8xI8x"), 12


@dataclass(frozen=True)
class Bag:
    """Contents of a file.

    Attributes:
        messages: its messages.
        note: the record `NOTE` where seatrial wrote it.
        definitions: of its messages.
        lost: what could not be read, in words; complete after the last message.
    """

    messages: Iterator[Message]
    note: Mapping[str, Any] = field(default_factory=dict[str, Any])
    definitions: Definitions = field(default_factory=Definitions)
    lost: list[str] = field(default_factory=list[str])


@contextmanager
def opened(path: Path) -> Generator[Bag]:
    """Open an MCAP file, a bag of ROS 1, a database of ROS 2, or the folder of a bag.

    Raises:
        DataError: none of them, or damaged.
    """
    try:
        with _opened(path) as bag:
            yield bag
    except (DataError, ImportError):
        raise
    except Exception as error:  # whatever the readers raise on a damaged file
        whole = "a whole bag of ROS 2 (metadata.yaml and its files)" if path.is_dir() else "a whole MCAP file"
        raise DataError(f"{path}: cannot be read ({first_line(error, 120)}); give {whole}") from None


def _opened(path: Path) -> Any:
    """The reader of a recording, by its first bytes."""
    if path.is_dir():
        return _bag(path) if (path / BAG).is_file() else _pieces(path, _files(path))
    with path.open("rb") as file:
        head = file.read(16)
    if head.startswith(MAGIC):
        return _ros1(path)
    return _pieces(path, [path]) if head.startswith(b"SQLite format 3") else _mcap(path)


@contextmanager
def _mcap(path: Path) -> Generator[Bag]:
    with path.open("rb") as file:
        if (end := _cut(file)) is not None:
            yield _cut_off(path, file, end)
            return
        make_reader = extra("mcap.reader").make_reader
        _hold_checksums(path, file)
        hold_mcap(path, file)
        reader = make_reader(file, validate_crcs=True)
        said = next((one.metadata for one in reader.iter_metadata() if one.name == NOTE), {})
        bag = Bag(iter(()), _noted(path, said.get("trial")))
        found = reader.iter_messages(log_time_order=True)
        yield Bag(_of_mcap(found, bag.definitions), bag.note, bag.definitions)


def _of_mcap(found: Iterator[Any], definitions: Definitions) -> Iterator[Message]:
    for schema, channel, message in found:
        encoding = channel.message_encoding
        kind = schema.name if schema is not None else ""
        if encoding not in _ENCODINGS:
            kind = f"{kind} as {encoding}"  # protobuf, JSON
        elif schema is not None and schema.encoding in ("ros1msg", "ros2msg"):
            kind = kind if kind.count("/") != 1 else kind.replace("/", "/msg/")
            definitions.learn(kind, schema.data.decode(errors="replace"))
        yield Message(channel.topic, kind, message.log_time, message.data, encoding)


_ENCODINGS = ("cdr", "ros1")


def _cut(file: BinaryIO) -> int | None:
    """Where the last whole record of an MCAP file ends that has no end; None for a file with one."""
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    if file.read(len(_MAGIC)) != _MAGIC:
        return None  # the reader reports it
    file.seek(-len(_MAGIC), io.SEEK_END)
    ended, at, code = file.read() == _MAGIC, len(_MAGIC), 0
    while not ended and code != _END and at + _RECORD.size <= size:
        file.seek(at)
        code, length = _RECORD.unpack(file.read(_RECORD.size))
        if at + _RECORD.size + length > size:
            file.seek(0)
            return at
        at += _RECORD.size + length
    file.seek(0)
    return None if ended or code == _END else at


_MAGIC, _RECORD, _END = b"\x89MCAP0\r\n", struct.Struct("<BQ"), 2


class _Ended(Exception):  # noqa: N818
    """The last whole record has been read."""


@dataclass
class _Until:
    """The bytes of a file before some place, behind which it raises `_Ended`."""

    file: BinaryIO
    end: int

    def read(self, count: int) -> bytes:
        if self.file.tell() >= self.end:
            raise _Ended
        return self.file.read(count)


def _cut_off(path: Path, file: BinaryIO, end: int) -> Bag:
    """The messages before the cut, chunk by chunk."""
    size = path.stat().st_size
    hold_mcap(path, file)
    reader = extra("mcap.reader").NonSeekingReader(_Until(file, end), validate_crcs=True, record_size_limit=size)
    definitions = Definitions()

    def messages() -> Iterator[Message]:
        with suppress(_Ended):
            yield from _of_mcap(reader.iter_messages(log_time_order=False), definitions)

    lost = f"cut off: the last {size - end} of {size} bytes are of no whole chunk, and are lost"
    return Bag(messages(), {}, definitions, [lost])


@contextmanager
def _ros1(path: Path) -> Generator[Bag]:
    walk, definitions, lost = Walk(path), Definitions(), list[str]()

    def messages(file: BinaryIO) -> Iterator[Message]:
        for message in walk.messages(file):
            definitions.learn(message.kind, walk.definitions[message.kind])
            yield message
        lost.extend([walk.lost] if walk.lost else [])

    with path.open("rb") as file:
        yield Bag(messages(file), {}, definitions, lost)


def _files(path: Path) -> list[Path]:
    """The files of a bag without metadata, in the order of their numbers.

    Raises:
        DataError: none.
    """
    found = [one for one in path.iterdir() if one.suffix.lower() in (".db3", ".mcap") and one.is_file()]
    if not found:
        raise DataError(f"{path}: no recording of ROS 2: neither {BAG} nor a file .db3 or .mcap in it")
    return sorted(found, key=lambda one: (len(one.stem), one.name))


@contextmanager
def _pieces(path: Path, files: list[Path]) -> Generator[Bag]:
    """Files of a bag one after another, without the metadata that a recorder writes when it ends."""
    definitions = Definitions()
    lost = [] if path.is_file() else [f"no {BAG}: the recording was not ended; its {len(files)} files are read"]

    def messages() -> Iterator[Message]:
        for file in files:
            if file.suffix.lower() == ".mcap":
                with _mcap(file) as bag:
                    yield from bag.messages
                    lost.extend(bag.lost)
            else:
                yield from _database(file, definitions, lost)

    yield Bag(messages(), {}, definitions, lost)


def _database(file: Path, definitions: Definitions, lost: list[str]) -> Iterator[Message]:
    """Messages of a database of ROS 2; of a damaged one those before the damage."""
    with TemporaryDirectory() as folder, closing(_connected(file, Path(folder))) as base:
        base.execute("PRAGMA writable_schema = ON")  # else a file of fewer pages than its first says is no database
        hold_database(file, base)
        if base.execute("SELECT 1 FROM sqlite_master WHERE name = 'message_definitions'").fetchone():
            for kind, encoding, text in base.execute(
                "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
            ):
                if encoding == "ros2msg":
                    definitions.learn(str(kind), str(text))
        topics = {key: (str(name), str(kind)) for key, name, kind in base.execute("SELECT id, name, type FROM topics")}
        try:
            for key, logged, data in base.execute("SELECT topic_id, timestamp, data FROM messages"):
                if key in topics and isinstance(data, bytes) and isinstance(logged, int) and logged >= 0:
                    yield Message(*topics[key], logged, data)
        except sqlite3.DatabaseError as error:
            lost.append(f"{file.name} is damaged ({error}): what comes before is read, the rest is lost")


def _connected(file: Path, folder: Path) -> sqlite3.Connection:
    """A database; a copy of one whose recorder did not end, as SQLite writes into it to take what was on its way."""
    beside = [one for end in ("-wal", "-journal") if (one := file.with_name(file.name + end)).is_file()]
    if not beside:
        return sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
    for one in (file, *beside):
        shutil.copyfile(one, folder / one.name)
    return sqlite3.connect(folder / file.name)


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
    definitions = Definitions()
    with Reader(path) as reader:
        for at in reader.connections:
            if at.msgdef.format.name == "MSG":
                definitions.learn(at.msgtype, at.msgdef.data)
        messages = (Message(at.topic, at.msgtype, logged, bytes(data)) for at, logged, data in reader.messages())
        yield Bag(messages, _noted(path, said.get(NOTE)), definitions)


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
