"""Manoeuvres: how the ship is steered, and what is read off the run, in one class.

A policy is a frozen dataclass whose numbers are declared with `spec` (so a campaign can vary them
lane by lane).  `command` is element-wise like physics and keeps its memory in a tuple that is
handed through, so ship + actuators + environment + policy compile into one step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Protocol

from ..data import Trial
from ..parameters import Scalar


@dataclass(frozen=True)
class Index:
    """One figure read off a run: value, unit, and for lengths the value in ship lengths."""

    value: float
    unit: str
    over_L: float | None = None


class Policy(Protocol):
    """Steers the ship, once per time step."""

    memory: ClassVar[tuple[str, ...]]
    """Names of what it remembers between steps."""

    def begin(self, state: tuple[Scalar, ...]) -> tuple[Scalar, ...]:
        """Memory at the execute point, from the initial (x, y, psi, u, v_m, r)."""
        ...

    def command(
        self, t: Scalar, state: tuple[Scalar, ...], memory: tuple[Scalar, ...]
    ) -> tuple[tuple[Scalar, ...], tuple[Scalar, ...]]:
        """Orders for the actuators (n_P [1/s], delta [rad]) and the memory of the next step."""
        ...


class Manoeuvre(Policy, Protocol):
    """A policy with a purpose: it knows when it is over and which figures it yields."""

    kind: ClassVar[str]

    def complete(self, trial: Trial) -> bool:
        """Whether the run holds all that the indices need."""
        ...

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Figures of the run by their standard names, SI units and radians."""
        ...
