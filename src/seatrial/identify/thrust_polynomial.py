"""Least squares of a polynomial in the revolutions, and what levels that were left out say of its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..data import Array

# Variance over the mean square of the thrust below which a table is one of a formula.
_EXACT = 1e-20


def design(n: Array, powers: Sequence[int]) -> Array:
    """Powers of n, one a column."""
    return np.stack([n**k for k in powers], axis=-1)


def least_squares(n: Array, thrust: Array, powers: Sequence[int]) -> tuple[Array, Array]:
    """Coefficients and their covariance; revolutions scaled to 1, so that n^5 and n are of one size."""
    top = float(n.max())
    scale = top ** np.array(powers, dtype=np.float64)
    A = design(n / top, powers)
    c, *_ = np.linalg.lstsq(A, thrust, rcond=None)
    # Without an offset a row at rest is met by any coefficients: it tells nothing of the noise.
    rows = n.size if 0 in powers else int((n != 0).sum())
    spare = max(rows - len(powers), 1)
    noise = float(((thrust - A @ c) ** 2).sum()) / spare
    # A perfect table still has terms: their variance is tiny, not zero.
    covariance = max(noise, 1e-24 * float(thrust @ thrust)) * np.linalg.pinv(A.T @ A)
    return c / scale, covariance / np.outer(scale, scale)


def inflation(n: Array, thrust: Array, powers: tuple[int, ...]) -> float:
    """What the scatter about the map understates: few rows to tell it, and terms that the map lacks.

    Rows of one level share what the terms miss, so the mean of a level that was left out is off by more than
    scatter, over the root of the rows, would have it; few spare rows spread as Student's t does.
    """
    informative = n.size if 0 in powers else int((n != 0).sum())
    spare = informative - len(powers)
    c, _ = least_squares(n, thrust, powers)
    noise = float(((thrust - design(n, powers) @ c) ** 2).sum()) / max(spare, 1)
    if not noise > _EXACT * float(thrust @ thrust):
        return 1.0
    missed = [float(count * mean**2) for count, mean in _means_left_out(n, thrust, powers)]
    student = spare / (spare - 2) if spare > 2 else 3.0
    return student * max(1.0, float(np.mean(missed)) / noise)


def _means_left_out(n: Array, thrust: Array, powers: tuple[int, ...]) -> list[tuple[int, float]]:
    """Rows of each level but the greatest, and mean error of a map without them; rest counts where there is a term."""
    out: list[tuple[int, float]] = []
    for level in (x for x in np.unique(n) if x < n.max() and (x != 0 or 0 in powers)):
        gone = n == level
        c, _ = least_squares(n[~gone], thrust[~gone], powers)
        out.append((int(gone.sum()), float((thrust[gone] - design(n[gone], powers) @ c).mean())))
    return out


def left_out(n: Array, thrust: Array, powers: tuple[int, ...]) -> Array:
    """Squared error of each row whose level was left out of the fit; the greatest level never is."""
    levels = [level for level in np.unique(n) if level < n.max()]
    errors: list[Array] = []
    for level in levels:
        out = n == level
        c, _ = least_squares(n[~out], thrust[~out], powers)
        errors.append((thrust[out] - design(n[out], powers) @ c) ** 2)
    return np.concatenate(errors)
