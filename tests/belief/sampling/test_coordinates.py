"""Coordinates of products: one for one, their volume, and a walk that is not held up by a ridge."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.belief.sampling.coordinates import Coordinates, TurnedWalk
from seatrial.belief.sampling.sampled import effective, rhat
from seatrial.belief.sampling.walking import Walker
from seatrial.data import Array

PATHS = ("hull.N_r", "rudder.f_alpha", "rudder.t_R", "rudder.a_H", "rudder.x_H", "propeller.w_P0")
AT = np.array([-0.05, 2.7, 0.3, 0.4, -1.4, 0.4])
X_R = -1.5


def coordinates() -> Coordinates:
    return Coordinates.of(PATHS, AT[None], X_R)


def test_values_and_coordinates_are_one_for_one_and_know_their_volume() -> None:
    there, rng = coordinates(), np.random.default_rng(0)
    values = AT * (1.0 + 0.1 * rng.standard_normal((20, len(AT))))
    back, volume = there.back(there.into(values))
    assert back == pytest.approx(values, rel=1e-12)
    slope = there.slope(values)
    step = 1e-6
    for k in range(len(AT)):
        moved = (there.into(values + step * np.eye(len(AT))[k]) - there.into(values - step * np.eye(len(AT))[k])) / 2e-6
        assert slope[:, :, k] == pytest.approx(moved, rel=1e-5, abs=1e-7)
    # the volume that coordinates stand for is one over that of their derivatives
    assert volume == pytest.approx(-np.linalg.slogdet(slope)[1], rel=1e-9)


def test_what_is_no_factor_stays_as_it_is() -> None:
    assert Coordinates.of(("hull.N_r", "wind.X_1"), np.ones((1, 2))).plain
    # a rudder that lifts the wrong way has no logarithm; nor has a lever without a_H, or with x_R free
    assert Coordinates.of(("rudder.f_alpha",), np.array([[-2.0]])).plain
    assert Coordinates.of(("rudder.x_H",), np.array([[-1.4]]), X_R).plain
    assert Coordinates.of(PATHS, AT[None]).lever is None
    there = coordinates()
    assert there.into(AT[None])[0, 0] == AT[0]
    assert np.isnan(there.into(np.where(np.arange(len(AT)) == 2, 1.5, AT)[None])).any()


def ridge(values: Array) -> Array:
    """Trials that fix two products of three factors, and priors about the middle."""
    f, t, a = values.T
    with np.errstate(all="ignore"):
        drag, lift = np.log(f * (1.0 - t) / 1.89) / 0.01, np.log(f * (1.0 + a) / 3.78) / 0.01
    prior = ((values - np.array([2.7, 0.3, 0.4])) / np.array([0.8, 0.2, 0.4])) ** 2
    found = -0.5 * (drag**2 + lift**2 + prior.sum(axis=1))
    return np.where(np.isfinite(found), found, -np.inf)


@pytest.mark.parametrize("turned", [True, False])
@pytest.mark.slow
def test_a_bent_ridge_is_walked_in_its_coordinates(turned: bool) -> None:
    centre, low, high = np.array([[2.7, 0.3, 0.4]]), np.array([0.5, -0.5, -0.5]), np.array([6.0, 0.9, 2.0])
    sigma = np.array([[0.8, 0.2, 0.4]])
    # the covariance of Laplace at the centre
    J = np.array([[1 / 2.7, -1 / 0.7, 0.0], [1 / 2.7, 0.0, 1 / 1.4]]) / 0.01
    root = np.linalg.cholesky(np.linalg.inv(J.T @ J + np.diag(sigma[0] ** -2.0)))[None]
    walker = Walker(ridge, centre, sigma, low, high, 150, 400, 1, np.zeros(8, dtype=np.intp))
    there = Coordinates.of(("rudder.f_alpha", "rudder.t_R", "rudder.a_H"), centre)
    start = np.clip(centre + 0.01 * np.random.default_rng(0).standard_normal((8, 3)) @ root[0].T, low, high)
    if not turned:
        found = walker.run(walker.begun(start, root)).drawn[150:]
        assert effective(found).min() < 250.0
        return
    walk = TurnedWalk.of(walker, there, centre)
    told = walk.told(walk.run(walk.begun(start, root)))
    found = told.drawn[150:]
    assert rhat(found).max() < 1.02
    assert effective(found).min() > 500.0
    assert ((found >= low) & (found <= high)).all()
    assert told.densities[200] == pytest.approx(ridge(told.drawn[200]), rel=1e-9)
    # the density along the ridge by quadrature: across it the likelihood leaves the same share everywhere in f
    f = np.linspace(0.6, 5.9, 4000)
    t, a = 1.0 - 1.89 / f, 3.78 / f - 1.0
    inside = (t >= low[1]) & (t <= high[1]) & (a >= low[2]) & (a <= high[2])
    prior = ((np.column_stack([f, t, a]) - centre[0]) / sigma[0]) ** 2
    weight = np.where(inside, np.exp(-0.5 * prior.sum(axis=1)) / f**2, 0.0)
    mean = float((weight * f).sum() / weight.sum())
    spread = float(np.sqrt((weight * (f - mean) ** 2).sum() / weight.sum()))
    assert found[..., 0].mean() == pytest.approx(mean, abs=4.0 * spread / np.sqrt(effective(found)[0]) + 0.01)
    assert found[..., 0].std() == pytest.approx(spread, rel=0.12)


def test_each_group_of_chains_begins_with_the_covariance_that_its_own_values_turn() -> None:
    """A logarithm divides the spread of a factor by the factor; two groups stand at different ones."""
    there = Coordinates.of(("hull.N_r", "rudder.f_alpha"), np.array([[-0.05, 2.0]]))
    taken: list[tuple[Array, Array]] = []
    walker: Any = SimpleNamespace(groups=np.array([0, 1, 0]), begun=lambda values, root: taken.append((values, root)))
    values = np.array([[-0.05, 2.0], [-0.06, 8.0], [-0.05, 2.0]])
    covariances = np.array([[[0.04, 0.01], [0.01, 0.25]], [[0.09, -0.02], [-0.02, 0.16]]])
    TurnedWalk(walker, there).begun(values, np.linalg.cholesky(covariances))
    [(coordinates_of, root)] = taken
    assert coordinates_of == pytest.approx(np.column_stack([values[:, 0], np.log(values[:, 1])]))
    for k, factor in enumerate((2.0, 8.0)):
        size = np.diag([1.0, 1.0 / factor])
        assert root[k] @ root[k].T == pytest.approx(size @ covariances[k] @ size)
