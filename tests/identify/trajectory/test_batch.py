"""Many problems at once: the normal equations of one, the optimum of one, bounds, held parameters, other data."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import Free, values
from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.identify import FitError, Loss, Nuisance, StudyError
from seatrial.identify.trajectory.gauss_newton import steps
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.identify.trajectory.objective import Data, TrajectoryObjective
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.study.study import read_study
from suzaku_turns import PAPER, PATHS, SHIP, problem
from trajectories_by_hand import written_out

ESTIMATOR = MultiStart(method="euler", initial="measured")


@pytest.fixture(scope="module")
def turns():
    return problem()


@pytest.fixture(scope="module")
def many(turns):
    return TrajectoryObjective.plain(turns, ESTIMATOR)


@pytest.mark.slow
@pytest.mark.parametrize("window", [600.0, 90.0])
def test_each_problem_has_the_normal_equations_of_its_own(turns, window):
    """Also where windows do not fill the blocks, samples are missing, and a prior pulls."""
    x = turns.trials[0]["x"].copy()
    x[100:140] = np.nan
    priors = (replace(turns.free[0], prior=1.1 * turns.free[0].start, sigma=0.1 * turns.free[0].start),)
    told = replace(turns, trials=(turns.trials[0].having(x=x), *turns.trials[1:]), free=priors + turns.free[1:])
    arguments = {"window": window, "dt": 1.0, "every": 2, "method": "rk4", "threads": 2}
    objective = TrajectoryObjective.build(told, told.trials, PAPER.sigma, **arguments)
    values, every = MultiStart(starts=7, seed=3).drawn(told.vector), np.arange(7)
    found, costs = objective.normals(values, np.zeros((7, 0)), every), objective.costs(values, np.zeros((7, 0)), every)
    for k, p in enumerate(values):
        cost, H, g = written_out(objective, p, np.zeros(0))
        assert found.cost[k] == pytest.approx(cost, rel=1e-11)
        assert costs[k] == pytest.approx(cost, rel=1e-11)
        np.testing.assert_allclose(found.H[k], H, rtol=1e-9, atol=1e-12 * np.abs(H).max())
        np.testing.assert_allclose(found.g[k], g, rtol=1e-9, atol=1e-10 * np.abs(g).max())


@pytest.mark.slow
def test_problems_with_currents_biases_and_errors_of_instruments_do_not_mix(turns):
    """Each has its own current, bias and inputs; together they are what they are alone, to rounding."""
    adrift = Nuisance({"x": 1.0}, current=0.1, bias={"psi": 0.01}, common={"antenna.ahead": 9.0, "offset.delta": 0.02})
    told = replace(turns, nuisance=adrift, trials=turns.trials[:2], free=turns.free[:3])
    objective = TrajectoryObjective.like(told, Trajectory(window=200.0, threads=2))
    draw = np.random.default_rng(4)
    p = np.hstack([MultiStart(starts=5).drawn(told.vector), [9.0, 0.02] * draw.standard_normal((5, 2))])
    eta = objective.layout.deviation * draw.standard_normal((5, objective.nuisances))
    together, costs = objective.normals(p, eta, np.arange(5)), objective.costs(p, eta, np.arange(5))
    for k in range(5):
        alone, found = objective.normal(p[k], eta[k]), together.of(k)
        assert costs[k] == pytest.approx(objective.cost(p[k], eta[k]), rel=1e-12)
        np.testing.assert_allclose(found.H, alone.H, rtol=1e-9, atol=1e-11 * np.abs(alone.H).max())
        for one, other in zip(found.blocks, alone.blocks, strict=True):
            np.testing.assert_allclose(one.own, other.own, rtol=1e-9, atol=1e-11 * np.abs(other.own).max())
            np.testing.assert_allclose(one.cross, other.cross, rtol=1e-9, atol=1e-11 * np.abs(other.cross).max())
    assert (objective.residuals(p[4], eta[4])[:, 0, 0] == 0.0).all()  # the prior of x represents its first reading
    for k, size in enumerate(1e-4 * np.append(told.vector.start, 9.0)):
        moved = size * np.eye(5)[k]
        slope = (objective.cost(p[4] + moved, eta[4]) - objective.cost(p[4] - moved, eta[4])) / (2.0 * size)
        assert 2.0 * alone.g[k] == pytest.approx(slope, rel=1e-3)
    step = np.zeros(objective.nuisances)
    for block in alone.blocks:
        for at, gradient in zip(block.where.ravel(), block.gradient.ravel(), strict=True):
            step[:] = 0.0
            step[at] = 1e-3 * objective.layout.deviation[at]
            slope = (objective.cost(p[4], eta[4] + step) - objective.cost(p[4], eta[4] - step)) / (2.0 * step[at])
            assert 2.0 * gradient == pytest.approx(slope, rel=1e-4, abs=1e-6 * np.abs(block.gradient).max())


BEGUN = {"x": 0.05, "y": 0.05, "psi": 0.002, "u": 0.01, "v_m": 0.01, "r": 0.001}


@pytest.mark.slow
def test_an_initial_state_stays_within_the_noise_of_what_would_have_been_read(turns):
    """A heading that reads too much costs no more than logs without that error; an antenna begins where it is."""
    own = Nuisance(BEGUN, common={"bias.psi": 1.0, "antenna.ahead": 9.0})
    told = replace(turns, nuisance=own, trials=turns.trials[:2], free=turns.free[:3])
    b, ahead = 0.07, 3.0

    def aside(trial: Trial) -> Trial:
        x, y, psi = (trial[name] for name in ("x", "y", "psi"))
        return trial.having(x=x + ahead * np.cos(psi), y=y + ahead * np.sin(psi))

    def objective(trials: tuple[Trial, ...]) -> TrajectoryObjective:
        told_now = replace(told, trials=trials)
        return TrajectoryObjective.build(
            told_now, trials, PAPER.sigma | {"x": 1.0, "y": 1.0, "psi": 0.01}, window=200.0, dt=1.0, every=1,
            method="rk4", threads=2)  # fmt: skip

    right = objective(told.trials)
    start, eta = told.vector.start, right.layout.deviation * np.random.default_rng(2).normal(size=right.nuisances)
    plain = right.cost(np.append(start, [0.0, 0.0]), eta)
    turned = objective(tuple(t.having(psi=t["psi"] + b) for t in told.trials)).cost(np.append(start, [b, 0.0]), eta)
    assert turned - b**2 == pytest.approx(plain, rel=1e-9)
    moved = objective(tuple(map(aside, told.trials)))
    began, true = (one.lanes(np.append(start, [0.0, far])[None], eta[None])[0].state
                   for one, far in ((moved, ahead), (right, 0.0)))  # fmt: skip
    np.testing.assert_allclose(began, true, atol=1e-9)


@pytest.mark.slow
def test_derivatives_by_errors_go_through_the_initial_states_that_were_read_with_them(turns):
    names = ("bias.psi_speed", "delay.position", "scale.r", "receiver.ahead", "deviation.east")
    own = Nuisance(BEGUN, common=dict.fromkeys(names, 1.0))
    told = replace(turns, nuisance=own, trials=turns.trials[:2], free=turns.free[:3])
    objective = TrajectoryObjective.like(told, Trajectory(window=100.0, threads=2))
    p = np.append(told.vector.start, [0.03, 0.4, 0.02, 0.5, 0.02])
    eta = objective.layout.deviation * np.random.default_rng(3).normal(size=objective.nuisances)
    g = objective.normal(p, eta).g
    for k in range(3, p.size):
        step = 1e-5 * np.eye(p.size)[k]
        slope = (objective.cost(p + step, eta) - objective.cost(p - step, eta)) / 2e-5
        assert 2.0 * g[k] == pytest.approx(slope, rel=2e-4, abs=1e-6 * abs(2.0 * g).max()), names[k - 3]


@pytest.mark.slow
def test_the_number_of_threads_and_the_neighbours_change_nothing(turns, many):
    values = MultiStart(starts=9, seed=0).drawn(turns.vector)
    found = many.best(values)
    alone = replace(many, threads=1).best(values[4:5])
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
    assert fit.objective < ends.costs[1] < many.best(start[1:]).cost[0]


@pytest.mark.slow
def test_each_problem_may_have_its_own_data(turns, many):
    other = problem(seed=2)
    theirs = TrajectoryObjective.plain(other, ESTIMATOR)
    data = Data(
        np.stack([many.windows.state0, theirs.windows.state0]),
        np.stack([many.windows.measured, theirs.windows.measured]), np.zeros((2, len(PATHS))),
    )  # fmt: skip
    values = MultiStart(starts=2, seed=1).drawn(turns.vector)
    softly = replace(many, problem=replace(turns, free=tuple(replace(f, sigma=abs(f.start)) for f in turns.free)))
    means = np.stack([turns.vector.start, 0.9 * turns.vector.start])
    pulled = replace(softly, data=replace(data, mean=means)).priors(values, np.zeros((2, 0)), np.arange(2))
    assert pulled == pytest.approx((((values - means) / turns.vector.start) ** 2).sum(axis=1), rel=1e-12)
    found = replace(many, data=data).best(values)
    assert found.cost[0] == pytest.approx(many.best(values[:1]).cost[0], rel=1e-12)
    assert found.cost[1] == pytest.approx(theirs.best(values[1:]).cost[0], rel=1e-12)


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
        TrajectoryObjective.plain(replace(turns, nuisance=Nuisance(current=0.1)), ESTIMATOR)
    with pytest.raises(StudyError, match=r"estimator\.starts"):
        MultiStart(starts=0)
    wild = (Free("hull.N_r", 1e3 * abs(SHIP.model.hull.N_r), 0.9e3 * abs(SHIP.model.hull.N_r), math.inf),)
    with pytest.raises(FitError, match="blows up at every start"):
        MultiStart(starts=2).fit(replace(turns, free=wild))


def test_a_channel_the_loss_does_not_name_is_not_compared(turns):
    told = replace(turns, loss=Loss({"psi": 0.01}, 0.0))
    many = TrajectoryObjective.plain(told, ESTIMATOR)
    values = MultiStart(starts=1, seed=0).drawn(told.vector)
    shifted = tuple(Trial(t.name, t.t, {**t.channels, "x": t["x"] + np.linspace(0, 9, len(t))}, t.units, t.meta)
                    for t in told.trials)  # fmt: skip
    moved = TrajectoryObjective.plain(replace(told, trials=shifted), ESTIMATOR)
    assert many.best(values).cost[0] == pytest.approx(moved.best(values).cost[0], rel=1e-12)


def test_priors_of_errors_of_instruments_stand_below_those_of_the_parameters() -> None:
    here: Any = SimpleNamespace(common=("bias.r", "delay.psi"), deviation=np.array([0.5, np.inf]))
    held = np.array([[2.0, 1.0], [1.0, 3.0]])
    wanted = [[2.0, 1.0, 0.0, 0.0], [1.0, 3.0, 0.0, 0.0], [0.0, 0.0, 4.0, 0.0], [0.0, 0.0, 0.0, 0.0]]
    np.testing.assert_array_equal(TrajectoryObjective._with_errors(here, held), wanted)
    none: Any = SimpleNamespace(common=(), deviation=np.zeros(0))
    np.testing.assert_array_equal(TrajectoryObjective._with_errors(none, held), held)


@pytest.mark.slow
def test_starts_over_a_minute_of_an_unstable_ship_are_the_best_there_are() -> None:
    """Eight steps of Gauss and Newton ended 38 times above: the ship swings round, and parts of steps had to be taken.

    The residuals at the best start of a true model with white noise are that noise: one a number.
    """
    told = read_study(Path(__file__).parents[3] / "studies" / "milliampere_full.toml")
    sails = {name: replace(sail, current=None) for name, sail in told.virtual.sails.items() if name.startswith("surge")}
    quiet = replace(told.virtual, seed=1003, wind=Uniform(), gusts="", known=(), sails=sails)
    problem = replace(told.problem, trials=tuple(quiet.run()), nuisance=Nuisance())
    objective = TrajectoryObjective.like(problem, MultiStart(initial="free", dt=0.2, window=60.0))
    assert objective.windows.trial.size == 3
    true = np.array([values(told.virtual.ship.model)[one.path] for one in problem.free])
    found, eta = objective.settled(true[None])
    numbers = np.count_nonzero(objective.windows.scale)
    assert abs(found.cost[0] / numbers - 1.0) < 4.0 * math.sqrt(2.0 / numbers)
    assert found.cost[0] < objective.cost(true, 0.0 * eta[0]) / 100.0  # from far away


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1003, 1010])
def test_starts_beside_currents_of_each_trial_are_the_best_there_are(seed: int) -> None:
    """They are sought from known currents and from still water; of twelve fits two had ended wrong."""
    told = read_study(Path(__file__).parents[3] / "studies" / "milliampere_aft.toml")
    quiet = replace(told.virtual, seed=seed, wind=Uniform(), gusts="", known=())
    problem = replace(told.problem, trials=tuple(one for one in quiet.run() if not one.name.startswith("unseen")))
    objective = TrajectoryObjective.like(problem, MultiStart(initial="free", dt=0.2, window=60.0))
    true = np.array([values(told.virtual.ship.model)[one.path] for one in problem.free])
    numbers = np.count_nonzero(objective.windows.scale)
    known = {one.name: dict.fromkeys(objective.layout.own.names, 0.05) for one in problem.trials}
    for given in ({}, known):
        eta = objective.begun(true, known=given)
        assert abs(objective.cost(true, eta) / numbers - 1.0) < 4.0 * math.sqrt(2.0 / numbers), given
