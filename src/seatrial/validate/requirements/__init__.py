"""What a simulator for autonomous ships must do (Sawada et al. 2024, section 6), as executable checks.

`judge(ship, scope)` runs the ship through the items of a scope and gives a `Table`: for each item pass,
fail or not applicable, why, the figures that show it and what to draw.  A check looks only at what the
ship does, never at the name of its family.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from ...data import Array

if TYPE_CHECKING:
    from .probe import Probe

Verdict = Literal["pass", "fail", "not applicable"]


@dataclass(frozen=True)
class Plot:
    """One drawing: lines (label, x, y) over named axes; `equal` for tracks."""

    title: str
    x: str
    y: str
    lines: tuple[tuple[str, Array, Array], ...]
    equal: bool = False


@dataclass(frozen=True)
class Judgement:
    """What became of one item.

    Attributes:
        reason: why, in one sentence; of a failure, which physics is missing.
        evidence: the figures it rests on: value and unit by what it is.
    """

    verdict: Verdict
    reason: str
    evidence: Mapping[str, tuple[float, str]] = field(default_factory=dict[str, tuple[float, str]])
    plots: tuple[Plot, ...] = ()


@dataclass(frozen=True)
class Item:
    """One requirement in our words, and how it is checked."""

    number: str
    text: str
    check: Callable[[Probe], Judgement]


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


def given(holds: bool, good: str, bad: str, evidence: Mapping[str, tuple[float, str]], *plots: Plot) -> Judgement:
    """Pass or fail, each with its reason."""
    return Judgement("pass" if holds else "fail", good if holds else bad, evidence, plots)
