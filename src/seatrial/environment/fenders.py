"""Fenders: the reaction of each over its deflection; what it stores is the integral, never a second table.

Published curves give energy and reaction both, and the two differ by up to three percent: the reaction is taken.  The
falling branch of a cone (35 to 60 percent) is kept: stiffness is negative there, so two fenders share unevenly.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from types import MappingProxyType

from ..core.errors import ChartError
from ..core.parameters import Scalar
from ..core.symbolic import larger
from ..core.values import dataclass


@dataclass(frozen=True)
class Curve:
    """Reaction over rated reaction, linear between given deflections over the height.

    Beyond the last deflection it goes on along the last branch, which must rise: steel on concrete, never a constant.

    Attributes:
        deflections: rising, from 0.
        reactions: 0 at first, never below.
        rated: deflection at which the energy is rated.

    Raises:
        ChartError: a curve that is not one.
    """

    deflections: tuple[float, ...]
    reactions: tuple[float, ...]
    rated: float = 1.0

    def __post_init__(self) -> None:
        s, R = self.deflections, self.reactions
        if len(s) != len(R) or len(s) < 2 or s[0] != 0.0 or R[0] != 0.0:
            raise ChartError("a fender curve: give as many reactions as deflections, from 0 and 0 on")
        for (a, b), (low, high) in zip(pairwise(s), pairwise(R), strict=True):
            if not b > a:
                raise ChartError(f"a fender curve falls: deflection {b:g} after {a:g}; deflections rise")
            if not high > 0.0:
                raise ChartError(f"a fender curve falls to {high:g} at deflection {b:g}; a fender never pulls")
            if b == s[-1] and not high > low:
                raise ChartError(
                    f"a fender curve falls at its end, from {low:g} to {high:g}; it ends in a stop that rises"
                )

    @property
    def _hinges(self) -> tuple[tuple[float, float], ...]:
        """Where the stiffness changes, and by how much."""
        slopes = [(high - low) / (b - a) for (a, b), (low, high)
                  in zip(pairwise(self.deflections), pairwise(self.reactions), strict=True)]  # fmt: skip
        changes = [slopes[0], *(after - before for before, after in pairwise(slopes))]
        return tuple((s, k) for s, k in zip(self.deflections, changes, strict=False) if k)

    def both(self, s: Scalar) -> tuple[Scalar, Scalar]:
        """Reaction over rated reaction, and energy over rated reaction times height, at a deflection over height."""
        force: Scalar = 0.0
        twice: Scalar = 0.0
        for at, k in self._hinges:
            beyond = larger(s - at, 0.0)
            more = k * beyond
            force, twice = force + more, twice + more * beyond
        return force, 0.5 * twice

    @property
    def stiffest(self) -> float:
        """Largest slope of the reaction."""
        return max((high - low) / (b - a) for (a, b), (low, high)
                   in zip(pairwise(self.deflections), pairwise(self.reactions), strict=True))  # fmt: skip


def _percent(rated: float, deflections: str, reactions: str) -> Curve:
    return Curve(tuple(float(x) / 100.0 for x in deflections.split()),
                 tuple(float(x) / 100.0 for x in reactions.split()), rated)  # fmt: skip


CURVES: Mapping[str, Curve] = MappingProxyType({
    # a maker's page of a cone rated at 70 percent
    "cone": _percent(0.70, "0 5 10 15 20 25 30 35 40 45 50 55 60 65 70 72 73 74",
                     "0 27 48 65 79 90 97 100 99 93 84 73 68 76 100 132 148 165"),
    # a cone rated at 72 percent, from a public code
    "cone72": _percent(0.72, "0 5 10 15 20 25 30 35 40 45 50 55 60 65 70 72 75",
                       "0 20 39 58 76 90 98 100 98 94 90 88 88 90 96 100 110"),
    # a unit element rated at 57.5 percent, from a public code
    "element": _percent(0.575, "0 5 10 15 20 25 30 35 40 45 50 55 57.5 62.5",
                        "0 23 47 69 87 97 100 97 90 85 84 92 100 121"),
    # a spring, for tests and for walls
    "linear": Curve((0.0, 1.0), (0.0, 1.0), 1.0),
})  # fmt: skip
"""Generic performance curves by name."""


@dataclass(frozen=True)
class Fender:
    """A kind of fender along a quay.

    Attributes:
        curve: its reaction over its deflection.
        height: from its base to its face [m].
        reaction: rated reaction [N].
        spacing: distance between neighbours along the quay [m].
        mu: friction of its face; .2 for the usual polyethylene (from memory).
        chi: share of the reaction lost per speed of compression [s/m] (Hunt and Crossley), 0 to 1 over design speed.
    """

    curve: Curve
    height: float
    reaction: float
    spacing: float
    mu: float = 0.2
    chi: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name != "curve" and not (0.0 <= value < 1e12 and (value > 0.0 or name in ("mu", "chi"))):
                raise ChartError(f"a fender's {name} is {value:g}; it is above zero")

    @property
    def energy(self) -> float:
        """What it takes up to its rated deflection [J]."""
        return float(self.curve.both(self.curve.rated)[1]) * self.reaction * self.height
