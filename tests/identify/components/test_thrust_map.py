"""Thrust maps from bollard pulls; the numbers are You 2023 Eq. 20, per thruster."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.data import DataError
from seatrial.identify.components.thrust_map import fit_thrust, fit_thrusters, least_squares, shared
from seatrial.ships.files import load

EQ_20 = np.array([0.0722, 1.974, 0.151, 0.04978, 0.001187, -0.0001773]) / 2.0
LEVELS = np.linspace(0.0, 10.0, 41)


def pull(n: np.ndarray) -> np.ndarray:
    return np.polynomial.polynomial.polyval(n, EQ_20)


def noisy(seed: int, sigma: float, n: np.ndarray = LEVELS) -> np.ndarray:
    return pull(n) + sigma * np.random.default_rng(seed).standard_normal(n.size)


def test_the_facts_of_equation_20() -> None:
    n = np.linspace(0, 25, 25001)
    assert n[np.argmax(pull(n))] == pytest.approx(16.9, abs=0.05)
    assert pull(n).max() == pytest.approx(84.6, abs=0.05)
    assert pull(np.zeros(1))[0] == pytest.approx(0.036, abs=1e-3)


@pytest.mark.slow
def test_without_noise_equation_20_comes_back() -> None:
    found = fit_thrust(LEVELS, pull(LEVELS))
    assert found.powers == (0, 1, 2, 3, 4, 5)
    assert found.coefficients == pytest.approx(EQ_20, rel=1e-8)
    assert pytest.approx(1.0, abs=1e-12) == found.R2


@pytest.mark.slow
@pytest.mark.parametrize("sigma", [0.05, pytest.param(0.3, marks=pytest.mark.long)])
def test_with_noise_thrust_comes_back_within_it(sigma: float) -> None:
    grid = np.linspace(0.25, 10.0, 100)
    errors: list[float] = []
    for seed in range(10):
        found = fit_thrust(LEVELS, noisy(seed, sigma))
        errors.append(float(np.sqrt(np.mean((found.thrust(grid) - pull(grid)) ** 2))))
        assert found.rmse == pytest.approx(sigma, rel=0.35)
        assert found.R2 > 0.999
        assert found.n_max == 10.0
    assert np.mean(errors) < 0.5 * sigma
    assert max(errors) < sigma


def test_of_readings_of_one_thrust_the_mean_has_their_deviation_over_the_root_of_their_number() -> None:
    """The textbook case of a polynomial: a constant."""
    thrust = np.array([10.1, 9.8, 10.3, 9.9, 10.2, 9.7, 10.0, 10.4])
    c, covariance = least_squares(np.full(8, 5.0), thrust, (0,))
    assert c == pytest.approx([thrust.mean()])
    assert covariance[0, 0] == pytest.approx(thrust.var(ddof=1) / 8, rel=1e-9)


@pytest.mark.slow
def test_one_of_two_that_were_pulled_together_has_half_of_everything() -> None:
    """Halves of the readings fitted by themselves are what `shared` makes of the whole."""
    total = 2.0 * noisy(3, 0.2)
    half, alone = shared("one", fit_thrust(LEVELS, total), 2), fit_thrust(LEVELS, total / 2.0)
    assert half.coefficients == pytest.approx(alone.coefficients, rel=1e-9)
    assert half.sigma == pytest.approx(alone.sigma, rel=1e-6)
    assert half.rmse == pytest.approx(alone.rmse, rel=1e-9)
    assert [one.error for one in half.candidates] == pytest.approx([one.error for one in alone.candidates], rel=1e-9)
    assert pytest.approx(half.R2) == alone.R2


@pytest.mark.long
def test_sigma_of_the_coefficients_covers_the_truth() -> None:
    z = [
        (one.coefficients - EQ_20) / one.sigma
        for one in (fit_thrust(LEVELS, noisy(seed, 0.1), order=5, offset=True) for seed in range(100))
    ]
    assert np.std(z) == pytest.approx(1.0, abs=0.15)


@pytest.mark.long
def test_order_by_cross_validation() -> None:
    rng = np.random.default_rng(1)
    square = 0.8 * LEVELS**2 + 0.2 * rng.standard_normal(LEVELS.size)
    assert fit_thrust(LEVELS, square).powers == (2,)
    cubic = 2.0 * LEVELS + 0.05 * LEVELS**3 + 0.05 * rng.standard_normal(LEVELS.size)
    assert max(fit_thrust(LEVELS, cubic).powers) == 3
    # The paper's R^2, .9992, which it calls an RMSE, goes with some 0.35 N of scatter.
    seen = np.mean([fit_thrust(LEVELS, noisy(seed, 0.35)).R2 for seed in range(10)])
    assert seen == pytest.approx(0.9992, abs=0.0003)


@pytest.mark.slow
def test_the_range_is_kept_and_extrapolation_is_asked_for() -> None:
    found = fit_thrust(LEVELS, noisy(0, 0.1), name="port")
    with pytest.raises(DataError, match=r"thruster port: 12 1/s.* 0 to 10 1/s"):
        found.thrust(np.array([5.0, 12.0]))
    with pytest.raises(DataError, match="-3 1/s was not tested"):
        found.thrust(-3.0)
    assert found.thrust(22.1, extrapolate=True) == pytest.approx(found.thrust(10.0))


@pytest.mark.slow
def test_the_map_is_the_thruster_of_the_library() -> None:
    found, ship = fit_thrust(LEVELS, pull(LEVELS)), load("qiuxin5")
    part = found.azimuth(-0.8, 0.163)
    theirs = dict(ship.model.thrusters.items())["1"]  # type: ignore[attr-defined]
    for n in (0.5, 3.0, 10.0, -4.0, 14.0):
        assert part.thrust(n) == pytest.approx(theirs.thrust(n), rel=1e-6)
        assert float(found.thrust(n, extrapolate=True)) == pytest.approx(part.thrust(n), rel=1e-9)


def test_astern_is_a_share_of_ahead() -> None:
    n = np.linspace(-8.0, 10.0, 37)
    T = np.where(n < 0, -0.6, 1.0) * 0.8 * n**2
    found = fit_thrust(n, T)
    assert (found.astern, found.n_low) == (pytest.approx(0.6), -8.0)
    assert float(found.thrust(-5.0)) == pytest.approx(-12.0)


def test_a_table_that_falls_is_refused_with_its_revolutions() -> None:
    n = np.arange(0.0, 21.0)
    with pytest.raises(DataError, match=r"not monotone: .* N at 17 1/s, .* N at 18 1/s"):
        fit_thrust(n, pull(n))
    swapped = pull(LEVELS)
    swapped[30] = 15.0
    with pytest.raises(DataError, match=r"at 7\.25 1/s, 15 N at 7\.5 1/s"):
        fit_thrust(LEVELS, swapped)


def test_a_polynomial_that_falls_is_not_taken() -> None:
    n = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 9.0, 10.0])
    T = np.array([0.0, 1.0, 4.0, 9.0, 16.0, 16.1, 16.2, 16.3])
    found = fit_thrust(n, T)
    curve = found.thrust(np.linspace(0, 10, 200))
    assert (np.diff(curve) > -1e-3 * curve.max()).all()
    assert not all(one.monotone for one in found.candidates)


@pytest.mark.slow
def test_two_tested_together() -> None:
    both = fit_thrust(LEVELS, 2 * pull(LEVELS))
    one = shared("1", both, 2)
    assert one.coefficients == pytest.approx(EQ_20, rel=1e-8)
    assert one.sigma == pytest.approx(both.sigma / 2)


@pytest.mark.slow
def test_thrusters_and_columns() -> None:
    table = {name: (LEVELS, pull(LEVELS)) for name in ("1", "2")}
    assert [one.name for one in fit_thrusters(table)] == ["1", "2"]
    with pytest.raises(DataError, match=r"2 thrusters \(1, 2\).* 1 \(1\)"):
        fit_thrusters(table, ["1"])
    with pytest.raises(DataError, match="no thrust of bow"):
        fit_thrusters(table, ["1", "2", "bow"])


@pytest.mark.parametrize(("n", "T", "words"), [
    ([0.0, 1.0, 2.0], [0.0, 1.0], "3 revolutions and 2 thrusts"),
    ([0.0, 1.0, 2.0], [0.0, 1.0, np.nan], "a row has no number"),
    ([], [], "no row of revolutions and thrust"),
    ([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 0.0], "thrust is zero in every row"),
    ([0.0, 5.0, 10.0], [0.0, 1.0, 4.0], "2 different revolutions ahead"),
    ([-9.0, 0.0, 3.0, 6.0, 9.0], [-60.0, 0.0, 1.0, 4.0, 9.0], "check the signs"),
])  # fmt: skip
def test_bad_tables(n: list[float], T: list[float], words: str) -> None:
    with pytest.raises(DataError, match=words):
        fit_thrust(np.array(n), np.array(T))


@pytest.mark.parametrize(("levels", "repeats", "sigma"), [
    ([0.0, 2.0, 4.0, 6.0, 8.0, 10.0], 1, 0.3),
    pytest.param([0.0, 2.0, 4.0, 6.0, 8.0, 10.0], 1, 0.05, marks=pytest.mark.long),
    pytest.param([2.0, 4.0, 5.5, 7.0, 8.5, 10.0], 1, 0.3, marks=pytest.mark.long),
    pytest.param([0.0, 2.0, 4.0, 6.0, 8.0, 10.0], 3, 0.3, marks=pytest.mark.long),
])  # fmt: skip
@pytest.mark.slow
def test_a_small_table_knows_how_little_it_knows(levels: list[float], repeats: int, sigma: float) -> None:
    """No set of terms goes through all points; beyond three sigma lies one map in twenty at most."""
    n, at, far = np.repeat(levels, repeats), 5.0 ** np.arange(6), 0
    for seed in range(40):
        found = fit_thrust(n, noisy(seed, sigma, n))
        assert len(found.powers) <= np.unique(n[n > 0]).size + (0.0 in levels and 0 in found.powers) - 2
        off = abs(float(found.thrust(5.0)) - pull(np.array(5.0)))
        far += off > 3 * np.sqrt(at @ found.covariance @ at)
    assert far <= 2


def test_rows_at_rest_tell_nothing_of_the_noise() -> None:
    n = np.array([1.0, 2.0, 4.0, 6.0, 8.0, 9.0, 10.0])
    T = noisy(3, 0.3, n)
    plain = fit_thrust(n, T, order=3, offset=False)
    rested = fit_thrust(np.append(np.zeros(20), n), np.append(np.zeros(20), T), order=3, offset=False)
    assert rested.sigma == pytest.approx(plain.sigma)


def test_thrust_has_the_sign_of_the_revolutions_and_the_range_is_what_was_tested() -> None:
    n = np.repeat([3.0, 4.0, 5.0, 6.0, 7.0, 8.0], 2)
    rng = np.random.default_rng(0)
    for curve in (0.9 * n**2 - 3.0, 8.0 * (n - 2.5), pull(n)):
        found = fit_thrust(n, curve + 0.1 * rng.standard_normal(n.size))
        assert (found.thrust(np.linspace(max(found.n_low, 0.2), 8.0, 100)) > -0.05).all()
        assert (found.n_low == 3.0) == (0 in found.powers)
    lifted = fit_thrust(n, 2.0 + 0.5 * n**2 + 0.01 * rng.standard_normal(n.size), offset=True)
    assert (lifted.powers[0], lifted.n_low) == (0, 3.0)
    with pytest.raises(DataError, match=r"1 1/s.* 3 to 8"):
        lifted.thrust(1.0)
    lifted.thrust(3.0)


def test_too_high_an_order() -> None:
    n = np.array([0.0, 3.0, 6.0, 9.0])
    with pytest.raises(DataError, match="order 5 needs more than 5"):
        fit_thrust(n, 0.8 * n**2, order=5)
    with pytest.raises(DataError, match="from 1 to 5"):
        fit_thrust(n, 0.8 * n**2, order=6)
