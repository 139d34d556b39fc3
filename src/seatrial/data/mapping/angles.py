"""Latitudes and longitudes as they are written: 63.44, 6326.47, 63 26 28.3 N; and those that cannot be one."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...core.parameters import unknown
from .. import Array, DataError
from .numbers import numbers, texts
from .tables import Table

if TYPE_CHECKING:
    import polars as pl

LATITUDE, LONGITUDE = ("latitude", 90.0, "NS"), ("longitude", 180.0, "EW")
"""What it is called, its largest value [deg], and its letters, positive first."""

_NUMBER = r"([0-9]+(?:[.][0-9]*)?)"
_LETTER = r"([A-Za-z]?)"
_PLAIN = rf"^{_LETTER}\s*([-+]?)\s*{_NUMBER}\s*[°º]?\s*{_LETTER}$"
_PARTS = rf"^{_LETTER}\s*([-+]?)\s*{_NUMBER}[°ºd:\s-]+{_NUMBER}?\s*['’′m:\s-]*{_NUMBER}?\s*[\"”″s'’′]*\s*{_LETTER}$"


_POINT = re.compile(r"(?:SRID=\d+;)?\s*POINT\s*[ZM]*\s*\(\s*(\S+)\s+([^\s)]+)(?:\s+[^\s)]+)*\s*\)", re.IGNORECASE)
_LETTERED = tuple((re.compile(form, re.IGNORECASE), turned) for form, turned in (
    (r"([-+\d].*?[NS])[\s,;/]*([-+\d].*[EW])", False), (r"([NS][\s:]*\d.*?)[\s,;/]*([EW][\s:]*\d.*)", False),
    (r"([-+\d].*?[EW])[\s,;/]*([-+\d].*[NS])", True), (r"([EW][\s:]*\d.*?)[\s,;/]*([NS][\s:]*\d.*)", True),
))  # fmt: skip
_BARE = re.compile(r"[(\[]?\s*([-+]?\d+(?:\.\d*)?)\s*[,;/\s]\s*([-+]?\d+(?:\.\d*)?)\s*[)\]]?")
_BARE_COMMA = re.compile(r"[(\[]?\s*([-+]?\d+(?:,\d*)?)(?:\s*[;/]\s*|\s+)([-+]?\d+(?:,\d*)?)\s*[)\]]?")


def halves(cell: str, decimal: str = ".", first: str = "latitude") -> tuple[str, str] | None:
    """Latitude and longitude of a cell that holds both, as texts; None where it does not.

    Args:
        cell: its text: 35 10.5N 139 42.1E, N35 10.5 E139 42.1, 35.175, 139.702, or POINT(139.702 35.175).
        decimal: the decimal mark.
        first: which of two bare numbers is the first.
    """
    text = cell.strip()
    if found := _POINT.fullmatch(text):
        return found[2], found[1]
    for form, turned in _LETTERED:
        if found := form.fullmatch(text):
            return (found[2], found[1]) if turned else (found[1], found[2])
    found = (_BARE_COMMA if decimal == "," else _BARE).fullmatch(text)
    return None if found is None else (found[1], found[2]) if first == "latitude" else (found[2], found[1])


def parted(table: Table, column: str, first: str) -> tuple[Table, str, str]:
    """The table with columns of the latitudes and longitudes of a column that holds both, and their names.

    Raises:
        DataError: a cell that does not hold both, naming file, column and row.
    """
    import polars as pl

    cells = texts(table, column)
    both = [None if cell is None else halves(cell, table.decimal, first) for cell in cells.to_list()]
    wrong = next((k for k, (cell, one) in enumerate(zip(cells, both, strict=True)) if cell and one is None), None)
    if wrong is not None:
        about = f"'{cells[wrong]:.40}' is no latitude and longitude such as 35 10.5N 139 42.1E or 35.175, 139.702"
        raise DataError(f"{table.at(column, wrong)}: {about}")
    names = (f"{column}, latitude", f"{column}, longitude")
    halved = {name: pl.Series([None if one is None else one[k] for one in both], dtype=pl.String)
              for k, name in enumerate(names)}  # fmt: skip
    return replace(table, frame=table.frame.with_columns(**halved)), *names


_SIZES = {"rad": 180.0 / math.pi, "1e-7 deg": 1e-7}
"""Degrees of the units in which angles are written as one number."""

_SILENT = 181.0
"""What AIS sends for a longitude that it does not have."""
_WHOLE = 1e6
"""Beyond what degrees and minutes in one number can be."""


def with_minutes(table: Table, whole: Array, column: str | None) -> Array:
    """Degrees with the minutes of a column of their own, away from zero; as they are without one.

    Raises:
        DataError: minutes below 0, or of 60 and more, naming file, column and row.
    """
    if column is None:
        return whole
    minutes = numbers(table, column)
    wrong = np.flatnonzero((minutes < 0.0) | (minutes >= 60.0))
    if wrong.size:
        raise DataError(f"{table.at(column, int(wrong[0]))}: {minutes[wrong[0]]:.9g} are no minutes of 0 to 60")
    return whole + np.copysign(minutes / 60.0, whole)


def degrees(table: Table, column: str, letter: str | None, format: str, kind: tuple[str, float, str]) -> Array:
    """A latitude or longitude [deg], north and east positive, shape (rows,).

    Args:
        table: the file.
        column: of the angle.
        letter: column of its letter; None where it is beside the angle, or there is none.
        format: as in `schema.Position`.
        kind: `LATITUDE` or `LONGITUDE`.

    Raises:
        DataError: no angle, another letter, minutes of 60 or more, or no place of the earth; naming file, column, row.
    """
    if table.frame[column].dtype.is_numeric() and letter is None and format != "dms":
        raw = numbers(table, column)
    else:
        raw = _written(table, column, letter, format, kind)
    found = _of_minutes(table, column, raw) if format == "ddmm.mmm" else raw * _SIZES.get(format, 1.0)
    known = found[np.isfinite(found)]
    if kind is LONGITUDE and known.size and known.min() >= 0.0 and _SILENT < np.median(known) <= known.max() <= 360.0:
        found = np.where(found > kind[1], found - 360.0, found)  # counted to the east all the way round
    over = np.flatnonzero(np.abs(found) > kind[1])
    if over.size:
        row, what = int(over[0]), f"{raw[over[0]]:.9g} is no {kind[0]}"
        likely = 'in degrees and minutes: format = "ddmm.mmm"'
        if np.abs(raw[row]) > _WHOLE:
            likely = 'in whole numbers: format = "1e-7 deg"'
        elif kind is LATITUDE and np.abs(raw[row]) <= LONGITUDE[1]:
            likely = "exchanged with longitude"
        raise DataError(f"{table.at(column, row)}: {what}; is it {likely}?")
    return found


def _written(table: Table, column: str, letter: str | None, format: str, kind: tuple[str, float, str]) -> Array:
    """Numbers of texts, times the sign of their letter."""
    import polars as pl

    cells = texts(table, column)
    if table.decimal == ",":
        cells = cells.str.replace_all(",", ".", literal=True)
    groups = [
        cells.str.extract(_PARTS if format == "dms" else _PLAIN, k) for k in range(1, 7 if format == "dms" else 5)
    ]
    wrong = np.flatnonzero((groups[1].is_null() & cells.is_not_null()).to_numpy())
    if wrong.size:
        example = {"deg": "63.4412", "ddmm.mmm": "6326.472", "dms": "63 26 28.3 N", "rad": "1.107"}.get(
            format, "634412000"
        )
        about = f"'{cells[int(wrong[0])]:.40}' is no {kind[0]} such as {example}; see format under position"
        raise DataError(f"{table.at(column, int(wrong[0]))}: {about}")
    parts = [one.cast(pl.Float64).to_numpy() for one in groups[2:-1]]
    value = parts[0]
    for part, size in zip(parts[1:], (60.0, 3600.0), strict=False):
        some = np.nan_to_num(part)
        _refuse_sixties(table, column, some)
        value = value + some / size
    beside = groups[0].fill_null("") + groups[-1].fill_null("")
    beside = beside if letter is None else texts(table, letter).fill_null("")
    return (
        value
        * np.where((groups[1] == "-").fill_null(False).to_numpy(), -1.0, 1.0)
        * _signs(table, column, beside, kind)
    )


def _signs(table: Table, column: str, beside: pl.Series, kind: tuple[str, float, str]) -> Array:
    """Signs of the letters N, S, E, W."""
    words = beside.str.to_uppercase()
    signs = np.ones(len(words))
    for word in words.unique().to_list():
        rows = (words == word).to_numpy()
        if word not in ("", *kind[2]):
            row = int(np.flatnonzero(rows)[0])
            about = unknown(word, list(kind[2]), f"letter of a {kind[0]}")
            swapped = "; are latitude and longitude exchanged?" if word in "NSEW" else ""
            raise DataError(f"{table.at(column, row)}: {about}{swapped}")
        signs[rows] = -1.0 if word == kind[2][1] else 1.0
    return signs


def _of_minutes(table: Table, column: str, raw: Array) -> Array:
    whole = np.trunc(np.abs(raw) / 100.0)
    minutes = np.abs(raw) - 100.0 * whole
    _refuse_sixties(table, column, np.nan_to_num(minutes), raw)
    return np.sign(raw) * (whole + minutes / 60.0)


def _refuse_sixties(table: Table, column: str, part: Array, raw: Array | None = None) -> None:
    over = np.flatnonzero(part >= 60.0)
    if over.size:
        row = int(over[0])
        said = "" if raw is None or not math.isfinite(raw[row]) else f" in {raw[row]:.9g}"
        raise DataError(f"{table.at(column, row)}: {part[row]:.6g} minutes or seconds{said}; is it in decimal degrees?")
