"""Layout of a table of text: its encoding, delimiter, decimal mark, lines before the header, row of units.

Each choice is made by what makes most cells values: a wrong delimiter or decimal mark leaves cells that are none.
"""

from __future__ import annotations

import codecs
import re
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from ...core.values import dataclass, replace
from .. import DataError
from ..mapping.schema import Long
from ..mapping.text import cells_of, texts_of
from ..table import bytes_of
from .naming import meanings, parted, unit_of, written

DELIMITERS = (";", "\t", ",", "|", "whitespace")
NEUTRAL = ("", "nan", "na", "null", "n/a", "-", "--", "true", "false")
"""Cells that are as likely in any layout."""

ROWS = 20_000
"""Rows that are looked at, at most."""

_PROBED, _FOOT = 200, 30
_WRITTEN, _HEAD = ("gb18030", "shift_jis", "euc-kr", "big5", "cp1251"), 2000
_EUROPEAN, _ABOVE, _LETTERS = ("cp1252", "cp1250", "cp1254", "cp1257", "cp1253"), 12, 3
"""Encodings of the letters of Europe, the commonest first, lines among which the header is, and letters of a word."""
"""Encodings of other letters, taken where names in the first characters are known."""

_LIKE = 6
"""Lines behind the first row that show that it is one."""

_LONGEST = 100
"""Characters of a cell that may be a value, twice those of any stamp; angles take the cube of it to match."""

_NUMBER = r"[+-]?(?:\d+(?:{mark}\d*)?|{mark}\d+)(?:[eE][+-]?\d+)?"
_NUMBERS = {mark: re.compile(_NUMBER.format(mark=re.escape(mark))) for mark in ".,"}
_BESIDE = r"\s*(?:°?\s*[A-Za-z]{1,5}|%|(?:°|[A-Za-z]{1,3}|1)/[A-Za-z]{1,3}|°)"
_LETTERED = {mark: re.compile(_NUMBER.format(mark=re.escape(mark)) + _BESIDE) for mark in ".,"}
_STAMP = re.compile(r"[\dTZ:./ +,-]*\d[\d:./-]*[\dZ](?:\s*[AP]\.?M\.?)?", re.IGNORECASE)
_BLANKED = re.compile(r"[NSEWO]?\s*\d{1,3}\s+\d{1,2}(?:[.,]\d+)?(?:\s+\d{1,2}(?:[.,]\d+)?)?\s*[NSEWO]", re.IGNORECASE)
"""An angle in degrees, minutes and seconds without their signs, ``33 53 59.8 S``."""
_SEXAGESIMAL = re.compile(
    r"[NSEWO]?\s*\d+\s*[°ºd-]?\s*[\d.,]+\s*['′m]?\s*([\d.,]+\s*[\"″s]?)?\s*[NSEWO]?", re.IGNORECASE
)


@dataclass(frozen=True)
class Layout:
    """How a table is written.

    Attributes:
        encoding: of the text.
        delimiter: what separates cells; "whitespace" for any white space.
        decimal: the decimal mark.
        skip: lines before the header.
        units_row: rows of units after the header.
        sheet: of a file of several tables; empty for the first and for texts, "*" where all alike are trials.
        thousands: mark between groups of three digits in any of its cells.
        footer: lines after the last row.
        named: whether the mapping gives the names of the columns, and the header is among the lines before the rows.
    """

    encoding: str = "utf-8-sig"
    delimiter: str = ","
    decimal: str = "."
    skip: int = 0
    units_row: int = 0
    sheet: str = ""
    thousands: str = ""
    footer: int = 0
    named: bool = False


