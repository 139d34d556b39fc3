"""Commands about models and trials: check, identify, predict, validate; each a few lines over `workflow`."""

from __future__ import annotations

from typing import Any

import typer

from ..workflow import Outcome, Silent, Table
from . import options as o
from .render import emit, note, say, show_table


def check(
    trials: o.Trials, against: o.Against = None, out: o.CoveragePage = None, json: o.Json = False
) -> None:
    """Check trials: what is wrong, where and the remedy."""
    from ..workflow.validate import check as run

    outcome = run(trials, against=against or (), out=out, sink=_Notes())
    _show(outcome, json)
    raise typer.Exit(1 if outcome.errors else 0)


def identify(
    study: o.StudyFile, out: o.RunFolder, quick: o.Quick = False, only: o.OnlyFits = None, page: o.FitPage = False,
    port: o.FitPort = None, json: o.Json = False,
) -> None:  # fmt: skip
    """Fit a ship to trials; write the model and a report."""
    from ..identify import FitError
    from ..workflow.identify import identify as run
    from ..workflow.identify import resumes
    from ..workflow.request import Stopped
    from .page import port_of, watching

    with watching(port_of(page, port)) as sink:
        try:
            outcome = run(study, out, quick=quick, only=only or (), sink=sink)
        except KeyboardInterrupt:
            again = f" to go on in {out}" if resumes(out) else ""
            raise Stopped(f"interrupted; run the same command again{again}") from None
        _show(outcome, json)
        sink.stay()
        if outcome.errors:
            raise FitError(outcome.errors[0])


def predict(
    model: o.ShipName, trials: o.Trials, out: o.PredictionFolder, restart: o.Restart = None,
    smooth_start: o.SmoothStart = None, json: o.Json = False,
) -> None:  # fmt: skip
    """Predict trials from their controls and initial states."""
    from ..workflow.request import positive
    from ..workflow.validate import predict as run

    positive(restart=restart, smooth_start=smooth_start)
    outcome = run(model, trials, out, restart=restart, smooth_start=smooth_start, sink=_Notes())
    _end(outcome, json)


def validate(
    model: o.ShipName, trials: o.Trials, out: o.Report = None, restart: o.Restart = None,
    smooth_start: o.SmoothStart = None, scale: o.Scale = None, json: o.Json = False,
) -> None:  # fmt: skip
    """Validate a model on trials beside two baselines."""
    from ..workflow.request import positive
    from ..workflow.validate import validate as run

    positive(restart=restart, smooth_start=smooth_start)
    outcome = run(model, trials, out=out, restart=restart, smooth_start=smooth_start, scale=scale, sink=_Notes())
    _end(outcome, json)


class _Notes(Silent):
    """A sink for workflows without fits: notes go to standard error."""

    def note(self, line: str) -> None:
        """One line for the user."""
        note(line)


def _show(outcome: Outcome[Any], json: bool) -> None:
    """Print the document, or the summary for people."""
    if json:
        emit(outcome.document)
        return
    for block in outcome.shown:
        if isinstance(block, Table):
            show_table(block.head, block.rows, block.right)
        else:
            say(f"{block}\n")


def _end(outcome: Outcome[Any], json: bool) -> None:
    """Print the outcome and what failed; exit 1 where something did."""
    for error in outcome.errors:
        note(f"error: {error}")
    _show(outcome, json)
    if outcome.errors:
        raise typer.Exit(1)
