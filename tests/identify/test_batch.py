"""Many problems at once: the normal equations of one, the optimum of one, bounds, held parameters, other data."""

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.identify import FitError, Loss, Nuisance, StudyError
from seatrial.identify.trajectory.batch import Data, Many
from seatrial.identify.trajectory.gauss_newton import steps
from seatrial.identify.trajectory.multistart import MultiStart, drawn
from seatrial.identify.trajectory.objective import TrajectoryObjective
from seatrial.identify.trajectory.shooting import Trajectory
from suzaku_turns import PAPER, PATHS, SHIP, problem

ESTIMATOR = MultiStart(method="euler", initial="measured")


@pytest.fixture(scope="module")
def turns():
    return problem()


@pytest.fixture(scope="module")
def many(turns):
    return Many.like(turns, ESTIMATOR)


@pytest.mark.slow
@pytest.mark.parametrize("window", [600.0, 90.0])
def test_each_problem_has_the_normal_equations_of_its_own(turns, window):
    """Also where windows do not fill the blocks, samples are missing, and a prior pulls."""
    x = turns.trials[0]["x"].copy()
    x[100:140] = np.nan
    priors = (replace(turns.free[0], prior=1.1 * turns.free[0].start, sigma=0.1 * turns.free[0].start),)
    told = replace(turns, trials=(turns.trials[0].having(x=x), *turns.trials[1:]), free=priors + turns.free[1:])
    arguments = {"window": window, "dt": 1.0, "every": 2, "method": "rk4", "threads": 2}
    one = TrajectoryObjective.build(told, told.trials, PAPER.sigma, **arguments)
    all_ = Many.build(told, told.trials, PAPER.sigma, **arguments)
    values = drawn(told.free, 7, np.random.default_rng(3))
    found = all_.normals(values)
    for k, p in enumerate(values):
        normal = one.normal(p, np.zeros(0))
        assert found.cost[k] == pytest.approx(normal.cost, rel=1e-11)
        np.testing.assert_allclose(found.H[k], normal.H, rtol=1e-9, atol=1e-12 * np.abs(normal.H).max())
        np.testing.assert_allclose(found.g[k], normal.g, rtol=1e-9, atol=1e-10 * np.abs(normal.g).max())


@pytest.mark.slow
def test_the_number_of_threads_and_the_neighbours_change_nothing(turns, many):
    values = drawn(turns.free, 9, np.random.default_rng(0))
    found = many.normals(values)
    alone = replace(many, threads=1).normals(values[4:5])
    assert found.cost[4] == alone.cost[0]
    assert np.array_equal(found.H[4], alone.H[0])


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [pytest.param(0.3, marks=pytest.mark.long), 0.5])
def test_the_optimum_is_that_of_one_search_after_the_other(ratio):
    told = problem(ratio=ratio)
    mine = ESTIMATOR.fit(told)
    other = Trajectory(window=600.0, every=1, method="euler", starts=6, tolerance=1e-12, initial="measured").fit(told)
    assert mine.objective == pytest.approx(other.objective, rel=1e-9)
    assert mine.objective <= other.objective * (1 + 1e-12)
    assert mine.ends.shape == (20, 13)
    assert (mine.ends[:, 0] <= mine.objective * (1 + 1e-9)).sum() >= 15
    low, high = np.array([f.low for f in told.free]), np.array([f.high for f in told.free])
    assert np.all((mine.ends[:, 1:] >= low) & (mine.ends[:, 1:] <= high))


@pytest.mark.long
def test_held_parameters_stay_and_the_others_follow(turns, many):
    fit = ESTIMATOR.fit(turns)
    start = np.repeat(fit.values[None], 2, axis=0)
    start[1, 0] *= 1.02
    held = np.zeros(start.shape, dtype=bool)
    held[:, 0] = True
    ends = many.descend(start, held=held)
    assert np.array_equal(ends.values[:, 0], start[:, 0])
    assert ends.costs[0] == pytest.approx(fit.objective, rel=1e-9)
    assert fit.objective < ends.costs[1] < many.normals(start[1:]).cost[0]


