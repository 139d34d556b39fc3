"""Inverse of a matrix of information: the covariance of a fit, wide where nothing is known, and the steps it allows.

A direction that neither data nor priors curve has no variance of its own.  A pseudo-inverse gives it none, which reads
as certainty; here it is as wide as the parameters can be (`Vector.reach`).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...data import Array

# Least curvature of a direction, relative to that of its parameters one by one: what rounding leaves of none.
_FLAT = 1e-13
# Least share of a direction that a group leaves to the others: below it there is nothing to compare the group with.
_LEFT = 1e-2
# Least share of the variance that a combination has of its parts; below it is rounding.
_ROUND = 1e-12


def inverse(A: Array) -> Array:
    """Inverse of A over the directions that have curvature; a step along the others is zero."""
    root = _parts(A)[0]
    return root @ root.T


def covariance(A: Array, reach: Array, meat: Array | None = None) -> Array:
    """Covariance where the information is A: its inverse, plus the directions that it does not determine.

    Args:
        A: information, symmetric, shape (n, n).
        reach: how far each parameter may be off where nothing is known, shape (n,).
        meat: covariance of the scores (White 1980) where it is not A itself, shape (n, n).
    """
    root, flat = _parts(A)
    back = root @ root.T
    found = back if meat is None else back @ meat @ back
    if not flat.shape[1]:
        return found
    # A Gaussian as wide as the reach of each parameter, given what is determined.
    _, size, along = np.linalg.svd((flat / reach[:, None]).T, full_matrices=False)
    along = along[size > 1e-12 * size[0]] * reach
    return found + along.T @ along


def by_groups(A: Array, grams: Iterable[Array], scores: Iterable[Array]) -> tuple[Array, float]:
    """Covariance by the scatter of the scores of groups, which any correlation within a group leaves right.

    A fit bends towards each group, whose score is then too small by what it has bent; divided by the root of the share
    that is left it is right where the residuals are white (CR2 of Bell and McCaffrey 2002).  What no group informs, a
    prior, scatters by its own information.

    Args:
        A: information, symmetric, shape (n, n).
        grams, scores: information and derivatives of half the objective of each group, shapes (n, n) and (n,).

    Returns:
        The covariance, shape (n, n), and by how much the scores scatter more than white residuals of unit size would,
        as variances, over all directions together: a few groups know no direction by itself, all together they do.
    """
    root, _ = _parts(A)
    rest, meat, white = A.copy(), np.zeros((root.shape[1],) * 2), 0.0
    for gram, score in zip(grams, scores, strict=True):
        rest -= gram
        share, along = np.linalg.eigh(root.T @ gram @ root)
        own = (along / np.sqrt(np.maximum(1.0 - share, _LEFT))) @ (along.T @ (root.T @ score))
        meat += np.outer(own, own)
        white += float(share.sum())
    return root @ (meat + root.T @ rest @ root) @ root.T, float(np.trace(meat)) / max(white, 1e-300)


def weakened(A: Array, data: Array, factor: float) -> Array:
    """Covariance where data count by 1/factor: what they fix is wider, what they leave to priors as wide as these.

    Args:
        A: information, that of priors included, shape (n, n).
        data: part of it that is of the data, shape (n, n).
    """
    return inverse(A - (1.0 - 1.0 / factor) * data)


def larger(one: Array, other: Array) -> Array:
    """The covariance in which each combination has the larger variance of two, `one` without rounding, shape (n, n).

    Along the directions in which both are diagonal; to take the larger deviation of each parameter and keep the
    correlations would make combinations certain that neither knows well.
    """
    return _between(one, other, 1.0, np.inf)


def smaller(one: Array, other: Array) -> Array:
    """The same with the smaller variances."""
    return _between(one, other, 0.0, 1.0)


def _between(one: Array, other: Array, least: float, most: float) -> Array:
    """Covariance `other` with its variances over those of `one` within limits."""
    size = np.sqrt(np.diag(one))
    weight, vectors = np.linalg.eigh(one / np.outer(size, size))
    root = np.sqrt(np.maximum(weight, _ROUND * weight[-1]))
    into, back = (vectors / root).T / size, size[:, None] * vectors * root
    ratio, along = np.linalg.eigh(into @ other @ into.T)
    spread = back @ along * np.sqrt(np.clip(ratio, least, most))
    return spread @ spread.T


def _parts(A: Array) -> tuple[Array, Array]:
    """Root R of the inverse R R' over what has curvature, and directions without it as columns.

    Parameters of 1e-5 stand beside those of 300, so that each is measured by its own curvature.
    """
    curvature = np.diag(A)
    scale = np.where(curvature > 0, np.where(curvature > 0, curvature, 1.0) ** -0.5, 1.0)
    scaled = scale[:, None] * A * scale
    weight, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    known = weight > _FLAT
    return scale[:, None] * vectors[:, known] / np.sqrt(weight[known]), scale[:, None] * vectors[:, ~known]
