"""The files of a folder as logs: one file, files alike, topics of one trial, or pieces of one."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass, replace
from .. import Array, DataError
from ..formats import known_by_suffix
from ..sheets import ARRAYS, PARQUET, WORKBOOKS, packed, sheets_of
from ..table import existing
from .cells import Column, columns_of
from .clock import Clock, clocks
from .layout import ROWS, Layout, Table, groups, is_value, read_text, told_apart
from .naming import tokens, unit_of
from .roles import Signal, sided, signals, trial_column
from .rows_of_names import widened

_ANGLES = ("heading", "yaw", "cog", "gamma_A", "gamma_T", "wind_direction", "alpha")
_FEWEST = 20
_PIECES = 20.0
"""Steps between two pieces of one log at most."""


@dataclass(frozen=True)
class Topic:
    """One file of a log.

    Attributes:
        name: its path below the folder of the trial.
        table, columns: of it.
        clock: its time; None where nothing in it is one.
    """

    name: str
    table: Table
    columns: tuple[Column, ...]
    clock: Clock | None


@dataclass(frozen=True)
class Log:
    """One trial, as the guess sees it.

    Attributes:
        main: the file whose times are the rows.
        topics: the others, where each has rows of its own.
        t: time of the rows [s].
        piece: the rows of its longest trial, where the file holds several.
        found: quantities on these rows, by role.
        pattern: of the files of a trial; empty where a trial is one file.
        join: "rows" where files alike are pieces of one log, else "time".
        others: the other files with the same columns.
        ship: column that says whose row it is, where ships take turns; the rows here are of the one with most.
        unread: files of the trial in which nothing is known.
        notes: what else is to be said, for the head of the mapping.
    """

    main: Topic
    topics: tuple[Topic, ...]
    t: Array
    piece: slice
    found: Mapping[str, Signal]
    pattern: str = ""
    join: str = "time"
    notes: tuple[str, ...] = ()
    others: tuple[Topic, ...] = ()
    ship: str = ""
    unread: tuple[Topic, ...] = ()


def find_log(src: Path) -> Log:
    """The log of a file or a folder; of many trials alike the longest.

    Raises:
        DataError: no table, none that can be read, tables that have nothing to do with each other.
    """
    base = src if src.is_dir() else src.parent
    paths = [src] if src.is_file() else sorted(p for p in src.rglob("*") if p.suffix.lower() in TABLES and p.is_file())
    if not paths:
        raise DataError(f"{src}: no table here; " + (known_by_suffix(src) or f"looked for *{', *'.join(TABLES)}"))
    tables, notes = _tables(paths)
    kinds: dict[tuple[str, ...], list[Table]] = {}
    for table in tables:
        kinds.setdefault(tuple(sorted(table.heads)), []).append(table)
    if len(kinds) == 1:
        return _alike(base, [*map(told_apart, tables)], notes)
    folder, pattern, chosen = _trial_of(base, kinds)
    return _topics(folder, pattern, chosen, notes)


def _tables(paths: Sequence[Path]) -> tuple[list[Table], list[str]]:
    """The files that are tables, and a note on the others."""
    tables: list[Table] = []
    failed: list[str] = []
    for path in paths:
        try:
            tables += map(widened, read_tables(path))
        except DataError as error:
            failed.append(str(error))
    if not tables:
        known = known_by_suffix(paths[0])
        raise DataError(f"{failed[0]}; {known}" if known else failed[0])
    return tables, [f"left out: {said}" for said in failed]


def _topic(base: Path, table: Table, context: bool) -> Topic:
    name = table.path.relative_to(base).as_posix()
    around = name.rpartition(".")[0] if context else ""
    columns = _signed(_gapped(columns_of(table, around)))
    clock = next(iter(clocks(columns)), None)
    if clock is None and len(table.columns[0]) > 2:
        turned = replace(table, columns=tuple(column[::-1] for column in table.columns))
        columns = _signed(_gapped(columns_of(turned, around)))
        clock = next(iter(clocks(columns)), None)
        if clock is not None:
            answer = replace(clock.answer, evidence=f"{clock.answer.evidence}; the newest row comes first")
            keys = {**clock.keys, "sort": "true"}
            return Topic(name, turned, columns, replace(clock, keys=keys, answer=answer))
        columns = _signed(_gapped(columns_of(table, around)))
    return Topic(name, table, columns, clock)


def _alike(base: Path, tables: Sequence[Table], notes: list[str]) -> Log:
    """Files with the same columns: each a trial, or pieces of one; the one whose rudder moves most is looked at."""
    ship = next((head for table in tables if (head := _ship_column(table))), "")
    topics = [_topic(base, _of_one(table, ship), False) for table in tables]
    moved = [_moved(one) for one in topics]
    span = max(most for _, most in moved) or 1.0
    longest = zip(topics, moved, strict=True)
    main, _ = max(longest, key=lambda one: (round(one[1][0] / span), len(one[0].table.columns[0])))
    others = tuple(one for one in topics if one is not main)
    pattern, join = "", "time"
    if others and len({one.table.path for one in topics}) == len(topics) and _pieces(topics):
        pattern, join = f"*{main.table.path.suffix}", "rows"
        notes = [*notes, f"{len(tables)} files follow each other in time: pieces of one log"]
    elif others:
        notes = [
            *notes,
            f"{len(tables)} {'files' if main.table.layout.sheet != '*' else 'sheets'} with the same columns, each a "
            f"trial; what is said here is of {main.name}",
        ]
    clock = main.clock
    t = clock.t if clock else np.arange(len(main.table.columns[0]), dtype=float)
    found = sided(signals(main.columns, clock.heads if clock else ()))
    return Log(main, (), t, _longest(main.columns, t), found, pattern, join, tuple(notes), others, ship)


_SHIPS = ("mmsi", "mmsi number", "imo", "vessel id", "ship id", "boat id", "vesselid", "shipid", "source id")


def _ship_column(table: Table) -> str:
    """The column that says whose row it is, where the rows of several ships alternate; empty without one."""
    for head, cells in zip(table.heads, table.columns, strict=True):
        changes = sum(a != b for a, b in pairwise(cells))
        if " ".join(tokens(head)) in _SHIPS and changes >= len(set(cells)) > 1:
            return head
    return ""


def _of_one(table: Table, ship: str) -> Table:
    """The rows of the ship that has most of them; the table as it is without a column of ships."""
    if not ship or ship not in table.heads:
        return table
    cells = table.columns[table.heads.index(ship)]
    most = Counter(cells).most_common(1)[0][0]
    rows = [k for k, cell in enumerate(cells) if cell == most]
    return replace(table, columns=tuple(tuple(column[k] for k in rows) for column in table.columns))


_SILENT = {"latitude": (91.0, 90.0), "longitude": (181.0, 180.0), "heading": (511.0, 360.0), "sog": (102.3, 102.2)}
"""What AIS sends for a quantity that it does not have, and the most that it can be: a heading may count turns."""

_NO_COURSE = (360.0, 359.9)
"""What AIS sends for a course that it does not have; of others it is north, so that one of the above is a witness."""

_FILLS = (-99.0, -999.0, -9999.0, -99999.0, 999.0, 9999.0, 99999.0, 999.9, -999.9, -32768.0,
          32767.0, 3276.7, 327.67, 65535.0, 6553.5, 655.35)  # fmt: skip
"""Numbers for none: nines, and the last ones of two bytes with no, one or two decimals."""
_APART = 0.3


def _gapped(columns: Sequence[Column]) -> tuple[Column, ...]:
    """The columns with the numbers that stand for no value as gaps, among their words of a gap."""
    of_ais = any(one.kind == "number" and np.isin(_silent(one)[0], one.values) for one in columns)
    silent = (_NO_COURSE if of_ais and _role(one) == "cog" else _silent(one) for one in columns)
    return tuple(_without(one, *none) if one.kind == "number" else one
                 for one, none in zip(columns, silent, strict=True))  # fmt: skip


def _role(column: Column) -> str:
    return column.means[0].role if column.means else ""


def _silent(column: Column) -> tuple[float, float]:
    return _SILENT.get(_role(column), (math.nan, 0.0))


def _without(column: Column, silent: float, most: float) -> Column:
    good = column.values[np.isfinite(column.values)]
    none = {silent} if silent in good and (np.abs(good[good != silent]) <= most).all() else set[float]()
    for one in _FILLS:
        rest = np.abs(good[good != one])
        if one in good and rest.size and rest.max() < _APART * abs(one):
            none.add(one)
    if not none:
        return column
    gone = np.isin(column.values, list(none))
    words = tuple(dict.fromkeys(cell.strip() for cell, k in zip(column.cells, gone, strict=True) if k))
    if gone[np.isfinite(column.values)].all():
        return replace(column, kind="empty")
    return replace(column, values=np.where(gone, np.nan, column.values), missing=(*column.missing, *words))


_HALVES = (("latitude", "N", "S"), ("longitude", "E", "W"))
"""An angle, and the letters of its sides, positive first."""


def _signed(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """Latitudes and longitudes with the sign of the letter beside them, or in a column of its own."""
    held = [[cell.strip().upper() for cell in column.cells] for column in columns]
    out: list[Column] = []
    for column in columns:
        role = column.means[0].role if column.means else ""
        for name, plus, minus in _HALVES if column.kind in ("letters", "number") else ():
            own = [cell.strip().upper() for cell in column.cells] if column.letters else next(
                (some for some in held if {plus, minus} >= {*some} - {""} and any(some)), None)  # fmt: skip
            if role == name and own is not None and (column.values >= 0.0)[np.isfinite(column.values)].all():
                south = np.array([cell.startswith(minus) or cell.endswith(minus) for cell in own])
                column = replace(column, values=np.where(south, -column.values, column.values))
        out.append(column)
    return tuple(out)


def _moved(topic: Topic) -> tuple[float, float]:
    """How far the rudder goes to and fro, and its range; noise alone goes far in a small one.

    Without a rudder it is two motors, as far as both together and one against the other go, else the heading.
    """
    found = signals(topic.columns, topic.clock.heads if topic.clock else ())
    pair = next(((found[f"{one}_1"].values, found[f"{one}_2"].values) for one in ("throttle", "force")
                 if "delta" not in found and {f"{one}_1", f"{one}_2"} <= set(found)), None)  # fmt: skip
    values = next((found[role].values for role in ("delta", "heading", "yaw", "r") if role in found), np.zeros(2))
    ways = [_to_and_fro(one) for one in ((pair[0] + pair[1], pair[0] - pair[1]) if pair else (values,))]
    return min(far for far, _ in ways), max(range_ for _, range_ in ways)


def _to_and_fro(values: Array) -> tuple[float, float]:
    some = values[np.isfinite(values)]
    some = some[:: max(some.size // 100, 1)]
    return (float(np.abs(np.diff(some)).sum()), float(np.ptp(some))) if some.size else (0.0, 0.0)


def leap(t: Array) -> float | None:
    """A leap of time [s] that divides a file into trials; None where nothing does."""
    steps = np.diff(t[np.isfinite(t)])
    ahead = steps[steps > 0]
    if ahead.size < 50:
        return None
    large = ahead[ahead > max(100.0 * float(np.median(ahead)), 30.0)]
    return float(f"{0.5 * large.min():.2g}") if 1 <= large.size < ahead.size / 50 else None


def _longest(columns: Sequence[Column], t: Array) -> slice:
    """Rows of the longest trial of a file."""
    column, gap = trial_column(columns, t), leap(t)
    if column is not None:
        cells = np.array([cell.strip() for cell in column.cells])
        cuts = np.flatnonzero(cells[1:] != cells[:-1]) + 1
    elif gap is not None:
        cuts = np.flatnonzero(np.diff(t) > gap) + 1
    else:
        return slice(None)
    edges = [0, *cuts.tolist(), t.size]
    return max((slice(a, b) for a, b in pairwise(edges)), key=lambda one: one.stop - one.start)


def _pieces(topics: Sequence[Topic]) -> bool:
    """Whether each file goes on where another ends."""
    spans = [(float(np.nanmin(one.clock.t)), float(np.nanmax(one.clock.t)), one.clock.t) for one in topics if one.clock]
    spans.sort(key=lambda one: one[0])
    if len(spans) < len(topics):
        return False
    step = float(np.nanmedian(np.diff(spans[0][2])))
    return all(0.0 < after[0] - before[1] <= _PIECES * step for before, after in pairwise(spans))


def _trial_of(base: Path, kinds: Mapping[tuple[str, ...], list[Table]]) -> tuple[Path, str, list[Table]]:
    """The folder of one trial of topics, the form of its files' names, and its files; the trial with most rows."""
    tables = [table for same in kinds.values() for table in same]
    inside: dict[str, dict[str, Table]] = {}
    for table in tables:
        first, _, rest = table.path.relative_to(base).as_posix().partition("/")
        inside.setdefault(first if rest else "", {})[rest or first] = table
    shared = [set(files) for files in inside.values()]
    if "" not in inside and len(inside) > 1 and set.intersection(*shared):
        best = max(inside, key=lambda name: sum(len(one.columns[0]) for one in inside[name].values()))
        return base / best, "", list(inside[best].values())
    if trials := _by_name(kinds):
        first = max(trials, key=lambda one: sum(len(table.columns[0]) for table in trials[one]))
        return base, first, trials[first]
    return base, "", tables


