"""Virtual sensors: readings of a true run, with noise, bias and resolution, seeded.

Contract: `Sensors` reads a whole trial at once, as a logger would record it.  An instrument of the bridge
(`instruments`, together a `suite`) is a frozen description; ``instrument.start(seed)`` gives a running one (`stream`),
whose ``read(t, truth)`` is called at every step and returns a `Reading` when one is due.  All values are SI and radians
with the names of the conventions; degrees, knots and rpm belong to the code of the standard that uses them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np

from ..core.errors import SensorError
from ..core.parameters import unknown
from ..core.values import dataclass, field
from ..data import Trial

__all__ = ["Reading", "SensorError", "Sensors", "Truth"]


@dataclass(frozen=True)
class Sensors:
    """The sensors of a ship, channel by channel, SI units and radians.

    Attributes:
        noise: standard deviation of white noise.
        bias: constant error.
        quantum: resolution; readings are rounded to whole multiples of it.
    """

    noise: Mapping[str, float] = field(default_factory=dict[str, float])
    bias: Mapping[str, float] = field(default_factory=dict[str, float])
    quantum: Mapping[str, float] = field(default_factory=dict[str, float])

    def __post_init__(self) -> None:
        for table, figures in (("noise", self.noise), ("quantum", self.quantum)):
            for name, value in figures.items():
                if not value >= 0.0:
                    raise SensorError(f"{table} of {name} is {value:g}; it must be zero or above")

    def read(self, trial: Trial, rng: np.random.Generator) -> Trial:
        """The run as recorded; channels without a sensor stay as they are.  SensorError: a sensor of no channel."""
        channels = dict(trial.channels)
        for name in dict.fromkeys((*self.noise, *self.bias, *self.quantum)):
            if name not in channels:
                raise SensorError(f"{trial.name}: {unknown(name, channels, 'channel')}")
            values = channels[name] + self.bias.get(name, 0.0)
            values = values + rng.normal(0.0, self.noise.get(name, 0.0), values.size)
            step = self.quantum.get(name, 0.0)
            channels[name] = np.round(values / step) * step if step else values
        return trial.having(**channels).noting("read by virtual sensors")


class Truth(Protocol):
    """True values by name: a mapping, or a running plant."""

    def __getitem__(self, name: str, /) -> float: ...


class Reading(NamedTuple):
    """One reading of an instrument.

    Attributes:
        kind: kind of the instrument: gnss, gyro, rate_gyro, speed_log, anemometer, echo_sounder or feedback.
        t: time of the sample [s]; latency delays the reading, not this time.
        values: by name, SI units and radians.
    """

    kind: str
    t: float
    values: Mapping[str, float]
