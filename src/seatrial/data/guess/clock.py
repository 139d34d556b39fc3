"""The clock of a table: stamps, date and time of day, Unix time, GPS weeks, or seconds since the start."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from datetime import datetime
from itertools import product

import numpy as np
import polars as pl

from ...core.values import dataclass, field
from .. import Array
from ..mapping.clocks.calendar import civil
from ..mapping.clocks.patterns import patterned
from .answers import Answer, listed, quoted
from .cells import Column
from .naming import tokens

_EPOCHS = (("s", 1e9), ("ms", 1e12), ("us", 1e15), ("ns", 1e18))
_ZONE = re.compile(r"(Z|UTC|[+-]\d\d:?\d\d)$", re.IGNORECASE)
_DAY = 86400.0
_CENTURY = 946684800.0
"""The year 2000 in Unix time [s]: where the seconds of all clocks with a date begin here."""

_WEEK = 7 * _DAY
_TICKS = 1e4
"""Steps of a clock beyond which its numbers are no minutes, but may be nanoseconds."""

_SLOW = 5.0
"""Steps [s] by which a clock may miss the end and the beginning of a day."""

_EVENLY = 0.01
"""Part of a step by which even ones differ."""

_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": _DAY}


@dataclass(frozen=True)
class Clock:
    """A clock of a table, as the mapping names it.

    Attributes:
        keys: of the table `time`, as TOML.
        t: seconds of the rows, from any start.
        answer: what the clock is, its evidence and doubts.
        heads: columns it is read from.
        rank: how good it is; the best clock of a table is taken.
        units: other units that the numbers may have.
    """

    keys: dict[str, str]
    t: Array
    answer: Answer
    heads: tuple[str, ...]
    rank: float
    units: tuple[str, ...] = field(default=())


def clocks(columns: Sequence[Column]) -> list[Clock]:
    """Every clock that a table may have, best first."""
    found = [one for make in (_stamps, _dated, _parts, _formed, _of_day, _of_hour, _gps, _digits, _days,
                                     _numbers)
             for one in make(columns)]  # fmt: skip
    return sorted(found or _even(columns), key=lambda clock: -clock.rank)


def _even(columns: Sequence[Column]) -> list[Clock]:
    """The first column that rises by even steps, whatever its name; one that counts rows is none."""
    for column in columns:
        named = max(map(column.score, ("tow", "week", "date"))) > 0.4
        steps = np.diff(column.values) if column.kind == "number" and not named else np.zeros(0)
        if steps.size < 20 or not np.isfinite(steps).all():
            continue
        step = float(np.median(steps))
        if step > 0.0 and step != 1.0 and float(np.ptp(steps)) < _EVENLY * step:
            doubt = f"a clock by its even steps of {step:.4g}, and none by its name; taken in s"
            keys = {"column": quoted(column.head), "unit": quoted("s")}
            return _ranked(column.values, 1.0, keys, Answer("rises evenly", (doubt,)), (column.head,))
    return []


_MOSTLY = 0.9
"""Part of the times of a coarse clock that have about as many rows as the others."""


def coarse(t: Array) -> bool:
    """Whether a clock has about as many rows at each of its times."""
    rising = t[np.isfinite(t)]
    _, counts = np.unique(rising, return_counts=True)
    inner = counts[1:-1]
    return bool((np.diff(rising) >= 0.0).all()) and inner.size > 2 and bool(
        (np.abs(inner - np.median(inner)) <= max(1.0, 0.2 * float(np.median(inner)))).mean() > _MOSTLY)  # fmt: skip


def an_hour_back(t: Array) -> bool:
    """Whether times go back once, by an hour less a step or so."""
    return _back_by(t, 3600.0)


def half_a_day_back(t: Array) -> bool:
    """Whether times go back once, by 12 hours less a step or so."""
    return _back_by(t, 0.5 * _DAY)


def _back_by(t: Array, size: float) -> bool:
    steps = np.diff(t[np.isfinite(t)])
    return bool(abs(float(np.min(steps)) + size) < max(_SLOW, 3.0 * float(np.median(np.abs(steps)))))


def _ranked(
    t: Array, base: float, keys: dict[str, str], answer: Answer, heads: tuple[str, ...], units: tuple[str, ...] = ()
) -> list[Clock]:
    """A clock, if it advances: most steps ahead, few repeats."""
    good = t[np.isfinite(t)]
    if good.size < 2 or np.isfinite(t).mean() < 0.8:
        return []
    steps = np.diff(good)
    ahead, still = float((steps > 0).mean()), float((steps == 0).mean())
    if ahead < 0.05:
        return []
    return [Clock(keys, t, answer, heads, base + ahead - 2.0 * max(still - 0.02, 0.0), units)]


def _stamps(columns: Sequence[Column]) -> list[Clock]:
    found: list[Clock] = []
    for column in columns:
        if column.kind not in ("iso", "stamp"):
            continue
        first = next(cell for cell in column.cells if cell.strip()).strip()
        plain = column.kind == "iso" or re.match(r"\d{4}[-/]", first)
        pattern, doubt = ("iso", "") if plain else _pattern(column.cells)
        keys = {"column": quoted(column.head), "format": quoted(pattern)}
        found += _with_zone(column, keys, pattern, doubt, lambda c: c, first, (column.head,))
    return found


def _dated(columns: Sequence[Column]) -> list[Clock]:
    """A column of dates with one of times of the day."""
    days = [column for column in columns if column.kind == "date"]
    days = days if len(days) == 1 else [column for column in days if column.score("date") > 0.3]
    times = [column for column in columns if column.kind == "clock"]
    if not days or not times:
        return []
    day, time = days[0], max(times, key=lambda c: max(c.score("clock"), c.score("time")))
    joined = tuple(f"{a.strip()} {b.strip()}" for a, b in zip(day.cells, time.cells, strict=True))
    first = joined[0]
    pattern, doubt = ("iso", "") if re.match(r"\d{4}-", first) else _pattern(joined)
    keys = {"date": quoted(day.head), "column": quoted(time.head), "format": quoted(pattern)}
    made = dict(enumerate(joined))
    return _with_zone(time, keys, pattern, doubt, lambda _: "", first, (day.head, time.head), tuple(made.values()))


def _with_zone(
    column: Column, keys: dict[str, str], pattern: str, doubt: str, _: Callable[[str], str], first: str,
    heads: tuple[str, ...], cells: tuple[str, ...] | None = None,
) -> list[Clock]:  # fmt: skip
    texts = column.cells if cells is None else cells
    doubts = [doubt] if doubt else []
    if _ZONE.search(first):
        evidence = f"stamps with their zone, such as {first}"
    else:
        utc = any("utc" in head.lower() or "gmt" in head.lower() for head in heads)
        keys = {**keys, "zone": quoted("UTC" if utc else "unknown")}
        evidence = f"stamps such as {first}" + (", by its name in UTC" if utc else "")
        if not utc:
            doubts.append('the stamps have no zone; write "UTC", "+02:00" or "Europe/Oslo" where it is known')
    t = np.array([_seconds(text, pattern) for text in texts])
    if pattern == "iso" and (steps := np.diff(t[np.isfinite(t)])).size and (steps < 0).mean() > 0.005:
        counted = np.array([_seconds(text, pattern, count=True) for text in texts])
        if (np.diff(counted[np.isfinite(counted)]) < 0).mean() < 0.1 * (steps < 0).mean():
            keys, t = {**keys, "fraction": quoted("ns")}, counted
            evidence += f"; {(steps < 0).sum()} rows go back unless the digits after the dot count nanoseconds"
    return _ranked(t, 3.0, keys, Answer(evidence, tuple(doubts)), heads)


def _seconds(text: str, pattern: str, count: bool = False) -> float:
    """A stamp as seconds; NaN where it is none."""
    plain, fraction = re.sub(r"([AaPp])\.?[Mm]\.?$", r"\1M", text.strip().replace(",", ".")), 0.0
    if found := re.search(r"(:\d\d|\d{6}| \d{1,2}(?=\.\d+$))\.(\d+)", plain):
        fraction = int(found[2]) * 1e-9 if count else float(f"0.{found[2]}")
        plain = plain.replace(found[0], found[1], 1)
    try:
        if pattern == "iso":
            when = datetime.fromisoformat(re.sub(r"\s*UTC$", "Z", plain.replace("/", "-")))
        else:
            when = datetime.strptime(plain, re.sub(r"\.%f", "", pattern))
    except ValueError:
        return np.nan
    start = datetime(2000, 1, 1, tzinfo=when.tzinfo)
    return (when - start).total_seconds() + fraction - (when.utcoffset().total_seconds() if when.utcoffset() else 0.0)  # type: ignore[union-attr]


def _pattern(cells: Sequence[str]) -> tuple[str, str]:
    """Pattern of stamps whose date does not begin with the year, and the doubt about day and month."""
    filled = [cell.strip() for cell in cells if cell.strip()]
    first = re.match(r"(\d{1,4})([./-])(\d{1,2}|[A-Z][a-z]{2})[./-](\d{1,4})([T ]+)(.*)", filled[0])
    if first is None:
        return f"{'%Y%m%d' if filled[0][:2] == '20' else '%d%m%y'} %H:%M:%S", ""
    mark, between, clock = first[2], first[5], first[6]
    parts = [re.match(r"(\d+)[./-](\d+)", cell) for cell in filled[:: max(len(filled) // 500, 1)]]
    a, b = (max((int(one[k]) for one in parts if one), default=0) for k in (1, 2))
    year, doubt = ("%Y" if len(first[4]) == 4 else "%y"), ""
    if first[3].isalpha():
        days = f"%d{mark}%b{mark}{year}"
    elif len(first[1]) == 4:
        days = f"%Y{mark}%m{mark}%d"
    elif b > 12:
        days = f"%m{mark}%d{mark}{year}"
    else:
        days = f"%d{mark}%m{mark}{year}"
        if a <= 12 and a != b and mark != ".":
            doubt = f"{first[1]}{mark}{first[3]} is read as day and month; if it is month and day write %m{mark}%d"
    half = re.search(r"(\s*)[AaPp]\.?[Mm]\.?$", clock)
    hours = "%I" if half else "%H"
    seconds = f"{hours}:%M:%S" if clock.count(":") == 2 else f"{hours}:%M"
    seconds += ".%f" if re.search(r":\d\d[.,]\d", clock) else ""
    return f"{days}{between}{seconds}" + (f"{half[1]}%p" if half else ""), doubt


_PARTS = (
    (("year", "yr", "yyyy", "ar", "jahr", "annee", "ano", "anno"), 1970, 2200),
    (("month", "mon", "mo", "mnd", "monat", "mois", "mes", "mese"), 1, 12),
    (("day", "dy", "dd", "dag", "tag", "jour", "dia", "giorno"), 1, 31),
    (("hour", "hr", "hh", "stunde", "heure", "hora", "ora"), 0, 23),
    (("minute", "min", "mi", "mn", "minut", "minuto"), 0, 59),
    (("second", "sec", "ss", "sekund", "sekunde", "seconde", "segundo", "secondo"), 0, 60.999),
)  # fmt: skip
"""Words of the columns of a time in its parts, and their least and most."""


def _parts(columns: Sequence[Column]) -> list[Clock]:
    """Year, month, day, hour, minute and second in columns of their own."""
    found: list[Column] = []
    for words, low, high in _PARTS:
        for one in columns:
            last = {*tokens(one.name)[-1:], *tokens(one.name.rstrip("s"))[-1:]}
            if (one.kind == "number" and last & set(words) and one not in found
                    and low <= np.nanmin(one.values) <= np.nanmax(one.values) <= high):  # fmt: skip
                found.append(one)
                break
    if len(found) < len(_PARTS):
        return []
    joined = tuple(" ".join(cell.strip() for cell in row) for row in zip(*(one.cells for one in found), strict=True))
    heads, form = tuple(one.head for one in found), "%Y %m %d %H %M %S"
    keys = {"date": listed(heads[:-1]), "column": quoted(heads[-1]), "format": quoted(form)}
    return _with_zone(found[-1], keys, form, "", lambda _: "", joined[0], heads, joined)


_DAYS = ("%d %b %Y", "%b %d %Y", "%b %d, %Y", "%a %d %b %Y", "%a, %d %b %Y", "%Y:%m:%d", "%Y:%j", "%Y-%j", "%d.%m.%Y",
         "%d/%m/%Y", "%d-%m-%Y", "%Y-%m-%d", "%Y.%m.%d", "%Y_%m_%d", "%d%b%Y", "%d-%b-%Y", "%Y%m%d")  # fmt: skip
_TIMES = ("%H:%M:%S", "%H.%M.%S", "%Hh%Mm%Ss", "%H-%M-%S", "%H_%M_%S", "%I:%M:%S %p", "%H%M%S")
_JOINTS = (" ", ":", "-", " - ", "_", ", ", "T")
_FORMS = (*map("".join, product(_DAYS, _JOINTS, _TIMES)), "%a %b %d %H:%M:%S %Y", *_TIMES[1:5])
"""Forms of stamps beside ISO's, tried one after the other on what nothing else reads."""


