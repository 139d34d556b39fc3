"""Designs: points in the unit cube, each a function of the campaign's seed and its own number alone.

So any part of a campaign can be computed anywhere, in any order and any number of times, and gives the same numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, get_args

import numpy as np

from ..core.parameters import ParameterError
from ..data import Array

Design = Literal["random", "sobol", "latin-hypercube", "saltelli", "grid"]
DESIGNS: tuple[Design, ...] = get_args(Design)
"""The ways to spread the runs over the space of what varies."""

# Numbers of one counter of Philox4x64.
_WORDS = 4
# Of a Sobol sequence, in which it can be entered anywhere.
_BITS = 30
# A Latin hypercube is drawn whole, by each process.
_LATIN = 5e7


def points(design: Design, seed: int, dims: int, runs: int, first: int, last: int, levels: Sequence[int] = ()) -> Array:
    """Points `first` to `last` (not included) of the `runs` points of a design, shape (last - first, dims), in (0, 1).

    Args:
        design: "random" (Philox 4x64, Salmon et al. 2011, by counter), "sobol" (scrambled by Owen's method),
            "latin-hypercube", "saltelli" (Saltelli 2010: a block of dims + 2 runs for each point of a Sobol sequence
            in 2 dims, for Sobol indices of first and total order) or "grid" (all combinations, the last input fastest).
        levels: of a grid, how many values each input has.

    Raises:
        ParameterError: a number of runs that the design cannot have.
    """
    if dims == 0:
        return np.zeros((last - first, 0))
    if design == "random":
        return uniform(seed, dims, first, last)
    if design == "sobol":
        return _sobol(seed, dims, first, last)
    if design in ("sobol", "saltelli") and runs > 2**_BITS:
        raise ParameterError(f"runs is {runs}; a Sobol sequence has 2^{_BITS} points; take random")
    if design == "latin-hypercube":
        return _latin(seed, dims, runs)[first:last]
    if design == "saltelli":
        return _saltelli(seed, dims, first, last)
    return _grid(levels, runs, first, last)


def check_runs(design: Design, dims: int, runs: int, levels: Sequence[int] = ()) -> None:
    """Refuse a number of runs that a design cannot have.

    Raises:
        ParameterError: what it would be.
    """
    if runs < 1:
        raise ParameterError(f"runs is {runs}; give 1 or more")
    if design == "grid" and runs != math.prod(levels):
        raise ParameterError(f"runs is {runs}; the grid has {' x '.join(map(str, levels))} = {math.prod(levels)}")
    if design == "saltelli" and (dims == 0 or runs % (dims + 2)):
        block = dims + 2
        raise ParameterError(f"runs is {runs}; design saltelli takes a multiple of {block} (inputs + 2), such as "
                             f"{block * max(round(runs / block), 1)}")  # fmt: skip
    if design in ("sobol", "saltelli") and runs > 2**_BITS:
        raise ParameterError(f"runs is {runs}; a Sobol sequence has 2^{_BITS} points; take random")
    if design == "latin-hypercube" and runs * dims > _LATIN:
        raise ParameterError(f"runs is {runs}; a Latin hypercube of {dims} inputs is drawn whole: at most "
                             f"{_LATIN / dims:.0f} runs; take sobol")  # fmt: skip


def uniform(seed: int, dims: int, first: int, last: int, stream: int = 0) -> Array:
    """Uniform numbers in (0, 1), shape (last - first, dims), row by row from a counter of its own."""
    each = -(-dims // _WORDS)
    source = np.random.Philox(key=np.array([seed, stream], dtype=np.uint64))
    source.advance(first * each)
    words = source.random_raw((last - first) * each * _WORDS).reshape(last - first, each * _WORDS)[:, :dims]
    return _open(words)


def _open(words: np.ndarray[tuple[int, ...], np.dtype[np.uint64]]) -> Array:
    """53 bits of each word as the middle of its interval: neither 0 nor 1, whose quantiles may be infinite."""
    return ((words >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53


def _sobol(seed: int, dims: int, first: int, last: int) -> Array:
    from scipy.stats import qmc

    sampler = qmc.Sobol(dims, scramble=True, rng=np.random.default_rng([seed, 1]), bits=_BITS)
    # SciPy warns of a first draw that is no power of two, which a part need not be: the first point is drawn by itself.
    begun = sampler.random(1) if first == 0 else np.zeros((0, dims))
    if first:
        sampler.fast_forward(first)
    rest = last - first - len(begun)
    drawn = np.vstack([begun, sampler.random(rest)]) if rest else begun
    return drawn + 0.5 ** (_BITS + 1)  # the middle of its interval


@lru_cache(maxsize=1)
def _latin(seed: int, dims: int, runs: int) -> Array:
    from scipy.stats import qmc

    points = qmc.LatinHypercube(dims, rng=np.random.default_rng([seed, 2])).random(runs)
    return np.clip(points, 2.0**-54, 1.0 - 2.0**-54)


def _saltelli(seed: int, dims: int, first: int, last: int) -> Array:
    """Runs A, AB_1 ... AB_dims, B of each base point: AB_i is A with input i of B."""
    block = dims + 2
    bases = _sobol(seed, 2 * dims, first // block, -(-last // block))
    A, B = bases[:, :dims], bases[:, dims:]
    out = np.repeat(A[:, None, :], block, axis=1)
    for i in range(dims):
        out[:, 1 + i, i] = B[:, i]
    out[:, -1] = B
    skipped = first - first // block * block
    return out.reshape(-1, dims)[skipped : skipped + last - first]


def _grid(levels: Sequence[int], runs: int, first: int, last: int) -> Array:
    places = np.unravel_index(np.arange(first, last), tuple(levels))
    return np.column_stack([(place + 0.5) / count for place, count in zip(places, levels, strict=True)])
