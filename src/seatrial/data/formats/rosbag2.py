"""Bags of ROS 2: folders of one recording each, with metadata or without, or databases alone; see `data.robot`."""

from __future__ import annotations

from pathlib import Path

from .. import DataError
from ..robot.files import BAG
from ..robot.topics import Topics, read_topics
from ..robot.trial import read

__all__ = ["name", "read", "read_mapping", "recordings", "suffixes"]

name = "rosbag2"
suffixes = (BAG, ".db3")
read_mapping = read_topics


def recordings(here: Path, mapping: Topics | None) -> list[Path]:
    """Folders with metadata; of what was not ended the folder of the databases, or the one that is given.

    Raises:
        DataError: none of them.
    """
    if not here.is_dir():
        return [here]
    whole = {one.parent for one in here.rglob(BAG)}
    alone = {one.parent for one in here.rglob("*.db3")} - whole
    if not whole | alone:
        raise DataError(f"{here}: no recording of format {name}; give its folder, the one with {BAG} or a .db3 in it")
    return sorted(whole | alone)
