"""Sentences that a log holds twice, and instruments that speak under one name: neither is one instrument twice as fast.

A logger that listens on two ports writes each sentence twice, one whose buffer hangs writes some lines again.  Two
gyros, or two receivers, of one talker take turns in the log: their readings differ from those beside them by the same
each time, now up and now down, and are a smooth line where every other one is left out.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from .. import Array
from .clocks import PIECES, Spoken
from .sources import CIRCLES, Series

_WHOLE, _COPIES = 0.05, 1.5
"""How far from a whole number the copies of a fix may be, as a part of it, and how many make a log of copies."""
_SOME, _AS_MANY = 0.02, 3.0
"""Fixes that stand twice in a row make a log of copies from this share on; a source has at most so many times it."""
_TURNS, _APART, _MANY = 0.9, 3.0, 20
"""Share of the readings that differ the other way than the one before; how many times the noise; and of how many."""
_LEAST = MappingProxyType({
    "psi": math.radians(0.25), "psi_magnetic": math.radians(0.25), "delta": math.radians(0.5), "latitude": 1.0,
})  # fmt: skip
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
        by, size = _parts(one) if same[one.source] == 1 else (None, "")
        if by is None:
            out.append(one)
            continue
        out += [replace(one.rows(by == k), source=f"{k + 1}/{one.source}") for k in (0, 1)]
        said.append(_doubt(one.source, size))
    return out, said


def _parts(one: Spoken) -> tuple[NDArray[np.int64] | None, str]:
    """Which of two instruments each reading is of, and how far apart these are; None where it is one."""
    name = next((name for name in _LEAST if name in one.names), None)
    if name is None:
        return None, ""
    t = np.arange(len(one), dtype=np.float64)
    if name == "latitude" and "time_of_day" in one.names:
        t = one["time_of_day"] + 86400.0 * np.cumsum(np.append(False, np.diff(one["time_of_day"]) < -43200.0))
    return _turns(name, t, one[name], one["longitude"] if name == "latitude" else None)


def apart(told: Mapping[str, Mapping[str, Series]]) -> tuple[dict[str, dict[str, Series]], list[str]]:
    """The same of readings whose times are known: what is told together stays together.

    Args:
        told: times, rising, and values by source and name.
    """
    out, said = dict[str, dict[str, Series]](), list[str]()
    for source, names in told.items():
        name = next((name for name in _LEAST if name in names), None)
        by, size = None, ""
        if name is not None:
            t, values = names[name]
            beside = names.get("longitude") if name == "latitude" else None
            if name != "latitude" or (beside is not None and np.array_equal(beside[0], t)):
                by, size = _turns(name, t, values, None if beside is None else beside[1])
        if by is None or name is None:
            out[source] = dict(names)
            continue
        t = names[name][0]
        for k in (0, 1):
            out[f"{k + 1}/{source}"] = {key: (times[by == k], values[by == k]) for key, (times, values) in names.items()
                                        if np.array_equal(times, t)}  # fmt: skip
        if rest := {key: one for key, one in names.items() if not np.array_equal(one[0], t)}:
            out[source] = rest
        said.append(_doubt(source, size))
    return out, said


def _doubt(source: str, size: str) -> str:
    return (f"doubt: two instruments speak as {source}, in turns and {size} apart: they are 1/{source} and 2/{source}; "
            "choose one by prefer in a mapping")  # fmt: skip


def _turns(name: str, t: Array, values: Array, east: Array | None) -> tuple[NDArray[np.int64] | None, str]:
    """Which of two instruments each reading of an angle, or each fix, is of, and how far apart they are."""
    if len(t) < _MANY:
        return None, ""
    plane = np.zeros(len(t), np.complex128)
    if east is None:
        plane.real = np.unwrap(values) if name in CIRCLES else values
    else:
        plane.real = _DEGREE * (values - values[0])
        plane.imag = _DEGREE * (east - east[0]) * math.cos(math.radians(float(values[0])))
    off, smooth = _off(t, plane, 1), _off(t, plane, 2)
    turns = np.real(off[1:] * np.conj(off[:-1])) < 0.0
    size = float(np.median(np.abs(off)))
    if np.mean(turns) < _TURNS or size < max(_LEAST[name], _APART * float(np.median(np.abs(smooth)))):
        return None, ""
    if east is not None:
        return _epochs(t), f"{size:.3g} m"
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
