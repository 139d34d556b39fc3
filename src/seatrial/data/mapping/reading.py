"""Trials of one recording by a mapping: its files are opened, timed, joined, brought to midship, and cut."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.values import asdict, dataclass, replace
from .. import UNITS, Array, DataError, Trial
from ..geodesy import Datum
from ..prepare import cut, marked, unbroken
from ..sheets import packed, sheets_of
from ..sidecar import CONVENTIONS
from ..table import disorder, within
from ..units import conversion
from .checked import instruments
from .clocks import Stamps, moment, stamps
from .joining import Series, in_order, joined, reach, single
from .long import widened
from .measured import measured
from .numbers import texts
from .places import Midship
from .recordings import name_of, piece, pieces
from .schema import Channel, Clock, Cut, Mapping, Position, Sensor, Split
from .tables import Table, heads_of, opened, stacked
from .uses import uses

_EXTRA = {"u_w": "m/s", "v_w": "m/s"}
"""Units of channels that are not standard ones and that no key of `channels` gives."""


@dataclass(frozen=True)
class _Strand:
    """One file, read: its series, and what was done to it, in words."""

    table: Table
    clock: Clock
    stamps: Stamps
    series: Series
    steps: tuple[str, ...]


def read(source: Path, mapping: Mapping) -> tuple[Trial, ...]:
    """The trials of one recording.

    Args:
        source: a file, or the folder of several.
        mapping: what is in them.

    Raises:
        DataError: naming file, column and row of what is wrong.
    """
    name = name_of(source, mapping)
    found: list[Trial] = []
    for sheet, one, table, apart in _tables(source, mapping):
        for suffix, rows in list(groups(table, one)):
            part = table if rows is None else table.rows(rows)
            trial, clock = _trial(source, one, name + sheet + suffix, part)
            trial = trial.noting(*apart)
            found += named_cuts(trial, one, source, name, clock) if one.trial else divided(trial, one.split)
    return tuple(found)


EVERY = "*"
"""The sheet that stands for each one that has a column of the mapping."""


def _tables(source: Path, mapping: Mapping) -> Iterator[tuple[str, Mapping, Table, tuple[str, ...]]]:
    """The tables of a recording whose times are rows: what the name of each ends in, its mapping, and what is left out.

    Raises:
        DataError: no sheet with a column of the mapping.
    """
    if mapping.sheet != EVERY:
        yield "", mapping, _rows_of(source, mapping), ()
        return
    if not packed(source):
        raise DataError(f"{source}: a text has no sheets; leave sheet out of the mapping")
    sheets, wanted = sheets_of(source), uses(mapping)
    names = [name for name in sheets.names if set(heads_of(sheets, mapping, name)) & {use.column for use in wanted}]
    if not names:
        raise DataError(f"{source}: no sheet with a column of the mapping; the sheets are {', '.join(sheets.names)}")
    others = [name for name in sheets.names if name not in names]
    apart = (f"sheets without its columns: {', '.join(others)}",) if others else ()
    for name in names:
        one = replace(mapping, sheet=name)
        yield ending(name), one, opened(source, one, wanted, sheets), apart


def _rows_of(source: Path, mapping: Mapping) -> Table:
    """The table whose times are the rows; of several pieces, one after the other."""
    own = mapping.files is not None and mapping.files.pattern in mapping.files.clocks
    wanted = [u for u in uses(mapping) if _of(mapping, u.file) is None and not (own and u.key.startswith("time."))]
    if mapping.long is not None:
        return widened(source, mapping, mapping.long)
    if mapping.files is None:
        return opened(source, mapping, wanted)
    if mapping.files.join == "time":
        return opened(piece(source, mapping, mapping.files.pattern), mapping, wanted)
    tables = [opened(path, mapping, wanted) for path in pieces(source, mapping, mapping.files.pattern)]
    if mapping.time.format != "clock":
        # by their times: names such as log_10 come before log_2
        tables.sort(key=lambda one: _first(stamps(one, mapping.time)))
    return stacked(tables)


def _first(found: Stamps) -> float:
    known = found.seconds(0)[np.isfinite(found.seconds(0))]
    return float(known[0]) if known.size else np.inf


def _of(mapping: Mapping, file: str | None) -> str | None:
    """The file of an instrument; None for that of the rows."""
    return None if mapping.files is None or file == mapping.files.pattern else file


def _trial(source: Path, mapping: Mapping, name: str, table: Table) -> tuple[Trial, tuple[Stamps, int]]:
    """One trial, and the clock of its rows with the time where it is 0."""
    parts: dict[str | None, list[tuple[str, Sensor]]] = {None: []}
    for place, sensor in instruments(mapping):
        parts.setdefault(_of(mapping, sensor.file), []).append((place, sensor))
    clock = _clock(mapping, mapping.files.pattern if mapping.files else None)
    marks = stamps(table, clock)
    # of rows that are put in order the first is not the earliest
    zero = (replace(marks, values=np.sort(marks.values)) if clock.sort else marks).zero
    datum: list[Datum] = []
    main = _strand(table, clock, marks, zero, parts.pop(None), mapping, datum)
    others = [(file, some, _opened(source, mapping, file, some, marks, zero, datum)) for file, some in parts.items()]
    channels, steps = _joined(mapping, main, others)
    t = _times(mapping, main.series.t)
    ship = Midship(t, channels)
    ship.bring(mapping)
    if datum and ship.exchanged(datum[0]):
        _refuse_exchanged(mapping, table, others)
    units = {n: conversion(n, c.unit)[0] for n, c in mapping.channels.items() if n not in UNITS}
    units |= {n: unit for n, unit in _EXTRA.items() if n in channels}
    meta: dict[str, Any] = {**CONVENTIONS, **_start(marks, zero), **mapping.meta}
    if datum:
        meta["datum"] = asdict(datum[0])
    how = f"imported by a mapping: {_count(mapping, table, others)}"
    turned = [f"{n}: sign turned" for n, c in mapping.channels.items() if c.sign == -1.0]
    if mapping.apparent is not None:
        turned += ["gamma_A: sign turned"] * (mapping.apparent.sign == -1.0)
        turned += ["gamma_A: turned from where the wind goes to"] * mapping.apparent.towards
    trial = marked(Trial(name, t, ship.channels, units, meta), ship.derived)
    return trial.noting(how, *turned, *steps, *ship.steps, *_zero_words(marks, zero), *main.steps), (marks, zero)


def _count(mapping: Mapping, table: Table, others: Sequence[Any]) -> str:
    if others:
        return f"{len(list(instruments(mapping)))} instruments of {1 + len(others)} files"
    read = {use.column for use in uses(mapping) if not use.key.startswith(("time", "split"))}
    return f"{len(read)} of {table.width} columns"


def _clock(mapping: Mapping, file: str | None) -> Clock:
    return mapping.time if mapping.files is None or file is None else mapping.files.clocks.get(file, mapping.time)


def _opened(
    source: Path, mapping: Mapping, file: str | None, parts: list[tuple[str, Sensor]], rows: Stamps, zero: int,
    datum: list[Datum],
) -> _Strand:  # fmt: skip
    """Another file of a trial."""
    clock, keys = _clock(mapping, file), {place for place, _ in parts}
    wanted = [use for use in uses(mapping) if use.file == file and use.key.rpartition(".")[0] in keys]
    own = mapping.files is not None and file in mapping.files.clocks
    begin = f'files.clocks."{file}".' if own else "time."
    wanted += [use for use in uses(mapping) if use.key.startswith(begin)]
    table = opened(piece(source, mapping, str(file)), mapping, wanted)
    found = stamps(table, clock)
    if found.kind != rows.kind:
        about = f"its clock is {_KINDS[found.kind]}, that of the rows {_KINDS[rows.kind]}; the two cannot be joined"
        raise DataError(f"{table.path}: column '{clock.column}': {about}")
    if found.kind == "day":
        found = found.days_from(rows)
    return _strand(table, clock, found, zero, parts, mapping, datum)


_KINDS = {
    "plain": "in seconds since some start",
    "day": "a time of day",
    "local": "of an unknown zone",
    "utc": "absolute",
}


def _strand(
    table: Table, clock: Clock, found: Stamps, zero: int, parts: list[tuple[str, Sensor]], mapping: Mapping,
    datum: list[Datum],
) -> _Strand:  # fmt: skip
    """What the instruments of one file measure, one row a time, in the order of time."""
    channels: dict[str, Array] = {}
    unfixed: list[str] = []
    for place, sensor in parts:
        channels |= measured(table, place, sensor)
    for _, sensor in parts:
        if isinstance(sensor, Position):
            unfixed += _to_plane(channels, sensor, datum)
    t, steps = _continued(found.seconds(zero), channels)
    steps += unfixed
    series = Series(t, channels, np.arange(len(t)))
    if clock.sort:
        series, said = in_order(series)
        steps.append(said)
    if mapping.duplicates != "refuse":
        series, again = single(series, mapping.duplicates)
        how = "spread to the next time" if mapping.duplicates == "spread" else f"the {mapping.duplicates} counts"
        steps += [f"{again} rows with the time of another one: {how}"] if again else []
    if len(series.t) < 2:
        raise DataError(f"{table.path}: {len(series.t)} rows of numbers; a trial needs at least 2")
    wrong = disorder(series.t, _advice(clock, series.t))
    if wrong is not None:
        raise DataError(f"{table.at(clock.column, int(series.rows[wrong[0]]))}: {wrong[1]}")
    return _Strand(table, clock, found, series, tuple(steps))


def _advice(clock: Clock, t: Array) -> str:
    """What to do about a time that repeats or goes back."""
    sort = "; sort = true under time in the mapping puts rows in order and leaves out those that repeat others"
    steps = np.diff(t)
    told = "" if clock.sort else sort
    if (steps[np.flatnonzero(steps <= 0.0)[:1]] == 0.0).any():
        return told + '; duplicates = "first" keeps one row a time'
    counted = clock.format is not None and clock.fraction == "decimal"
    return told + ('; fraction = "ns" reads 5.42 as 5.000000042' if counted else "")


def _continued(t: Array, channels: dict[str, Array]) -> tuple[Array, list[str]]:
    """Time continued over empty rows at the end at the median step: loggers pad."""
    filled = np.isfinite(t)
    if not filled.size or filled[-1]:
        return t, []
    for values in channels.values():
        filled |= np.isfinite(values)
    last = int(np.flatnonzero(filled)[-1]) if filled.any() else -1
    count = len(t) - 1 - last
    if count == 0 or last < 1:
        return t, []
    out = t.copy()
    out[last + 1 :] = t[last] + float(np.nanmedian(np.diff(t[: last + 1]))) * np.arange(1, count + 1)
    return out, [f"time continued over {count} empty rows at the end"]


def _to_plane(channels: dict[str, Array], position: Position, datum: list[Datum]) -> list[str]:
    """Latitude and longitude as metres north and east of the datum, which is the first fix where none is given.

    Returns:
        what was done, in words: rows of 0, 0 among others are those of a receiver without a fix, and gaps, and so is a
        speed of 0 that it tells there.
    """
    latitude, longitude = channels.pop("latitude"), channels.pop("longitude")
    good = np.flatnonzero(np.isfinite(latitude + longitude))
    unfixed = (latitude == 0.0) & (longitude == 0.0)
    none = int(unfixed.sum()) if (fixed := good[~unfixed[good]]).size else 0
    if none:
        latitude, longitude = (np.where(unfixed, np.nan, one) for one in (latitude, longitude))
        good = fixed
        still = unfixed & (channels.get("north", latitude) == 0.0) & (channels.get("east", latitude) == 0.0)
        for name in {"north", "east", "U_G", "gamma_G"} & set(channels):
            channels[name] = np.where(still, np.nan, channels[name])
    if position.datum:
        datum.append(Datum(*position.datum))
    elif good.size:
        datum.append(Datum(float(latitude[good[0]]), float(longitude[good[0]])))
    empty = np.full(latitude.shape, np.nan)
    channels["x"], channels["y"] = datum[0].track(latitude, longitude) if datum else (empty, empty.copy())
    return [f"{none} positions of 0, 0 are gaps: the receiver had no fix"] if none else []


def _times(mapping: Mapping, t: Array) -> Array:
    step = mapping.files.step if mapping.files else None
    return t if step is None else t[0] + step * np.arange(int((t[-1] - t[0]) / step + 1e-9) + 1)


def _joined(
    mapping: Mapping, main: _Strand, others: Sequence[tuple[str | None, list[tuple[str, Sensor]], _Strand]]
) -> tuple[dict[str, Array], list[str]]:
    """Every channel on the rows, and how it came there."""
    t = _times(mapping, main.series.t)
    channels: dict[str, Array] = {}
    steps: list[str] = []
    whose = {name: sensor for place, sensor in instruments(mapping) for name in _given(place, sensor)}
    for file, strand in ((None, main), *((file, strand) for file, _, strand in others)):
        for name, values in strand.series.channels.items():
            sensor = whose[name]
            if file is None and t is main.series.t and sensor.lag == 0.0:
                channels[name] = values
                continue
            try:
                channels[name] = joined(strand.series, name, sensor, t)
            except DataError as error:
                raise DataError(f"{strand.table.path}: {error}") from None
            how = f"{sensor.interpolate} within {reach(strand.series, name, sensor):.3g} s"
            late = f", {sensor.lag:g} s late" if sensor.lag else ""
            steps.append(f"{name} joined from {file or 'the rows'}: {how}{late}")
    return channels, steps


def _given(place: str, sensor: Sensor) -> tuple[str, ...]:
    """Channels that an instrument gives before it is brought to midship."""
    if isinstance(sensor, Channel):
        return (place.partition(".")[2],)
    return {"position": ("x", "y"), "ground": ("U_G", "gamma_G", "north", "east"), "log": ("u_w", "gamma_w"),
            "apparent": ("U_A", "gamma_A"), "heading": ("psi",)}[place]  # fmt: skip


def _refuse_exchanged(mapping: Mapping, table: Table, others: Sequence[tuple[Any, Any, _Strand]]) -> None:
    place = mapping.position
    if place is None:
        return
    there = next((one.table for file, _, one in others if file == _of(mapping, place.file)), table)
    about = (f"the track fits heading and speed only with '{place.latitude}' and '{place.longitude}' exchanged; "
             "exchange latitude and longitude in the mapping")  # fmt: skip
    raise DataError(f"{there.at(place.latitude, 0)}: {about}")


def _start(marks: Stamps, zero: int) -> dict[str, str]:
    if marks.kind != "utc":
        return {}
    begun = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=zero // 1000)
    return {"start": begun.isoformat(timespec="microseconds")}


def _zero_words(marks: Stamps, zero: int) -> list[str]:
    if marks.kind not in ("day", "local"):
        return []
    begun = datetime(1970, 1, 1) + timedelta(microseconds=zero // 1000)
    said = begun.time().isoformat() if marks.kind == "day" else f"{begun.isoformat()}, in a zone that is unknown"
    return [f"t = 0 s is {said}"]


def only(trials: tuple[Trial, ...], source: Path) -> Trial:
    """The trial of a recording that is one.

    Raises:
        DataError: it is cut into several.
    """
    if len(trials) != 1:
        raise DataError(f"{source}: {len(trials)} trials by its mapping; import it first (seatrial import csv)")
    return replace(trials[0])


def groups(table: Table, mapping: Mapping) -> Iterator[tuple[str, NDArray[np.intp] | None]]:
    """Rows of each trial by the column that divides a log, and what its name ends in; else all, as None.

    Rows where the column is empty belong to no trial.

    Raises:
        DataError: a value that comes back after another one, naming file, column and row.
    """
    column = mapping.split.column
    if column is None:
        yield "", None
        return
    cells = texts(table, column).fill_null("")
    code = cells.rank("dense").to_numpy().astype(np.int64)
    if mapping.split.scattered:
        for word in cells.unique(maintain_order=True).to_list():
            if word:
                yield ending(word), np.flatnonzero((cells == word).to_numpy())
        return
    edges = [0, *(np.flatnonzero(np.diff(code)) + 1).tolist(), len(code)]
    seen: set[str] = set()
    for start, stop in pairwise(edges):
        word = "" if start == len(cells) else str(cells[start])
        if not word:
            continue
        if word in seen:
            about = "one stretch is one trial; where rows of several take turns give scattered = true under split"
            raise DataError(f"{table.at(column, start)}: '{word:.40}' again, after others; {about}")
        seen.add(word)
        yield ending(word), np.arange(start, stop)


def ending(word: str) -> str:
    """What the name of a trial ends in, by the word of its rows."""
    return f"_{re.sub(r'[^A-Za-z0-9.-]+', '_', re.sub(r'[.]0$', '', word))}"


def divided(trial: Trial, split: Split) -> tuple[Trial, ...]:
    """The trial, or its parts between leaps of time."""
    return (trial,) if split.gap is None else unbroken(trial, split.gap)


def named_cuts(trial: Trial, mapping: Mapping, source: Path, log: str, clock: tuple[Stamps, int]) -> Iterator[Trial]:
    """The trials that a mapping cuts out of a log; time keeps its origin.

    Raises:
        DataError: a time that the log does not have.
    """
    for k, one in enumerate(mapping.trial):
        if one.log in (None, log):
            with within(f"{source}: trial[{k}]"):
                start, stop = (_at(one, key, clock) for key in ("start", "stop"))
                if start >= stop:
                    raise DataError(f"'{one.name}' is from {start:g} to {stop:g} s; 'to' must be later")
                yield _described(replace(cut(trial, start, stop), name=one.name), one)


def _at(one: Cut, key: str, clock: tuple[Stamps, int]) -> float:
    said = getattr(one, key)
    return said if isinstance(said, float) else moment(said, *clock)


def _described(trial: Trial, one: Cut) -> Trial:
    said: dict[str, Any] = {"kind": one.kind, "set_points": dict(one.set_points) or None}
    return replace(trial, meta={**trial.meta, **{key: value for key, value in said.items() if value is not None}})
