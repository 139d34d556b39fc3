"""Trajectory least squares: exact normal equations, bounds, gaps, nuisances, threads, and coming back from a kill."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import Free, ParameterError, near, read
from seatrial.identify import FitError, Loss, Nuisance, Problem, StudyError
from seatrial.identify.posterior.verdicts import posterior
from seatrial.identify.resume import ResumeError
from seatrial.identify.trajectory.gauss_newton import Block, Normal
from seatrial.identify.trajectory.objective import TrajectoryObjective
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

SHIP = load("kvlcc2_l7")
SIGMA = {"x": 1.0, "y": 1.0, "psi": 0.1, "u": 0.05, "v_m": 0.05, "r": 0.01}
PATHS = ("hull.R_0", "hull.N_r", "rudder.t_R", "propeller.w_P0")


@pytest.fixture(scope="module")
def trials():
    n_P = approach(SHIP)[1]
    policies = (Turning(n_P=n_P, delta=0.4), Zigzag(n_P=n_P, delta=math.radians(20), psi=math.radians(20)))
    return tuple(simulate(SHIP, p, duration=60.0, dt=0.1, name=f"t{i}") for i, p in enumerate(policies))


def problem_of(trials, *, factor=1.1, nuisance=None, **bounds):
    free = tuple(Free(p, factor * read(SHIP.model, p), prior=read(SHIP.model, p),
                      sigma=0.5 * abs(read(SHIP.model, p)), **bounds) for p in PATHS)  # fmt: skip
    return Problem(SHIP, trials, free, Loss(SIGMA), nuisance or Nuisance())


def objective_of(problem, window=25.0):
    return TrajectoryObjective.build(
        problem, problem.trials, SIGMA, window=window, dt=0.1, every=5, method="rk4", threads=1
    )


NUISANCE = Nuisance(initial={"u": 0.01, "r": 0.001}, current=0.05, bias={"psi": 0.01, "u": 0.01})


@pytest.mark.slow
@pytest.mark.parametrize("nuisance", [Nuisance(), NUISANCE], ids=["plain", "with nuisances"])
def test_the_gradient_is_that_of_the_cost(trials, nuisance):
    problem = problem_of(trials, nuisance=nuisance)
    objective = objective_of(problem)
    rng = np.random.default_rng(1)
    p = np.array([f.start for f in problem.free])
    eta = 0.3 * objective.layout.deviation * rng.standard_normal(objective.nuisances)
    normal = objective.normal(p, eta)
    assert normal.cost == pytest.approx(objective.cost(p, eta), rel=1e-12)
    for k in range(p.size):
        step = np.zeros_like(p)
        step[k] = 1e-6 * abs(p[k])
        slope = (objective.cost(p + step, eta) - objective.cost(p - step, eta)) / (2 * step[k])
        assert 2 * normal.g[k] == pytest.approx(slope, rel=2e-5, abs=1e-6 * abs(slope) + 1e-6)
    for block in normal.blocks:
        for k, gradient in zip(block.where.ravel(), block.gradient.ravel(), strict=True):
            step = np.zeros_like(eta)
            step[k] = 1e-5 * objective.layout.deviation[k]
            slope = (objective.cost(p, eta + step) - objective.cost(p, eta - step)) / (2 * step[k])
            assert 2 * gradient == pytest.approx(slope, rel=1e-4, abs=1e-3)


@pytest.mark.slow
def test_a_free_initial_state_is_held_to_its_measurement_once(trials):
    """By the prior of its offset; rows later on count as before."""
    free, plain = (objective_of(problem_of(trials, nuisance=n)) for n in (NUISANCE, Nuisance()))
    assert (free.windows.scale[:, 0, [3, 5]] == 0.0).all()
    np.testing.assert_array_equal(free.windows.scale[:, 0, [0, 1, 2, 4]], plain.windows.scale[:, 0, [0, 1, 2, 4]])
    np.testing.assert_array_equal(free.windows.scale[:, 1:], plain.windows.scale[:, 1:])


@pytest.mark.slow
def test_a_step_whose_squares_overflow_costs_infinity_without_a_warning(trials):
    objective = objective_of(problem_of(trials))
    far = np.where(objective.windows.scale > 0, 1e200, 0.0)
    objective = replace(objective, windows=replace(objective.windows, measured=far))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        p = np.array([f.start for f in objective.problem.free])
        assert objective.cost(p, np.zeros(0)) == math.inf
        assert objective.standardised(p) == math.inf


@pytest.mark.slow
def test_a_known_current_and_a_sensor_bias_are_found_as_nuisances(trials):
    drift = 0.03
    shifted = tuple(t.having(x=t["x"] + drift * t.t, u=t["u"] + 0.02) for t in trials)
    # over ground everything drifts north, while u and v_m follow the drift in ship axes
    shifted = tuple(
        t.having(u=t["u"] + drift * np.cos(t["psi"]), v_m=t["v_m"] - drift * np.sin(t["psi"])) for t in shifted
    )
    sharp = Loss(SIGMA, correlation=0.0)
    nuisance = Nuisance(initial={"u": 0.05}, current=1.0, bias={"u": 0.1})
    problem = replace(problem_of(shifted, nuisance=nuisance), loss=sharp)
    fit = Trajectory(window=60.0, every=5, method="rk4", tolerance=1e-10).fit(problem)
    for path, value in zip(PATHS, fit.values, strict=True):
        assert value == pytest.approx(read(SHIP.model, path), rel=0.02), path


@pytest.mark.slow
def test_gaps_are_skipped_not_filled(trials):
    x = trials[0]["x"].copy()
    x[100:200] = np.nan
    holed = (trials[0].having(x=x), trials[1])
    fit = Trajectory(window=60.0, every=5, tolerance=1e-8).fit(problem_of(holed))
    for path, value in zip(PATHS, fit.values, strict=True):
        assert value == pytest.approx(read(SHIP.model, path), rel=0.02), path
    objective = objective_of(problem_of(holed), window=60.0)
    assert objective.windows.scale[0, 25, 0] == 0.0
    assert objective.windows.scale[0, 25, 1] > 0.0


@pytest.mark.slow
def test_bounds_hold_and_are_reported(trials):
    truth = read(SHIP.model, "hull.N_r")
    free = (Free("hull.N_r", 1.3 * truth, low=1.4 * truth, high=1.2 * truth), Free("hull.R_0", 0.02))
    fit = Trajectory(window=60.0, every=5).fit(Problem(SHIP, trials, free, Loss(SIGMA)))
    assert fit.values[0] == 1.2 * truth
    assert fit.at_bound == ("hull.N_r",)
    assert fit.verdicts[0].status == "at bound"
    assert "on its bound" in fit.verdicts[0].text


@pytest.mark.slow
def test_the_outcome_depends_neither_on_threads_nor_on_the_caller(trials):
    problem = problem_of(trials)
    one, two = (Trajectory(window=2.0, every=5, threads=n).fit(problem) for n in (1, 2))
    assert np.array_equal(one.values, two.values)
    assert one.digest == two.digest
    assert problem == problem_of(trials)


@pytest.mark.slow
def test_a_killed_run_ends_with_the_same_numbers(trials, tmp_path):
    problem, estimator = problem_of(trials, factor=1.4), Trajectory(window=30.0, every=5, starts=2, tolerance=1e-9)
    whole = estimator.fit(problem)
    checkpoint = tmp_path / "state.npz"

    def kill(iteration, objective, validation):
        if iteration == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        estimator.fit(problem, progress=kill, checkpoint=checkpoint)
    resumed = estimator.fit(problem, checkpoint=checkpoint)
    assert np.array_equal(whole.values, resumed.values)
    assert np.array_equal(whole.history[:, :2], resumed.history[:, :2])
    with pytest.raises(ResumeError, match=r"belongs to another problem"):
        Trajectory(window=20.0).fit(problem, checkpoint=checkpoint)


@pytest.mark.slow
def test_validation_is_watched_and_never_fitted(trials):
    alone = Trajectory(window=30.0, every=5).fit(problem_of(trials[:1]))
    later = trials[1].rows(slice(20, None))  # both begin with the same straight run
    watched = Trajectory(window=30.0, every=5).fit(replace(problem_of(trials[:1]), validation=(later,)))
    assert np.array_equal(alone.values, watched.values)
    assert np.isfinite(watched.history[:, 2]).all()


@pytest.mark.slow
def test_a_model_that_blows_up_is_named_with_trial_state_and_time(trials):
    free = (Free("hull.N_r", 500.0),)
    with pytest.raises(FitError, match=r"blows up at every start; trial t0, window lane 0: \w+ = .* at t ="):
        Trajectory(window=60.0).fit(Problem(SHIP, trials, free, Loss(SIGMA)))


def test_an_interval_needs_width_and_must_hold_the_start():
    with pytest.raises(ParameterError, match=r"hull.Y_v: the interval \[1, 1\] has no width"):
        Free("hull.Y_v", 1.0, 1.0, 1.0)
    with pytest.raises(ParameterError, match="exclude the start 3"):
        Free("hull.Y_v", 3.0, 1.0, 2.0)
    with pytest.raises(ParameterError, match=r"near: rudder\.t_R"):
        near(SHIP.model, "ruder.t_R", ratio=0.1)


def test_the_posterior_of_a_known_normal_is_exact():
    """Two parameters, data on the first only: the second keeps its prior."""
    free = (Free("a", 0.0, prior=0.0, sigma=1.0), Free("b", 0.0, prior=0.0, sigma=2.0))
    H = np.diag([99.0 + 1.0, 0.25])
    covariance, share = posterior(Normal(0.0, H, np.zeros(2)), free, np.zeros(2), 1.0)
    np.testing.assert_allclose(np.diag(covariance), [0.01, 4.0], rtol=1e-10)
    np.testing.assert_allclose(share, [0.99, 0.0], atol=1e-10)


def test_eliminating_nuisances_is_the_inverse_of_the_joint_hessian():
    rng = np.random.default_rng(0)
    J = rng.standard_normal((30, 5))
    joint, g = J.T @ J, J.T @ rng.standard_normal(30)
    block = Block(np.arange(2)[None], joint[None, 3:, 3:], joint[None, 3:, :3], g[None, 3:])
    H, gradient = Normal(0.0, joint[:3, :3], g[:3], (block,)).reduced(0.0)
    np.testing.assert_allclose(np.linalg.inv(H), np.linalg.inv(joint)[:3, :3], rtol=1e-9)
    np.testing.assert_allclose(np.linalg.solve(H, gradient), np.linalg.solve(joint, g)[:3], rtol=1e-9)


def test_impossible_settings_are_refused_by_name():
    with pytest.raises(StudyError, match=r"estimator\.window is -5; it must be above zero"):
        Trajectory(window=-5.0)
    with pytest.raises(ValueError, match="no integration method 'rk5'; known: rk4, euler"):
        Trajectory(method="rk5")
