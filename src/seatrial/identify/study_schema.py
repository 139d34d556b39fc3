"""The keys of a study file and their types; imported only when one is read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=False)


class DataTable(_Table):
    root: str = "."
    format: str | None = None
    mapping: str | None = None
    train: list[str] = Field(min_length=1)
    validation: list[str] = []
    test: list[str] = []
    exclude: list[str] = []


class LossTable(_Table):
    sigma: dict[str, float] = {}
    correlation: float = Field(default=5.0, ge=0.0)


class NuisanceTable(_Table):
    initial: dict[str, float] = {}
    current: float = Field(default=0.0, ge=0.0)
    bias: dict[str, float] = {}


class ReportTable(_Table):
    restart: float | None = Field(default=None, gt=0.0)


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

    @classmethod
    def keys(cls, place: Sequence[int | str]) -> list[str]:
        """Known keys of the table at `place`."""
        table: Any = cls
        for key in place:
            table = table.model_fields[str(key)].annotation
        return [f.alias or name for name, f in table.model_fields.items()]
