"""The instruments of a bridge: where the ship is, where she heads, how fast she goes, what blows, what she obeys."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import ClassVar

from ..environment import to_body, to_earth
from . import Truth
from .stream import EXACT, Errors, Instrument

_NONE: Mapping[str, Errors] = MappingProxyType({})


def _velocity_at(truth: Truth, x: float, y: float) -> tuple[float, float]:
    """Velocity over ground, ahead and to starboard, of the point `x` ahead of midship and `y` to starboard [m/s]."""
    r = truth["r"]
    return truth["u"] - r * y, truth["v_m"] + r * x


@dataclass(frozen=True, kw_only=True)
class Gnss(Instrument):
    """A satellite receiver: position of its antenna and how that moves over ground.

    It says x, y [m], speed over ground U [m/s] and course over ground chi [rad].  What it says of the antenna
    differs from midship by the lever arm, in position and, as the ship turns, in velocity.

    Attributes:
        antenna_x, antenna_y: where the antenna stands ahead of midship and to starboard [m].
        position: errors of x and of y [m], independent of each other.
        velocity: errors of the speed [m/s].
        course: errors of the course [rad].
    """

    kind: ClassVar[str] = "gnss"

    antenna_x: float = 0.0
    antenna_y: float = 0.0
    position: Errors = EXACT
    velocity: Errors = EXACT
    course: Errors = EXACT

    @property
    def errors(self) -> Mapping[str, Errors]:
        """What is wrong with each value that it says."""
        return {"x": self.position, "y": self.position, "U": self.velocity, "chi": self.course}

    @property
    def turns(self) -> tuple[str, ...]:
        """The course is a direction."""
        return ("chi",)

    def measure(self, truth: Truth) -> tuple[float, ...]:
        """True x, y, U, chi of the antenna."""
        c, s = math.cos(truth["psi"]), math.sin(truth["psi"])
        north, east = to_earth(self.antenna_x, self.antenna_y, c, s)
        v_north, v_east = to_earth(*_velocity_at(truth, self.antenna_x, self.antenna_y), c, s)
        return truth["x"] + north, truth["y"] + east, math.hypot(v_north, v_east), math.atan2(v_east, v_north)


@dataclass(frozen=True, kw_only=True)
class Gyro(Instrument):
    """A gyro compass: heading psi [rad], from 0 to 2 pi."""

    kind: ClassVar[str] = "gyro"

    heading: Errors = EXACT

    @property
    def errors(self) -> Mapping[str, Errors]:
        """What is wrong with the heading."""
        return {"psi": self.heading}

    @property
    def turns(self) -> tuple[str, ...]:
        """The heading is a direction."""
        return ("psi",)

    def measure(self, truth: Truth) -> tuple[float, ...]:
        """True heading."""
        return (truth["psi"],)


@dataclass(frozen=True, kw_only=True)
class RateGyro(Instrument):
    """A rate-of-turn indicator: r [rad/s], positive to starboard."""

    kind: ClassVar[str] = "rate_gyro"

    rate_of_turn: Errors = EXACT

    @property
    def errors(self) -> Mapping[str, Errors]:
        """What is wrong with the rate of turn."""
        return {"r": self.rate_of_turn}

    def measure(self, truth: Truth) -> tuple[float, ...]:
        """True rate of turn."""
        return (truth["r"],)


@dataclass(frozen=True, kw_only=True)
class SpeedLog(Instrument):
    """A log of two axes: through the water u_w, v_w, and over ground u, v_m at its transducer [m/s].

    Attributes:
        at_x, at_y: where the transducer is ahead of midship and to starboard [m].
        water: errors of u_w and v_w.
        ground: errors of u and v_m; None is a log without bottom track, which says nothing of them.
    """

    kind: ClassVar[str] = "speed_log"

    at_x: float = 0.0
    at_y: float = 0.0
    water: Errors = EXACT
    ground: Errors | None = None

    @property
    def errors(self) -> Mapping[str, Errors]:
        """What is wrong with each value that it says."""
        track = {} if self.ground is None else {"u": self.ground, "v_m": self.ground}
        return {"u_w": self.water, "v_w": self.water, **track}

    def measure(self, truth: Truth) -> tuple[float, ...]:
        """True speeds at the transducer, through the water and, with bottom track, over ground."""
        u, v = _velocity_at(truth, self.at_x, self.at_y)
        c, s = math.cos(truth["psi"]), math.sin(truth["psi"])
        u_C, v_C = to_body(truth["current_x"], truth["current_y"], c, s)
        through = (float(u - u_C), float(v - v_C))
        return through if self.ground is None else (*through, u, v)


@dataclass(frozen=True, kw_only=True)
class Anemometer(Instrument):
    """An anemometer on its mast: apparent wind speed U_A [m/s] and where it comes from, gamma_A [rad] from the bow.

    It feels the motion of the mast: where the ship turns, a mast far from midship moves on its own.  The angle runs
    from 0 to 2 pi clockwise.

    Attributes:
        at_x, at_y: where the mast stands ahead of midship and to starboard [m].
        speed: errors of U_A.
        direction: errors of gamma_A.
    """

    kind: ClassVar[str] = "anemometer"

    at_x: float = 0.0
    at_y: float = 0.0
    speed: Errors = EXACT
    direction: Errors = EXACT

    @property
    def errors(self) -> Mapping[str, Errors]:
        """What is wrong with each value that it says."""
        return {"U_A": self.speed, "gamma_A": self.direction}

    @property
    def turns(self) -> tuple[str, ...]:
        """The angle is a direction."""
        return ("gamma_A",)

    def measure(self, truth: Truth) -> tuple[float, ...]:
        """True apparent wind at the mast."""
        u, v = _velocity_at(truth, self.at_x, self.at_y)
        c, s = math.cos(truth["psi"]), math.sin(truth["psi"])
        ahead, aside = to_body(truth["wind_x"], truth["wind_y"], c, s)  # where it comes from, times its speed
        along, across = float(ahead + u), float(aside + v)
        return math.hypot(along, across), math.atan2(across, along)


@dataclass(frozen=True, kw_only=True)
class Feedback(Instrument):
    """Indicators of what rudder, propeller and thrusters actually do, by the names of the controls.

    Attributes:
        controls: those that it shows.
        of: errors by name; a control that is not in it is shown as it is.
    """

    kind: ClassVar[str] = "feedback"

    controls: tuple[str, ...] = ("delta", "n_P")
    of: Mapping[str, Errors] = field(default_factory=lambda: _NONE)

    @property
    def errors(self) -> Mapping[str, Errors]:
        """What is wrong with each value that it says."""
        return {name: self.of.get(name, Errors()) for name in self.controls}

    def measure(self, truth: Truth) -> tuple[float, ...]:
        """True values of the controls."""
        return tuple(truth[name] for name in self.controls)
