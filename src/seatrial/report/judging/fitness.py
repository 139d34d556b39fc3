"""Section and numbers of the fitness of a model for a purpose (Sawada 2024 section 5)."""

from __future__ import annotations

import math
from typing import Any

from ...validate.fitness import FIT, NOT_FIT, SIZE, Fitness, Found
from .. import figures
from ..blocks import Body, bullets, figure, gallery, lead, number, soft, table
from ..page import Section

_MARK = {FIT: "✓ fit", NOT_FIT: "✗ not fit"}
_HEAD = ("error", "accepted", "found", "95 % interval", "unit", "trials", "errors", "verdict", "why")


def section(found: Fitness) -> Section:
    """The verdict, the table of limits with intervals, a drawing of both, and where the limits come from."""
    body = brief(found) + gallery(figure(_drawn(found), _CAPTION))
    remark = (
        f"Found: {SIZE:g} times the root mean square error, so nine of ten errors are smaller where they are normal. "
        "Interval: studentised bootstrap over trials. A limit is kept if the interval is below it, exceeded if the "
        "interval is above it; else it cannot be told. Errors of position, heading, speed and turn are those at the "
        "end of windows that start in the measured state."
    )
    sources = [f"{one.limit.key}: {number(one.limit.size)} {one.limit.unit}; Sawada 2024 section {one.limit.source}"
               if one.limit.source[:1].isdigit() else
               f"{one.limit.key}: {number(one.limit.size)} {one.limit.unit}; {one.limit.source}"
               for one in found.found]  # fmt: skip
    if found.left_out:
        sources.append(f"left out, used in the fit: {', '.join(found.left_out)}")
    return Section("Fit for purpose", body + soft(remark) + bullets(sources))


def brief(found: Fitness) -> Body:
    """The verdict and the limits."""
    return lead(f"For {found.title}: {found.verdict}.") + table(_HEAD, map(_row, found.found), words=(4, 7, 8))


def numbers(found: Fitness) -> dict[str, Any]:
    """The same for a JSON document; infinite errors are null, as everywhere."""
    return {
        "purpose": found.purpose, "verdict": found.verdict, "left_out": found.left_out,
        "limits": {one.limit.key: {
            "about": one.limit.about, "accepted": one.limit.size, "unit": one.limit.unit, "source": one.limit.source,
            "value": one.value, "low": one.low, "high": one.high, "verdict": one.verdict, "why": one.reason,
            "errors": dict(one.errors),
        } for one in found.found},
    }  # fmt: skip


_CAPTION = "Errors over what is accepted (dashed: 1), with their intervals; dots are single errors"


def _row(one: Found) -> list[str]:
    limit, errors = one.limit, sum(map(len, one.errors.values()))
    span = f"{_sized(one.low)} … {_sized(one.high)}" if one.errors else "–"
    return [f"{limit.key}: {limit.about}", number(limit.size), _sized(one.value), span, limit.unit,
            str(len(one.errors)), str(errors), _MARK.get(one.verdict, f"? {one.verdict}"), one.reason]  # fmt: skip


def _sized(value: float) -> str:
    return "∞" if math.isinf(value) else number(value)


def _drawn(found: Fitness) -> str:
    """A bar for the interval of each limit, in units of the limit, on a logarithmic axis."""
    drawn, (ax,) = figures.canvas(1, (7.0, 0.8 + 0.5 * len(found.found)))
    for k, one in enumerate(reversed(found.found)):
        single = [e / one.limit.size for some in one.errors.values() for e in some if 0.0 < e < math.inf]
        ax.plot(single, [k] * len(single), ".", color=figures.GREY, ms=3.0)
        if math.isfinite(one.low) and one.low > 0.0:
            ax.plot([one.low / one.limit.size, one.high / one.limit.size], [k, k], color=figures.BLUE, lw=4.0)
        if 0.0 < one.value < math.inf:
            ax.plot(one.value / one.limit.size, k, "o", color=figures.BLUE)
    ax.axvline(1.0, color=figures.GREY, lw=1.2, ls=figures.BASELINE[1])
    ax.set_xscale("log")
    ax.set_yticks(range(len(found.found)), [one.limit.key for one in reversed(found.found)])
    ax.set(xlabel="error over limit [-]", ylim=(-0.6, len(found.found) - 0.4))
    return figures.svg(drawn, "fit for purpose")
