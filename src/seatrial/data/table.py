"""Text files of numbers, with errors that name file, column and line.

The readers share it: the bytes of a log become a table of floats only here.
"""

from __future__ import annotations

import csv
import difflib
import math
from collections.abc import Container, Generator, Iterable, Sequence
from contextlib import contextmanager
from itertools import repeat
from pathlib import Path

import numpy as np

from ..core.files import no_file
from . import Array, DataError

_LONGEST = 1e10
"""Largest time in seconds; those since 1970 are below."""

_NAMED = 8
"""Columns that an error names."""

_BLOCK = 500
"""Rows that are read at once."""

_LOOKED = 65536
"""Bytes at the beginning of a file in which a binary one has a zero."""


@contextmanager
def within(place: object) -> Generator[None]:
    """Begin the text of a `DataError` with the place it is from."""
    try:
        yield
    except DataError as error:
        raise DataError(f"{place}: {error}") from None


def existing(path: str | Path) -> Path:
    """The path as a `Path` if it exists; otherwise an error that lists similar names."""
    here = Path(path)
    if why := no_file(here):
        raise DataError(f"{here}: {why}")
    try:
        if here.exists():
            return here
    except OSError as error:
        raise DataError(f"{str(here)[:80]}...: {error.strerror}") from None
    folder = here.parent
    if not folder.is_dir():
        raise DataError(f"{here}: no such file, and no folder {folder}")
    names = sorted(entry.name for entry in folder.iterdir())
    near = difflib.get_close_matches(here.name, names, n=4, cutoff=0.5)
    held = f"near: {', '.join(near)}" if near else f"the folder holds: {', '.join(names[:8]) or 'nothing'}"
    raise DataError(f"{here}: no such file; {held}")


def quoted_cells(line: str, delimiter: str) -> list[str]:
    """Cells of a line of which some may be within quotes; with one of over 131 072 characters it is one cell."""
    try:
        return next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:
        return [line]


def lines_of(path: str | Path, encoding: str = "utf-8-sig") -> list[str]:
    """Lines of a text file.

    Raises:
        DataError: no such file, a folder, an empty or a binary file, another encoding.
    """
    raw = bytes_of(path)
    if b"\0" in raw[:_LOOKED]:
        raise DataError(f"{path}: a binary file, not text; expected rows of numbers")
    try:
        return raw.decode(encoding).splitlines()
    except (UnicodeDecodeError, LookupError) as error:
        raise DataError(f"{path}: not readable as {encoding} text ({error})") from error


def bytes_of(path: str | Path) -> bytes:
    """The bytes of a file that is not empty.

    Raises:
        DataError: no such file, a folder, an empty file, one that may not be read.
    """
    here = existing(path)
    if here.is_dir():
        raise DataError(f"{here}: is a folder; name one file in it")
    try:
        raw = here.read_bytes()
    except OSError as error:
        raise DataError(f"{here}: cannot be read: {error.strerror}") from error
    if not raw.strip(b"\0 \t\r\n"):
        raise DataError(f"{here}: the file is empty; it should have a header and rows of numbers")
    return raw


def split_row(line: str, delimiter: str | None) -> list[str]:
    """Cells of a line; None separates by any white space."""
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def once(path: str | Path, line: int, heads: Sequence[str], wanted: Iterable[str]) -> None:
    """Refuse a header that has a wanted column twice, as it is ambiguous.

    Raises:
        DataError: naming file, column and line.
    """
    for name in wanted:
        if heads.count(name) > 1:
            raise DataError(f"{path}: column '{name}', line {line}: {heads.count(name)} columns of this name; keep one")


def numbers(
    path: str | Path, lines: Sequence[str], first: int, columns: Sequence[str], delimiter: str | None,
    gaps: Container[str] = (),
) -> tuple[Array, list[int]]:  # fmt: skip
    """Table of floats from the lines after the header; empty cells become NaN, blank lines are left out.

    Args:
        path: file, for the errors.
        lines: all lines of the file.
        first: index of the first line of numbers.
        columns: names of the columns, for the errors and the count.
        delimiter: what separates cells; None for white space.
        gaps: words for a missing value, such as "--"; empty cells, nan, na and null are known.

    Returns:
        The table, shape (rows, columns), and the line number of each row (1 is the first of the file).
    """
    kept = [k for k in range(first, len(lines)) if lines[k].strip()]
    parts: list[Array] = []
    for k in range(0, len(kept), _BLOCK):
        some = kept[k : k + _BLOCK]
        plain = _plain([lines[k] for k in some], len(columns), delimiter)
        parts.append(_told(path, lines, some, columns, delimiter, gaps) if plain is None else plain)
    table = np.concatenate(parts) if parts else np.zeros((0, len(columns)))
    infinite = np.argwhere(np.isinf(table))
    if infinite.size:
        row, column = infinite[0]
        raise DataError(
            f"{path}: column '{columns[column]}', line {kept[row] + 1}: infinite; "
            "give a finite number, or leave the cell empty for a gap"
        )
    return table, [k + 1 for k in kept]


