"""Manoeuvres as a person orders them: angles in degrees, the approach that of the ship.

``ship.simulate(Zigzag(rudder_deg=20, heading_deg=20))`` makes the manoeuvre of `seatrial.manoeuvres` of the same kind,
whose numbers are radians and revolutions.  An angle that is not given is the manoeuvre's own, within the limit of the
ship; docs/manoeuvres.md has them, and what each yields.
"""

from __future__ import annotations

from typing import ClassVar, Literal

from ..core.values import dataclass

Side = Literal["starboard", "port"]


@dataclass(frozen=True, kw_only=True)
class Order:
    """A manoeuvre to be run; see `Ship.simulate`."""

    kind: ClassVar[str] = ""
    """Name on the command line and in trial files."""


@dataclass(frozen=True, kw_only=True)
class _Sided(Order):
    """With a first side."""

    side: Side = "starboard"


@dataclass(frozen=True, kw_only=True)
class _Steered(_Sided):
    """With a rudder angle, a magnitude [deg], or of a craft without a rudder a steering demand [% of its greatest]."""

    rudder_deg: float | None = None
    steer_percent: float | None = None


@dataclass(frozen=True, kw_only=True)
class _Turned(_Steered):
    """With a change of heading, a magnitude [deg]."""

    heading_deg: float | None = None


@dataclass(frozen=True, kw_only=True)
class _Drawn(_Steered):
    """With random orders of this seed."""

    seed: int = 1


class Turning(_Steered):
    """Turning circle: rudder over, 35 deg unless ordered, and held."""

    kind = "turning"


class Zigzag(_Turned):
    """Zigzag, 10/10 unless ordered: the rudder is reversed whenever the heading has changed by `heading_deg`."""

    kind = "zigzag"


class InitialTurning(_Turned):
    """Rudder over, 10 deg unless ordered, until the heading has changed by 10 deg."""

    kind = "initial-turning"


class Spiral(_Steered):
    """Direct spiral of Dieudonne: steady rates of turn over rudder angles, from one side to the other and back."""

    kind = "spiral"


class ReverseSpiral(_Sided):
    """Reverse spiral of Bech: the rudder angles that hold given rates of turn."""

    kind = "reverse-spiral"


class PullOut(_Steered):
    """Rudder over until the turn is steady, then midships; to both sides."""

    kind = "pull-out"


class Stopping(Order):
    """Engine stopped, rudder midships."""

    kind = "stopping"


class CrashAstern(Order):
    """Revolutions of the approach reversed until the ship is stopped."""

    kind = "crash-astern"


class Acceleration(Order):
    """From rest, with the revolutions of the approach."""

    kind = "acceleration"


class Straight(Order):
    """Rudder midships; give a duration."""

    kind = "straight"


class Williamson(_Turned):
    """Williamson turn onto the reciprocal track."""

    kind = "williamson"


class Scharnow(_Turned):
    """Scharnow turn onto the reciprocal track."""

    kind = "scharnow"


class SingleTurn(_Turned):
    """Single turn (Anderson) back to the place of the execute."""

    kind = "single-turn"


class CourseKeeping(_Turned):
    """An autopilot changes course by `heading_deg` and keeps it; `rudder_deg` is its largest order."""

    kind = "course-keeping"


class TrackFollowing(_Turned):
    """Line-of-sight guidance round a corner of `heading_deg`, 90 deg unless ordered."""

    kind = "track"


class Berthing(_Turned):
    """To a stop 28 lengths ahead and one to the side."""

    kind = "berthing"


class Crabbing(_Sided):
    """Two lengths sideways by thrusters fore and aft, from rest."""

    kind = "crabbing"


class PseudoRandom(_Drawn):
    """Five levels of rudder and revolutions in a maximal-length sequence, for identification."""

    kind = "pseudo-random"


class HumanRandom(_Drawn):
    """Rudder and revolutions at random, ahead and astern, as a person gives them."""

    kind = "random"


@dataclass(frozen=True, kw_only=True)
class ThrustSteps(Order):
    """Surge force, sway force and yaw moment at random levels, by two thrusters ordered in newtons, from rest."""

    kind: ClassVar[str] = "thrust-steps"

    seed: int = 1


@dataclass(frozen=True, kw_only=True)
class Weather:
    """Steady wind, current and waves, directions in degrees clockwise from north, and the depth of the water.

    Attributes:
        wind, wind_from_deg: true wind speed [m/s] and the direction it comes from.
        gusts: spectrum of gusts about that wind, as of ``seatrial simulate --gusts``; None: a steady wind.
        current, current_towards_deg: speed of the water [m/s] and the direction it goes to.
        wave_height, wave_period, waves_from_deg: significant height [m], mean period [s], where they come from.
        depth: depth of the water [m]; None is deep.
        seed: of the gusts.
    """

    wind: float = 0.0
    wind_from_deg: float = 0.0
    gusts: str | None = None
    current: float = 0.0
    current_towards_deg: float = 0.0
    wave_height: float = 0.0
    wave_period: float = 0.0
    waves_from_deg: float = 0.0
    depth: float | None = None
    seed: int = 1
