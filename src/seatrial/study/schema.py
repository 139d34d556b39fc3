"""The keys of a study file and their types; imported only when one is read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..core.parameters import unknown
from ..identify import StudyError


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=False)


class SmootherTable(_Table):
    """A Kalman smoother on the study's ship that gives the motion; noises in m and rad, walks per root second."""

    position: float = Field(gt=0.0)
    heading: float = Field(gt=0.0)
    antenna: tuple[float, float] = (0.0, 0.0)
    delay: float = Field(default=0.0, ge=0.0)
    current: float = Field(default=0.0, ge=0.0)
    process: dict[str, float] = {}
    parameters: dict[str, float] = {}


class DataSetTable(_Table):
    """Trials of one folder and format; `scale_to` brings them to the scale of the study's ship by Froude's law."""

    root: str = "."
    sets: str | None = None
    format: str | None = None
    mapping: str | None = None
    train: list[str] = []
    validation: list[str] = []
    test: list[str] = []
    exclude: list[str] = []
    scale_to: Literal["ship"] | None = None
    smoother: SmootherTable | None = None


class DataTable(DataSetTable):
    """One folder, or several as [[data.set]]."""

    set: list[DataSetTable] = []
    extrapolate: bool = False


class LossTable(_Table):
    sigma: dict[str, float] = {}
    correlation: float | None = Field(default=None, ge=0.0)
    scale: Literal["noise", "spread"] = "noise"
    weights: dict[str, Annotated[float, Field(gt=0.0)]] = {}


class NuisanceTable(_Table):
    initial: dict[str, float] = {}
    current: float = Field(default=0.0, ge=0.0)
    bias: dict[str, float] = {}
    common: dict[str, Annotated[float, Field(gt=0.0)]] = {}
    suspects: Literal["", "auto"] = ""


class PublishedTable(_Table):
    """What a paper found, to stand beside: relative errors in per cent by velocity, R2 by azimuth."""

    source: str
    full: dict[Literal["u", "v_m", "r"], float] = {}
    rival: dict[Literal["u", "v_m", "r"], float] = {}
    R2: dict[str, float] = {}


class ReportTable(_Table):
    restart: float | None = Field(default=None, gt=0.0)
    unidentified: dict[str, str] = {}
    published: PublishedTable | None = None


class WindTable(_Table):
    speed: float = Field(default=0.0, ge=0.0)
    from_: float = Field(default=0.0, alias="from")
    gusts: str = ""


class CurrentTable(_Table):
    speed: float = Field(default=0.0, ge=0.0)
    towards: float = 0.0


class BenchTable(_Table):
    """A bollard pull of each thruster of the truth: levels of revolutions, how often each, noise of the cell."""

    revolutions: list[float] = Field(min_length=2)
    repeats: int = Field(default=1, ge=1)
    noise: float = Field(default=0.0, ge=0.0)


class VirtualTrialTable(_Table):
    type: str
    rudder: float | None = None
    heading: float | None = None
    seed: int = 1
    revolutions: float | None = None
    speed: float | None = Field(default=None, ge=0.0)
    duration: float | None = Field(default=None, gt=0.0)
    current: CurrentTable | None = None
    set: dict[str, float | str] = {}


class VirtualTable(_Table):
    """Trials made rather than read; angles in degrees, the rest in SI units."""

    ship: str
    seed: int = Field(ge=0)
    duration: float = 600.0
    sample: float = 1.0
    step: float = 0.1
    speed: float | None = Field(default=None, gt=0.0)
    orders: bool = True
    lag: dict[str, float] = {}
    noise: dict[str, float] = {}
    wind: WindTable = WindTable()
    wind_force: dict[str, Any] = {}
    current: CurrentTable = CurrentTable()
    known: bool | list[Literal["wind", "current"]] = False
    bench: BenchTable | None = None
    trials: dict[str, VirtualTrialTable] = Field(min_length=1)


class RivalTable(_Table):
    """A model with fewer parameters that is fitted beside: the rest stay as the ship file has them."""

    free: list[str] = Field(min_length=1)


class StudyFile(_Table):
    """One study file; [free] and [estimator] are judged by those who know their names."""

    schema_: str = Field(alias="schema")
    title: str = ""
    ship: str
    data: DataTable
    free: dict[str, Any] = {}
    loss: LossTable = LossTable()
    nuisance: NuisanceTable = NuisanceTable()
    estimator: dict[str, Any] = {"type": "shooting:Trajectory"}
    report: ReportTable = ReportTable()
    virtual: VirtualTable | None = None
    rival: RivalTable | None = None


def known_keys(schema: Any, place: Sequence[int | str]) -> list[str]:
    """Known keys of the table at `place` of a document."""
    table = schema
    for key in place:
        # Below a table of tables, whatever the name; within one that may be left out, the table itself.
        table = table.model_fields[str(key)].annotation if hasattr(table, "model_fields") else get_args(table)[-1]
        table = next((one for one in get_args(table) if hasattr(one, "model_fields")), table) \
            if type(None) in get_args(table) else table
    return [f.alias or name for name, f in table.model_fields.items()]


def told(path: Path, schema: Any, error: ValidationError) -> StudyError:
    """The first thing wrong in a document, in one line."""
    first = error.errors()[0]
    key = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        known = known_keys(schema, first["loc"][:-1])
        return StudyError(f"{path}: {key}: {unknown(str(first['loc'][-1]), known, 'key')}")
    said = "is missing" if first["type"] == "missing" else f"is {first['input']!r}: {first['msg']}"
    return StudyError(f"{path}: {key} {said}")
