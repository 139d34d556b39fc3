"""Ranks beside NumPy's own, to the bit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.core.ranks import median, quantile

SHARES = (0.0, 0.02, 0.05, 0.25, 0.5, 0.75, 0.9, 0.98, 0.999, 1.0)


def arrays() -> list[np.ndarray]:
    rng = np.random.default_rng(3)
    sizes = [1, 2, 3, 4, 5, 10, 11, 101, 600]
    drawn = [rng.normal(size=n) * 10.0 ** rng.integers(-9, 9) for n in sizes]
    even = [np.round(rng.normal(size=n), 1) for n in sizes]
    return [*drawn, *even, np.zeros(7), np.array([1.0, math.inf, 3.0]), np.array([2.0, math.nan, 1.0]),
            rng.normal(size=(2, 31)), np.arange(12)]  # fmt: skip


@pytest.mark.parametrize("values", arrays(), ids=lambda one: str(one.shape))
def test_ranks_are_numpy_s_to_the_bit(values: np.ndarray) -> None:
    kept = values.copy()
    with np.errstate(invalid="ignore"):
        assert np.array_equal(median(values), np.median(values), equal_nan=True)
        for share in SHARES:
            assert np.array_equal(quantile(values, share), np.quantile(values, share), equal_nan=True), share
    assert np.array_equal(values, kept, equal_nan=True)


def test_lists_are_taken() -> None:
    assert median([3, 1, 2]) == 2.0
    assert quantile([[1, 2], [3, 4]], 0.5) == 2.5


def test_of_nothing_there_is_no_rank() -> None:
    with pytest.warns(RuntimeWarning):
        assert math.isnan(median([]))
    with pytest.raises(IndexError):
        quantile([], 0.5)
