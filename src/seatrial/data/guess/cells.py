"""Cells of a column: numbers, numbers with letters, angles in minutes, stamps, clocks; and the words of a gap."""

from __future__ import annotations

import math
import re
from collections import Counter
from typing import Literal

import numpy as np

from ...core.values import dataclass, field, replace
from .. import Array
from ..mapping.angles import halves
from .layout import Table, number, ungrouped
from .naming import Meaning, meanings, parted, tokens, unit_in_name, unit_of, words_of_names

Kind = Literal["number", "letters", "minutes", "dms", "iso", "stamp", "date", "clock", "text", "empty"]

_LETTERS = re.compile(r"(?P<number>[+-]?[\d.,]+(?:[eE][+-]?\d+)?)\s*°?\s*(?P<letters>[A-Za-z]{1,3})\.?")
_SPOKEN = re.compile(r"(?P<number>[+-]?[\d.,]+(?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s.,:-].{0,11}|1/\w+)")
_SIDES = frozenset("NSEWPOLB")
_PROBED = 200
_NAMED = 0.45
"""Score from which on a name says what it is."""
_BEFORE = re.compile(r"(?P<letters>[a-z]{1,4}|starboard|steuerbord|styrbord|backbord|babord|bakbord)"
                     r"\s*(?P<number>[\d.,]+)", re.IGNORECASE)  # fmt: skip
_DMS = re.compile(r"(?P<h>[NSEWO])?\s*(?P<d>\d{1,3})\s*[°ºd:-]\s*(?P<m>[\d.,]+)\s*['′m:-]?\s*"
                  r"(?:(?P<s>[\d.,]+)\s*(?:\"|″|''|(?-i:s))?)?\s*(?P<e>[NSEWO])?", re.IGNORECASE)  # fmt: skip
_SPACED = re.compile(r"(\d{1,3})\s+(?=\d)")
_ISO = re.compile(r"\d{4}-?\d\d-?\d\d[T _]\d\d:?\d\d(:?\d\d([.,]\d+)?)?\s*(Z|UTC|[+-]\d\d:?\d\d)?")
_STAMP = re.compile(r"\d{1,4}[./-](?:\d{1,2}|[A-Z][a-z]{2})[./-]\d{1,4}[T ]+\d{1,2}:\d\d(:\d\d([.,]\d+)?)?.*")
_DOTTED = re.compile(r"([01]?\d|2[0-3])\.[0-5]\d\.[0-5]\d([.,]\d+)?")
_DAYS = 3
"""Different dates in a column at most: what looks like more are times with dots, 13.22.41."""
_DATE = re.compile(r"\d{1,4}[./-](?:\d{1,2}|[A-Z][a-z]{2})[./-]\d{1,4}|20\d{6}")
_CLOCK = re.compile(r"\d{1,2}:\d\d(:\d\d([.,]\d+)?)?(\s*[AaPp]\.?[Mm]\.?)?")
_FORMS: tuple[tuple[Kind, re.Pattern[str]], ...] = (
    ("iso", _ISO),
    ("stamp", _STAMP),
    ("date", _DATE),
    ("clock", _CLOCK),
)
MIDSHIPS = ("midships", "midship", "amidships", "mid", "mittschiffs", "midtskips", "zero")
"""Words for a rudder that is not over."""

_GAP = ("", "nan", "na", "null")
"""Words that every reader takes for a gap."""


@dataclass(frozen=True)
class Column:
    """A column of a log.

    Attributes:
        table: it is from.
        head: as it is in the file.
        name: without its unit.
        unit: symbol of `data.units`; empty where nothing says it.
        where: what says the unit: "header", "row of units", "name", "cells".
        kind: of its cells.
        values: its numbers, NaN for a gap or where a cell is none; degrees for angles in minutes.
        letters: after its numbers, with how often they occur.
        missing: words that stand for a gap, beside the usual ones.
        means: what its name may mean, best first.
        cells: its text.
        unread: what stands in the place of a unit and is none that is known.
        half: 0 or 1 for the first or second part of cells that hold a latitude and a longitude; None for whole cells.
    """

    table: Table
    head: str
    name: str
    unit: str
    where: str
    kind: Kind
    values: Array
    letters: dict[str, int]
    missing: tuple[str, ...]
    means: tuple[Meaning, ...]
    cells: tuple[str, ...] = field(repr=False)
    half: int | None = None
    unread: str = ""

    @property
    def said(self) -> str:
        """The column and where it is, for sentences."""
        return f"'{self.head}'"

    @property
    def varies(self) -> bool:
        """Whether its numbers are not all the same."""
        good = self.values[np.isfinite(self.values)]
        return good.size > 1 and bool(good.min() < good.max())

    def score(self, role: str) -> float:
        """How much its name says that it is this quantity."""
        return next((one.score for one in self.means if one.role == role), 0.0)


