"""The one law of draws: moments, bounds, widening by trials left out, samples."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import truncnorm

from seatrial.belief.parts import _fitted, widened
from seatrial.belief.posterior import Posterior
from seatrial.belief.power import Power
from seatrial.belief.reading import posterior
from seatrial.core.parameters import Free
from seatrial.core.records import from_json, to_json
from seatrial.data import Array, Trial
from seatrial.identify import Fit, Problem
from seatrial.ships.files import load
from seatrial.study.store import save_fit

SHIP = load("kvlcc2_l7")
INF = math.inf


def held(covariance: Array, low: Array | None = None, high: Array | None = None, prior: float = INF) -> Posterior:
    """Some coefficients without physical ranges, all about -.1."""
    names = ("hull.Y_v", "hull.N_v", "hull.N_r", "hull.Y_vvv")[: len(covariance)]
    least, most = np.full(len(names), -INF) if low is None else low, np.full(len(names), INF) if high is None else high
    free = tuple(Free(name, min(max(-0.1, a), b), a, b, -0.1, prior)
                 for name, a, b in zip(names, least.tolist(), most.tolist(), strict=True))  # fmt: skip
    return Posterior(SHIP, free, np.full(len(names), -0.1), covariance)


def test_moments_are_those_of_the_law() -> None:
    covariance = np.array([[4e-4, 1.5e-4], [1.5e-4, 1e-4]])
    one = held(covariance)
    away = np.linalg.solve(np.linalg.cholesky(covariance), (one.draws(20000, 4) - one.mean).T)
    assert np.abs(away.mean(axis=1)).max() < 4.0 / math.sqrt(20000)
    assert np.cov(away) == pytest.approx(np.eye(2), abs=0.05)


@pytest.mark.slow
def test_draws_of_a_posterior_have_its_moments_within_the_bounds(tmp_path: Path) -> None:
    """A correlated pair, of which one is cut two standard deviations below its estimate: moments of the cut normal."""
    ship = load("kvlcc2_l7")
    free = (Free("hull.Y_v", -0.3, -0.34, 1.0), Free("hull.N_v", -0.1))
    covariance = np.array([[4e-4, 1.5e-4], [1.5e-4, 1e-4]])
    values = np.array([-0.3, -0.1])
    fit = Fit(
        ship.having({"hull.Y_v": -0.3, "hull.N_v": -0.1}), free, values, np.sqrt(np.diag(covariance)), covariance,
        np.ones(2), (), (), np.zeros((0, 4)), 1.0, 0.1, 1, "done", "d",
    )  # fmt: skip
    save_fit(fit, tmp_path, Problem(ship, (Trial("a", np.arange(2.0), {}),), free), study="s")
    held = posterior(tmp_path / "model.toml")
    draws = held.draws(20000, 3)
    assert np.array_equal(draws, held.draws(20000, 3))
    assert not np.array_equal(draws, held.draws(20000, 4))
    assert draws[:, 0].min() >= -0.34
    law = truncnorm(-2.0, np.inf, -0.3, 0.02)
    assert draws[:, 0].mean() == pytest.approx(law.mean(), abs=5e-4)
    assert draws[:, 0].std() == pytest.approx(law.std(), rel=0.02)
    slope = covariance[0, 1] / covariance[0, 0]  # of the other on this one, whatever is cut
    assert np.polyfit(draws[:, 0], draws[:, 1], 1)[0] == pytest.approx(slope, rel=0.03)
    rest = draws[:, 1] + 0.1 - slope * (draws[:, 0] + 0.3)
    assert rest.std() == pytest.approx(np.sqrt(covariance[1, 1] - slope * covariance[0, 1]), rel=0.02)


def _rejected(one: Posterior, count: int) -> Array:
    """The law by its definition: draws of the normal density that lie within the bounds."""
    rng, (low, high), kept = np.random.default_rng(9), one.bounds, np.zeros((0, len(one.mean)))
    while len(kept) < count:
        drawn = rng.multivariate_normal(one.mean, one.covariance, 400_000)
        kept = np.vstack([kept, drawn[((drawn >= low) & (drawn <= high)).all(axis=1)]])
    return kept[:count]


@pytest.mark.slow
def test_rare_draws_are_of_the_same_law_as_common_ones() -> None:
    """Estimates at their bounds, correlated so that few normal draws are within: against plain rejection."""
    sigma, correlation = np.array([0.02, 0.01, 0.03, 0.05]), 0.6 * np.ones((4, 4)) + 0.4 * np.eye(4)
    correlation[[1, 3]] *= -1.0
    correlation[:, [1, 3]] *= -1.0
    one = held(correlation * np.outer(sigma, sigma), np.full(4, -0.1), np.array([INF, -0.095, INF, INF]))
    drawn, wanted = one.draws(4000, 1), _rejected(one, 4000)
    low, high = one.bounds
    assert ((drawn >= low) & (drawn <= high)).all()
    assert len(np.unique(drawn[:, 0])) == 4000
    error = 4.0 * wanted.std(axis=0) * math.sqrt(2.0 / 4000)
    assert (np.abs(drawn.mean(axis=0) - wanted.mean(axis=0)) < error).all()
    assert drawn.std(axis=0) == pytest.approx(wanted.std(axis=0), rel=0.06)
    assert np.corrcoef(drawn.T) == pytest.approx(np.corrcoef(wanted.T), abs=0.07)


@pytest.mark.slow
def test_the_far_tail_has_its_closed_form() -> None:
    """A box that begins six standard deviations from the estimate: the truncated normal distribution."""
    one = held(np.diag([1e-4, 1e-4]), np.array([-0.04, -INF]))
    drawn, law = one.draws(4000, 2)[:, 0], truncnorm(6.0, INF, -0.1, 0.01)
    assert drawn.min() >= -0.04
    assert drawn.mean() == pytest.approx(law.mean(), abs=4.0 * law.std() / math.sqrt(4000))
    assert drawn.std() == pytest.approx(law.std(), rel=0.08)
    under = held(np.diag([1e-4, 1e-4]), high=np.array([-0.16, INF]))  # its mirror image
    assert under.draws(4000, 2)[:, 0].mean() == pytest.approx(-0.2 - law.mean(), abs=4.0 * law.std() / math.sqrt(4000))


@pytest.mark.slow
def test_a_direction_without_variance_stays() -> None:
    one = held(np.diag([1e-4, 0.0]), np.array([-0.1, -0.2]), np.array([-0.0999, 0.0]))
    assert (one.draws(500, 1)[:, 1] == -0.1).all()


def test_left_out_trials_widen_what_the_data_know_and_not_the_prior() -> None:
    """By T: a direction that the data fix by root T, one that only the prior holds not at all."""
    many, prior = 10**6, 0.05  # so many trials that every draw has the same factor
    known, open_ = 1e-4 * prior, 0.999 * prior
    one = replace(held(np.diag([known**2, open_**2]), prior=prior), power=Power(9.0, many, {}, 1.0))
    spread = one.draws(20000, 1).std(axis=0)
    assert spread[0] == pytest.approx(3.0 * known, rel=0.03)
    assert spread[1] == pytest.approx(open_, rel=0.03)
    beyond = replace(one, power=Power(9.0, many, {}, 4.0)).draws(20000, 1).std(axis=0)
    assert beyond == pytest.approx(2.0 * spread, rel=0.03)


def test_few_trials_know_the_factor_badly() -> None:
    """With T drawn for each, a well-known direction has Student's t distribution of as many degrees as trials."""
    one = replace(held(np.diag([1e-10, 1e-10]), prior=0.05), power=Power(4.0, 5, {}, 1.0))
    away = (one.draws(40000, 3)[:, 0] + 0.1) / (2.0 * 1e-5)
    assert away.std() == pytest.approx(math.sqrt(5.0 / 3.0), rel=0.05)
    assert (np.abs(away) > 2.571).mean() == pytest.approx(0.05, abs=0.005)


