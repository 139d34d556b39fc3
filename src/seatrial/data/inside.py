"""What packed tables hold, counted before they are unpacked: Parquet by its pages, workbooks by their cells."""

from __future__ import annotations

import re
import struct
import zipfile
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ..core import unpacking
from ..core.errors import first_line
from . import DataError

if TYPE_CHECKING:
    import polars as pl

_CELLS, _PER_CELL = 1_000_000, 20
"""Cells of the rectangle that a sheet spans at most, or so many for each that is written."""

_REFERENCE = re.compile(rb"([A-Z]{1,3})([0-9]{1,7})")
_CELL = re.compile(rb"""<(?:\w+:)?(c|row)\b[^>]{0,400}?\br=["']([^"']{0,40})["']""")
_ODS = re.compile(
    rb"""<(?:table:(?P<end>/?)(?P<what>table-row|table-cell|covered-table-cell)\b(?P<rest>[^>]{0,2000}))"""
)
_REPEATED = re.compile(rb'number-(?:rows|columns)-repeated="([0-9]{1,9})"')


def hold_parquet(path: Path) -> None:
    """Count the rows and pages of a Parquet file.

    Raises:
        DataError: more than `unpacking.most`, no such file, or a damaged one.
    """
    raw = path.read_bytes()
    try:
        footer = _Thrift(raw, len(raw) - 8 - struct.unpack("<I", raw[-8:-4])[0]).struct()
        # each value is a number of 8 bytes when read, or the place of a text
        count = float(sum(_pages(raw, column) for group in footer[4] for column in group[1]))
        count += 8.0 * footer[3] * sum(1 for element in footer[2] if 5 not in element)
    except (IndexError, KeyError, TypeError, ValueError, struct.error, OverflowError, RecursionError):
        raise DataError(f"{path}: not a readable Parquet file (damaged, or cut off)") from None
    if count > unpacking.most(len(raw)):
        raise DataError(f"{path}: {unpacking.told(count, len(raw))}")


def read_frame(path: Path) -> pl.DataFrame:
    """The table of a Parquet file.

    Raises:
        DataError: not such a file, a damaged one, or one that holds too much.
    """
    import polars as pl

    hold_parquet(path)
    with parquet(path):
        return pl.read_parquet(path)


@contextmanager
def parquet(path: Path) -> Generator[None, None, None]:
    """A Parquet file is read: DataError for one that is damaged, or not such a file."""
    import polars as pl

    try:
        yield
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError, ValueError, RecursionError) as error:
        raise DataError(f"{path}: not a readable Parquet file ({first_line(error)})") from None


@contextmanager
def workbook(path: Path) -> Generator[None, None, None]:
    """A workbook is read: DataError for one that is damaged or holds too much, or where its reader is missing."""
    try:
        hold_workbook(path)
        yield
    except DataError:
        raise
    except ImportError:
        raise DataError(f"{path}: workbooks need the extra 'log': pip install 'seatrial[log]'") from None
    except Exception as error:  # whatever the readers raise on a damaged workbook
        raise DataError(f"{path}: not readable as a workbook: {first_line(error, 120)}") from None


