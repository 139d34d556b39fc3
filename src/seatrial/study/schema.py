"""The keys of study files and of files of many fits, and their types."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from ..core.records import Limits, NotNegative, Positive, named
from ..core.values import dataclass, field

Open = Annotated[float, Limits(above=0.0, infinite=True)]
"""A standard deviation that may be infinite: no prior."""


USUAL = "shooting:Trajectory"
"""The estimator of a study that names none."""


@dataclass(frozen=True, kw_only=True)
class SmootherTable:
    """A Kalman smoother on the study's ship that gives the motion; noises in m and rad, walks per root second."""

    position: Positive
    heading: Positive
    antenna: tuple[float, float] = (0.0, 0.0)
    delay: NotNegative = 0.0
    current: NotNegative = 0.0
    process: dict[str, float] = field(default_factory=dict[str, float])
    parameters: dict[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True, kw_only=True)
class FolderTable:
    """A folder of recordings, their format, and the file of sets that names compositions of them."""

    root: str = "."
    sets: str | None = None
    format: str | None = None
    mapping: str | None = None


@dataclass(frozen=True, kw_only=True)
class DataSetTable(FolderTable):
    """Trials of one folder and format.

    `scale_to` brings them to the scale of the study's ship by Froude's law, `assumed` names controls that they lack.
    """

    train: list[str] = field(default_factory=list[str])
    validation: list[str] = field(default_factory=list[str])
    test: list[str] = field(default_factory=list[str])
    exclude: list[str] = field(default_factory=list[str])
    assumed: list[str] = field(default_factory=list[str])
    scale_to: Literal["ship"] | None = None
    smoother: SmootherTable | None = None


@dataclass(frozen=True, kw_only=True)
class DataTable(DataSetTable):
    """One folder, or several as [[data.set]]."""

    set: list[DataSetTable] = field(default_factory=list[DataSetTable])
    extrapolate: bool = False


@dataclass(frozen=True, kw_only=True)
class LossTable:
    sigma: dict[str, float] = field(default_factory=dict[str, float])
    correlation: NotNegative | None = None
    scale: Literal["noise", "spread"] = "noise"
    weights: dict[str, Positive] = field(default_factory=dict[str, float])


@dataclass(frozen=True, kw_only=True)
class NuisanceTable:
    initial: dict[str, Open] = field(default_factory=dict[str, float])
    current: NotNegative = 0.0
    bias: dict[str, float] = field(default_factory=dict[str, float])
    common: dict[str, Open] = field(default_factory=dict[str, float])
    suspects: Literal["", "auto"] = ""


@dataclass(frozen=True, kw_only=True)
class PublishedTable:
    """What a paper found, to stand beside: relative errors in per cent by velocity, R2 by azimuth."""

    source: str
    full: dict[Literal["u", "v_m", "r"], float] = field(default_factory=dict[Any, float])
    rival: dict[Literal["u", "v_m", "r"], float] = field(default_factory=dict[Any, float])
    R2: dict[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True, kw_only=True)
class ReportTable:
    restart: Positive | None = None
    unidentified: dict[str, str] = field(default_factory=dict[str, str])
    published: PublishedTable | None = None


@dataclass(frozen=True, kw_only=True)
class WindTable:
    speed: NotNegative = 0.0
    from_: float = named("from", 0.0)
    gusts: str = ""


@dataclass(frozen=True, kw_only=True)
class CurrentTable:
    speed: NotNegative = 0.0
    towards: float = 0.0


@dataclass(frozen=True, kw_only=True)
class BenchTable:
    """A bollard pull of each thruster of the truth: levels of revolutions, how often each, noise of the cell."""

    revolutions: Annotated[list[float], Limits(entries=2)]
    repeats: Annotated[int, Limits(least=1)] = 1
    noise: NotNegative = 0.0


@dataclass(frozen=True, kw_only=True)
class VirtualTrialTable:
    type: str
    rudder: float | None = None
    heading: float | None = None
    seed: int = 1
    revolutions: float | None = None
    speed: NotNegative | None = None
    duration: Positive | None = None
    current: CurrentTable | None = None
    set: dict[str, float | str] = field(default_factory=dict[str, float | str])


@dataclass(frozen=True, kw_only=True)
class VirtualTable:
    """Trials made rather than read; angles in degrees, the rest in SI units."""

    ship: str
    seed: Annotated[int, Limits(least=0)]
    duration: float = 600.0
    sample: float = 1.0
    step: float = 0.1
    speed: Positive | None = None
    orders: bool = True
    lag: dict[str, float] = field(default_factory=dict[str, float])
    noise: dict[str, float] = field(default_factory=dict[str, float])
    wind: WindTable = field(default_factory=WindTable)
    wind_force: dict[str, Any] = field(default_factory=dict[str, Any])
    current: CurrentTable = field(default_factory=CurrentTable)
    known: bool | list[Literal["wind", "current"]] = False
    bench: BenchTable | None = None
    trials: Annotated[dict[str, VirtualTrialTable], Limits(entries=1)]


