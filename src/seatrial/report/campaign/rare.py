"""Report of a search for a rare violation: its probability, the levels that led there, and a violation to look at."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...campaign import Criterion
from ...campaign.rare import Rare
from ..blocks import Body, entries, fields, figure, gallery, joined, lead, line, note, number, table, tiles
from ..canvas.frame import Frame
from ..figures import BLUE, VERMILION
from ..page import Page, Section
from .shown import Unit, valued, worded
from .shown import bound as bound_of

SCHEMA = "seatrial-campaign-rare-report/1"

_WIDTH, _HEIGHT, _POINTS = 460, 270, 40


def page(
    name: str, criterion: str, bound: Criterion, cases: Sequence[Rare], unit: str, folder: str,
    provenance: Mapping[str, str],
) -> Page:  # fmt: skip
    """The whole page.

    Args:
        unit: of the index that the criterion bounds, SI.
        folder: of the search, for the command that sails a violation again.
        provenance: campaign file, version and the like.
    """
    own = Unit.of(unit)
    edges = bound_of(bound, {bound.index: own})
    head = lead(f"{worded(bound.index)} {edges}; subset simulation, {sum(one.runs for one in cases)} runs.")
    parts = [
        Section("", head + tiles([_tile(one) for one in cases]) + note("Read with care", _warnings(cases))),
        Section("Levels", gallery(*(_curve(one, own) for one in cases)) + joined(_levels(one, own) for one in cases)),
        Section("A violation to look at", joined(_nearest(one, bound, own, folder) for one in cases)),
        Section("Provenance", entries(provenance)),
    ]
    numbers = {
        "schema": SCHEMA, "name": name, "criterion": criterion, "provenance": dict(provenance),
        "cases": [{"case": one.case, "probability": one.estimate.probability, "interval": one.estimate.interval,
                   "run": one.run, "nearest": dict(one.nearest), "distance": one.distance} for one in cases],
    }  # fmt: skip
    return Page(f"Rare violations of {worded(criterion)}: {name}", (Section("", fields(numbers)), *parts))


def _tile(one: Rare) -> tuple[str, str]:
    low, high = one.estimate.interval
    if not one.reached:
        return f"< {number(_product(one))}", f"{one.case}: the search ended before a tenth of a level was a violation"
    return number(one.estimate.probability), f"{one.case}: {number(low)} to {number(high)}, 95 %, {one.runs} runs"


def _product(one: Rare) -> float:
    return math.prod(level.share for level in one.levels[:-1])


def _warnings(cases: Sequence[Rare]) -> list[str]:
    return [f"{one.case}: {one.unknown:.1%} of the last level did not reach the index; they count as no violation."
            for one in cases if one.unknown]  # fmt: skip


def _curve(one: Rare, own: Unit) -> Body:
    """Probability to come as near to a violation as a margin, each level below the last."""
    margins: list[float] = []
    logs: list[float] = []
    before = 1.0
    for level in one.levels:
        known = np.sort(level.margins[np.isfinite(level.margins)])
        reach = len(known) if level is one.levels[0] else round(len(level.margins) * 0.98)
        for k in np.unique(np.linspace(0, min(reach, len(known)) - 1, _POINTS).astype(int)):
            if known[k] >= level.next_bound or level is one.levels[-1]:
                margins.append(float(known[k]) * own.factor)
                logs.append(math.log10(before * (k + 1) / len(level.margins)))
        before *= level.share
    order = np.argsort(margins)
    x, y = np.array(margins)[order], np.array(logs)[order]
    least = math.floor(min(logs))
    frame = Frame(_WIDTH, _HEIGHT, (float(x[0]), float(x[-1])), (least, 0.0), left=46, bottom=34)
    drawn = [frame.line(x.tolist(), y.tolist(), BLUE, width=1.8)]
    if x[0] < 0.0:
        drawn.append(frame.line([0.0, 0.0], [least, 0.0], VERMILION, width=1.5, dash="5 3"))
    svg = frame.svg(drawn, own.label("margin to the bound"), "log10 of the probability to be nearer")
    return figure(svg, f"{one.case}: how likely a run is to come so near; left of the dashed line it is a violation.")


def _levels(one: Rare, own: Unit) -> Body:
    rows = [[str(k), own.write(level.bound) if math.isfinite(level.bound) else "all", number(level.share),
             number(level.accepted) if k > 1 else ""] for k, level in enumerate(one.levels, 1)]  # fmt: skip
    return table([f"{one.case}: level", own.label("margin at most"), "share inside the next", "moves accepted"], rows)


def _nearest(one: Rare, bound: Criterion, own: Unit, folder: str) -> Body:
    if one.run is None:
        return line(f"{one.case}: none was found.")
    rows = [[name, number(given)] for name, given in one.nearest.items() if math.isfinite(given)]
    said = (f"{one.case}: of the violations of the last level this one is nearest to the middle of all inputs, "
            f"{number(one.distance)} standard deviations away, and so among the most likely ones: "
            f"{worded(bound.index)} {valued(one.nearest[bound.index], own)}.")  # fmt: skip
    command = f"seatrial simulate --from {folder} {one.run} -o run.csv"
    return line(f"{said} It is sailed again by", command=command) + table(["input, index", "SI"], rows)
