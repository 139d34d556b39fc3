"""Commands about models and trials: check, identify, predict, validate; each a few lines over `workflow`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ..workflow import Outcome, Silent, Table
from .support import Stopped, emit, note, positive, say, show_table

Model = Annotated[str, typer.Argument(help="A name of the library (seatrial ships) or a ship file.")]
Trials = Annotated[list[Path], typer.Argument(help="Trial files, or folders of them.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Restart = Annotated[float | None, typer.Option(help="Reset to the measured state every N seconds.")]
SmoothStart = Annotated[
    float | None, typer.Option(help="Estimate initial states from the last N seconds of data.")
]


def check(
    trials: Trials,
    against: Annotated[
        list[Path] | None, typer.Option(help="Training trials to look for overlap and coverage. Repeatable.")
    ] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="With --against: page to write (.html).")] = None,
    json: Json = False,
) -> None:
    """Check trials: findings with place, evidence and remedy; exit 1 on errors."""
    from ..workflow.check import check as run

    outcome = run(trials, against=against or (), out=out, sink=_Notes())
    _show(outcome, json)
    raise typer.Exit(1 if outcome.errors else 0)


def identify(
    study: Annotated[Path, typer.Argument(help="A study file, or a table of many fits.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder of the run; a killed run resumes from it.")],
    quick: Annotated[bool, typer.Option("--quick", help="Of a table of fits: run its rehearsal.")] = False,
    only: Annotated[list[str] | None, typer.Option(help="Of a table of fits: run this one. Repeatable.")] = None,
    page: Annotated[bool, typer.Option("--page", help="Show the running fit on a page of this machine.")] = False,
    port: Annotated[int | None, typer.Option(help="Port of the page; 0 takes a free one; default 8021.")] = None,
    json: Json = False,
) -> None:
    """Fit a ship to trials; write model.toml, fit.json, history.csv and report.html."""
    from ..identify import FitError
    from ..workflow.identify import identify as run
    from ..workflow.identify import resumes
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
    model: Model,
    trials: Trials,
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for the predictions.")],
    restart: Restart = None,
    smooth_start: SmoothStart = None,
    json: Json = False,
) -> None:
    """Predict trials on their own rows, free-running."""
    from ..workflow.validate import predict as run

    positive(restart=restart, smooth_start=smooth_start)
    outcome = run(model, trials, out, restart=restart, smooth_start=smooth_start, sink=_Notes())
    _end(outcome, json)


def validate(
    model: Model,
    trials: Trials,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Report to write (.html; .json beside it).")] = None,
    restart: Restart = None,
    smooth_start: SmoothStart = None,
    scale: Annotated[str | None, typer.Option(help="Divide errors as this fit did: its model.toml.")] = None,
    json: Json = False,
) -> None:
    """Compare the predictions of a model and two baselines with trials."""
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
