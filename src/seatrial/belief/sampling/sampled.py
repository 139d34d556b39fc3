"""What the draws of a posterior say, beside Laplace's approximation of it, in numbers and in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ...core.parameters import Free
from ...core.values import dataclass
from ...data import Array

RHAT, ENOUGH = 1.01, 400.0
"""R-hat below which chains agree, and effective draws that quantiles need (Vehtari et al. 2021)."""

# Laplace counts as right to these: shift of the mean in sigmas, and ratio of the sigmas either way.
_SHIFT, _RATIO = 0.25, 1.2
# A bound cuts the density where so large a share lies within so small a part of a sigma from it.
_NEAR, _CUT = 0.1, 0.025
# Correlation beyond which two parameters are told as a combination; names listed in a line; share of divergent moves.
_RIDGE, _LISTED, _LOST = 0.95, 4, 0.005
# Fourth moment of residuals over that of a Gaussian beyond which their tails are heavy.
_TAILS = 2.0
# R-hat foreseen for the end from which on chains are given up; what keeps the covariance within chains regular.
_HOPELESS, _RIDGED = 1.1, 0.05


@dataclass(frozen=True)
class Sampled:
    """Draws of a posterior.

    Attributes:
        free: the parameters.
        draws: shape (draws, chains, free).
        density: log density of each draw, but for a constant, shape (draws, chains).
        accepted: acceptance probability, shape (draws, chains).
        divergent: moves that were lost.
        best: where the density is greatest: the fit, as the search left it, shape (free,).
        laplace: covariance of Laplace's approximation there, shape (free, free).
        variance: factor that divides the squared residuals.
        tails: fourth moment of the residuals over that of a Gaussian, by channel.
        seconds, calls: CPU time [s], and evaluations of the density by each chain.
        digest: fingerprint of fit, seed and number of draws.
    """

    free: tuple[Free, ...]
    draws: Array
    density: Array
    accepted: Array
    divergent: int
    best: Array
    laplace: Array
    variance: float
    tails: Mapping[str, float]
    seconds: float
    calls: int
    digest: str

    @property
    def paths(self) -> tuple[str, ...]:
        """Of the parameters."""
        return tuple(one.path for one in self.free)

    @cached_property
    def flat(self) -> Array:
        """All draws of all chains, shape (draws * chains, free)."""
        return self.draws.reshape(-1, self.draws.shape[2])

    @cached_property
    def rhat(self) -> Array:
        """Of each parameter, shape (free,)."""
        return rhat(self.draws)

    @cached_property
    def effective(self) -> Array:
        """Lesser of the effective sizes of bulk and tails, shape (free,)."""
        return np.minimum(effective(self.draws), effective_tails(self.draws))

    @cached_property
    def mean(self) -> Array:
        """Of the draws, shape (free,)."""
        return self.flat.mean(axis=0)

    @cached_property
    def sigma(self) -> Array:
        """Standard deviation of the draws, shape (free,)."""
        return self.flat.std(axis=0, ddof=1)

    @cached_property
    def interval(self) -> Array:
        """Quantiles of 2.5 and 97.5 %, shape (2, free)."""
        return np.quantile(self.flat, (0.025, 0.975), axis=0)

    @cached_property
    def shift(self) -> Array:
        """Mean less the best, in Laplace's sigmas, shape (free,)."""
        return (self.mean - self.best) / np.sqrt(np.diag(self.laplace))

    @cached_property
    def ratio(self) -> Array:
        """Sigma of the draws over Laplace's, shape (free,)."""
        return self.sigma / np.sqrt(np.diag(self.laplace))

    @property
    def converged(self) -> bool:
        """Whether the chains agree, and there are enough draws for intervals."""
        return bool((self.rhat <= RHAT).all() and (self.effective >= ENOUGH).all())

    @property
    def cut(self) -> tuple[str, ...]:
        """Paths whose density is cut off by a bound."""
        near, flat = _NEAR * self.sigma, self.flat
        low, high = (np.array([getattr(one, name) for one in self.free]) for name in ("low", "high"))
        share = np.maximum((flat < low + near).mean(axis=0), (flat > high - near).mean(axis=0))
        return tuple(path for path, one in zip(self.paths, share, strict=True) if one > _CUT)

    @property
    def words(self) -> tuple[str, ...]:
        """What the draws say, one line each, the trust in them first."""
        return (self._trust(), *self._moves(), self._beside(), *self._cut(), *self._ridges(), *self._tails())

    def _trust(self) -> str:
        worst, least = int(np.nanargmax(self._safe())), int(np.nanargmin(np.nan_to_num(self.effective)))
        r, e = self.rhat[worst], self.effective[least]
        told = (f"{len(self.flat)} draws of {self.draws.shape[1]} chains; largest R-hat {r:.3f} ({self.paths[worst]}), "
                f"fewest effective draws {e:.0f} ({self.paths[least]})")  # fmt: skip
        if self.converged:
            return f"The chains agree: {told}."
        why = "do not agree" if not (self.rhat <= RHAT).all() else "agree, but the draws are too few for intervals"
        more = max(2.0, min(20.0, 1.3 * ENOUGH / max(e, 1.0)))
        wanted = f"R-hat is to be {RHAT} or less and effective draws {ENOUGH:.0f} or more"
        return f"The chains {why}: {told}; {wanted}: draw {more:.0f} times as many, or give tighter priors."

    def _safe(self) -> Array:
        return np.where(np.isfinite(self.rhat), self.rhat, np.inf)

    def _moves(self) -> tuple[str, ...]:
        share = self.divergent / self.accepted.size
        if share <= _LOST:
            return ()
        return (f"{self.divergent} of {self.accepted.size} moves were lost: the density has a corner or a cliff that "
                "the chains do not enter, and the draws may lack a part of it.",)  # fmt: skip

    def _beside(self) -> str:
        off = np.flatnonzero((np.abs(self.shift) > _SHIFT) | (np.abs(np.log(self.ratio)) > np.log(_RATIO)))
        if not off.size:
            return "Laplace's approximation holds: every mean within a quarter of a sigma, every sigma within 20 %."
        worst = off[np.argsort(-(np.abs(self.shift[off]) + np.abs(np.log(self.ratio[off]))))][:_LISTED]
        told = "; ".join(f"{self.paths[k]} mean {self.shift[k]:+.2f} sigma, sigma {self.ratio[k]:.2f} times"
                         for k in worst)  # fmt: skip
        doubt = "" if self.converged else ", as far as these chains can tell"
        return (f"Laplace's approximation is off for {off.size} of {len(self.free)} parameters{doubt}; take the draws' "
                f"intervals: {told}{', ...' if off.size > _LISTED else ''}.")  # fmt: skip

    def _cut(self) -> tuple[str, ...]:
        found = self.cut
        return (f"Cut off by a bound, where the density is still high: {', '.join(found)}.",) if found else ()

    def _ridges(self) -> tuple[str, ...]:
        # Of the ranks: a curved ridge has a weak correlation of the values.
        ranks = self.flat.argsort(axis=0).argsort(axis=0).astype(np.float64)
        with np.errstate(all="ignore"):
            c = np.atleast_2d(np.corrcoef(ranks.T))
        pairs = [(i, j) for i in range(len(c)) for j in range(i) if abs(c[i, j]) > _RIDGE]
        pairs.sort(key=lambda one: -abs(c[one]))
        return tuple(f"{self.paths[j]} and {self.paths[i]} lie on a ridge (rank correlation {c[i, j]:+.3f}): the data "
                     "fix a combination, not each of them." for i, j in pairs[:_LISTED])  # fmt: skip

    def _tails(self) -> tuple[str, ...]:
        heavy = [f"{name} {one:.1f} times" for name, one in self.tails.items() if one > _TAILS]
        if not heavy:
            return ()
        return (f"Residuals have heavier tails than the Gaussian noise that the posterior assumes (fourth moment: "
                f"{', '.join(heavy)}): a few decide the estimate, and the width is not to be trusted.",)  # fmt: skip

    def numbers(self) -> dict[str, Any]:
        """For JSON, SI units."""
        columns = zip(self.mean, self.sigma, *self.interval, self.rhat, self.effective, self.shift, self.ratio,
                      strict=True)  # fmt: skip
        names = ("mean", "sigma", "low_95", "high_95", "rhat", "effective", "laplace_shift", "laplace_ratio")
        return {
            "draws": len(self.flat), "chains": self.draws.shape[1], "converged": self.converged,
            "variance": self.variance, "divergent": self.divergent, "accepted": float(self.accepted.mean()),
            "seconds": self.seconds, "calls": self.calls, "digest": self.digest, "words": list(self.words),
            "tails": dict(self.tails),
            "parameters": {path: dict(zip(names, map(float, one), strict=True))
                           for path, one in zip(self.paths, columns, strict=True)},
        }  # fmt: skip


