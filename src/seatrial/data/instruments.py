"""Readings of the instruments of a log that is not of NMEA 0183, and the trial of them: by the rules of `nmea.sources`.

A source is named as a talker and three characters, such as ``35/127250``: address and group.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ..core.values import dataclass, field, replace
from . import Array, DataError, Trial
from .formats.nmea import Aboard, Log, aboard_of, preferred, trial_of, true_headings
from .nmea.copies import apart
from .nmea.sources import Series, chosen
from .table import existing

_LONGEST = 1 << 16
"""Bytes of a line that are looked at."""

Finish = Callable[[dict[str, Series]], Mapping[str, str]]
"""Changes the chosen series in place; the names of quantities in place of those of readings."""


@dataclass
class Heard:
    """Readings as they come: by source and name, of several at one time the later ones.

    Attributes:
        ignored: number of lines, messages or groups of each kind that nothing is read from.
        lines, invalid: how many there are, and how many could not be read.
        first: what is wrong with the first of those.
    """

    ignored: dict[str, int] = field(default_factory=dict[str, int])
    lines: int = 0
    invalid: int = 0
    first: str = ""
    _kept: dict[str, dict[str, _Kept]] = field(default_factory=dict[str, "dict[str, _Kept]"])
    _whole: dict[str, dict[str, Series]] = field(default_factory=dict[str, dict[str, Series]])

    def add(self, t: float, source: str, values: Mapping[str, float]) -> None:
        """Readings of one source at one time [s], by the names of `nmea.readings.readings`."""
        for name, value in values.items():
            if math.isfinite(value) and math.isfinite(t):
                times, kept = self._kept.setdefault(source, {}).setdefault(name, (array("d"), array("d")))
                times.append(t)
                kept.append(value)

    def many(self, source: str, name: str, t: Array, values: Array) -> None:
        """Readings of one name of a source, behind those that it told before."""
        good = np.isfinite(t) & np.isfinite(values)
        times, kept = self._kept.setdefault(source, {}).setdefault(name, (array("d"), array("d")))
        times.frombytes(t[good].tobytes())
        kept.frombytes(np.asarray(values, np.float64)[good].tobytes())

    def join(self, other: Heard) -> None:
        """What other sources told."""
        self._kept |= other._kept
        self._whole |= other._whole

    def whole(self, source: str, name: str, t: Array, values: Array) -> None:
        """All readings of one name of a source; of several at one time the later ones."""
        good = np.flatnonzero(np.isfinite(t) & np.isfinite(values))
        if good.size:
            self._whole.setdefault(source, {})[name] = _rising(t[good], values[good])

    def leave(self, kind: str, count: int = 1) -> None:
        """Count what nothing is read from."""
        self.ignored[kind] = self.ignored.get(kind, 0) + count

    def refuse(self, why: str) -> None:
        """Count a line that cannot be read."""
        self.invalid += 1
        self.first = self.first or f"line {self.lines}: {why}"

    def told(self) -> dict[str, dict[str, Series]]:
        """Times, rising, and values of each quantity of each source."""
        one_by_one = {source: {name: _rising(*map(np.array, kept)) for name, kept in some.items()}
                      for source, some in self._kept.items()}  # fmt: skip
        return {**self._whole, **one_by_one}


_Kept = tuple["array[float]", "array[float]"]
"""Times and values as they came."""


def _rising(t: Array, values: Array) -> Series:
    """Readings in the order of time; of several at one time the last."""
    order = np.argsort(t, kind="stable")
    t, values = t[order], values[order]
    last = np.append(np.diff(t) != 0.0, np.True_)
    return t[last], values[last]


def each_line(path: Path, heard: Heard, take: Callable[[str], None]) -> None:
    """Give each line that is not empty, without its end, and count them in `heard`.

    Raises:
        DataError: no such file, or one that may not be read.
    """
    try:
        with existing(path).open("rb") as file:
            while raw := file.readline(_LONGEST):
                heard.lines += 1
                text = raw.decode("utf-8-sig" if heard.lines == 1 else "utf-8", "replace").rstrip("\r\n\0 ")
                if text:
                    take(text)
    except OSError as error:
        raise DataError(f"{path}: not readable: {error.strerror}") from None


def trial_by(
    path: Path, heard: Heard, what: str, mapping: Aboard | None = None, epoch: float | None = 0.0,
    steps: Sequence[str] = (), finish: Finish | None = None, plain: Mapping[str, str] = MappingProxyType({}),
    digits: int = 6, base: str = "",
) -> Trial:  # fmt: skip
    """The trial of what instruments told.

    Args:
        path: of the log, for its name and the errors.
        heard: the readings.
        what: the kind of log, for the processing steps.
        mapping: where the instruments are; None for the file beside the log, if it has one.
        epoch: seconds since 1970 at time 0; None where the log has no date.
        steps: what was done before.
        finish: see `Finish`.
        plain: readings that are channels as they are, with their units.
        digits: of the seconds of the clock.
        base: reading whose times are the rows; where it is empty or not there, that with most readings.

    Raises:
        DataError: nothing of a ship's motion, magnetic headings alone without variation, or mostly invalid lines.
    """
    told = heard.told()
    if not told or 2 * heard.invalid > max(heard.lines, 1):
        why = heard.first or f"nothing of a ship's motion; it holds {', '.join(list(heard.ignored)[:8]) or 'nothing'}"
        counted = f"{heard.lines} lines, {heard.invalid} of them not of {what}" if heard.lines else f"no {what}"
        raise DataError(f"{path}: {counted}; {why}")
    aboard = mapping or aboard_of(path)
    told, turns = apart(told)
    more = [*steps, *turns]
    if heard.invalid:
        more.append(f"{heard.invalid} of {heard.lines} lines could not be read, the first: {heard.first}")
    told = true_headings(path, told, aboard, more)
    ends = [float(t[k]) for one in told.values() for t, _ in one.values() for k in (0, -1)]
    series, choices = chosen(told, preferred(path, aboard, told), max(ends) - min(ends))
    renamed = finish(series) if finish else {}
    choices = [replace(one, group=renamed.get(one.group, one.group)) for one in choices]
    more += [f"{one.group}: {one}" for one in choices if one.others]
    counts = {"all": heard.lines, "invalid": heard.invalid} if heard.lines else {}
    log = Log(series, more, epoch, counts, choices, dict(sorted(heard.ignored.items())), plain, digits, base)
    return trial_of(path, log, aboard, what)
