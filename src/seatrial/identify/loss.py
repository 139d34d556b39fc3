"""How a prediction is held against a measurement, and what may differ from trial to trial."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase


@dataclass(frozen=True)
class Loss:
    """What a fit holds against a prediction.

    Attributes:
        sigma: scale of each compared channel by name, SI units; the residual is divided by it.
            Empty takes the standard deviation over the training trials.
        correlation: time over which the errors of a prediction are alike [s]; it says how many
            samples count as independent against the prior.  0 counts every sample.
        weights: how much the trials whose names fit a shell-style pattern count (the first that fits); others count 1.
    """

    sigma: Mapping[str, float] = field(default_factory=dict[str, float])
    correlation: float = 5.0
    weights: Mapping[str, float] = field(default_factory=dict[str, float])

    def weight(self, name: str) -> float:
        """How much the trial of this name counts."""
        return next((w for pattern, w in self.weights.items() if fnmatchcase(name, pattern)), 1.0)


@dataclass(frozen=True)
class Nuisance:
    """What differs from window to window or from trial to trial and is estimated along.

    Attributes:
        initial: standard deviation of the initial state's offset by channel; empty: as measured.  Infinite: free,
            the first reading counting as any other.
        current: standard deviation of a constant current per trial, each component [m/s]; 0: none.
        bias: standard deviation of a constant sensor bias per trial by channel; empty: none.
    """

    initial: Mapping[str, float] = field(default_factory=dict[str, float])
    current: float = 0.0
    bias: Mapping[str, float] = field(default_factory=dict[str, float])
