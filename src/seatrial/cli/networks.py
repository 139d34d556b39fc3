"""The run of a series of fits: what `identify` does where the file is a table of models."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..identify import Fit, FitError, Progress
from .page import Watch
from .spread import keep_members
from .support import Spoken, emit, figure, fitting, live, note, say, show_table

if TYPE_CHECKING:
    from ..study.series import Cell, Row, Series

PAGE = "report.html"


def compare_fits(path: Path, out: Path, as_json: bool, quick: bool, only: Sequence[str], watch: Watch) -> None:
    """Lint, fit each cell that is not done with a checkpoint of its own, judge all that are done, report.

    Raises:
        FitError: a fit failed; the others are done and in the report.
    """
    from ..report.series import write
    from ..study.series import FULL, QUICK, read_series
    from ..study.series_run import asked, check, left, run
    from ..validate.series import judged, sigma

    series = read_series(path, QUICK if quick else FULL)
    cells = left(series, out, only)
    if cells:
        for line in check(cells, series):
            note(line)
    else:
        note(f"{out}: every fit is done already, with the same data and settings; nothing was run")
    scale = sigma(series)

    def beside(cell: Cell, fit: Fit, where: Path) -> None:
        keep_members(cell.problem, cell.estimator, fit, where, scale, series.restart)

    done = len(asked(series, only)) - len(cells)
    if cells and done:
        note(f"{out}: {done} of {done + len(cells)} fits are done already")
    with fitting(path, f" to go on in {out}"), _progress() as (spoken, told):
        progress = _paged(watch, series, out, cells, asked(series, only), spoken)
        failed = run(cells, series, out, told=told, progress=progress, beside=beside, scale=scale, done=done)
    watch.reporting()
    options = "".join((" --quick" if quick else "", *(f" --only {name}" for name in only)))
    write(out / PAGE, series, judged(series, out), failed=failed, provenance={
        "study": str(path), "version": f"seatrial {__version__}",
        "data": "; ".join(dict.fromkeys(str(t.meta.get("source", "")) for t in series.tests.values())),
        "command": f"seatrial identify {path}{options} -o {out}",
    })  # fmt: skip
    _tell(json.loads((out / PAGE).with_suffix(".json").read_text(encoding="utf-8")), out, as_json)
    if failed:
        watch.stay()
        raise FitError(f"{len(left(series, out, only))} of {len(cells)} fits failed, first {failed[0]}")


def _paged(
    watch: Watch, series: Series, out: Path, cells: Sequence[tuple[Row, Cell]], wanted: Sequence[tuple[Row, Cell]],
    progress: Progress,
) -> Progress:  # fmt: skip
    """Who is told of the cells that are to be fitted: the page too, where there is one, with all wanted."""
    from ..study.series_run import folder
    from ..study.store import SUMMARY

    if not cells:
        return progress
    files = {f"{row.key}, {cell.name}": folder(out, row, cell) / SUMMARY for row, cell in cells}
    names = [f"{row.key}, {cell.name}" for row, cell in wanted]
    before = [name for name in names if name not in files]
    return watch.table(series.title or series.name, files, series.restart, progress, before)


@contextmanager
def _progress() -> Generator[tuple[Spoken, Callable[[str], None]], None, None]:
    """Live state of a fit on a terminal, a line now and then elsewhere; and who is told of each fit that begins."""
    if not sys.stderr.isatty():
        yield Spoken(note, _words, seldom=True), note
        return
    from rich.console import Console

    with Console(stderr=True).status("reading") as status:

        def begun(line: str) -> None:
            note(line)
            live(status)("  fitting, nothing to tell yet")

        yield Spoken(live(status), _words), begun


def _words(iteration: int, objective: float, validation: float) -> str:
    watched = "" if math.isnan(validation) else f", validation {validation:.5g}"
    return f"  {iteration}: loss {objective:.6g}{watched}"


def _tell(found: Mapping[str, Any], out: Path, as_json: bool) -> None:
    if as_json:
        emit({**found, "run": str(out)})
        return
    tests = [*found["tests"], "together"]
    rows = [
        (key, str(len(one["seeds"])), *(_error(one, test) for test in tests)) for key, one in found["models"].items()
    ]
    show_table(("standardised error", "seeds", *tests), rows, right=tuple(range(1, len(tests) + 2)))
    for claim in found["claims"]:
        verdicts = ", ".join(f"{row['test']}: {row['verdict']}" for row in claim["rows"])
        say(f"{claim['says']}: {verdicts}\n")
    say(f"wrote {out / PAGE}, {(out / PAGE).with_suffix('.json')}\n")


def _error(one: Mapping[str, Any], test: str) -> str:
    mean, spread = one["mean"][test], one["standard_deviation"][test]
    if mean is None:
        return "no number" if one["seeds"] else ""
    return figure(mean, 3) + ("" if spread is None else f" +- {figure(spread, 2)}")
