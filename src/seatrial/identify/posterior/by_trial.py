"""Score tests of errors of instruments that differ from trial to trial, or that one trial has alone.

A current that turns with the tide, a compass whose error depends on the heading or an indicator that was adjusted in
mid-day may cancel over all trials: as one number for all they hardly show.  Here each suspect is one number per trial,
eliminated together with the parameters (as in `diagnose`, Rao 1948), and preferred to one number for all where the
objective falls by more than the further numbers cost by Schwarz's criterion, and by more than twice as much.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...data import Array
from .contradiction import deviates
from .diagnosis import MOVES, REMOVES, SIGNIFICANT, Differing, Suspicion

# An error by trial is told where it removes more than so many times what the same error of all trials removes.
_TWICE = 2.0
# One trial alone has it where that explains this share of what a number for each explains: a large error is not linear.
_ALONE = 0.8
# Least curvature by which the numbers of all trials differ from the parameters, relative to that of each.
_FLAT = 1e-6


@dataclass(frozen=True)
class Moments:
    """Products of the weighted derivatives by parameters (n) and suspects (k), trial by trial.

    Attributes:
        names: of the trials.
        gram: shape (trials, n + k, n + k).
        scatter: covariance of the slopes by noise, same shape.
        slope: derivatives of half the objective, shape (trials, n + k).
        back: covariance of the parameters for unit residuals, shape (n, n).
        cost: sum of squares.
        rows: number of residuals.
    """

    names: Sequence[str]
    gram: Array
    scatter: Array
    slope: Array
    back: Array
    cost: float
    rows: int


def differing(
    moments: Moments, tested: Sequence[Suspicion], order: Sequence[str], paths: Sequence[str], sigma: Array
) -> tuple[Differing, ...]:
    """Errors that differ between trials by more than chance, where that explains more than one number for all.

    Args:
        tested: the suspects as one number for all trials.
        order: their names in the order of the columns of `moments`.
        paths, sigma: free parameters, the first of the n, and the sigma of all n.
    """
    found = [one for one in (_differing(moments, s, order.index(s.name), paths, sigma) for s in tested) if one]
    return tuple(sorted(found, key=lambda one: one.numbers * math.log(moments.rows) - one.drop))


@dataclass(frozen=True)
class _Numbers:
    """One error as a number for each trial: estimate and sigma, slope and its scatter, curvature, parameters by it."""

    size: Array
    spread: Array
    slope: Array
    scatter: Array
    curvature: Array
    follow: Array


def _numbers(moments: Moments, at: int) -> _Numbers | None:
    """The numbers of the suspect in column `at`; None where no data tell them all apart from the parameters."""
    n, own = len(moments.back), moments.gram[:, at, at]
    if not own.all():
        return None
    cross = moments.gram[:, :n, at].T
    follow = moments.back @ cross
    M = np.diag(own) - cross.T @ follow
    if np.linalg.eigvalsh(M / np.sqrt(np.outer(own, own))).min() < _FLAT:
        return None
    g = moments.slope[:, at] - follow.T @ moments.slope[:, :n].sum(axis=0)
    mixed = follow.T @ moments.scatter[:, :n, at].T
    S = np.diag(moments.scatter[:, at, at]) - mixed - mixed.T + follow.T @ moments.scatter[:, :n, :n].sum(0) @ follow
    spread = np.linalg.solve(M, np.linalg.solve(M, S).T)
    return _Numbers(-np.linalg.solve(M, g), np.sqrt(np.diag(spread)), g, S, M, follow)


def _differing(
    moments: Moments, one: Suspicion, k: int, paths: Sequence[str], sigma: Array
) -> Differing | None:
    trials, found = len(moments.names), _numbers(moments, len(moments.back) + k)
    if trials < 3 or found is None:
        return None
    g, S, penalty = found.slope, found.scatter, math.log(max(moments.rows, 2))
    drop, alone = float(g @ np.linalg.solve(S, g)), g**2 / np.diag(S)
    first = int(np.argmax(alone))
    chosen = float(alone[first]) - penalty - 2.0 * math.log(trials)  # one trial of several
    if chosen >= min(drop - trials * penalty, _ALONE * drop):
        curvature = float(found.curvature[first, first])
        drop, size = float(alone[first]), float(-g[first]) / curvature
        each = {moments.names[first]: replace(one, size=size, sigma=math.sqrt(S[first, first]) / curvature)}
        moves, removed = -found.follow[:, first] * size, float(g[first] ** 2) / curvature
    else:
        each = {name: replace(one, size=float(a), sigma=float(b))
                for name, a, b in zip(moments.names, found.size, found.spread, strict=True)}  # fmt: skip
        moves, removed = -found.follow @ found.size, float(-g @ found.size)
    moved = dict(zip(paths, (moves / np.maximum(sigma, 1e-300)).tolist(), strict=False))
    share = removed / moments.cost
    better = drop - one.drop > SIGNIFICANT + (len(each) - 1) * penalty and share > _TWICE * one.share
    acts = max(map(abs, moved.values()), default=0.0) > MOVES or share > REMOVES
    if not (better and acts and deviates(drop, len(each)) > math.sqrt(SIGNIFICANT)):
        return None
    return Differing(one.words, each, drop, share, moved)
