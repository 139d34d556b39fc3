"""Page and numbers of the IMO manoeuvring criteria (MSC.137(76)) of a ship."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...validate.imo import FAIL, PASS, UNDECIDED, Criterion, ImoTable
from .. import figures
from ..blocks import Body, bullets, entries, fields, figure, heading, lead, note, number, table
from ..page import Page, Section

_NAME = "criterion (MSC.137(76) section 5.3)"
_HEAD = (_NAME, "side", "value", "limit", "unit", "verdict")
_BANDED = (_NAME, "side", "value", "from", "to", "limit", "unit", "draws that meet it", "verdict")
_MARKS = ((PASS, figures.BLUE, "o"), (UNDECIDED, figures.OCHRE, "D"), (FAIL, figures.VERMILION, "s"))


def page(found: ImoTable) -> Page:
    """The criteria with values, limits and verdicts, what they leave out, and the conditions."""
    drawn = figure(_drawn(found), "Values, their bands and the limit, which is 1") if banded(found) else ()
    return Page(
        f"{found.ship}: IMO manoeuvring standards",
        (
            Section("", fields(numbers(found), _head(found))),
            Section("Criteria", _criteria(found) + drawn + _reasons(found.rows)),
            Section("Conditions", entries(found.conditions)),
        ),
    )


def brief(found: ImoTable) -> Body:
    """The same without drawings, for a terminal."""
    return fields(numbers(found), _head(found) + _criteria(found) + _reasons(found.rows) + entries(found.conditions))


def _head(found: ImoTable) -> Body:
    return lead(found.verdict) + note("What this does not show", found.caveats)


def _criteria(found: ImoTable) -> Body:
    if banded(found):
        return table(_BANDED, map(_banded, found.rows), words=(1, 6, 8))
    return table(_HEAD, map(_row, found.rows), words=(1, 4, 5))


def numbers(found: ImoTable) -> dict[str, object]:
    """The table as JSON has it."""
    return {
        "ship": found.ship, "standard": "IMO MSC.137(76)", "L_pp": {"value": found.L_pp, "unit": "m"},
        "speed": {"value": found.speed, "unit": "m/s"}, "n_P": {"value": found.n_P, "unit": "1/s"},
        "L_over_V": {"value": found.L_over_V, "unit": "s"}, "verdict": found.verdict,
        "criteria": [
            {"criterion": row.name, "side": row.side or None, "value": row.value, "limit": row.limit,
             "unit": row.unit, "verdict": row.verdict, "reason": row.reason, **_band(row)}
            for row in found.rows
        ],
        "conditions": dict(found.conditions), "caveats": list(found.caveats),
    }  # fmt: skip


def _band(row: Criterion) -> dict[str, object]:
    if row.band is None:
        return {}
    low, high = (None if math.isnan(edge) else edge for edge in (row.band.low, row.band.high))
    return {"band": {"low": low, "high": high, "met": row.band.met, "draws": row.band.draws}}


def banded(found: ImoTable) -> bool:
    """Whether any criterion was judged by draws."""
    return any(row.band is not None for row in found.rows)


def _edges(row: Criterion) -> tuple[str, str]:
    """Lower and upper edge of the band in words; dashes where there is none."""
    found = () if row.band is None else (row.band.low, row.band.high)
    return tuple("–" if math.isnan(edge) else number(edge) for edge in found) or ("–", "–")  # type: ignore[return-value]


def _row(row: Criterion) -> tuple[str, ...]:
    value = "–" if row.value is None else number(row.value)
    return (row.name, row.side or "–", value, number(row.limit), row.unit, row.verdict)


def _banded(row: Criterion) -> tuple[str, ...]:
    name, side, value, limit, unit, verdict = _row(row)
    met = "–" if row.band is None else f"{math.floor(100.0 * row.band.met):d} %"
    return (name, side, value, *_edges(row), limit, unit, met, verdict)


def _drawn(found: ImoTable) -> str:
    """Each criterion on a line: its band as a bar and its value as a mark, in parts of the limit."""
    rows = [row for row in found.rows if row.band is not None and row.value is not None]
    drawn, (ax,) = figures.canvas(1, (9.5, 0.9 + 0.27 * len(rows)))
    for verdict, colour, mark in _MARKS:
        own = [(k, row) for k, row in enumerate(rows) if row.verdict == verdict]
        for k, row in own:
            low, high = (edge / row.limit for edge in _ends(row))
            ax.plot([low, high], [k, k], color=colour, lw=5, alpha=0.45, solid_capstyle="butt", label="_band")
        if own:
            ax.plot([(row.value or 0.0) / row.limit for _, row in own], [k for k, _ in own], mark, color=colour, ms=6,
                    label=verdict)  # fmt: skip
    ax.axvline(1.0, color=figures.INK, lw=1.2)
    figures.rows_of(drawn, ax, [row.title for row in rows], "value / limit [-]", len(_MARKS))
    return figures.svg(drawn, f"criteria of {found.ship}")


def _ends(row: Criterion) -> tuple[float, float]:
    """Edges of the band; the value itself where too few draws give it."""
    value = float(row.value or 0.0)
    band = row.band
    return (value, value) if band is None or math.isnan(band.low) else (band.low, band.high)


def _reasons(rows: Sequence[Criterion]) -> Body:
    """Each reason once, after the criteria that it belongs to."""
    reasons = dict.fromkeys(row.reason for row in rows if row.reason)
    said = [f"{', '.join(row.title for row in rows if row.reason == reason)}: {reason}" for reason in reasons]
    return heading("Reasons") + bullets(said) if said else ()
