"""A scenario as values, SI units and radians: ships and their routes, weather, faults, alarms and criteria."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

from ...actuators import Actuator, Actuators
from ...core.values import dataclass, field
from ...data.geodesy import Datum
from ...data.nmea.ais import Status, Type
from ...encounters.sensing import Sensing
from ...environment import CALM, Environment
from ...environment.chart import Chart
from ...environment.sea import Sea
from ...environment.sea.rao import Rao
from ...manoeuvres.autopilot import K_PRIME, T_PRIME
from ...manoeuvres.track import Leg, legs
from ...models.nomoto import Nomoto, from_prime
from ...ships import Ship
from ...study.grounds import Grounds
from ..machinery import Aboard
from .schema import Ais, Kind

_RUDDER, _RUDDER_RATE = math.radians(35.0), math.radians(2.5)
"""Limit and rate of the rudder of a ship without a file; assumed."""


@dataclass(frozen=True)
class Sailing:
    """How a ship begins and where it goes.

    Attributes:
        x, y, psi: initial place [m] and heading [rad].
        speed: initial speed through the water [m/s].
        route: waypoints (x, y) to pass, in order [m]; none: the line of the initial heading.
        mmsi: of the transponder; 0 for none of its own.
        kind, status: what its transponder says of its type and of what it is doing.
    """

    x: float
    y: float
    psi: float
    speed: float
    route: tuple[tuple[float, float], ...] = ()
    mmsi: int = 0
    kind: Type | None = None
    status: Status = "under way"

    @property
    def legs(self) -> tuple[Leg, ...]:
        """The legs from the initial place on; without a route one that never ends."""
        if not self.route:
            return (Leg(self.x, self.y, self.psi, math.inf),)
        return tuple(Leg(*map(float, leg)) for leg in legs(((self.x, self.y), *self.route)))


@dataclass(frozen=True)
class Own:
    """The own ship.

    Attributes:
        usual: whether its instruments have the usual errors; else they are exact.
        piloted: whether it has a track pilot of its own.
        antenna: place of the antenna, forward and to starboard of midship [m]; None: midship, of usual instruments 0.4
            lengths abaft it.
        begun: initial (x, y, psi, u, v_m, r) over ground; None: those of `sailing`, ahead through the water.
        grounds: what the trials of its fit tested; None of a ship without a fit.
    """

    ship: Ship
    sailing: Sailing
    usual: bool = False
    piloted: bool = True
    antenna: tuple[float, float] | None = None
    begun: tuple[float, ...] | None = None
    grounds: Grounds | None = None


@dataclass(frozen=True)
class Other:
    """Another ship, and what reports it: its own transponder, the radar of the own ship.

    Attributes:
        conduct: how it behaves towards others (`encounters.conduct`); None: it keeps its route whatever comes.
    """

    name: str
    ship: Ship
    sailing: Sailing
    ais: Ais = "class A"
    radar: bool = True
    conduct: str | None = None


@dataclass(frozen=True)
class Weather:
    """Weather that is reached `over` seconds after `at` [s], linearly in its components."""

    at: float
    over: float
    around: Environment


@dataclass(frozen=True)
class Fault:
    """A fault of an instrument ("gyro") or of the gear (a control, or an order that several controls obey).

    Attributes:
        kind: frozen (the last reading is repeated), silent, jump, drift; jammed, slow, lost (no order reaches it).
        of: the instrument or the control.
        at, lasts: when it begins and how long it lasts [s]; None: by a button, to the end.
        by: error of each value, SI units and radians, of a drift per second.
        rate: of a slow control [1/s of its unit].
        label: for the button.
    """

    kind: Kind
    of: str
    at: float | None = None
    lasts: float | None = None
    by: Mapping[str, float] = field(default_factory=dict[str, float])
    rate: float = math.inf
    label: str = ""

    @property
    def of_gear(self) -> bool:
        """Whether it lies between an order and the gear."""
        return self.kind in ("jammed", "slow", "lost")


@dataclass(frozen=True)
class Criteria:
    """What makes a run a success, SI units and radians; None is not judged.

    Attributes:
        passing_distance: least distance to every other ship, between the midships.
        under_keel: least depth of the chart at midship, less the draught; squat is not in it.
        cross_track: greatest distance from the route.
        heading_error: greatest difference from the direction of the leg, `settle` seconds after the start of it.
        time: until the last waypoint is abeam.
        rules: whether every rule of the road that applies is to be kept.
    """

    passing_distance: float | None = None
    cross_track: float | None = None
    heading_error: float | None = None
    time: float | None = None
    settle: float = 60.0
    under_keel: float | None = None
    rules: bool = False


@dataclass(frozen=True)
class Limits:
    """When alarms are raised: nearest approach within a time, off the route, rudder off its order, under the keel."""

    cpa: float = 926.0
    tcpa: float = 720.0
    cross_track: float | None = None
    rudder: float = math.radians(5.0)
    under_keel: float | None = None


@dataclass(frozen=True)
class Scenario:
    """A scenario.

    Attributes:
        duration: greatest simulated time [s]; the run ends earlier when the last waypoint is abeam.
        rate: ticks a second [Hz].
        seed: of gusts and instruments.
        datum: where x and y are zero; None: nowhere on earth.
        epoch: seconds since 1970, UTC, at t = 0.
        variation: of the magnetic compass, east positive [rad]; None without one.
        gusts: spectrum of the gusts; None without.
        weather: by time; before the first it is calm.
        chart: depths, banks, quays and fenders, about where x and y are zero; None for open water.
        sea, rao: an irregular sea and the operators of the own ship's motion in it, which its instruments see; both or
            neither.  The mean drift is part of `weather`.
        sensing: radar and AIS as they reach the wire; None: without error, delay or loss.
        aboard: FMUs of the own ship's gear and controllers.
    """

    title: str
    duration: float
    own: Own
    others: tuple[Other, ...] = ()
    rate: float = 10.0
    seed: int = 1
    datum: Datum | None = None
    epoch: float = 1_767_268_800.0
    variation: float | None = None
    gusts: str | None = None
    weather: tuple[Weather, ...] = ()
    faults: tuple[Fault, ...] = ()
    criteria: Criteria = Criteria()
    limits: Limits = Limits()
    chart: Chart | None = None
    sea: Sea | None = None
    rao: Rao | None = None
    sensing: Sensing | None = None
    aboard: tuple[Aboard, ...] = ()

    @property
    def first(self) -> Environment:
        """The weather at the start, without gusts."""
        begun = [one.around for one in self.weather if one.at == 0.0 and one.over == 0.0]
        return begun[-1] if begun else CALM


def ordinary(name: str, length: float, speed: float) -> Ship:
    """A ship of this length that steers as a middling merchant ship and holds its speed through the water."""
    K, T = from_prime(K_PRIME, T_PRIME, length, speed)
    rudder = Actuator(low=-_RUDDER, high=_RUDDER, rate=_RUDDER_RATE)
    return Ship(name, Nomoto(K=K, T=T, U=speed), Actuators({"rudder": rudder}), length, speed)


Phase = Literal["pilot", "wire", "page", "fmu", "ardupilot", "nobody"]
"""Who steers the own ship: its track pilot, a sender on the wire, a mariner at the page, an FMU aboard, ArduPilot."""