def hopeless(draws: Array, paths: Sequence[str], count: int, seconds: float) -> str:
    """Why chains will not agree by their end, and when they would; empty where they may.

    The squares of R-hat less one fall as one over the draws once chains have forgotten their starts, and no faster
    before.  The direction is that in which the chains lie farthest apart for their spread (Brooks and Gelman 1998).

    Args:
        draws: kept so far, shape (draws, chains, free).
        count: draws of each chain that were asked for.
        seconds: CPU time spent [s].
    """
    done, apart = len(draws), float(np.nanmax(rhat(draws))) ** 2 - 1.0
    end, needed = math.sqrt(1.0 + max(apart, 0.0) * done / count), math.ceil(done * apart / (RHAT**2 - 1.0))
    if end <= _HOPELESS:
        return ""
    spread = draws.std(axis=(0, 1))
    unit = (draws - draws.mean(axis=(0, 1))) / np.where(spread > 0.0, spread, 1.0)
    within = np.mean([np.cov(chain.T) for chain in unit.transpose(1, 0, 2)], axis=0)
    within = np.atleast_2d(within) + _RIDGED * np.eye(len(paths))
    root = np.linalg.cholesky(within)
    means = np.linalg.solve(root, unit.mean(axis=0).T)
    along = np.abs(root @ np.linalg.svd(means)[0][:, 0])
    names = [paths[int(k)] for k in np.argsort(-along)[:_LISTED] if along[k] > 0.5 * along.max()]
    hours = seconds / done * needed / 3600.0
    return (f"given up after {done} of {count} draws of each chain and {seconds:.0f} s of CPU time: R-hat is "
            f"{math.sqrt(1.0 + apart):.2f}, the chains lie apart along {', '.join(names)}, and R-hat would be about "
            f"{end:.2f} at the end; {RHAT} takes some {needed} draws of each chain, {hours:.1f} h")


