"""The keys of scenario files, `seatrial-scenario/1`, and their types; metres, m/s, degrees and seconds."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from ...core.records import Limits, NotNegative, Positive
from ...core.values import dataclass, field
from ...data.nmea.ais import Status, Type
from ...encounters.sensing import Sensing

SCHEMA = "seatrial-scenario/1"
"""The first key of a scenario's file."""

Heading = Annotated[float, Limits(least=-360.0, most=360.0)]
Mmsi = Annotated[int, Limits(least=200_000_000, most=799_999_999)]

START = datetime.fromisoformat("2026-01-01T12:00:00+00:00")
"""When a run begins whose scenario does not say."""

Ais = Literal["class A", "class A assigned", "class B", "none"]
Kind = Literal["frozen", "silent", "jump", "drift", "jammed", "slow", "lost"]


Point = Any
"""A point: [north, east] of `place` [m], or {lat, lon} [deg]; checked by who reads it, for one message in one line."""


@dataclass(frozen=True, kw_only=True)
class SailingTable:
    """How a ship begins and where it goes; without a route it keeps the line of its initial heading.

    Without a place it begins where x and y are zero, without a heading towards the first waypoint, else north, and
    without a speed at that of its file.
    """

    at: Point = None
    heading: Heading | None = None
    speed: NotNegative | None = None
    route: tuple[Point, ...] = ()
    mmsi: Mmsi | None = None
    type: Type | None = None
    status: Status = "under way"


@dataclass(frozen=True, kw_only=True)
class OwnTable(SailingTable):
    """The own ship; `pilot` is what steers it where nothing else does, `antenna` forward and to starboard [m]."""

    ship: str
    instruments: Literal["exact", "usual"] = "exact"
    antenna: tuple[float, float] | None = None
    pilot: Literal["track", "none"] = "track"


@dataclass(frozen=True, kw_only=True)
class TrafficTable(SailingTable):
    """Another ship: one of the library or a file, or a length: a ship of average steering at a held speed.

    `conduct` is how it behaves towards others, in place of a route.
    """

    ship: str | None = None
    length: Annotated[float, Limits(least=2.0, most=600.0)] | None = None
    ais: Ais = "class A"
    radar: bool = True
    conduct: str | None = None


@dataclass(frozen=True, kw_only=True)
class WeatherTable:
    """Weather from `at` on, reached from what was before within `over` seconds; what is left out stays."""

    at: NotNegative = 0.0
    over: NotNegative = 0.0
    wind: str | None = None
    current: str | None = None
    waves: str | None = None
    depth: Positive | None = None


@dataclass(frozen=True, kw_only=True)
class FaultTable:
    """A fault of an instrument or of the gear; without `at` only a button starts it."""

    kind: Kind
    of: str
    at: NotNegative | None = None
    lasts: Positive | None = None
    by: dict[str, float] = field(default_factory=dict[str, float])
    rate: Positive | None = None
    label: Annotated[str, Limits(length=60)] = ""


@dataclass(frozen=True, kw_only=True)
class FmuTable:
    """An FMU aboard: by input what it reads, by output what it gives (`realtime.machinery.Aboard`)."""

    file: str
    name: Annotated[str, Limits(length=60)] = ""
    reads: dict[str, str] = field(default_factory=dict[str, str])
    gives: dict[str, str] = field(default_factory=dict[str, str])
    start: dict[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True, kw_only=True)
class SystemTable:
    """A system of the Open Simulation Platform, in which the own ship is one of the simulators."""

    file: str
    ship: str


@dataclass(frozen=True, kw_only=True)
class CriteriaTable:
    """What makes a run a success; what is left out is not judged. `settle` is the time before the heading counts."""

    passing_distance: Positive | None = None
    under_keel: Positive | None = None
    cross_track: Positive | None = None
    heading_error: Positive | None = None
    time: Positive | None = None
    settle: NotNegative = 60.0
    rules: bool = False


@dataclass(frozen=True, kw_only=True)
class AlarmsTable:
    """When alarms are raised: nearest approach [m] within a time [s], distance from the route, water under the keel."""

    cpa: Positive = 926.0
    tcpa: Positive = 720.0
    cross_track: Positive | None = None
    rudder: Positive = 5.0
    under_keel: Positive | None = None


@dataclass(frozen=True, kw_only=True)
class ScenarioFile:
    """A scenario."""

    title: Annotated[str, Limits(length=120)] = ""
    duration: Annotated[float, Limits(above=0.0, most=7 * 86400.0)]
    rate: Annotated[float, Limits(least=1.0, most=100.0)] = 10.0
    seed: Annotated[int, Limits(least=0)] = 1
    place: tuple[float, float] | None = None
    variation: Annotated[float, Limits(least=-180.0, most=180.0)] | None = None
    start: datetime = START
    gusts: str | None = None
    chart: str | None = None
    sea: str | None = None
    rao: str | None = None
    roll_damping: float | None = None
    own: OwnTable
    traffic: Annotated[dict[str, TrafficTable], Limits(length=99)] = field(default_factory=dict[str, TrafficTable])
    sensors: Sensing | None = None
    weather: tuple[WeatherTable, ...] = ()
    faults: tuple[FaultTable, ...] = ()
    fmu: tuple[FmuTable, ...] = ()
    system: SystemTable | None = None
    criteria: CriteriaTable = field(default_factory=CriteriaTable)
    alarms: AlarmsTable = field(default_factory=AlarmsTable)
