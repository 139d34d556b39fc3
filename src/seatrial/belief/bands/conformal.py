"""Conformal factors by trial: how many spreads wide a band is, so that it holds on trials that were never seen.

A score is an error on a left-out trial over the spread of the draws there.  Scores of one trial depend on each other,
so trials count, not samples: each recording has the same weight, and every quantile that judges a recording is taken
from the others.  Kinds of manoeuvre differ in size: scores are divided by a factor of their kind, drawn towards a
middle of all kinds, the more so the fewer recordings it has and the less kinds differ.  The quantile is the one whose
mean coverage of left-out recordings is the level.  (The quantile of hierarchical conformal prediction, which puts a
recording at infinity, covers 98 % for 95 % with 25 recordings, as docs/bands.md shows; this one covers 95 %.)

Fewer recordings than a level needs cannot show it by their ranks.  Then the factor is the root mean square score of all
kinds and neighbouring horizons together times Student's t of as many degrees of freedom as recordings: exact for one
normal error a recording, whose scale is as unknown as so few leave it; never less than the factor of the greatest level
that they show, which knows the kinds.  How far one such set can be off is said with it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.errors import RequestError
from ...core.values import dataclass
from ...data import Array
from ..power import LEAST

# The middle of the kinds counts as so many recordings of each kind, at least and at most.
_PRIOR = (0.25, 10.0)
# Scores of so many neighbouring horizons on either side count at a horizon too.
_NEAR = 1
_HALVINGS = 10
# Of sets of so few recordings, this share has bands that hold at least as often as is said of them.
_SURE = 0.9


def needed(level: float) -> int:
    """Fewest recordings that can show a level, of 0 to 1: with fewer, all of them inside shows less.

    >>> needed(0.9), needed(0.95), needed(0.99)
    (9, 19, 99)
    """
    return max(math.ceil(1.0 / (1.0 - level) - 1e-9) - 1, 2)


def shown(count: int) -> float:
    """The greatest level that so many recordings can show, of 0 to 1; 0 where they show none.

    >>> shown(19), shown(4), shown(1)
    (0.95, 0.8, 0.0)
    """
    # rounded downwards: a level above what they show would be refused
    return math.floor(1e9 * (1.0 - 1.0 / (count + 1)) + 1e-3) / 1e9 if count >= 2 else 0.0


@dataclass(frozen=True)
class Factors:
    """Half widths of bands over the spread.

    Attributes:
        kinds: of manoeuvre, the last one stands for any other.
        factor: shape (kinds, horizons, channels); NaN where too few recordings go so far.
        recordings: of each kind at each horizon, shape (kinds, horizons); all of them in the last row.
    """

    kinds: tuple[str, ...]
    factor: Array
    recordings: NDArray[np.intp]


def factors(
    score: Array, groups: Sequence[str], kinds: Sequence[str], level: float, alike: Sequence[Sequence[int]] = ()
) -> Factors:
    """Factors of a level: by ranks of the recordings, or by Student's t where all of them are too few for that.

    Args:
        score: absolute error over spread, shape (windows, horizons, channels); NaN where unknown.
        groups: recording of each window.
        kinds: kind of manoeuvre of each window.
        level: of 0 to 1.
        alike: channels that share a factor; each of the others has its own.

    Raises:
        RequestError: fewer than `LEAST` recordings, or than the level needs where that is less, at every horizon.
    """
    from scipy.special import stdtrit  # a quarter of a second, for what few ask

    names, group = np.unique(np.asarray(groups), return_inverse=True)
    every, kind = np.unique(np.asarray(kinds), return_inverse=True)
    of = np.array([kind[np.argmax(group == k)] for k in range(len(names))], dtype=np.intp)
    horizons, channels = score.shape[1:]
    out = np.full((len(every) + 1, horizons, channels), np.nan)
    counts = np.zeros((len(every) + 1, horizons), dtype=np.intp)
    ranked = len(np.unique(group[np.isfinite(score).any(axis=(1, 2))])) >= needed(level)
    least = needed(level) if ranked else LEAST
    for j in range(horizons):
        here = np.unique(group[np.isfinite(score[:, j]).any(axis=1)])
        counts[:-1, j], counts[-1, j] = np.bincount(of[here], minlength=len(every)), len(here)
        near = slice(max(j - _NEAR, 0), j + _NEAR + 1)
        for some in (*alike, *([c] for c in range(channels) if not any(c in one for one in alike))):
            reaching = len(np.unique(group[np.isfinite(score[:, j][:, some]).any(axis=1)]))
            if reaching < least:
                continue
            about = score[:, near][:, :, some].reshape(len(score), -1)
            found = _at(about, group, of, len(every), level if ranked else min(level, shown(reaching)))
            if not ranked:
                found = np.maximum(found, stdtrit(reaching, 0.5 * (1.0 + level)) * _rms(about, group))
            out[:, j, some] = found[:, None]
    if not np.isfinite(out).any():
        raise too_few(int(counts[-1].max()))
    return Factors((*map(str, every), ""), out, counts)


def too_few(count: int) -> RequestError:
    """The refusal of so few recordings that they do not tell a scale."""
    return RequestError(f"too few trials to calibrate: {count} recordings, and at least {LEAST} are needed; add trials")


def unsure(count: int, level: float) -> tuple[str, ...]:
    """What bands of a level are worth that so many recordings do not show by themselves; nothing where they do.

    The squared scale of such a band is that of the errors times chi-square over its degrees of freedom, so what the
    bands of one set hold differs: its lower quantile over the sets is said.

    >>> unsure(19, 0.95)
    ()
    """
    if count >= needed(level):
        return ()
    from scipy.special import gammaincinv, ndtr, stdtrit

    scale = math.sqrt(2.0 * float(gammaincinv(0.5 * count, 1.0 - _SURE)) / count)
    least = 2.0 * float(ndtr(stdtrit(count, 0.5 * (1.0 + level)) * scale)) - 1.0
    return (f"{count} recordings show {math.floor(100.0 * shown(count))} % by themselves; bands of {100 * level:.3g} % "
            "are by Student's t, as if errors were normal: on average they hold, and in "
            f"{10 * _SURE:.0f} of 10 such sets for {math.floor(100.0 * least)} % or more of what is measured",
            )  # fmt: skip


def _rms(score: Array, group: NDArray[np.intp]) -> float:
    """Root mean square score, each recording counting once.

    Args:
        score: shape (windows, horizons).
    """
    known = np.isfinite(score)
    owner = np.broadcast_to(group[:, None], score.shape)[known]
    many = np.bincount(owner)
    here = many > 0
    return float(np.sqrt(np.mean(np.bincount(owner, score[known] ** 2)[here] / many[here])))


def _at(score: Array, group: NDArray[np.intp], kind: NDArray[np.intp], kinds: int, level: float) -> Array:
    """Factor of each kind and of any other, for one channel about one horizon, shape (kinds + 1,).

    Args:
        score: shape (windows, horizons).
        group: recording of each window.
        kind: of each recording, below `kinds`.
    """
    known = np.isfinite(score)
    value, owner = score[known], np.broadcast_to(group[:, None], score.shape)[known]
    many = np.bincount(owner, minlength=len(kind))
    here = many > 0
    square = np.where(here, np.bincount(owner, value**2, minlength=len(kind)) / np.maximum(many, 1), 0.0)
    prior = _prior(square, here, kind, kinds)
    alone = np.array([_sizes(square, here & (np.arange(len(kind)) != k), kind, kinds, prior)[kind[k]]
                      for k in range(len(kind))])  # fmt: skip
    scaled = value / alone[owner]
    order = np.argsort(scaled, kind="stable")
    scaled, owner = scaled[order], owner[order]
    weight = 1.0 / many[owner]
    sizes = _sizes(square, here, kind, kinds, prior)
    return np.append(sizes, sizes.max()) * _quantile(scaled, weight, _share(scaled, owner, weight, here, level))


def _sizes(square: Array, here: NDArray[np.bool_], kind: NDArray[np.intp], kinds: int, prior: float) -> Array:
    """Root mean square score of each kind, drawn towards a middle of the kinds, shape (kinds,).

    Args:
        prior: number of recordings that the middle counts as.
    """
    count = np.bincount(kind[here], minlength=kinds)
    total = np.bincount(kind[here], square[here], minlength=kinds)
    middle = np.exp(np.mean(np.log(np.maximum(total[count > 0] / count[count > 0], 1e-300))))
    return np.sqrt(np.maximum((total + prior * middle) / (count + prior), 1e-300))


def _prior(square: Array, here: NDArray[np.bool_], kind: NDArray[np.intp], kinds: int) -> float:
    """Relative variance of mean squares within kinds over that between kinds: what a middle of the kinds is worth."""
    groups = [square[here & (kind == k)] for k in range(kinds)]
    groups = [one for one in groups if len(one) > 1]
    if len(groups) < 2:
        return _PRIOR[1]
    means = np.array([one.mean() for one in groups])
    within = float(np.mean([one.var(ddof=1) / max(one.mean() ** 2, 1e-300) for one in groups]))
    between = float(means.var(ddof=1) / max(means.mean() ** 2, 1e-300)) - within * float(
        np.mean([1.0 / len(one) for one in groups])
    )
    return float(np.clip(within / max(between, 1e-9), *_PRIOR))


def _quantile(value: Array, weight: Array, share: float) -> float:
    """Smallest value below or at which lies a share of the weight; values in increasing order."""
    within = np.cumsum(weight)
    return float(value[min(int(np.searchsorted(within, share * within[-1] * (1.0 - 1e-12))), len(value) - 1)])


def _share(value: Array, owner: NDArray[np.intp], weight: Array, here: NDArray[np.bool_], level: float) -> float:
    """Share of the weight whose quantile among the others covers a left-out recording to `level` on average."""
    mine = owner == np.flatnonzero(here)[:, None]
    others = np.cumsum(np.where(mine, 0.0, weight), axis=1)
    low, high = level, 1.0
    for _ in range(_HALVINGS):
        share = 0.5 * (low + high)
        at = np.minimum((others < share * others[:, -1:] * (1.0 - 1e-12)).sum(axis=1), len(value) - 1)
        covered = float((mine & (value <= value[at][:, None])).sum(axis=1) @ (1.0 / mine.sum(axis=1))) / len(mine)
        low, high = (low, share) if covered >= level else (share, high)
    return high
