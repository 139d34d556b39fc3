"""Quantiles, histograms and counted probabilities: intervals that hold the truth as often as they say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.campaign.analysis.proportion import Proportion, runs_to_exclude
from seatrial.campaign.analysis.spread import SHARES, histogram, spread
from seatrial.campaign.designs import uniform


@pytest.mark.slow
def test_intervals_of_quantiles_hold_the_truth() -> None:
    held = dict.fromkeys(SHARES[1:-1], 0)
    for seed in range(400):
        found = spread(-np.log(uniform(seed, 1, 0, 200)[:, 0]))
        for q in found.quantiles:
            if q.share in held:
                held[q.share] += q.low <= -math.log1p(-q.share) <= q.high
    assert all(0.93 * 400 <= count <= 400 for count in held.values()), held


def test_few_runs_bound_no_rare_quantile() -> None:
    found = spread(np.array([3.0, math.nan, 1.0, 2.0, math.nan, 5.0]))
    assert (found.count, found.missing, found.least, found.most) == (4, 2, 1.0, 5.0)
    by_share = {q.share: q for q in found.quantiles}
    assert math.isnan(by_share[0.99].high)
    assert math.isnan(by_share[0.01].low)
    assert by_share[0.5].value == 2.5
    assert spread(np.full(3, math.nan)).quantiles == ()


def test_an_outlier_does_not_hide_the_others() -> None:
    values = uniform(1, 1, 0, 5000)[:, 0]
    values[7] = 1e9
    found = histogram([values, values[:0]])
    assert found is not None
    assert found.edges[-1] < 2.0
    assert found.shares[0].sum() + found.beyond[0] == pytest.approx(1.0)
    assert 0.0 < found.beyond[0] < 0.01
    assert not found.shares[1].any()


def test_bars_of_times_hold_equal_numbers_of_steps() -> None:
    """Times are multiples of the step; bars of 1.5 steps would be combs."""
    values = np.floor(uniform(1, 1, 0, 200000)[:, 0] * 130.0) * 0.2 + 40.0
    found = histogram([values])
    assert found is not None
    inner = found.shares[0][1:-2]
    assert inner.max() / inner.min() < 1.1
    assert histogram([np.full(5, 2.0)]) is None
    assert histogram([np.zeros(0)]) is None


def test_counted_probabilities() -> None:
    none, some = Proportion(0, 10), Proportion(4, 20)
    assert none.interval == pytest.approx((0.0, 0.3085), abs=1e-4)  # Clopper and Pearson, tabulated
    assert some.interval == pytest.approx((0.0573, 0.4366), abs=1e-4)
    assert Proportion(0, 0).interval == (0.0, 1.0)
    assert Proportion(100, 10000).needed(0.1) == pytest.approx(1.96**2 / 0.01 * 99.0, rel=1e-3)
    assert none.needed() > 800
    assert runs_to_exclude(1e-3) == 2995
    assert Proportion(0, 2995).value == 0.0
    assert (1.0 - 1e-3) ** 2995 < 0.05 < (1.0 - 1e-3) ** 2994