def _formed(columns: Sequence[Column]) -> list[Clock]:
    """Texts that are times in a form of ours, alone or behind a column of dates."""
    found: list[Clock] = []
    texts = [one for one in columns if one.kind in ("text", "date", "clock")]
    days = [one for one in texts if one.kind == "date" or (one.kind == "text" and one.score("date") > 0.3)]
    pairs = [((one,), _FORMS) for one in texts if one.kind == "text"]
    pairs += [((day, one), tuple(map(" ".join, product(_DAYS, _TIMES)))) for day in days for one in texts
              if one is not day and "text" in (one.kind, day.kind)]  # fmt: skip
    for parts, forms in pairs:
        cells = [" ".join(cell.strip() for cell in row) for row in zip(*(one.cells for one in parts), strict=True)]
        first = next((cell for cell in cells if cell.strip()), "")
        form = next((one for one in forms if re.fullmatch(patterned(one).form.strip("^$"), first)), None)
        told = patterned(form).fields(pl.Series([cell or None for cell in cells]), "decimal") if form else None
        if form is None or told is None or told.wrong.any():
            continue
        t: Array = (civil(told) * 1e-9 - _CENTURY * told.dated).astype(np.float64)
        heads = tuple(one.head for one in parts)
        keys = {"date": quoted(heads[0])} if len(parts) > 1 else {}
        keys |= {"column": quoted(heads[-1]), "format": quoted(form)}
        utc = any(word in head.lower() for word in ("utc", "gmt") for head in heads)
        keys |= {"zone": quoted("UTC" if utc else "unknown")} if told.dated else {}
        t += 0.0 if told.dated else np.concatenate([[0.0], _DAY * np.cumsum(np.diff(t) < -0.5 * _DAY)])
        answer = Answer(f"stamps such as {first}", (_NO_ZONE,) if told.dated and not utc else ())
        found += _ranked(t, 2.9 if told.dated else 2.0, keys, answer, heads)
    return found


