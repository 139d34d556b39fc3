"""Times of rows from the clock of a log: numbers, ISO 8601, patterns, hours of the day, Unix time, GPS time.

Stamps are whole nanoseconds, so that no digit of a logger is lost.  A time that a zone never has is refused.  Of the
hour that it has twice, when summer time ends, the rows before the clock goes back are the first and those after it the
second; where it does not go back in that hour they cannot be told apart, and are refused.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from ....core.values import dataclass
from ... import Array, DataError
from ...units import conversion
from ..numbers import numbers, texts
from ..schema import Clock
from ..tables import Table
from .calendar import DAYS, EPOCHS, civil, leap_seconds, offset_of
from .patterns import Pattern, iso, of_day, patterned

if TYPE_CHECKING:
    import polars as pl

Ticks = NDArray[np.int64]
NEVER = np.iinfo(np.int64).min
"""The stamp of a row without a time."""

_SECOND = 10**9
_HOUR = 3600 * _SECOND
_DAY = 24 * _HOUR
_WEEK = 7 * _DAY
_FINE = 100_000
_GPS_ZERO = 315_964_800 * _SECOND
_ROLLS = 1024
Kind = Literal["plain", "day", "local", "utc"]


@dataclass(frozen=True)
class Stamps:
    """Times of rows.

    Attributes:
        kind: of seconds since some start, of nanoseconds since midnight, since 1970 in an unknown zone, and since 1970.
        values: seconds, shape (rows,), NaN without one; or nanoseconds, `NEVER` without one.
        ahead: local time less UTC at the first row [ns].
    """

    kind: Kind
    values: Array | Ticks
    ahead: int = 0

    @property
    def zero(self) -> int:
        """The first time, down to a whole microsecond [ns]; 0 of plain seconds."""
        if self.kind == "plain" or not len(self.values):
            return 0
        known = self.values[self.values != NEVER]
        return 0 if not known.size else int(known[0]) // 1000 * 1000

    def seconds(self, zero: int) -> Array:
        """Seconds after `zero` [ns], shape (rows,); NaN without a time."""
        if self.kind == "plain":
            return np.asarray(self.values, dtype=np.float64)
        return np.where(self.values == NEVER, np.nan, (self.values - zero) / _SECOND)

    def days_from(self, other: Stamps) -> Stamps:
        """Times of day on the day that brings them nearest to those of another file."""
        mine, its = (one.values[one.values != NEVER] for one in (self, other))
        if not mine.size or not its.size:
            return self
        late = int(np.round((int(its[0]) - int(mine[0])) / _DAY)) * _DAY
        return Stamps(self.kind, _shifted(np.asarray(self.values, dtype=np.int64), late))


def stamps(table: Table, clock: Clock) -> Stamps:
    """Times of the rows of a table.

    Raises:
        DataError: a cell that is no such time, an ambiguous one, or one without a zone; naming file, column and row.
    """
    if clock.step is not None:
        return Stamps("plain", clock.step * np.arange(len(table), dtype=np.float64) + clock.offset)
    if clock.format is None:
        factor = conversion("t", clock.unit or "s")[1]
        table.agree(clock.column, clock.unit or "s")
        return Stamps("plain", numbers(table, clock.column) * factor + clock.offset * factor)
    late = round(clock.offset * conversion("t", "s" if clock.unit in (None, "ns") else str(clock.unit))[1] * _SECOND)
    if clock.format == "epoch":
        return Stamps("utc", _shifted(_unix(table, clock), late))
    if clock.format == "gps":
        return Stamps("utc", _shifted(_gps(table, clock), late))
    if clock.format == "seconds of the day":
        return Stamps("day", _shifted(_onwards(_exact(table, clock.column, EPOCHS[clock.unit or "s"]), _DAY), late))
    if clock.format in DAYS:
        days = numbers(table, clock.column) - DAYS[clock.format]
        _refuse_far(table, clock.column, np.nan_to_num(days), _DAY)
        # a double of such a number has some ten microseconds, a spreadsheet writes whole milliseconds
        ticks = np.where(np.isfinite(days), np.round(np.nan_to_num(days) * _DAY / _FINE) * _FINE, NEVER)
        found = _in_zone(table, clock, ticks.astype(np.int64), np.isfinite(days))
    else:
        found = _read(table, clock)
    return Stamps(found.kind, _shifted(np.asarray(found.values, dtype=np.int64), late), found.ahead)


def moment(text: str, like: Stamps, zero: int) -> float:
    """A time that a person wrote, such as 11:20:00 or 2025-04-11T11:20:00+02:00, in seconds after `zero` of a log.

    Without a date it is of the first day of the log, without a zone of the zone of its first row.

    Raises:
        DataError: no time, or one that the log cannot tell.
    """
    import polars as pl

    hint = "give seconds, or a time such as 11:20:00" + ("" if like.kind == "day" else " or 2025-04-11T11:20:00")
    if like.kind == "plain":
        raise DataError(f"'{text}' is no number; the time of this log is seconds")
    for pattern in (iso(), of_day()):
        found = pattern.fields(pl.Series([text]), "decimal")
        if found is None or (pattern.dated and like.kind == "day"):
            continue
        local = int(civil(found)[0])
        if not pattern.dated and like.kind != "day":
            local += (zero + like.ahead) // _DAY * _DAY
        zone = str(found.zone[0] or "")
        ahead = offset_of(zone) if zone else like.ahead
        if ahead is not None:
            return (local - (0 if like.kind == "day" else ahead) - zero) / _SECOND
    raise DataError(f"'{text:.40}' is no time; {hint}")


def _shifted(values: Ticks, late: int) -> Ticks:
    return np.where(values == NEVER, NEVER, values + late) if late else values


def _unix(table: Table, clock: Clock) -> Ticks:
    """Nanoseconds since 1970, by every digit of the cells."""
    found = _exact(table, clock.column, EPOCHS[clock.unit or "s"])
    if clock.nanoseconds is not None:
        after = _exact(table, clock.nanoseconds, 1)
        found = np.where((found == NEVER) | (after == NEVER), NEVER, found + after)
    return found


def _gps(table: Table, clock: Clock) -> Ticks:
    """UTC by GPS weeks and seconds."""
    week = numbers(table, str(clock.week))
    second = _exact(table, clock.column, EPOCHS.get(clock.unit or "s", _SECOND))
    known = np.isfinite(week) & (second != NEVER)
    early = np.flatnonzero(known & (week + _ROLLS * clock.rollover < _ROLLS))
    if early.size:
        row = int(early[0])
        about = f"week {week[row]:g} is before 1999; receivers that count to 1023 have begun anew: give rollover = 2"
        raise DataError(f"{table.at(str(clock.week), row)}: {about} under time in the mapping")
    over = np.flatnonzero(known & (second >= _WEEK))
    if over.size:
        raise DataError(f'{table.at(clock.column, int(over[0]))}: a week has 604800 s; is unit = "ms" right?')
    weeks = np.where(known, week, 0.0).astype(np.int64) + _ROLLS * clock.rollover
    gps = _GPS_ZERO + weeks * _WEEK + np.where(known, second, 0)
    return np.where(known, gps - leap_seconds(gps) * _SECOND, NEVER)


def _exact(table: Table, column: str, unit: int) -> Ticks:
    """Whole nanoseconds of numbers in a unit of so many nanoseconds, without rounding where they are digits."""
    import polars as pl

    if table.frame[column].dtype == pl.String:
        cells = texts(table, column)
        parts = [cells.str.extract(r"^(\d{1,19})(?:[.,](\d+))?$", k) for k in (1, 2)]
        if bool((parts[0].is_not_null() | cells.is_null()).all()):
            whole = parts[0].cast(pl.Int64, strict=False).fill_null(0).to_numpy()
            after = parts[1].fill_null("").str.pad_end(9, "0").str.slice(0, 9).cast(pl.Int64).to_numpy()
            _refuse_far(table, column, whole, unit)
            return np.where(cells.is_null().to_numpy(), NEVER, whole * unit + after * unit // _SECOND)
    elif table.frame[column].dtype.is_integer():
        whole = table.frame[column].cast(pl.Int64).fill_null(0).to_numpy()
        _refuse_far(table, column, whole, unit)
        return np.where(table.frame[column].is_null().to_numpy(), NEVER, whole * unit)
    values = numbers(table, column)
    _refuse_far(table, column, np.nan_to_num(values), unit)
    return np.where(np.isfinite(values), np.round(np.nan_to_num(values) * unit), NEVER).astype(np.int64)


def _refuse_far(table: Table, column: str, values: Array | Ticks, unit: int) -> None:
    far = np.flatnonzero((values < 0) | (values > (2**63 - 1) // unit // 2))
    if far.size:
        row = int(far[0])
        said = next((name for name, size in EPOCHS.items() if size == unit), "days")
        raise DataError(f"{table.at(column, row)}: {values[row]:.15g} {said} are centuries; is it in another unit?")


def _read(table: Table, clock: Clock) -> Stamps:
    """Stamps of texts, or of a column of times as Parquet has them."""
    import polars as pl

    cells = table.frame[clock.column]
    if isinstance(cells.dtype, pl.Datetime) and clock.date is None:
        ticks = cells.dt.cast_time_unit("ns").cast(pl.Int64).fill_null(NEVER).to_numpy()
        zoned = cells.dtype.time_zone is not None
        return Stamps("utc", ticks) if zoned else _in_zone(table, clock, ticks, np.ones(len(table), dtype=bool))
    pattern = patterned(str(clock.format))
    # a workbook counts times of day from the end of 1899, and dates from midnight
    written = texts(table, clock.column).str.replace(r"^1899-12-3[01] ", "")
    for part in reversed(clock.parts):
        written = texts(table, part).str.replace(r"[ T]00:00:00(?:\.0+)?$", "") + " " + written
    known = written.is_not_null().to_numpy()
    found = pattern.fields(written, clock.fraction)
    if found is None:
        raise DataError(_no_time(table, clock, pattern, written))
    wrong = found.wrong & known
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise DataError(f"{table.at(clock.column, row)}: '{written[row]:.40}' is a time that no calendar has")
    local = np.where(known, civil(found), NEVER)
    if not pattern.dated:
        return Stamps("day", _onwards(local, _DAY if pattern.hours else _HOUR))
    return _zoned(table, clock, local, found.zone)


def _no_time(table: Table, clock: Clock, pattern: Pattern, written: pl.Series) -> str:
    """The first cell that is no time in the pattern."""
    wrong = written.is_not_null() & ~written.str.contains(pattern.form)
    row = int(np.flatnonzero(wrong.to_numpy())[0])
    return f"{table.at(clock.column, row)}: '{written[row]:.40}' is no time such as {pattern.example}"


def _onwards(ticks: Ticks, turn: int) -> Ticks:
    """Times of the day, or of the hour, that go on where the clock begins anew."""
    known = np.flatnonzero(ticks != NEVER)
    out = ticks.copy()
    steps = np.diff(ticks[known])
    out[known[1:]] += turn * np.cumsum(np.where(steps < -turn // 2, 1, np.where(steps > turn * 23 // 24, -1, 0)))
    return out


def _zoned(table: Table, clock: Clock, local: Ticks, zones: pl.Series) -> Stamps:
    """UTC of local times by the zones in the texts, else by that of the mapping."""
    bare = zones.is_null().to_numpy() & (local != NEVER)
    ahead = np.zeros(len(local), dtype=np.int64)
    for zone in zones.drop_nulls().unique().to_list():
        found = offset_of(zone)
        rows = (zones == zone).fill_null(False).to_numpy()
        if found is None:
            about = f"the zone '{zone}' is not one time everywhere; write +02:00, or leave it out and give zone"
            raise DataError(f'{table.at(clock.column, int(np.flatnonzero(rows)[0]))}: {about} = "Europe/Oslo"')
        ahead[rows] = found
    if not bare.any():
        first = int(np.flatnonzero(local != NEVER)[0]) if (local != NEVER).any() else 0
        return Stamps("utc", np.where(local == NEVER, NEVER, local - ahead), int(ahead[first]) if len(ahead) else 0)
    if clock.zone == "unknown" and not bare[local != NEVER].all():
        row = int(np.flatnonzero(bare)[0])
        raise DataError(f"{table.at(clock.column, row)}: no time zone, and other rows have one; give zone")
    rest = _in_zone(table, clock, local, bare)
    return Stamps(rest.kind, np.where(bare, rest.values, np.where(local == NEVER, NEVER, local - ahead)), rest.ahead)


def _in_zone(table: Table, clock: Clock, local: Ticks, rows: NDArray[np.bool_]) -> Stamps:
    """UTC of the local times of some rows by the zone of the mapping."""
    import polars as pl

    some = np.flatnonzero(rows & (local != NEVER))
    if clock.zone == "unknown" or not some.size:
        return Stamps("local", local)
    if clock.zone is None:
        about = 'no time zone; give zone = "UTC", "+02:00" or "Europe/Oslo" under time in the mapping, or "unknown"'
        raise DataError(f"{table.at(clock.column, int(some[0]))}: {about}")
    fixed = offset_of(clock.zone)
    if fixed is not None:
        return Stamps("utc", np.where(local == NEVER, NEVER, local - fixed), fixed)
    naive = pl.Series(local[some]).cast(pl.Datetime("ns"))
    there = naive.dt.replace_time_zone(clock.zone, ambiguous="null", non_existent="null")
    back = np.flatnonzero(np.diff(local[some]) < -_HOUR // 4)
    if back.size == 1:
        ends = [naive.dt.replace_time_zone(clock.zone, ambiguous=which, non_existent="null")
                for which in ("earliest", "latest")]  # fmt: skip
        first = pl.Series(np.arange(some.size) <= back[0])
        there = pl.select(pl.when(first).then(ends[0]).otherwise(ends[1])).to_series()
    lost = np.flatnonzero(there.is_null().to_numpy())
    if lost.size:
        twice = naive[lost[:1].tolist()].dt.replace_time_zone(clock.zone, ambiguous="earliest", non_existent="null")
        how = "never" if twice.is_null().all() else "twice, when its clocks are put back"
        row = int(some[lost[0]])
        about = f'{naive[int(lost[0])]} is {how} in {clock.zone}; give zone = "+02:00", or what the clock was set to'
        raise DataError(f"{table.at(clock.column, row)}: {about}")
    utc = local.copy()
    utc[some] = there.cast(pl.Int64).to_numpy()
    return Stamps("utc", utc, int(local[some[0]] - utc[some[0]]))
