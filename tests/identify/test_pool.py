"""Searches through a pool: the numbers are those of one process, and a piece fits through a pickle."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from seatrial import __version__
from seatrial.belief.ensemble import ensemble
from seatrial.core.errors import RunError
from seatrial.core.executors import Pool, at_version
from seatrial.identify import Spread
from seatrial.identify.networks.widths import Widths
from seatrial.identify.posterior.profile import profiles
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.identify.tuning.fine_tuning import FineTuning
from suzaku_turns import problem

PATHS = ("hull.R_0", "rudder.kappa")


class Pickling:
    """An executor that sends everything through a pickle, both ways, as a worker gets it."""

    def __init__(self, threads: ThreadPoolExecutor) -> None:
        self.threads, self.sent = threads, 0

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Future[Any]:
        self.sent += 1
        return self.threads.submit(_there_and_back, pickle.dumps((fn, args)))


def _there_and_back(piece: bytes) -> Any:
    fn, args = pickle.loads(piece)
    return pickle.loads(pickle.dumps(fn(*args)))


@pytest.fixture
def sent():
    with ThreadPoolExecutor(2) as threads:
        yield Pickling(threads)


def pool(sent: Pickling, width: int) -> Pool:
    return Pool(sent, lambda: width, away=True)


@pytest.mark.slow
@pytest.mark.parametrize("estimator", [
    MultiStart(starts=5, method="euler", iterations=8),
    Trajectory(window=100.0, starts=3, method="euler", iterations=4),
])  # fmt: skip
def test_starts_elsewhere_end_where_they_end_here(estimator: Any, sent: Pickling) -> None:
    told = problem(paths=PATHS)
    here, there = estimator.fit(told), estimator.fit(told, pool=pool(sent, 3))
    assert sent.sent == 3
    assert np.array_equal(here.values, there.values)
    assert np.array_equal(here.ends, there.ends)
    assert np.array_equal(here.history[:, :2], there.history[:, :2])
    assert here.digest == there.digest


@pytest.mark.slow
@pytest.mark.parametrize("initial", ["measured", "free"])
def test_repetitions_and_profiles_are_the_same_however_they_are_dealt(initial: str, sent: Pickling) -> None:
    told, settings = problem(paths=PATHS), MultiStart(starts=2, method="euler", initial=initial)
    fit = settings.fit(told)
    whole, apart = (ensemble(fit, told, settings, members=7, pool=p) for p in (None, pool(sent, 3)))
    assert np.array_equal(whole.values, apart.values)
    one, other = (profiles(fit, told, settings, pool=p) for p in (None, pool(sent, 2)))
    for a, b in zip(one.profiles, other.profiles, strict=True):
        assert np.array_equal(a.values, b.values)
        assert np.array_equal(a.rise, b.rise)
    assert sent.sent == 5


@pytest.mark.long
def test_a_fine_tuning_is_the_same(sent: Pickling) -> None:
    told = problem(paths=PATHS)
    own = FineTuning(ratios=(0.2, 0.4), population=6, largest=12, agree=2, starts=2, fold_starts=1,
                     method="euler", initial="measured")  # fmt: skip
    here, there = own.tune(told), own.tune(told, pool=pool(sent, 2))
    assert here.chosen == there.chosen
    for a, b in zip(here.ranges, there.ranges, strict=True):
        assert np.array_equal(a.fit.values, b.fit.values)
        assert np.array_equal(a.soft, b.soft)
        assert a.left_out == b.left_out


def test_who_takes_a_pool() -> None:
    assert all(isinstance(one, Spread) for one in (MultiStart(), Trajectory(), FineTuning(), Widths()))


def test_a_worker_of_another_version_refuses() -> None:
    assert at_version(__version__, max, 1, 2) == 2
    with pytest.raises(RunError, match="a worker has seatrial"):
        at_version("0.0.1", max, 1, 2)
