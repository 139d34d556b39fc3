"""Priors that are correlated: a Gaussian one beside the likelihood of other data is the fit to both."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.belief.power import Power, directions
from seatrial.belief.sampling.density import Density
from seatrial.core.parameters import Free, read
from seatrial.data import Trial
from seatrial.identify import Fit, Loss, Problem, StudyError
from seatrial.identify.filters.filtering import Kalman, Tracker
from seatrial.identify.filters.measurement import Antenna, Heading
from seatrial.identify.lint import lint
from seatrial.identify.population.evolution import Scoring
from seatrial.identify.posterior.profile import profiles
from seatrial.identify.posterior.verdicts import posterior
from seatrial.identify.regression.regression import Regression, weighted_fit
from seatrial.identify.shooting.logo import Shooting
from seatrial.identify.trajectory.objective import TrajectoryObjective
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.identify.vector import Vector
from seatrial.manoeuvres import Policy
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

SHIP = load("kvlcc2_l7")
PATHS = ("hull.R_0", "hull.Y_v", "hull.Y_r", "hull.N_v", "hull.N_r")
SIGMA = {"u": 0.02, "v_m": 0.01, "r": 0.003}


def sailed(policy: Policy, seed: int) -> Trial:
    """A run of a minute with the noise of sensors."""
    rng = np.random.default_rng(seed)
    run = simulate(SHIP, policy, duration=60.0, dt=0.1, name=f"t{seed}")
    return run.having(**{n: run[n] + 0.02 * s * rng.standard_normal(len(run)) for n, s in SIGMA.items()})


@pytest.fixture(scope="module")
def trials() -> tuple[Trial, ...]:
    n, ten = approach(SHIP)[1], math.radians(10)
    return sailed(Turning(n_P=n, delta=0.4), 1), sailed(Zigzag(n_P=n, delta=ten, psi=ten), 2)


def tied(paths: Sequence[str], mean: np.ndarray, covariance: np.ndarray) -> tuple[Free, ...]:
    """Parameters whose prior is this Gaussian."""
    sigma = np.sqrt(np.diag(covariance))
    c = covariance / np.outer(sigma, sigma)
    return tuple(
        Free(path, m, prior=m, sigma=s, tied=tuple((paths[j], float(c[k, j])) for j in range(k)))
        for k, (path, m, s) in enumerate(zip(paths, mean.tolist(), sigma.tolist(), strict=True))
    )


def some_covariance(sigma: np.ndarray, seed: int = 0) -> np.ndarray:
    made = np.random.default_rng(seed).normal(size=(3 * sigma.size, sigma.size)) @ (np.eye(sigma.size) + 0.7)
    c = made.T @ made
    size = np.sqrt(np.diag(c))
    return c / np.outer(size, size) * np.outer(sigma, sigma)


VALUES = np.array([float(read(SHIP.model, path)) for path in PATHS])
COVARIANCE = some_covariance(0.3 * np.abs(VALUES))


def test_the_posterior_of_one_set_of_data_as_the_prior_of_another_is_the_fit_to_both() -> None:
    """Equations that are linear in the parameters: a Gaussian prior times a likelihood is the joint likelihood."""
    rng, rows, n = np.random.default_rng(4), 30, len(PATHS)
    matrix = rng.normal(size=(2 * rows, 3, n)) @ (np.eye(n) + 0.8) / np.abs(VALUES)
    right = matrix @ VALUES + 0.3 * rng.normal(size=(2 * rows, 3))
    problem = Problem(SHIP, (), tuple(Free(path, 0.0) for path in PATHS), Loss(dict.fromkeys(SIGMA, 0.3)))

    def fitted(free: tuple[Free, ...], part: slice) -> Fit:
        return weighted_fit(replace(problem, free=free), matrix[part], right[part], Regression(), 0.0, None)

    one, both = fitted(problem.free, slice(0, rows)), fitted(problem.free, slice(None))
    known = one.covariance * (3 * rows - n) / one.objective  # at residuals of unit variance
    after = fitted(tied(PATHS, one.values, known), slice(rows, None))
    np.testing.assert_allclose(after.values, both.values, rtol=1e-9)
    assert after.objective == pytest.approx(both.objective - one.objective, rel=1e-9)
    # sigmas alone are another prior
    alone = fitted(tuple(replace(f, tied=()) for f in tied(PATHS, one.values, known)), slice(rows, None))
    assert np.abs(alone.values / both.values - 1.0).max() > 1e-3


@pytest.fixture(scope="module")
def objectives(trials: tuple[Trial, ...]) -> tuple[TrajectoryObjective, TrajectoryObjective]:
    """The same trajectories, without and with a prior whose covariance is `COVARIANCE`."""
    settings = Trajectory(window=20.0, every=10, initial="measured", threads=1)
    free = tuple(Free(path, value) for path, value in zip(PATHS, VALUES.tolist(), strict=True))
    plain = Problem(SHIP, trials, free, Loss(SIGMA))
    return tuple(
        TrajectoryObjective.plain(one, settings)
        for one in (plain, replace(plain, free=tied(PATHS, VALUES, COVARIANCE)))
    )  # type: ignore[return-value]


@pytest.mark.slow
def test_a_tied_prior_adds_its_quadratic_form_to_objective_slope_curvature_and_density(
    objectives: tuple[TrajectoryObjective, TrajectoryObjective],
) -> None:
    plain, held = objectives
    p, inverse = VALUES * [1.1, 0.95, 1.2, 1.0, 0.9], np.linalg.inv(COVARIANCE)
    away, none = p - VALUES, np.zeros(0)
    assert held.cost(p, none) - plain.cost(p, none) == pytest.approx(away @ inverse @ away, rel=1e-9)
    a, b = plain.normal(p, none), held.normal(p, none)
    scale = np.abs(a.H).max()
    np.testing.assert_allclose(b.H - a.H, inverse, atol=1e-12 * scale)
    np.testing.assert_allclose(b.g - a.g, inverse @ away, atol=1e-12 * scale)
    # the likelihood counts by one over the factor, the prior by itself
    for at in (Density(plain, 4.0), Density(held, 4.0)):
        assert at.value(p[None])[0] == pytest.approx(at(p[None])[0][0], rel=1e-9)
    (low, slope), (high, steep) = (Density(one, 4.0)(p[None]) for one in objectives)
    assert high[0] - low[0] == pytest.approx(-0.5 * away @ inverse @ away, rel=1e-8)
    np.testing.assert_allclose(steep[0] - slope[0], -inverse @ away, atol=1e-10 * np.abs(inverse).max())


@pytest.mark.slow
def test_the_covariance_of_a_fit_has_the_prior_once_and_the_data_by_their_variance(
    objectives: tuple[TrajectoryObjective, TrajectoryObjective],
) -> None:
    plain, held = objectives
    data, free = plain.normal(VALUES, np.zeros(0)).H, held.problem.free
    found, share = posterior(held.normal(VALUES, np.zeros(0)), free, VALUES, 9.0)
    np.testing.assert_allclose(found, np.linalg.inv(data / 9.0 + np.linalg.inv(COVARIANCE)), rtol=1e-7)
    np.testing.assert_allclose(share, 1.0 - np.diag(found) / np.diag(COVARIANCE), rtol=1e-7)
    np.testing.assert_allclose(held.information, np.linalg.inv(COVARIANCE), rtol=1e-9)
    before, reach = held.before(VALUES)
    np.testing.assert_allclose(before, np.linalg.inv(COVARIANCE), rtol=1e-9)
    np.testing.assert_allclose(reach, np.sqrt(np.diag(COVARIANCE)))


@pytest.mark.slow
def test_a_search_ends_where_slopes_of_data_and_prior_cancel(
    objectives: tuple[TrajectoryObjective, TrajectoryObjective],
) -> None:
    plain, held = objectives
    mean = VALUES * [1.1, 0.95, 1.2, 1.0, 0.9]
    problem = replace(held.problem, free=tied(PATHS, mean, 1e-3 * COVARIANCE))
    fit = Trajectory(window=20.0, every=10, initial="measured", threads=1, tolerance=1e-12).fit(problem)
    slope = plain.normal(fit.values, np.zeros(0)).g
    pull = np.linalg.solve(1e-3 * COVARIANCE, fit.values - mean)
    size = np.sqrt(np.diag(1e-3 * COVARIANCE))
    assert np.abs(size * pull).max() > 1.0
    np.testing.assert_allclose(size * slope, -size * pull, atol=1e-4 * np.abs(size * pull).max())
    # and the profile about it knows the same curvature
    known = profiles(fit, problem, Trajectory(window=20.0, every=10, initial="measured", threads=1), variance=2.0)
    box = np.diag(12.0 / (6.0 * size) ** 2)  # uniform over three sigma to either side, which a profile walks
    whole = np.linalg.inv(plain.normal(fit.values, np.zeros(0)).H / 2.0 + np.linalg.inv(1e-3 * COVARIANCE) + box)
    sigma = np.sqrt(np.diag(whole))
    np.testing.assert_allclose(known.correlation, whole / np.outer(sigma, sigma), atol=1e-3)


def test_candidates_of_a_search_are_scored_by_the_quadratic_form() -> None:
    problem: Any = SimpleNamespace(vector=Vector(tied(PATHS, VALUES, COVARIANCE)))
    candidates = VALUES * np.random.default_rng(2).uniform(0.5, 1.5, (7, VALUES.size))
    wanted = [d @ np.linalg.solve(COVARIANCE, d) for d in candidates - VALUES]
    found = Scoring.prior(SimpleNamespace(problem=problem), candidates)  # type: ignore[arg-type]
    np.testing.assert_allclose(found, wanted, rtol=1e-9)


def test_draws_of_a_tied_prior_have_its_covariance() -> None:
    free = (*tied(PATHS, VALUES, COVARIANCE), Free("rudder.t_R", 0.4, 0.0, 1.0))
    made = Vector(free).of_prior(40_000, np.random.default_rng(5))
    size = np.sqrt(np.diag(COVARIANCE))
    np.testing.assert_allclose(np.corrcoef(made[:, :-1].T), COVARIANCE / np.outer(size, size), atol=0.02)
    np.testing.assert_allclose(made[:, :-1].std(axis=0), size, rtol=0.02)
    assert (made[:, -1] == 0.4).all()


@pytest.mark.parametrize("factor", [1.0, 7.0])
def test_a_power_widens_what_the_data_say_and_not_a_tied_prior(factor: float) -> None:
    """Covariance (C0^-1 + D/T)^-1 where that of the fit is (C0^-1 + D)^-1."""
    free = tied(PATHS, VALUES, COVARIANCE)
    D = np.linalg.inv(some_covariance(0.02 * np.abs(VALUES), 3))
    D[:, 0] = D[0] = 0.0  # of which the data say nothing
    fitted = np.linalg.inv(np.linalg.inv(COVARIANCE) + D)
    across, fixed = directions(free, fitted)
    np.testing.assert_allclose(across @ across.T, COVARIANCE, rtol=1e-9)
    np.testing.assert_allclose(across / (1.0 + fixed) @ across.T, fitted, rtol=1e-6, atol=1e-9 * fitted.max())
    told = Power(factor, 3, {}, 1.0)
    wanted = np.linalg.inv(np.linalg.inv(COVARIANCE) + D / factor)
    np.testing.assert_allclose(told.covariance(free, fitted), wanted, rtol=1e-6, atol=1e-9 * wanted.max())
    assert told.shares(free, fitted) == pytest.approx(np.diag(wanted) / np.diag(COVARIANCE))


@pytest.mark.slow
def test_a_filter_starts_from_the_covariance_of_its_priors(trials: tuple[Trial, ...], monkeypatch: Any) -> None:
    begun: list[np.ndarray] = []

    def forward(self: Tracker, trial: Trial, events: Any, series: Any, mean: np.ndarray, P: np.ndarray) -> Any:
        begun.append(P)
        raise StopIteration

    monkeypatch.setattr(Tracker, "_forward", forward)
    free = tied(PATHS, VALUES, COVARIANCE)
    tracker = Kalman({"gnss": Antenna(0.02), "compass": Heading(0.002)}, {}, free).prepared(SHIP)
    with pytest.raises(StopIteration):
        tracker.run(trials[0])
    at = [tracker.model.names.index(path) for path in PATHS]
    np.testing.assert_allclose(begun[0][np.ix_(at, at)], COVARIANCE, rtol=1e-9)
    begun[0][np.ix_(at, at)] = 0.0
    np.testing.assert_array_equal(begun[0], np.diag(np.diag(begun[0])))


def test_priors_that_are_tied_are_looked_at_as_others_are(trials: tuple[Trial, ...]) -> None:
    problem = Problem(SHIP, trials, tied(PATHS, VALUES, COVARIANCE), Loss(SIGMA))
    untied = replace(problem, free=tuple(replace(f, tied=()) for f in problem.free))
    assert [vars(one) for one in lint(problem)] == [vars(one) for one in lint(untied)]


def test_multiple_shooting_refuses_tied_priors(trials: tuple[Trial, ...]) -> None:
    problem = Problem(SHIP, trials, tied(PATHS, VALUES, COVARIANCE), Loss(SIGMA))
    with pytest.raises(StudyError, match=r"no correlated priors; take shooting:Trajectory"):
        Shooting(window=20.0).fit(problem)
