"""Bands of manoeuvres: that each run is that of its ship, and that they hold as often as they say."""

from __future__ import annotations

import numpy as np
import pytest

from fitted_run import DEGREE, PATHS, covariance, truth
from seatrial.belief.bands.manoeuvring import Bands, bands, straightened
from seatrial.core.parameters import read
from seatrial.environment import Uniform
from seatrial.manoeuvres import Manoeuvre
from seatrial.manoeuvres.initial_turning import InitialTurning
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.simulate.approach import approach
from seatrial.simulate.run import simulate

MEAN = np.array([float(read(truth().model, path)) for path in PATHS])


def sailed(policy: Manoeuvre, draws: np.ndarray, duration: float, *, held: bool = True, dt: float = 0.02) -> Bands:
    return bands(truth(), policy, PATHS, draws, speed=truth().speed, duration=duration, dt=dt, weather=Uniform(),
                 held=held, threads=2)  # fmt: skip


@pytest.mark.parametrize("policy", [
    Turning(0.0, 35 * DEGREE), pytest.param(Zigzag(0.0, 20 * DEGREE, 20 * DEGREE, 1), marks=pytest.mark.slow),
])  # fmt: skip
def test_each_run_is_that_of_its_own_ship(policy: Manoeuvre) -> None:
    """Indices and tracks against a single run of the ship, with the revolutions that hold its own speed."""
    draws = MEAN * np.array([[1.0, 1.0, 1.0], [1.2, 0.9, 1.3]])
    found = sailed(policy, draws, 120.0)
    for k, draw in enumerate(draws):
        ship = truth().having(dict(zip(PATHS, draw.tolist(), strict=True)))
        U, n_P = approach(ship, truth().speed)
        own = type(policy)(**{**vars(policy), "n_P": n_P})
        run = simulate(ship, own, speed=U, duration=120.0, dt=0.02)
        indices = own.indices(run, ship.L_pp)
        assert len(found.indices) >= 4
        for name, values in found.indices.items():
            assert values[k] == pytest.approx(indices[name].value, rel=2e-3), name
        at = np.interp(found.t, run.t, run["y"])
        assert found.tracks[k, :, 1] == pytest.approx(at, abs=2e-3 * ship.L_pp)


def test_a_manoeuvre_without_a_tally_is_read_as_a_whole() -> None:
    policy = InitialTurning(approach(truth())[1], 10 * DEGREE, 10 * DEGREE)
    found = sailed(policy, MEAN * np.ones((3, 1)), 60.0, dt=0.1, held=False)
    assert np.ptp(found.tracks, axis=0) == pytest.approx(0.0, abs=1e-12)
    assert np.isfinite(found.tracks).all()
    assert found.indices


def curved(draws: np.ndarray, by: float) -> Bands:
    """Runs whose figures are bent parabolas of the draws about one half, shape (draws, 2)."""
    x, y = (draws - 0.5).T
    figure = 7.0 + 2.0 * x - 3.0 * y + by * (x**2 + x * y)
    track = np.stack([np.stack([k * figure, figure - k], axis=-1) for k in range(5)], axis=1)
    return Bands(np.arange(5.0), np.concatenate([track] * 3, axis=2), {"advance": figure, "overshoot": figure - 7.0},
                 np.full(len(draws), np.nan))  # fmt: skip


def test_runs_by_pairs_are_straight_in_the_draws_however_bent_the_figures() -> None:
    """A parabola about the fit has no odd part: the runs are those of its tangent, in the order of the draws."""
    half = np.random.default_rng(2).normal(0.5, 0.3, (40, 2))
    every = np.vstack([np.full((1, 2), 0.5), half, 1.0 - half])
    tangent = curved(every[1:], 0.0)
    found = straightened(curved(every, 5.0), 80)
    np.testing.assert_allclose(found.indices["advance"], tangent.indices["advance"], atol=1e-12)
    np.testing.assert_allclose(found.tracks, tangent.tracks, atol=1e-12)
    low, high = found.edges("advance", 0.9)
    assert 0.5 * (low + high) == pytest.approx(7.0, abs=1e-9), "the fit is in the middle"
    bent = curved(every[1:], 5.0).indices["advance"]
    assert np.mean(bent) > 7.2, "draws of a bent figure lie to one side"
    assert len(straightened(curved(every, 5.0), 79).failed) == 79
    wide = straightened(curved(every, 5.0), 80, 1.5)
    np.testing.assert_allclose(wide.indices["advance"] - 7.0, 1.5 * (found.indices["advance"] - 7.0), atol=1e-9)
    np.testing.assert_allclose(np.ptp(wide.tracks, axis=0), 1.5 * np.ptp(found.tracks, axis=0), atol=1e-9)
    # what no run has below zero stays there: an angle of overshoot
    none = curved(every, 5.0)
    above = Bands(none.t, none.tracks, {"overshoot": np.abs(none.indices["overshoot"])}, none.failed)
    assert np.min(straightened(above, 80).indices["overshoot"]) == 0.0


