"""Inverse of a matrix of information: the covariance of a fit, wide where nothing is known, and the steps it allows.

A direction that neither data nor priors curve has no variance of its own.  A pseudo-inverse gives it none, which reads
as certainty; here it is as wide as the parameters can be (`Vector.reach`).
"""

from __future__ import annotations

import numpy as np

from ...data import Array

# Least curvature of a direction, relative to that of its parameters one by one: what rounding leaves of none.
_FLAT = 1e-13


def inverse(A: Array) -> Array:
    """Inverse of A over the directions that have curvature; a step along the others is zero."""
    return _parts(A)[0]


def covariance(A: Array, reach: Array, meat: Array | None = None) -> Array:
    """Covariance where the information is A: its inverse, plus the directions that it does not determine.

    Args:
        A: information, symmetric, shape (n, n).
        reach: how far each parameter may be off where nothing is known, shape (n,).
        meat: covariance of the scores (White 1980) where it is not A itself, shape (n, n).
    """
    back, flat = _parts(A)
    found = back if meat is None else back @ meat @ back
    if not flat.shape[1]:
        return found
    # A Gaussian as wide as the reach of each parameter, given what is determined.
    _, size, along = np.linalg.svd((flat / reach[:, None]).T, full_matrices=False)
    along = along[size > 1e-12 * size[0]] * reach
    return found + along.T @ along


def _parts(A: Array) -> tuple[Array, Array]:
    """Inverse over what has curvature, and directions without it as columns.

    Parameters of 1e-5 stand beside those of 300, so that each is measured by its own curvature.
    """
    curvature = np.diag(A)
    scale = np.where(curvature > 0, np.where(curvature > 0, curvature, 1.0) ** -0.5, 1.0)
    scaled = scale[:, None] * A * scale
    weight, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    known = weight > _FLAT
    kept = scale[:, None] * vectors[:, known]
    return (kept / weight[known]) @ kept.T, scale[:, None] * vectors[:, ~known]
