"""What a campaign shows: distributions, probabilities, sensitivities, and the runs worth looking at, by number.

`analyse` reads the table of a folder column by column, so that ten million runs fit the memory.  Numbers are in SI
units and radians.  With design saltelli, only runs A and B of each block are counted as independent; the runs between
them share all inputs but one with A, and would make every interval too narrow.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...core.values import dataclass
from ...data import Array
from ...models import STATES
from ..chunk import WEATHER
from ..folder import Held
from ..tables import damaged, scan
from .proportion import Proportion
from .sensitivity import Sensitivity, given_data, saltelli
from .spread import Histogram, Spread, histogram, spread

__all__ = ["Analysis", "Extreme", "Figure", "Judged", "Lost", "analyse"]

_NAMED = 5
"""Runs that are named of each kind."""

# First-order shares from given data settle long before; the first runs of a random design are a random sample.
_GIVEN = 200_000


@dataclass(frozen=True)
class Extreme:
    """One run, with its index."""

    run: int
    value: float


@dataclass(frozen=True)
class Figure:
    """One index of one case.

    Attributes:
        case: number of the case.
        index: name.
        spread: distribution.
        largest, smallest: runs, the most extreme first.
        sensitivity: shares of the inputs; None where the index does not vary.
    """

    case: int
    index: str
    spread: Spread
    largest: tuple[Extreme, ...]
    smallest: tuple[Extreme, ...]
    sensitivity: Sensitivity | None


@dataclass(frozen=True)
class Judged:
    """One criterion in one case.

    Attributes:
        case: number of the case.
        name: of the criterion.
        index: that is judged.
        low, high: bounds, infinite where open.
        violated: runs beyond them, of the runs that reached the index.
        missing: runs that did not reach it.
        worst: runs farthest beyond or nearest to a bound, the worst first.
    """

    case: int
    name: str
    index: str
    low: float
    high: float
    violated: Proportion
    missing: int
    worst: tuple[Extreme, ...]


@dataclass(frozen=True)
class Lost:
    """Runs of a case that left the validity of the ship or blew up, and those too short for their indices.

    Attributes:
        case: number of the case.
        failed, incomplete: of all independent runs.
        first_failed: runs that failed earliest, with the time [s].
        first_incomplete: first numbers of runs that are incomplete and did not fail.
    """

    case: int
    failed: Proportion
    incomplete: Proportion
    first_failed: tuple[Extreme, ...]
    first_incomplete: tuple[int, ...]


@dataclass(frozen=True)
class Analysis:
    """What the runs of a folder show.

    Attributes:
        held: the folder.
        rows: runs that are there.
        figures: by index, then case.
        histograms: by index, over the cases.
        judged: by criterion, then case.
        lost: by case.
    """

    held: Held
    rows: int
    figures: tuple[Figure, ...]
    histograms: dict[str, Histogram]
    judged: tuple[Judged, ...]
    lost: tuple[Lost, ...]

    @property
    def cases(self) -> tuple[str, ...]:
        """Names of the cases."""
        return self.held.manifest.cases

    @property
    def indices(self) -> tuple[str, ...]:
        """Names of the indices, in the order of the table."""
        return index_names(self.held)


def index_names(held: Held) -> tuple[str, ...]:
    """Columns of the table that are indices."""
    other = {"run", "case", "failed", "complete", *WEATHER, *STATES, *held.manifest.inputs}
    judged = {f"{name}_met" for name in held.manifest.criteria}
    return tuple(name for name in held.manifest.columns if name not in other | judged and "." not in name)


@dataclass(frozen=True)
class _Rows:
    """The runs of one case that are there."""

    held: Held
    table: Any
    case: int

    def column(self, name: str) -> Array:
        """One column, shape (runs,)."""
        import polars as pl

        try:
            found = self.table.filter(pl.col("case") == self.case).select(name).collect()[name]
        except pl.exceptions.PolarsError as error:
            raise damaged(self.held, error) from None
        return found.to_numpy() if found.dtype == pl.Int64 else found.cast(pl.Float64).to_numpy()  # NaN for null

    def single(self, values: Array, runs: Array) -> Array:
        """Those of independent runs: all, or A and B of each block."""
        if self.held.manifest.design != "saltelli":
            return values
        block = len(self.held.manifest.inputs) + 2
        return values[np.isin(runs % self.held.manifest.runs % block, (0, block - 1))]


def analyse(held: Held) -> Analysis:
    """Read all that the runs of a folder show; parts may be missing.

    Raises:
        CampaignError: no part is there, or one is damaged.
    """
    table = scan(held)
    cases = [_Rows(held, table, number) for number in range(len(held.manifest.cases))]
    runs = [rows.column("run") for rows in cases]
    figures, judged, drawn = list[Figure](), list[Judged](), dict[str, Histogram]()
    for name in index_names(held):
        values = [rows.column(name) for rows in cases]
        alone = [rows.single(one, own) for rows, one, own in zip(cases, values, runs, strict=True)]
        common = histogram([one[np.isfinite(one)] for one in alone])
        if common is not None:
            drawn[name] = common
        for rows, own, all_, one in zip(cases, runs, values, alone, strict=True):
            figures.append(Figure(rows.case, name, spread(one), _most(own, all_), _most(own, -all_, -1.0),
                                  _sensitivity(rows, own, all_)))  # fmt: skip
            judged.extend(_judged(rows, name, own, all_, one))
    lost = tuple(_lost(rows, own) for rows, own in zip(cases, runs, strict=True))
    return Analysis(held, sum(map(len, runs)), tuple(figures), drawn, tuple(judged), lost)


def _judged(rows: _Rows, index: str, runs: Array, values: Array, alone: Array) -> Iterator[Judged]:
    """The verdicts on an index, where criteria bound it."""
    for name, bound in rows.held.manifest.criteria.items():
        if bound.index != index:
            continue
        low, high = bound.low, bound.high
        there = alone[np.isfinite(alone)]
        counted = Proportion(int(np.count_nonzero(margin(there, low, high) < 0)), len(there))
        worst = tuple(Extreme(one.run, float(values[np.searchsorted(runs, one.run)]))
                      for one in _most(runs, -margin(values, low, high)))  # fmt: skip
        yield Judged(rows.case, name, index, low, high, counted, len(alone) - len(there), worst)


def margin(values: Array, low: float, high: float) -> Array:
    """How far an index is from violating its criterion; below zero where it does."""
    return np.minimum(values - low, high - values)


def _most(runs: Array, values: Array, sign: float = 1.0) -> tuple[Extreme, ...]:
    """The runs of the largest values, times `sign`; of equal ones the first."""
    there = np.flatnonzero(np.isfinite(values))
    if len(there) > _NAMED:
        edge = np.partition(values[there], -_NAMED)[-_NAMED]
        there = there[values[there] >= edge]
    order = np.lexsort((runs[there], -values[there]))[:_NAMED]
    return tuple(Extreme(int(runs[k]), sign * float(values[k])) for k in there[order])


def _sensitivity(rows: _Rows, runs: Array, values: Array) -> Sensitivity | None:
    names, about = rows.held.manifest.inputs, rows.held.manifest
    if not names:
        return None
    if about.design != "saltelli":
        # a grid is no sample of its first runs
        last = len(values) if about.design == "grid" else min(len(values), _GIVEN)
        return given_data({name: rows.column(name)[:last] for name in names}, values[:last])
    block = len(names) + 2
    place = runs % about.runs
    blocks, counts = np.unique(place // block, return_counts=True)
    whole = np.isin(place // block, blocks[counts == block])  # parts may be missing, and cut a block
    return saltelli(names, values[whole])


def _lost(rows: _Rows, runs: Array) -> Lost:
    failed, complete = rows.column("failed"), rows.column("complete")
    over, short = np.isfinite(failed), complete == 0.0
    failed_, short_ = (Proportion(int(np.count_nonzero(one)), len(one))
                       for one in (rows.single(over, runs), rows.single(short, runs)))  # fmt: skip
    first = runs[short & ~over][:_NAMED]
    return Lost(rows.case, failed_, short_, _most(runs, -failed, -1.0), tuple(int(run) for run in first))