def test_a_pair_of_which_one_run_failed_has_failed_when_that_did() -> None:
    every = np.vstack([np.full((1, 2), 0.5), np.full((3, 2), 0.6), np.full((3, 2), 0.4)])
    made = curved(every, 1.0)
    made.failed[[2, 5, 6]] = 3.0, 2.0, 4.0
    made.tracks[2, 3:], made.tracks[5, 2:], made.tracks[6, 4:] = np.nan, np.nan, np.nan
    made.indices["advance"][6] = np.nan
    found = straightened(made, 6)
    assert np.array_equal(found.failed, [np.nan, 2.0, 4.0, np.nan, 2.0, 4.0], equal_nan=True)
    assert np.isfinite(found.tracks).all(axis=2).sum(axis=1).tolist() == [5, 2, 4, 5, 2, 4]
    assert np.isnan(found.indices["advance"]).tolist() == [False, False, True, False, False, True]


@pytest.mark.slow
def test_an_index_that_too_few_runs_reach_has_no_band() -> None:
    draws = MEAN + np.random.default_rng(0).standard_normal((200, 3)) @ np.diag(np.sqrt(np.diag(covariance(0.1))))
    found = sailed(Turning(0.0, 35 * DEGREE), draws, 24.2, dt=0.1)
    reached = np.isfinite(found.indices["advance"]).mean()
    assert 0.0 < reached < 0.95
    assert np.isnan(found.edges("advance", 0.95)).all()
    assert np.isnan(found.edges("no such index", 0.95)).all()


@pytest.mark.slow
def test_bands_hold_as_often_as_they_say() -> None:
    """Fifty fits of one ship, each off by its own error: the truth lies in 95 % of their bands."""
    rng, repeats, draws, scale = np.random.default_rng(7), 50, 100, np.sqrt(np.diag(covariance(0.03)))
    estimates = MEAN + rng.standard_normal((repeats, 3)) * scale
    every = estimates[:, None] + rng.standard_normal((repeats, draws, 3)) * scale
    policy = Zigzag(0.0, 20 * DEGREE, 20 * DEGREE, 1)
    found = sailed(policy, every.reshape(-1, 3), 60.0, dt=0.05)
    own = sailed(policy, MEAN[None], 60.0, dt=0.05)
    held: list[bool] = []
    for name in ("first_overshoot", "initial_turning_time", "initial_turning_distance", "second_reversal"):
        low, high = np.quantile(found.indices[name].reshape(repeats, draws), (0.025, 0.975), axis=1)
        inside = (own.indices[name] >= low) & (own.indices[name] <= high)
        held += inside.tolist()
    assert 0.90 <= np.mean(held) <= 0.98


def test_a_draw_whose_propeller_drags_nothing_fails_at_once_and_takes_no_band_from_the_others() -> None:
    """Thrust that rises again where the propeller hardly turns: k_2 so large that u_P alone pushes the ship on."""
    paths = (*PATHS, "propeller.k_2")
    draws = np.tile(np.append(MEAN, float(read(truth().model, "propeller.k_2"))), (20, 1))
    draws[:3, -1] = 3.0
    found = bands(truth(), Turning(0.0, 35 * DEGREE), paths, draws, speed=truth().speed, duration=40.0, dt=0.1,
                  weather=Uniform(), threads=2)  # fmt: skip
    assert np.flatnonzero(np.isfinite(found.failed)).tolist() == [0, 1, 2]
    assert np.isnan(found.indices["advance"][:3]).all()
    low, high = found.edges("advance", 0.95)
    assert low == pytest.approx(found.indices["advance"][3], rel=1e-9)
    assert high == pytest.approx(low, rel=1e-9)


def test_a_band_of_fewer_than_half_of_the_draws_is_none() -> None:
    """Failed draws leave the count; those that go on and do not reach an index stay in it."""
    reached = np.append(np.arange(1.0, 12.0), np.full(9, np.nan))
    over = np.full(20, np.nan)
    standing = np.where(np.isnan(reached), 5.0, np.nan)
    t, tracks = np.zeros(1), np.zeros((20, 1, 6))
    assert np.isnan(Bands(t, tracks, {"advance": reached}, over).edges("advance", 0.9)).all()
    low, high = Bands(t, tracks, {"advance": reached}, standing).edges("advance", 0.8)
    assert (low, high) == pytest.approx((2.0, 10.0))
    fewer = np.where(reached > 9.5, np.nan, reached)
    failed = np.where(np.isnan(fewer), 5.0, np.nan)
    assert np.isnan(Bands(t, tracks, {"advance": fewer}, failed).edges("advance", 0.8)).all()
