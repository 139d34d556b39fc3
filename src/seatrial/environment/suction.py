"""Suction of a vertical wall on a ship that passes it, as if its mirror image passed on the other side.

Double body in potential flow, slender, rigid free surface; sections of a parabola of area A (1 - 4 x^2/L^2).  The
side force towards a wall at d from the centreline is rho U^2 (A/L)^2 phi(d/L, h/L), with

    phi = 64/pi (d/L) sum_k J(2 sqrt(d^2 + k^2 h^2)/L),   J(b) = 1/6 int_0^1 (1 - 3t + 2t^3) (t^2 + b^2)^(-3/2) dt,

k over the images in bottom and surface.  It has no yaw moment in a straight run, and the bottom, viscosity and the
waves of the ship are not in it: near the bottom it is low (docs/harbour.md).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Beyond so many lengths the closed form is all rounding; there its first term of the series.
_FAR = 20.0


def between(b: Array) -> Array:
    """J(b): the double integral of two straight slopes at distance b in lengths."""
    near = np.minimum(b, _FAR)
    R = np.sqrt(1.0 + near * near)
    closed = (1.0 / (near * near * R) - 3.0 * (1.0 / near - 1.0 / R) + 2.0 * (R + near * near / R - 2.0 * near)) / 6.0
    return np.where(b > _FAR, b**-5.0 / 48.0, closed)


def suction(d: Array, h: Array, L: float, images: int = 10) -> Array:
    """Phi at distances d [m] of a wall from the centreline in water of depth h [m] (infinite where deep)."""
    total = between(2.0 * d / L)
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(1, images + 1):
            total = total + 2.0 * np.where(np.isfinite(h), between(2.0 * np.sqrt(d * d + (k * h) ** 2) / L), 0.0)
    return 64.0 / math.pi * d / L * total
