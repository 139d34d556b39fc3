"""MCAP files of robots; see `data.robot`."""

from __future__ import annotations

from ..robot.topics import read_topics
from ..robot.trial import read

__all__ = ["name", "read", "read_mapping", "suffixes"]

name = "mcap"
suffixes = (".mcap",)
read_mapping = read_topics
