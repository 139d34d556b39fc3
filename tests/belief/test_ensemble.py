"""Ensembles and bands: noise seen through the residuals, members as the theory has them, warnings of misfit."""

import numpy as np
import pytest

from seatrial.belief.ensemble import bands, ensemble
from seatrial.identify import Loss
from seatrial.identify.posterior.misfit import Remainder, misfit, white
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.identify.trajectory.objective import TrajectoryObjective
from seatrial.models import STATES
from seatrial.simulate.replay import replay
from suzaku_turns import GNSS, SHIP, TRUTH, manoeuvre, problem, turn, unmodelled

pytestmark = pytest.mark.slow

ESTIMATOR = MultiStart(starts=4, method="euler", initial="measured")


@pytest.fixture(scope="module")
def fitted():
    told = problem()
    return told, ESTIMATOR.fit(told)


@pytest.fixture(scope="module")
def group(fitted):
    told, fit = fitted
    return ensemble(fit, told, ESTIMATOR, members=40, seed=3)


def test_the_noise_is_seen_through_the_errors_that_last(fitted):
    told, fit = fitted
    level = white(fit, told, ESTIMATOR)
    for name, sigma in GNSS.items():
        assert level[name] == pytest.approx(sigma, rel=0.06)
    assert level["u"] < 1e-4


def test_members_spread_as_linear_theory_has_it():
    """Two parameters, heading only: the start's error bends every sample, the samples have errors of their own."""
    told = problem(SHIP, paths=("hull.R_0", "rudder.kappa"), loss=Loss({"psi": GNSS["psi"]}, 0.0))
    fit = ESTIMATOR.fit(told)
    members = ensemble(fit, told, ESTIMATOR, members=400, noise={"psi": GNSS["psi"]}, seed=1)
    arguments = {"window": 600.0, "dt": 1.0, "every": 1, "method": "euler", "threads": 2}
    one = TrajectoryObjective.build(told, told.trials, told.loss.sigma, **arguments)
    lanes, _ = one.lanes(fit.values[None], np.zeros((1, 0)))
    slopes = one.slopes(lanes)[1][0, :, 1:, 2, :] / GNSS["psi"]
    J, start = slopes[:, :, :2], slopes[:, :, 4] * GNSS["psi"]
    H = np.einsum("wri,wrj->ij", J, J)
    pulled = np.einsum("wri,wr->wi", J, start)
    covariance = np.linalg.inv(H) @ (H + pulled.T @ pulled) @ np.linalg.inv(H)
    np.testing.assert_allclose(members.values.std(axis=0), np.sqrt(np.diag(covariance)), rtol=0.1)


def test_an_ensemble_is_the_same_whenever_it_is_drawn_and_stays_in_the_box(fitted, group):
    told, fit = fitted
    again = ensemble(fit, told, ESTIMATOR, members=40, seed=3)
    assert np.array_equal(again.values, group.values)
    assert np.all(group.values >= [f.low for f in told.free])
    assert np.all(group.values <= [f.high for f in told.free])
    assert 0.02 < group.surpassed < 0.98


def test_bands_hold_the_fit_and_the_truth(fitted, group):
    unseen = turn(TRUTH, 20)
    one = bands(group, unseen, manoeuvre(20))
    alone = replay(fitted[1].ship, unseen, method="euler")
    for k, name in enumerate(STATES):
        np.testing.assert_allclose(one.best[:, k], alone[name], rtol=1e-9, atol=1e-9)
    low, high = one.band("psi")
    assert np.all(low <= high)
    assert np.mean((low <= unseen["psi"] + 1e-9) & (unseen["psi"] - 1e-9 <= high)) > 0.8
    true = manoeuvre(20).indices(unseen, SHIP.L_pp)
    for name in ("advance", "tactical_diameter"):
        a, b = one.interval(name)
        assert a < b
        assert one.measured[name] == true[name].value
        assert a - 0.2 * (b - a) <= true[name].value <= b + 0.2 * (b - a)
    narrow = one.interval("advance", 0.5)
    assert one.interval("advance")[0] <= narrow[0] < narrow[1] <= one.interval("advance")[1]


def test_a_small_coverage_of_the_unseen_tactical_diameter():
    """Five parameters; the long tier has all twelve and a hundred repetitions."""
    paths = ("hull.R_0", "propeller.w_P0", "rudder.epsilon", "rudder.kappa", "rudder.gamma_Rp")
    unseen = turn(SHIP, 20, 400.0)
    true = manoeuvre(20).indices(unseen, SHIP.L_pp)["tactical_diameter"].value
    hits = 0
    for seed in range(6):
        told = problem(SHIP, seed=500 + seed, paths=paths, angles=(10, 35), duration=300.0)
        members = ensemble(ESTIMATOR.fit(told), told, ESTIMATOR, members=60, seed=seed)
        low, high = bands(members, unseen, manoeuvre(20)).interval("tactical_diameter")
        hits += low <= true <= high
    assert hits >= 5


def test_a_model_of_the_right_structure_is_not_blamed(fitted):
    told, fit = fitted
    left = misfit(fit, told, ESTIMATOR, noise=GNSS)
    assert not left.lacking
    assert left.words == ("The residuals look like sensor noise: nothing in these trials contradicts the model.",)
    for r in left.remainders:
        assert r.size == pytest.approx(1.0, abs=0.06)
        assert abs(r.correlation) < 0.1
        assert abs(r.runs) < 4.0


def test_unlogged_wind_and_a_lagging_rudder_are_seen_in_the_residuals():
    told = unmodelled(1)
    fit = ESTIMATOR.fit(told)
    left = misfit(fit, told, ESTIMATOR)
    assert left.lacking
    assert "lacks something" in left.words[0]
    assert any("times the sensor noise" in line for line in left.words)
    assert any("keep their sign" in line for line in left.words)
    assert ensemble(fit, told, ESTIMATOR, members=20).surpassed == 0.0


def test_what_counts_as_chance():
    assert Remainder("x", 1.05, 0.05, -2.0, 1000).warnings == ()
    assert len(Remainder("x", 1.3, 0.5, -9.0, 1000).warnings) == 3
