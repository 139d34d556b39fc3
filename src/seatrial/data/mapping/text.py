"""Text files of tables: their encoding, their rows and cells, and columns of numbers read at once.

Rows are counted and their cells are checked before any is read, since a reader of columns pads short rows silently.
"""

from __future__ import annotations

import codecs
import io
from collections.abc import Callable, Sequence, Set
from collections.abc import Mapping as Named
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import first_line
from ...core.values import dataclass
from .. import DataError
from ..table import bytes_of, quoted_cells

if TYPE_CHECKING:
    import polars as pl

_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"),
          (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))  # fmt: skip
_LOOKED = 65536
# Separates cells once lines with other separators are put in order: no text of a logger has it.
_UNIT = "\x1f"


@dataclass(frozen=True)
class Layout:
    """Where the rows and columns of a text are.

    Attributes:
        body: the rows of the table as UTF-8, header and rows of units left out.
        separator: one character between cells.
        heads: names in the header.
        lines: line of each row in the file, from 1, blank ones and those that repeat the heading left out.
        units: cells of the rows of units.
        quoted: whether a quoted cell holds a separator.
    """

    body: bytes
    separator: str | None
    heads: tuple[str, ...]
    lines: NDArray[np.int64]
    units: tuple[tuple[str, ...], ...]
    quoted: bool
    blank: tuple[int, ...] = ()


def texts_of(path: Path, encoding: str | None) -> bytes:
    """The text of a file as UTF-8, lines ending in a newline.

    Args:
        path: of the file.
        encoding: its own; None for that of its byte-order mark, else UTF-8.

    Raises:
        DataError: no such file, an empty or a binary one, another encoding.
    """
    raw = bytes_of(path)
    known = encoding or next((name for mark, name in _MARKS if raw.startswith(mark)), "utf-8")
    wide = known.lower().replace("_", "-").startswith(("utf-16", "utf-32"))
    if not wide and b"\0" in raw[:_LOOKED]:
        raise DataError(f'{path}: a binary file, not text; expected rows of numbers (or encoding = "utf-16-le")')
    try:
        if known.lower() not in ("utf-8", "utf8", "utf-8-sig", "ascii"):
            raw = raw.decode(known).encode()
        elif not raw.isascii():
            codecs.utf_8_decode(raw, "strict", True)
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        advice = "" if encoding else '; give encoding = "latin-1" or that of the logger in the mapping'
        raise DataError(f"{path}: not readable as {known} text, line {line} ({error.reason}){advice}") from None
    except (LookupError, UnicodeError) as error:
        raise DataError(f"{path}: not readable as {known} text ({error})") from None
    if raw.startswith(codecs.BOM_UTF8):
        raw = raw[len(codecs.BOM_UTF8) :]
    return raw if b"\r" not in raw else raw.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def above(path: Path, raw: bytes, footer: int) -> bytes:
    """A text without so many of its last lines, empty ones not counted.

    Raises:
        DataError: it has fewer lines.
    """
    for _ in range(footer):
        raw = raw.rstrip(b"\n \t")
        if not raw:
            raise DataError(f"{path}: fewer than the {footer} lines that the mapping leaves out as a footer")
        raw = raw[: raw.rfind(b"\n") + 1]
    return raw


def laid_out(
    path: Path, raw: bytes, separator: str | None, skip: int, units: int, named: Sequence[str] = ()
) -> Layout:  # fmt: skip
    """The header, the rows of units and the rows of a text, each as long as the header.

    Args:
        path: of the file, for the errors.
        raw: its text.
        separator: what separates cells; None for white space.
        skip: lines before the header.
        units: rows of units after it.
        named: names of the columns of a table without a header.

    Raises:
        DataError: no header, a row with more or fewer cells than the header, naming its line.
    """
    start, found = 0, 0
    heading: list[bytes] = []
    above = units + (not named)
    while found < skip or len(heading) < above:
        if start >= len(raw):
            raise DataError(f"{path}: {found} lines, and the mapping skips {skip}")
        stop = raw.find(b"\n", start)
        stop = len(raw) if stop < 0 else stop
        line = raw[start:stop]
        # an empty line between the names and the units is none of them
        if found >= skip and (line.strip(b" ") or not heading):
            heading.append(line)
        start, found = stop + 1, found + 1
    while (stop := raw.find(b"\n", start)) >= 0 and not raw[start:stop].strip(b" "):
        start, found = stop + 1, found + 1
    body = raw[start:]
    if separator is None or len(separator.encode()) != 1:
        heading, body = (
            [_put(line, separator) for line in heading],
            b"\n".join(_put(line, separator) for line in body.split(b"\n")),
        )
        separator = _UNIT
    rows = [tuple(cells_of(line.decode(), separator)) for line in heading]
    heads, *rest = [tuple(named), *rows] if named else rows
    first = found + 1
    source = "columns of the mapping" if named else "the header"
    again = {line.strip() for line in heading if line.strip()}
    blank, count, quoted = _counted(path, body, separator, len(heads), (first, source), again)
    lines = np.delete(np.arange(count, dtype=np.int64), blank) + first
    return Layout(body, separator, heads, lines, tuple(rest), quoted, tuple(blank))


