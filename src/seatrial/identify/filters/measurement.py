"""Measurement models of navigation sensors: antenna, compass, gyro and speed log.

A sensor has a place on the ship (its lever arm: x forward of midship, y to starboard), white noise and
a delay: what the trial holds at time t was true at t - delay.  Any frozen dataclass with the members of
`Sensor` is one.
"""

from __future__ import annotations

from typing import ClassVar, Protocol

from ...core.parameters import Scalar
from ...core.symbolic import cos, sin
from ...core.values import dataclass
from ...environment import Environment, to_body, to_earth
from .. import StudyError


class Sensor(Protocol):
    """One instrument; `read` is written over floats and symbols alike.

    Attributes:
        angle: whether the reading is an angle, the same again after a turn.
        channels: channels of the trial that hold its readings.
        sd: standard deviation of its white noise, the same in all its channels.
        delay: age of a reading at the time that the trial gives it [s].
    """

    angle: ClassVar[bool]

    @property
    def channels(self) -> tuple[str, ...]: ...
    @property
    def sd(self) -> float: ...
    @property
    def delay(self) -> float: ...

    def read(self, state: tuple[Scalar, ...], environment: Environment) -> tuple[Scalar, ...]:
        """Readings without noise, one a channel."""
        ...


class _Instrument:
    """Checks of the fields that all sensors have; readings are no angles."""

    angle: ClassVar[bool] = False
    sd: float
    delay: float

    def __post_init__(self) -> None:
        name = type(self).__name__
        if not self.sd > 0.0:
            raise StudyError(f"{name}: its noise is {self.sd:g}; a standard deviation above zero is needed")
        if not self.delay >= 0.0:
            raise StudyError(f"{name}: its delay is {self.delay:g} s; it must be zero or above")


@dataclass(frozen=True)
class Antenna(_Instrument):
    """A satellite antenna: north and east of the antenna itself [m].

    Attributes:
        sd: noise of each coordinate [m].
        x, y: where it stands, forward of midship and to starboard [m].
        delay: age of a fix [s].
        channels: where the trial holds north and east of the antenna.
    """

    sd: float
    x: float = 0.0
    y: float = 0.0
    delay: float = 0.0
    channels: tuple[str, ...] = ("x", "y")

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.channels) != 2:
            raise StudyError(f"Antenna: {len(self.channels)} channels; it reads two, north and east")

    def read(self, state: tuple[Scalar, ...], environment: Environment) -> tuple[Scalar, ...]:
        """North and east of the antenna [m]."""
        north, east = to_earth(self.x, self.y, cos(state[2]), sin(state[2]))
        return state[0] + north, state[1] + east


@dataclass(frozen=True)
class Heading(_Instrument):
    """A gyro compass: heading from north [rad], in any turn."""

    angle: ClassVar[bool] = True
    sd: float
    delay: float = 0.0
    channels: tuple[str, ...] = ("psi",)

    def read(self, state: tuple[Scalar, ...], environment: Environment) -> tuple[Scalar, ...]:
        """Heading [rad]."""
        return (state[2],)


@dataclass(frozen=True)
class Rate(_Instrument):
    """A rate gyro: rate of turn [rad/s]."""

    sd: float
    delay: float = 0.0
    channels: tuple[str, ...] = ("r",)

    def read(self, state: tuple[Scalar, ...], environment: Environment) -> tuple[Scalar, ...]:
        """Rate of turn [rad/s]."""
        return (state[5],)


@dataclass(frozen=True)
class Log(_Instrument):
    """A speed log: speed ahead at its own place [m/s], through the water or over ground.

    Attributes:
        sd: its noise [m/s].
        y: where it is, to starboard of midship [m]; how far forward does not matter to the speed ahead.
        water: through the water where True.
    """

    sd: float
    y: float = 0.0
    delay: float = 0.0
    water: bool = True
    channels: tuple[str, ...] = ("u",)

    def read(self, state: tuple[Scalar, ...], environment: Environment) -> tuple[Scalar, ...]:
        """Speed ahead [m/s]."""
        ahead = state[3] - self.y * state[5]
        if not self.water:
            return (ahead,)
        return (ahead - to_body(environment.current_x, environment.current_y, cos(state[2]), sin(state[2]))[0],)


@dataclass(frozen=True)
class Track(_Instrument):
    """Velocity over ground of a satellite antenna: its components north and east [m/s].

    Attributes:
        sd: noise of each component [m/s].
        x, y: where it stands, forward of midship and to starboard [m].
        delay: age of a reading [s].
        channels: where the trial holds the components.
    """

    sd: float
    x: float = 0.0
    y: float = 0.0
    delay: float = 0.0
    channels: tuple[str, ...] = ("v_north", "v_east")

    def read(self, state: tuple[Scalar, ...], environment: Environment) -> tuple[Scalar, ...]:
        """Velocity of the antenna, north and east [m/s]."""
        u, v_m, r = state[3:6]
        return to_earth(u - self.y * r, v_m + self.x * r, cos(state[2]), sin(state[2]))