def _by_name(kinds: Mapping[tuple[str, ...], list[Table]]) -> dict[str, list[Table]]:
    """The files of each trial, whose name begins or ends the names of those of every kind; empty where none does."""
    for ending in (False, True):
        found: list[dict[str, Table]] = []
        for same in kinds.values():
            names = [table.path.name for table in same]
            tail, head = _shared_end(names), _shared_end([name[::-1] for name in names]) if ending else ""
            if len(names) < 2 or not tail:
                return {}
            found.append({name[len(head) : -len(tail)]: table for name, table in zip(names, same, strict=True)})
        if len(found[0]) > 1 and all(one.keys() == found[0].keys() for one in found):
            return {name: [one[name] for one in found] for name in found[0]}
    return {}


def _shared_end(names: Sequence[str]) -> str:
    """The letters in which all names end."""
    first = min(names, key=len)
    return next(first[k:] for k in range(len(first) + 1) if all(name.endswith(first[k:]) for name in names))


def _topics(base: Path, prefix: str, tables: Sequence[Table], notes: list[str]) -> Log:
    """Topics with rows of their own, on the rows of the one that says most of the motion."""
    usual = Counter(_written(table) for table in tables).most_common(1)[0][0]
    notes = [
        *notes,
        *(f"left out: {table.path.name}: written otherwise than the other files"
          for table in tables if _written(table) != usual),
    ]
    topics = [_topic(base, table, True) for table in tables if _written(table) == usual]
    timed = [one for one in topics if one.clock is not None]
    if not timed:
        raise DataError(f"{base}: none of {len(topics)} tables has a time, by which files of one trial are joined; "
                        "captive tests go to seatrial captive")  # fmt: skip
    said = {one.name: signals(one.columns, one.clock.heads if one.clock else (), one.name) for one in timed}
    main = max(timed, key=lambda one: (_weight(said[one.name]), len(one.table.columns[0])))
    said[main.name] = {role: replace(one, file="") for role, one in said[main.name].items()}
    t = main.clock.t if main.clock else np.zeros(0)
    found: dict[str, Signal] = {}
    used, unread = list[Topic](), list[Topic]()
    for one in sorted(timed, key=lambda one: (one is not main, -len(one.table.columns[0]))):
        values = one.clock.t if one.clock else t
        if one is not main and (values.size < _FEWEST or values[-1] < t[0] or values[0] > t[-1]):
            notes = [*notes, f"left out: {one.name}: {values.size} rows, or times that are not those of {main.name}"]
            continue
        for role, signal in said[one.name].items():
            kept = found.get(role)
            if kept is None or (role[0] != "q" and not kept.column.varies and signal.column.varies):
                found[role] = signal if one is main else replace(signal, values=_onto(t, values, signal))
        if one is not main:
            (used if any(s.file == one.name for s in found.values()) else unread).append(one)
    pattern = main.name.replace(prefix, "{trial}", 1) if prefix else main.name
    return Log(main, tuple(used), t, slice(None), sided(found), pattern, "time", tuple(notes), unread=tuple(unread))


