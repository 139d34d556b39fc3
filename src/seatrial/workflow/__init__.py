"""Workflows: what the commands do, as functions that return values and print nothing.

Contract: what the user should read while a workflow runs goes to its argument `note`, one line at a time, or, where
there are fits to watch, to a `Sink`; these return an `Outcome`.  A request that cannot be carried out is a
`RequestError`, raised before anything is written.

`identify` from command to report: `cli.fits`, `identify` (the order of things), `study.study` and `study.series` (what
is asked for, as `study.cells`), `identify.lint`, the estimator, `study.store`, `reports` (page, and the summary for a
terminal), `comparing`, and `report.report`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from ..core.errors import RequestError as RequestError
from ..core.values import dataclass

if TYPE_CHECKING:  # the command line imports this room before it knows what is asked for
    from ..identify import Problem, Progress
    from ..report.blocks import Body

__all__ = ["SILENT", "Document", "Outcome", "RequestError", "Silent", "Sink", "figure"]

Result = TypeVar("Result")

Document = Mapping[str, object]
"""What ``--json`` prints: texts, numbers, lists and mappings; a number that is not finite means null."""


@dataclass(frozen=True)
class Outcome(Generic[Result]):
    """What a workflow leaves.

    Attributes:
        result: the value for Python.
        shown: the same as blocks that each face draws, JSON among them.
        errors: what failed while the rest was done, one line each; a command exits with 1 where there are any.
        leads: what speaks against the result, one line each, the first lines of `shown`: that the model does not
            explain the data, or that it predicts worse than before the fit.
    """

    result: Result
    shown: Body
    errors: tuple[str, ...] = ()
    leads: tuple[str, ...] = ()

    @property
    def document(self) -> Document:
        """What JSON has of it."""
        from ..report.blocks import document

        return document(self.shown)


class Sink(Protocol):
    """Receives notes, and the progress of fits; a class that names it as its base ignores what it does not define."""

    def note(self, line: str) -> None:
        """One line for the user."""

    def fitting(
        self, title: str, files: Mapping[str, Path], before: Sequence[str]
    ) -> AbstractContextManager[object]:  # fmt: skip
        """Fits run inside of this context.

        Args:
            title: of the study.
            files: the file that each fit leaves when it is done, by the name of the fit.
            before: names of the fits that an earlier run has done.
        """
        return nullcontext()

    def fit(self, name: str, problem: Problem, restart: float | None, *, several: bool) -> Progress | None:
        """A fit begins; returns what its estimator reports to.

        Args:
            name: of the fit.
            problem: what is fitted.
            restart: seconds between restarts where its predictions are drawn.
            several: its estimator makes several fits and reports each by itself (`identify.watch.part`).
        """
        return None

    def reporting(self, text: str) -> None:
        """The fits have ended, `text` says how; the report is being written."""


class Silent(Sink):
    """A `Sink` that drops everything."""


SILENT: Sink = Silent()
"""Takes what a step says and shows none of it."""


def figure(value: object, digits: int = 4) -> str:
    """A number as a table of a terminal shows it; a dash where there is none."""
    if not isinstance(value, int | float) or value != value or value in (float("inf"), float("-inf")):
        return "–"
    return f"{value:.{digits}g}"
