"""Waiting for a steady turn, as a policy does it: from one window of time to the next."""

from __future__ import annotations

from ..core.parameters import Scalar, Scalars
from ..core.symbolic import magnitude, where

MEMORY = ("since", "level", "calm")
"""Start of the window [s], yaw rate there [rad/s], windows in a row in which it hardly changed."""

WINDOW, TOLERANCE = 2.0, 1e-4
"""Usual window in L/U and usual change of r L/U over it.

What is left to come may be ten times that: in a turn the speed settles slowly, and the yaw rate with it.
"""

# One window alone may lie across the peak of an overshoot.
_CALM = 2


def waited(t: Scalar, r: Scalar, memory: Scalars, window: Scalar, tolerance: Scalar) -> tuple[Scalar, Scalars]:
    """Whether the yaw rate has become steady, and the memory of the next step.

    It is when `r` [rad/s] has changed by `tolerance` or less over each of two windows of `window`
    seconds.  A new order then begins a new wait: the count starts again by itself.
    """
    since, level, calm = memory
    over = t - since >= window * (1.0 - 1e-9)
    count = where(magnitude(r - level) <= tolerance, calm + 1.0, 0.0)
    calm = where(over, count, calm)
    steady = calm >= _CALM
    return steady, (where(over, t, since), where(over, r, level), where(steady, 0.0, calm))
