"""Logs that a reader of their own takes: robots' logs, NMEA sentences, and the public sets that are recognised."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .. import DataError
from ..importing import recognised
from ..table import existing


@dataclass(frozen=True)
class Reader:
    """A reader of `seatrial import`.

    Attributes:
        format: its name.
        said: one line for the user.
        tabular: whether the logs are tables, of which a mapping may be written as well.
    """

    format: str
    said: str
    tabular: bool


def reader_of(src: Path) -> Reader | None:
    """The reader that takes a log or a folder without a mapping; None where none does.

    Raises:
        DataError: no such path.
    """
    here = existing(src)
    files = [here] if here.is_file() else sorted(path for path in here.rglob("*") if path.is_file())
    bags = [path.parent for path in files if path.name == "metadata.yaml" and b"rosbag2" in path.read_bytes()[:200]]
    if bags:
        return _said("rosbag2", here, "a recording of ROS 2", False)
    if any(path.suffix.lower() == ".mcap" for path in files):
        return _said("mcap", here, "MCAP files", False)
    for path in files:
        if path.suffix.lower() in (".nmea", ".log", ".txt", ".csv", "") and _sentences(path):
            return _said("nmea", here, "NMEA 0183 sentences", False)
    for path in files:
        try:
            format = recognised(path)
        except DataError:
            continue
        if format:
            return _said(format, here, "the columns of a public set", format != "simman")
    return None


def _said(format: str, src: Path, what: str, tabular: bool) -> Reader:
    return Reader(format, f"{what}: seatrial import {format} {src} -o DIR reads them without a mapping", tabular)


def _sentences(path: Path) -> bool:
    """Whether most of the first lines are sentences of NMEA 0183."""
    with path.open("rb") as file:
        lines = [line for line in file.read(4000).splitlines()[:-1] if line.strip()]
    marked = sum((b"$" in line[:40] and b"*" in line[-6:]) or b"!AIVD" in line for line in lines)
    return len(lines) > 1 and marked > 0.5 * len(lines)
