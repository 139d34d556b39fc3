"""One fit of a study, in a folder of its own: a cell.  Which cells are done, and what the lint says of the others.

A study is a table of one cell, whose folder is that of the run; a table of fits has a cell for each model and seed.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from ..core.values import dataclass, field, replace
from ..data import Trial
from ..identify import Estimator, Issue, Problem, StudyError
from ..identify.lint import lint, raise_on_errors
from ..identify.resume import digest
from .store import SUMMARY, claim

FITS, PAGE, NUMBERS = "fits", "report.html", "report.json"


@dataclass(frozen=True)
class Cell:
    """One fit with one seed.

    Attributes:
        seed: None where the estimator draws nothing.
        problem: what is fitted to what.
        estimator: with this seed alone.
        study: what `fit.json` calls its study.
        key: of its model in a table of fits; empty of a study, which has one cell.
        restart: seconds between restarts where its predictions are drawn.
        test: trials kept apart from training and validation, whose digests `fit.json` keeps.
        text, file: the study as written, and where it was read from, kept in `fit.json`.
        unidentified: why parameters cannot be identified whatever sigma is, by path.
        run: fingerprint of a run that this cell is all of, its report too; empty takes that of the fit.
        scale: of each state where the fit is judged, kept in `fit.json`; None where it is not kept.
        spread: scale of each state for the members of a hybrid; None makes none.
    """

    seed: int | None
    problem: Problem
    estimator: Estimator
    study: str = ""
    key: str = ""
    restart: float | None = None
    test: tuple[Trial, ...] = ()
    text: str = ""
    file: str = ""
    unidentified: Mapping[str, str] = field(default_factory=dict[str, str])
    run: str = ""
    scale: Mapping[str, float] | None = None
    spread: Mapping[str, float] | None = None

    @property
    def name(self) -> str:
        """Of the fit, for progress: that of the study, or model and seed."""
        return f"{self.key}, {self._draw}" if self.key else self.study

    @property
    def folder(self) -> Path:
        """Its folder, below that of the run."""
        return Path(FITS, self.key, self._draw) if self.key else Path()

    @property
    def _draw(self) -> str:
        return "one" if self.seed is None else f"seed-{self.seed}"

    @property
    def digest(self) -> str:
        """Fingerprint of everything that determines what it leaves."""
        return self.run or digest(self.problem, self.estimator)

    @property
    def several(self) -> bool:
        """Whether its estimator makes several fits and reports each by itself."""
        return getattr(self.estimator, "several", False)

    @property
    def posed(self) -> Cell:
        """As its estimator takes it: to one of several fits all trials kept back are tests, which decide nothing."""
        if not self.several:
            return self
        return replace(self, problem=replace(self.problem, validation=(*self.problem.validation, *self.test)), test=())

    def done(self, out: Path) -> bool:
        """Whether the run in `out` has this fit; of a study its report too, which holds what no other file does.

        Raises:
            StudyError: the folder holds the fit of another problem.
        """
        where = out / self.folder
        leaves = (SUMMARY,) if self.key else (SUMMARY, PAGE, NUMBERS)
        return all((where / name).exists() for name in leaves) and not claim(where, self.digest, self.study)


def check(cells: Sequence[Cell], apart: Sequence[Trial]) -> tuple[Issue, ...]:
    """Warnings of the lint on the problem of each cell; of cells alike, once.

    Args:
        apart: trials that no fit sees.

    Raises:
        StudyError: a problem that cannot be run.
    """
    found: list[Issue] = []
    seen: set[object] = set()
    for cell in cells:
        problem = cell.problem
        trials = (tuple(t.name for t in some) for some in (problem.trials, problem.validation))
        mark = problem.ship.name, problem.free, getattr(cell.estimator, "starts_remedy", None), *trials
        if mark in seen:
            continue
        seen.add(mark)
        issues = lint(problem, apart, cell.estimator)
        raise_on_errors(issues)
        found += issues
    return tuple(found)


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
