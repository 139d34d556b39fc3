"""The keys of a mapping file, for pydantic; imported only when one is read."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class TimeColumn(_Strict):
    """The column of time."""

    column: str
    unit: str
    offset: float = 0.0


class ChannelColumn(_Strict):
    """The column of a channel."""

    column: str
    unit: str
    sign: float = 1.0
    offset: float = 0.0


class Frame(_Strict):
    """The axes of the velocities."""

    velocity: Literal["body", "earth"] = "body"


class MappingFile(_Strict):
    """The whole file."""

    schema_: Literal["seatrial-mapping/1"] = Field(alias="schema")
    time: TimeColumn
    frame: Frame = Frame()
    channels: dict[str, ChannelColumn] = Field(min_length=1)
    delimiter: str = Field(default=",", min_length=1)
    skip: int = Field(default=0, ge=0)
    encoding: str = "utf-8-sig"
    ship: str | None = None
    scale: float | None = Field(default=None, gt=0)
    L_pp: float | None = Field(default=None, gt=0)
    kind: str | None = None
    source: str | None = None
    licence: str | None = None
    water_density: float | None = Field(default=None, gt=0)


def keys_at(place: list[str]) -> list[str]:
    """Keys that may stand at a place of the file."""
    if not place:
        return [field.alias or name for name, field in MappingFile.model_fields.items()]
    inner = {"time": TimeColumn, "frame": Frame}.get(place[0], ChannelColumn)
    return list(inner.model_fields)
