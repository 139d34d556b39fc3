"""Page and numbers of the requirements of a scope (Sawada 2024, section 6), judged for a ship."""

from __future__ import annotations

import math

from ...core.version import __version__
from ...validate.requirements import Drawn, Finding, Item, Judgement, Table
from .. import figures
from ..blocks import Body, Verdict, entries, fields, figure, gallery, lead, number, soft, table
from ..page import Page, Section

_MARK = {"pass": "✓ pass", "doubt": "! doubt", "fail": "✗ fail", "undecided": "? undecided",
         "not applicable": "– not applicable", "not judged": "– not judged"}  # fmt: skip
_SOURCES = {
    "collision-avoidance": "Sawada et al. 2024, section 6.2: heading control for collision avoidance",
    "berthing": "Sawada et al. 2024, section 6.2: berthing",
    "functional": "Sawada et al. 2024, section 6.1: the list of IEC 62065, and the non-functional items of section 6.2",
}


def verdict(found: Table) -> str:
    """The outcome in one line."""
    passed, failed, aside, open_ = (found.count(v) for v in ("pass", "fail", "not applicable", "not judged"))
    words = f"{passed} of {len(found.rows)} items pass"
    words += f", {failed} fail ({', '.join(found.failed)})" if failed else ""
    doubted = [item.number for item, j in found.rows if j.verdict == "doubt"]
    words += f", {len(doubted)} in doubt ({', '.join(doubted)})" if doubted else ""
    unsure = [item.number for item, j in found.rows if j.verdict == "undecided"]
    words += f", {len(unsure)} undecided ({', '.join(unsure)})" if unsure else ""
    words += f", {aside} not applicable" if aside else ""
    return words + (f", {open_} not judged" if open_ else "")


def page(found: Table) -> Page:
    """The table first, then each item with its values and figures, then the conditions."""
    conditions = {
        **found.conditions, "thresholds": "src/seatrial/validate/requirements/thresholds.py", "version": __version__,
        "command": f"seatrial requirements {found.ship} --scope {found.scope}",
    }  # fmt: skip
    items = (_item(item, judgement) for item, judgement in found.rows)
    title = f"{found.ship}: requirements, {found.scope}"
    return Page(title, (Section("", brief(found)), *items, Section("Conditions", entries(conditions))))


def brief(found: Table) -> Body:
    """The verdict and the table of items."""
    rows = ((item.number, item.text, _MARK[j.verdict], j.reason) for item, j in found.rows)
    source = (f"{_SOURCES[found.scope]}. Each item is judged by what the ship does in simulation; "
              "agreement with a real ship is another matter (seatrial validate).")  # fmt: skip
    head = lead(f"{found.ship}, {found.scope}: {verdict(found)}") + soft(source)
    judged = table(("item", "requirement", "verdict", "why"), rows, words=(1, 2, 3), wide=True)
    return fields(numbers(found), head + judged)


def numbers(found: Table) -> dict[str, object]:
    """The table as JSON has it."""
    return {
        "ship": found.ship, "scope": found.scope, "verdict": verdict(found), "failed": list(found.failed),
        "items": [
            {"item": item.number, "requirement": item.text, "verdict": j.verdict, "reason": j.reason,
             "evidence": {one.what: _finding(one, j.drawn) for one in j.findings},
             **({"met": j.drawn.met, "draws": j.drawn.draws} if j.drawn else {})}
            for item, j in found.rows
        ],
    }  # fmt: skip


def _finding(one: Finding, drawn: Drawn | None) -> dict[str, object]:
    low, high = _band(one, drawn)
    band = {} if math.isnan(low) else {"band": {"low": low, "high": high}}
    if one.bound is None:
        return {"value": one.value, "unit": one.unit, **band}
    bound = {"low": one.bound.low, "high": one.bound.high, "holds": one.holds, "why": one.bound.why}
    return {"value": one.value, "unit": one.unit, **band, **bound, **({} if one.holds else {"wrong": one.wrong})}


def _band(one: Finding, drawn: Drawn | None) -> tuple[float, float]:
    return drawn.bands.get(one.what, (math.nan, math.nan)) if drawn else (math.nan, math.nan)


def _row(one: Finding, drawn: Drawn | None) -> tuple[str, ...]:
    low, high = _band(one, drawn)
    value = number(one.value, 4) + ("" if math.isnan(low) else f" ({number(low, 3)} to {number(high, 3)})")
    value += f" {one.unit}" if one.unit != "-" else ""
    if one.bound is None:
        return one.what, value, "", "", ""
    return one.what, value, str(one.bound), "✓ holds" if one.holds else f"✗ {one.wrong}", one.bound.why


def _item(item: Item, found: Judgement) -> Section:
    drawn = (figure(figures.lines(plot.title, plot.x, plot.y, plot.lines, equal=plot.equal), plot.title)
             for plot in found.plots)  # fmt: skip
    body: Body = (Verdict(_MARK[found.verdict], found.reason),)
    if found.findings:
        value = "value" if found.drawn is None else "value (band)"
        head = ("measured; of many points, the worst", value, "threshold", "verdict", "because")
        rows = (_row(one, found.drawn) for one in found.findings)
        body += table(head, rows, words=(0, 2, 3, 4), wide=True)
    return Section(f"{item.number}. {item.text}", body + gallery(*drawn))
