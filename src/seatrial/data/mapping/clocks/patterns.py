"""Written times, by a pattern, as numbers of years, months, days, hours, minutes, seconds and nanoseconds."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ....core.values import dataclass

if TYPE_CHECKING:
    import polars as pl

_ZONE = r"(?P<zone>[A-Za-z]{1,5}|[+-][0-9]{2}(?::?[0-9]{2})?)"
_FRACTION = r"(?:[.,](?P<fraction>[0-9]+))?"
_ISO = (
    r"^(?P<year>[0-9]{4})[-/.]?(?P<month>[0-9]{1,2})[-/.]?(?P<day>[0-9]{1,2})[T _]\s*(?P<hour>[0-9]{1,2}):?"
    r"(?P<minute>[0-9]{2})(?::?(?P<second>[0-9]{2})" + _FRACTION + r")?\s*" + _ZONE + "?$"
)
_DAY = (
    r"^(?P<hour>[0-9]{1,3}):(?P<minute>[0-9]{2})(?::(?P<second>[0-9]{2})"
    + _FRACTION
    + r")?\s*(?P<half>[AaPp]\.?[Mm]\.?)?$"
)
_GROUPS = {
    "Y": r"(?P<year>[0-9]{4})", "y": r"(?P<short>[0-9]{2})", "m": r"(?P<month>[0-9]{1,2})", "d": r"(?P<day>[0-9]{1,2})",
    "a": r"[^\W\d_]{2,12}\.?", "b": r"(?P<name>[^\W\d_]{3,10})\.?", "B": r"(?P<name>[^\W\d_]{3,10})",
    "j": r"(?P<ordinal>[0-9]{1,3})",
    "H": r"(?P<hour>[0-9]{1,2})", "I": r"(?P<hour>[0-9]{1,2})", "M": r"(?P<minute>[0-9]{1,2})",
    "S": r"(?P<second>[0-9]{1,2})" + _FRACTION, "f": r"(?P<fraction>[0-9]+)", "p": r"(?P<half>[AaPp]\.?[Mm]\.?)",
    "z": _ZONE, "%": "%",
}  # fmt: skip
_MONTHS = (
    "jan janv ene gen", "feb fev fév", "mar mär mrt maa", "apr avr abr", "may mai mag maj mei maí", "jun juin giu",
    "jul juil lug", "aug aoû aou ago", "sep set", "oct okt ott out", "nov", "dec dez des dic déc",
)  # fmt: skip
"""First letters of the months in English, German, French, Spanish, Italian, Portuguese, Dutch and Nordic languages."""
_LENGTHS = np.array([0, 31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31])

Whole = NDArray[np.int64]


@dataclass(frozen=True)
class Fields:
    """Parts of written times, each of shape (rows,); those of a row without a time are 0.

    Attributes:
        dated: whether they have a date.
        zone: as written, null without one.
        wrong: whether no calendar or clock has such a time.
    """

    dated: bool
    year: Whole
    month: Whole
    day: Whole
    hour: Whole
    minute: Whole
    second: Whole
    nanosecond: Whole
    zone: pl.Series
    wrong: NDArray[np.bool_]


@dataclass(frozen=True)
class Pattern:
    """How times are written: as a regular expression with a named group for each part, and by an example."""

    form: str
    example: str

    @property
    def dated(self) -> bool:
        """Whether there is a date in it."""
        return any(f"<{part}>" in self.form for part in ("year", "short"))

    @property
    def hours(self) -> bool:
        """Whether there are hours in it."""
        return "<hour>" in self.form

    def fields(self, written: pl.Series, fraction: str) -> Fields | None:
        """The parts of written times; None where one is not in the pattern.

        Args:
            written: texts; null without a time.
            fraction: "ns" where the digits after the dot count nanoseconds.
        """
        import polars as pl

        found = written.str.extract_groups(self.form).struct.unnest()
        held = set(found.columns)
        always = next(name for name in ("hour", "minute") if name in held)
        if bool((found[always].is_null() & written.is_not_null()).any()):
            return None

        def whole(name: str) -> Whole:
            if name not in held:
                return np.zeros(len(written), dtype=np.int64)
            return found[name].cast(pl.Int64, strict=False).fill_null(0).to_numpy()

        digits = found["fraction"].fill_null("") if "fraction" in held else pl.Series([""] * len(written))
        nanosecond = _nanoseconds(digits, fraction)
        year, month, day = whole("year"), whole("month"), whole("day")
        if "short" in held:
            year = whole("short") + np.where(whole("short") < 70, 2000, 1900)
        if "name" in held:
            month = _numbers_of(found["name"])
        if "ordinal" in held:
            month, day = np.ones_like(day), whole("ordinal")
        hour = whole("hour")
        if "half" in held:
            half = found["half"].str.to_lowercase().str.slice(0, 1)
            hour = np.where(half.is_null().to_numpy(), hour, hour % 12 + 12 * (half == "p").fill_null(False).to_numpy())
        minute, second = whole("minute"), whole("second")
        wrong = (minute > 59) | (second > 60) | (nanosecond >= 10**9)
        if self.dated:
            wrong |= (hour > 23) | (year < 1970) | (year > 2261) | _no_date(year, month, day, "ordinal" in held)
        zone = found["zone"] if "zone" in held else pl.Series([None] * len(written), dtype=pl.String)
        return Fields(self.dated, year, month, day, hour, minute, second, nanosecond, zone, wrong)


def iso() -> Pattern:
    """ISO 8601, also with a blank or slashes: 2025-04-11T11:51:10.63+02:00, 2025/04/11 11:51:10."""
    return Pattern(_ISO, "2025-04-11T11:51:10.63+02:00")


def of_day() -> Pattern:
    """Hours, minutes and seconds: 11:51:10.63."""
    return Pattern(_DAY, "11:51:10.63")


def patterned(format: str) -> Pattern:
    """The pattern of a format of a mapping: "iso", "clock", or directives such as "%d.%m.%Y %H:%M:%S"."""
    if format in ("iso", "clock"):
        return iso() if format == "iso" else of_day()
    # the fraction of a second is read wherever there is one
    plain = re.sub(r"%S[.,]%f", "%S", format)
    parts = re.split(r"%(.)", plain)
    form = ""
    for k, part in enumerate(parts):
        group = _GROUPS[part] if k % 2 else re.escape(part).replace(r"\ ", r"\s+")
        # of digits without a mark between them only the first may have lost its zero
        form += group.replace("{1,2}", "{2}") if k % 2 and k > 1 and not parts[k - 1] else group
    return Pattern(f"^{form}$", f"'{format}'")


def _nanoseconds(digits: pl.Series, fraction: str) -> Whole:
    import polars as pl

    if fraction == "decimal":
        digits = digits.str.pad_end(9, "0").str.slice(0, 9)
    return digits.cast(pl.Int64, strict=False).fill_null(0).to_numpy()


def _numbers_of(names: pl.Series) -> Whole:
    """Numbers of months by their names; 0 for others."""
    import polars as pl

    known = {name: k for k, some in enumerate(_MONTHS, start=1) for name in some.split()}
    whole = names.str.to_lowercase()
    told = [whole.str.slice(0, size).replace_strict(known, default=0, return_dtype=pl.Int64).fill_null(0).to_numpy()
            for size in (4, 3)]  # fmt: skip
    return np.where(told[0] > 0, told[0], told[1])


def _no_date(year: Whole, month: Whole, day: Whole, ordinal: bool) -> NDArray[np.bool_]:
    leap = (year % 4 == 0) & ((year % 100 != 0) | (year % 400 == 0))
    if ordinal:
        return (day < 1) | (day > 365 + leap)
    longest = _LENGTHS[np.clip(month, 0, 12)] + (leap & (month == 2))
    return (month < 1) | (month > 12) | (day < 1) | (day > longest)
