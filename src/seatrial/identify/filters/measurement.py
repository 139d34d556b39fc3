"""Measurement models of navigation sensors: antenna, compass, gyro and speed log.

A sensor has a place on the ship (its lever arm: x forward of midship, y to starboard), white noise and
a delay: what the trial holds at time t was true at t - delay.  Any frozen dataclass with the members of
`Sensor` is one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

from ...core.parameters import Scalar
from ...core.symbolic import cos, sin
from ...environment import Environment, to_body, to_earth
from .. import StudyError


class Sensor(Protocol):
    """One instrument; `read` is written over floats and symbols alike."""

    angle: ClassVar[bool]
    """Whether the reading is an angle, the same again after a turn."""

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels of the trial that hold its readings."""
        ...

    @property
    def sd(self) -> float:
        """Standard deviation of its white noise, the same in all its channels."""
        ...

    @property
    def delay(self) -> float:
        """Age of a reading at the time that the trial gives it [s]."""
        ...

    def read(self, state: tuple[Scalar, ...], environment: Environment) -> tuple[Scalar, ...]:
        """Readings without noise, one a channel."""
        ...


def _checked(sensor: Sensor) -> None:
    name = type(sensor).__name__
    if not sensor.sd > 0.0:
        raise StudyError(f"{name}: its noise is {sensor.sd:g}; a standard deviation above zero is needed")
    if not sensor.delay >= 0.0:
        raise StudyError(f"{name}: its delay is {sensor.delay:g} s; it must be zero or above")


@dataclass(frozen=True)
class Antenna:
    """A satellite antenna: north and east of the antenna itself [m].

    Attributes:
        sd: noise of each coordinate [m].
        x, y: where it stands, forward of midship and to starboard [m].
        delay: age of a fix [s].
        channels: where the trial holds north and east of the antenna.
    """

    angle: ClassVar[bool] = False

    sd: float
    x: float = 0.0
    y: float = 0.0
    delay: float = 0.0
    channels: tuple[str, ...] = ("x", "y")

    def __post_init__(self) -> None:
        _checked(self)
        if len(self.channels) != 2:
            raise StudyError(f"Antenna: {len(self.channels)} channels; it reads two, north and east")

    def read(self, state: tuple[Scalar, ...], environment: Environment) -> tuple[Scalar, ...]:
        """North and east of the antenna [m]."""
        north, east = to_earth(self.x, self.y, cos(state[2]), sin(state[2]))
        return state[0] + north, state[1] + east


@dataclass(frozen=True)
class Heading:
    """A gyro compass: heading from north [rad], in any turn."""

    angle: ClassVar[bool] = True

    sd: float
    delay: float = 0.0
    channels: tuple[str, ...] = ("psi",)

    def __post_init__(self) -> None:
        _checked(self)

    def read(self, state: tuple[Scalar, ...], environment: Environment) -> tuple[Scalar, ...]:
        """Heading [rad]."""
        return (state[2],)


@dataclass(frozen=True)
class Rate:
    """A rate gyro: rate of turn [rad/s]."""

    angle: ClassVar[bool] = False

    sd: float
    delay: float = 0.0
    channels: tuple[str, ...] = ("r",)

    def __post_init__(self) -> None:
        _checked(self)

    def read(self, state: tuple[Scalar, ...], environment: Environment) -> tuple[Scalar, ...]:
        """Rate of turn [rad/s]."""
        return (state[5],)


@dataclass(frozen=True)
class Log:
    """A speed log: speed ahead at its own place [m/s], through the water or over ground.

    Attributes:
        sd: its noise [m/s].
        y: where it is, to starboard of midship [m]; how far forward does not matter to the speed ahead.
        water: through the water where True.
    """

    angle: ClassVar[bool] = False

    sd: float
    y: float = 0.0
    delay: float = 0.0
    water: bool = True
    channels: tuple[str, ...] = ("u",)

    def __post_init__(self) -> None:
        _checked(self)

    def read(self, state: tuple[Scalar, ...], environment: Environment) -> tuple[Scalar, ...]:
        """Speed ahead [m/s]."""
        ahead = state[3] - self.y * state[5]
        if not self.water:
            return (ahead,)
        return (ahead - to_body(environment.current_x, environment.current_y, cos(state[2]), sin(state[2]))[0],)
