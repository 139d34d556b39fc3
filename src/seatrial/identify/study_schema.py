"""The keys of a study file and their types; imported only when one is read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=False)


class DataSetTable(_Table):
    """Trials of one folder and format; `scale_to` brings them to the scale of the study's ship by Froude's law."""

    root: str = "."
    format: str | None = None
    mapping: str | None = None
    train: list[str] = []
    validation: list[str] = []
    test: list[str] = []
    exclude: list[str] = []
    scale_to: Literal["ship"] | None = None


class DataTable(DataSetTable):
    """One folder, or several as [[data.set]]."""

    set: list[DataSetTable] = []
    extrapolate: bool = False


class LossTable(_Table):
    sigma: dict[str, float] = {}
    correlation: float = Field(default=5.0, ge=0.0)


class NuisanceTable(_Table):
    initial: dict[str, float] = {}
    current: float = Field(default=0.0, ge=0.0)
    bias: dict[str, float] = {}


class ReportTable(_Table):
    restart: float | None = Field(default=None, gt=0.0)


class WindTable(_Table):
    speed: float = Field(default=0.0, ge=0.0)
    from_: float = Field(default=0.0, alias="from")
    gusts: str = ""


class VirtualTrialTable(_Table):
    type: str
    rudder: float | None = None
    heading: float | None = None
    seed: int = 1


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
    trials: dict[str, VirtualTrialTable] = Field(min_length=1)


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

    @classmethod
    def keys(cls, place: Sequence[int | str]) -> list[str]:
        """Known keys of the table at `place`."""
        table: Any = cls
        for key in place:
            # Below a table of tables, whatever the name; within one that may be left out, the table itself.
            table = table.model_fields[str(key)].annotation if hasattr(table, "model_fields") else get_args(table)[-1]
            table = next((one for one in get_args(table) if hasattr(one, "model_fields")), table) \
                if type(None) in get_args(table) else table
        return [f.alias or name for name, f in table.model_fields.items()]
