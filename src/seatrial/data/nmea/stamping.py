"""Stamps that loggers write around a sentence: which form a log has, and seconds from it.

One form serves a whole log: that which most of its first lines have, the most telling one first.  A stamp without a
zone is taken for UTC; what it is off by is seen against the clock of the receiver (`clocks`).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime, timedelta, timezone

import numpy as np

from ...core.values import dataclass
from .. import Array
from .digits import NOUGHTS, TENS, WIDEST, Bytes, Places, Same, alike, mapped, wholes
from .framing import MILLISECONDS

_MOST = 0.9
"""A form that tells more is taken where it serves this share of the lines that the most frequent one does."""
_FIRST, _LAST = 3.0e8, 4.0e9
"""Seconds since 1970 that a stamp may be: 1979 to 2096."""
_MILLI, _MICRO = 15.0, 2e4
"""Steps of whole numbers, from one line of a source to its next, that are milliseconds and microseconds from there."""
_TIME = r"(\d{1,2}):(\d\d):(\d\d)(?::?[.,](\d{1,9})|:(\d{3}))?"
_ZONE = r"\s*(Z|UTC|[+-]\d\d:?\d\d)?"
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")


def _of_day(same: Same, k: int) -> Array:
    """Seconds of the day from the groups of `_TIME` that begin at `k`."""
    seconds = (3600 * same.whole(k) + 60 * same.whole(k + 1) + same.whole(k + 2)).astype(np.float64)
    fraction = next((one for one in (k + 3, k + 4) if same.found[one]), None)
    return seconds if fraction is None else seconds + same.whole(fraction) / TENS[len(same.found[fraction])]


def _midnights(same: Same, order: Sequence[int], zone: int | None) -> Array:
    """Seconds since 1970 at 0 o'clock of the days in the groups of year, month and day; NaN for no day."""
    code = same.whole(order[0]) * 10_000 + same.whole(order[1]) * 100 + same.whole(order[2])
    ahead = np.zeros(len(same.start), np.int64)
    if zone and same.found[zone] and same.found[zone][0] in "+-":
        first, end = same.found.span(zone)
        ahead = 60 * wholes(same.data, same.start + first + 1, 2) + wholes(same.data, same.start + end - 2, 2)
        ahead = -ahead if same.found[zone][0] == "-" else ahead
    days, which = np.unique(code * _MINUTES + ahead + _MINUTES // 2, return_inverse=True)
    return np.array([_midnight(*divmod(one, _MINUTES)) for one in days.tolist()])[which]


Reader = Callable[[Same], Array]


_MINUTES = 20_000
"""More than any zone is ahead or behind."""


def _midnight(date: int, ahead: int = _MINUTES // 2) -> float:
    """Seconds since 1970 at 0 o'clock of a day yyyymmdd, in a zone `ahead` minutes and `_MINUTES` / 2 less ahead."""
    zone = timedelta(minutes=ahead - _MINUTES // 2)
    try:
        return datetime(date // 10_000, date // 100 % 100, date % 100, tzinfo=timezone(zone)).timestamp()
    except ValueError:
        return np.nan


def _ordered(order: str) -> Reader:
    """A date of three groups in this order, the time after it, and a zone."""
    groups = [1 + order.index(which) for which in "ymd"]
    return lambda found: _midnights(found, groups, 9) + _of_day(found, 4)


def _day_of_year(found: Same) -> Array:
    years, which = np.unique(found.whole(1), return_inverse=True)
    begun = np.array([_midnight(10_000 * year + 101) for year in years.tolist()])[which]
    return begun + 86400.0 * (found.whole(2) - 1) + _of_day(found, 3)


def _named_month(found: Same) -> Array:
    """A stamp of syslog, which has no year: seconds since the year began, a leap year."""
    month = found.found[1].lower()
    if month not in _MONTHS:
        return np.full(len(found.start), np.nan)
    days = found.whole(2)
    begun = np.array([_midnight(19_720_100 + 100 * _MONTHS.index(month) + day) for day in range(100)])
    return begun[days] + _of_day(found, 3)


def _epoch(found: Same) -> Array:
    value = found.decimal(1)
    value = np.where(value > MILLISECONDS, value / 1000.0, value)
    return np.where((value > _FIRST) & (value < _LAST), value, np.nan)


_FORMS: tuple[tuple[str, re.Pattern[str], Reader], ...] = (
    ("a date and time", re.compile(rf"(\d{{4}})-(\d\d)-(\d\d)[T _]{_TIME}{_ZONE}"), _ordered("ymd")),
    ("a date and time", re.compile(rf"(\d{{4}})/(\d\d)/(\d\d)[T ,;\t]+{_TIME}{_ZONE}"), _ordered("ymd")),
    ("a date, the day first", re.compile(rf"(\d\d)\.(\d\d)\.(\d{{4}})[T ,;\t]+{_TIME}{_ZONE}"), _ordered("dmy")),
    ("a date, the month first", re.compile(rf"(\d\d)/(\d\d)/(\d{{4}})[T ,;\t]+{_TIME}{_ZONE}"), _ordered("mdy")),
    ("a date, the day first", re.compile(rf"(\d\d)/(\d\d)/(\d{{4}})[T ,;\t]+{_TIME}{_ZONE}"), _ordered("dmy")),
    ("the day of the year", re.compile(rf"(\d{{4}}):(\d{{3}}):{_TIME}"), _day_of_year),
    ("seconds since 1970", re.compile(r"(?<![\d.])(\d{10}(?:\.\d+)?|\d{13}(?:\.\d+)?)(?![\d.])"), _epoch),
    ("a month and day without the year", re.compile(rf"([A-Z][a-z]{{2}})\s+(\d{{1,2}})\s+{_TIME}"), _named_month),
    ("the time of the day", re.compile(rf"(?<!\d){_TIME}{_ZONE}"), lambda found: _of_day(found, 1)),
    ("seconds", re.compile(r"^\s*[\[(]?(\d{1,9}(?:\.\d*)?)[\])]?[\s,;:]*$"), lambda found: found.decimal(1)),
    ("seconds", re.compile(r"^MSG\s+\d+\s+(\d{1,5}\.\d+)\s*$"), lambda found: found.decimal(1)),
)  # fmt: skip


@dataclass(frozen=True)
class Form:
    """How a log stamps its lines.

    Attributes:
        about: in words.
        pattern, read: of the stamp.
        behind: whether it stands behind the sentence.
        dated: whether it counts from 1970; else from the beginning of a day, or of anything.
    """

    about: str
    pattern: re.Pattern[str]
    read: Reader
    behind: bool = False
    dated: bool = False

    def seconds(self, around: Around) -> Array:
        """The stamps of lines [s]; NaN where one has none."""
        out = np.full(len(around.before), np.nan)
        where = around.behind if self.behind else around.before
        for rows, text in templates(around.data, *where.T):
            out[rows] = self.told(around.data, where[rows, 0], text)
        return out

    def told(self, data: Bytes, start: Places, text: str) -> Array | float:
        """The stamps of texts that begin at `start` and are the first one's but for their digits."""
        found = self.pattern.search(text)
        return np.nan if found is None else self.read(Same(data, start, found))


@dataclass(frozen=True)
class Around:
    """What stands before and behind the sentences of lines, without TAG blocks.

    Attributes:
        data: bytes in which they lie, and `digits.WIDEST` more.
        before, behind: first byte and number of bytes, lines by 2.
    """

    data: Bytes
    before: Places
    behind: Places


def around(texts: Sequence[tuple[bytes, bytes]]) -> Around:
    """What stands before and behind each of a few lines."""
    sizes = np.array([[len(before), len(behind)] for before, behind in texts], np.int64).reshape(-1)
    ends = np.cumsum(sizes)
    data = b"".join(part for pair in texts for part in pair) + bytes(WIDEST)
    spans = np.stack([ends - sizes, sizes], axis=1).reshape(-1, 2, 2)
    return Around(np.frombuffer(data, np.uint8), spans[:, 0], spans[:, 1])


def templates(data: Bytes, start: Places, width: Places) -> Iterator[tuple[Places, str]]:
    """Rows whose bytes are the same but for their digits, with the text of the first of them."""
    some = np.flatnonzero(width > 0)
    for rows in alike(mapped(data, NOUGHTS), start[some], width[some]):
        first = some[rows[0]]
        yield some[rows], data[start[first] : start[first] + width[first]].tobytes().decode("latin-1")


def form_of(tried: Around) -> Form | None:
    """The form that more than half of the lines have; None where no form is so frequent.

    Of two that serve equally (the day or the month first) the earlier one of the list is taken: where a day beyond
    the 12th comes, only one of them is left.

    Args:
        tried: what stands around the first sentence of each of some lines.
    """
    forms = [Form(about, pattern, read, behind, k < 7)
             for behind in (False, True) for k, (about, pattern, read) in enumerate(_FORMS)]  # fmt: skip
    count = [0] * len(forms)
    for where, some in ((tried.before, forms[: len(_FORMS)]), (tried.behind, forms[len(_FORMS) :])):
        for rows, text in templates(tried.data, *where.T):
            for form in some:
                seconds = np.broadcast_to(form.told(tried.data, where[rows, 0], text), len(rows))
                count[forms.index(form)] += int(np.isfinite(seconds).sum())
    best = max(count)
    if 2 * best <= len(tried.before):
        return None
    return forms[next(k for k in range(len(forms)) if count[k] >= _MOST * best)]


def unit_of(stamps: Sequence[Array]) -> tuple[float, str]:
    """Unit of stamps that are numbers without a date, in seconds and in words: no instrument waits for long.

    Loggers that count from their start do so in milliseconds or microseconds.

    Args:
        stamps: of each source, in the order of its lines.
    """
    known = [one[np.isfinite(one)] for one in stamps]
    steps = [float(np.median(np.diff(one))) for one in known if len(one) > 2]
    if not steps or any((one != np.round(one)).any() for one in known):
        return 1.0, ""
    quick = min(steps)
    return (1e-6, "microseconds") if quick > _MICRO else (1e-3, "milliseconds") if quick > _MILLI else (1.0, "")


def unwrapped_days(stamps: Array) -> Array:
    """Times of the day that go on beyond midnight."""
    return stamps + 86400.0 * np.cumsum(np.append(False, np.diff(stamps) < -43200.0))[: len(stamps)]
