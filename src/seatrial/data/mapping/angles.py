"""Latitudes and longitudes as they are written: 63.44, 6326.47, 63 26 28.3 N; and those that cannot be one."""

from __future__ import annotations

import math
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
_PARTS = rf"^{_LETTER}\s*([-+]?)\s*{_NUMBER}[°ºd:\s]+{_NUMBER}?\s*['’′m:\s]*{_NUMBER}?\s*[\"”″s'’′]*\s*{_LETTER}$"


_SIZES = {"rad": 180.0 / math.pi, "1e-7 deg": 1e-7}
"""Degrees of the units in which angles are written as one number."""

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
