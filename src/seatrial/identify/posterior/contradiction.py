"""Trials that contradict the others: what each trial alone asks of the parameters, against what chance allows.

At the optimum the scores of all trials (derivatives of the objective) add up to zero.  For right models each differs
from zero by the noise of its trial only, so the square of a score over its covariance is a chi square with as many
degrees of freedom as parameters (test of a break between samples, Chow 1960, by scores).  A fault of one trial, another
loading condition, a current or an error of the compass that the heading turns: each makes trials disagree, long before
their residuals, to which the parameters of all have adapted, are larger than the noise or alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...data import Array

# Deviates beyond which chance is no explanation: those of a suspect (`diagnosis.SIGNIFICANT`).
_DEVIATES = 5.0
# Of trials that contradict each other, those beyond this are named.
_HARDLY = 3.0
# One trial stands out where leaving it out removes this share of what the scores of all exceed chance by.
_MOST = 0.75
# Trials, those of the largest chi square, that are left out in turn.
_TRIED = 4
# Directions of the scores that no parameter moves, relative to the strongest.
_FLAT = 1e-9


@dataclass(frozen=True)
class Contradiction:
    """What one trial asks of the parameters, against the others.

    Attributes:
        trial: its name.
        chi, freedom: square of its score over the covariance, and what chance leaves of that on average.
        deviates: the same in standard deviations of a Gaussian (Wilson and Hilferty 1931).
        together: deviates of the scores of all trials at once.
        removes: share of the excess of all trials that leaving this one out would remove.
        moves: change of each free parameter without this trial, in its sigma.
    """

    trial: str
    chi: float
    freedom: int
    deviates: float
    together: float
    removes: float
    moves: Mapping[str, float]

    @property
    def matters(self) -> bool:
        """Whether chance is no explanation, and the result depends on it."""
        return max(self.deviates, self.together) > _DEVIATES and max(map(abs, self.moves.values()), default=0.0) > 1.0

    @property
    def odd(self) -> bool:
        """Whether noise does not explain it, or hardly."""
        return self.deviates > _HARDLY

    @property
    def alone(self) -> bool:
        """Whether the others agree among themselves, or nearly."""
        return self.deviates > _DEVIATES and self.removes > _MOST

    @property
    def text(self) -> str:
        """The finding in one line."""
        most = max(self.moves, key=lambda path: abs(self.moves[path]))
        return (f"trial {self.trial} contradicts the others (chi square {self.chi:.0f} where {self.freedom} is "
                f"expected); without it {most} would move by {self.moves[most]:+.1f} sigma")  # fmt: skip


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
            scale = np.where(scale > _FLAT * scale.max(initial=0.0), scale, np.inf)
            size, vectors = np.linalg.eigh(own / np.outer(scale, scale))
            seen = size > _FLAT * max(float(size.max(initial=0.0)), 1e-300)
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
    for k in np.argsort(-each)[:_TRIED].tolist():
        rest, expected = scores.without(k).squares()
        left = float(np.maximum(rest - expected, 0.0).sum())
        moves = scores.step(k) / np.maximum(sigma, 1e-300)
        out.append(Contradiction(
            scores.names[k], float(chi[k]), int(freedom[k]), float(each[k]), together,
            1.0 - left / max(excess, 1e-300), dict(zip(paths, moves.tolist(), strict=False)),
        ))  # fmt: skip
    return tuple(sorted(out, key=lambda one: -one.removes))
