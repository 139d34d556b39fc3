"""Commands about models and trials: check, identify, predict, validate; and the progress of their fits."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from click.exceptions import Exit

from ..workflow import Outcome, RequestError, Sink
from ..workflow.asked import Bands, Cluster, Predicting, Serving
from . import options as o
from .render import answer, at_terminal, fault, live, note

if TYPE_CHECKING:
    from socket import socket

    from ..identify import Problem, Progress
    from ..realtime.fit_page.board import Board
    from ..realtime.pages import Watched

PORT = 8021
"""Where the page of a fit is served; the bridge has the port before."""

# Off a terminal a line of progress is at most one in so many seconds, of every so many rows, or after so long.
_LEAST, _EVERY, _SILENCE = 1.0, 10, 10.0


def check(
    trials: o.Trials, against: o.Against = (), out: o.CoveragePage = None, remedy: o.Remedies = None,
    json: bool = False,
) -> None:  # fmt: skip
    """Check trials: what is wrong, where and the remedy."""
    from ..workflow.validate import check as run

    outcome = run(trials, against=against, out=out, remedy=remedy, sink=Terminal())
    show(outcome, json)
    raise Exit(1 if outcome.errors else 0)


def identify(
    study: o.StudyFile, out: o.RunFolder, quick: o.Quick = False, only: o.OnlyFits = (),
    free_suspects: o.FreeSuspects = False, cluster: Cluster = Cluster(), sample: o.Sample = None,
    details: o.Details = False, *, serving: Serving, json: bool = False,
) -> None:  # fmt: skip
    """Fit a ship to trials; write the model and a report."""
    from ..identify import FitError
    from ..workflow.identify import identify as run
    from ..workflow.identify import resumes
    from ..workflow.request import Stopped

    with watching(port_of(serving, PORT)) as sink:
        try:
            outcome = run(study, out, quick=quick, only=only, free_suspects=free_suspects, dask=cluster.dask,
                          sample=sample, details=details, sink=sink)  # fmt: skip
        except KeyboardInterrupt:
            again = f" to go on in {out}" if resumes(out) else ""
            raise Stopped(f"interrupted; run the same command again{again}") from None
        show(outcome, json)
        sink.stay()
        if outcome.errors:
            raise FitError(outcome.errors[0])


def predict(
    model: o.ShipName, trials: o.Trials, out: o.PredictionFolder, *, how: Predicting, bands: Bands,
    json: bool = False,
) -> None:  # fmt: skip
    """Predict trials from their controls and initial states."""
    from ..workflow.validate import predict as run

    end(run(model, trials, out, how=how, bands=bands, sink=Terminal()), json)


def validate(
    model: o.ShipName, trials: o.Trials, out: o.Report = None, scale: o.Scale = None, purpose: o.FitFor = None,
    limit: o.Limit = None, *, how: Predicting, bands: Bands, json: bool = False,
) -> None:  # fmt: skip
    """Validate a model on trials beside two baselines."""
    from ..workflow.comparing import STATUS
    from ..workflow.validate import validate as run

    outcome = run(model, trials, out=out, how=how, scale=scale, purpose=purpose, limits=limit, bands=bands,
                  sink=Terminal())  # fmt: skip
    end(outcome, json)
    if outcome.result.fitness is not None:
        raise Exit(STATUS[outcome.result.fitness.verdict])


def show(outcome: Outcome[Any], json: bool) -> None:
    """Print the document, or the summary for people."""
    answer(outcome.shown, json)


def end(outcome: Outcome[Any], json: bool) -> None:
    """Print the outcome and what failed; exit 1 where something did."""
    for error in outcome.errors:
        fault(f"error: {error}")
    show(outcome, json)
    if outcome.errors:
        raise Exit(1)


def port_of(serving: Serving, usual: int) -> int | None:
    """The port of the page that was asked for; None where none was.

    Raises:
        RequestError: a port without a page.
    """
    if serving.port is not None and not serving.page:
        raise RequestError(f"--port {serving.port} is of the page; add --page")
    return (usual if serving.port is None else serving.port) if serving.page else None


class Terminal(Sink):
    """Notes and progress on standard error, and the page of the fits where a socket is given."""

    def __init__(self, listening: socket | None = None, page: type[Watched] | None = None) -> None:
        self._listening, self._kind = listening, page
        self._board: Board | None = None
        self._shown = ExitStack()
        self._live: Callable[[str], None] | None = None

    def note(self, line: str) -> None:
        note(line)

    @contextmanager
    def fitting(self, title: str, files: Mapping[str, Path], before: Sequence[str]) -> Generator[None, None, None]:
        """Serve the page, and keep a moving line on a terminal while fits run."""
        self._serve(title, files, before)
        if not at_terminal():
            yield
            return
        from rich.console import Console

        with Console(stderr=True).status("compiling") as status:
            self._live = live(status)
            try:
                yield
            finally:
                self._live = None

    def fit(self, name: str, problem: Problem, restart: float | None, *, several: bool) -> Progress | None:
        """A fit begins: on the page, and in words; of several, each begins by itself."""
        if self._live is not None:
            self._live("compiling")
        if several:
            return Words(self._live, board=self._board, restart=restart)
        return _watched(self._board, name, problem, restart, Words(self._live))

    def reporting(self, text: str) -> None:
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
                from ..core.errors import obeyed

                obeyed()
                note("page ended")

    def close(self, state: str = "", text: str = "") -> None:
        """End the page, in another state than `stay` has left."""
        if self._board is not None and state:
            self._board.end(state, text)
        self._shown.close()

    def _serve(self, title: str, files: Mapping[str, Path], before: Sequence[str]) -> None:
        if self._listening is None or self._kind is None:
            return
        from ..realtime.fit_page.board import STATIC, Board, Tracker

        self._board = Board(title, files, before=before)
        self._shown.enter_context(self._kind(self._board, STATIC, self._listening))
        self._shown.enter_context(Tracker(self._board))
        note(f"page: {self._address}")

    @property
    def _address(self) -> str:
        from ..core.listening import address

        return address(self._listening) if self._listening else ""


class Words:
    """Progress of a fit in words: on the moving line of a terminal, or a line now and then.

    Args:
        moving: puts a text on the moving line; None where there is none.
        name: of the fit, where several run side by side.
        board, restart: where each of several fits is shown (`part`), and the restarts of its predictions [s].
        said: when the last line was written, shared by the fits side by side.
    """

    def __init__(
        self, moving: Callable[[str], None] | None, name: str = "", *, board: Board | None = None,
        restart: float | None = None, said: list[float] | None = None,
    ) -> None:  # fmt: skip
        self._moving, self._name, self._board, self._restart = moving, name, board, restart
        self._said = [-math.inf] if said is None else said

    def __call__(self, iteration: int, objective: float, validation: float) -> None:
        """A row of the history."""
        silence = time.monotonic() - self._said[0]
        often = silence >= _SILENCE or (iteration % _EVERY == 0 and silence >= _LEAST)
        if self._moving is None and iteration != 1 and not often:
            return
        watched = "" if math.isnan(validation) else f", validation {validation:.5g}"
        self.stage(f"iteration {iteration}: objective {objective:.6g}{watched}")

    def stage(self, text: str) -> None:
        """What is being done, before there is a row."""
        self._said[0] = time.monotonic()
        (self._moving or note)(f"{self._name}: {text}" if self._name else text)

    def part(self, name: str, problem: Problem) -> Progress:
        """One of several fits begins; see `identify.watch.part`."""
        return _watched(self._board, name, problem, self._restart, Words(self._moving, name, said=self._said))


def _watched(board: Board | None, name: str, problem: Problem, restart: float | None, words: Words) -> Progress:
    """A fit on the page, which passes its rows on to `words`; these alone where there is no page."""
    if board is None:
        return words
    part = board.begin(name, problem, restart)
    part.beside = words
    return part


@contextmanager
def watching(port: int | None) -> Generator[Terminal, None, None]:
    """The sink of a command, with a page at this port for as long as it runs; no page without a port.

    Raises:
        RequestError: the port is taken, or the extra is not there.
    """
    if port is None:
        yield Terminal()
        return
    from ..core.listening import HERE, listen

    with listen(HERE, port, False) as listening:
        try:
            from ..realtime.pages import Watched
        except ImportError as error:
            raise RequestError(f"--page needs {error.name}; pip install 'seatrial[web]'") from None
        watch = Terminal(listening, Watched)
        try:
            yield watch
        except KeyboardInterrupt:
            watch.close("stopped", "stopped; the same command again resumes here")
            raise
        except Exception as error:
            watch.close("failed", str(error))
            raise
        watch.close()
