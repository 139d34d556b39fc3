"""Page and numbers of the IMO manoeuvring criteria (MSC.137(76)) of a ship."""

from __future__ import annotations

from collections.abc import Iterator

from ...validate.imo import Criterion, ImoTable
from ..page import Page, Section, bullets, entries, lead, note, number, table

_HEAD = ("criterion (MSC.137(76) section 5.3)", "side", "value", "limit", "unit", "verdict")


def page(found: ImoTable) -> Page:
    """The criteria with values, limits and verdicts, what they leave out, and the conditions."""
    reasons = list(_reasons(found.rows))
    criteria = table(_HEAD, (_row(row) for row in found.rows), words=(1, 4, 5))
    return Page(
        f"{found.ship}: IMO manoeuvring standards",
        (
            Section("", lead(found.verdict) + note("What this does not show", found.caveats)),
            Section("Criteria", criteria + (f"<h3>Reasons</h3>{bullets(reasons)}" if reasons else "")),
            Section("Conditions", entries(found.conditions)),
        ),
        numbers(found),
    )


def numbers(found: ImoTable) -> dict[str, object]:
    """The table as JSON has it."""
    return {
        "ship": found.ship, "standard": "IMO MSC.137(76)", "L_pp": {"value": found.L_pp, "unit": "m"},
        "speed": {"value": found.speed, "unit": "m/s"}, "n_P": {"value": found.n_P, "unit": "1/s"},
        "L_over_V": {"value": found.L_over_V, "unit": "s"}, "verdict": found.verdict,
        "criteria": [
            {"criterion": row.name, "side": row.side or None, "value": row.value, "limit": row.limit,
             "unit": row.unit, "verdict": row.verdict, "reason": row.reason}
            for row in found.rows
        ],
        "conditions": dict(found.conditions), "caveats": list(found.caveats),
    }  # fmt: skip


def _row(row: Criterion) -> tuple[str, ...]:
    value = "–" if row.value is None else number(row.value)
    return (row.name, row.side or "–", value, number(row.limit), row.unit, row.verdict)


def _reasons(rows: tuple[Criterion, ...]) -> Iterator[str]:
    """Each reason once, after the criteria that it belongs to."""
    for reason in dict.fromkeys(row.reason for row in rows if row.reason):
        names = (f"{row.name}{f' ({row.side})' if row.side else ''}" for row in rows if row.reason == reason)
        yield f"{', '.join(names)}: {reason}"