def columns_of(table: Table, around: str = "") -> list[Column]:
    """The columns of a table, their names read together with that of the file where they say little alone.

    A column that holds latitudes and longitudes is two of the same head.
    """
    return [part for k in range(len(table.heads)) for part in _placed(_column(table, k, around))]


_PLACES = frozenset(("position", "pos", "place", "location", "latlon", "latlong", "coordinates", "coordinate", "coords",
                     "geo", "geom", "geometry", "point", "gps", "gnss", "fix", "wkt", "posisjon", "standort", "ichi",
                     "posicion", "posizione", "positie"))  # fmt: skip


def _placed(column: Column) -> list[Column]:
    """A column as it is, or as its latitudes and longitudes where it holds both."""
    mark = column.table.layout.decimal
    filled = [cell for cell in column.cells if cell.strip().lower() not in _GAP]
    plain = all(character in " 0123456789.,;/+-()[]" for cell in filled[:_PROBED] for character in cell)
    if column.kind != "text" or (plain and not _PLACES & set(tokens(column.name))):
        return [column]
    both = [halves(cell, mark) for cell in column.cells]
    if sum(one is not None for one in both) < 0.9 * len(filled):
        return [column]
    words = tuple(sorted({c for c, one in zip(column.cells, both, strict=True) if one is None and c in filled}))[:12]
    parts = [tuple("" if one is None else one[k] for one in both) for k in (0, 1)]
    read = [_read(_spaced(cells), mark)[:3] for cells in parts]
    last = bool(
        plain and np.nanmax(np.abs(read[0][1]), initial=0.0) > 90.0
    )  # no latitude, so the longitude comes first
    return [
        replace(column, kind=read[k][0], values=read[k][1], letters=read[k][2], missing=words, cells=parts[k],
                means=tuple(meanings("latitude" if k == last else "longitude")), half=k)
        for k in (0, 1)
    ]  # fmt: skip


def _column(table: Table, k: int, around: str) -> Column:
    head, cells = table.heads[k], ungrouped(table.columns[k], table.layout.decimal)
    name, bracket = parted(head)
    unit, where = unit_of(bracket), "header"
    if not unit and table.units[k]:
        unit, where = unit_of(table.units[k]), "row of units"
    if not unit:
        unit, where = unit_in_name(name), "name"
    beside, bare = spoken(cells, table.layout.decimal)
    if beside:
        cells = bare
        unit, where = (unit, where) if unit else (beside, "cells")
    means = tuple(meanings(name, around))
    if unit in ("rpm", "1/s") and not any(one.role == "n_P" and one.score >= _NAMED for one in means):
        means = tuple(meanings(f"{name} rpm", around))  # "Engine (rpm)" says with its unit what it is
    angle = bool(means) and means[0].role in ("latitude", "longitude")
    kind, values, letters, missing = _read(_spaced(cells) if angle else cells, table.layout.decimal)
    unread = "" if unit else next((text for text in (bracket, table.units[k]) if _like_unit(text)), "")
    return Column(table, head, name, unit, where if unit else "", kind, values, letters, missing, means, cells,
                  unread=unread)  # fmt: skip


def _like_unit(text: str) -> bool:
    """Whether a text in the place of a unit may be one, and no word that says more about the name."""
    return bool(re.fullmatch(r"[^\W\d_][\w/^*.·° -]{0,9}", text.strip())) and not words_of_names(text)


def _spaced(cells: tuple[str, ...]) -> tuple[str, ...]:
    """Cells of an angle with the sign of degrees where only a blank is between them and the minutes."""
    return tuple(_SPACED.sub(r"\1° ", cell, count=1) for cell in cells)


