"""The keys of campaign files, `seatrial-campaign/1`, and their types."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ..study.schema import Strict
from .designs import Design

SCHEMA = "seatrial-campaign/1"

Positive = Annotated[float, Field(gt=0.0)]
Numbers = list[float]


class ManoeuvreTable(Strict):
    """A manoeuvre with the settings of `seatrial simulate`: rudder, heading [deg], speed [m/s], rps [1/s], else [%]."""

    kind: str
    name: str = ""
    rudder: Positive | None = None
    steer: Positive | None = None
    heading: Positive | None = None
    side: Literal["port", "starboard"] | None = None
    seed: int | None = Field(default=None, ge=0)
    speed: Positive | None = None
    rps: float | None = None
    throttle: float | None = None
    duration: Positive | None = None
    dt: Positive | None = None
    method: Literal["rk4", "euler"] = "rk4"
    indices: Literal["tally", "all"] = "tally"
    device: str = "cpu"
    precision: Literal["double", "single"] = "double"


class TracksTable(Strict):
    """Samples of each run that are kept: each so many, and which of their columns."""

    every: int = Field(default=1, gt=0)
    columns: list[str] = Field(default_factory=list)
    precision: Literal["double", "single"] = "single"


class WeatherTable(Strict):
    """What is around all ships, as the options of `seatrial simulate` of these names give it."""

    wind: str | None = None
    gusts: str | None = None
    current: str | None = None
    waves: str | None = None
    depth: Positive | None = None


class InputTable(Strict):
    """One input: one of the distributions, in `unit`; with `factor` it multiplies the value of the ship."""

    value: float | None = None
    uniform: Numbers | None = None
    normal: Numbers | None = None
    lognormal: Numbers | None = None
    triangular: Numbers | None = None
    choice: Numbers | None = None
    values: Numbers | None = None
    weights: tuple[float, ...] = ()
    within: tuple[float, float] | None = None
    factor: bool = False
    unit: str | None = None


class PosteriorTable(Strict):
    """A fit whose posterior is drawn from: folder of a run, or a file in it."""

    fit: str
    widen: Positive = 1.0


class CriterionTable(Strict):
    """Bounds of an index, in `unit`."""

    at_most: float | None = None
    at_least: float | None = None
    unit: str | None = None


class CampaignFile(Strict):
    """A campaign."""

    title: str = ""
    ships: list[str]
    runs: int = Field(gt=0)
    manoeuvre: ManoeuvreTable | list[ManoeuvreTable]
    seed: int = Field(default=1, ge=0)
    design: Design = "random"
    chunk: int | None = Field(default=None, gt=0)
    tracks: TracksTable | None = None
    revolutions: Literal["ship", "balanced"] = "ship"
    weather: WeatherTable = WeatherTable()
    inputs: dict[str, InputTable] = Field(default_factory=dict)
    posterior: PosteriorTable | None = None
    criteria: dict[str, CriterionTable] = Field(default_factory=dict)