def test_samples_are_taken_where_there_are_any_and_widened_like_the_rest() -> None:
    rng = np.random.default_rng(5)
    skewed = -0.1 + 0.02 * (rng.exponential(1.0, (8000, 2)) - 1.0)
    plain = replace(held(np.diag([4e-4, 4e-4]), prior=10.0), samples=skewed)
    drawn = plain.draws(8000, 1)
    assert {*drawn[:, 0].tolist()} <= {*skewed[:, 0].tolist()}
    wide = replace(plain, power=Power(4.0, 10**6, {}, 1.0)).draws(8000, 1)
    assert wide.std(axis=0) == pytest.approx(2.0 * drawn.std(axis=0), rel=0.04)
    assert ((wide - wide.mean(axis=0)) ** 3).mean(axis=0) / wide.std(axis=0) ** 3 == pytest.approx([2.0, 2.0], abs=0.5)
    less = replace(plain, samples=-0.1 + 1.5 * (skewed + 0.1)).draws(8000, 1)
    assert less.std(axis=0) == pytest.approx(1.5 * drawn.std(axis=0), rel=1e-9)


def test_physical_ranges_hold_where_the_study_declares_none() -> None:
    free = (Free("propeller.t_P", 0.95),)
    drawn = Posterior(SHIP, free, np.array([0.95]), np.array([[0.2**2]])).draws(2000, 1)
    assert drawn.max() <= 1.0
    assert drawn.std() == pytest.approx(truncnorm(-math.inf, 0.25, 0.95, 0.2).std(), rel=0.06)


