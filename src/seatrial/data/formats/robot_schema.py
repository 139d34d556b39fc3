"""The mapping file of a robot's log."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ...core.parameters import unknown
from .. import DataError
from ..documents import read_toml
from ..geodesy import Datum
from ..sidecar import check_meta
from ..units import conversion
from .robot_log import Topics


class _Place(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    latitude: float
    longitude: float


class _Number(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    channel: str
    unit: str | None = None
    sign: Literal[-1, 1] = 1


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    schema_: Literal["seatrial-robot/1"] = Field(alias="schema")
    odometry: str | None = None
    twist: str | None = None
    fix: str | None = None
    datum: _Place | None = None
    numbers: dict[str, _Number] = {}
    ship: str | None = None
    L_pp: float | None = Field(default=None, gt=0.0)


def read_topics(path: Path) -> Topics:
    """Read a mapping file.

    Raises:
        DataError: not TOML, an unknown key, a wrong type or unit.
    """
    try:
        said = _File.model_validate(read_toml(path))
    except ValidationError as error:
        raise DataError(f"{path}: {_first(error)}") from None
    numbers: dict[str, tuple[str, float]] = {}
    for topic, one in said.numbers.items():
        factor = 1.0
        if one.unit is not None:
            try:
                factor = conversion(one.channel, one.unit)[1]
            except DataError as wrong:
                raise DataError(f"{path}: numbers, {topic}: {wrong}") from None
        numbers[topic] = one.channel, one.sign * factor
    datum = None if said.datum is None else Datum(said.datum.latitude, said.datum.longitude)
    meta = {name: value for name, value in (("ship", said.ship), ("L_pp", said.L_pp)) if value is not None}
    check_meta(path, meta)
    return Topics(said.odometry, said.twist, said.fix, numbers, datum, meta)


def _first(error: ValidationError) -> str:
    """What is wrong first, in a line."""
    one = error.errors()[0]
    where = ".".join(map(str, one["loc"])) or "file"
    if one["type"] == "extra_forbidden":
        known = [field.alias or name for name, field in _File.model_fields.items()]
        return unknown(where, known, "key") if len(one["loc"]) == 1 else f"{where}: no such key"
    return f"{where}: {one['msg']}"
