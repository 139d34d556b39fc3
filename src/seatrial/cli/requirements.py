"""The command requirements: Sawada 2024 section 6 for a ship, as a table, a page or JSON."""

from __future__ import annotations

from pathlib import Path

from ..core.files import write_whole
from ..report.requirements import document, verdict
from ..validate.requirements import Table
from ..validate.requirements.scopes import SCOPES, judge
from .support import UsageError, emit, note, read_ship, say, show_table

HEAD = ("item", "requirement", "verdict", "why")


def requirements(ship: str, scope: str, out: Path | None, json: bool) -> None:
    """Judge a ship and tell the outcome; write a page where `out` asks for one.

    Raises:
        UsageError: an unknown scope, or an output that is no page or whose folder is not there.
        ShipError: a ship that cannot be read.
    """
    if scope not in SCOPES:
        raise UsageError(f"--scope is '{scope}'; known: {', '.join(SCOPES)}")
    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"{out}: the page of the requirements ends in .html")
    if out is not None and not out.parent.is_dir():
        raise UsageError(f"{out}: no such folder: {out.parent}")
    found = judge(read_ship(ship), scope)
    if out is not None:
        write_whole(out, document(found))
        note(f"wrote {out}")
    if json:
        emit(numbers(found))
        return
    show_table(HEAD, ((item.number, item.text, j.verdict, j.reason) for item, j in found.rows))
    say(f"{found.ship}, {found.scope}: {verdict(found)}\n")


def numbers(found: Table) -> dict[str, object]:
    """The table as JSON has it."""
    return {
        "ship": found.ship, "scope": found.scope, "verdict": verdict(found), "failed": list(found.failed),
        "items": [
            {"item": item.number, "requirement": item.text, "verdict": j.verdict, "reason": j.reason,
             "evidence": {name: {"value": value, "unit": unit} for name, (value, unit) in j.evidence.items()}}
            for item, j in found.rows
        ],
    }  # fmt: skip