def _written(table: Table) -> tuple[object, ...]:
    """How a file is written; one mapping says it for all files of a trial."""
    suffix = table.path.suffix.lower()
    return (suffix in TABLES[len(TEXTS) :], table.layout)


def _weight(found: Mapping[str, Signal]) -> float:
    """How much of the motion a topic says; of those with a heading the one with most rows has the rows of the trial."""
    moving = {role for role, signal in found.items() if signal.column.varies}
    return 2.0 if moving & {"heading", "yaw", "qw"} else 1.0 if moving & {"latitude", "x", "north"} else 0.0


def _onto(t: Array, own: Array, signal: Signal) -> Array:
    """Values at other times: on lines, angles and letters those of the nearest."""
    good = np.isfinite(own)
    at, values = own[good], signal.values[good]
    order = np.argsort(at, kind="stable")
    at, values = at[order], values[order]
    if signal.role not in _ANGLES and not signal.column.letters and not signal.role.startswith("q"):
        return np.interp(t, at, values, left=np.nan, right=np.nan)
    near = np.clip(np.searchsorted(at, t), 1, at.size - 1)
    near -= (t - at[near - 1] < at[near] - t).astype(int)
    return values[near]


_ENOUGH, _REACHES = 20, 2.0
"""Rows in a run that hold all quantities, below which they are bridged; over how many steps of each."""


