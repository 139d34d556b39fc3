"""Pages of the command line: the port they are served at, and the page that shows a running fit."""

from __future__ import annotations

import socket
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from ..identify import Fit, Problem, Progress
from ..study.study import Study
from ..workflow.realtime import HERE, address, listen
from .support import UsageError, note, obeyed

if TYPE_CHECKING:
    from ..realtime.fit_page.board import Board
    from ..realtime.fit_page.server import Page

PORT = 8021
"""Where the page of a fit is served; the bridge has the port before."""

Told = Callable[[str, int, float], None]


def port_of(page: bool, port: int | None) -> int | None:
    """The port of the page that was asked for; None where none was.

    Raises:
        UsageError: a port without a page.
    """
    if port is not None and not page:
        raise UsageError(f"--port {port} is of the page; add --page")
    return (PORT if port is None else port) if page else None


class Watch:
    """The page of a run of `identify`; without a socket there is none, and every call leaves things as they are."""

    def __init__(self, listening: socket.socket | None = None, page: type[Page] | None = None) -> None:
        self._listening, self._kind = listening, page
        self._board: Board | None = None
        self._page: Page | None = None

    def begin(self, title: str, files: Mapping[str, Path] | None = None, before: Iterable[str] = ()) -> None:
        """Serve the page; `files` are what the fits to come leave, where there are several, `before` what is done."""
        if self._listening is None or self._kind is None:
            return
        from ..realtime.fit_page.board import Board

        self._board = Board(title, files, before=before)
        self._page = self._kind(self._board, self._listening)
        self._page.start()
        note(f"page: {self._address}")

    def alone(self, study: Study, progress: Progress | None) -> Progress | None:
        """The page and the one fit of a study; whom the estimator tells, `progress` among them."""
        self.begin(study.title or f"{study.problem.ship.name}: {study.name}")
        return self.fit(study.name, study.problem, study.restart, progress)

    def fit(
        self, name: str, problem: Problem, restart: float | None, progress: Progress | None
    ) -> Progress | None:  # fmt: skip
        """A fit begins; whom its estimator tells, `progress` among them."""
        if self._board is None:
            return progress
        part = self._board.begin(name, problem, restart)
        part.beside = progress
        return part

    def sweep(self, restart: float | None, told: Told) -> Told:
        """Many fits side by side, each begun by whoever makes them."""
        if self._board is None:
            return told
        from ..realtime.fit_page.board import Parts

        return Parts(self._board, restart, told, lambda name: lambda row, cost, _: told(name, row, cost))

    def table(
        self, title: str, files: Mapping[str, Path], restart: float | None, progress: Progress,
        before: Iterable[str] = (),
    ) -> Progress:  # fmt: skip
        """The page and the fits of a table, one after the other.

        Args:
            title: of the table.
            files: what the fits to come leave when they are done, by their names.
            restart: of the tracks that are drawn [s].
            progress: told of every row.
            before: names of the fits that an earlier run has done.
        """
        self.begin(title, files, before)
        if self._board is None:
            return progress
        from ..realtime.fit_page.board import Parts

        return Parts(self._board, restart, progress, lambda _: progress)

    def found(self, fit: Fit) -> None:
        """The one fit has ended; what comes is the report."""
        if self._board is not None and self._board.part is not None:
            self._board.part.at(lambda: fit.ship)
            self.reporting(fit.status)

    def reporting(self, text: str = "") -> None:
        """The fits have ended; what comes is the report."""
        if self._board is not None:
            self._board.end("writing the report", text)

    def stay(self) -> None:
        """Everything is written.  At a terminal the page stays until Ctrl-C, elsewhere it ends."""
        if self._board is None:
            return
        self._board.end("done", self._board.text)
        if sys.stderr.isatty():
            note(f"page: {self._address} stays until Ctrl-C")
            try:
                threading.Event().wait()
            except KeyboardInterrupt:
                obeyed()
                note("page ended")

    def close(self, state: str = "", text: str = "") -> None:
        """End the page, in another state than `stay` has left."""
        if self._board is not None and state:
            self._board.end(state, text)
        if self._page is not None:
            self._page.close()

    @property
    def _address(self) -> str:
        return address(self._listening) if self._listening else ""


@contextmanager
def watching(port: int | None) -> Generator[Watch, None, None]:
    """A page at this port for as long as a command runs; none without a port.

    Raises:
        UsageError: the port is taken, or the extra is not there.
    """
    if port is None:
        yield Watch()
        return
    with listen(HERE, port, False) as listening:
        try:
            from ..realtime.fit_page.server import Page
        except ImportError as error:
            raise UsageError(f"--page needs {error.name}; pip install 'seatrial[web]'") from None
        watch = Watch(listening, Page)
        try:
            yield watch
        except KeyboardInterrupt:
            watch.close("stopped", "stopped; the same command again goes on from here")
            raise
        except Exception as error:
            watch.close("failed", str(error))
            raise
        watch.close()
