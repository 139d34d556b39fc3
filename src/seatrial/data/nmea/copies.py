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

import numpy as np
from numpy.typing import NDArray

from ...core.constants import ARC_DEGREE
from .. import Array
from ..turns import turns
from .clocks import PIECES, Spoken
from .sources import CIRCLES, Series

_WHOLE, _COPIES = 0.05, 1.5
"""How far from a whole number the copies of a fix may be, as a part of it, and how many make a log of copies."""
_AS_MANY = 3.0
"""A source has at most so many times the share of copies that fixes have which stand twice in a row."""
_SHOWN = ("psi", "psi_magnetic", "delta", "latitude")
"""Readings by which instruments are told apart."""


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
    if not share:
        return list(found), ""
    out = [one.rows(~_twice(one)) if np.mean(_twice(one)) <= _AS_MANY * share else one for one in found]
    lost = sum(map(len, found)) - sum(map(len, out))
    return out, f"some lines are logged twice in a row: {lost} copies left out"


def shared(found: Sequence[Spoken]) -> tuple[list[Spoken], list[str]]:
    """Sources apart that take turns under one name, as ``1/HEHDT`` and ``2/HEHDT``, and the doubts that this is."""
    out, said = list[Spoken](), list[str]()
    same = Counter(one.source for one in found)
    for one in found:
        parts = _parts(one) if same[one.source] == 1 else None
        if parts is None:
            out.append(one)
            continue
        by, size = parts
        out += [replace(one.rows(by == k), source=f"{k + 1}/{one.source}") for k in (0, 1)]
        said.append(_doubt(one.source, size))
    return out, said


def _parts(one: Spoken) -> tuple[NDArray[np.int64], str] | None:
    """Which of two instruments each reading is of, and how far apart these are; None where it is one."""
    name = next((name for name in _SHOWN if name in one.names), None)
    return None if name is None else _turns(name, one[name], one["longitude"] if name == "latitude" else None)


def apart(told: Mapping[str, Mapping[str, Series]]) -> tuple[dict[str, dict[str, Series]], list[str]]:
    """The same of readings whose times are known: what is told together stays together.

    Args:
        told: times, rising, and values by source and name.
    """
    out, said = dict[str, dict[str, Series]](), list[str]()
    for source, names in told.items():
        name = next((name for name in _SHOWN if name in names), "")
        t, values = names.get(name, (np.zeros(0), np.zeros(0)))
        east = names.get("longitude") if name == "latitude" else None
        whole = name and (name != "latitude" or (east is not None and np.array_equal(east[0], t)))
        parts = _turns(name, values, None if east is None else east[1]) if whole else None
        if parts is None:
            out[source] = dict(names)
            continue
        by, size = parts
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


def _turns(name: str, values: Array, east: Array | None) -> tuple[NDArray[np.int64], str] | None:
    """Which of two instruments each angle, or each fix in degrees, is of, and how far apart they are in words."""
    if east is None:
        found = turns(name, np.unwrap(values) if name in CIRCLES else values)
        return None if found is None else (found[0], f"{math.degrees(found[1]):.3g} deg")
    found = turns("x", ARC_DEGREE * (values - values[0]),
                  ARC_DEGREE * (east - east[0]) * math.cos(math.radians(float(values[0]))))  # fmt: skip
    return None if found is None else (found[0], f"{found[1]:.3g} m")