def _plain(rows: Sequence[str], count: int, delimiter: str | None) -> Array | None:
    """Table of rows that hold numbers alone, read at once; None where one holds more, or lacks a cell."""
    if delimiter is None or {*map(str.count, rows, repeat(delimiter))} != {count - 1}:
        return None
    try:  # which knows no digits but those of ASCII, and none apart by underscores
        return np.loadtxt(rows, delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        return None


def _told(
    path: str | Path, lines: Sequence[str], kept: Sequence[int], columns: Sequence[str], delimiter: str | None,
    gaps: Container[str],
) -> Array:  # fmt: skip
    """Table of some lines, cell by cell where they hold more than numbers."""
    flat: list[float] = []
    for k in kept:
        cells = lines[k].split(delimiter)
        if len(cells) != len(columns):
            raise DataError(
                f"{path}: line {k + 1} has {len(cells)} cells, not {len(columns)} ({_listed(columns)}); "
                "complete or remove the line"
            )
        try:
            # whole rows only: extend would keep half of a bad one
            flat += list(map(float if lines[k].isascii() and "_" not in lines[k] else decimal, cells))
        except ValueError:
            flat.extend(_number(path, k, *pair, gaps) for pair in zip(columns, cells, strict=True))
    return np.array(flat, dtype=np.float64).reshape(len(kept), len(columns))


def decimal(text: str) -> float:
    """The number of a text in the usual notation.

    Raises:
        ValueError: no number, or one in Python's notation only: ``1_000``, full-width digits.
    """
    if "_" in text or not text.strip().isascii():
        raise ValueError(text)
    return float(text)


def _listed(columns: Sequence[str]) -> str:
    """Names of columns, the first few."""
    return ", ".join(columns[:_NAMED]) + (", ..." if len(columns) > _NAMED else "")


def _number(path: str | Path, k: int, column: str, cell: str, gaps: Container[str]) -> float:
    text = cell.strip().strip('"').strip()
    if text.lower() in ("", "nan", "na", "null") or text in gaps:
        return math.nan
    try:
        return decimal(text)
    except ValueError:
        raise DataError(
            f"{path}: column '{column}', line {k + 1}: '{text[:40]}' is not a number; "
            "give a number with a decimal dot, or leave the cell empty for a gap"
        ) from None


def continued(table: Array, time: int) -> tuple[Array, list[str]]:
    """Continue time over empty rows at the end at the median step; also return the processing steps.

    Loggers pad; the padding is a gap, and each row of a gap needs a time.
    """
    filled = ~np.isnan(table).all(axis=1)
    last = int(np.flatnonzero(filled)[-1]) if filled.any() else -1
    count = len(table) - 1 - last
    if count == 0 or last < 1:
        return table, []
    out = table.copy()
    step = float(np.nanmedian(np.diff(table[: last + 1, time])))
    out[last + 1 :, time] = table[last, time] + step * np.arange(1, count + 1)
    return out, [f"time continued over {count} empty rows at the end"]


def check_time(path: str | Path, column: str, t: Array, lines: Sequence[int], advice: str = "") -> None:
    """Refuse missing time, time that repeats or goes back (with advice), and recordings of fewer than two rows.

    Raises:
        DataError: naming file, column and line.
    """
    if t.size < 2:
        raise DataError(f"{path}: {t.size} row{'s' * (t.size != 1)} of numbers; a trial needs at least 2")
    found = disorder(t, advice)
    if found is not None:
        raise DataError(f"{path}: column '{column}', line {lines[found[0]]}: {found[1]}")


def disorder(t: Array, advice: str = "") -> tuple[int, str] | None:
    """The first row without a time, or whose time is out of reach, repeats or goes back, and what is wrong with it."""
    missing, far = np.flatnonzero(~np.isfinite(t)), np.flatnonzero(np.abs(t) > _LONGEST)
    back = np.flatnonzero(t[1:] <= t[:-1]) + 1
    if missing.size:
        return int(missing[0]), "no time; every row needs its time"
    if far.size:
        k = int(far[0])
        return k, f"time is {t[k]:.9g} s; {_LONGEST:g} s, 300 years, is the most: is it in ms or us?"
    if back.size:
        k = int(back[0])
        what = "repeats" if t[k] == t[k - 1] else "goes back"
        return k, (f"time {what} ({t[k - 1]:.9g} then {t[k]:.9g}); it must increase from row to row "
                   f"({back.size} such rows){advice}")  # fmt: skip
    return None