def test_errors_of_the_form_count_once_where_left_out_trials_tell_them() -> None:
    """Sigmas that residuals have widened too are taken back before the likelihood is divided by T."""
    sigma, by = np.array([1e-3, 2e-3]), np.array([3.0, 1.5])
    plain = np.array([[1.0, 0.6], [0.6, 1.0]]) * np.outer(sigma, sigma)
    once = replace(held(plain, prior=0.05), power=Power(4.0, 10**6, {}, 1.0))
    told = Power(4.0, 10**6, {}, 1.0, dict(zip(("hull.Y_v", "hull.N_v"), by.tolist(), strict=True)))
    twice = replace(held(plain * np.outer(by, by), prior=0.05), power=told)
    np.testing.assert_allclose(twice.draws(500, 3), once.draws(500, 3), rtol=1e-9)
    np.testing.assert_allclose(told.covariance(once.free, twice.covariance),
                               Power(4.0, 9, {}, 1.0).covariance(once.free, plain), rtol=1e-12)  # fmt: skip
    written = {key: value for key, value in json.loads(to_json(told, "x/1")).items() if key != "schema"}
    assert from_json(Power, written, "p") == told


@pytest.mark.parametrize(("correlation", "found"), [(None, {}), (5.0, {"a": 2.0}), (0.0, {"a": 2.0})])
def test_only_a_stated_time_of_errors_gives_a_sigma_to_go_back_to(correlation: float | None, found: dict) -> None:
    free = (Free("a", 0.0), Free("b", 0.0))
    fit: Any = SimpleNamespace(free=free, diagnosis=SimpleNamespace(widened={"a": 2.0}))
    problem: Any = SimpleNamespace(loss=SimpleNamespace(correlation=correlation))
    assert widened(fit, problem) == found
    assert not widened(SimpleNamespace(free=free, diagnosis=None), problem)  # type: ignore[arg-type]


def test_a_part_is_as_sure_as_its_study_states() -> None:
    fit: Any = SimpleNamespace(values=np.array([1.0, 2.0]), covariance=np.array([[9.0, 3.0], [3.0, 4.0]]),
                               diagnosis=SimpleNamespace(widened={"a": 3.0, "b": 1.0}))  # fmt: skip
    estimator: Any = SimpleNamespace(fit=lambda problem: fit)
    problem: Any = SimpleNamespace(free=("a", "b"), vector=SimpleNamespace(paths=("a", "b")),
                                   loss=SimpleNamespace(correlation=5.0))  # fmt: skip
    values, covariance = _fitted(estimator, problem)
    np.testing.assert_allclose(covariance, [[1.0, 1.0], [1.0, 4.0]])
    assert values.tolist() == [1.0, 2.0]