def _of_day(columns: Sequence[Column]) -> list[Clock]:
    found: list[Clock] = []
    for column in columns:
        if column.kind != "clock":
            continue
        first = next(cell for cell in column.cells if cell.strip()).strip()
        t = np.array([_of_clock(cell) for cell in column.cells])
        steps = np.nan_to_num(np.diff(t), nan=0.0)
        t = t + np.concatenate([[0.0], _DAY * np.cumsum(steps < -0.5 * _DAY)])
        keys = {"column": quoted(column.head), "format": quoted("clock")}
        answer = Answer(f"time of the day without a date, such as {first}")
        found += _ranked(t, 2.0, keys, answer, (column.head,))
    return found


_MINUTES = re.compile(r"\d{1,2}:\d\d[.,]\d+")


def _of_hour(columns: Sequence[Column]) -> list[Clock]:
    """Minutes and seconds, as a spreadsheet shows times that it has cut: 30:12.5."""
    found: list[Clock] = []
    for column in columns:
        named = max(column.score(role) for role in ("time", "stamp", "clock"))
        if column.kind not in ("text", "minutes") or named < 0.4 or not _all(column, _MINUTES.pattern):
            continue
        t = np.array([_of_clock(f"0:{cell.strip()}") if cell.strip() else np.nan for cell in column.cells])
        steps = np.nan_to_num(np.diff(t), nan=0.0)
        t = t + np.concatenate([[0.0], 3600.0 * np.cumsum(steps < -1800.0)])
        keys = {"column": quoted(column.head), "format": quoted("%M:%S")}
        doubt = "minutes and seconds alone, as spreadsheets cut times: the hour is lost, and the trial has no date"
        found += _ranked(t, 2.0, keys, Answer(f"such as {column.cells[0].strip()}", (doubt,)), (column.head,))
    return found


