"""Workflows: identify, validate, predict, check and demo as functions that return values and print nothing.

Contract: a workflow returns an `Outcome`; what the user should read while it runs goes to a `Sink`.

`identify` from command to report: `cli.fits`, `identify` (the order of things), `plans` (a study or a table of fits, as
`study.study` and `study.series` read them), `identify.lint`, the estimator, `study.store`, `reports` (which page),
`comparing`, `report.report`, `report.sections`, and `shown` (the summary for a terminal).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from ..identify import Problem, Progress

__all__ = ["SILENT", "Document", "Outcome", "RequestError", "Shown", "Silent", "Sink", "Table", "figure"]

Result = TypeVar("Result")

Document = Mapping[str, object]
"""What ``--json`` prints: texts, numbers, lists and mappings; a number that is not finite means null."""


class RequestError(ValueError):
    """A request that cannot be carried out; the text names what, where and what would be right."""


@dataclass(frozen=True)
class Table:
    """A table for a terminal; `right` are the indices of the columns of numbers."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    right: tuple[int, ...] = ()


Shown = Table | str
"""One block of the summary that people read: a table, or a line."""


@dataclass(frozen=True)
class Outcome(Generic[Result]):
    """What a workflow leaves.

    Attributes:
        result: the value for Python.
        document: the same for JSON.
        shown: the same for people, block by block.
        errors: what failed while the rest was done, one line each; a command exits with 1 where there are any.
    """

    result: Result
    document: Document
    shown: tuple[Shown, ...]
    errors: tuple[str, ...] = ()


class Sink(Protocol):
    """Receives notes, and the progress of fits."""

    def note(self, line: str) -> None:
        """One line for the user."""
        ...

    def fitting(
        self, title: str, files: Mapping[str, Path], before: Sequence[str]
    ) -> AbstractContextManager[object]:  # fmt: skip
        """Fits run inside of this context.

        Args:
            title: of the study.
            files: the file that each fit leaves when it is done, by the name of the fit.
            before: names of the fits that an earlier run has done.
        """
        ...

    def fit(self, name: str, problem: Problem, restart: float | None, *, several: bool) -> Progress | None:
        """A fit begins; returns what its estimator reports to.

        Args:
            name: of the fit.
            problem: what is fitted.
            restart: seconds between restarts where its predictions are drawn.
            several: its estimator makes several fits and reports each by itself (`identify.watch.part`).
        """
        ...

    def reporting(self, text: str) -> None:
        """The fits have ended, `text` says how; the report is being written."""
        ...


class Silent:
    """A `Sink` that drops everything."""

    def note(self, line: str) -> None:
        """Drops the line."""

    def fitting(
        self, title: str, files: Mapping[str, Path], before: Sequence[str]
    ) -> AbstractContextManager[object]:  # fmt: skip
        """Does nothing."""
        return nullcontext()

    def fit(self, name: str, problem: Problem, restart: float | None, *, several: bool) -> Progress | None:
        """No progress is reported."""
        return None

    def reporting(self, text: str) -> None:
        """Does nothing."""


SILENT: Sink = Silent()


def figure(value: object, digits: int = 4) -> str:
    """A number as a table of a terminal shows it; a dash where there is none."""
    if not isinstance(value, int | float) or value != value or value in (float("inf"), float("-inf")):
        return "–"
    return f"{value:.{digits}g}"