def rhat(draws: Array) -> Array:
    """Larger of the R-hats of the ranks and of the folded ranks, shape (free,); NaN where nothing ever moves.

    Args:
        draws: shape (draws, chains, free).
    """
    return np.array([max(_ratio(_ranked(one)), _ratio(_ranked(np.abs(one - np.median(one))))) for one in _split(draws)])


def effective(draws: Array) -> Array:
    """Effective sample size of the bulk: of the ranks, shape (free,)."""
    return np.array([_size(_ranked(one)) for one in _split(draws)])


def effective_tails(draws: Array) -> Array:
    """Lesser of the effective sample sizes of both 5 % tails, shape (free,)."""
    return np.array([min(_size((one <= np.quantile(one, q)).astype(np.float64)) for q in (0.05, 0.95))
                     for one in _split(draws)])  # fmt: skip


def effective_mean(draws: Array) -> Array:
    """Effective sample size of the mean: of the values themselves, shape (free,)."""
    return np.array([_size(one) for one in _split(draws)])


def _split(draws: Array) -> Array:
    """Halves of chains as chains, shape (free, draws // 2, 2 chains)."""
    half = len(draws) // 2
    return np.concatenate([draws[:half], draws[len(draws) - half :]], axis=1).transpose(2, 0, 1)


def _ranked(one: Array) -> Array:
    """Normal quantiles of the ranks of all draws."""
    from scipy.special import ndtri
    from scipy.stats import rankdata  # takes a second to import

    ranks = rankdata(one, method="average").reshape(one.shape)
    found: Array = ndtri((ranks - 0.375) / (one.size + 0.25))
    return found


def _ratio(one: Array) -> float:
    within, count = float(one.var(axis=0, ddof=1).mean()), len(one)
    if not within > 0:
        return float("nan")
    between = float(one.mean(axis=0).var(ddof=1))
    return float(np.sqrt((count - 1) / count + between / within))


def _size(one: Array) -> float:
    """Effective size of several chains (draws, chains), by Geyer's initial monotone sequence."""
    count, chains = one.shape
    within = float(one.var(axis=0, ddof=1).mean())
    if not within > 0:
        return float("nan")
    padded = np.fft.rfft(one - one.mean(axis=0), 2 * count, axis=0)
    covariance = np.fft.irfft(np.abs(padded) ** 2, axis=0)[:count].real / count
    whole = within * (count - 1) / count + (float(one.mean(axis=0).var(ddof=1)) if chains > 1 else 0.0)
    rho = 1.0 - (within - covariance.mean(axis=1) * count / (count - 1)) / whole
    rho[0] = 1.0
    pairs = rho[: count - count % 2].reshape(-1, 2).sum(axis=1)
    below = np.flatnonzero(pairs <= 0)
    # Sums of pairs fall; the first that is negative is chance.
    last = int(below[0]) if below.size else len(pairs)
    pairs = np.minimum.accumulate(pairs[:last])
    tau = max(-1.0 + 2.0 * float(pairs.sum()), 1.0 / np.log10(count * chains))
    return count * chains / tau
