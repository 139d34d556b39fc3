"""Numbers of a campaign as people read them: angles in degrees, probabilities with intervals, bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ...campaign import Criterion
from ...campaign.analysis import Judged
from ...campaign.analysis.proportion import Proportion
from ...core.values import dataclass
from ..blocks import number

_DEGREES = math.degrees(1.0)


@dataclass(frozen=True)
class Unit:
    """How a quantity is written: unit to print, and factor from SI."""

    name: str = ""
    factor: float = 1.0

    @staticmethod
    def of(si: str) -> Unit:
        """Angles in degrees, all else as it is."""
        if si.startswith("rad"):
            return Unit("°" + si[3:], _DEGREES)
        return Unit("" if si == "-" else si)

    def write(self, value: float, digits: int = 4) -> str:
        """A number without its unit."""
        return number(value * self.factor, digits)

    def label(self, name: str) -> str:
        """A name with the unit in brackets."""
        return f"{worded(name)} [{self.name}]" if self.name else worded(name)


Units = Mapping[str, Unit]


def worded(name: str) -> str:
    """The name of an index in words."""
    return name.replace("_", " ")


def unit(units: Units, name: str) -> Unit:
    """Unit of an index; SI without a name where it is unknown."""
    return units.get(name, Unit())


def share(one: Proportion) -> str:
    """A probability with its interval."""
    low, high = one.interval
    return f"{number(one.value)} ({number(low)} to {number(high)})"


def bound(one: Judged | Criterion, units: Units) -> str:
    """What a criterion asks for."""
    own = unit(units, one.index)
    parts = [f"{sign} {own.write(edge)}{_gap(own)}" for sign, edge in (("≥", one.low), ("≤", one.high))
             if math.isfinite(edge)]  # fmt: skip
    return " and ".join(parts)


def _gap(own: Unit) -> str:
    return own.name if own.name.startswith("°") or not own.name else f" {own.name}"


def valued(value: float, own: Unit) -> str:
    """A number with its unit."""
    return f"{own.write(value)}{_gap(own)}"
