"""The keys of study files and of files of many fits, and their types."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..core.parameters import unknown
from ..identify import StudyError

_Model = TypeVar("_Model", bound=BaseModel)


class Strict(BaseModel):
    """A table of a file: unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class SmootherTable(Strict):
    """A Kalman smoother on the study's ship that gives the motion; noises in m and rad, walks per root second."""

    position: float = Field(gt=0.0)
    heading: float = Field(gt=0.0)
    antenna: tuple[float, float] = (0.0, 0.0)
    delay: float = Field(default=0.0, ge=0.0)
    current: float = Field(default=0.0, ge=0.0)
    process: dict[str, float] = {}
    parameters: dict[str, float] = {}


class FolderTable(Strict):
    """A folder of recordings, their format, and the file of sets that names compositions of them."""

    root: str = "."
    sets: str | None = None
    format: str | None = None
    mapping: str | None = None


class DataSetTable(FolderTable):
    """Trials of one folder and format; `scale_to` brings them to the scale of the study's ship by Froude's law."""

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


class LossTable(Strict):
    sigma: dict[str, float] = {}
    correlation: float | None = Field(default=None, ge=0.0)
    scale: Literal["noise", "spread"] = "noise"
    weights: dict[str, Annotated[float, Field(gt=0.0)]] = {}


class NuisanceTable(Strict):
    initial: dict[str, float] = {}
    current: float = Field(default=0.0, ge=0.0)
    bias: dict[str, float] = {}
    common: dict[str, Annotated[float, Field(gt=0.0)]] = {}
    suspects: Literal["", "auto"] = ""


class PublishedTable(Strict):
    """What a paper found, to stand beside: relative errors in per cent by velocity, R2 by azimuth."""

    source: str
    full: dict[Literal["u", "v_m", "r"], float] = {}
    rival: dict[Literal["u", "v_m", "r"], float] = {}
    R2: dict[str, float] = {}


class ReportTable(Strict):
    restart: float | None = Field(default=None, gt=0.0)
    unidentified: dict[str, str] = {}
    published: PublishedTable | None = None


class WindTable(Strict):
    speed: float = Field(default=0.0, ge=0.0)
    from_: float = Field(default=0.0, alias="from")
    gusts: str = ""


class CurrentTable(Strict):
    speed: float = Field(default=0.0, ge=0.0)
    towards: float = 0.0


class BenchTable(Strict):
    """A bollard pull of each thruster of the truth: levels of revolutions, how often each, noise of the cell."""

    revolutions: list[float] = Field(min_length=2)
    repeats: int = Field(default=1, ge=1)
    noise: float = Field(default=0.0, ge=0.0)


class VirtualTrialTable(Strict):
    type: str
    rudder: float | None = None
    heading: float | None = None
    seed: int = 1
    revolutions: float | None = None
    speed: float | None = Field(default=None, ge=0.0)
    duration: float | None = Field(default=None, gt=0.0)
    current: CurrentTable | None = None
    set: dict[str, float | str] = {}


class VirtualTable(Strict):
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


class RivalTable(Strict):
    """A model with fewer parameters that is fitted beside: the rest stay as the ship file has them."""

    free: list[str] = Field(min_length=1)


class StudyFile(Strict):
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


class TrialsTable(FolderTable):
    """Where the trials are, and which are kept apart from every fit; labels of `test` are the rows of the table."""

    test: dict[str, str] = Field(min_length=1)
    validation: dict[str, str] = {}


class FitTable(Strict):
    """One model; what it does not say is that of the fit named in `like`."""

    title: str = ""
    like: str = ""
    ship: str = ""
    train: list[str] = []
    exclude: list[str] = []
    validation: list[str] | None = None
    free: dict[str, Any] = {}
    loss: LossTable | None = None
    nuisance: NuisanceTable = NuisanceTable()
    estimator: dict[str, Any] = {}
    seeds: list[int] | None = None
    published: str = ""


class Claim(Strict):
    """An expected order: the error of `worse` is at least `factor` times that of `better` in every row.

    1 asks for better or equal, 10 for ten times better, 0.9 for no worse than by a margin (1/0.9, eleven per cent).
    """

    says: str
    better: str
    worse: str
    rows: tuple[str, ...] = Field(min_length=1)
    factor: float = Field(default=1.0, gt=0.0)


class BudgetTable(Strict):
    """Another size of the same: which fits, their seeds, and settings that replace those of an estimator by type."""

    fits: list[str] = []
    seeds: list[int] | None = None
    settings: dict[str, dict[str, Any]] = {}


class Published(Strict):
    """What a publication prints: results by column, then by row, the mean and the standard deviation over its seeds.

    `settings` are those of its estimator, of all columns ("all") and of each; `seconds` by composition and kind;
    `tests` the recordings of its rows, `evaluation` how it predicts them; `why` says, by the name of what differs,
    why ours does.
    """

    source: str
    note: str = ""
    rows: dict[str, dict[str, tuple[float, ...]]] = {}
    settings: dict[str, dict[str, Any]] = {}
    seconds: dict[str, dict[str, float]] = {}
    evaluation: dict[str, str] = {}
    tests: dict[str, str] = {}
    why: dict[str, str] = {}


class SeriesReportTable(Strict):
    restart: float | None = Field(default=None, gt=0.0)
    sigma: dict[str, float] = {}
    draw: list[str] = []
    seeds: list[str] = []
    tracks: list[str] = []
    curves: dict[str, list[str]] = {}


class SeriesFile(Strict):
    """One file of many fits."""

    schema_: str = Field(alias="schema")
    title: str = ""
    about: str = ""
    seeds: list[int] = Field(default=[0], min_length=1)
    data: TrialsTable
    loss: LossTable = LossTable()
    fits: dict[str, FitTable] = Field(min_length=1)
    claims: list[Claim] = []
    budgets: dict[str, BudgetTable] = {}
    published: Published | str | None = None
    report: SeriesReportTable = SeriesReportTable()


def known_keys(schema: Any, place: Sequence[int | str]) -> list[str]:
    """Known keys of the table at `place` of a document."""
    table = schema
    for key in place:
        # Below a table of tables, whatever the name; within one that may be left out, the table itself.
        table = table.model_fields[str(key)].annotation if hasattr(table, "model_fields") else get_args(table)[-1]
        table = next((one for one in get_args(table) if hasattr(one, "model_fields")), table) \
            if type(None) in get_args(table) else table
    return [f.alias or name for name, f in table.model_fields.items()]


def checked(path: Path, schema: type[_Model], document: Any) -> _Model:
    """The document with its keys and types checked.

    Raises:
        StudyError: the first thing wrong in it, in one line.
    """
    try:
        return schema.model_validate(document)
    except ValidationError as error:
        found = error.errors()  # an unknown key first: it may be the one that is missing, misspelt
        first = next((one for one in found if one["type"] == "extra_forbidden"), found[0])
    key = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        known = known_keys(schema, first["loc"][:-1])
        raise StudyError(f"{path}: {key}: {unknown(str(first['loc'][-1]), known, 'key')}")
    what = "is missing" if first["type"] == "missing" else f"is {first['input']!r}: {first['msg']}"
    raise StudyError(f"{path}: {key} {what}")
