"""The keys of scenario files, `seatrial-scenario/1`, and their types; metres, m/s, degrees and seconds."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import Field

from ...study.schema import Strict

SCHEMA = "seatrial-scenario/1"

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Heading = Annotated[float, Field(ge=-360.0, le=360.0)]
Mmsi = Annotated[int, Field(ge=200_000_000, le=799_999_999)]

Ais = Literal["class A", "class A assigned", "class B", "none"]
Kind = Literal["frozen", "silent", "jump", "drift", "jammed", "slow", "lost"]


Point = Any
"""A point: [north, east] of `place` [m], or {lat, lon} [deg]; checked by who reads it, for one message in one line."""


class SailingTable(Strict):
    """How a ship begins and where it goes; without a route it keeps the line of its initial heading.

    Without a place it begins where x and y are zero, without a heading towards the first waypoint, else north, and
    without a speed at that of its file.
    """

    at: Point = None
    heading: Heading | None = None
    speed: NotNegative | None = None
    route: tuple[Point, ...] = ()
    mmsi: Mmsi | None = None


class OwnTable(SailingTable):
    """The own ship; `pilot` is what steers it where nothing else does, `antenna` forward and to starboard [m]."""

    ship: str
    instruments: Literal["exact", "usual"] = "exact"
    antenna: tuple[Finite, Finite] | None = None
    pilot: Literal["track", "none"] = "track"


class TrafficTable(SailingTable):
    """Another ship: one of the library or a file, or a length: a ship of average steering at a held speed."""

    ship: str | None = None
    length: Annotated[float, Field(ge=2.0, le=600.0)] | None = None
    ais: Ais = "class A"
    radar: bool = True


class WeatherTable(Strict):
    """Weather from `at` on, reached from what was before within `over` seconds; what is left out stays."""

    at: NotNegative = 0.0
    over: NotNegative = 0.0
    wind: str | None = None
    current: str | None = None
    waves: str | None = None
    depth: Positive | None = None


class FaultTable(Strict):
    """A fault of an instrument or of the gear; without `at` only a button starts it."""

    kind: Kind
    of: str
    at: NotNegative | None = None
    lasts: Positive | None = None
    by: dict[str, Finite] = Field(default_factory=dict)
    rate: Positive | None = None
    label: str = Field(default="", max_length=60)


class CriteriaTable(Strict):
    """What makes a run a success; what is left out is not judged. `settle` is the time before the heading counts."""

    passing_distance: Positive | None = None
    under_keel: Positive | None = None
    cross_track: Positive | None = None
    heading_error: Positive | None = None
    time: Positive | None = None
    settle: NotNegative = 60.0


class AlarmsTable(Strict):
    """When alarms are raised: nearest approach [m] within a time [s], distance from the route, water under the keel."""

    cpa: Positive = 926.0
    tcpa: Positive = 720.0
    cross_track: Positive | None = None
    rudder: Positive = 5.0
    under_keel: Positive | None = None


class ScenarioFile(Strict):
    """A scenario."""

    title: str = Field(default="", max_length=120)
    duration: Annotated[float, Field(gt=0.0, le=7 * 86400.0)]
    rate: Annotated[float, Field(ge=1.0, le=100.0)] = 10.0
    seed: int = Field(default=1, ge=0)
    place: tuple[float, float] | None = None
    variation: Annotated[float, Field(ge=-180.0, le=180.0)] | None = None
    start: datetime = datetime.fromisoformat("2026-01-01T12:00:00+00:00")
    gusts: str | None = None
    chart: str | None = None
    sea: str | None = None
    rao: str | None = None
    roll_damping: Finite | None = None
    own: OwnTable
    traffic: dict[str, TrafficTable] = Field(default_factory=dict, max_length=99)
    weather: tuple[WeatherTable, ...] = ()
    faults: tuple[FaultTable, ...] = ()
    criteria: CriteriaTable = CriteriaTable()
    alarms: AlarmsTable = AlarmsTable()