@dataclass(frozen=True)
class Table:
    """A table as text.

    Attributes:
        path: file.
        layout: how it is written.
        heads: of its columns.
        units: what the row of units says of each; empty without one.
        columns: cells of each column.
        cut: whether the file has more rows.
        beside: other sheets of the file that are tables.
        apart: what else the file holds and is not read, in words.
        long: how it was made of a table with one value a row; None for one of a column a quantity.
        over: cells of the line above the header.
    """

    path: Path
    layout: Layout
    heads: tuple[str, ...]
    units: tuple[str, ...]
    columns: tuple[tuple[str, ...], ...]
    cut: bool = False
    beside: tuple[str, ...] = ()
    apart: tuple[str, ...] = ()
    long: Long | None = None
    over: tuple[str, ...] = ()


def told_apart(table: Table) -> Table:
    """The table with names that say which column is which, where its header alone does not.

    Names of groups, as of merged cells, stand in the line above the header, each over the first of its columns; of
    columns of one name that means something the later ones get a number.
    """
    heads = list(table.heads)
    if len(table.over) == len(heads) and groups(table.over):
        group = ""
        for k, (over, head) in enumerate(zip(table.over, heads, strict=True)):
            group = over or group
            joined = f"{group} {head}".strip() if head else over
            heads[k] = joined if _said(joined) > _said(head) or not _said(head) else head
    seen = Counter[str]()
    for k, head in enumerate(heads):
        seen[head] += 1
        if head and seen[head] > 1 and meanings(parted(head)[0]):
            heads[k] = f"{head} ({seen[head]})"
    if tuple(heads) == table.heads:
        return table
    layout = replace(table.layout, named=True, skip=table.layout.skip + 1)
    return replace(table, heads=tuple(heads), layout=layout)


def groups(over: Sequence[str]) -> bool:
    """Whether cells are names of groups of columns: words, and fewer of them than columns."""
    filled = [cell for cell in over if cell]
    return len(filled) > 1 and not any(map(is_value, filled)) and len(set(filled)) < len(over)


def _said(head: str) -> float:
    """How well a name tells a quantity."""
    return max((one.score for one in meanings(parted(head)[0])), default=0.0)


def decoded(path: Path) -> tuple[str, str]:
    """The text of a file as an import reads it, and its encoding: by byte-order mark, zero bytes, or else by trial.

    Raises:
        DataError: no such file, an empty or a binary one.
    """
    encoding = _encoding(bytes_of(path))
    return texts_of(path, encoding).decode(), encoding


def _encoding(raw: bytes) -> str:
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    head = raw[:2000]
    if head[1::2].count(0) > 0.4 * len(head) / 2:
        return "utf-16-le"
    if head[::2].count(0) > 0.4 * len(head) / 2:
        return "utf-16-be"
    if 0 in head:
        return "utf-8"
    for encoding in ("utf-8-sig", *_WRITTEN):
        try:
            text = raw.decode(encoding)
        except UnicodeDecodeError:
            continue
        if encoding == "utf-8-sig" or written(text[:_HEAD]):
            return encoding
    # letters of Europe: where the words of the header are names of quantities
    return max(_EUROPEAN, key=lambda one: _named(raw[:_HEAD].decode(one, "replace")))


def _named(text: str) -> float:
    """How well the words at the head of a text tell quantities."""
    cells = [cell for line in text.splitlines()[:_ABOVE] for cell in re.split("[;,\t|]", line)]
    return round(sum(_said(cell) for cell in cells if not cell.isascii() and len(cell.strip()) > _LETTERS), 6)


def is_value(cell: str, mark: str = ".") -> bool:
    """Whether a cell is a number with this decimal mark, with a letter, a time or an angle in minutes."""
    plain = cell.strip()
    return len(plain) <= _LONGEST and bool(
        _NUMBERS[mark].fullmatch(plain) or _LETTERED[mark].fullmatch(plain) or _BLANKED.fullmatch(plain)
        or ((":" in plain or plain.count("-") >= 2 or plain.count("/") >= 2 or plain.count(".") >= 2)
        and _STAMP.fullmatch(plain)) or (any(c in plain for c in "°'′\"") and _SEXAGESIMAL.fullmatch(plain))
    )  # fmt: skip


_GROUPED = {
    mark: re.compile(rf"[+-]?\d{{1,3}}(?:{other}\d{{3}})+(?:{point}\d*)?")
    for mark, other, point in ((",", r"\.", ","), (".", ",", r"\."))
}


