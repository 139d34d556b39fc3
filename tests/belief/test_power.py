"""What trials that are left out in turn say of a posterior: little of a right model, much of a wrong one."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from seatrial.belief.parts import left_out
from seatrial.belief.posterior import Posterior
from seatrial.belief.power import Power, directions
from seatrial.belief.weighing import power
from seatrial.core.errors import RequestError
from seatrial.core.parameters import Free, near, read
from seatrial.core.records import from_json
from seatrial.data import Trial
from seatrial.identify import Loss, StudyError
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.sensors import Sensors
from suzaku_turns import GNSS, SHIP, TRUTH, problem, turn

ESTIMATOR = Trajectory(window=200.0, every=10, method="euler", initial="measured", threads=2)
PATHS = ("hull.R_0", "rudder.kappa", "hull.N_r")
FREE = (Free("a", 1.0, prior=1.0, sigma=0.5), Free("b", 2.0, prior=2.0, sigma=0.1), Free("c", 3.0))
COVARIANCE = np.array([[0.01, 0.002, 0.0], [0.002, 0.0099, 0.0], [0.0, 0.0, 0.04]])
MEAN = np.array([1.0, 2.0, 3.0])
SURE = 10**6
"""So many trials that the factor is known."""


def turns(ships, seed=1):
    """Two noisy turns of each ship, to be explained by one."""
    angles = (10, -20, 35, -35, 20, -10)
    told = problem(SHIP, loss=Loss(GNSS, correlation=0.0), angles=(10,), paths=PATHS, duration=200.0)
    rng, sensors = np.random.default_rng(seed), Sensors(GNSS)
    runs = [sensors.read(turn(ships[k % len(ships)], angle, 200.0), rng) for k, angle in enumerate(angles)]
    trials = tuple(Trial(run.name, run.t, run.channels, run.units, run.meta) for run in runs)
    free = tuple(replace(f, prior=f.start, sigma=0.3 * abs(f.start)) for f in near(SHIP.model, *PATHS, ratio=0.9))
    return replace(told, trials=trials, free=free)


def drawn(factor, left=1.0, trials=SURE, count=60_000):
    rng = np.random.default_rng(0)
    across, fixed = directions(FREE, COVARIANCE)
    wide = Power(factor, trials, {}, left).deviations(fixed, count, rng)
    return MEAN + (wide * rng.standard_normal((count, 3))) @ across.T


def judged(told, by=ESTIMATOR):
    """Power of a fit by each trial left out in turn."""
    fit = by.fit(told)
    held = Posterior(fit.ship, fit.free, fit.values, fit.covariance)
    return fit, power(fit, told, by, [*left_out(by, told, fit, held, out=[[one] for one in told.trials])])


def test_a_likelihood_that_counts_in_full_leaves_the_posterior_as_it_is():
    assert np.cov(drawn(1.0).T) == pytest.approx(COVARIANCE, abs=5e-4)


def test_the_less_a_likelihood_counts_the_nearer_is_the_prior():
    """A direction that the data fix widens by the root of the factor, one that they leave open not at all."""
    found = drawn(9.0).std(axis=0)
    precision = np.linalg.inv(COVARIANCE) - np.diag([0.5**-2, 0.1**-2, (100 * 0.2) ** -2])
    wanted = np.linalg.inv(precision / 9.0 + np.diag([0.5**-2, 0.1**-2, (100 * 0.2) ** -2]))
    assert found == pytest.approx(np.sqrt(np.diag(wanted)), rel=0.02)
    assert found[1] / 0.1 < 1.01
    assert found[2] == pytest.approx(0.6, rel=0.02)
    assert drawn(1e12).std(axis=0)[:2] == pytest.approx([0.5, 0.1], rel=0.02)


def test_few_trials_make_the_tails_heavy_but_those_of_the_prior():
    few, many = drawn(9.0, trials=3), drawn(9.0)
    wide = [np.quantile(np.abs(one - MEAN), 0.99, axis=0) for one in (few, many)]
    assert wide[0][2] > 1.5 * wide[1][2]
    assert wide[0][1] < 1.05 * wide[1][1]


def test_priors_that_are_too_narrow_are_widened_and_told():
    found = Power(1e8, SURE, {"one": 50.0}, 4.0)
    assert drawn(1e8, 4.0).std(axis=0)[:2] == pytest.approx([1.0, 0.2], rel=0.02)
    assert "the priors are too narrow" in found.words[1]
    assert len(Power(2.0, 4, {"one": 2.0}, 1.0).words) == 1


def test_directions_are_those_of_the_covariance():
    across, fixed = directions(FREE, COVARIANCE)
    assert (across / (1.0 + fixed)) @ across.T == pytest.approx(COVARIANCE, rel=1e-9, abs=1e-12)


@pytest.mark.slow
def test_a_ship_that_the_model_can_be_needs_no_widening():
    told = turns([SHIP])
    _, found = judged(told)
    assert found.trials == 6
    assert found.factor < 6.0
    assert found.left < 1.5


@pytest.mark.slow
def test_trials_of_two_ships_do_not_make_one_that_is_known_well():
    """By its stated errors the fit is as sure as before, and misses each trial that it has not seen."""
    told = turns([SHIP, TRUTH])
    fit, found = judged(told)
    assert found.factor > 30.0
    assert min(found.errors.values()) > 5.0
    wide = np.sqrt(np.diag(found.covariance(fit.free, fit.covariance)))
    sure = np.sqrt(np.diag(found.of(fit.free, fit.covariance)))
    assert (wide > 2.0 * sure).any()
    assert (sure <= fit.sigma).all()
    assert (wide <= 1.01 * np.array([f.sigma for f in fit.free]) * np.sqrt(max(found.left, 1.0))).all()


@pytest.mark.slow
def test_windows_that_overlap_count_for_less_and_leave_the_same_widths():
    """They count each sample four times, so that T is some four times as great, and draws are as wide."""
    other = SHIP.having({"hull.N_r": 1.05 * float(read(SHIP.model, "hull.N_r"))})
    told, plain = turns([SHIP, other]), replace(ESTIMATOR, window=100.0)
    (fit, once), (again, often) = (judged(told, by) for by in (plain, replace(plain, stride=25.0)))
    assert 2.0 * once.factor < often.factor < 8.0 * once.factor
    wide = [np.sqrt(np.diag(one.covariance(of.free, of.covariance))) for one, of in ((once, fit), (often, again))]
    assert wide[1] == pytest.approx(wide[0], rel=0.25)


@pytest.mark.slow
def test_two_trials_are_too_few():
    told = turns([SHIP])
    with pytest.raises(StudyError, match="2 trials are too few to leave each out in turn; fit 3 or more"):
        power(ESTIMATOR.fit(told), replace(told, trials=told.trials[:2]), ESTIMATOR, [])


def test_what_is_kept_is_what_was_found():
    found = Power(2.5, 4, {"one": 2.0, "two": 3.0}, 1.0)
    assert from_json(Power, asdict(found), "a") == found
    for key, wrong in (("factor", 0.5), ("factor", float("inf")), ("trials", 1), ("left", -1.0)):
        with pytest.raises(RequestError, match=rf"a: {key} is "):
            from_json(Power, {**asdict(found), key: wrong}, "a")
