"""A file as a table of named columns, each of numbers or of texts, whatever it is: text, workbook or arrays."""

from __future__ import annotations

import re
from collections.abc import Mapping as Named
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import unknown
from ...core.values import dataclass, field, replace
from .. import DataError
from ..sheets import Sheets, packed, sheets_of
from ..table import existing, once
from ..units import KNOWN
from .schema import Mapping
from .text import Layout, above, laid_out, texts_of, typed
from .uses import Use

if TYPE_CHECKING:
    import polars as pl

_ANGLES = ("position", "split")
"""Keys of columns that have no unit in their cells, or a reader of their own."""

NUMBERED = re.compile(r"(?:.*\(:,)?[0-9]+\)?")
"""Names of the columns of a matrix, which are none."""

_NUMBER = re.compile(r"[-+]?[0-9]*[.,]?[0-9]")
_BRACKETED = re.compile(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$")


@dataclass(frozen=True)
class Table:
    """The columns of one file that a mapping reads.

    Attributes:
        path: of the file, for the errors.
        frame: columns by name, of numbers, texts or times.
        lines: number of each row in the file, from 1, shape (rows,).
        width: number of columns of the file.
        word: what a row of the file is called, "line" or "row".
        stated: unit that the file gives for a column, in its header, a row of units or its cells, and the row's number.
        decimal: the decimal mark of texts.
        thousands: mark between their groups of three digits.
        missing: words of a missing value, in lower case.
        pieces: files of which it is made one after the other, and the rows of each; empty for one.
        header: number of the row of the names.
    """

    path: Path
    frame: pl.DataFrame
    lines: NDArray[np.int64]
    width: int
    word: str = "line"
    stated: Named[str, tuple[str, int]] = field(default_factory=dict[str, tuple[str, int]])
    decimal: str = "."
    thousands: str = ""
    missing: frozenset[str] = frozenset()
    pieces: tuple[tuple[Path, int], ...] = ()
    header: int = 1

    def __len__(self) -> int:
        return len(self.lines)

    def at(self, column: str, row: int) -> str:
        """The place of a cell, for the beginning of an error."""
        ends = np.cumsum([count for _, count in self.pieces])
        path = self.pieces[int(np.searchsorted(ends, row, side="right"))][0] if self.pieces else self.path
        return f"{path}: column '{column}', {self.word} {self.lines[row]}"

    def rows(self, index: NDArray[np.intp]) -> Table:
        """The same table with only some of its rows."""
        return replace(self, frame=self.frame[index], lines=self.lines[index])

    def agree(self, column: str, unit: str, despite: str | None = None, *, channel: bool = False) -> None:
        """Refuse a unit that contradicts the one in the file.

        Args:
            column: its name.
            unit: what the mapping says.
            despite: what the mapping says that the file says wrongly.
            channel: whether the mapping may have `despite` there.

        Raises:
            DataError: naming file, column and row.
        """
        said, line = self.stated.get(column, ("", 0))
        if not {said, unit} <= set(KNOWN) or said == despite or KNOWN[said] == KNOWN[unit]:
            return
        if line == self.header and KNOWN[said][0] != KNOWN[unit][0]:
            return  # a word in brackets that is no unit here: the wind (t) is no mass
        way = f'despite = "{said}" where the file is wrong' if channel else "mend the file"
        about = f"in {said}, and the mapping says {unit}; give {said}, or {way}"
        raise DataError(f"{self.path}: column '{column}', {self.word} {line}: {about}")


def opened(path: Path, mapping: Mapping, wanted: Sequence[Use], sheets: Sheets | None = None) -> Table:
    """The wanted columns of a file.

    Args:
        path: of the file.
        mapping: how it is written.
        wanted: the columns.
        sheets: the tables of the file where they are open already, as one that is read sheet by sheet.

    Raises:
        DataError: a file that cannot be read, a column that is not there or there twice, rows of another length.
    """
    if packed(existing(path)):
        book = sheets_of(path) if sheets is None else sheets
        found = _of_frame(path, mapping, wanted, book.one(mapping.sheet), None if book.headed else mapping.skip)
        if sheets is not None:
            found = replace(found, word=f"sheet '{mapping.sheet}', row")
    else:
        found = _of_text(path, mapping, wanted)
    words = frozenset(("", "nan", "na", "null", *(word.strip().lower() for word in mapping.missing)))
    return _unspoken(replace(found, decimal=mapping.decimal, thousands=mapping.thousands, missing=words), wanted)


def heads_of(sheets: Sheets, mapping: Mapping, name: str) -> list[str]:
    """The names of the columns of a sheet; none where it ends before its header."""
    frame = sheets.one(name)
    if sheets.headed or mapping.columns:
        return list(mapping.columns or frame.columns)
    return _heads(frame, mapping.skip) if frame.height > mapping.skip else []


def _heads(frame: pl.DataFrame, row: int) -> list[str]:
    return ["" if cell is None else str(cell).strip() for cell in frame.row(row)]


def _unspoken(table: Table, wanted: Sequence[Use]) -> Table:
    """The table with the units taken off its cells of numbers, and stated for their columns.

    Raises:
        DataError: two units in one column, naming file, column and row.
    """
    import polars as pl

    frame, stated = table.frame, dict(table.stated)
    for name in dict.fromkeys(one.column for one in wanted if one.number and not one.key.startswith(_ANGLES)):
        if frame[name].dtype != pl.String:
            continue
        plain, units = unspoken(frame[name])
        for unit, row in units.items():
            first, line = stated.setdefault(name, (unit, int(table.lines[row])))
            if KNOWN.get(first) != KNOWN[unit]:
                about = f"in {unit}, and {table.word} {line} says {first}; a column has one unit"
                raise DataError(f"{table.at(name, row)}: {about}")
        frame = frame.with_columns(plain) if units else frame
    return replace(table, frame=frame, stated=stated)


def stacked(tables: Sequence[Table]) -> Table:
    """The rows of several tables of the same columns, one after the other."""
    import polars as pl

    if len(tables) == 1:
        return tables[0]
    kinds = {name: {one.frame[name].dtype for one in tables} for name in tables[0].frame.columns}
    mixed = [name for name, some in kinds.items() if len(some) > 1]
    frames = [one.frame.with_columns(pl.col(mixed).cast(pl.String)) if mixed else one.frame for one in tables]
    lines = np.concatenate([one.lines for one in tables])
    return replace(
        tables[0], frame=pl.concat(frames), lines=lines, pieces=tuple((one.path, len(one)) for one in tables)
    )


def _of_text(path: Path, mapping: Mapping, wanted: Sequence[Use]) -> Table:
    raw = above(path, texts_of(path, mapping.encoding), mapping.footer)
    layout = laid_out(path, raw, mapping.separator, mapping.skip, int(mapping.units_row), mapping.columns)
    index = _places(path, *_header(mapping, "line"), layout.heads, wanted)
    plain = mapping.decimal == "."
    numbers = {one.column for one in wanted if one.number and plain}
    frame = typed(path, layout, {name: (k, name in numbers) for name, k in index.items()}, mapping.missing)
    stated = _stated(mapping.skip + 1, layout, index)
    return Table(path, frame, layout.lines, len(layout.heads), "line", stated, header=mapping.skip + 1)


def _of_frame(path: Path, mapping: Mapping, wanted: Sequence[Use], frame: pl.DataFrame, skip: int | None) -> Table:
    """The wanted columns of a frame, whose own names are the header, or the row after those that are skipped."""
    if skip is None:
        first, units, heads = 0, 0, _named(path, mapping, frame.columns)
        index = _places(path, "column names, row", 0, heads, wanted)
    else:
        if frame.height <= skip:
            raise DataError(f"{path}: {frame.height} rows, and the mapping skips {skip}")
        heads = mapping.columns or _heads(frame, skip)
        if len(heads) != frame.width:
            raise DataError(f"{path}: {frame.width} columns, and columns of the mapping has {len(heads)}")
        index = _places(path, *_header(mapping, "row"), heads, wanted)
        units = int(mapping.units_row)
        first = skip + (not mapping.columns)
        while units and first < frame.height - 1 and not any(frame.row(first)):
            first += 1  # empty rows between the names and the units
        first += units
    rows = [["" if cell is None else str(cell).strip() for cell in frame.row(k)] for k in range(first - units, first)]
    last = frame.height
    if mapping.footer:
        told = np.flatnonzero(~frame.select(_every_null(frame)).to_series().to_numpy())
        last = int(told[-mapping.footer]) if mapping.footer <= told.size else 0
    body = frame[first : max(last, first)].select([frame.columns[k] for k in index.values()])
    body.columns = list(index)
    filled = np.flatnonzero(~body.select(_every_null(body)).to_series().to_numpy()) if skip is not None else None
    lines = np.arange(first + 1, first + 1 + body.height, dtype=np.int64)
    layout = Layout(b"", None, tuple(heads), lines, tuple(tuple(row) for row in rows), False)
    table = Table(path, body, lines, len(heads), "row", _stated(first - units, layout, index), header=first - units)
    return table if filled is None or filled.size == len(table) else table.rows(filled)


def _named(path: Path, mapping: Mapping, heads: list[str]) -> Sequence[str]:
    """The names of columns that the file gives, or those of the mapping where it gives numbers only.

    Raises:
        DataError: both give names, or another number of them.
    """
    if not mapping.columns:
        return heads
    if not all(map(NUMBERED.fullmatch, heads)):
        raise DataError(f"{path}: the file names its own columns; leave columns out of the mapping")
    if len(heads) != len(mapping.columns):
        raise DataError(f"{path}: {len(heads)} columns, and columns of the mapping has {len(mapping.columns)}")
    return mapping.columns


def _every_null(frame: pl.DataFrame) -> Any:
    import polars as pl

    return pl.all_horizontal(pl.all().is_null())


def _header(mapping: Mapping, word: str) -> tuple[str, int]:
    """Where the names of the columns are, in words; row 0 where the mapping gives them."""
    return ("columns of the mapping, row", 0) if mapping.columns else (word, mapping.skip + 1)


def _places(path: Path, word: str, line: int, heads: Sequence[str], wanted: Sequence[Use]) -> dict[str, int]:
    """Where each wanted column is in the header."""
    names = list(dict.fromkeys(one.column for one in wanted))
    for name in names:
        if name not in heads and sum(_NUMBER.match(head) is not None for head in heads) > len(heads) / 2:
            raise DataError(f"{path}: {word} {line} holds numbers, not names of columns; name them in the mapping: "
                            'columns = ["t", "psi", ...]')  # fmt: skip
        if name not in heads:
            raise DataError(f"{path}: {word} {line}: {unknown(name, heads, 'column')}")
    once(path, line, heads, names)
    return {name: list(heads).index(name) for name in names}


def _stated(header: int, layout: Layout, index: Named[str, int]) -> dict[str, tuple[str, int]]:
    """Units that the file itself gives, by column, and where: in rows of units, else at the end of a name."""
    found: dict[str, tuple[str, int]] = {}
    for name, k in index.items():
        ended = _BRACKETED.search(name)
        if ended is not None:
            found[name] = ended[1], header
        for below, row in enumerate(layout.units, start=1):
            text = row[k].strip().strip("[]()").strip() if k < len(row) else ""
            if text in KNOWN:
                found[name] = text, header + below
    return found


_CELL = r"^([-+]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][-+]?[0-9]+)?)\s*([^0-9\s.,].*|1/.*)$"
_SIDES = frozenset("NSEWPOLB")
"""Letters of a hemisphere or a side: 12.3 S is no time."""

_TRUE = re.compile(r"^(°|deg)\s*T$")
_LOOKED = 1000
"""Cells that are looked at; a logger that writes units writes them from the start."""


def unspoken(cells: pl.Series) -> tuple[pl.Series, dict[str, int]]:
    """Cells without the units beside their numbers ("5.2 kn"), and these units with the first row of each."""
    if not _units(cells.drop_nulls().head(_LOOKED)):
        return cells, {}
    said = _units(cells)
    bare = cells.str.strip_chars(' \t"')
    found = bare.str.extract(_CELL, 2)
    rows = {one: int(np.flatnonzero((found == one).fill_null(False).to_numpy())[0]) for one in said}
    plain = bare.str.extract(_CELL, 1).zip_with(found.is_in(said).fill_null(False), cells)
    return plain.alias(cells.name), {_symbol(one): row for one, row in rows.items()}


def _units(cells: pl.Series) -> list[str]:
    """Units beside the numbers of some cells, as they are written, in the order of the cells."""
    found = cells.str.strip_chars(' \t"').str.extract(_CELL, 2).drop_nulls().unique(maintain_order=True).to_list()
    return [one for one in found if one not in _SIDES and _symbol(one) in KNOWN]


def _symbol(said: str) -> str:
    """The symbol of a unit: RPM is rpm, and degrees true are degrees."""
    said = _TRUE.sub(r"\1", said)
    return said if said in KNOWN else said.lower()
