"""What residuals are left of noise: correlation, independent samples and runs against sums written out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.identify.posterior.misfit import Misfit, Remainder, _remainder, _runs, correlated


def red(rng: np.random.Generator, rows: int, samples: int, a: float) -> np.ndarray:
    """Noise of unit variance whose neighbours have the correlation a, shape (rows, samples)."""
    out = np.empty((rows, samples))
    out[:, 0] = rng.normal(size=rows)
    for k in range(1, samples):
        out[:, k] = a * out[:, k - 1] + math.sqrt(1.0 - a * a) * rng.normal(size=rows)
    return out


@pytest.mark.slow
def test_samples_of_red_noise_count_as_its_correlation_says() -> None:
    """The sum of a^k over all lags, twice and one: (1 + a)/(1 - a) samples are one independent sample."""
    rng = np.random.default_rng(4)
    for a in (0.5, 0.8):
        first, each = correlated(list(red(rng, 40, 4000, a)), least=0.005)
        assert first == pytest.approx(a, abs=0.01)
        assert each == pytest.approx((1.0 + a) / (1.0 - a), rel=0.06)


def test_correlations_are_summed_until_they_vanish() -> None:
    rows = [np.array([1.0, 2.0, 1.0, -1.0]), np.array([2.0, 1.0])]
    power = 7.0 + 5.0
    lags = [(2.0 + 2.0 - 1.0 + 2.0) / power, (1.0 - 2.0) / power]
    assert correlated(rows) == pytest.approx((lags[0], 1.0 + 2.0 * lags[0]))
    assert correlated(rows, least=lags[0] + 0.01) == pytest.approx((lags[0], 1.0))
    assert correlated([np.ones(4)], longest=2) == pytest.approx((0.75, 1.0 + 2.0 * 0.75))
    assert correlated([np.ones(4)]) == pytest.approx((0.75, 1.0 + 2.0 * (0.75 + 0.5 + 0.25)))
    assert correlated([np.zeros(4)]) == (0.0, 1.0)
    assert correlated([np.ones((3, 2))])[1] == pytest.approx(1.0 + 2.0 * (2.0 / 3.0 + 1.0 / 3.0))


def test_runs_of_independent_signs_are_standard_normal_and_those_of_red_noise_few() -> None:
    """Wald and Wolfowitz's test."""
    rng = np.random.default_rng(5)
    found = np.array([_runs(rng.normal(size=(3, 60))) for _ in range(400)])
    assert found.mean() == pytest.approx(0.0, abs=4.0 / math.sqrt(400))
    assert found.std() == pytest.approx(1.0, abs=0.15)
    assert _runs(red(rng, 3, 60, 0.8)) < -3.0
    assert _runs(np.tile([1.0, -1.0], (2, 20))) > 5.0


def test_runs_by_hand() -> None:
    """Three up and two down in four runs: expected 2*3*2/5 + 1 = 3.4, variance 2.4 * 1.4 / 4 = 0.84."""
    row = np.array([1.0, -1.0, math.nan, 1.0, 1.0, -1.0])
    assert _runs(row[None]) == pytest.approx((4 - 3.4) / math.sqrt(0.84))
    # a window of one sign adds one run where half of its samples are expected
    both = np.vstack([row, np.array([1.0, 2.0, 1.0, 3.0, math.nan, math.nan])])
    assert _runs(both) == pytest.approx((5 - 3.4 - 2.0) / math.sqrt(0.84 + 1.0))
    assert _runs(np.full((2, 3), math.nan)) == 0.0


def test_a_remainder_is_told_at_its_lag_over_known_pairs() -> None:
    e = np.array([[2.0, 1.0, math.nan, 1.0, -1.0, 2.0], [0.0, 1.0, 2.0, 1.0, 0.0, -1.0]])
    found = _remainder("x", e, 2)
    size = math.sqrt((4 + 1 + 1 + 1 + 4 + 0 + 1 + 4 + 1 + 0 + 1) / 11)
    pairs = [1.0 * 1.0, 1.0 * 2.0, 0.0 * 2.0, 1.0 * 1.0, 2.0 * 0.0, 1.0 * -1.0]
    assert (found.channel, found.samples) == ("x", 11 // 2)
    assert found.size == pytest.approx(size)
    assert found.correlation == pytest.approx(sum(pairs) / 6 / size**2)
    assert found.runs == pytest.approx(_runs(e[:, ::2]))


@pytest.mark.parametrize(
    ("size", "alike", "runs", "told"),
    [(1.14, 0.0, 0.0, 0), (1.16, 0.0, 0.0, 1), (1.0, 0.29, 0.0, 0), (1.0, 0.31, 0.0, 1), (1.0, 0.0, -3.9, 0),
     (1.0, 0.0, -4.1, 1), (1.0, 0.0, 4.1, 0), (2.0, 0.9, -9.0, 3)],
)  # fmt: skip
def test_what_is_told_of_a_channel_is_what_exceeds_chance(size: float, alike: float, runs: float, told: int) -> None:
    """Of 400 samples, four deviations of a correlation are 0.2; a tenth is allowed besides."""
    one = Remainder("x", size, alike, runs, 400)
    assert len(one.warnings) == told
    assert Misfit((Remainder("y", 1.0, 0.0, 0.0, 400), one)).lacking == bool(told)
    assert len(Misfit((one,)).words) == 1 + told
