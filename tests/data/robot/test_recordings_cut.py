"""Recordings that a loss of power ended: what came before is read, the rest is told; and files made to do harm."""

from __future__ import annotations

import bz2
import math
import sqlite3
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from recorded import Speaker, ticks, write_chunks, write_ros1, written
from rosbags.rosbag1 import Reader

from seatrial.cli.app import main
from seatrial.data import DataError, Trial
from seatrial.data.formats import recordings
from seatrial.data.robot.messages import Message
from seatrial.data.robot.trial import read
from seatrial.workflow.data import importing

T = 0.1 * np.arange(400)


def places(ros1: bool = False) -> list[Message]:
    """North is the number of the message."""
    say = Speaker(ros1)
    return [say.pose("/pose", k, float(n), 0.0, 0.5 * math.pi) for n, k in enumerate(ticks(T))]


def doubts(trial: Trial) -> str:
    return " ".join(step for step in trial.meta["processing"] if step.startswith("doubt") and "track" not in step)


@pytest.mark.parametrize("packed", ["ZSTD", "LZ4", "NONE"])
@pytest.mark.parametrize("share", [0.31, 0.6, 0.93])
def test_a_cut_mcap_gives_every_whole_chunk(tmp_path: Path, packed: str, share: float) -> None:
    whole = tmp_path / "whole.mcap"
    write_chunks(whole, places(), packed, 4096)
    data = whole.read_bytes()
    cut = int(share * len(data))
    (tmp_path / "cut.mcap").write_bytes(data[:cut])
    got = read(tmp_path / "cut.mcap")
    with whole.open("rb") as file:
        chunks = make_reader(file).get_summary().chunk_indexes
    last = max(one.message_end_time for one in chunks if one.chunk_start_offset + one.chunk_length <= cut)
    assert got["x"].tolist() == [n for n, k in enumerate(ticks(T)) if k <= last]
    assert len(got) >= 50
    assert "cut off: the last " in doubts(got)
    assert "cut off" not in doubts(read(whole))


@pytest.mark.parametrize("packed", ["", "BZ2", "LZ4"])
@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_cut_bag_of_ros_1_gives_every_whole_chunk(tmp_path: Path, packed: str, share: float) -> None:
    whole = tmp_path / "whole.bag"
    write_ros1(whole, places(True), packed, 4096)
    data = whole.read_bytes()
    cut = int(share * len(data))
    (tmp_path / "cut.bag").write_bytes(data[:cut])
    got = read(tmp_path / "cut.bag")
    with Reader(whole) as bag:
        ends = {pos: one.datapos + one.datasize for pos, one in bag.chunks.items()}
        last = max(one.end_time for one in bag.chunk_infos if ends[one.pos] <= cut)
    assert got["x"].tolist() == [n for n, k in enumerate(ticks(T)) if k <= last]
    assert 25 < len(got) < 400
    assert "cut off: the last " in doubts(got)
    complete = read(whole)
    assert len(complete) == 400
    assert doubts(complete) == ""


@pytest.mark.slow
def test_a_bag_without_metadata_is_read_from_its_databases(tmp_path: Path) -> None:
    """Two pieces, in the order of their numbers; a folder, its file alone, and by no name of a format."""
    found = places()
    (tmp_path / "run").mkdir()
    for k in (0, 1):
        (tmp_path / f"{k}").mkdir()
        bag = written(tmp_path / f"{k}", "rosbag2", found[200 * k : 200 * k + 200])
        (bag / "run.db3").replace(tmp_path / "run" / f"run_{k}.db3")
    got = read(tmp_path / "run")
    assert got["x"].tolist() == list(range(400))
    assert "no metadata.yaml" in doubts(got)
    assert read(tmp_path / "run" / "run_1.db3")["x"].tolist() == list(range(200, 400))
    assert recordings("rosbag2", tmp_path / "run") == [tmp_path / "run"]
    for source in (tmp_path / "run", tmp_path / "run" / "run_0.db3"):
        assert importing(str(source), None, tmp_path)[0] == "rosbag2"