def bridged(t: Array, found: Mapping[str, Signal]) -> dict[str, Signal]:
    """Quantities on all rows near their own readings, where hardly a row holds all of them.

    Instruments that speak in turn, each in rows of its own, are compared so, and those that every other row lacks;
    where rows hold all nothing is made up.
    """
    known = {role: np.isfinite(one.values) for role, one in found.items()}
    known = {role: good for role, good in known.items() if good.sum() > 2}
    if not known or _longest_run(np.logical_and.reduce([*known.values()])) >= _ENOUGH:
        return dict(found)
    out = dict(found)
    for role, good in known.items():
        own = t[good]
        values = _onto(t, own, replace(found[role], values=found[role].values[good]))
        near = np.clip(np.searchsorted(own, t), 1, own.size - 1)
        away = np.minimum(np.abs(t - own[near]), np.abs(t - own[near - 1]))
        out[role] = replace(found[role], values=np.where(away <= _REACHES * np.median(np.diff(own)), values, np.nan))
    return out


def _longest_run(held: NDArray[np.bool_]) -> int:
    """Rows of the longest stretch that holds."""
    edges = np.flatnonzero(np.concatenate([[True], ~held, [True]]))
    return int(np.diff(edges).max()) - 1


TEXTS = (".csv", ".tsv", ".txt", ".dat", ".log", ".asc", ".lvm")
TABLES = (*TEXTS, *WORKBOOKS, *PARQUET, *ARRAYS)
"""Suffixes of the files that are looked at."""


