"""Any table of numbers as a trial, by a mapping file, `seatrial-mapping/1`.

The file says which column is which channel, in which unit, with which sign and offset:

    schema = "seatrial-mapping/1"
    time = { column = "Time", unit = "s" }
    frame = { velocity = "earth" }
    [channels.psi]
    column = "HDG"
    unit = "deg"

A channel is `sign * column + offset`, both in the unit of the column, and then SI.  With ``velocity = "earth"``
the columns of `u` and `v_m` hold the velocities north and east and are turned into body axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.parameters import unknown
from .. import UNITS, Array, DataError, Trial, unwrapped
from ..documents import read_toml
from ..prepare import to_body
from ..sidecar import CONVENTIONS, check_meta
from ..table import check_time, continued, lines_of, numbers, once, split_row
from ..units import conversion, standard_unit

if TYPE_CHECKING:
    from pydantic import ValidationError

_META = ("ship", "scale", "L_pp", "kind", "source", "licence", "water_density")


@dataclass(frozen=True)
class Column:
    """Where a channel comes from: `(sign * column + offset) * unit`, the offset in the unit of the column."""

    column: str
    unit: str
    sign: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Mapping:
    """A mapping file, checked.

    Attributes:
        time: the column of time.
        channels: columns of the channels, by channel.
        velocity: "body" or "earth", the axes of the columns of u and v_m.
        delimiter: what separates cells; None for white space.
        skip: lines before the header.
        encoding: of the text.
        meta: what goes into the sidecar.
    """

    time: Column
    channels: dict[str, Column]
    velocity: str
    delimiter: str | None
    skip: int
    encoding: str
    meta: dict[str, Any]


def read_mapping(path: str | Path) -> Mapping:
    """Read and check a mapping file.

    Raises:
        DataError: not TOML, an unknown key (the near ones are named), a wrong type or unit.
    """
    here = Path(path)
    checked = _validated(here, read_toml(here))
    channels = {name: Column(**value) for name, value in checked["channels"].items()}
    for name, column in channels.items():
        _check_channel(here, name, column)
    time = Column(**checked["time"])
    _check_unit(here, "t", time.unit)
    velocity = checked["frame"]["velocity"]
    if velocity == "earth" and not {"u", "v_m", "psi"} <= set(channels):
        raise DataError(f'{here}: frame.velocity = "earth" needs channels u (north), v_m (east) and psi')
    separator = checked["delimiter"]
    meta = {k: checked[k] for k in _META if checked[k] is not None}
    check_meta(Path(path), meta)
    return Mapping(
        time, channels, velocity, None if separator == "whitespace" else separator,
        checked["skip"], checked["encoding"], meta,
    )  # fmt: skip


def read(path: str | Path, mapping: Mapping) -> Trial:
    """Read one log by a mapping.

    Raises:
        DataError: naming file, column and line.
    """
    here = Path(path)
    lines = lines_of(here, mapping.encoding)
    if len(lines) <= mapping.skip:
        raise DataError(f"{here}: {len(lines)} lines, and the mapping skips {mapping.skip}")
    heads = split_row(lines[mapping.skip], mapping.delimiter)
    for column in (mapping.time, *mapping.channels.values()):
        if column.column not in heads:
            raise DataError(f"{here}: line {mapping.skip + 1}: {unknown(column.column, heads, 'column')}")
    once(here, mapping.skip + 1, heads, [column.column for column in (mapping.time, *mapping.channels.values())])
    wanted = {"t": mapping.time, **mapping.channels}
    index = {name: heads.index(column.column) for name, column in wanted.items()}
    table, numbered = _wanted_numbers(here, lines, mapping, heads, sorted(set(index.values())))
    table, added = continued(table, index["t"])
    values = {name: _si(name, column, table[:, index[name]]) for name, column in wanted.items()}
    t = values.pop("t")
    check_time(here, mapping.time.column, t, numbered)
    units = {name: conversion(name, c.unit)[0] for name, c in mapping.channels.items() if name not in UNITS}
    steps = [f"imported by a mapping: {len(values)} of {len(heads)} columns"]
    steps += [f"{n}: sign turned" for n, c in mapping.channels.items() if c.sign == -1.0]
    if "psi" in values:
        values["psi"] = unwrapped(values["psi"])
        steps.append("psi made continuous")
    if mapping.velocity == "earth":
        values["u"], values["v_m"] = to_body(values["u"], values["v_m"], values["psi"])
        steps.append("u, v_m turned from earth axes into body axes by psi")
    if added:
        steps.append(f"time continued over {added} empty rows at the end")
    return Trial(here.stem, t, values, units, {**CONVENTIONS, **mapping.meta, "processing": steps})


def _wanted_numbers(
    path: Path, lines: Sequence[str], mapping: Mapping, heads: list[str], wanted: list[int]
) -> tuple[Array, list[int]]:
    """Like `numbers`, but only the wanted columns need to be numbers; the others become NaN."""
    reduced = list(lines)
    comma = mapping.delimiter or " "
    for k in range(mapping.skip + 1, len(lines)):
        cells = split_row(lines[k], mapping.delimiter)
        if len(cells) == len(heads):
            reduced[k] = comma.join(cells[c] for c in wanted)
        elif lines[k].strip():
            raise DataError(f"{path}: line {k + 1} has {len(cells)} cells, the header has {len(heads)}")
    names = [heads[c] for c in wanted]
    part, numbered = numbers(path, reduced, mapping.skip + 1, names, mapping.delimiter)
    table = np.full((len(part), len(heads)), np.nan)
    table[:, wanted] = part
    return table, numbered


def _si(name: str, column: Column, raw: Array) -> Array:
    factor = conversion(name, column.unit)[1]
    return raw * (column.sign * factor) + column.offset * factor


def _check_channel(path: Path, name: str, column: Column) -> None:
    if name == "t":
        raise DataError(f"{path}: channels.t: time has a table of its own, 'time'")
    if not name.isidentifier():
        raise DataError(f"{path}: channels.{name}: a channel name is letters, digits and underscores")
    near = unknown(name, UNITS, "channel")
    if standard_unit(name) is None and "near:" in near:
        # a typing error would silently make a channel that nobody reads
        raise DataError(f"{path}: channels.{name}: {near}")
    if column.sign not in (1.0, -1.0):
        raise DataError(f"{path}: channels.{name}.sign is {column.sign:g}; it must be 1 or -1")
    if not math.isfinite(column.offset):
        raise DataError(f"{path}: channels.{name}.offset is {column.offset}; it must be finite")
    _check_unit(path, name, column.unit)


def _check_unit(path: Path, name: str, unit: str) -> None:
    try:
        conversion(name, unit)
    except DataError as error:
        raise DataError(f"{path}: {error}") from None


def _validated(path: Path, said: dict[str, Any]) -> dict[str, Any]:
    """The file as plain values with the defaults filled in, by pydantic."""
    from pydantic import ValidationError

    from .mapping_schema import MappingFile

    try:
        return MappingFile.model_validate(said).model_dump()
    except ValidationError as error:
        raise DataError(f"{path}: {_told(error)}") from None


def _told(error: ValidationError) -> str:
    """First complaint of pydantic as one line, with the near keys for an unknown one."""
    from .mapping_schema import keys_at

    first = error.errors()[0]
    place = [str(part) for part in first["loc"]]
    if first["type"] == "extra_forbidden":
        inside = ".".join(place[:-1])
        return (f"{inside}: " if inside else "") + unknown(place[-1], keys_at(place[:-1]), "key")
    if first["type"] == "missing":
        return f"{'.'.join(place)} is missing"
    return f"{'.'.join(place)}: {first['msg'][0].lower()}{first['msg'][1:]} (it is {first['input']!r})"