@pytest.mark.slow
def test_each_problem_may_have_its_own_data(turns, many):
    other = problem(seed=2)
    theirs = Many.like(other, ESTIMATOR)
    data = Data(
        np.stack([many.windows.state0, theirs.windows.state0]),
        np.stack([many.windows.measured, theirs.windows.measured]), np.zeros((2, len(PATHS))),
    )  # fmt: skip
    values = drawn(turns.free, 2, np.random.default_rng(1))
    found = many.normals(values, data)
    assert found.cost[0] == pytest.approx(many.normals(values[:1]).cost[0], rel=1e-12)
    assert found.cost[1] == pytest.approx(theirs.normals(values[1:]).cost[0], rel=1e-12)


@pytest.mark.slow
def test_steps_are_the_best_within_the_box():
    """Against bounded least squares by another method (scipy's lsq_linear)."""
    from scipy.optimize import lsq_linear

    rng = np.random.default_rng(5)
    for _ in range(40):
        J, e = rng.normal(size=(30, 6)) @ np.diag(10.0 ** rng.uniform(-3, 2, 6)), 5.0 * rng.normal(size=30)
        low, high = -rng.uniform(0, 1, 6) * 10.0 ** rng.uniform(-3, 1), rng.uniform(0, 1, 6)
        (step,) = steps((J.T @ J)[None], (J.T @ e)[None], low[None], high[None], np.ones((1, 6), dtype=bool), 0.0)
        want = lsq_linear(J, -e, (low, high), tol=1e-14).x
        assert np.all((step >= low - 1e-12) & (step <= high + 1e-12))
        assert np.sum((J @ step + e) ** 2) <= np.sum((J @ want + e) ** 2) * (1 + 1e-9)


@pytest.mark.slow
def test_one_start_with_nuisances_is_the_search_from_there(turns):
    """Of currents, biases and an error that all trials share, as of `Trajectory`."""
    adrift = Nuisance(current=0.1, bias={"psi": 0.01}, common={"scale.u": 0.02})
    told = replace(turns, nuisance=adrift, trials=turns.trials[:2])
    mine = MultiStart(starts=1, method="euler").fit(told)
    other = Trajectory(window=600.0, every=1, method="euler", iterations=60, tolerance=1e-10).fit(told)
    assert mine.objective == pytest.approx(other.objective, rel=1e-9)
    np.testing.assert_allclose(mine.values, other.values, atol=1e-3 * other.sigma.max())
    for name, found in other.nuisances.items():
        assert mine.nuisances[name] == pytest.approx(found, abs=1e-4)


@pytest.mark.slow
def test_a_model_that_blows_up_everywhere_is_refused(turns):
    with pytest.raises(StudyError, match=r"no \[nuisance\]"):
        Many.like(replace(turns, nuisance=Nuisance(current=0.1)), ESTIMATOR)
    with pytest.raises(StudyError, match=r"estimator\.starts"):
        MultiStart(starts=0)
    wild = (Free("hull.N_r", 1e3 * abs(SHIP.model.hull.N_r), 0.9e3 * abs(SHIP.model.hull.N_r), math.inf),)
    with pytest.raises(FitError, match="blows up at every start"):
        MultiStart(starts=2).fit(replace(turns, free=wild))


def test_a_channel_the_loss_does_not_name_is_not_compared(turns):
    told = replace(turns, loss=Loss({"psi": 0.01}, 0.0))
    many = Many.like(told, ESTIMATOR)
    values = drawn(told.free, 1, np.random.default_rng(0))
    shifted = tuple(Trial(t.name, t.t, {**t.channels, "x": t["x"] + np.linspace(0, 9, len(t))}, t.units, t.meta)
                    for t in told.trials)  # fmt: skip
    moved = Many.like(replace(told, trials=shifted), ESTIMATOR)
    assert many.normals(values).cost[0] == pytest.approx(moved.normals(values).cost[0], rel=1e-12)
