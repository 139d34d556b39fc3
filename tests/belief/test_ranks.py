"""Truths drawn from a prior within its bounds, against SciPy's distributions."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from seatrial.belief.ranks import truths
from seatrial.core.parameters import Free
from seatrial.identify import FitError
from seatrial.identify.vector import Vector


def problem(mean: list[float], sigma: list[float], low: list[float], high: list[float]) -> Any:
    arrays = {name: np.array(x, dtype=float) for name, x in zip(("mean", "sigma", "low", "high"),
                                                                 (mean, sigma, low, high), strict=True)}  # fmt: skip

    class Vector(SimpleNamespace):
        def __len__(self) -> int:
            return len(mean)

        def of_prior(self, count: int, rng: Any) -> Any:
            return self.mean + np.where(np.isfinite(self.sigma), self.sigma, 0.0) * rng.normal(size=(count, len(mean)))

    return SimpleNamespace(vector=Vector(**arrays), free=tuple(mean))


def test_truths_of_tied_priors_have_their_covariance() -> None:
    free = (Free("a", 1.0, prior=1.0, sigma=0.5), Free("b", 0.0, -2.0, 3.0),
            Free("c", 0.0, prior=-2.0, sigma=3.0, tied=(("a", -0.8),)))  # fmt: skip
    whole: Any = SimpleNamespace(vector=Vector(free), free=free)
    made = truths(whole, 20_000, np.random.default_rng(3))
    assert np.corrcoef(made[:, 0], made[:, 2])[0, 1] == pytest.approx(-0.8, abs=4.0 * 0.36 / np.sqrt(20_000))
    assert made.std(axis=0)[[0, 2]] == pytest.approx([0.5, 3.0], rel=0.02)


def test_truths_follow_the_prior_cut_at_its_bounds() -> None:
    """A normal distribution cut on one side, and an even one where no prior is stated."""
    made = truths(problem([1.0, 5.0], [0.5, np.inf], [0.8, -2.0], [9.0, 3.0]), 4000, np.random.default_rng(1))
    cut = stats.truncnorm((0.8 - 1.0) / 0.5, (9.0 - 1.0) / 0.5, loc=1.0, scale=0.5)
    assert stats.kstest(made[:, 0], cut.cdf).pvalue > 1e-3
    assert stats.kstest(made[:, 1], stats.uniform(-2.0, 5.0).cdf).pvalue > 1e-3
    assert abs(stats.spearmanr(made[:, 0], made[:, 1]).statistic) < 4.0 / np.sqrt(4000)


def test_a_prior_far_beyond_its_bounds_is_refused() -> None:
    with pytest.raises(FitError, match="next to nothing of the prior"):
        truths(problem([0.0], [1.0], [9.0], [10.0]), 3, np.random.default_rng(1))


def test_a_value_without_freedom_is_that_value() -> None:
    made = truths(problem([2.0, 0.0], [np.inf, 1.0], [2.0, -9.0], [2.0, 9.0]), 5, np.random.default_rng(2))
    assert (made[:, 0] == 2.0).all()
