"""Instruments of a bridge: GNSS, gyro compass, rate gyro, speed log, anemometer, echo sounder, feedback."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import ClassVar

from ..core.parameters import unknown
from ..core.values import dataclass, field
from ..environment import to_body, to_earth
from . import SensorError, Truth
from .stream import EXACT, Errors, Instrument, direction, not_below_zero, rounded

_NONE: Mapping[str, Errors] = MappingProxyType({})


def _velocity_at(truth: Truth, x: float, y: float) -> tuple[float, float]:
    """Velocity over ground, ahead and to starboard, of the point `x` ahead of midship and `y` to starboard [m/s]."""
    r = truth["r"]
    return truth["u"] - r * y, truth["v_m"] + r * x


@dataclass(frozen=True, kw_only=True)
class Gnss(Instrument):
    """A GNSS receiver: position and velocity over ground of its antenna.

    A reading has x, y [m], speed over ground U [m/s] and course over ground chi [rad], from 0 to 2 pi.  The
    antenna differs from midship by the lever arm, in position and, in a turn, in velocity.  The errors are those of the
    components of the velocity: at rest the course is arbitrary, and the speed is never below zero.

    Attributes:
        antenna_x, antenna_y: place of the antenna ahead of midship and to starboard [m].
        position: errors of x and of y [m], independent of each other.
        velocity: errors of the velocity to the north and to the east [m/s], independent of each other.
        speed_quantum, course_quantum: resolution of U [m/s] and of chi [rad].
    """

    kind: ClassVar[str] = "gnss"

    antenna_x: float = 0.0
    antenna_y: float = 0.0
    position: Errors = EXACT
    velocity: Errors = EXACT
    speed_quantum: float = 0.0
    course_quantum: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        not_below_zero("the gnss", speed_quantum=self.speed_quantum, course_quantum=self.course_quantum)

    @property
    def errors(self) -> Mapping[str, Errors]:
        return {"x": self.position, "y": self.position, "north": self.velocity, "east": self.velocity}

    def measure(self, truth: Truth) -> tuple[float, ...]:
        """True position and velocity of the antenna, north and east."""
        c, s = math.cos(truth["psi"]), math.sin(truth["psi"])
        north, east = to_earth(self.antenna_x, self.antenna_y, c, s)
        v_north, v_east = to_earth(*_velocity_at(truth, self.antenna_x, self.antenna_y), c, s)
        return truth["x"] + north, truth["y"] + east, v_north, v_east

    def say(self, measured: Sequence[float]) -> dict[str, float]:
        """x, y, U, chi."""
        x, y, north, east = measured
        return {"x": x, "y": y, "U": rounded(math.hypot(north, east), self.speed_quantum),
                "chi": direction(math.atan2(east, north), self.course_quantum)}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Gyro(Instrument):
    """A gyro compass: heading psi [rad], from 0 to 2 pi."""

    kind: ClassVar[str] = "gyro"

    heading: Errors = EXACT

    @property
    def errors(self) -> Mapping[str, Errors]:
        return {"psi": self.heading}

    def measure(self, truth: Truth) -> tuple[float, ...]:
        return (truth["psi"],)

    def say(self, measured: Sequence[float]) -> dict[str, float]:
        return {"psi": direction(measured[0])}


@dataclass(frozen=True, kw_only=True)
class RateGyro(Instrument):
    """A rate-of-turn indicator: r [rad/s], positive to starboard."""

    kind: ClassVar[str] = "rate_gyro"

    rate_of_turn: Errors = EXACT

    @property
    def errors(self) -> Mapping[str, Errors]:
        return {"r": self.rate_of_turn}

    def measure(self, truth: Truth) -> tuple[float, ...]:
        return (truth["r"],)


@dataclass(frozen=True, kw_only=True)
class SpeedLog(Instrument):
    """A log of two axes: through the water u_w, v_w, and over ground u, v_m at its transducer [m/s].

    Attributes:
        at_x, at_y: place of the transducer ahead of midship and to starboard [m].
        stern_x: place of the transverse speeds of the stern, v_w_stern and v_stern, ahead of midship (so below
            zero) [m]; None is a log without them.
        water: errors of u_w, v_w and v_w_stern.
        ground: errors of u, v_m and v_stern; None is a log without bottom track, which does not measure them.
    """

    kind: ClassVar[str] = "speed_log"

    at_x: float = 0.0
    at_y: float = 0.0
    stern_x: float | None = None
    water: Errors = EXACT
    ground: Errors | None = None

    @property
    def errors(self) -> Mapping[str, Errors]:
        stern = ("_stern",) if self.stern_x is not None else ()
        water = dict.fromkeys(("u_w", "v_w", *(f"v_w{name}" for name in stern)), self.water)
        if self.ground is None:
            return water
        return {**water, **dict.fromkeys(("u", "v_m", *(f"v{name}" for name in stern)), self.ground)}

    def measure(self, truth: Truth) -> tuple[float, ...]:
        """True speeds at the transducer and at the stern, through the water and, with bottom track, over ground."""
        u, v = _velocity_at(truth, self.at_x, self.at_y)
        stern = () if self.stern_x is None else _velocity_at(truth, self.stern_x, 0.0)[1:]
        c, s = math.cos(truth["psi"]), math.sin(truth["psi"])
        u_C, v_C = to_body(truth["current_x"], truth["current_y"], c, s)
        through = (float(u - u_C), float(v - v_C), *(float(aside - v_C) for aside in stern))
        return through if self.ground is None else (*through, u, v, *stern)


@dataclass(frozen=True, kw_only=True)
class Anemometer(Instrument):
    """An anemometer on its mast: apparent wind speed U_A [m/s] and where it comes from, gamma_A [rad] from the bow.

    The apparent wind includes the motion of the mast: in a turn, a mast far from midship has its own velocity.  With
    that motion as input, a reading has the true wind too: U_T, and gamma_T_bow from the bow.  The errors are those of
    the components, so no speed is below zero.  Angles run from 0 to 2 pi clockwise.

    Attributes:
        at_x, at_y: place of the mast ahead of midship and to starboard [m].
        wind: errors of the apparent wind from ahead and from starboard [m/s], independent of each other.
        motion: errors of the input motion of the mast, ahead and to starboard [m/s]; None is an
            anemometer without true wind.
        skew: angle by which it is turned to starboard against the ship [rad].
        speed_quantum, direction_quantum: resolution of the speeds [m/s] and of the angles [rad].
    """

    kind: ClassVar[str] = "anemometer"

    at_x: float = 0.0
    at_y: float = 0.0
    wind: Errors = EXACT
    motion: Errors | None = EXACT
    skew: float = 0.0
    speed_quantum: float = 0.0
    direction_quantum: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        not_below_zero("the anemometer", speed_quantum=self.speed_quantum, direction_quantum=self.direction_quantum)
        if not math.isfinite(self.skew):
            raise SensorError(f"skew of the anemometer is {self.skew:g}; it must be finite")

    @property
    def errors(self) -> Mapping[str, Errors]:
        motion = {} if self.motion is None else {"u": self.motion, "v_m": self.motion}
        return {"ahead": self.wind, "aside": self.wind, **motion}

    def measure(self, truth: Truth) -> tuple[float, ...]:
        """True apparent wind at the mast, and velocity of the mast."""
        u, v = _velocity_at(truth, self.at_x, self.at_y)
        c, s = math.cos(truth["psi"]), math.sin(truth["psi"])
        ahead, aside = to_body(truth["wind_x"], truth["wind_y"], c, s)  # where it comes from, times its speed
        felt = (float(ahead + u), float(aside + v))
        return felt if self.motion is None else (*felt, u, v)

    def say(self, measured: Sequence[float]) -> dict[str, float]:
        """U_A, gamma_A and, where the motion is known, U_T, gamma_T_bow."""
        c, s = math.cos(self.skew), math.sin(self.skew)
        ahead, aside = to_body(measured[0], measured[1], c, s) if self.skew else measured[:2]
        U_A, gamma_A = self._polar(float(ahead), float(aside))
        if len(measured) == 2:
            return {"U_A": U_A, "gamma_A": gamma_A}
        U_T, gamma_T = self._polar(float(ahead - measured[2]), float(aside - measured[3]))
        return {"U_A": U_A, "gamma_A": gamma_A, "U_T": U_T, "gamma_T_bow": gamma_T}

    def _polar(self, ahead: float, aside: float) -> tuple[float, float]:
        speed = rounded(math.hypot(ahead, aside), self.speed_quantum)
        return speed, direction(math.atan2(aside, ahead), self.direction_quantum)


@dataclass(frozen=True, kw_only=True)
class EchoSounder(Instrument):
    """An echo sounder: depth of the ground below its transducer [m], and draught of the transducer.

    In water beyond its reach, a reading has the latter only.

    Attributes:
        draught: of the transducer, below the waterline [m].
        reach: greatest depth below it that it measures [m].
        depth: errors of the measured depth.
    """

    kind: ClassVar[str] = "echo_sounder"

    draught: float = 0.0
    reach: float = math.inf
    depth: Errors = EXACT

    def __post_init__(self) -> None:
        super().__post_init__()
        not_below_zero("the echo_sounder", draught=self.draught)
        if not self.reach > 0.0:
            raise SensorError(f"reach of the echo_sounder is {self.reach:g}; it must be above zero")

    @property
    def errors(self) -> Mapping[str, Errors]:
        return {"below": self.depth}

    def measure(self, truth: Truth) -> tuple[float, ...]:
        """True depth below the transducer; infinite in deep water."""
        per_depth = truth["per_depth"]
        return (1.0 / per_depth - self.draught if per_depth > 0.0 else math.inf,)

    def say(self, measured: Sequence[float]) -> dict[str, float]:
        """The depth of the transducer, and that of the ground below it, within reach."""
        below, found = measured[0], {"transducer": self.draught}
        return {**found, "below": below} if 0.0 <= below <= self.reach and math.isfinite(below) else found


@dataclass(frozen=True, kw_only=True)
class Feedback(Instrument):
    """Indicators of the actual values of rudder, propeller and thrusters, by the names of the controls.

    Attributes:
        controls: controls with an indicator.
        of: errors by name; a control that is absent has no errors.
    """

    kind: ClassVar[str] = "feedback"

    controls: tuple[str, ...] = ("delta", "n_P")
    of: Mapping[str, Errors] = field(default_factory=lambda: _NONE)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in self.of:
            if name not in self.controls:
                raise SensorError(f"errors of the feedback: {unknown(name, self.controls, 'control')}")

    @property
    def errors(self) -> Mapping[str, Errors]:
        return {name: self.of.get(name, EXACT) for name in self.controls}

    def measure(self, truth: Truth) -> tuple[float, ...]:
        return tuple(truth[name] for name in self.controls)