def _of_clock(cell: str) -> float:
    half = re.search(r"\s*([AaPp])\.?[Mm]\.?$", cell.strip())
    parts = cell.strip()[: half.start() if half else None].split(":")
    try:
        hours = float(parts[0]) if half is None else float(parts[0]) % 12.0 + 12.0 * (half[1] in "pP")
        rest = sum(float(part.replace(",", ".")) * 60.0 ** (1 - k) for k, part in enumerate(parts[1:]))
        return 3600.0 * hours + rest
    except ValueError:
        return np.nan


_NO_ZONE = 'the times have no zone; write "UTC", "+02:00" or "Europe/Oslo" where it is known'
_DIGITS = re.compile(r"\d{1,14}([.,]\d+)?")
_EVEN = 0.5
"""Digits are hours, minutes and seconds where that makes the spread of the steps smaller than this part of it."""


def _digits(columns: Sequence[Column]) -> list[Clock]:
    """Times as digits without marks: HHMMSS, with a date in a column of its own or not, and YYYYMMDDHHMMSS."""
    found: list[Clock] = []
    days = [one for one in columns if one.score("date") > 0.3 and _all(one, r"\d{5,8}")]
    for column in columns:
        named = max(column.score(role) for role in ("time", "stamp", "clock", "epoch"))
        if column.kind != "number" or named < 0.4 or not column.varies or not _all(column, _DIGITS.pattern):
            continue
        first = next(cell for cell in column.cells if cell.strip()).strip()
        if len(first.partition(".")[0]) == 14 and first[:2] in ("19", "20"):
            found += _with_zone(column, {"column": quoted(column.head), "format": quoted("%Y%m%d%H%M%S")},
                                "%Y%m%d%H%M%S", "", lambda c: c, first, (column.head,))  # fmt: skip
        elif (t := _sexagesimal(column)) is not None:
            found += _digits_of_day(column, days[0] if days else None, t, first)
    return found


