"""The cells of a series on disk, each in a folder of its own: which are done, and the fits that they hold."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.parameters import unknown
from ..data import Array
from ..identify import Issue, StudyError
from ..identify.lint import lines, lint, raise_on_errors
from ..ships import Ship
from ..ships.classes import foreign
from ..ships.files import load
from .series import Cell, Row, Series
from .store import HISTORY, MODEL, SUMMARY, Summary, claim, read_summary
from .stored import read_history

FITS = "fits"


@dataclass(frozen=True)
class Member:
    """A fitted ship, or one that is judged without a fit.

    Attributes:
        seed: None where nothing was drawn.
        history: rows (iteration, objective, validation or NaN, seconds), shape (iterations, 4).
        objective: the least loss on the validation trials, where the estimator watches them.
        summary: what `fit.json` holds; None for a ship as it is.
    """

    seed: int | None
    ship: Ship
    history: Array
    objective: float
    summary: Summary | None

    @property
    def seconds(self) -> float:
        """Time of the fit [s]."""
        return self.summary.seconds if self.summary else 0.0


def folder(out: Path, row: Row, cell: Cell) -> Path:
    """Folder of a cell."""
    return out / FITS / row.key / cell.name


def check(cells: Sequence[tuple[Row, Cell]], series: Series) -> list[str]:
    """Warnings of the lint on every problem, each once.

    Raises:
        StudyError: a problem that cannot be run.
    """
    found: list[Issue] = []
    seen: set[object] = set()
    for _, cell in cells:
        problem = cell.problem
        trials = (tuple(t.name for t in some) for some in (problem.trials, problem.validation))
        mark = problem.ship.name, problem.free, getattr(cell.estimator, "starts_remedy", None), *trials
        if mark in seen:
            continue
        seen.add(mark)
        issues = lint(problem, tuple(series.tests.values()), cell.estimator)
        raise_on_errors(issues)
        found += issues
    return list(lines(found))


def asked(series: Series, only: Sequence[str] = ()) -> list[tuple[Row, Cell]]:
    """The cells of a table, in the order of the file.

    Args:
        only: keys of the models that count; none counts all.

    Raises:
        StudyError: no such model.
    """
    for name in only:
        if name not in (row.key for row in series.rows):
            raise StudyError(f"{series.path}: {unknown(name, [row.key for row in series.rows], 'fit')}")
    return [(row, cell) for row in series.rows if not only or row.key in only for cell in row.cells]


def left(series: Series, out: Path, only: Sequence[str] = ()) -> list[tuple[Row, Cell]]:
    """Those of the cells that are still to be fitted; see `asked`."""
    return [(row, cell) for row, cell in asked(series, only) if not _done(series, out, row, cell)]


def _done(series: Series, out: Path, row: Row, cell: Cell) -> bool:
    """Whether the fit of this very cell is in its folder.

    Raises:
        StudyError: the folder holds the fit of another problem.
    """
    where = folder(out, row, cell)
    if not (where / SUMMARY).exists():
        return False
    claimed(where, cell.digest, f"{series.name}: {row.key}")
    return True


def claimed(where: Path, digest: str, study: str) -> bool:
    """Whether the folder of a cell was free until now."""
    try:
        return claim(where, digest, study)
    except StudyError as error:
        raise StudyError(f"{error}, or remove this one, and it is fitted anew") from None


@contextmanager
def swept(where: Path, out: Path) -> Generator[None, None, None]:
    """Remove the folders above a cell again where they were made for it and it was refused."""
    above = [path for path in (where.parent, out / FITS, out) if not path.exists()]
    try:
        yield
    except StudyError:
        with suppress(OSError):  # something is in it
            for path in above:
                path.rmdir()
        raise


def members(series: Series, row: Row, out: Path) -> tuple[Member, ...]:
    """The fits of a row that are done, in the order of its seeds.

    Raises:
        StudyError: a folder holds the fit of another problem, or one that cannot be read.
    """
    if not row.cells:
        return (Member(None, row.ship, np.zeros((0, 4)), math.nan, None),)
    found: list[Member] = []
    for cell in row.cells:
        where = folder(out, row, cell)
        if _done(series, out, row, cell):
            said = read_summary(where)
            found.append(Member(
                cell.seed, load(where / MODEL, trust=foreign(row.ship.model)), read_history(where / HISTORY),
                said.objective, said,
            ))  # fmt: skip
    return tuple(found)
