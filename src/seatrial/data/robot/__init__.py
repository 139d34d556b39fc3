"""Logs of robots: MCAP files and bags of ROS 2.

Contract: `opened` gives the messages of a file and what seatrial noted in it; `read` makes a `Trial` of them, by the
`Topics` of a mapping file where the log leaves a choice; `write_mcap` and `write_bag` write messages.  `messages` has
the standard messages and the change of axes.  All of it needs the extra ``log``, and without it raises `DataError`.
"""

from .files import Bag, Message, opened, write_bag, write_mcap
from .trial import Topics, read, read_topics

__all__ = ["Bag", "Message", "Topics", "opened", "read", "read_topics", "write_bag", "write_mcap"]