def _pages(raw: bytes, column: dict[int, Any]) -> int:
    """Bytes of the pages of a column of a group of rows, unpacked, and of its texts, a usual one for each value."""
    about = column[3]
    at = min(about.get(11) or about[9], about[9])
    end = at + about[7]
    if not 0 < at <= end <= len(raw):
        raise ValueError
    total, words, values = 0, 0, 0
    while at < end:
        thrift = _Thrift(raw, at)
        head = thrift.struct()
        size, packed = head[2], head[3]
        if size < 0 or packed < 0:
            raise ValueError
        if 7 in head:
            words = max(words, size // max(head[7][1], 1)) if head[7][1] else size
        else:
            values += (head.get(5) or head.get(8) or {1: 0})[1]
        total += size
        at = thrift.at + packed
    texts = about[1] in (6, 7)  # byte arrays
    return total + (values * words if texts else 0)


class _Thrift:
    """The compact protocol of Thrift: structs as fields by number."""

    def __init__(self, raw: bytes, at: int) -> None:
        if at < 0:
            raise ValueError
        self.raw, self.at = raw, at

    def struct(self, depth: int = 0) -> dict[int, Any]:
        found: dict[int, Any] = {}
        field = 0
        while (head := self._byte()) != 0:
            field = field + (head >> 4) if head >> 4 else self._zigzag()
            found[field] = self._value(head & 15, depth)
        return found

    def _byte(self) -> int:
        self.at += 1
        return self.raw[self.at - 1]

    def _varint(self) -> int:
        found = shift = 0
        while True:
            byte = self._byte()
            found |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return found
            if shift > 63:
                raise ValueError

    def _zigzag(self) -> int:
        found = self._varint()
        return (found >> 1) ^ -(found & 1)

    def _value(self, kind: int, depth: int, element: bool = False) -> Any:
        if depth > 20:
            raise ValueError
        if kind in (1, 2):
            return self._byte() == 1 if element else kind == 1
        if kind == 3:
            return self._byte()
        if kind in (4, 5, 6):
            return self._zigzag()
        if kind == 7:
            self.at += 8
            return 0.0
        if kind == 8:
            size = self._varint()
            self.at += size
            return self.raw[self.at - size : self.at]
        if kind in (9, 10):
            head = self._byte()
            size = head >> 4 if head >> 4 < 15 else self._varint()
            if size > len(self.raw):
                raise ValueError
            return [self._value(head & 15, depth + 1, True) for _ in range(size)]
        if kind == 12:
            return self.struct(depth + 1)
        raise ValueError


def hold_workbook(path: Path) -> None:
    """Count the cells of the sheets of a workbook, whose rectangle a reader takes memory for.

    Raises:
        DataError: more than fits; a cell without a place.
    """
    size = path.stat().st_size
    if not zipfile.is_zipfile(path):
        return
    try:
        with zipfile.ZipFile(path) as archive:
            unpacking.hold(archive, size)
            for member in archive.infolist():
                name = member.filename.lower()
                if name.endswith(".xml") and ("sheet" in name or name == "content.xml"):
                    written, spanned = _spanned(archive.read(member))
                    if spanned > max(_CELLS, _PER_CELL * written):
                        about = f"{member.filename} spans {spanned:.3g} cells and has {written}"
                        raise ValueError(f"{about}; delete those far from the table")
    except (ValueError, zipfile.BadZipFile, OSError, EOFError, RuntimeError, NotImplementedError) as error:
        raise DataError(f"{path}: not readable as a workbook: {error}") from None


def _spanned(xml: bytes) -> tuple[int, float]:
    """Cells that a sheet has, and those of the rectangle from its first to its last."""
    return _of_ods(xml) if b"number-columns-repeated" in xml or b"office:spreadsheet" in xml else _of_xlsx(xml)


def _of_xlsx(xml: bytes) -> tuple[int, float]:
    written, wide, high = xml.count(b"<c ") + xml.count(b"<c>") + xml.count(b":c "), 1, 1
    for what, text in cast("Iterator[tuple[bytes, bytes]]", (one.groups() for one in _CELL.finditer(xml))):
        if what == b"row":
            if not text.isdigit():
                raise ValueError(f"a row has the place {text!r:.30}")
            high = max(high, int(text))
            continue
        found = _REFERENCE.fullmatch(text)
        if found is None:
            raise ValueError(f"a cell has the place {text!r:.30}")
        column = 0
        for letter in found[1]:
            column = 26 * column + letter - 64
        wide, high = max(wide, column), max(high, int(found[2]))
    return written, float(max(wide, 1)) * float(high)


def _of_ods(xml: bytes) -> tuple[int, float]:
    written, spanned, wide, times = 0, 0.0, 0, 1
    for one in _ODS.finditer(xml):
        rest = one["rest"]
        found = _REPEATED.search(rest)
        count = int(found[1]) if found else 1
        if one["what"] == b"table-row":
            spanned += float(wide) * times
            wide, times = 0, count
        elif b"value" in rest and not one["end"]:
            written += 1
            wide += count
    return written, spanned + float(wide) * times
