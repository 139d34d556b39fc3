"""The messages of a recording by topic: columns of numbers, whatever the length of the recording."""

from __future__ import annotations

import math
import re
from array import array
from collections import Counter
from collections.abc import Collection
from pathlib import Path

import numpy as np

from ...core.values import dataclass, field
from .. import Array, DataError
from .files import Bag
from .messages import READ, Values, unpacked

# Later than any log [ns]: the year 2262, beyond which 64 bits end.
_NEVER = 2**63
# The clocks of logger and stamps are the same if they differ by no more than this [ns].
_SAME_CLOCK = 10**9
_ORDERS = re.compile(r"(?:^|[/_])(cmd|command|set_?points?|goal|target|desired|reference|ref|waypoint|initialpose)\w*")
"""Topics of orders to a robot, in the types of what it measures."""


@dataclass
class Series:
    """All messages of one topic.

    Attributes:
        kind: of its messages.
        frames: of its first.
        times: their own [ns], of logging where they have none.
        logged: times of logging [ns].
        stamped: whether they have a time of their own.
        columns: numbers by name.
        sentences: of NMEA 0183.
    """

    kind: str
    frames: tuple[str, ...] = ()
    times: array[int] = field(default_factory=lambda: array("q"))
    logged: array[int] = field(default_factory=lambda: array("q"))
    stamped: bool = True
    columns: dict[str, array[float]] = field(default_factory=dict[str, "array[float]"])
    sentences: list[str] = field(default_factory=list[str])

    def add(self, logged: int, said: Values) -> None:
        """One message more."""
        count = len(self.times)
        self.stamped = said.stamp is not None
        self.frames = self.frames or said.frames
        self.times.append(logged if said.stamp is None else said.stamp)
        self.logged.append(logged)
        for name in said.values:
            if name not in self.columns:
                self.columns[name] = array("d", [math.nan]) * count
        for name, column in self.columns.items():
            column.append(said.values.get(name, math.nan))
        if said.sentence:
            self.sentences.append(said.sentence)

    def column(self, name: str) -> Array:
        """Numbers, NaN where a message has none."""
        return np.array(self.columns[name]) if name in self.columns else np.full(len(self.times), math.nan)


def gathered(path: Path, bag: Bag, ignored: Counter[str], wanted: Collection[str] = ()) -> dict[str, Series]:
    """The series of each topic that is read; others are counted.

    Args:
        path: of the log, for errors.
        bag: its messages.
        ignored: counts by topic and kind.
        wanted: topics that are read though their names are those of orders.

    Raises:
        DataError: bytes that are no such message, a topic of two types, an impossible time.
    """
    found: dict[str, Series] = {}
    left: dict[tuple[str, str], bool] = {}
    for message in bag.messages:
        topic, kind = message.topic, message.kind
        if (topic, kind) not in left:
            order = _ORDERS.search(topic) and topic not in wanted
            left[topic, kind] = kind not in READ or bool(order and READ[kind][0] not in ("Num", "Out"))
            if not left[topic, kind] and (known := found.setdefault(topic, Series(kind)).kind) != kind:
                raise DataError(f"{path}: {topic} is {known} and {kind}; give it one type")
        if left[topic, kind]:
            ignored[f"{topic} ({kind})"] += 1
            continue
        series = found[topic]
        try:
            if message.logged >= _NEVER:
                raise DataError(f"logged {message.logged} ns after 1970; no clock can give that")
            series.add(message.logged, unpacked(kind, message.data, message.encoding, bag.definitions))
        except DataError as error:
            raise DataError(f"{path}: {topic}, message {len(series.times) + 1}: {error}") from None
    return found


def behind(series: Collection[Series]) -> int:
    """By how much the clock of the logger is late against the stamps [ns]; 0 where they are the same clock."""
    stamped = [one for one in series if one.stamped and len(one.times)]
    if not stamped:
        return 0
    most = max(stamped, key=lambda one: len(one.times))
    late = int(np.median(np.array(most.logged) - np.array(most.times)))
    return late if abs(late) > _SAME_CLOCK else 0
