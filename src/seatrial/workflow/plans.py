"""What `identify` is asked for: a study as one job, or a table of fits as a job for each cell."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from ..belief.drawn import read_draws
from ..core.executors import Pool
from ..core.files import plain
from ..core.version import __version__
from ..data import Trial
from ..identify import Estimator, Fit, Issue, Problem, StudyError
from ..identify.resume import digest
from ..study.series import FULL, QUICK, Series, is_series, read_series
from ..study.series_run import Cell, Row, asked, check, claimed, folder, left
from ..study.store import SCHEMA, SUMMARY, claim, read_summary
from ..study.study import Study, read_study
from . import Document, RequestError, Sink
from .comparing import scales
from .reports import details, judged_on, report, sources

PAGE = "report.html"


@dataclass(frozen=True)
class Job:
    """One fit of a plan, in a folder of its own.

    Attributes:
        name: of the fit, for progress.
        study: what `fit.json` calls its study.
        where: its folder.
        restart: seconds between restarts where its predictions are drawn.
        text: the study as written, kept in `fit.json`.
        scale: of each state where the fit is judged, kept in `fit.json`; None where it is not kept.
        spread: scale of each state for the members of a hybrid; None makes none.
        unidentified: why parameters cannot be identified whatever sigma is, by path.
        test: trials kept apart from training and validation.
        file: the study file.
    """

    name: str
    study: str
    problem: Problem
    estimator: Estimator
    where: Path
    restart: float | None
    text: str = ""
    scale: Mapping[str, float] | None = None
    spread: Mapping[str, float] | None = None
    unidentified: Mapping[str, str] = field(default_factory=dict[str, str])
    test: tuple[Trial, ...] = ()
    file: str = ""

    @property
    def several(self) -> bool:
        """Whether its estimator makes several fits and reports each by itself."""
        return getattr(self.estimator, "several", False)


def read_plan(
    path: Path, out: Path, quick: bool = False, only: Sequence[str] = (), suspects: bool = False
) -> Plan:  # fmt: skip
    """Read a study or a table of fits.

    Args:
        out: folder of the run.
        quick, only: of a table: its rehearsal, and the models to fit.
        suspects: free the errors of instruments that the residuals call for.

    Raises:
        RequestError, StudyError, ShipError, DataError, ParameterError: what is wrong, with file, key and remedy.
    """
    if is_series(path):
        series = read_series(path, QUICK if quick else FULL, suspects=suspects, only=only)
        return TablePlan(series, out, tuple(only), suspects)
    if quick or only:
        raise RequestError(f"{path}: is one study; --quick and --only are for a table of fits ('seatrial-series/1')")
    study = read_study(path, suspects=suspects)
    if study.rival and study.virtual and not study.test:
        raise StudyError(f"{path}: [rival] is judged on trials kept back, of a truth that is known; name some in "
                         "data.test, of [virtual]")  # fmt: skip
    return StudyPlan(study, out, suspects)


@dataclass(frozen=True)
class StudyPlan:
    """One study: one job, in the folder of the run itself.

    Attributes:
        suspects: whether --free-suspects was given.
        partial: the report shows the jobs that are done where others fail; if not, one that fails ends the run.
    """

    study: Study
    out: Path
    suspects: bool = False
    partial: bool = False

    @property
    def path(self) -> Path:
        """The study file."""
        return self.study.path

    @property
    def title(self) -> str:
        """Of the study; where it has none, ship and file."""
        return self.study.title or f"{self.study.problem.ship.name}: {self.study.name}"

    @property
    def kept_back(self) -> bool:
        """Whether the report judges the fit on trials that it has not seen."""
        return bool(self.study.problem.validation or self.study.test)

    def jobs(self) -> Sequence[Job]:
        """All that were asked for: one."""
        study = self.study
        problem, text = study.problem, study.path.read_text(encoding="utf-8")
        job = Job(study.name, study.name, problem, study.estimator, self.out, study.restart, text,
                  unidentified=study.unidentified, test=study.test, file=str(study.path))  # fmt: skip
        if job.several:  # all trials kept back are tests, which decide nothing
            return (replace(job, problem=replace(problem, validation=(*problem.validation, *study.test)), test=()),)
        if study.rival and study.virtual:
            return (job,)
        return (replace(job, scale=scales(judged_on(study), study.sigma), spread=scales(problem.trials, study.sigma)),)

    def left(self) -> Sequence[Job]:
        """Those that are still to be fitted: the one, unless its report is written.

        Raises:
            StudyError: the folder holds the fit of another problem.
        """
        (job,) = self.jobs()
        done = (self.out / SUMMARY).exists() and (self.out / PAGE).exists()
        return () if done and not self.claim(job) else (job,)

    def lint(self) -> Sequence[str]:
        """Notes of the study and warnings of the lint on what is left.

        Raises:
            StudyError: a problem that cannot be fitted.
        """
        from ..identify.lint import lines, lint, raise_on_errors

        study = self.study
        issues: Sequence[Issue] = lint(study.problem, study.test, study.estimator)
        raise_on_errors(issues)
        return (*study.notes, *lines(issues))

    def claim(self, job: Job) -> bool:
        """Mark the folder of a job as its own; returns whether it was free.

        Raises:
            StudyError: the folder holds the fit of another problem.
        """
        return claim(job.where, self.study.digest, self.study.name)

    def report(
        self, fits: Mapping[str, Fit], failed: Sequence[str], sink: Sink, pool: Pool | None = None
    ) -> None:
        """Write the page and its numbers that the estimator and the study ask for.

        Args:
            fits: made in this run, by the name of the job.
            failed: a line for each job that failed.
            pool: who computes what else it needs; None does it here.
        """
        fit = fits[self.study.name]
        provenance = {
            "study": str(self.path), "digest": self.study.digest, "version": f"seatrial {__version__}",
            "command": f"seatrial identify {self.path}{' --free-suspects' * self.suspects} -o {self.out}",
        }  # fmt: skip
        report(details(self.study, fit, sink, pool), self.study, fit, self.out / PAGE, provenance, sink)

    def document(self) -> Document:
        """What a finished run has found: the numbers of its report; of a plain fit, `fit.json` with its errors."""
        numbers, fit = _numbers(self.out), read_summary(self.out)
        if numbers["schema"] != "seatrial-report/1":
            return {"diagnosis": fit.diagnosis, **numbers}
        judged = {key: numbers[key] for key in ("standardised", "forecasts", "worse_than_untuned") if key in numbers}
        drawn = read_draws(self.out)
        return {"schema": SCHEMA, **plain(fit), **({} if drawn is None else {"posterior": drawn.said}), **judged}


@dataclass(frozen=True)
class TablePlan:
    """A table of fits: a job for each model and seed, each in a folder of its own; methods as of `StudyPlan`."""

    series: Series
    out: Path
    only: tuple[str, ...] = ()
    suspects: bool = False
    partial: bool = True
    kept_back: bool = True

    @property
    def path(self) -> Path:
        """The file of the table."""
        return self.series.path

    @property
    def title(self) -> str:
        """Of the table."""
        return self.series.title or self.series.name

    def jobs(self) -> Sequence[Job]:
        """The cells, in the order of the file."""
        return [self._job(row, cell) for row, cell in asked(self.series, self.only)]

    def left(self) -> Sequence[Job]:
        """Those that leave no fit yet."""
        return [self._job(row, cell) for row, cell in left(self.series, self.out, self.only)]

    def lint(self) -> Sequence[str]:
        """Warnings of the lint on each problem, once."""
        return check(left(self.series, self.out, self.only), self.series)

    def claim(self, job: Job) -> bool:
        """Mark the folder of a cell."""
        return claimed(job.where, digest(job.problem, job.estimator), job.study)

    def report(
        self, fits: Mapping[str, Fit], failed: Sequence[str], sink: Sink, pool: Pool | None = None
    ) -> None:
        """The table, of all fits that are done."""
        from ..report.page import write
        from ..report.series import covered, page
        from ..validate.series import judged

        quick = " --quick" if self.series.budget == QUICK else ""
        options = quick + "".join(f" --only {name}" for name in self.only) + " --free-suspects" * self.suspects
        write(self.out / PAGE, page(
            self.series, judged(self.series, self.out), covered(self.series), failed=failed, provenance={
                "study": str(self.path), "version": f"seatrial {__version__}",
                "data": sources(self.series.tests.values()),
                "command": f"seatrial identify {self.path}{options} -o {self.out}",
            },
        ))  # fmt: skip

    def document(self) -> Document:
        """The numbers of the report, and the fits whose model does not explain the data."""
        done = [job for job in self.jobs() if (job.where / SUMMARY).exists()]
        lacking = [job.name for job in done if not read_summary(job.where).explained]
        return {**_numbers(self.out), "not_explained": lacking}

    def _job(self, row: Row, cell: Cell) -> Job:
        from ..validate.series import sigma

        scale, where = sigma(self.series), folder(self.out, row, cell)
        return Job(f"{row.key}, {cell.name}", f"{self.series.name}: {row.key}", cell.problem, cell.estimator, where,
                   self.series.restart, scale=scale, spread=scale)  # fmt: skip


Plan = StudyPlan | TablePlan
"""A study file, read: its jobs and its report."""


def _numbers(out: Path) -> Mapping[str, object]:
    return json.loads((out / PAGE).with_suffix(".json").read_text(encoding="utf-8"))
