"""The mapping file of a robot's log: which topics are read, and what bare numbers are.

Every key may be left out:

    schema = "seatrial-robot/1"
    odometry = "/ekf/odom"
    datum = { latitude = 35.0, longitude = 139.5 }        # else the first fix
    antenna = { forward = 0.4, starboard = 0.0 }          # m from midship
    prefer = { heading = "/imu/data:Imu" }
    axes = { "/imu/data" = "ned" }                        # or enu, nwu; else the track tells
    [numbers]
    "/helm/angle" = { channel = "delta", unit = "deg", sign = -1 }
    "/mavros/rc/out[0]" = { channel = "throttle_port", unit = "-", scale = 0.0025, offset = -3.75 }
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Literal

import numpy as np

from ...core.parameters import unknown
from ...core.values import dataclass, field
from .. import Array, DataError
from ..formats.nmea import Aboard
from ..instruments import Heard
from ..sidecar import read_described
from ..table import within
from ..units import UNIT_OF_THRUSTERS, conversion, standard_unit


@dataclass(frozen=True)
class Number:
    """A channel that a topic of bare numbers holds: sign, scale and unit times the number, and the offset.

    Attributes:
        channel: its name.
        unit: of the number; None for that of the channel.
        sign, scale: factors.
        offset: added, in the unit.
    """

    channel: str
    unit: str | None = None
    sign: Literal[-1, 1] = 1
    scale: float = 1.0
    offset: float = 0.0

    @property
    def factor(self) -> float:
        """Factor from the unit to that of the channel.

        Raises:
            DataError: an unknown unit, or one that cannot measure the channel.
        """
        return 1.0 if self.unit is None else conversion(self.channel, self.unit)[1]

    @property
    def si(self) -> str:
        """Unit of the channel."""
        if self.unit is not None:
            return conversion(self.channel, self.unit)[0]
        return standard_unit(self.channel) or UNIT_OF_THRUSTERS.get(self.channel.partition("_")[0], "-")

    def of(self, values: Array) -> Array:
        """The channel of numbers."""
        scaled = values if self.scale == 1.0 and self.sign == 1 else self.sign * self.scale * values
        moved = scaled + self.offset if self.offset else scaled
        return moved if self.factor == 1.0 else self.factor * moved


@dataclass(frozen=True)
class Topics(Aboard):
    """Which topics are read, where a log leaves a choice, where the instruments are, and what the trials are.

    Attributes:
        odometry, twist, fix: topics of these types; None for the one that speaks most.
        axes: axes of the orientation of a topic, where the track does not tell.
        numbers: channels of topics of bare numbers.
    """

    odometry: str | None = None
    twist: str | None = None
    fix: str | None = None
    axes: Mapping[str, Literal["enu", "ned", "nwu"]] = field(default_factory=dict[str, Literal["enu", "ned", "nwu"]])
    numbers: dict[str, Number] = field(default_factory=dict[str, Number])

    def known(self, path: Path, asked: str, there: Collection[str]) -> None:
        """Refuse a topic that the log does not have."""
        if asked not in there:
            raise DataError(f"{path}: {unknown(asked, there, 'topic')}")


Bare = tuple[Array, Array]
"""Times [s] and values of numbers whose meaning a mapping says."""


def named(path: Path, topics: Topics, heard: Heard, bare: Mapping[str, Bare]) -> dict[str, str]:
    """Take the numbers that the mapping names, count the others that change, and give their channels with units.

    Raises:
        DataError: the mapping names numbers that the log does not have.
    """
    for at in topics.numbers:
        topics.known(path, at, bare)
    plain: dict[str, str] = {}
    for at, (t, values) in bare.items():
        number = topics.numbers.get(at)
        if number is not None:
            heard.whole(f"{at}:Num", number.channel, t, number.of(values))
            plain[number.channel] = number.si
        elif values.size and np.ptp(np.nan_to_num(values)) > 0.0:
            heard.ignored[at] = values.size
    return plain


def read_topics(path: Path) -> Topics:
    """Read a mapping file; the units of `numbers` are checked."""
    topics = read_described(path, Topics, "seatrial-robot/1")
    for topic, one in topics.numbers.items():
        with within(f"{path}: numbers, {topic}"):
            _ = one.factor
    return topics