def _all(column: Column, form: str) -> bool:
    filled = [cell.strip() for cell in column.cells if cell.strip()]
    return bool(filled) and all(re.fullmatch(form, cell) for cell in filled)


def _sexagesimal(column: Column) -> Array | None:
    """Seconds since midnight of digits HHMMSS; None where they are not that, or may as well be seconds."""
    good = column.values[np.isfinite(column.values)]
    if good.max() >= 240000.0 or (good % 100.0).max() >= 60.0 or (good // 100.0 % 100.0).max() >= 60.0:
        return None
    t = column.values // 10000.0 * 3600.0 + column.values // 100.0 % 100.0 * 60.0 + column.values % 100.0
    raw, read = (float(np.nanstd(np.diff(one))) for one in (column.values, t))
    padded = all(re.match(r"\d{6}", cell.strip()) for cell in column.cells if cell.strip()) and good.min() < 100000.0
    return t if padded or (good.max() > 100.0 and read < _EVEN * raw) else None


def _digits_of_day(column: Column, day: Column | None, t: Array, first: str) -> list[Clock]:
    steps = np.nan_to_num(np.diff(t), nan=0.0)
    t = t + np.concatenate([[0.0], _DAY * np.cumsum(steps < -0.5 * _DAY)])
    if day is None:
        keys = {"column": quoted(column.head), "format": quoted("%H%M%S")}
        answer = Answer(f"digits of hours, minutes and seconds of the day, such as {first}")
        return _ranked(t, 2.6, keys, answer, (column.head,))
    written = next(cell for cell in day.cells if cell.strip()).strip()
    doubt = f"the date {written} is read as day, month and year; if it is year, month and day write %y%m%d"
    pattern, doubts = ("%Y%m%d", []) if len(written) == 8 and written[:2] in ("19", "20") else ("%d%m%y", [doubt])
    pattern = "%d%m%Y" if len(written) > 6 and pattern == "%d%m%y" else pattern
    utc = any("utc" in head.lower() or "gmt" in head.lower() for head in (column.head, day.head))
    if not utc:
        doubts.append(_NO_ZONE)
    keys = {"date": quoted(day.head), "column": quoted(column.head), "format": quoted(f"{pattern} %H%M%S"),
            "zone": quoted("UTC" if utc else "unknown")}  # fmt: skip
    answer = Answer(f"digits of a date and of hours, minutes and seconds, such as {written} {first}", tuple(doubts))
    return _ranked(t, 3.0, keys, answer, (day.head, column.head))


_COUNTS = {"datenum": (730_486.0, 743_300.0), "excel": (36_526.0, 49_310.0), "julian": (2_451_500.0, 2_465_000.0),
           "mjd": (51_544.0, 64_500.0)}  # fmt: skip
"""Days from 2000 to 2035 as MATLAB, spreadsheets and astronomers count them."""

_SLOWEST = 0.02
_OF_YEAR = ("yearday", "yday", "jday", "julian", "doy", "day")


def _days(columns: Sequence[Column]) -> list[Clock]:
    """Times in days: of a count from some date by their size, or of the year by their name."""
    found: list[Clock] = []
    for column in columns:
        named = max(column.score(role) for role in ("time", "stamp", "clock", "epoch", "date"))
        if column.kind != "number" or named < 0.4 or not column.varies or column.unit not in ("", "d"):
            continue
        steps = np.diff(column.values[np.isfinite(column.values)])
        if not 0.0 < float(np.median(np.abs(steps))) < _SLOWEST:
            continue
        middle, t = float(np.nanmedian(column.values)), column.values * _DAY
        keys = {"column": quoted(column.head)}
        form = next((name for name, (low, high) in _COUNTS.items() if low < middle < high), None)
        if form is not None:
            utc = any(word in column.head.lower() for word in ("utc", "gmt"))
            answer = Answer(
                f"days as {form} counts them, by the size of the numbers ({middle:.4f})", () if utc else (_NO_ZONE,)
            )
            keys |= {"format": quoted(form), "zone": quoted("UTC" if utc else "unknown")}
            found += _ranked(t, 2.8, keys, answer, (column.head,))
        elif 0.0 <= middle < 367.0 and any(word in column.name.lower() for word in _OF_YEAR):
            doubt = "days of a year by its name; the year is not in the column, so that the trial has no date"
            found += _ranked(t, 2.8, {**keys, "unit": quoted("d")}, Answer("days", (doubt,)), (column.head,))
        elif 0.0 <= np.nanmin(column.values) <= np.nanmax(column.values) <= 1.0 and (day := _day_of(columns)):
            doubt = f"parts of a day beside the days in '{day.head}', which are not read: the trial has no date"
            found += _ranked(t, 2.8, {**keys, "unit": quoted("d")}, Answer("days", (doubt,)), (column.head,))
    return found


def _day_of(columns: Sequence[Column]) -> Column | None:
    """The column of whole days as spreadsheets count them, by its name and size."""
    low, high = _COUNTS["excel"]
    return next((one for one in columns if one.kind == "number" and one.score("date") > 0.3
                 and bool(((one.values >= low) & (one.values <= high)).all())), None)  # fmt: skip


def _gps(columns: Sequence[Column]) -> list[Clock]:
    weeks = [c for c in columns if c.kind == "number" and c.score("week") > 0.4
             and 0 <= np.nanmin(c.values) <= np.nanmax(c.values) < 4000]  # fmt: skip
    tows = [c for c in columns if c.kind == "number" and c.score("tow") > 0.4]
    if not weeks or not tows:
        return []
    week, tow = weeks[0], tows[0]
    unit = "ms" if np.nanmax(tow.values) > _WEEK else "s"
    t = week.values * _WEEK + tow.values * (1e-3 if unit == "ms" else 1.0)
    keys = {"week": quoted(week.head), "column": quoted(tow.head), "format": quoted("gps")}
    keys |= {"unit": quoted("ms")} if unit == "ms" else {}
    answer = Answer(f"GPS week {np.nanmin(week.values):.0f} and its seconds")
    return _ranked(t, 3.2, keys, answer, (week.head, tow.head))


def _numbers(columns: Sequence[Column]) -> list[Clock]:
    """Seconds since the start, or since 1970 by their size."""
    found: list[Clock] = []
    for column in columns:
        name = max(
            column.score("time"), column.score("epoch"), 0.9 * column.score("stamp"), 0.9 * column.score("clock")
        )
        if column.kind != "number" or name < 0.4 or not column.varies:
            continue
        middle = float(np.nanmedian(column.values))
        epoch = next((unit for unit, size in _EPOCHS if 0.94 * size < middle < 2.5 * size), "")
        epoch = epoch if column.unit in ("", epoch) else ""
        keys = {"column": quoted(column.head)}
        if epoch:
            factor = 1e9 / dict(_EPOCHS)[epoch]
            t = column.values * factor - _CENTURY
            keys |= {"unit": quoted(epoch), "format": quoted("epoch")}
            nanos = [c for c in columns if epoch == "s" and c.kind == "number"
                     and c.name.lower().endswith(("nsecs", "nsec", "nanosec"))]  # fmt: skip
            if nanos:
                t, keys = t + 1e-9 * nanos[0].values, {**keys, "nanoseconds": quoted(nanos[0].head)}
            answer = Answer(f"since 1970, by the size of its numbers ({middle:.4g})")
            found += _ranked(t, 2.5 + 0.1 * name, keys, answer, (column.head, *(c.head for c in nanos[:1])))
            continue
        known = column.unit if column.unit in _UNITS else ""
        unit = known or "s"
        answer = Answer(f"unit by its {column.where}" if known else "numbers that rise from row to row")
        t, keys = column.values * _UNITS[unit], {**keys, "unit": quoted(unit)}
        if _of_a_day(t):
            found += _seconds_of_days(column, t, keys, name)
            continue
        far = float(np.nanmedian(np.abs(np.diff(column.values)))) > _TICKS
        others = () if known else ("ms", "us", "ns") if far else ("ms", "min", "us")
        found += _ranked(t, 2.2 + 0.1 * name, keys, answer, (column.head,), others)
    return found


def _seconds_of_days(column: Column, t: Array, keys: dict[str, str], score: float) -> list[Clock]:
    t = t + np.concatenate([[0.0], _DAY * np.cumsum(np.nan_to_num(np.diff(t)) < -0.5 * _DAY)])
    keys = {**keys, "format": quoted("seconds of the day")}
    answer = Answer("begins anew at midnight: seconds of the day")
    return _ranked(t, 2.4 + 0.1 * score, keys, answer, (column.head,))


def _of_a_day(t: Array) -> bool:
    """Whether numbers are seconds of the day that go over midnight: they begin anew at 0 from 86 400, and else rise."""
    good = t[np.isfinite(t)]
    back = np.flatnonzero(np.diff(good) < 0.0)
    slow = max(_SLOW, 3.0 * float(np.median(np.abs(np.diff(good))))) if good.size > 1 else 0.0
    return bool(back.size and (good >= 0.0).all() and (good <= _DAY).all() and (good[back] > _DAY - slow).all()
                and (good[back + 1] < slow).all())  # fmt: skip
