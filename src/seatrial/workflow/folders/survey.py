"""What is in a folder of recordings: a table, a page and a document."""

from __future__ import annotations

import math
from pathlib import Path

from ...core.files import write_whole
from ...data.folder import read_folder
from ...data.kinds.parts import separating
from ...data.prepare.steps import steps_text
from ...report.blocks import fields, joined, line, table
from ...validate.folder import Entry, Survey, survey
from .. import SILENT, Outcome, Sink
from ..asked import Foreign
from ..request import PAGES, check_output


def trials(
    folder: Path, logs: Foreign = Foreign(), *, out: Path | None = None, remedy: Path | None = None,
    sink: Sink = SILENT,
) -> Outcome[Survey]:  # fmt: skip
    """Survey a folder of recordings, and write a page of it where one is asked for.

    Args:
        remedy: file to write with the steps that make a trial of each manoeuvre where a recording holds several.

    Raises:
        RequestError: a page that is no .html, or a file of steps that is no .toml.
        DataError: no folder, or no recording that can be read; one that cannot is a row with the reason.
    """
    from ...report.trials import held, numbers, page, warnings

    check_output(out, PAGES, "a page")
    check_output(remedy, (".toml",), "a file of steps")
    found = survey(read_folder(folder, logs.format, logs.mapping))
    if out is not None:
        from ...report.page import write

        write(out, page(found))
        sink.note(f"wrote {out}")
    several = {name: entry for name, entry in found.entries.items() if entry.parts}
    if remedy is not None and several:
        write_whole(remedy, steps_text((f"{name}: {held(entry)}", [separating(entry.trial, entry.parts)])
                                       for name, entry in several.items()))  # fmt: skip
        sink.note(f"wrote {remedy}; then: seatrial mend {folder} --by {remedy} -o DIR")
    elif several:
        sink.note(f"note: each manoeuvre is to be a trial of its own: seatrial trials {folder} --remedy steps.toml")
    elif remedy is not None:
        sink.note("no recording holds several manoeuvres; no file of steps is written")
    head = ("recording", "recognised", "told", "s", "u [m/s]", "rudder [deg]", "revs [1/s]", "new", "doubts")
    unread = found.folder.unread
    failed = (f"{folder}: {len(unread)} of {len(found.folder.files)} recordings cannot be read",) if unread else ()
    rows = [(name, _row(name, entry)) for name, entry in found.entries.items()]
    rows += [(name, (name, "unreadable", *"–" * 6, why)) for name, why in unread.items()]
    counted = ", ".join(f"{count} {name}" for name, count in found.counts.items())
    counted += f", and {len(unread)} unreadable" if unread else ""
    shown = (table(head, (row for _, row in sorted(rows)), words=(1, 2, 8)) + joined(map(line, warnings(found)))
             + line(f"{len(rows)} recordings: {counted}"))  # fmt: skip
    return Outcome(found, fields(numbers(found), shown), errors=failed)


def _row(name: str, entry: Entry) -> tuple[str, ...]:
    from ...report.trials import span

    told = {"differs": f"{entry.told} (differs)", "close": f"{entry.told} (close)"}.get(entry.verdict, entry.told)
    new = f"{100 * entry.new:.0f} %" if math.isfinite(entry.new) else "–"
    return (name, entry.kind.label, told or "–", f"{entry.trial.duration:.0f}",
            *(span(entry, channel) for channel in ("u", "delta", "n_P")), new,
            "; ".join(entry.kind.doubts) or "–")  # fmt: skip
