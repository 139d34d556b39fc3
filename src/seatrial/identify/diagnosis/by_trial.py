"""Trials that contradict the others: what each trial alone asks of the parameters, against what chance allows.

At the optimum the scores of all trials (derivatives of the objective) add up to zero.  For right models each differs
from zero by the noise of its trial only, so the square of a score over its covariance is a chi square with as many
degrees of freedom as parameters (test of a break between samples, Chow 1960, by scores).  A fault of one trial, another
loading condition, a current or an error of the compass that the heading turns: each makes trials disagree, long before
their residuals, to which the parameters of all have adapted, are larger than the noise or alike.

Score tests of errors of instruments that differ from trial to trial, or that one trial has alone.

A current that turns with the tide, a compass whose error depends on the heading or an indicator that was adjusted in
mid-day may cancel over all trials: as one number for all they hardly show.  Here each suspect is one number per trial,
eliminated together with the parameters (as in `diagnose`, Rao 1948), and preferred to one number for all where the
objective falls by more than the further numbers cost by Schwarz's criterion, and by more than twice as much.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...core.values import dataclass, replace
from ...data import Array
from .blame.contradiction import Contradiction
from .findings import MOVES, REMOVES, SIGNIFICANT, Differing, Suspicion

# Trials, those of the largest chi square, that are left out in turn.
_TRIED = 4
# Directions of the scores that no parameter moves, relative to the strongest.
_UNMOVED = 1e-9
# An error by trial is told where it removes more than so many times what the same error of all trials removes.
_TWICE = 2.0
# One trial alone has it where that explains this share of what a number for each explains: a large error is not linear.
_ALONE = 0.8
# Least curvature by which the numbers of all trials differ from the parameters, relative to that of each.
_FLAT = 1e-6


@dataclass(frozen=True)
class Scores:
    """Scores of each trial at the optimum and what is known of their scatter.

    Attributes:
        names: of the trials.
        score: shape (trials, n).
        curvature: derivatives of the scores, shape (trials, n, n).
        scatter: covariance of the scores by noise, shape (trials, n, n).
        prior: curvature of the prior, shape (n, n).
    """

    names: Sequence[str]
    score: Array
    curvature: Array
    scatter: Array
    prior: Array

    def without(self, index: int) -> Scores:
        """The scores at the optimum of the other trials, to first order."""
        keep = np.arange(len(self.names)) != index
        rest = Scores([n for n, k in zip(self.names, keep, strict=True) if k], self.score[keep], self.curvature[keep],
                      self.scatter[keep], self.prior)  # fmt: skip
        return Scores(rest.names, rest.score + rest.curvature @ self.step(index), rest.curvature, rest.scatter,
                      rest.prior)  # fmt: skip

    def step(self, index: int) -> Array:
        """Change of the optimum where one trial is left out, shape (n,)."""
        rest = self.prior + self.curvature.sum(axis=0) - self.curvature[index]
        return np.linalg.pinv(rest, hermitian=True) @ self.score[index]

    def squares(self) -> tuple[Array, Array]:
        """Chi square and degrees of freedom of each trial, shape (trials,) each."""
        back = np.linalg.pinv(self.prior + self.curvature.sum(axis=0), hermitian=True)
        whole = self.prior + self.scatter.sum(axis=0)
        chi, freedom = np.zeros(len(self.names)), np.zeros(len(self.names))
        for k, (g, A, C) in enumerate(zip(self.score, self.curvature, self.scatter, strict=True)):
            # The optimum follows each trial: g - A back (sum of all scores) is what is left of its noise.
            shared = C @ back @ A
            own = C - shared - shared.T + A @ back @ whole @ back @ A
            scale = np.sqrt(np.maximum(np.diag(C), 0.0))
            scale = np.where(scale > _UNMOVED * scale.max(initial=0.0), scale, np.inf)
            size, vectors = np.linalg.eigh(own / np.outer(scale, scale))
            seen = size > _UNMOVED * max(float(size.max(initial=0.0)), 1e-300)
            along = vectors[:, seen].T @ (g / scale)
            chi[k], freedom[k] = float((along**2 / size[seen]).sum()), int(seen.sum())
        return chi, freedom


def deviates(chi: float, freedom: float) -> float:
    """A chi square as a standard deviate (Wilson and Hilferty 1931)."""
    spread = 2.0 / (9.0 * freedom)
    return float((np.cbrt(chi / freedom) - 1.0 + spread) / np.sqrt(spread))


def contradictions(scores: Scores, paths: Sequence[str], sigma: Array) -> tuple[Contradiction, ...]:
    """Each of the trials that disagree most against the others, the one whose absence removes most of that first.

    Args:
        paths: of the free parameters, the first of the n.
        sigma: of the estimates, shape (n,).
    """
    if len(scores.names) < 3:
        return ()  # two that disagree do not tell which of them is wrong
    chi, freedom = scores.squares()
    # The scores add up to zero: what one trial has too much the others lack.
    whole, share = float(chi.sum()), 1.0 - 1.0 / len(scores.names)
    together = deviates(share * whole, share * float(freedom.sum())) if freedom.any() else -np.inf
    excess = float(np.maximum(chi - freedom, 0.0).sum())
    out: list[Contradiction] = []
    each = np.array([deviates(c, n) if n else -np.inf for c, n in zip(chi.tolist(), freedom.tolist(), strict=True)])
    for k in map(int, np.argsort(-each)[:_TRIED]):
        rest, expected = scores.without(k).squares()
        left = float(np.maximum(rest - expected, 0.0).sum())
        moves = scores.step(k) / np.maximum(sigma, 1e-300)
        out.append(Contradiction(
            scores.names[k], float(chi[k]), int(freedom[k]), float(each[k]), together,
            1.0 - left / max(excess, 1e-300), dict(zip(paths, moves.tolist(), strict=False)),
        ))  # fmt: skip
    return tuple(sorted(out, key=lambda one: -one.removes))


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
