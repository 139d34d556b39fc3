"""The command imo: the criteria of MSC.137(76) for a ship, as a table, a page or JSON."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..core.files import write_whole
from ..report.imo import document
from ..validate.imo import Criterion, ImoTable, imo_table
from .support import UsageError, emit, figure, note, read_ship, say, show_table

HEAD = ("criterion", "side", "value", "limit", "unit", "verdict", "why")


def imo(ship_name: str, out: Path | None, json: bool) -> None:
    """Run the trials, tell the verdicts and what they leave out; write a page where `out` asks for one.

    Raises:
        UsageError: an output that is no page, or whose folder is not there.
        ShipError: a ship that cannot be read, or finds no steady approach.
    """
    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"{out}: the page of the criteria ends in .html")
    if out is not None and not out.parent.is_dir():
        raise UsageError(f"{out}: no such folder: {out.parent}")
    table = imo_table(read_ship(ship_name))
    if out is not None:
        write_whole(out, document(table))
        note(f"wrote {out}")
    if json:
        emit(_numbers(table))
        return
    show_table(HEAD, (_row(row) for row in table.rows), right=(2, 3))
    lines = [f"{name}: {value}" for name, value in table.conditions.items()]
    lines += [*(f"caveat: {line}" for line in table.caveats), table.verdict]
    say("\n".join(lines) + "\n")


def _row(row: Criterion) -> tuple[str, ...]:
    return (row.name, row.side or "–", figure(row.value), figure(row.limit), row.unit, row.verdict, row.reason)


def _numbers(table: ImoTable) -> dict[str, Any]:
    return {
        "ship": table.ship, "standard": "IMO MSC.137(76)", "L_pp": {"value": table.L_pp, "unit": "m"},
        "speed": {"value": table.speed, "unit": "m/s"}, "n_P": {"value": table.n_P, "unit": "1/s"},
        "L_over_V": {"value": table.L_over_V, "unit": "s"}, "verdict": table.verdict,
        "criteria": [
            {"criterion": row.name, "side": row.side or None, "value": row.value, "limit": row.limit,
             "unit": row.unit, "verdict": row.verdict, "reason": row.reason}
            for row in table.rows
        ],
        "conditions": dict(table.conditions), "caveats": list(table.caveats),
    }  # fmt: skip
