"""What the data do not determine is as wide as it can be, is said so, and stays where it began."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.core.parameters import Free, near
from seatrial.data import Array, Trial
from seatrial.identify import Fit, Problem
from seatrial.identify.posterior import information
from seatrial.identify.posterior.verdicts import posterior, verdicts
from seatrial.identify.regression.regression import Regression
from seatrial.identify.trajectory.gauss_newton import Normal
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.identify.trajectory.shooting import OneStep, Trajectory
from seatrial.manoeuvres.straight import Straight
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

SENSORS = {"x": 0.02, "y": 0.02, "psi": 0.003, "u": 0.01, "v_m": 0.01, "r": 0.002}
SHIP = load("kvlcc2_l7")
DEG, N_P = math.radians(1.0), 10.4


def _noisy(trial: Trial, seed: int, factor: float = 1.0) -> Trial:
    rng = np.random.default_rng(seed)
    logged = {name: trial[name] + factor * rng.normal(0.0, level, len(trial)) for name, level in SENSORS.items()}
    return Trial(trial.name, trial.t, {**logged, "delta": trial["delta"], "n_P": trial["n_P"]}, meta=dict(trial.meta))


def _trials(factor: float = 1.0, **true: float) -> tuple[Trial, ...]:
    """A zigzag and a turn of a ship whose named parameters are so many times those of the file."""
    known = {path.replace("__", "."): size for path, size in true.items()}
    start = {f.path: f.start for f in near(SHIP.model, *known, ratio=0.1)} if known else {}
    ship = SHIP.having({path: size * start[path] for path, size in known.items()})
    runs = (Zigzag(N_P, 20.0 * DEG, 20.0 * DEG), Turning(N_P, 35.0 * DEG))
    return tuple(_noisy(simulate(ship, policy, duration=60.0, dt=0.1, name=f"{k}"), k, factor)
                 for k, policy in enumerate(runs))  # fmt: skip


def _off(fit: Fit, **true: float) -> Array:
    """Distance of the truth from the estimates [sigma]."""
    start = {f.path: f.start for f in fit.free}
    truth = [start[path] * true.get(path.replace(".", "__"), 1.0) for path in start]
    return np.abs(fit.values - np.array(truth)) / fit.sigma


def _status(fit: Fit) -> dict[str, str]:
    return {v.subject: v.status for v in fit.verdicts}


# The inverse of a matrix of information


def test_covariance_is_the_inverse_where_everything_is_determined() -> None:
    rng = np.random.default_rng(3)
    J = rng.normal(size=(50, 4)) * [1e-5, 1.0, 300.0, 2e4]
    A = J.T @ J
    exact = np.linalg.inv(A * np.outer(1.0 / np.sqrt(np.diag(A)), 1.0 / np.sqrt(np.diag(A))))
    exact = exact / np.sqrt(np.outer(np.diag(A), np.diag(A)))
    assert information.covariance(A, np.full(4, 1e9)) == pytest.approx(exact, rel=1e-9)
    assert information.inverse(A) == pytest.approx(exact, rel=1e-9)


def test_with_scores_of_another_scatter_it_is_the_sandwich() -> None:
    """White (1980): of the least-squares estimate under readings of unequal noise, by propagation of that noise."""
    rng = np.random.default_rng(5)
    J, noise = rng.normal(size=(30, 3)), rng.uniform(0.5, 3.0, 30)
    estimator = np.linalg.pinv(J) * noise
    found = information.covariance(J.T @ J, np.ones(3), (J.T * noise**2) @ J)
    assert found == pytest.approx(estimator @ estimator.T, rel=1e-9)


def test_what_the_data_know_worse_than_the_interval_is_as_wide_as_the_interval() -> None:
    free = (Free("a", 1.0, 0.5, 1.5),)
    for alone in (0.1, 50.0, 5000.0):  # what the data say
        covariance, _ = posterior(Normal(0.0, np.array([[alone**-2.0]]), np.zeros(1)), free, np.ones(1), 1.0)
        assert covariance[0, 0] == pytest.approx(1.0 / (alone**-2.0 + 0.5**-2.0), rel=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_flat_directions_are_those_of_the_svd_and_as_wide_as_the_reach(seed: int) -> None:
    """Of columns that lie in a plane, the null space has the spread of a Gaussian of that reach held to it."""
    rng = np.random.default_rng(seed)
    J = 1e4 * rng.normal(size=(40, 2)) @ rng.normal(size=(2, 5))
    reach = rng.uniform(0.5, 2.0, 5)
    _, size, along = np.linalg.svd(J * reach)
    assert size[2] < 1e-12 * size[0]
    null = along[2:].T * reach[:, None]
    found = information.covariance(J.T @ J, reach)
    assert found == pytest.approx(null @ null.T, abs=1e-5)
    assert (np.einsum("ij,jk,ik->i", J, found, J) < 1.0 + 1e-6).all()  # no reading is predicted worse than it was read


@pytest.mark.parametrize(("row", "sign"), [((1.0, 1.0), "trade off"), ((1.0, -1.0), "rise and fall together")])
def test_a_sum_trades_off_and_a_difference_rises_and_falls_together(row: tuple[float, float], sign: str) -> None:
    free = (Free("a", 1.0, 0.5, 1.5), Free("b", 2.0, 1.0, 3.0))
    values = np.array([1.0, 2.0])
    covariance, share = posterior(Normal(0.0, 1e8 * np.outer(row, row), np.zeros(2)), free, values, 1.0)
    found = {v.subject: v for v in verdicts(free, values, covariance, share, ())}
    assert found["a"].status == found["b"].status == "not identified"
    assert sign in found["a and b"].text
    assert np.array(row) @ covariance @ row == pytest.approx(1e-8, rel=1e-2)
    # An interval is as good as a prior of its half width: the line across is as wide as both allow.
    assert covariance[0, 0] == pytest.approx(1.0 / (1.0 / 0.5**2 + 1.0 / 1.0**2), rel=1e-6)


def test_three_that_only_act_by_their_sum_are_named_together() -> None:
    free = tuple(Free(name, 1.0, 0.5, 1.5) for name in "abcd")
    H = 1e8 * np.outer([1.0, 1.0, 1.0, 0.0], [1.0, 1.0, 1.0, 0.0]) + 1e8 * np.diag([0.0, 0.0, 0.0, 1.0])
    covariance, share = posterior(Normal(0.0, H, np.zeros(4)), free, np.ones(4), 1.0)
    found = {v.subject: v.status for v in verdicts(free, np.ones(4), covariance, share, ())}
    assert found == {"a": "not identified", "b": "not identified", "c": "not identified", "d": "identified",
                     "a, b and c": "weak"}  # fmt: skip


def test_the_reach_holds_the_truth_from_any_place_in_the_interval() -> None:
    """From the edge of an interval the truth is at most two half widths away, and sigma is as wide."""
    free = (Free("a", 1.0, 0.5, 1.5), Free("b", 1.0, 0.5, 1.5))
    for edge in (0.5, 0.75, 1.5):
        values = np.array([edge, 2.0 - edge])
        covariance, _ = posterior(Normal(0.0, 1e10 * np.ones((2, 2)), np.zeros(2)), free, values, 1.0)
        farthest = max(1.5 - edge, edge - 0.5)
        assert farthest / math.sqrt(covariance[0, 0]) == pytest.approx(math.sqrt(2.0), rel=1e-3)


def test_exact_data_do_not_turn_a_flat_direction_into_a_known_one() -> None:
    free = (Free("a", 1.0, 0.5, 1.5), Free("b", 1.0, 0.5, 1.5))
    covariance, share = posterior(Normal(0.0, np.ones((2, 2)), np.zeros(2)), free, np.ones(2), 0.0)
    assert np.sqrt(np.diag(covariance)) == pytest.approx(0.5 / math.sqrt(2.0), rel=1e-3)
    assert share == pytest.approx(0.0)


# Fits


@pytest.mark.slow
@pytest.mark.parametrize("estimator", [Trajectory(), MultiStart(starts=3)], ids=["gradient", "multi-start"])
def test_two_inertias_of_which_only_the_sum_acts_are_not_identified(estimator: Trajectory | MultiStart) -> None:
    trials = _trials(body__I_zG=1.15)
    fit = estimator.fit(Problem(SHIP, trials, near(SHIP.model, "body.I_zG", "body.J_z", ratio=0.3)))
    assert {"body.I_zG": "not identified", "body.J_z": "not identified"}.items() <= _status(fit).items()
    assert (_off(fit, body__I_zG=1.15) < 2.0).all()
    (pair,) = [v for v in fit.verdicts if v.subject == "body.I_zG and body.J_z"]
    assert pair.text == "only body.I_zG + body.J_z acts: fix one of them"
    # The sum is known, and by finite differences of the simulation only the sum acts.
    both = float(np.sqrt(np.ones(2) @ fit.covariance @ np.ones(2)))
    assert abs(fit.values.sum() - sum(f.start for f in fit.free) - 0.15 * fit.free[0].start) < 4.0 * both
    assert both < 0.05 * fit.sigma[0]
    assert _singular(("body.I_zG", "body.J_z"))[1] < 1e-6 * _singular(("body.I_zG", "body.J_z"))[0]


def _singular(paths: tuple[str, ...]) -> Array:
    """Singular values of the derivatives of the readings over their noise, by relative changes of the parameters."""
    start = {f.path: f.start for f in near(SHIP.model, *paths, ratio=0.1)}

    def read(values: dict[str, float]) -> Array:
        run = simulate(SHIP.having(values), Zigzag(N_P, 20.0 * DEG, 20.0 * DEG), duration=30.0, dt=0.1)
        return np.concatenate([run[name] / level for name, level in SENSORS.items()])

    step = 1e-3
    columns = [(read({path: start[path] * (1.0 + step)}) - read({path: start[path] * (1.0 - step)})) / (2.0 * step)
               for path in paths]  # fmt: skip
    return np.asarray(np.linalg.svd(np.column_stack(columns), compute_uv=False), dtype=np.float64)


@pytest.mark.slow
def test_a_product_of_two_is_not_identified_and_what_stands_beside_it_is() -> None:
    trials = _trials(rudder__A_R=1.2)
    free = near(SHIP.model, "rudder.A_R", "rudder.f_alpha", "hull.N_r", ratio=0.5)
    fit = Trajectory().fit(Problem(SHIP, trials, free))
    found = _status(fit)
    assert found["rudder.A_R"] == found["rudder.f_alpha"] == "not identified"
    assert found["hull.N_r"] == "identified"
    assert (_off(fit, rudder__A_R=1.2) < 3.0).all()
    told = next(v.text for v in fit.verdicts if v.subject == "rudder.A_R and rudder.f_alpha")
    assert told == "only rudder.A_R * rudder.f_alpha acts: fix one of them"


@pytest.mark.slow
def test_a_parameter_without_influence_stays_at_its_start_and_the_data_do_not_want_it_elsewhere() -> None:
    straight = _noisy(simulate(SHIP, Straight(N_P), duration=60.0, dt=0.1, name="straight"), 3)
    fit = Trajectory().fit(Problem(SHIP, (straight,), near(SHIP.model, "hull.N_rrr", "hull.R_0", ratio=0.5)))
    assert fit.values[0] == fit.free[0].start
    assert fit.at_bound == ()
    assert _status(fit)["hull.N_rrr"] == "not identified"
    assert fit.sigma[0] == pytest.approx(fit.free[0].high - fit.free[0].start, rel=1e-3)
    assert _status(fit)["hull.R_0"] == "identified"


@pytest.mark.slow
def test_a_branch_that_no_trial_enters_leaves_its_parameter_where_it_was() -> None:
    """A turn to starboard has one sign of the flow at the rudder, and nothing says what the other would be."""
    free = near(SHIP.model, "rudder.gamma_Rn", "hull.N_r", ratio=0.3)
    fit = Trajectory().fit(Problem(SHIP, _trials()[1:], free))
    assert _status(fit) == {"rudder.gamma_Rn": "not identified", "hull.N_r": "identified"}
    assert fit.values[0] == free[0].start


# Estimators that take measured states as exact


@pytest.mark.slow
@pytest.mark.parametrize(("estimator", "factor"), [(OneStep(), 3.0), (Regression(), 10.0)], ids=["steps", "windows"])
def test_noise_of_measured_states_caps_the_verdicts_of_a_regression(
    estimator: OneStep | Regression, factor: float
) -> None:
    """Noisy velocities attenuate (errors in variables); long predictions tell, and sigma covers the pull."""
    trials = _trials(factor)
    fit = estimator.fit(Problem(SHIP, trials, near(SHIP.model, "hull.N_r", "hull.N_v", "hull.Y_v", ratio=0.9)))
    assert "identified" not in _status(fit).values()
    assert fit.diagnosis is not None
    assert fit.diagnosis.lacking
    assert (_off(fit) < 2.0).all()
    pulled = np.array(list(fit.diagnosis.pulled.values()))
    own = fit.sigma / np.sqrt(1.0 + pulled**2)  # what the residuals of its own steps say
    assert fit.sigma == pytest.approx(np.hypot(own, own * pulled))
    assert any("pulls this fit" in line for line in fit.diagnosis.lines) == bool((abs(pulled) > 2.0).any())
    if isinstance(estimator, OneStep):
        assert (_off(fit) * fit.sigma / own).max() > 3.0  # which is no interval about the truth


@pytest.mark.slow
def test_a_regression_on_clean_logs_keeps_its_verdict() -> None:
    trials = _trials(0.05)
    fit = OneStep().fit(Problem(SHIP, trials, near(SHIP.model, "hull.N_r", ratio=0.5)))
    assert _status(fit) == {"hull.N_r": "identified"}
    assert (_off(fit) < 3.0).all()
