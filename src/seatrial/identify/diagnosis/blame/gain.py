"""What an error of an instrument gains in trials that had no part in its estimate, and how sure it is.

A wrong model leaves residuals that are large and alike, and some suspect always takes up a part of them: its chi square
over sensor noise is then no chance.  Two figures do not take the model as right.  The gain is judged on blocks (trials,
or windows of few trials) each by the error that the others ask for, so that only an error of one size everywhere gains
(cross-validation; Stone 1974), and counts as a share of what the residuals exceed the noise by.  The standard error
follows from the scatter of the blocks' scores about that error (White 1980; Liang and Zeger 1986), whatever the size
and the correlation of the residuals.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ....core.values import dataclass
from ....data import Array

# An error is credible where it explains this share of what exceeds the noise, and is so many times its scatter.
EXPLAINS, SURE = 0.5, 5.0
# Standard deviations of a chi square that the residuals may exceed the noise by without an explanation.
_CHANCE = 2.0
# Fewer trials than this are judged window by window.
_TRIALS = 3


@dataclass(frozen=True)
class Gain:
    """How much one error explains beyond noise.

    Attributes:
        share: of what the residuals exceed the noise by, in blocks that had no part in the estimate; below 0 where it
            makes them worse, 1 at most.
        deviates: the error over its scatter from window to window, and from trial to trial; the smaller one.
    """

    share: float
    deviates: float

    @property
    def credible(self) -> bool:
        """Whether it explains what a wrong model would not leave."""
        return self.deviates > SURE and self.share > EXPLAINS


CERTAIN = Gain(1.0, math.inf)
"""Of an error that explains everything."""


def gains(e: Array, own: Array, trial: Array, shown: Sequence[int], expected: float) -> list[Gain]:
    """Of each suspect, beside those that are at fault for certain.

    Args:
        e: weighted residuals, shape (lanes, rows).
        own: their derivatives by the suspects, less what the parameters explain, shape (lanes, rows, suspects).
        trial: of each lane, shape (lanes,).
        shown: which of the suspects are certain.
        expected: sum of squares that noise leaves.
    """
    flat = own.reshape(e.size, -1)
    left, known = e.ravel(), flat[:, [*shown]]
    if known.size:
        back = np.linalg.pinv(known)
        left, flat = left - known @ (back @ left), flat - known @ (back @ flat)
    return [gain(left.reshape(e.shape), one.reshape(e.shape), trial, expected) for one in flat.T]


def gain(e: Array, own: Array, trial: Array, expected: float) -> Gain:
    """That of one suspect.

    Args:
        e: weighted residuals, shape (lanes, rows).
        own: their derivative by the suspect, less what the parameters explain of it, same shape.
        trial: of each lane, shape (lanes,).
        expected: sum of squares that noise leaves.
    """
    cost, power = float((e**2).sum()), float((own**2).sum())
    if not power > 0.0:
        return Gain(0.0, 0.0)
    slope, curvature = (own * e).sum(axis=1), (own**2).sum(axis=1)
    size = -float(slope.sum()) / power
    by_trial = [np.array([part[trial == k].sum() for k in np.unique(trial)]) for part in (slope, curvature)]
    g, C = by_trial if len(by_trial[0]) >= _TRIALS else (slope, curvature)
    rest = np.maximum(C.sum() - C, 1e-300)
    others = -(g.sum() - g) / rest
    gained = -float((2.0 * others * g + others**2 * C).sum()) if len(g) > 1 else size**2 * power
    scores = [slope + size * curvature, by_trial[0] + size * by_trial[1]]
    sure = [abs(size) * power / max(_scatter(one), 1e-300) for one in scores if len(one) >= _TRIALS]
    excess = max(cost - expected - _CHANCE * math.sqrt(2.0 * expected), 1e-300)
    return Gain(min(gained / excess, 1.0), min(sure, default=math.inf))


def _scatter(scores: Array) -> float:
    """Standard deviation of the sum of independent scores."""
    return math.sqrt(len(scores) / (len(scores) - 1.0) * float((scores**2).sum()))
