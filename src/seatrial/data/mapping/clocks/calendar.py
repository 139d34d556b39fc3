"""The calendar: days of dates, leap seconds of GPS time, and names of zones that are a fixed offset."""

from __future__ import annotations

import re
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from .patterns import Fields

EPOCHS = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1}
"""Nanoseconds of the units of Unix time."""

DAYS = {"excel": 25_569.0, "datenum": 719_529.0, "julian": 2_440_587.5, "mjd": 40_587.0}
"""The first of January 1970 as spreadsheets (from 1900), MATLAB and astronomers (whole, modified) count days."""

Ticks = NDArray[np.int64]
_SECOND = 10**9
_FIXED = re.compile(r"([+-])(\d{2}):?(\d{2})?")

# Days on which UTC has got a second more (IERS, Bulletin C), since GPS time began; none was announced until 2026.
_LEAPS = (
    "1981-07", "1982-07", "1983-07", "1985-07", "1988-01", "1990-01", "1991-01", "1992-07", "1993-07", "1994-07",
    "1996-01", "1997-07", "1999-01", "2006-01", "2009-01", "2012-07", "2015-07", "2017-01",
)  # fmt: skip


def days(year: NDArray[np.int64], month: NDArray[np.int64], day: NDArray[np.int64]) -> NDArray[np.int64]:
    """Days since 1970 of dates of the Gregorian calendar."""
    # years that begin in March put the leap day last
    year = year - (month <= 2)
    era = year // 400
    of_era = year - 400 * era
    of_year = (153 * (month + np.where(month > 2, -3, 9)) + 2) // 5 + day - 1
    return era * 146_097 + of_era * 365 + of_era // 4 - of_era // 100 + of_year - 719_468


def civil(found: Fields) -> Ticks:
    """Nanoseconds since 1970 of dates and times of day as they are written; since midnight without a date."""
    day = days(found.year, found.month, found.day) if found.dated else np.zeros_like(found.hour)
    return ((day * 24 + found.hour) * 60 + found.minute) * (60 * _SECOND) + found.second * _SECOND + found.nanosecond


def leap_seconds(gps: Ticks) -> NDArray[np.int64]:
    """Seconds by which GPS time is ahead of UTC, at times since 1970 that count as GPS does [ns]."""
    begins = [datetime.fromisoformat(f"{month}-01").replace(tzinfo=UTC).timestamp() for month in _LEAPS]
    # the n-th step is at n - 1 s after midnight as GPS counts
    edges = np.array([int(begin) + k for k, begin in enumerate(begins, start=1)], dtype=np.int64) * _SECOND
    return np.searchsorted(edges, gps, side="right").astype(np.int64)


def offset_of(zone: str) -> int | None:
    """Local time less UTC of a zone that is always the same [ns]; None for others."""
    if zone.upper() in ("Z", "UTC", "GMT"):
        return 0
    found = _FIXED.fullmatch(zone)
    if found is None or int(found[2]) > 14 or int(found[3] or 0) > 59:
        return None
    return (-1 if found[1] == "-" else 1) * (int(found[2]) * 60 + int(found[3] or 0)) * 60 * _SECOND
