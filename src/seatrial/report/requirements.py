"""The requirements of a scope, judged for a ship, as a page."""

from __future__ import annotations

from collections.abc import Iterator

from .. import __version__
from ..validate.requirements import Item, Judgement, Table
from . import figures
from .page import figure, number, page, table, text

_MARK = {"pass": "✓ pass", "fail": "✗ fail", "not applicable": "– not applicable"}
_SOURCES = {
    "collision-avoidance": "Sawada et al. 2024, section 6.2: heading control for collision avoidance",
    "berthing": "Sawada et al. 2024, section 6.2: berthing",
    "functional": "Sawada et al. 2024, section 6.1: the list of IEC 62065",
}


def verdict(found: Table) -> str:
    """The outcome in one line."""
    passed, failed, aside = (found.count(v) for v in ("pass", "fail", "not applicable"))
    told = f"{passed} of {len(found.rows)} items pass"
    told += f", {failed} fail ({', '.join(found.failed)})" if failed else ""
    return told + (f", {aside} not applicable" if aside else "")


def document(found: Table) -> str:
    """The whole page: the table first, then each item with its figures and drawings."""
    title = f"{found.ship}: requirements, {found.scope}"
    rows = ((item.number, item.text, _MARK[j.verdict], j.reason) for item, j in found.rows)
    return page(
        title,
        f"<h1>{text(title)}</h1><p class=\"lead\">{text(verdict(found))}</p>"
        f"<p class=\"soft\">{text(_SOURCES[found.scope])}. Each item is judged by what the ship does in simulation; "
        "agreement with a real ship is another matter (seatrial validate).</p>"
        + f'<div class="wrap">{table(("item", "requirement", "verdict", "why"), rows, words=(1, 2, 3))}</div>'
        + "".join(_section(item, judgement) for item, judgement in found.rows)
        + f"<h2>Conditions</h2><dl>{_conditions(found)}</dl>",
    )  # fmt: skip


def _conditions(found: Table) -> str:
    """How it was judged: at which speed and step, by which version, and where the limits of each check stand."""
    told = {**found.conditions, "limits of each check": "docs/decisions.md, requirements", "version": __version__,
            "command": f"seatrial requirements {found.ship} --scope {found.scope}"}  # fmt: skip
    return "".join(f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in told.items())


def _section(item: Item, found: Judgement) -> str:
    drawn = "".join(_drawings(found))
    evidence = ((name, number(value, 4), unit) for name, (value, unit) in found.evidence.items())
    return (
        f"<h2>{text(item.number)}. {text(item.text)}</h2><p><strong>{text(_MARK[found.verdict])}</strong>: "
        f"{text(found.reason)}.</p>"
        + (table(("measured", "value", "unit"), evidence, words=(2,)) if found.evidence else "")
        + (f'<div class="figures">{drawn}</div>' if drawn else "")
    )


def _drawings(found: Judgement) -> Iterator[str]:
    for plot in found.plots:
        yield figure(figures.lines(plot.title, plot.x, plot.y, plot.lines, equal=plot.equal), plot.title)
