"""A speed and the revolutions that hold it, given together: the uncertain numbers of a ship that meet both.

The numbers move as little as they can, each measured by its sigma: the most probable ones of independent normal
densities, given that thrust and resistance are equal.  What is least certain moves most, what is given not at all.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from ..core.constants import KNOT
from ..core.values import dataclass
from . import ShipError

FARTHEST = 2.0
"""Sigmas by which the numbers may move together; beyond, speed and revolutions are those of another ship."""

Surplus = Callable[[Mapping[str, float]], float]
"""Thrust over resistance, less one, of numbers moved by so many sigmas each."""

# Central difference in sigmas: truncation and rounding both below 1e-8; rounds stop where nothing moves any more.
_STEP, _CLOSE, _MOST = 1e-4, 1e-12, 50
# Revolutions sought over those of the file: any ship whose unit is right, and one with rpm for 1/s, lie between.
_LOW, _HIGH = 1e-3, 1e3


@dataclass(frozen=True)
class Agreement:
    """Numbers that meet a condition.

    Attributes:
        moves: of each number, over its sigma.
        left: sigma of each that remains, over that before.
    """

    moves: Mapping[str, float]
    left: Mapping[str, float]

    @property
    def distance(self) -> float:
        """How far the numbers moved together, in sigmas."""
        return math.hypot(*self.moves.values())


def agree(surplus: Surplus, names: tuple[str, ...]) -> Agreement | None:
    """The nearest moves at which nothing is left over; None where none are found.

    Newton's method on the condition along its gradient, beginning where nothing has moved.
    """
    z = np.zeros(len(names))
    for _ in range(_MOST):
        value, slope = _line(surplus, names, z)
        steep = float(slope @ slope)
        if not (math.isfinite(value) and steep > 0.0):
            return None
        there = (float(slope @ z) - value) / steep * slope
        done = float(np.abs(there - z).max()) < _CLOSE ** 0.5 and abs(value) < _CLOSE**0.5
        z = there
        if done:
            share = slope / math.sqrt(steep)
            left = np.sqrt(np.maximum(1.0 - share * share, 0.0))
            return Agreement(dict(zip(names, z.tolist(), strict=True)), dict(zip(names, left.tolist(), strict=True)))
        if float(np.linalg.norm(z)) > 10.0 * FARTHEST:
            return None
    return None


def _line(surplus: Surplus, names: tuple[str, ...], z: np.ndarray) -> tuple[float, np.ndarray]:
    """Value and slopes at z."""

    def at(moved: np.ndarray) -> float:
        return surplus(dict(zip(names, moved.tolist(), strict=True)))

    steps = _STEP * np.eye(len(names))
    return at(z), np.array([(at(z + h) - at(z - h)) / (2.0 * _STEP) for h in steps])


def revolutions(surplus: Callable[[float], float], n_P: float) -> float | None:
    """Revolutions [1/s] that hold the speed, by bisection about given ones; None where none within a factor 1000 do."""
    low, high = _LOW * n_P, _HIGH * n_P
    if surplus(low) > 0.0 or surplus(high) < 0.0:
        return None
    while high / low > 1.0 + 1e-6:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if surplus(middle) < 0.0 else (low, middle)
    return math.sqrt(low * high)


def refuse(where: str, U: float, n_P: float, holding: float | None, found: Agreement | None) -> None:
    """Refuse speed and revolutions that no ship near the estimate has together."""
    if found is not None and found.distance <= FARTHEST:
        return
    holds = "none hold that speed" if holding is None else f"{60.0 * holding:.4g} rpm hold it"
    far = "out of reach of" if found is None else f"{found.distance:.2g} sigma away from"
    raise ShipError(
        f"{where}: {U / KNOT:.4g} kn at {60.0 * n_P:.4g} rpm: {holds} by resistance, wake and propeller as "
        f"estimated, and the given ones are {far} that ({FARTHEST:g} are allowed); n_P is that of the shaft, not of "
        "the engine, and belongs to `speed`, `D_P` and `pitch_ratio`: correct one, or leave n_P out"
    )
