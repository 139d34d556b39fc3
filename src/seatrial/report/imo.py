"""The table of the IMO criteria as a page."""

from __future__ import annotations

from collections.abc import Iterator

from ..validate.imo import Criterion, ImoTable
from .page import bullets, number, page, table, text

_HEAD = ("criterion (MSC.137(76) section 5.3)", "side", "value", "limit", "unit", "verdict")


def document(found: ImoTable) -> str:
    """The whole page."""
    conditions = "".join(f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in found.conditions.items())
    reasons = list(_reasons(found.rows))
    return page(
        f"{found.ship}: IMO manoeuvring standards",
        f"<h1>{text(found.ship)}: IMO manoeuvring standards</h1>"
        f'<p class="lead">{text(found.verdict)}</p>'
        f'<div class="note"><strong>What this does not show</strong>{bullets(found.caveats)}</div>'
        f"<h2>Criteria</h2>{table(_HEAD, (_row(row) for row in found.rows), words=(1, 4, 5))}"
        + (f"<h3>Reasons</h3>{bullets(reasons)}" if reasons else "")
        + f"<h2>Conditions</h2><dl>{conditions}</dl>",
    )


def _row(row: Criterion) -> tuple[str, ...]:
    value = "–" if row.value is None else number(row.value)
    return (row.name, row.side or "–", value, number(row.limit), row.unit, row.verdict)


def _reasons(rows: tuple[Criterion, ...]) -> Iterator[str]:
    """Each reason once, behind the criteria that it belongs to."""
    for reason in dict.fromkeys(row.reason for row in rows if row.reason):
        names = (f"{row.name}{f' ({row.side})' if row.side else ''}" for row in rows if row.reason == reason)
        yield f"{', '.join(names)}: {reason}"