def spoken(cells: tuple[str, ...], mark: str) -> tuple[str, tuple[str, ...]]:
    """The unit that stands beside the numbers of a column, ``5.2 kn``, and the cells without it; empty without one."""
    filled = [cell.strip() for cell in cells if cell.strip().lower() not in _GAP][:_PROBED]
    matches = [found for cell in filled if (found := _SPOKEN.fullmatch(cell))]
    pairs = [one for one in matches if number(one["number"], mark) is not None]
    units = {unit_of(one["unit"]) for one in pairs if one["unit"] not in _SIDES}
    if len(pairs) < 0.5 * len(filled) or len(units) != 1 or not (unit := units.pop()):
        return "", cells
    parted = ((cell, _SPOKEN.fullmatch(cell.strip())) for cell in cells)
    return unit, tuple(cell if one is None or unit_of(one["unit"]) != unit else one["number"] for cell, one in parted)


def _read(cells: tuple[str, ...], mark: str) -> tuple[Kind, Array, dict[str, int], tuple[str, ...]]:
    """Kind of the cells, their numbers, letters, and the words that stand for a gap."""
    filled = [cell for cell in cells if cell.strip().lower() not in _GAP]
    none = np.full(len(cells), math.nan)
    if not filled:
        return "empty", none, {}, ()
    numbers = np.array([math.nan if (found := number(cell, mark)) is None else found for cell in cells])
    counts = Counter(filled)
    if len(counts) > _DAYS and all(_DOTTED.fullmatch(cell.strip()) for cell in filled):
        return "text", none, {}, ()
    for kind, form in _FORMS:
        if (
            kind == "date"
            and np.isfinite(numbers).sum() > 0.5 * len(filled)
            and not all(c.startswith("20") and len(c) == 8 for c in filled)
        ):
            continue
        if sum(bool(form.fullmatch(cell.strip())) for cell in filled) > 0.9 * len(filled):
            return kind, none, {}, ()
    if np.isfinite(numbers).sum() >= 0.5 * len(filled):
        return "number", numbers, {}, tuple(word for word in counts if number(word, mark) is None)[:12]
    for read in (_lettered, _minutes):
        kind, values, letters = read(cells, mark)
        if np.isfinite(values).sum() > 0.8 * len(filled):
            gaps = {c for c, v in zip(cells, values, strict=True) if math.isnan(v)} - {
                c for c in cells if c.strip().lower() in _GAP
            }
            return kind, values, letters, tuple(sorted(gaps))[:12]
    return "text", none, {}, ()


def _lettered(cells: tuple[str, ...], mark: str) -> tuple[Kind, Array, dict[str, int]]:
    """Numbers with a letter after or before them, ``12.3 S``; letters sign nothing here."""
    values, letters = np.full(len(cells), math.nan), Counter[str]()
    for k, cell in enumerate(cells):
        plain = cell.strip()
        if plain.lower() in MIDSHIPS:
            values[k] = 0.0
            letters.update([plain])
            continue
        found = _LETTERS.fullmatch(plain) or _BEFORE.fullmatch(plain)
        value = number(found["number"], mark) if found else number(plain, mark)
        if value is not None:
            values[k] = value
            letters.update([found["letters"]] if found else [])
    return "letters", values, dict(letters)


def _minutes(cells: tuple[str, ...], mark: str) -> tuple[Kind, Array, dict[str, int]]:
    """Degrees and minutes, ``63° 26.47' N``, or degrees, minutes and seconds, in degrees."""
    values, letters, seconds = np.full(len(cells), math.nan), Counter[str](), 0
    for k, cell in enumerate(cells):
        found = _DMS.fullmatch(cell.strip())
        if not found:
            continue
        parts = [number(found[key], mark) if found[key] else 0.0 for key in ("d", "m", "s")]
        if any(part is None for part in parts):
            continue
        seconds += found["s"] is not None
        letter = (found["h"] or found["e"] or "").upper()
        letters.update([letter] if letter else [])
        values[k] = sum(float(part or 0.0) / 60.0**j for j, part in enumerate(parts)) * (
            -1.0 if letter in ("S", "W") else 1.0
        )
    return "dms" if seconds else "minutes", values, dict(letters)