def test_a_damaged_database_gives_what_comes_before(tmp_path: Path) -> None:
    bag = written(tmp_path, "rosbag2", places())
    file = bag / "run.db3"
    data = file.read_bytes()
    (bag / "metadata.yaml").unlink()
    file.write_bytes(data[: len(data) * 7 // 10 // 4096 * 4096])
    got = read(bag)
    assert got["x"].tolist() == list(range(len(got)))
    assert 100 < len(got) < 400
    assert "is damaged" in doubts(got)


def test_what_was_on_its_way_into_a_database_is_read_too(tmp_path: Path) -> None:
    """A recorder that was not ended leaves a log of changes (WAL) beside the database."""
    bag = written(tmp_path, "rosbag2", places())
    (bag / "metadata.yaml").unlink()
    open_still = sqlite3.connect(bag / "run.db3", isolation_level=None)
    open_still.execute("PRAGMA journal_mode=WAL")
    open_still.execute("PRAGMA wal_autocheckpoint=0")
    say = Speaker()
    more = say.pose("/pose", ticks(T + 100.0)[0], 77.0, 0.0, 0.0)
    open_still.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (1, ?, ?)", (more.logged, more.data))
    copied = tmp_path / "copied"
    copied.mkdir()
    for one in bag.iterdir():
        (copied / one.name).write_bytes(one.read_bytes())
    open_still.close()
    assert (copied / "run.db3-wal").stat().st_size > 0
    assert read(copied)["x"][-1] == 77.0


def record(op: int, data: bytes, **fields: bytes) -> bytes:
    said = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v
                    for k, v in {"op": bytes([op]), **fields}.items())  # fmt: skip
    return struct.pack("<I", len(said)) + said + struct.pack("<I", len(data)) + data


MAGIC = b"#ROSBAG V2.0\n"
ONE = record(2, bytes(8), conn=b"\0\0\0\0", time=bytes(8))


def chunk(data: bytes, said: int, packed: bytes = b"bz2") -> bytes:
    return record(5, data, compression=packed, size=struct.pack("<I", said))


def repeated() -> bytes:
    few = record(7, b"\x15\0\0\0type=std_msgs/Float64", conn=b"\0\0\0\0", topic=b"/a") + ONE * 60_000
    return chunk(bz2.compress(few), len(few)) * 4


LARGE = 4_000_000
HOSTILE: dict[str, Callable[[], bytes]] = {
    "header": lambda: b"\xff\xff\xff\xff" + b"abc",
    "data": lambda: chunk(b"", 0)[:-4] + b"\xff\xff\xff\x7f",
    "bomb": lambda: chunk(bz2.compress(bytes(LARGE)), LARGE) * 20,
    "lie": lambda: chunk(bz2.compress(bytes(LARGE)), 10),
    "said": lambda: chunk(b"", 2**32 - 1, b"none"),
    "packed": lambda: chunk(b"abc", 3, b"xz"),
    "broken": lambda: chunk(b"abc", 3),
    "unknown": lambda: ONE,
    "empty": bytes,
    "repeated": repeated,
}


@pytest.mark.parametrize("name", [pytest.param(one, marks=pytest.mark.slow) if one == "repeated" else one
                                  for one in HOSTILE])  # fmt: skip
def test_a_bag_made_to_do_harm_is_a_line(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.bag"
    path.write_bytes(MAGIC + HOSTILE[name]())
    assert main(["import", "rosbag1", str(path), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    assert "a.bag" in said
    assert ("more than 200000 messages" in said) == (name in ("repeated", "bomb"))
    assert not (tmp_path / "out").exists()


def test_a_definition_of_a_message_may_be_wrong(tmp_path: Path) -> None:
    """The definition in a file counts where the type is none of the standard ones; a wrong one is a line."""
    say = Speaker(True)
    found = [say.sentence("/nmea", k, "$HEHDT,10.0,T") for k in ticks(T)]
    write_ros1(tmp_path / "a.bag", found)
    whole = (tmp_path / "a.bag").read_bytes()
    assert len(read(tmp_path / "a.bag")) == 400
    (tmp_path / "b.bag").write_bytes(whole.replace(b"string sentence", b"string santence"))
    with pytest.raises(DataError, match=r"/nmea, message 1: .*sentence"):
        read(tmp_path / "b.bag")
