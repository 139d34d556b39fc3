"""The keys of the mapping file of an NMEA log, for pydantic; imported only when one is read."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ...core.parameters import unknown
from .. import DataError
from ..documents import read_toml


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class Antenna(_Strict):
    """Where the antenna is, from midship [m]."""

    forward: float = 0.0
    starboard: float = 0.0


class Log(_Strict):
    """Where the speed log is, from midship [m]."""

    forward: float = 0.0


class DatumPoint(_Strict):
    """Where x and y are zero [deg]."""

    latitude: float = Field(ge=-89, le=89)
    longitude: float = Field(ge=-180, le=180)


class NmeaFile(_Strict):
    """The whole file."""

    schema_: Literal["seatrial-nmea/1"] = Field(alias="schema")
    antenna: Antenna = Antenna()
    log: Log = Log()
    datum: DatumPoint | None = None
    ship: str | None = None
    scale: float | None = Field(default=None, gt=0)
    L_pp: float | None = Field(default=None, gt=0)
    kind: str | None = None
    source: str | None = None
    licence: str | None = None
    water_density: float | None = Field(default=None, gt=0)


_INNER: dict[str, type[BaseModel]] = {"antenna": Antenna, "log": Log, "datum": DatumPoint}


def checked(path: Path) -> dict[str, Any]:
    """The file as plain values with the defaults filled in.

    Raises:
        DataError: not TOML, an unknown key (the near ones are named), a wrong type.
    """
    here, said = Path(path), read_toml(path)
    try:
        return NmeaFile.model_validate(said).model_dump()
    except ValidationError as error:
        first = error.errors()[0]
        place = [str(part) for part in first["loc"]]
        if first["type"] == "extra_forbidden":
            fields = _INNER[place[0]].model_fields if len(place) > 1 else NmeaFile.model_fields
            known = [entry.alias or name for name, entry in fields.items()]
            raise DataError(f"{here}: {unknown('.'.join(place), known, 'key')}") from None
        raise DataError(f"{here}: {'.'.join(place)}: {first['msg'][0].lower()}{first['msg'][1:]}") from None
