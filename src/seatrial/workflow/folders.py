"""What is in a folder of recordings, and a first study of it."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.parameters import unknown
from ..data.folder import read_folder
from ..data.trialfile import write_trial
from ..ships.files import load
from ..validate.folder import Entry, Survey, survey
from . import SILENT, Outcome, RequestError, Sink, Table
from .request import PAGES, check_output, make_folder

if TYPE_CHECKING:
    from ..study.draft import Draft


def trials(
    folder: Path, *, format: str | None = None, mapping: Path | None = None, out: Path | None = None,
    sink: Sink = SILENT,
) -> Outcome[Survey]:  # fmt: skip
    """Survey a folder of recordings, and write a page of it where one is asked for.

    Raises:
        RequestError: a page that is no .html.
        DataError: no folder, or a recording that cannot be read.
    """
    from ..report.trials import numbers, page, warnings

    check_output(out, PAGES, "a page")
    found = survey(read_folder(folder, format, mapping))
    if out is not None:
        from ..report.page import write

        write(out, page(found))
        sink.note(f"wrote {out}")
    head = ("recording", "recognised", "told", "s", "u [m/s]", "rudder [deg]", "revs [1/s]", "new", "doubts")
    table = Table(head, tuple(_row(name, entry) for name, entry in found.entries.items()), (3, 4, 5, 6, 7))
    counted = ", ".join(f"{count} {name}" for name, count in found.counts.items())
    shown = (table, *warnings(found), f"{len(found.entries)} recordings: {counted}")
    return Outcome(found, numbers(found), shown)


def _row(name: str, entry: Entry) -> tuple[str, ...]:
    from ..report.trials import span

    told = {"differs": f"{entry.told} (differs)", "close": f"{entry.told} (close)"}.get(entry.verdict, entry.told)
    new = f"{100 * entry.new:.0f} %" if math.isfinite(entry.new) else "–"
    return (name, entry.kind.label, told or "–", f"{entry.trial.duration:.0f}",
            *(span(entry, channel) for channel in ("u", "delta", "n_P")), new,
            "; ".join(entry.kind.doubts) or "–")  # fmt: skip


def new_study(
    action: str, ship: str, folder: Path, out: Path, *, format: str | None = None, mapping: Path | None = None,
    sink: Sink = SILENT,
) -> Outcome[Draft]:  # fmt: skip
    """Write a first study of a ship and a folder of recordings.

    Args:
        action: "new"; no other is known.
        out: the study; it is not overwritten.

    Raises:
        RequestError: another action, or a file that is there already or cannot be written.
        ShipError, DataError, StudyError: no such ship, or no recordings that it can be fitted to.
    """
    from ..study.draft import draft

    if action != "new":
        raise RequestError(f"study: {unknown(action, ('new',), 'action')}; write seatrial study new SHIP FOLDER")
    check_output(out, (".toml",), "a study")
    if out.exists():
        raise RequestError(f"{out}: is there already; choose another file with -o, or delete it")
    read = read_folder(folder, format, mapping)
    named = os.path.relpath(Path(ship).resolve(), out.resolve().parent) if ship.endswith(".toml") else ship
    made = draft(named, load(ship), read, out, mapping)
    for trial in made.cut:
        parts = out.with_name(f"{out.stem}_trials")
        make_folder(parts)
        write_trial(trial, parts / f"{trial.name}.csv")
    out.write_text(made.text, encoding="utf-8")
    for line in made.notes:
        sink.note(f"note: {line}")
    kinds = list(dict.fromkeys((*made.train, *made.test)))
    rows = tuple((kind, str(len(made.train.get(kind, ()))), ", ".join(made.test.get(kind, ())) or "–")
                 for kind in kinds)  # fmt: skip
    told = tuple(f"left out: {name}: {why}" for name, why in made.left_out.items())
    run = out.with_suffix("")
    shown = (Table(("kind", "training", "held out"), rows, (1,)), *told,
             f"wrote {out}; read it, then: seatrial identify {out} -o {run}")  # fmt: skip
    document = {"study": str(out), "train": made.train, "test": made.test, "left_out": made.left_out,
                "cut": [trial.name for trial in made.cut], "notes": list(made.notes)}  # fmt: skip
    return Outcome(made, document, shown)
