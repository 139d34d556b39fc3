"""Section and numbers of the fitness of a model for a purpose (Sawada 2024 section 5)."""

from __future__ import annotations

import math
from typing import Any

from ...validate.fitness import FIT, NOT_FIT, SIZE, Fitness, Found, Limit
from .. import figures
from ..blocks import Body, bullets, figure, gallery, lead, number, soft, table
from ..page import Section

REMARK = (
    f"Found: {SIZE:g} times the root mean square error, so nine of ten errors are smaller where they are normal. "
    "Interval: of 95 %, by a studentised bootstrap over trials; of fewer than five trials its lower end only, by "
    "chi-squared. A limit is kept if the interval is below it, exceeded if the interval is above it; else it cannot be "
    "told. m: of the ship at full scale, so the errors of a model times its scale. L: its length; U: its approach "
    "speed; share: of what was measured."
)
"""What a figure of fitness, its interval and its units are."""
_OF = {"turn": "the change of heading", "position": "the place", "speed": "the speed ahead"}
_WHEN = {"low speed": "at low speed (F_n below 0.05)", "turning": "that turn by 10° or more",
         "large rudder angle": "with 20° of rudder or more", "propeller reversed": "with the propeller reversed",
         "under way": "above low speed (F_n of 0.05)"}  # fmt: skip
_MARK = {FIT: "✓ fit", NOT_FIT: "✗ not fit"}
_HEAD = ("error", "accepted", "found", "95 % interval", "unit", "trials", "errors", "verdict", "why")


def section(found: Fitness) -> Section:
    """The verdict, the table of limits with intervals, a drawing of both, and where the limits come from."""
    body = brief(found) + gallery(figure(_drawn(found), _CAPTION))
    left_out = [f"left out, used in the fit: {', '.join(found.left_out)}"] * bool(found.left_out)
    return Section("Fit for purpose", body + soft(REMARK) + bullets((*definitions(found), *left_out)))


def definitions(found: Fitness) -> list[str]:
    """What each figure is an error of, where, after how long, and where its limit comes from, a line each."""
    return [f"{one.key}: {one.about}; {_where(one, found.unit_time)}; at most {number(one.size)} {one.unit} "
            f"({'Sawada 2024 section ' * one.source[:1].isdigit()}{one.source})"
            for one in (some.limit for some in found.found)]  # fmt: skip


def _where(limit: Limit, unit_time: float) -> str:
    if limit.horizon:
        after = f"{limit.horizon:g} L/U ({limit.horizon * unit_time:.3g} s) after a start in the measured state"
        return f"error of {_OF.get(limit.of, limit.of)} {after}, in windows {_WHEN.get(limit.when, limit.when)}"
    if limit.of == "stopping":
        return "error of the way from the engine's order to a fifth of the speed"
    if limit.of == "overshoot":
        return "error of the highest heading of a leg, predicted from the reversal of the rudder on"
    return f"error of {limit.of.replace('_', ' ')} in a run of the whole manoeuvre"


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


def sized(one: Found) -> str:
    """What was found of a limit, with its interval and on what, in a phrase; empty where no trial shows it."""
    if not one.errors:
        return ""
    errors, trials = sum(map(len, one.errors.values())), len(one.errors)
    ends = [_sized(end) if math.isfinite(end) else "?" for end in (one.low, one.high)]
    span = f", 95 %: {ends[0]} to {ends[1]}" if ends != ["?", "?"] else ""
    return (f"{_sized(one.value)} {one.limit.unit} of {number(one.limit.size)} {one.limit.unit}{span}; "
            f"{errors} error{'s' * (errors != 1)} in {trials} trial{'s' * (trials != 1)}")  # fmt: skip


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
