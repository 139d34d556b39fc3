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

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from ...core.parameters import unknown
from .. import UNITS, Array, DataError, Trial, unwrapped
from ..prepare import to_body
from ..sidecar import CONVENTIONS, Described, read_described
from ..table import check_time, continued, lines_of, numbers, once, split_row, within
from ..units import conversion, of_thruster, standard_unit

name = "csv"
suffixes = (".csv", ".dat")
needs_mapping = True


@dataclass(frozen=True)
class TimeColumn:
    """The column of time: `(column + offset) * unit`.

    With `sort`, rows are put in the order of their times, and of rows that are the same one is kept.
    """

    column: str
    unit: str
    offset: float = 0.0
    sort: bool = False


@dataclass(frozen=True)
class Column:
    """Where a channel comes from: `(sign * column + offset) * unit`, the offset in the unit of the column."""

    column: str
    unit: str
    offset: float = 0.0
    sign: float = 1.0


@dataclass(frozen=True)
class Frame:
    """Axes of the columns of u and v_m."""

    velocity: Literal["body", "earth"] = "body"


@dataclass(frozen=True, kw_only=True)
class Mapping(Described):
    """A mapping file.

    Attributes:
        time: the column of time.
        channels: columns of the channels, by channel.
        frame: the axes of the velocities.
        delimiter: what separates cells; "whitespace" for any white space.
        skip: lines before the header.
        encoding: of the text.
    """

    time: TimeColumn
    channels: dict[str, Column]
    frame: Frame = Frame()
    delimiter: str = ","
    skip: int = 0
    encoding: str = "utf-8-sig"

    @property
    def separator(self) -> str | None:
        """What separates cells; None for white space."""
        return None if self.delimiter == "whitespace" else self.delimiter


def read_mapping(path: Path) -> Mapping:
    """Read and check a mapping file."""
    found = read_described(path, Mapping, "seatrial-mapping/1")
    if not found.channels or not found.delimiter or found.skip < 0:
        raise DataError(f"{path}: give one channel at least, a delimiter, and skip of 0 or more")
    for channel, column in found.channels.items():
        _check_channel(path, channel, column)
    with within(path):
        conversion("t", found.time.unit)
    if found.frame.velocity == "earth" and not {"u", "v_m", "psi"} <= set(found.channels):
        raise DataError(f'{path}: frame.velocity = "earth" needs channels u (north), v_m (east) and psi')
    return found


def read(source: Path, mapping: Mapping) -> Trial:
    """Read one log by a mapping."""
    lines = lines_of(source, mapping.encoding)
    if len(lines) <= mapping.skip:
        raise DataError(f"{source}: {len(lines)} lines, and the mapping skips {mapping.skip}")
    heads = split_row(lines[mapping.skip], mapping.separator)
    time = Column(mapping.time.column, mapping.time.unit, mapping.time.offset)
    wanted = {"t": time, **mapping.channels}
    for column in wanted.values():
        if column.column not in heads:
            raise DataError(f"{source}: line {mapping.skip + 1}: {unknown(column.column, heads, 'column')}")
    once(source, mapping.skip + 1, heads, [column.column for column in wanted.values()])
    index = {channel: heads.index(column.column) for channel, column in wanted.items()}
    table, numbered = _wanted_numbers(source, lines, mapping, heads, sorted(set(index.values())))
    table, padded = continued(table, index["t"])
    if mapping.time.sort:
        table, numbered, padded = _sorted(table, index["t"], numbered, padded)
    values = {channel: _si(channel, column, table[:, index[channel]]) for channel, column in wanted.items()}
    t = values.pop("t")
    check_time(source, time.column, t, numbered, "" if mapping.time.sort else "; sort = true under time in the mapping "
               "puts rows in order and leaves out those that repeat others")  # fmt: skip
    units = {n: conversion(n, c.unit)[0] for n, c in mapping.channels.items() if n not in UNITS}
    steps = [f"imported by a mapping: {len(values)} of {len(heads)} columns"]
    steps += [f"{n}: sign turned" for n, c in mapping.channels.items() if c.sign == -1.0]
    if "psi" in values:
        values["psi"] = unwrapped(values["psi"])
        steps.append("psi made continuous")
    if mapping.frame.velocity == "earth":
        values["u"], values["v_m"] = to_body(values["u"], values["v_m"], values["psi"])
        steps.append("u, v_m turned from earth axes into body axes by psi")
    return Trial(source.stem, t, values, units, {**CONVENTIONS, **mapping.meta}).noting(*steps, *padded)


def _sorted(table: Array, time: int, lines: list[int], steps: list[str]) -> tuple[Array, list[int], list[str]]:
    """Rows in the order of their times, each once, their lines, and the steps with this one."""
    _, each = np.unique(np.nan_to_num(table, nan=np.inf), axis=0, return_index=True)
    order = each[np.lexsort((each, table[each, time]))]
    said = f"sorted by time, {len(table) - len(order)} rows that repeat others left out"
    return table[order], [lines[min(k, len(lines) - 1)] for k in order.tolist()], [*steps, said]


def _wanted_numbers(
    path: Path, lines: Sequence[str], mapping: Mapping, heads: list[str], wanted: list[int]
) -> tuple[Array, list[int]]:
    """Like `numbers`, but only the wanted columns need to be numbers; the others become NaN."""
    reduced = list(lines)
    comma = mapping.separator or " "
    for k in range(mapping.skip + 1, len(lines)):
        cells = split_row(lines[k], mapping.separator)
        if len(cells) == len(heads):
            reduced[k] = comma.join(cells[c] for c in wanted)
        elif lines[k].strip():
            raise DataError(f"{path}: line {k + 1} has {len(cells)} cells, the header has {len(heads)}")
    names = [heads[c] for c in wanted]
    part, numbered = numbers(path, reduced, mapping.skip + 1, names, mapping.separator)
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
    if standard_unit(name) is None and not of_thruster(name) and "near:" in near:
        # a typing error would silently make an unused channel
        raise DataError(f"{path}: channels.{name}: {near}")
    if column.sign not in (1.0, -1.0):
        raise DataError(f"{path}: channels.{name}.sign is {column.sign:g}; it must be 1 or -1")
    with within(path):
        conversion(name, column.unit)


