"""Profiles: against the Gaussian case, the flat valley of four turning tests, verdicts in plain words."""

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import read
from seatrial.identify import Loss
from seatrial.identify.posterior.profile import THRESHOLD, profiles
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.identify.trajectory.objective import TrajectoryObjective
from suzaku_turns import GNSS, PATHS, SHIP, TRUTH, problem

ESTIMATOR = MultiStart(starts=6, method="euler", initial="measured")
SENSORS = Loss(GNSS, correlation=0.0)


@pytest.fixture(scope="module")
def noisy():
    told = problem(loss=SENSORS)
    fit = ESTIMATOR.fit(told)
    return told, fit, profiles(fit, told, ESTIMATOR)


@pytest.mark.slow
def test_where_the_model_is_nearly_linear_a_profile_is_the_parabola_of_the_covariance():
    """Two well determined parameters: the interval is 1.96 deviations to either side."""
    told = problem(loss=SENSORS, paths=("hull.R_0", "rudder.kappa"), truth=SHIP)
    fit = ESTIMATOR.fit(told)
    known = profiles(fit, told, ESTIMATOR, variance=1.0)
    many = TrajectoryObjective.plain(told, ESTIMATOR)
    sigma = np.sqrt(np.diag(np.linalg.inv(many.best(fit.values[None]).H[0])))
    for k, one in enumerate(known.profiles):
        assert one.interval[1] - fit.values[k] == pytest.approx(math.sqrt(THRESHOLD) * sigma[k], rel=0.02)
        assert fit.values[k] - one.interval[0] == pytest.approx(math.sqrt(THRESHOLD) * sigma[k], rel=0.02)
        assert one.status == "identified"
        curved = ((one.values - fit.values[k]) / sigma[k]) ** 2
        np.testing.assert_allclose(one.rise, curved, rtol=0.05, atol=1e-6)


@pytest.mark.long
def test_four_turns_leave_a_valley_that_is_flat_to_nine_digits_over_more_than_six_tenths_of_the_box():
    """Without noise: rudder and hull share the rudder's force, and nothing in a turn tells them apart."""
    told = problem(SHIP, noise={})
    fit = replace(ESTIMATOR.fit(problem(SHIP)), values=np.array([f.start for f in told.free]), objective=0.0)
    many, low, high = TrajectoryObjective.plain(told, ESTIMATOR), told.vector.low, told.vector.high
    known = profiles(fit, told, ESTIMATOR, variance=1.0)
    k = PATHS.index("rudder.t_R")
    valley = known.profiles[k]
    untuned = many.best((low + 0.7 * (high - low))[None]).cost[0]
    flat = valley.values[valley.rise <= 1e-9 * untuned]
    assert np.ptp(flat) / (valley.high - valley.low) > 0.6
    moved = (valley.others - fit.values) / (high - low)
    assert {PATHS[i] for i in np.flatnonzero(np.ptp(moved[valley.rise <= 1e-9 * untuned], axis=0) > 0.05)} >= {
        "rudder.t_R", "rudder.a_H"
    }  # fmt: skip
    assert valley.status == "not identified" or valley.loose
    words = [v for v in known.verdicts[len(PATHS) :] if v.status == "not identified"]
    assert "rudder.t_R" in words[0].subject
    assert "rudder.a_H" in words[0].subject
    assert "trade off against each other" in words[0].text


@pytest.mark.long
def test_verdicts_are_words_and_intervals_hold_the_truth(noisy):
    known = noisy[2]
    assert known.better < 1e-3
    assert {p.status for p in known.profiles} <= {"identified", "weak", "at bound", "not identified"}
    inside = sum(p.interval[0] <= read(TRUTH.model, p.free.path) <= p.interval[1] for p in known.profiles)
    assert inside >= 11
    assert known.profiles[0].status == "identified"  # the resistance
    assert known.correlation == pytest.approx(known.correlation.T)
    assert np.diag(known.correlation) == pytest.approx(np.ones(12))
    assert np.all(np.diff(known.deviations) <= 0)
    # The start is measured with noise of 1 m: its error lasts, and 7212 residuals are far fewer facts.
    assert known.independent < 500
    for v in known.verdicts:
        assert v.text
        assert "nan" not in v.text


@pytest.mark.slow
def test_a_bound_that_the_data_lean_on_is_said():
    told = problem(SHIP, loss=SENSORS, paths=("hull.R_0", "rudder.kappa"))
    shut = replace(told.free[0], high=0.99 * told.free[0].start, start=0.9 * told.free[0].start)
    told = replace(told, free=(shut, told.free[1]))
    known = profiles(ESTIMATOR.fit(told), told, ESTIMATOR)
    assert known.profiles[0].status == "at bound"
    assert "leans on its bound" in known.profiles[0].verdict.text


@pytest.mark.slow
def test_a_prior_counts_in_a_profile():
    told = problem(SHIP, loss=SENSORS, paths=("rudder.t_R", "rudder.a_H", "rudder.x_H"))
    free = tuple(replace(f, low=-math.inf, high=math.inf, prior=f.start, sigma=0.02 * abs(f.start)) for f in told.free)
    told = replace(told, free=free)
    known = profiles(ESTIMATOR.fit(told), told, ESTIMATOR)
    a, b = known.profiles[0].interval
    assert b - a <= 2.05 * math.sqrt(THRESHOLD) * free[0].sigma
