"""Damped Newton steps within bounds, of many problems at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..data import Array

Mask = NDArray[np.bool_]


def steps(H: Array, g: Array, low: Array, high: Array, moving: Mask, damping: Array) -> tuple[Array, Array]:
    """Damped Newton steps to the best point of each quadratic within bounds, and the decrease each promises.

    The active set is found by exchanging whatever violates its bound or its multiplier, all at once at
    first (Judice and Pires 1994), one by one where that does not settle.

    Args:
        H, g: shapes (problems, free, free) and (problems, free).
        low, high: bounds relative to where each problem stands, shape (problems, free).
        moving: what may move at all, shape (problems, free).
        damping: shape (problems,).
    """
    n = g.shape[1]
    d = np.sqrt(np.maximum(np.diagonal(H, axis1=1, axis2=2), 0.0))
    d = np.where(d > 0, d, 1.0)
    A = H / (d[:, :, None] * d[:, None, :]) + damping[:, None, None] * np.eye(n)
    b, low, high = g / d, low * d, high * d
    at, z = np.zeros(g.shape), np.zeros(g.shape)
    for turn in range(6 * n):
        z = _solved(A, b, np.where(moving, np.where(at < 0, low, high), 0.0), moving & (at == 0))
        slope = b + (A @ z[:, :, None])[:, :, 0]
        wanted = np.where(at == 0, np.where(z < low, -1.0, np.where(z > high, 1.0, 0.0)),
                          np.where(at * slope > 0, 0.0, at))  # fmt: skip
        wrong = moving & (wanted != at)
        if not wrong.any():
            break
        if turn >= n:
            wrong &= np.cumsum(wrong, axis=1) == 1
        at = np.where(wrong, wanted, at)
    step = np.clip(z, low, high) / d
    return step, -(2.0 * (g * step).sum(axis=1) + np.einsum("si,sij,sj->s", step, H, step))


def _solved(A: Array, b: Array, fixed: Array, moving: Mask) -> Array:
    """Minimum over what moves, the others at their `fixed` values."""
    fixed = np.where(moving, 0.0, fixed)
    rest = np.where(moving, 0.0, 1.0)[:, :, None] * np.eye(b.shape[1])
    K = np.where(moving[:, :, None] & moving[:, None, :], A, rest)
    right = np.where(moving, -(b + (A @ fixed[:, :, None])[:, :, 0]), fixed)
    solved: Array = np.linalg.solve(K, right[:, :, None])
    return solved[:, :, 0]
