"""Sentences that a log holds twice, and instruments that speak under one name: neither is one instrument twice as fast.

A logger that listens on two ports writes each sentence twice, one whose buffer hangs writes some lines again.  Two
gyros, or two receivers, of one talker take turns in the log: their readings differ from those beside them by the same
each time, now up and now down, and are a smooth line where every other one is left out.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .. import Array
from .clocks import PIECES, Spoken
from .sources import CIRCLES

_WHOLE, _COPIES = 0.05, 1.5
"""How far from a whole number the copies of a fix may be, as a part of it, and how many make a log of copies."""
_SOME, _AS_MANY = 0.02, 3.0
"""Fixes that stand twice in a row make a log of copies from this share on; a source has at most so many times it."""
_TURNS, _APART, _MANY = 0.9, 3.0, 20
"""Share of the readings that differ the other way than the one before; how many times the noise; and of how many."""
_LEAST = {"psi": math.radians(0.25), "psi_magnetic": math.radians(0.25), "delta": math.radians(0.5), "latitude": 1.0}
"""Differences of two instruments that are told: of angles [rad], of places [m]."""
_DEGREE = 60.0 * 1852.0
"""Metres of a degree of latitude."""
_PHASE = 0.05
"""Part of the interval of its fixes by which the epochs of two receivers differ at least."""


def once(found: Sequence[Spoken]) -> tuple[list[Spoken], str]:
    """The log without copies of its lines, and what is said of them; as it is where it has none.

    A fix that is told again with its time, digit by digit, is a copy; where all clocks of a log are told so many times,
    so are the sentences without one.  Where some fixes are, directly after themselves, so is any such line.
    """
    clocks = [one for one in found if "time_of_day" in one.names]
    copies = [len(one) / int(np.count_nonzero(~_again(one))) for one in clocks if len(one) > 1]
    many = round(float(np.median(copies))) if copies else 1
    if min(copies, default=1.0) < _COPIES or any(abs(one - many) > _WHOLE * many for one in copies):
        return _some(found, clocks)
    out = list[Spoken]()
    for one in found:
        again = _again(one)
        begun = np.flatnonzero(~again)
        kept = one.rows((np.arange(len(one)) - begun[np.cumsum(~again) - 1]) % many == 0)
        out.append(kept if abs(many * len(kept) - len(one)) <= _WHOLE * many * len(kept) + many else one)
    lost = sum(map(len, found)) - sum(map(len, out))
    return out, f"each sentence is logged {many} times: {lost} copies left out"


def _again(one: Spoken) -> NDArray[np.bool_]:
    """Readings that are those of the line before of the same source, all digits."""
    return np.append(False, (one.values[:, 1:] == one.values[:, :-1]).all(axis=0))


def _twice(one: Spoken) -> NDArray[np.bool_]:
    """Readings that repeat the line right before them."""
    return _again(one) & np.append(False, np.diff(one.place // PIECES) <= 1)


def _some(found: Sequence[Spoken], clocks: Sequence[Spoken]) -> tuple[list[Spoken], str]:
    """The log without lines that repeat the one right before them, where its fixes show that it has such copies."""
    fixes = sum(map(len, clocks))
    share = sum(int(np.count_nonzero(_twice(one))) for one in clocks) / max(fixes, 1)
    if share < _SOME:
        return list(found), ""
    out = [one.rows(~_twice(one)) if np.mean(_twice(one)) <= _AS_MANY * share else one for one in found]
    lost = sum(map(len, found)) - sum(map(len, out))
    return out, f"some lines are logged twice in a row: {lost} copies left out"


def shared(found: Sequence[Spoken]) -> tuple[list[Spoken], list[str]]:
    """Sources apart that take turns under one name, as ``1/HEHDT`` and ``2/HEHDT``, and the doubts that this is."""
    out, said = list[Spoken](), list[str]()
    same = Counter(one.source for one in found)
    for one in found:
        by, apart = _parts(one) if same[one.source] == 1 else (None, "")
        if by is None:
            out.append(one)
            continue
        out += [replace(one.rows(by == k), source=f"{k + 1}/{one.source}") for k in (0, 1)]
        said.append(f"doubt: two instruments speak as {one.source}, in turns and {apart} apart: they are 1/{one.source}"
                    f" and 2/{one.source}; choose one by prefer in a mapping")  # fmt: skip
    return out, said


def _parts(one: Spoken) -> tuple[NDArray[np.int64] | None, str]:
    """Which of two instruments each reading is of, and how far apart these are; None where it is one."""
    name = next((name for name in _LEAST if name in one.names), None)
    if name is None or len(one) < _MANY:
        return None, ""
    if name == "latitude":
        t = one["time_of_day"] if "time_of_day" in one.names else np.arange(len(one), dtype=np.float64)
        t = t + 86400.0 * np.cumsum(np.append(False, np.diff(t) < -43200.0))
        north, east = one["latitude"], one["longitude"]
        values = np.zeros(len(one), np.complex128)
        values.real = _DEGREE * (north - north[0])
        values.imag = _DEGREE * (east - east[0]) * math.cos(math.radians(float(north[0])))
    else:
        t = np.arange(len(one), dtype=np.float64)
        values = (np.unwrap(one[name]) if name in CIRCLES else one[name]).astype(np.complex128)
    off, smooth = _off(t, values, 1), _off(t, values, 2)
    turns = np.real(off[1:] * np.conj(off[:-1])) < 0.0
    size = float(np.median(np.abs(off)))
    if np.mean(turns) < _TURNS or size < max(_LEAST[name], _APART * float(np.median(np.abs(smooth)))):
        return None, ""
    if name == "latitude":
        by = _epochs(t)
        return by, f"{size:.3g} m"
    by = np.append(np.append(-off[0].real, off.real), -off[-1].real) > 0.0
    return (by != by[0]).astype(np.int64), f"{math.degrees(size):.3g} deg"


def _off(t: Array, values: NDArray[np.complex128], step: int) -> NDArray[np.complex128]:
    """Readings less the line between those `step` before and after them."""
    before, here, after = t[: -2 * step], t[step:-step], t[2 * step :]
    span = after - before
    share = np.where(span > 0.0, (here - before) / np.where(span > 0.0, span, 1.0), 0.5)
    return values[step:-step] - values[: -2 * step] * (1.0 - share) - values[2 * step :] * share


def _epochs(t: Array) -> NDArray[np.int64] | None:
    """Which of two receivers each fix is of, by the part of the interval at which it comes; None if at the same."""
    interval = float(np.median(t[2:] - t[:-2]))
    if interval <= 0.0:
        return None
    away = np.abs((t - t[0] + 0.5 * interval) % interval - 0.5 * interval) / interval
    far = float(np.quantile(away, 0.9))
    return None if far < _PHASE else (away > 0.5 * far).astype(np.int64)
