"""Long tables, of one value a row, as the guess sees them: a column for each name, a row for each time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np

from .. import Array
from ..mapping.long import JOINT
from ..mapping.schema import Long
from ..sheets import packed
from .answers import Answer, Entry, listed, quoted
from .cells import Column, columns_of
from .clock import Clock, clocks
from .layout import ROWS, Table, read_text
from .naming import meanings, tokens

_VALUES = frozenset(("value", "values", "wert", "verdi", "val", "reading", "valeur", "valor", "waarde", "atai"))
_NAMES = frozenset(("name", "names", "path", "field", "measurement", "tag", "tagname", "variable", "signal", "channel",
                    "sensor", "topic", "key", "metric", "parameter", "item", "quantity", "series"))  # fmt: skip
_FEWEST, _KNOWN, _TIMES = 2, 0.5, 8
"""Names of quantities at least, how well one is known, and how often one stands there."""

_MOST, _WIDEST, _SHOWN = 200_000, 200, 4
_UNEVEN = 2.0
_HELD = ("delta", "n_P", "alpha", "throttle", "force")


def widened(table: Table) -> Table:
    """A long table as a wide one in the order of time; any other as it is."""
    if table.cut and not packed(table.path) and any(_VALUES & set(tokens(head)) for head in table.heads):
        table = read_text(table.path, _MOST)  # the rows of one name may come before those of another
    found = _columns(table)
    if found is None:
        return table
    names, value, unit, clock = found
    said = [JOINT.join(parts) for parts in zip(*(column.cells for column in names), strict=True)]
    long = Long(tuple(column.head for column in names), value.head, unit.head if unit else None)
    heads = [head for head, _ in Counter(said).most_common(_WIDEST)]
    times = [column for column in columns_of(table) if column.head in clock.heads]
    rows: dict[tuple[str, ...], dict[str, str]] = {}
    for word, cell, *when in zip(said, value.cells, *(column.cells for column in times), strict=True):
        rows.setdefault(tuple(when), {}).setdefault(word, cell)
    units = dict(zip(said, unit.cells, strict=True)) if unit else {}
    own = [table.heads.index(column.head) for column in times]
    stamps = replace(table, heads=tuple(table.heads[k] for k in own), units=tuple(table.units[k] for k in own))
    order, t = _in_order(replace(stamps, columns=tuple(zip(*rows, strict=True))))
    keys = list(rows)
    kept = [keys[k] for k in order]
    columns = (*zip(*kept, strict=True), *(tuple(rows[key].get(head, "") for key in kept) for head in heads))
    wide = replace(
        table, heads=(*(table.heads[k] for k in own), *heads), columns=columns, cut=table.cut or len(rows) > ROWS,
        units=(*(table.units[k] for k in own), *(units.get(head, "") for head in heads)),
        apart=(*table.apart, *_beside(table, {*clock.heads, *long.name, long.value, long.unit})),
    )  # fmt: skip
    held = [column.head for column in columns_of(wide)
            if column.means and column.means[0].role in _HELD and _on_change(column, t)]  # fmt: skip
    return replace(wide, long=replace(long, hold=tuple(held)))


def _in_order(times: Table) -> tuple[list[int], Array]:
    """The first rows in the order of their time, and the times [s]."""
    clock = next(iter(clocks(columns_of(times))), None)
    t = clock.t if clock is not None else np.arange(float(len(times.columns[0])))
    order = np.argsort(t, kind="stable")[:ROWS]
    return order.tolist(), t[order]


def _beside(table: Table, known: Collection[str | None]) -> Iterator[str]:
    """Columns of a few words beside the values, such as their quality."""
    for column in columns_of(table):
        words = sorted(set(column.cells))
        if column.head not in known and column.kind == "text" and len(words) > 1 and _repeated(column):
            yield f"{column.said} ({', '.join(words[:_SHOWN])}), which may say that a value is none"


def _on_change(column: Column, t: Array) -> bool:
    """Whether a value is written when it changes: at uneven times, and never twice the same."""
    good = np.isfinite(column.values)
    at, values = t[good], column.values[good]
    if at.size < _FEWEST or at.size > 0.5 * t.size:
        return False
    steps = np.diff(at)
    return bool((np.diff(values) != 0.0).all() and np.quantile(steps, 0.9) > _UNEVEN * np.quantile(steps, 0.1))


def _columns(table: Table) -> tuple[list[Column], Column, Column | None, Clock] | None:
    """Columns of names, of values and of units, and the clock of the rows of one name; None where it is none."""
    columns = columns_of(table)
    words = [one for one in columns if one.kind == "text" and _repeated(one)]
    value = next((one for one in columns if _VALUES & set(tokens(one.name))), None)
    plain = [one for one in columns if one.kind == "number" and not one.means and one.score("time") < _KNOWN]
    value = plain[0] if value is None and len(plain) == 1 else value
    unit = next((one for one in columns if one.name.lower().strip("_") in ("unit", "units", "einheit", "enhet")), None)
    names = [one for one in words if one is not value and one is not unit and set(tokens(one.name)) & _NAMES]
    names = names or [one for one in words if one is not value and one is not unit]
    names = [one for one in names if len(set(one.cells)) > 1]
    if value is None or not names:
        return None
    chosen = _fewest(names)
    if len(chosen) < len(names) and _strange(names) < _strange(chosen):
        chosen = names
    said = [JOINT.join(parts) for parts in zip(*(column.cells for column in chosen), strict=True)]
    means = [meanings(word) for word, _ in Counter(said).most_common(_WIDEST)]
    known = {some[0].role for some in means if some and some[0].score > _KNOWN}
    if len(known) < _FEWEST:
        return None
    most = Counter(said).most_common(1)[0][0]
    rows = [k for k, word in enumerate(said) if word == most]
    own = replace(table, columns=tuple(tuple(cells[k] for k in rows) for cells in table.columns))
    clock = next(iter(clocks([one for one in columns_of(own) if one.head != value.head])), None)
    return None if clock is None else (chosen, value, unit, clock)


def _repeated(column: Column) -> bool:
    """Whether a column holds a few words, each of them often."""
    words = set(column.cells)
    return len(words) * _TIMES <= len(column.cells)


def _strange(names: list[Column]) -> int:
    """How many of the names that some columns make together are those of no quantity."""
    said = {JOINT.join(parts) for parts in zip(*(column.cells for column in names), strict=True)}
    return sum(not (some := meanings(word)) or some[0].score < _KNOWN for word in said)


def _fewest(names: list[Column]) -> list[Column]:
    """The columns that tell quantities apart: one where it tells as many as all, else all of them."""
    whole = len(set(zip(*(one.cells for one in names), strict=True)))
    single = [one for one in names if len(set(one.cells)) == whole]
    return single[-1:] or names


def long_entry(long: Long) -> Entry:
    """The entry of a long table."""
    keys = {"name": listed(long.name), "value": quoted(long.value)}
    keys |= {"unit": quoted(long.unit)} if long.unit else {}
    doubts: tuple[str, ...] = ()
    if long.hold:
        keys["hold"] = listed(long.hold)
        doubts = ("written when it changes, it seems, and held until the next value; else leave out hold",)
    return Entry("long", keys, Answer("one value a row; columns below are names", doubts))
