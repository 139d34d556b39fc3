"""R-hat and effective sample size of chains, rank-normalised and split (Vehtari et al. 2021)."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri
from scipy.stats import rankdata

from ...data import Array


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