def typed(path: Path, layout: Layout, wanted: Named[str, tuple[int, bool]], missing: Sequence[str]) -> pl.DataFrame:
    """The wanted columns: those of numbers as floats where every cell is one, the others as texts.

    Args:
        path: of the file, for the errors.
        layout: of the text.
        wanted: number of the column and whether it is one of numbers, by name.
        missing: words that stand for a missing value.

    Raises:
        DataError: cells in quotes that do not end in their line.
    """
    import polars as pl

    if not len(layout.lines):
        return pl.DataFrame(schema={name: pl.Float64 if number else pl.String for name, (_, number) in wanted.items()})
    by_place = sorted(wanted, key=lambda name: wanted[name][0])

    words = ["nan", "NaN", "NA", "null", *missing]

    def read(floats: bool) -> pl.DataFrame:
        kinds = {f"{k}": pl.String for k in range(len(layout.heads))}
        kinds |= {f"{k}": pl.Float64 for k, number in wanted.values() if number and floats}
        frame = pl.read_csv(
            layout.body, has_header=False, separator=layout.separator or ",", schema=kinds,
            columns=[wanted[name][0] for name in by_place], quote_char='"' if layout.quoted else None,
            null_values=words if floats else None, raise_if_empty=False,
        )  # fmt: skip
        frame.columns = by_place
        return frame.select(list(wanted))

    try:
        found = read(True)
    except pl.exceptions.PolarsError:
        found = _whole(path, lambda: read(False))
    if found.height != len(layout.lines) + len(layout.blank):
        raise DataError(f"{path}: a cell in quotes does not end in its line; remove line breaks and single quotes")
    if layout.blank:
        kept = np.ones(found.height, dtype=bool)
        kept[[k for k in layout.blank if k < found.height]] = False
        found = found.filter(pl.Series(kept))
    return found


def _whole(path: Path, read: Callable[[], pl.DataFrame]) -> pl.DataFrame:
    """What a reader gives, its own errors in one line."""
    import polars as pl

    try:
        return read()
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
        raise DataError(f"{path}: not readable as a table: {first_line(error)}") from None


def _counted(
    path: Path, body: bytes, separator: str, width: int, said: tuple[int, str], heading: Set[bytes]
) -> tuple[list[int], int, bool]:  # fmt: skip
    """Blank lines, the number of lines, and whether a separator is within quotes, of the rows of a table.

    Lines without a filled cell count as blank ones, and so do those of the heading that a logger wrote again.

    Args:
        path, body, separator, width: of the table.
        said: number of its first line, and where its width is from.
        heading: its lines above the first row.
    """
    comma, blank, quoted, k = separator.encode(), list[int](), False, -1
    first, names = said
    plain = {comma, *(line[:1] for line in heading)}
    for k, line in enumerate(io.BytesIO(body)):
        count = line.count(comma) + 1
        none = line[:1] in plain and (line.strip() in heading or not line.strip(comma + b" \t\r\n"))
        if count == width and width > 1 and not none:
            continue
        if none or not line.strip():
            blank.append(k)
            continue
        if count != width and b'"' in line:
            count, quoted = len(quoted_cells(line.decode(), separator)), True
        if count != width:
            about = f"has {count} cells, {names} has {width}; complete or remove the line"
            raise DataError(f"{path}: line {first + k} {about}")
    return blank, k + 1, quoted


def cells_of(line: str, separator: str | None) -> list[str]:
    """Cells of a line without blanks and quotes around them; None separates by any white space."""
    if separator is None:
        return line.split()
    cells = quoted_cells(line, separator) if '"' in line else line.split(separator)
    return [cell.strip().strip('"').strip() for cell in cells]


def _put(line: bytes, separator: str | None) -> bytes:
    """A line with one character between its cells."""
    cells = line.split() if separator is None else line.split(separator.encode())
    return _UNIT.encode().join(cells)
