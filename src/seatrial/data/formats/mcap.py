"""MCAP files of robots; see `data.robot`."""

from __future__ import annotations

from ..robot.trial import read, read_topics

__all__ = ["name", "read", "read_mapping", "suffixes"]

name = "mcap"
suffixes = (".mcap",)
read_mapping = read_topics
