"""Two instruments in one series: readings that leap to and fro between two lines, each of which is smooth.

Two gyros, or two receivers, that speak under one name differ by the same each time, in turns, in any order or at any
rates.  The leaps between them are alike, and each takes back the one before; what is left of each is as smooth as one
instrument's readings are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ..core.ranks import median, quantile
from . import Array

_MANY, _SOME, _OFTEN = 40, 20, 0.15
"""Readings, leaps, and leaps as a part of the readings, that show two instruments."""
_BACK, _ALIKE = 0.9, 0.5
"""Share of the leaps that take back the one before, and their spread as a part of their size."""
_SMOOTH = 5.0
"""How much larger the leaps are than what the readings of each instrument are off a line."""
_OVER = 8
"""Readings over which the motion is smooth."""
_STEPS, _SAME = 2.5, 1e-6
"""Steps of the last digit that the leaps have to pass, as one coarse instrument flickers between two; what is equal."""
DIFFER: Mapping[str, float] = MappingProxyType({
    "psi": math.radians(0.25), "psi_magnetic": math.radians(0.25), "delta": math.radians(0.5), "x": 1.0,
})  # fmt: skip
"""Least differences that are told, of angles [rad] and places [m]."""


def turns(name: str, values: Array, east: Array | None = None) -> tuple[NDArray[np.int64], float] | None:
    """Which of two instruments each reading is of, 0 for the first to speak, and how far they are apart.

    Args:
        name: a key of `DIFFER`.
        values: of an angle, unwrapped [rad], or north [m]; in the order of time, without gaps.
        east: of a place [m].

    Returns:
        None where it is one instrument, or nothing tells.
    """
    plane = np.zeros(len(values), np.complex128)
    plane.real = values
    if east is not None:
        plane.imag = east
    # a reading that is held over several rows is one: in a turn the stairs leap, and stand still between
    fresh = np.append(np.ones(min(len(plane), 1), bool), np.abs(np.diff(plane)) > _SAME)
    found = _parted(plane[fresh], max(DIFFER[name], _STEPS * _digit(values)))
    return None if found is None else (found[0][np.cumsum(fresh) - 1], found[1])


def _parted(plane: NDArray[np.complex128], least: float) -> tuple[NDArray[np.int64], float] | None:
    """As `turns`, of readings that all differ from the one before."""
    if len(plane) < _MANY:
        return None
    step = np.diff(plane)
    step -= _smooth(step)
    size = quantile(np.abs(step), 1.0 - 0.5 * _OFTEN)
    leaps = np.flatnonzero(np.abs(step) > 0.5 * size)
    if size < least or len(leaps) < max(_SOME, _OFTEN * len(step)):
        return None
    far = np.abs(step[leaps])
    apart = median(far)
    alike = float(quantile(far, 0.75) - quantile(far, 0.25)) < _ALIKE * apart
    back = np.real(step[leaps[1:]] * np.conj(step[leaps[:-1]])) < 0.0
    if not alike or float(np.mean(back)) < _BACK:
        return None
    # the side that a leap goes to, as one that was missed leaves the next ones right
    side = np.cumprod(np.append(1.0, np.where(back, -1.0, 1.0))) > 0.0
    on = np.append(~side[:1], side)[np.searchsorted(leaps, np.arange(len(plane)))]
    by = (on != on[0]).astype(np.int64)
    off = np.concatenate([_off_line(plane[by == k]) for k in (0, 1)])
    if apart < _SMOOTH * median(off):
        return None
    return by, apart


def _digit(values: Array) -> float:
    """Step of the last digit of readings."""
    known = np.unique(np.round(values / _SAME)) * _SAME
    return float(np.diff(known).min()) if len(known) > 1 else 0.0


def _smooth(step: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """The mean of steps around each, in which leaps to and fro cancel each other."""
    total = np.zeros(len(step) + 1, np.complex128)
    total[1:] = np.cumsum(step)
    first = np.maximum(np.arange(len(step)) - _OVER // 2, 0)
    last = np.minimum(first + _OVER, len(step))
    first = np.maximum(last - _OVER, 0)
    return (total[last] - total[first]) / (last - first)


def _off_line(plane: NDArray[np.complex128]) -> Array:
    """How far each reading is off the middle of those beside it."""
    return np.abs(plane[1:-1] - 0.5 * (plane[2:] + plane[:-2])) if len(plane) > 2 else np.zeros(1)
