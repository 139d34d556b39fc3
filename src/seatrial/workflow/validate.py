"""Free-running predictions of trials by a model, and their comparison with the measurements and baselines."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from .. import __version__
from ..data import DataError, Trial
from ..data.check import check
from ..data.trialfile import read_trials, write_trial
from ..engine import SimulationError
from ..report.evidence import assumptions
from ..report.report import Report
from ..ships import Ship
from ..ships.files import load
from ..simulate.replay import replay
from ..validate.metrics import scale_words
from . import SILENT, Outcome, RequestError, Sink
from .advice import cautions, spread_numbers, spread_of, trained
from .comparing import compared, in_found_currents, provenance, scales_asked
from .shown import comparisons as table_of


def validate(
    model: str, paths: Sequence[Path], *, out: Path | None = None, restart: float | None = None,
    smooth_start: float | None = None, scale: str | None = None, sink: Sink = SILENT,
) -> Outcome[Report]:  # fmt: skip
    """Compare a model and its baselines with trials.

    Args:
        model: a name of the library, or a ship file.
        paths: trial files, or folders of them.
        out: page to write, with its numbers beside it.
        restart: seconds between restarts from the measured state; None for one free run.
        smooth_start: estimate initial states from the last so many seconds of data.
        scale: model.toml of a fit; errors are divided as where it was judged.

    Returns:
        The report; a prediction that blew up is in `errors`.

    Raises:
        RequestError, ShipError, DataError: what is asked for cannot be done.
    """
    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        raise RequestError(f"{out}: a report ends in .html; its numbers go beside it as .json")
    ship, trials = _read(model, paths, sink)
    sigma, origin = scales_asked(trials, scale)
    scaled = f"{scale_words(sigma)} ({origin})"
    moved = in_found_currents(trials, model, sink)
    comparisons, failed = compared(ship, moved, restart, sigma, smooth_start=smooth_start)
    spread = spread_of(model, ship, trials, sink)
    made = provenance(ship)
    report = Report(
        f"{ship.name}: validation", comparisons, trained_on=tuple(made.get("trained_on", ())),
        findings=(*(str(s) for s in spread if s.verdict != "inside"),
                  *(str(f) for t in trials for f in check(t) if f.severity != "info")),
        assumptions=assumptions(ship),
        provenance={"model": model, "version": f"seatrial {__version__}", "trials": ", ".join(map(str, paths)),
                    "errors divided by": scaled, "restart": "none" if restart is None else f"{restart:g} s",
                    **({} if smooth_start is None else {"starts": f"from the readings of {smooth_start:g} s"}),
                    **{k: str(made[k]) for k in ("study", "digest", "date") if k in made}},
    )  # fmt: skip
    if out is not None:
        sink.note(f"wrote {report.write(out)}")
    document = {**report.numbers(), **spread_numbers(spread)}
    return Outcome(report, document, (table_of(report), f"errors divided by: {scaled}"), failed)


def predict(
    model: str, paths: Sequence[Path], out: Path, *, restart: float | None = None, smooth_start: float | None = None,
    sink: Sink = SILENT,
) -> Outcome[tuple[Trial, ...]]:  # fmt: skip
    """Predict trials on their own rows, and write the predictions as trial files to `out`; other arguments as above.

    Returns:
        The predictions; a trial that cannot be predicted is in `errors`.

    Raises:
        RequestError, ShipError, DataError: what is asked for cannot be done; `out` would overwrite the trials.
    """
    ship, trials = _read(model, paths, sink, out)
    predictions: list[Trial] = []
    failed: list[str] = []
    for trial in in_found_currents(trials, model, sink):
        try:
            predictions.append(replay(ship, trial, restart=restart, smooth_start=smooth_start))
        except SimulationError as error:  # the other trials are predicted all the same
            failed.append(str(error))
    _make_folder(out)
    for prediction in predictions:
        write_trial(prediction, out / f"{prediction.name}.csv")
    written = tuple(str(out / f"{one.name}.csv") for one in predictions)
    spread = spread_of(model, ship, trials, sink)
    document = {"model": ship.name, "restart": restart, "written": list(written), **spread_numbers(spread)}
    return Outcome(tuple(predictions), document, written, tuple(failed))


def _read(model: str, paths: Sequence[Path], sink: Sink, out: Path | None = None) -> tuple[Ship, Sequence[Trial]]:
    """Ship and trials, whose cautions are noted."""
    ship, trials = trained(load(model), model), read_trials(paths)
    for source in paths:
        if out is not None and (source if source.is_dir() else source.parent).resolve() == out.resolve():
            raise DataError(f"{out}: holds the trials themselves; choose another folder with -o")
    for line in cautions(ship, trials):
        sink.note(line)
    return ship, trials


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RequestError(f"{out}: not a folder that can be made: {error.strerror}") from None
