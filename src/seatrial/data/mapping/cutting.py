"""One log divided into trials: by a column, by leaps of time, or by a list of times."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import DataError, Trial
from ..prepare import cut, unbroken
from ..table import within
from .cells import texts
from .clocks import Stamps, moment
from .schema import Cut, Mapping, Split
from .tables import Table


def groups(table: Table, mapping: Mapping) -> Iterator[tuple[str, NDArray[np.intp] | None]]:
    """Rows of each trial by the column that divides a log, and what its name ends in; else all, as None.

    Rows where the column is empty belong to no trial.

    Raises:
        DataError: a value that comes back after another one, naming file, column and row.
    """
    column = mapping.split.column
    if column is None:
        yield "", None
        return
    cells = texts(table, column).fill_null("")
    code = cells.rank("dense").to_numpy().astype(np.int64)
    edges = [0, *(np.flatnonzero(np.diff(code)) + 1).tolist(), len(code)]
    seen: set[str] = set()
    for start, stop in pairwise(edges):
        word = "" if start == len(cells) else str(cells[start])
        if not word:
            continue
        if word in seen:
            raise DataError(f"{table.at(column, start)}: '{word:.40}' again, after others; one stretch is one trial")
        seen.add(word)
        yield f"_{re.sub(r'[^A-Za-z0-9.-]+', '_', re.sub(r'[.]0$', '', word))}", np.arange(start, stop)


def divided(trial: Trial, split: Split) -> tuple[Trial, ...]:
    """The trial, or its parts between leaps of time."""
    return (trial,) if split.gap is None else unbroken(trial, split.gap)


def named_cuts(trial: Trial, mapping: Mapping, source: Path, log: str, clock: tuple[Stamps, int]) -> Iterator[Trial]:
    """The trials that a mapping cuts out of a log; time keeps its origin.

    Raises:
        DataError: a time that the log does not have.
    """
    for k, one in enumerate(mapping.trial):
        if one.log in (None, log):
            with within(f"{source}: trial[{k}]"):
                start, stop = (_at(one, key, clock) for key in ("start", "stop"))
                if start >= stop:
                    raise DataError(f"'{one.name}' is from {start:g} to {stop:g} s; 'to' must be later")
                yield _described(replace(cut(trial, start, stop), name=one.name), one)


def _at(one: Cut, key: str, clock: tuple[Stamps, int]) -> float:
    said = getattr(one, key)
    return said if isinstance(said, float) else moment(said, *clock)


def _described(trial: Trial, one: Cut) -> Trial:
    said: dict[str, Any] = {"kind": one.kind, "set_points": dict(one.set_points) or None}
    return replace(trial, meta={**trial.meta, **{key: value for key, value in said.items() if value is not None}})
