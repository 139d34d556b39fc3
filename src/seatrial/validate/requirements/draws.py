"""The items of a scope judged by draws of a fitted ship: which verdicts stand whatever the fit leaves open."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...engine import SimulationError
from ...ships import Ship, ShipError
from . import Drawn, Finding, Item, Judgement, Table
from .probe import Probe
from .scopes import CHECKED_ONCE, checked

_MET = ("pass", "doubt")
_TRIED = (*_MET, "fail")


def judged_by(table: Table, ships: Iterable[Ship], level: float) -> Table:
    """The same table with verdicts of draws; items of the computation or of an interface keep theirs.

    A verdict stands where at most half of what lies outside a band of `level` (0 to 1) says otherwise; between the
    two an item is undecided.  A draw that cannot be examined fails every item.
    """
    motion = [item for item, found in table.rows if item.check not in CHECKED_ONCE and found.verdict in _TRIED]
    by_item: dict[str, list[Judgement]] = defaultdict(list)
    for ship in ships:
        for item, found in zip(motion, _examined(ship, motion), strict=True):
            by_item[item.number].append(found)
    rows = ((item, _together(found, by_item[item.number], level) if item.number in by_item else found)
            for item, found in table.rows)  # fmt: skip
    return replace(table, rows=tuple(rows))


def _examined(ship: Ship, items: Sequence[Item]) -> Iterator[Judgement]:
    try:
        probe = replace(Probe.of(ship), searches=False)  # a fit has no slips, and reasons of draws are counted
    except (ShipError, SimulationError) as error:
        yield from (Judgement("fail", str(error)) for _ in items)
        return
    for item in items:
        yield checked(item, probe)


def _together(fitted: Judgement, draws: Sequence[Judgement], level: float) -> Judgement:
    """The judgement of the fitted ship with the verdict of the draws and the bands of what was measured."""
    met = sum(one.verdict in _MET for one in draws) / len(draws)
    tail = 0.5 * (1.0 - level)
    verdict = "pass" if met >= 1.0 - tail else "fail" if met <= tail else "undecided"
    why = Counter(one.reason for one in draws if one.verdict not in _MET).most_common(1)
    reason = fitted.reason
    if why and fitted.verdict == "pass":
        reason = f"met by {met:.3g} of the draws; else: {why[0][0]}"
    elif met > 0.0 and fitted.verdict != "pass":
        reason = f"met by {met:.3g} of the draws; of the fitted numbers: {fitted.reason}"
    bands = {what: _edges(values, level) for what, values in _measured(fitted, draws)}
    return replace(fitted, verdict=verdict, reason=reason, drawn=Drawn(met, len(draws), bands))


def _measured(fitted: Judgement, draws: Sequence[Judgement]) -> Iterator[tuple[str, list[float]]]:
    """Each finding of the fitted ship and what the draws give for it; a worst point may lie elsewhere in each draw."""
    each = [_values(one.findings) for one in draws]
    for what, stem in _stems(fitted.findings):
        yield what.what, [one[stem] for one in each if stem in one]


def _values(findings: Sequence[Finding]) -> dict[tuple[str, int], float]:
    return {stem: one.value for one, stem in _stems(findings)}


def _stems(findings: Sequence[Finding]) -> Iterator[tuple[Finding, tuple[str, int]]]:
    """Findings by their words before the place in brackets, and the number of such ones before them."""
    seen: Counter[str] = Counter()
    for one in findings:
        stem = one.what.partition(" (")[0]
        yield one, (stem, seen[stem])
        seen[stem] += 1


def _edges(values: Sequence[float], level: float) -> tuple[float, float]:
    finite = [value for value in values if math.isfinite(value)]
    if len(finite) < max(level * len(values), 1):
        return math.nan, math.nan
    low, high = np.quantile(finite, (0.5 * (1.0 - level), 0.5 * (1.0 + level)))
    return float(low), float(high)
