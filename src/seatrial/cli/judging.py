"""Commands that judge a ship: imo, requirements."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import options as o
from .render import emit, figure, note, say, show_table

if TYPE_CHECKING:
    from ..validate.imo import Criterion, ImoTable
    from ..validate.requirements import Table

HEAD = ("criterion", "side", "value", "limit", "unit", "verdict", "why")


def imo(ship: o.ShipName, out: o.Page = None, json: o.Json = False) -> None:
    """Judge a ship by the criteria of IMO MSC.137(76)."""
    from ..workflow.judging import imo as run

    table = run(ship, out, note)
    if json:
        emit(_imo_document(table))
        return
    show_table(HEAD, (_row(row) for row in table.rows), right=(2, 3))
    lines = [f"{name}: {value}" for name, value in table.conditions.items()]
    lines += [*(f"caveat: {line}" for line in table.caveats), table.verdict]
    say("\n".join(lines) + "\n")


def requirements(
    ship: o.ShipName, scope: o.Scope = "collision-avoidance", out: o.Page = None, json: o.Json = False
) -> None:
    """Judge a ship by the requirements of Sawada 2024 section 6."""
    from ..report.requirements import verdict
    from ..workflow.judging import requirements as run

    found = run(ship, scope, out, note)
    if json:
        emit(_requirements_document(found, verdict(found)))
        return
    show_table(("item", "requirement", "verdict", "why"),
               ((item.number, item.text, j.verdict, j.reason) for item, j in found.rows))  # fmt: skip
    say(f"{found.ship}, {found.scope}: {verdict(found)}\n")


def _row(row: Criterion) -> tuple[str, ...]:
    return (row.name, row.side or "–", figure(row.value), figure(row.limit), row.unit, row.verdict, row.reason)


def _imo_document(table: ImoTable) -> dict[str, Any]:
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


def _requirements_document(found: Table, verdict: str) -> dict[str, object]:
    return {
        "ship": found.ship, "scope": found.scope, "verdict": verdict, "failed": list(found.failed),
        "items": [
            {"item": item.number, "requirement": item.text, "verdict": j.verdict, "reason": j.reason,
             "evidence": {name: {"value": value, "unit": unit} for name, (value, unit) in j.evidence.items()}}
            for item, j in found.rows
        ],
    }  # fmt: skip
