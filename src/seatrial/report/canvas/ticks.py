"""Numbers along an axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_LARGE, _SMALL = 6, -4
"""Powers of ten from which, and up to which, the numbers of an axis are told as multiples of one."""


_DIGIT, _WIDTHS = 6.4, {".": 3.2, "−": 8.4}
"""Widths of a digit and of what is no digit, in letters of ten points of DejaVu Sans [pt]."""


def rounded(low: float, high: float, most: int = 4, whole: bool = False) -> list[float]:
    """Round numbers between two ends, `most` intervals of 1, 2 or 5 times a power of ten at most."""
    rough = (high - low) / most
    size = 10.0 ** math.floor(math.log10(rough))
    step = next(m * size for m in (1.0, 2.0, 5.0, 10.0) if m * size >= rough * (1 - 1e-9))
    step = max(step, 1.0) if whole else step
    return [step * k for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def logarithmic(low: float, high: float, most: int) -> list[float]:
    """Numbers of a logarithmic axis: powers of ten, with others between them where these are few, or round ones."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    stride = max(1, math.ceil((last - first) / most))
    for mantissas in ((1.0,), (1.0, 2.0, 5.0)):
        found = [m * 10.0**k for k in range(first, last + 1, stride) for m in mantissas if low <= m * 10.0**k <= high]
        if len(found) >= 3:
            return found
    return [value for value in rounded(low, high, min(most, 4)) if value > 0.0]


def labels(values: Sequence[float], room: float = math.inf) -> tuple[list[str], str]:
    """Numbers along a linear axis, and the power of ten that all are multiples of: of large, small and long ones.

    Args:
        room: width that a number has, in letters of ten points [pt].
    """
    largest = max(map(abs, values), default=0.0)
    power = math.floor(math.log10(largest)) if largest > 0.0 else 0
    if _SMALL < power < _LARGE and all(_wide(text) <= room for text in plain(values)):
        power = 0
    return plain([value / 10.0**power for value in values]), f"×10{str(power).translate(_RAISED)}" if power else ""


def _wide(text: str) -> float:
    """Width of a number of ten points, in the widest of the common fonts [pt]."""
    return sum(_WIDTHS.get(letter, _DIGIT) for letter in text)


def plain(values: Sequence[float]) -> list[str]:
    """Rising numbers, with as many decimals as tell neighbours apart."""
    step = min((b - a for a, b in pairwise(values)), default=1.0)
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    shown = [f"{0.0 if abs(one) < 1e-9 * step else one:.{decimals}f}" for one in values]
    return [text.replace("-", "−") for text in shown]


def alone(value: float) -> str:
    """A number by itself, as along a logarithmic axis; a large or a small one as a power of ten."""
    power = math.floor(math.log10(value) + 1e-9)
    if _SMALL < power < _LARGE:
        return f"{value:.6g}"
    times = value / 10.0**power
    return f"{'' if abs(times - 1.0) < 1e-6 else f'{times:.3g}×'}10{str(power).translate(_RAISED)}"
