"""Bags of ROS 2: folders of one recording each; see `data.robot`."""

from __future__ import annotations

from ..robot.files import BAG
from ..robot.trial import read, read_topics

__all__ = ["name", "read", "read_mapping", "suffixes"]

name = "rosbag2"
suffixes = (BAG,)
read_mapping = read_topics
