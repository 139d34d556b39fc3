"""The keys of campaign files, `seatrial-campaign/1`, and their types."""

from __future__ import annotations

from typing import Annotated, Literal

from ..core.records import Limits, Positive
from ..core.values import dataclass, field
from .designs import Design

SCHEMA = "seatrial-campaign/1"
"""The first key of a campaign's file."""

Numbers = list[float]
Open = Annotated[float, Limits(infinite=True)]


@dataclass(frozen=True, kw_only=True)
class ManoeuvreTable:
    """A manoeuvre with the settings of `seatrial simulate`: rudder, heading [deg], speed [m/s], rps [1/s], else [%]."""

    kind: str
    name: str = ""
    rudder: Positive | None = None
    steer: Positive | None = None
    heading: Positive | None = None
    side: Literal["port", "starboard"] | None = None
    seed: Annotated[int, Limits(least=0)] | None = None
    speed: Positive | None = None
    rps: float | None = None
    throttle: float | None = None
    duration: Positive | None = None
    dt: Positive | None = None
    method: Literal["rk4", "euler"] = "rk4"
    indices: Literal["tally", "all"] = "tally"
    device: str = "cpu"
    precision: Literal["double", "single"] = "double"


@dataclass(frozen=True, kw_only=True)
class TracksTable:
    """Samples of each run that are kept: each so many, and which of their columns."""

    every: Annotated[int, Limits(least=1)] = 1
    columns: list[str] = field(default_factory=list[str])
    precision: Literal["double", "single"] = "single"


@dataclass(frozen=True, kw_only=True)
class WeatherTable:
    """What is around all ships, as the options of `seatrial simulate` of these names give it."""

    wind: str | None = None
    gusts: str | None = None
    current: str | None = None
    waves: str | None = None
    depth: Positive | None = None


@dataclass(frozen=True, kw_only=True)
class InputTable:
    """One input: one of the distributions, in `unit`; with `factor` it multiplies the value of the ship."""

    value: float | None = None
    uniform: Numbers | None = None
    normal: Numbers | None = None
    lognormal: Numbers | None = None
    triangular: Numbers | None = None
    choice: Numbers | None = None
    values: Numbers | None = None
    weights: tuple[float, ...] = ()
    within: tuple[Open, Open] | None = None
    factor: bool = False
    unit: str | None = None


@dataclass(frozen=True, kw_only=True)
class PosteriorTable:
    """A fit whose posterior is drawn from: folder of a run, or a file in it."""

    fit: str
    widen: Positive = 1.0


@dataclass(frozen=True, kw_only=True)
class CriterionTable:
    """Bounds of an index, in `unit`."""

    at_most: float | None = None
    at_least: float | None = None
    unit: str | None = None


@dataclass(frozen=True, kw_only=True)
class CampaignFile:
    """A campaign."""

    title: str = ""
    ships: list[str]
    runs: Annotated[int, Limits(least=1)]
    manoeuvre: ManoeuvreTable | list[ManoeuvreTable]
    seed: Annotated[int, Limits(least=0)] = 1
    design: Design = "random"
    chunk: Annotated[int, Limits(least=1)] | None = None
    tracks: TracksTable | None = None
    revolutions: Literal["ship", "balanced"] = "ship"
    weather: WeatherTable = field(default_factory=WeatherTable)
    inputs: dict[str, InputTable] = field(default_factory=dict[str, InputTable])
    posterior: PosteriorTable | None = None
    criteria: dict[str, CriterionTable] = field(default_factory=dict[str, CriterionTable])
