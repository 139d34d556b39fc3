"""Stamps that loggers write around a sentence: which form a log has, and seconds from it.

One form serves a whole log: that which most of its first lines have, the most telling one first.  A stamp without a
zone is taken for UTC; what it is off by is seen against the clock of the receiver (`clocks`).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone

_TRIED = 400
"""Lines by which the form is chosen."""

_MOST = 0.9
"""A form that tells more is taken where it serves this share of the lines that the most frequent one does."""
_MILLISECONDS = 1e11
_FIRST, _LAST = 3.0e8, 4.0e9
"""Seconds since 1970 that a stamp may be: 1979 to 2096."""
_TIME = r"(\d{1,2}):(\d\d):(\d\d)(?::?[.,](\d{1,9})|:(\d{3}))?"
_ZONE = r"\s*(Z|UTC|[+-]\d\d:?\d\d)?"
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")

Reader = Callable[[re.Match[str]], float | None]


def _of_day(found: re.Match[str], k: int) -> float:
    """Seconds of the day from the groups of `_TIME` that begin at `k`."""
    fraction = found[k + 3] or found[k + 4] or ""
    return 3600 * int(found[k]) + 60 * int(found[k + 1]) + int(found[k + 2]) + float(f"0.{fraction or 0}")


def _since(year: int, month: int, day: int, seconds: float, zone: str | None) -> float | None:
    try:
        midnight = datetime(year, month, day, tzinfo=UTC)
        if zone and zone not in ("Z", "UTC"):
            hours, minutes = int(zone[1:3]), int(zone[-2:])
            ahead = timedelta(hours=hours, minutes=minutes)
            midnight = midnight.replace(tzinfo=timezone(ahead if zone[0] == "+" else -ahead))
        return midnight.timestamp() + seconds
    except ValueError:
        return None


def _ordered(order: str) -> Reader:
    """A date of three groups in this order, the time after it, and a zone."""

    def read(found: re.Match[str]) -> float | None:
        year, month, day = (int(found[1 + order.index(which)]) for which in "ymd")
        return _since(year, month, day, _of_day(found, 4), found[9])

    return read


def _day_of_year(found: re.Match[str]) -> float | None:
    midnight = _since(int(found[1]), 1, 1, 0.0, None)
    return None if midnight is None else midnight + 86400.0 * (int(found[2]) - 1) + _of_day(found, 3)


def _named_month(found: re.Match[str]) -> float | None:
    """A stamp of syslog, which has no year: seconds since the year began, a leap year."""
    month = found[1].lower()
    return _since(1972, _MONTHS.index(month) + 1, int(found[2]), _of_day(found, 3), None) if month in _MONTHS else None


def _epoch(found: re.Match[str]) -> float | None:
    value = float(found[1])
    value = value / 1000.0 if value > _MILLISECONDS else value
    return value if _FIRST < value < _LAST else None


def _plain(found: re.Match[str]) -> float | None:
    return float(found[1])


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
    ("seconds", re.compile(r"^\s*[\[(]?(\d{1,9}(?:\.\d*)?)[\])]?[\s,;:]*$"), _plain),
    ("seconds", re.compile(r"^MSG\s+\d+\s+(\d{1,5}\.\d+)\s*$"), _plain),
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

    def seconds(self, before: bytes, behind: bytes) -> float | None:
        """The stamp of a line [s]; None where it has none."""
        found = self.pattern.search((behind if self.behind else before).decode("latin-1"))
        return None if found is None else self.read(found)


def form_of(around: Sequence[tuple[bytes, bytes]]) -> Form | None:
    """The form that more than half of the lines have; None where no form is so frequent.

    Of two that serve equally (the day or the month first) the earlier one of the list is taken: where a day beyond
    the 12th comes, only one of them is left.

    Args:
        around: what stands before and behind the first sentence of each line.
    """
    tried = [*around[:_TRIED], *around[_TRIED :: max(len(around) // _TRIED, 1)]]
    count: Counter[int] = Counter()
    forms = [Form(about, pattern, read, behind, k < 7)
             for behind in (False, True) for k, (about, pattern, read) in enumerate(_FORMS)]  # fmt: skip
    for k, form in enumerate(forms):
        count[k] = sum(form.seconds(*one) is not None for one in tried)
    best = max(count.values(), default=0)
    if not tried or 2 * best <= len(tried):
        return None
    return forms[next(k for k in range(len(forms)) if count[k] >= _MOST * best)]


def unwrapped_days(stamps: Iterable[float]) -> list[float]:
    """Times of the day that go on beyond midnight."""
    out, days, last = list[float](), 0, None
    for one in stamps:
        if last is not None and one < last - 43200.0:
            days += 1
        last = one
        out.append(one + 86400.0 * days)
    return out
