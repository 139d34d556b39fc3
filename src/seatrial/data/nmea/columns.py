"""Many sentences of one shape, read together: fields are columns of bytes, numbers of all sentences one array.

Sentences have a shape where all but their digits, signs and points is the same: address, words, and how many fields
there are.  Where a reader asks for something in which they still differ (a field that is empty in some, the number of a
shaft), they are parted by it and read anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from .. import Array
from . import heard
from .digits import WHOLE_TENS, Bytes, Decimals, Places, decimals, rows_of
from .readings import Found, read

_PARTS = 64
"""Parts of one shape at most; sentences that differ more are read one by one."""


class _DifferError(Exception):
    """Sentences differ in what a reader asks for; `part` has a number for each, the same where they are the same."""

    def __init__(self, part: NDArray[np.int64]) -> None:
        super().__init__()
        self.part = part


@dataclass(frozen=True)
class Columns:
    """The `readings.Fields` of sentences of one shape.

    Attributes:
        kind: of the sentences.
        data: bytes in which they lie, and `digits.WIDEST` more.
        start, stop: first byte of each field and the one behind its last, fields by sentences.
        words: fields without digits, signs and points.
        row: number of each sentence.
    """

    kind: str
    data: Bytes
    start: Places
    stop: Places
    words: tuple[str, ...]
    row: Places

    def __len__(self) -> int:
        return len(self.words)

    def text(self, k: int) -> str:
        if k >= len(self):
            return ""
        width = self.stop[k] - self.start[k]
        most = int(width.max())
        table = rows_of(self.data, self.start[k], most) * (np.arange(most) < width[:, None])
        if (table == table[0]).all():
            return table[0].tobytes().decode("latin-1").rstrip("\0")
        raise _DifferError(np.unique(np.ascontiguousarray(table).view(f"V{most}").ravel(), return_inverse=True)[1])

    def word(self, k: int) -> str:
        if k >= len(self):
            return ""
        plain = self.stop[k] - self.start[k] == len(self.words[k])
        if plain.all():
            return self.words[k]
        if plain.any():
            raise _DifferError(plain.astype(np.int64))
        return "#"

    def number(self, k: int) -> Array:
        if self._worded(k):
            return np.full(len(self.row), np.nan)
        first = self.data[self.start[k]]
        signed = ((first == ord("+")) | (first == ord("-"))) & (self.stop[k] > self.start[k])
        found = decimals(self.data, self.start[k] + signed, self.stop[k] - self.start[k] - signed)
        wrong = found.wrong | (found.before > 9) | (found.after > 12) | (found.before + found.after < 1)
        value = np.where(signed & (first == ord("-")), -found.value, found.value)
        return self._sure(k, found, np.where(wrong, np.nan, value), heard.number)

    def clock(self, k: int) -> Array:
        if self._worded(k):
            return np.full(len(self.row), np.nan)
        found = decimals(self.data, self.start[k], self.stop[k] - self.start[k])
        unit = WHOLE_TENS[np.minimum(found.after, 15)]
        minutes = found.number // (100 * unit)
        whole = found.number // unit - 100 * minutes
        good = ~found.wrong & (found.before == 6) & (minutes // 100 <= 24) & (minutes % 100 < 60) & (whole <= 60)
        seconds = (found.number - 100 * minutes * unit) / unit
        value = 3600 * (minutes // 100) + 60 * (minutes % 100) + seconds
        return self._sure(k, found, np.where(good, value, np.nan), heard.clock)

    def place(self, k: int) -> Array:
        if self._worded(k):
            return np.full(len(self.row), np.nan)
        found = decimals(self.data, self.start[k], self.stop[k] - self.start[k])
        unit = 100 * WHOLE_TENS[np.minimum(found.after, 15)]
        degrees = found.number // unit
        minutes = (found.number - degrees * unit) / (unit // 100)
        good = ~found.wrong & (found.before >= 3) & (found.before <= 5) & (minutes < 60.0)
        return self._sure(k, found, np.where(good, degrees + minutes / 60.0, np.nan), heard.place)

    def _worded(self, k: int) -> bool:
        """Whether a field can hold no number: it is not there, or holds letters in all sentences."""
        return k >= len(self) or self.words[k] != ""

    def _sure(self, k: int, found: Decimals, value: Array, one: Callable[[str], float]) -> Array:
        """Values, those of fields with too many digits one by one."""
        for at in np.flatnonzero(found.odd).tolist():
            value[at] = one(self.data[self.start[k, at] : self.stop[k, at]].tobytes().decode("latin-1"))
        return value

    def _parted(self, part: NDArray[np.int64]) -> Iterator[Columns]:
        for which in range(int(part.max()) + 1):
            yours = np.flatnonzero(part == which)
            start, stop, row = self.start[:, yours], self.stop[:, yours], self.row[yours]
            yield Columns(self.kind, self.data, start, stop, self.words, row)

    def read(self) -> Iterator[tuple[Places, Found]]:
        """Readings with the rows that they are of; a row that is in none is too different from the others."""
        waiting: list[Columns] = [self]
        parts = 1
        while waiting:
            one = waiting.pop()
            try:
                yield one.row, read(one)
            except _DifferError as differ:
                parts += int(differ.part.max())
                if parts <= _PARTS:
                    waiting += one._parted(differ.part)