@dataclass(frozen=True, kw_only=True)
class CaptiveTable:
    """Tables of captive tests that are fitted first, and whose coefficients are the priors of the fit to trials.

    `scatter` multiplies their sigmas: by how many of these the coefficients of captive and free tests differ.
    """

    tables: Annotated[list[str], Limits(entries=1)]
    mapping: str | None = None
    fit: list[str] = field(default_factory=list[str])
    scatter: Annotated[float, Limits(least=1.0)] = 1.0


@dataclass(frozen=True, kw_only=True)
class RivalTable:
    """A model with fewer parameters that is fitted beside: the rest stay as the ship file has them."""

    free: Annotated[list[str], Limits(entries=1)]


@dataclass(frozen=True, kw_only=True)
class StudyFile:
    """One study file without its schema; [free] and [estimator] are judged by those who know their names.

    [actuators] and [wind] are laid over those of the ship file, whose keys they have; the former has no free parameter.
    """

    title: str = ""
    ship: str
    data: DataTable
    actuators: dict[str, dict[str, Any]] = field(default_factory=dict[str, dict[str, Any]])
    wind: dict[str, Any] = field(default_factory=dict[str, Any])
    captive: CaptiveTable | None = None
    free: dict[str, Any] = field(default_factory=dict[str, Any])
    loss: LossTable = field(default_factory=LossTable)
    nuisance: NuisanceTable = field(default_factory=NuisanceTable)
    estimator: dict[str, Any] = field(default_factory=lambda: {"type": USUAL})
    report: ReportTable = field(default_factory=ReportTable)
    virtual: VirtualTable | None = None
    rival: RivalTable | None = None


@dataclass(frozen=True, kw_only=True)
class TrialsTable(FolderTable):
    """Where the trials are, and which are kept apart from every fit; labels of `test` are the rows of the table."""

    test: Annotated[dict[str, str], Limits(entries=1)]
    validation: dict[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True, kw_only=True)
class FitTable:
    """One model; what it does not say is that of the fit named in `like`."""

    title: str = ""
    like: str = ""
    ship: str = ""
    train: list[str] = field(default_factory=list[str])
    exclude: list[str] = field(default_factory=list[str])
    validation: list[str] | None = None
    free: dict[str, Any] = field(default_factory=dict[str, Any])
    loss: LossTable | None = None
    nuisance: NuisanceTable = field(default_factory=NuisanceTable)
    estimator: dict[str, Any] = field(default_factory=dict[str, Any])
    seeds: list[int] | None = None
    published: str = ""


@dataclass(frozen=True, kw_only=True)
class Claim:
    """An expected order: the error of `worse` is at least `factor` times that of `better` in every row.

    1 asks for better or equal, 10 for ten times better, 0.9 for no worse than by a margin (1/0.9, eleven per cent).
    """

    says: str
    better: str
    worse: str
    rows: Annotated[tuple[str, ...], Limits(entries=1)]
    factor: Positive = 1.0


@dataclass(frozen=True, kw_only=True)
class BudgetTable:
    """Another size of the same: which fits, their seeds, and settings that replace those of an estimator by type."""

    fits: list[str] = field(default_factory=list[str])
    seeds: list[int] | None = None
    settings: dict[str, dict[str, Any]] = field(default_factory=dict[str, dict[str, Any]])


@dataclass(frozen=True, kw_only=True)
class Published:
    """What a publication prints: results by column, then by row, the mean and the standard deviation over its seeds.

    `settings` are those of its estimator, of all columns ("all") and of each; `seconds` by composition and kind;
    `tests` the recordings of its rows, `evaluation` how it predicts them; `why` says, by the name of what differs,
    why ours does.
    """

    source: str
    note: str = ""
    rows: dict[str, dict[str, tuple[float, ...]]] = field(default_factory=dict[str, dict[str, tuple[float, ...]]])
    settings: dict[str, dict[str, Any]] = field(default_factory=dict[str, dict[str, Any]])
    seconds: dict[str, dict[str, float]] = field(default_factory=dict[str, dict[str, float]])
    evaluation: dict[str, str] = field(default_factory=dict[str, str])
    tests: dict[str, str] = field(default_factory=dict[str, str])
    why: dict[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True, kw_only=True)
class SeriesReportTable:
    restart: Positive | None = None
    sigma: dict[str, float] = field(default_factory=dict[str, float])
    draw: list[str] = field(default_factory=list[str])
    seeds: list[str] = field(default_factory=list[str])
    tracks: list[str] = field(default_factory=list[str])
    curves: dict[str, list[str]] = field(default_factory=dict[str, list[str]])


@dataclass(frozen=True, kw_only=True)
class SeriesFile:
    """One file of many fits."""

    title: str = ""
    about: str = ""
    seeds: Annotated[list[int], Limits(entries=1)] = field(default_factory=lambda: [0])
    data: TrialsTable
    loss: LossTable = field(default_factory=LossTable)
    fits: Annotated[dict[str, FitTable], Limits(entries=1)]
    claims: list[Claim] = field(default_factory=list[Claim])
    budgets: dict[str, BudgetTable] = field(default_factory=dict[str, BudgetTable])
    published: Published | str | None = None
    report: SeriesReportTable = field(default_factory=SeriesReportTable)
