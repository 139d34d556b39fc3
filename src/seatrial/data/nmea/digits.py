"""Numbers in bytes, many at a time, to the last bit what `float` makes of their text; and rows of bytes that are alike.

A decimal is a whole number over a power of ten: where a float holds both, their quotient is the float nearest to the
decimal.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from .. import Array

Bytes = NDArray[np.uint8]
Places = NDArray[np.int64]

_SURE, _HELD = 18, 2**53
"""Digits of a number that 64 bits hold, and up to where a float holds every whole number."""
WIDEST = 24
"""Bytes of a number that are looked at."""
TENS: Array = np.power(10.0, np.arange(WIDEST + 1))
"""Powers of ten by which digits behind the point are scaled."""
WHOLE_TENS: Places = 10 ** np.minimum(np.arange(WIDEST + 1), 18).astype(np.int64)
"""The same as integers; 10^18 is the last that 64 bits hold."""

NOUGHTS = bytes(ord("0") if chr(k).isascii() and chr(k).isdigit() else k for k in range(256))
"""A table for `mapped`: every digit is a nought."""
HEX: Places = np.array([int(chr(k), 16) if chr(k) in "0123456789ABCDEFabcdef" else 999 for k in range(256)])
"""What a byte is as a hexadecimal digit; 999 where it is none."""
_ZERO, _POINT = ord("0"), ord(".") + 256 - ord("0")
_BASE = 0x9E3779B97F4A7C15
_INVERSE = pow(_BASE, -1, 1 << 64)


@dataclass(frozen=True)
class Decimals:
    """Fields taken for digits with a point among them, one a row.

    Attributes:
        number: the digits as a whole number.
        before, after: how many stand before the point, or behind it.
        odd: fields with more digits or bytes than are counted here; their other values mean nothing.
        wrong: fields that hold anything else, or two points.
    """

    number: Places
    before: Places
    after: Places
    odd: NDArray[np.bool_]
    wrong: NDArray[np.bool_]

    @property
    def value(self) -> Array:
        """The decimals; of fields that are odd or wrong anything."""
        return self.number / TENS[np.minimum(self.after, WIDEST)]


def rows_of(data: Bytes, start: Places, width: int) -> Bytes:
    """A row of bytes from each place on."""
    return (
        np.lib.stride_tricks.sliding_window_view(data, width)[start] if width else np.empty((len(start), 0), np.uint8)
    )


def decimals(data: Bytes, start: Places, width: Places) -> Decimals:
    """Scan fields that begin at `start` and are `width` bytes long; `data` goes on for `WIDEST` bytes behind them."""
    number: Places = np.zeros(len(start), np.int64)
    least, most = int(width.min(initial=WIDEST)), int(width.max(initial=0))
    digits, after, points = (np.zeros(len(start), np.uint8) for _ in range(3))
    table = np.ascontiguousarray(rows_of(data, start, min(most, WIDEST)).T) - np.uint8(_ZERO)
    for k, digit in enumerate(table):
        if k >= least:
            digit[width <= k] = 255
        is_digit = digit < 10
        if is_digit.all():
            number = (number * 10 + digit).astype(np.int64, copy=False)
        else:
            number = np.where(is_digit, number * 10 + digit, number)
            points += digit == _POINT
        digits += is_digit
        after += is_digit & (points > 0)
    wrong = (digits + points != width) | (points > 1)
    odd = (digits > _SURE) | (number > _HELD) | (width > WIDEST)
    return Decimals(number, (digits - after).astype(np.int64), after.astype(np.int64), odd, wrong)


def mapped(data: Bytes, table: bytes) -> Bytes:
    """Bytes by a table of 256."""
    return np.frombuffer(data.tobytes().translate(table), np.uint8)


def wholes(data: Bytes, start: Places, width: int) -> Places:
    """Whole numbers of `width` digits each, at most 18."""
    return (rows_of(data, start, width) - np.uint8(_ZERO)) @ WHOLE_TENS[:width][::-1]


@dataclass(frozen=True)
class Same:
    """Texts that match as the first of them does, as they are the same but for their digits.

    Attributes:
        data, start: bytes, and where each text begins.
        found: the match in the first of them; it is that of all.
    """

    data: Bytes
    start: Places
    found: re.Match[str]

    def whole(self, k: int) -> Places:
        """The whole numbers of a group."""
        first, end = self.found.span(k)
        return wholes(self.data, self.start + first, end - first)

    def decimal(self, k: int, skip: int = 0) -> Array:
        """The numbers of a group, the first bytes of it skipped; NaN where one is none."""
        first, end = self.found.span(k)
        first += skip
        told = decimals(self.data, self.start + first, np.full(len(self.start), end - first))
        value = np.where(told.wrong, np.nan, told.value)
        for at in np.flatnonzero(told.odd).tolist():
            text = self.data[self.start[at] + first : self.start[at] + end].tobytes()
            try:
                value[at] = float(text)
            except ValueError:
                value[at] = np.nan
        return value


@cache
def _power_table(base: int, size: int) -> NDArray[np.uint64]:
    return np.cumprod(np.append(np.uint64(1), np.full(size - 1, base, np.uint64)), dtype=np.uint64)


def _powers(base: int, count: int) -> NDArray[np.uint64]:
    """Powers 0 to `count` - 1 of an odd number, modulo 2^64."""
    return _power_table(base, 1 << max(count - 1, 1).bit_length())[:count]


def alike(
    data: Bytes, start: Places, length: Places, beside: NDArray[np.uint64] | None = None, few: int = 1
) -> Iterator[Places]:  # fmt: skip
    """Numbers of rows of at least one byte that are equal, and have equal numbers beside them, group by group.

    Groups of fewer than `few` rows are left out.
    """
    if not len(start):
        return
    total = np.zeros(len(data) + 1, np.uint64)
    np.cumsum(np.multiply(data, _powers(_BASE, len(data)), out=total[1:]), out=total[1:])
    hashed = (total[start + length] - total[start]) * _powers(_INVERSE, len(data))[start] + length.astype(np.uint64)
    hashed = hashed if beside is None else hashed ^ beside
    order = np.argsort(hashed, kind="stable")
    waiting = np.split(order, np.flatnonzero(np.diff(hashed[order])) + 1)
    while waiting:
        rows = waiting.pop()
        if len(rows) < few:
            continue
        size = int(length[rows[0]])
        same = length[rows] == size if beside is None else (length[rows] == size) & (beside[rows] == beside[rows[0]])
        table = rows_of(data, start[np.where(same, rows, rows[0])], size)
        same &= (table == table[0]).all(axis=1)
        if not same.all():  # two rows of one hash
            waiting.append(rows[~same])
        yield rows[same]
