"""A first study of a ship and a folder of recordings, written to a file."""

from __future__ import annotations

import os
from pathlib import Path

from ...core.files import write_whole
from ...core.parameters import unknown
from ...data.folder import read_folder
from ...data.trialfile import write_trials
from ...report.blocks import fields, joined, line, table
from ...study.drafting.draft import Draft, draft
from .. import SILENT, Outcome, RequestError, Sink
from ..asked import Foreign
from ..request import check_output, make_folder, ship_of


def new_study(
    action: str, ship: str, folder: Path, out: Path, logs: Foreign = Foreign(), *, sink: Sink = SILENT
) -> Outcome[Draft]:
    """Write a first study of a ship and a folder of recordings.

    Args:
        action: "new"; no other is known.
        out: the study; it is not overwritten.
        logs: how recordings of other tools are read.

    Raises:
        RequestError: another action, or a file that is there already or cannot be written.
        ShipError, DataError, StudyError: no such ship, or no recordings that it can be fitted to.
    """
    if action != "new":
        raise RequestError(f"study: {unknown(action, ('new',), 'action')}; write seatrial study new SHIP FOLDER")
    check_output(out, (".toml",), "a study")
    if out.exists():
        raise RequestError(f"{out}: is there already; choose another file with -o, or delete it")
    read = read_folder(folder, logs.format, logs.mapping)
    named = os.path.relpath(Path(ship).resolve(), out.resolve().parent) if ship.endswith(".toml") else ship
    made = draft(named, ship_of(ship), read, out, logs.mapping)
    if made.cut:
        parts = out.with_name(f"{out.stem}_trials")
        make_folder(parts)
        write_trials(made.cut, parts)
    write_whole(out, made.text)
    for one in made.notes:
        sink.note(f"note: {one}")
    kinds = list(dict.fromkeys((*made.train, *made.test)))
    rows = tuple((kind, str(len(made.train.get(kind, ()))), ", ".join(made.test.get(kind, ())) or "–")
                 for kind in kinds)  # fmt: skip
    told = joined(line(f"left out: {name}: {why}") for name, why in made.left_out.items())
    run = out.with_suffix("")
    shown = (table(("kind", "training", "held out"), rows, words=(2,)) + told
             + line(f"wrote {out}; read it, then: seatrial identify {out} -o {run}"))  # fmt: skip
    document = {"study": str(out), "train": made.train, "test": made.test, "left_out": made.left_out,
                "cut": [trial.name for trial in made.cut], "notes": list(made.notes)}  # fmt: skip
    return Outcome(made, fields(document, shown))