def read_tables(path: Path) -> list[Table]:
    """One file as tables of text, at most `ROWS` rows of each; several where a workbook has sheets alike.

    Raises:
        DataError: it cannot be read, or it is no table.
    """
    if not packed(existing(path)):
        return [read_text(path)]
    sheets = sheets_of(path)
    found: list[Table] = []
    for name in sheets.names:
        frame, sheet = sheets.one(name), name if name != sheets.names[0] else ""
        rows = [[_cell(value) for value in row] for row in frame.head(ROWS + 50).iter_rows()]
        if sheets.headed:
            units = ("",) * frame.width
            found.append(Table(path, Layout(sheet=sheet), tuple(frame.columns), units, tuple(zip(*rows, strict=True)),
                               frame.height > ROWS, apart=sheets.apart))  # fmt: skip
        elif (table := _of_sheet(path, sheet, rows)) is not None:
            found.append(table)
    if not found:
        raise DataError(f"{path}: no sheet with a header and rows of numbers")
    return _alike_sheets(found, sheets.names[0])


def _alike_sheets(tables: list[Table], first: str) -> list[Table]:
    """The tables of the kind with most cells, beside the others."""
    cells: dict[tuple[object, ...], int] = {}
    for table in tables:
        cells[_kind(table)] = cells.get(_kind(table), 0) + sum(map(len, table.columns))
    kind = max(cells, key=lambda one: cells[one])
    chosen = [table for table in tables if _kind(table) == kind]
    beside = tuple(table.layout.sheet or first for table in tables if _kind(table) != kind)
    every = [replace(table.layout, sheet="*") if len(chosen) > 1 else table.layout for table in chosen]
    return [replace(table, layout=layout, beside=beside) for table, layout in zip(chosen, every, strict=True)]


def _kind(table: Table) -> tuple[object, ...]:
    """What sheets have in common that one mapping reads."""
    return table.heads, table.units, replace(table.layout, sheet="")


def _of_sheet(path: Path, sheet: str, rows: list[list[str]]) -> Table | None:
    """A sheet as a table; None for one without a header above rows of numbers."""
    width = max((len(row) for row in rows), default=0)
    first = next((k for k, row in enumerate(rows) if sum(is_value(cell) for cell in row) >= max(2, width // 3)), 0)
    if first == 0 or len(rows) - first < 2:
        return None
    units: list[str] = []
    above = [k for k in range(first - 1, -1, -1) if any(rows[k])]
    if not above:
        return None
    head = above[0]
    said = sum(bool(unit_of(cell)) for cell in rows[head])
    if len(above) > 1 and said >= 0.6 * sum(bool(cell) for cell in rows[head]):
        units, head = rows[head], above[1]
    over = rows[above[above.index(head) + 1]] if head != above[-1] else []
    over = over if groups(over) else []
    named = [k for k, cell in enumerate(rows[head]) if cell or over]
    body = [row for row in rows[first:] if any(row)]
    columns = tuple(tuple(row[k] for row in body[:ROWS]) for k in named)
    layout = Layout(skip=head, units_row=1 if units else 0, sheet=sheet)
    said = tuple(units[k] for k in named) if units else ("",) * len(named)
    return Table(path, layout, tuple(rows[head][k] for k in named), said, columns, over=tuple(over))


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return value.isoformat() if hasattr(value, "isoformat") else str(value).strip()
