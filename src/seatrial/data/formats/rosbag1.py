"""Bags of ROS 1, whole or cut off; see `data.robot`."""

from __future__ import annotations

from ..robot.topics import read_topics
from ..robot.trial import read

__all__ = ["name", "read", "read_mapping", "suffixes"]

name = "rosbag1"
suffixes = (".bag", ".active")
read_mapping = read_topics
