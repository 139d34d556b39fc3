"""The box of CMA-ES: both penalties find an optimum in a corner, and say what they are."""

from __future__ import annotations

import numpy as np
import pytest
from cmaes import CMA

from seatrial.identify import StudyError
from seatrial.identify.population.evolution import Evolution
from seatrial.identify.population.penalty import KINDS, Adaptive, penalty
from seatrial.identify.tuning.fine_tuning import FineTuning

# Half of the optimum lies outside of the box, and the parameters are not alike in scale.
AIM, WEIGHTS = np.array([-0.5, 1.4, 0.3, 0.7, 2.0]), 10.0 ** np.arange(5.0)
INSIDE = np.clip(AIM, 0.0, 1.0)


def bowl(x: np.ndarray) -> np.ndarray:
    return (WEIGHTS * (x - AIM) ** 2).sum(axis=-1)


def search(name: str, generations: int = 250) -> tuple[np.ndarray, CMA]:
    """Best point of the box that a run finds."""
    strategy = CMA(mean=np.full(5, 0.5), sigma=0.3, population_size=12, seed=3)
    keeps, best = penalty(name, np.full(5, 0.5)), np.full(5, 0.5)
    for _ in range(generations):
        asked = np.array([strategy.ask() for _ in range(12)])
        inside = np.clip(asked, 0.0, 1.0)
        costs = bowl(inside)
        strategy.tell(list(zip(asked, keeps.values(asked, inside, costs, strategy).tolist(), strict=True)))
        best = min((best, *inside), key=bowl)
    return best, strategy


@pytest.mark.slow
@pytest.mark.parametrize("name", list(KINDS))
def test_an_optimum_in_a_corner_is_found(name: str) -> None:
    best, strategy = search(name)
    assert best == pytest.approx(INSIDE, abs=2e-3)
    # The mean does not wander off to the optimum outside.
    assert np.abs(strategy.mean - INSIDE).max() < 0.5


@pytest.mark.parametrize("name", list(KINDS))
def test_a_candidate_that_blows_up_is_the_worst(name: str) -> None:
    strategy = CMA(mean=np.full(5, 0.5), sigma=0.1, population_size=4, seed=1)
    asked = np.full((4, 5), 0.5) + 0.1 * np.arange(4)[:, None]
    seen = penalty(name, np.full(5, 0.5)).values(asked, asked, np.array([2.0, np.inf, 1.0, np.inf]), strategy)
    assert list(np.argsort(seen)) == [2, 0, 1, 3]


def test_weights_are_zero_inside_and_grow_where_the_mean_is_far_outside() -> None:
    keeps = Adaptive(np.full(2, 0.5))
    for mean, grows in (([0.5, 0.5], []), ([0.5, 1.2], []), ([0.5, 1.2], [1]), ([0.5, 1.02], [])):
        strategy = CMA(mean=np.array(mean), sigma=0.05, population_size=8, seed=1)
        before = keeps.gamma.copy()
        asked = np.array([strategy.ask() for _ in range(8)])
        inside = np.clip(asked, 0.0, 1.0)
        keeps.values(asked, inside, bowl2(inside), strategy)
        if mean == [0.5, 0.5]:
            assert not keeps.gamma.any()
        elif before.any():
            assert list(np.flatnonzero(keeps.gamma > before)) == grows
    assert keeps.gamma[1] > keeps.gamma[0] > 0


def bowl2(x: np.ndarray) -> np.ndarray:
    return (x**2).sum(axis=1)


@pytest.mark.parametrize("estimator", [Evolution, FineTuning])
def test_a_penalty_that_is_not_there(estimator: type) -> None:
    with pytest.raises(StudyError, match=r"estimator.penalty is 'resample'; it must be one of spread, hansen2009"):
        estimator(penalty="resample")
