"""The keys of a file of many fits and their types; imported only when one is read."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from .study_schema import LossTable, NuisanceTable


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=False)


class TrialsTable(_Table):
    """Where the trials are, and which are kept apart from every fit; labels of `test` are the rows of the table."""

    root: str = "."
    sets: str | None = None
    format: str | None = None
    mapping: str | None = None
    test: dict[str, str] = Field(min_length=1)
    validation: dict[str, str] = {}


class FitTable(_Table):
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


class ClaimTable(_Table):
    """An order that is expected: the error of `worse` over that of `better` is at least `factor` in every row.

    1 asks for better or equal, 10 for ten times better, 0.9 for no worse than by a margin (1/0.9, eleven per cent).
    """

    says: str
    better: str
    worse: str
    rows: list[str] = Field(min_length=1)
    factor: float = Field(default=1.0, gt=0.0)


class BudgetTable(_Table):
    """Another size of the same: which fits, their seeds, and settings that replace those of an estimator by type."""

    fits: list[str] = []
    seeds: list[int] | None = None
    settings: dict[str, dict[str, Any]] = {}


class PublishedTable(_Table):
    """What a paper found: by column, then by row, the mean and the standard deviation over its seeds."""

    source: str
    note: str = ""
    rows: dict[str, dict[str, list[float]]] = {}


class ReportTable(_Table):
    restart: float | None = Field(default=None, gt=0.0)
    sigma: dict[str, float] = {}
    draw: list[str] = []
    seeds: list[str] = []
    tracks: list[str] = []


class SeriesFile(_Table):
    """One file of many fits."""

    schema_: str = Field(alias="schema")
    title: str = ""
    about: str = ""
    seeds: list[int] = Field(default=[0], min_length=1)
    data: TrialsTable
    loss: LossTable = LossTable()
    fits: dict[str, FitTable] = Field(min_length=1)
    claims: list[ClaimTable] = []
    budgets: dict[str, BudgetTable] = {}
    published: PublishedTable | None = None
    report: ReportTable = ReportTable()
