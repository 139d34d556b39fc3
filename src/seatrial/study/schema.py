"""The keys of study files and of files of many fits, and their types."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..core.parameters import unknown
from ..identify import StudyError

_Model = TypeVar("_Model", bound=BaseModel)
_SHOWN = 80
"""Longest text of a document that a message repeats."""
_TABLES, _TABLE = ("model_type", "dict_type"), "Input should be a table"
"""What Pydantic calls a valid dictionary or instance of a class."""


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
    """Known keys of the table at `place` of a document, of each kind of table that may stand there."""
    options: list[Any] = [schema]
    for key in place:
        options = [one for option in options for one in _members(_below(option, key))]
    tables = [option for option in options if hasattr(option, "model_fields")]
    return list(dict.fromkeys(f.alias or name for table in tables for name, f in table.model_fields.items()))


def _below(option: Any, key: int | str) -> Any:
    """Type of what stands under a key of a table, or at a place of a list; None where nothing does."""
    if hasattr(option, "model_fields"):
        found = [f.annotation for name, f in option.model_fields.items() if key in (name, f.alias)]
        return found[0] if found else None
    inner = [one for one in get_args(option) if one is not Ellipsis]
    if get_origin(option) is tuple and isinstance(key, int):
        return inner[min(key, len(inner) - 1)]
    return inner[-1] if inner else None


def _members(option: Any) -> list[Any]:
    """The types that a union joins, without their constraints."""
    if get_origin(option) is Annotated:
        return _members(get_args(option)[0])
    if get_origin(option) in (Union, UnionType):
        return [one for member in get_args(option) for one in _members(member)]
    return [option]


def _place(document: Any, found: Any) -> tuple[int | str, ...]:
    """Where an error of Pydantic is in the document, without the names of the types that it tried there."""
    place: list[int | str] = []
    for part in found["loc"]:
        here = isinstance(document, dict) and part in document
        if here or (isinstance(document, list) and isinstance(part, int) and part < len(document)):
            document = document[part]
            place.append(part)
    return (*place, found["loc"][-1]) if found["type"] == "missing" else tuple(place)


def checked(path: Path, schema: type[_Model], document: Any) -> _Model:
    """The document with its keys and types checked.

    Raises:
        StudyError: the first thing wrong in it, in one line.
    """
    try:
        return schema.model_validate(document)
    except ValidationError as error:
        found = [(_place(document, one), one) for one in error.errors()]
    # An unknown key first: it may be the one that is missing, misspelt.  Then the deepest: of several kinds of table
    # or list that may stand somewhere, the one that is there has been tried farthest.
    place, first = max(found, key=lambda one: (one[1]["type"] == "extra_forbidden", len(one[0])))
    *above, last = place or ("document",)
    if first["type"] == "extra_forbidden":
        wrong = f": {unknown(_short(str(last)), known_keys(schema, above), 'key')}"
    elif first["type"] == "missing":
        wrong = " is missing"
    else:
        told = [_TABLE if one["type"] in _TABLES else one["msg"] for at, one in found if at == place]
        why = " or ".join(dict.fromkeys(told))
        wrong = f" is {_short(repr(first['input']))}: {why}"
    raise StudyError(f"{path}: {'.'.join(_short(str(part)) for part in (*above, last))}{wrong}")


def _short(text: str) -> str:
    """A text of the document, on one line of moderate length."""
    line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    return line if len(line) <= _SHOWN else f"{line[:_SHOWN]}..."