def ungrouped(cells: tuple[str, ...], mark: str) -> tuple[str, ...]:
    """Cells of a column without the marks between groups of three digits; as they are where they have none."""
    filled = [cell.strip() for cell in cells if cell.strip()]
    other = "." if mark == "," else ","
    fitting = sum(bool(_GROUPED[mark].fullmatch(cell) or _NUMBERS[mark].fullmatch(cell)) for cell in filled)
    if not any(other in cell for cell in filled) or fitting < 0.9 * len(filled):
        return cells
    return tuple(cell.replace(other, "") if _GROUPED[mark].fullmatch(cell.strip()) else cell for cell in cells)


def number(cell: str, mark: str = ".") -> float | None:
    """The number of a cell with this decimal mark; None where it is none."""
    plain = cell.strip()
    return float(plain.replace(mark, ".")) if _NUMBERS[mark].fullmatch(plain) else None


def split_line(line: str, delimiter: str) -> list[str]:
    """Cells of a line, as an import splits it."""
    return cells_of(line, None if delimiter == "whitespace" else delimiter)


def read_text(path: Path, most: int = ROWS) -> Table:
    """A table of text with the layout that makes most of its cells values, and so many of its rows at most.

    Raises:
        DataError: not text, no rows of numbers, or no header above them.
    """
    text, encoding = decoded(path)
    lines = text.split("\n")
    filled = [line for line in lines if line.strip()]
    middle = filled[len(filled) // 3 :][:_PROBED]
    ranked = sorted(
        ((_share(middle, delimiter, mark), delimiter, mark) for delimiter in DELIMITERS for mark in ".,"
         if (delimiter, mark) != (",", ",")), key=lambda one: -one[0])  # fmt: skip
    if ranked[0][0] <= 0.0:
        raise DataError(f"{path}: no rows of numbers found; is it a table?")
    delimiter, mark = next((two for share, *two in ranked if share > _NEXT * ranked[0][0]
                            and _headed(path, lines, middle, *two)), ranked[0][1:])  # fmt: skip
    count = Counter(len(split_line(line, delimiter)) for line in middle).most_common(1)[0][0]
    first = _first_row(lines, lambda line: _is_row(split_line(line, delimiter), count, mark))
    if first is None:
        raise DataError(f"{path}: no rows of numbers found; is it a table?")
    heads, skip, units = _header(path, lines, first, delimiter, count)
    above_it = next((split_line(line, delimiter) for line in reversed(lines[:skip]) if line.strip()), [])
    foot, footer = _footer(lines, first, lambda line: split_line(line, delimiter), mark)
    above = {line.strip() for line in lines[skip:first]}
    rows = [cells for line in lines[first : min(first + most, foot)] if line.strip() and line.strip() not in above
            and len(cells := split_line(line, delimiter)) == count and any(cells)]  # fmt: skip
    if len(rows) < 2:
        raise DataError(f"{path}: {len(rows)} rows of numbers; a trial needs at least 2")
    columns = tuple(zip(*rows, strict=True))
    grouped = any(ungrouped(column, mark) is not column for column in columns)
    layout = Layout(encoding, delimiter, mark, skip, 1 if units else 0, "", "," if mark == "." else ".")
    layout = replace(layout, thousands=layout.thousands if grouped else "", footer=footer)
    units = units or [""] * count
    return Table(path, layout, tuple(heads), tuple(units), columns, len(lines) - first > most, over=tuple(above_it))


def _headed(path: Path, lines: list[str], middle: list[str], delimiter: str, mark: str) -> bool:
    """Whether a delimiter parts the header into as many names as the rows have cells."""
    count = Counter(len(split_line(line, delimiter)) for line in middle).most_common(1)[0][0]
    first = _first_row(lines, lambda line: _is_row(split_line(line, delimiter), count, mark))
    try:
        return first is not None and bool(_header(path, lines, first, delimiter, count))
    except DataError:
        return False


_NEXT = 0.5
"""How well a delimiter makes a table, as a part of the best, that is tried where the best has no header."""


def _first_row(lines: list[str], is_row: Callable[[str], bool]) -> int | None:
    """Number of the first row: one that most of the next lines are like, as a remark may look like a row."""
    some = [k for k, line in enumerate(lines) if line.strip()]
    for n, k in enumerate(some):
        if is_row(lines[k]):
            after = some[n + 1 : n + 1 + _LIKE]
            if sum(is_row(lines[j]) for j in after) >= 0.8 * len(after):
                return k
    return None


def _share(lines: list[str], delimiter: str, mark: str) -> float:
    """How well a delimiter and a decimal mark make a table: share of cells that are values, in rows of one length."""
    rows = [split_line(line, delimiter) for line in lines]
    count, often = Counter(map(len, rows)).most_common(1)[0]
    cells = [cell for row in rows for cell in row if len(row) == count and cell.lower() not in NEUTRAL]
    if count < 2 or not cells:
        return 0.0
    fine = sum(is_value(cell, mark) for cell in cells) / len(cells)
    plain = 0.001 * (mark == ".")  # where no cell has a decimal mark, the dot
    # White space also splits dates from times, so that a true delimiter goes first.
    return fine * often / len(rows) - (0.05 if delimiter == "whitespace" else 0.0) + plain


def _footer(
    lines: Sequence[str], first: int, split: Callable[[str], list[str]], mark: str
) -> tuple[int, int]:  # fmt: skip
    """Number of the line behind the last row, and how many lines that are not empty follow it.

    A line at the end is none of the rows where it has another number of cells, or a word where they all have values.
    One of values alone is a row that is cut, and the import names it.
    """
    filled = [k for k in range(first, len(lines)) if lines[k].strip()]
    some = [split(lines[k]) for k in filled[: _PROBED]]
    count = len(some[0])
    valued = [all(is_value(row[k], mark) or row[k].lower() in NEUTRAL for row in some if len(row) == count)
              for k in range(count)]  # fmt: skip

    def is_row(cells: list[str]) -> bool:
        said = [k for k in range(len(cells)) if cells[k].lower() not in NEUTRAL]
        return len(cells) == count and bool(said) and all(is_value(cells[k], mark) for k in said if valued[k])

    for n, k in enumerate(reversed(filled[-_FOOT:])):
        cells = split(lines[k])
        if is_row(cells):
            return (k + 1, n) if n else (len(lines), 0)
        if len(cells) > 1 and all(is_value(cell, mark) for cell in cells):
            break
    return len(lines), 0


def _is_row(cells: list[str], count: int, mark: str) -> bool:
    filled = [cell for cell in cells if cell.lower() not in NEUTRAL]
    values = sum(is_value(cell, mark) for cell in filled)
    return len(cells) == count and values >= max(1, len(filled) // 3)


def _header(path: Path, lines: list[str], first: int, delimiter: str, count: int) -> tuple[list[str], int, list[str]]:
    """Heads, the lines before them, and the row of units between them and the first row of numbers."""
    blanks = f" \t{delimiter if delimiter in DELIMITERS[:-1] else ''}"  # a line of separators says nothing
    above = [k for k in range(first - 1, -1, -1) if lines[k].strip(blanks)][:2]
    rows = [split_line(lines[k], delimiter) for k in above]
    if not rows or len(rows[0]) != count:
        raise DataError(f"{path}: line {first + 1}: no header with {count} names above the first row of numbers; "
                        'write one, or a mapping with columns = ["t [s]", "psi [deg]", ...]')  # fmt: skip
    named = [cell for cell in rows[0] if cell]
    said = sum(bool(unit_of(cell)) or cell.strip("[]()") in ("-", "") for cell in named)
    if len(rows) == 2 and len(rows[1]) == count and said >= 0.6 * len(named):
        return rows[1], above[1], rows[0]
    return rows[0], above[0], []
