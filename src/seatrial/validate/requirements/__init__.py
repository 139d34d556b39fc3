"""What a simulator for autonomous ships must do (Sawada et al. 2024, section 6), as executable checks.

`judge(ship, scope)` runs the ship through the items of a scope and gives a `Table`: for each item pass,
fail or not applicable, why, the figures that show it and what to draw.  A check looks only at what the
ship does, never at the name of its family.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Literal

from ...core.values import dataclass, field
from ...data import Array
from ...ships import Ship
from .thresholds import Bound, Range

if TYPE_CHECKING:
    from .probe import Probe

Verdict = Literal["pass", "doubt", "fail", "undecided", "not applicable", "not judged"]

_SAID = 3


@dataclass(frozen=True)
class Plot:
    """One drawing: lines (label, x, y) over named axes; `equal` for tracks."""

    title: str
    x: str
    y: str
    lines: tuple[tuple[str, Array, Array], ...]
    equal: bool = False


@dataclass(frozen=True)
class Finding:
    """One measured value and the bound it is held against.

    Attributes:
        what: the quantity and where it was measured; of many points, the worst.
        bound: None where the value is shown only.
        wrong: the physics that is wrong or missing where the bound does not hold.
        doubt: whether a value beyond the bound is unusual only, which some ships are.
    """

    what: str
    value: float
    unit: str = "-"
    bound: Bound | None = None
    wrong: str = ""
    doubt: bool = False

    @property
    def holds(self) -> bool:
        """Whether the value lies within its bound."""
        return self.bound is None or self.bound.holds(self.value)


@dataclass(frozen=True)
class Drawn:
    """What draws of a fitted ship make of one item.

    Attributes:
        met: share of the draws that pass it.
        draws: their number.
        bands: lower and upper edge by what was measured; NaN where too few draws give it.
    """

    met: float
    draws: int
    bands: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Judgement:
    """What became of one item.

    Attributes:
        verdict: "doubt" where a value is unusual and none impossible; "undecided" where draws of a fitted ship differ
            about it.
        reason: why, in one sentence; of a failure, which physics is wrong or missing.
        findings: the measured values it rests on, each with its bound.
        drawn: what draws make of it; None where none were made.
    """

    verdict: Verdict
    reason: str
    findings: tuple[Finding, ...] = ()
    plots: tuple[Plot, ...] = ()
    drawn: Drawn | None = None

    @property
    def evidence(self) -> Mapping[str, tuple[float, str]]:
        """Value and unit by what was measured."""
        return {one.what: (one.value, one.unit) for one in self.findings}


@dataclass(frozen=True)
class Item:
    """One requirement in our words, and how it is checked."""

    number: str
    text: str
    check: Callable[[Probe], Judgement]


Elsewhere = Mapping[str, Callable[[Ship], Judgement]]
"""Checks of rooms that this one may not import, by the number of the item."""


@dataclass(frozen=True)
class Table:
    """The items of a scope, judged for one ship, and under which conditions."""

    ship: str
    scope: str
    rows: tuple[tuple[Item, Judgement], ...]
    conditions: Mapping[str, str] = field(default_factory=dict[str, str])

    def count(self, verdict: Verdict) -> int:
        """How many items have this verdict."""
        return sum(judgement.verdict == verdict for _, judgement in self.rows)

    @property
    def failed(self) -> tuple[str, ...]:
        """Numbers of the items that failed."""
        return tuple(item.number for item, judgement in self.rows if judgement.verdict == "fail")


def judged(good: str, findings: Iterable[Finding], *plots: Plot) -> Judgement:
    """Pass with the reason `good` if every bound holds; else doubt, or fail, with what is unusual or wrong."""
    found = tuple(findings)
    if not any(one.bound for one in found):
        raise ValueError("an item without a bound cannot fail")
    wrong = [*dict.fromkeys(one.wrong for one in found if not (one.holds or one.doubt))]
    unusual = [*dict.fromkeys(one.wrong for one in found if one.doubt and not one.holds)]
    told = wrong or unusual
    more = f"; and {len(told) - _SAID} more" if len(told) > _SAID else ""
    reason = "; ".join(told[:_SAID]) + more if told else good
    return Judgement("fail" if wrong else "doubt" if unusual else "pass", reason, found, plots)


def not_applicable(what: str, why: str) -> Finding:
    """A quantity that the ship does not have, shown with the reason and held against nothing."""
    return Finding(f"{what}: not applicable, {why}", math.nan)


def worst(
    what: str, points: Iterable[tuple[str, float]], bound: Bound, wrong: str, unit: str = "-"
) -> Finding:  # fmt: skip
    """The point that is furthest out of a bound, or nearest to its end; `{at}` in the texts is where that is."""

    def room(point: tuple[str, float]) -> float:
        value = point[1]
        if not math.isfinite(value):
            return -math.inf
        return min(value - bound.low, bound.high - value)

    at, value = min(points, key=room)
    return Finding(f"{what} ({at})" if at else what, value, unit, bound, wrong.format(at=at))


def ranged(what: str, value: float, unit: str, known: Range, wrong: str) -> Iterator[Finding]:
    """A value against the range of ships: beyond it a doubt, far beyond a failure; always shown."""
    said = f"{wrong} ({what} {value:.3g}, ships {known.usual})"
    far = not known.far.holds(value)
    yield Finding(what, value, unit, known.far if far else known.usual, said, doubt=not far)
