"""Chance by counter: a number depends on seed, episode and place alone, so no lane's luck depends on another's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..data import Array

Counts = NDArray[np.uint64]

# The increment and the mixing constants of SplitMix64 (Steele, Lea and Flood 2014).
_STEP, _FIRST, _SECOND = (np.uint64(k) for k in (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB))


def _mixed(z: Counts) -> Counts:
    z = z + _STEP
    z = (z ^ (z >> np.uint64(30))) * _FIRST
    z = (z ^ (z >> np.uint64(27))) * _SECOND
    return z ^ (z >> np.uint64(31))


def uniform(seeds: Counts, episodes: Counts, count: int) -> Array:
    """Numbers in [0, 1), shape (lanes, count), of each lane's seed and episode."""
    key = _mixed(_mixed(seeds) ^ episodes)
    places = np.arange(count, dtype=np.uint64)
    return (_mixed(key[:, None] ^ _mixed(places)) >> np.uint64(11)).astype(np.float64) * 2.0**-53
