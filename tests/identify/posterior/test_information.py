"""Covariances by the scatter of groups, and the larger and the smaller of two: by brute force over combinations."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.identify.posterior.information import by_groups, inverse, larger, smaller, weakened

UNITS = np.array([1.0, 1e6, 1e-4, 30.0])


def drawn(rng: np.random.Generator) -> np.ndarray:
    """A covariance of four parameters whose units differ by ten orders."""
    half = rng.standard_normal((4, 6))
    return np.outer(UNITS, UNITS) * (half @ half.T)


def test_of_two_covariances_each_combination_has_the_larger_or_the_smaller_variance() -> None:
    rng = np.random.default_rng(1)
    one, other = drawn(rng), drawn(rng)
    both, least = larger(one, other), smaller(one, other)
    for way in rng.standard_normal((200, 4)) / UNITS:
        a, b, most, less = (float(way @ C @ way) for C in (one, other, both, least))
        assert most >= (1.0 - 1e-9) * max(a, b)
        assert less <= (1.0 + 1e-9) * min(a, b)
    # along what both have as their own axes the two are shared out: nothing is lost and nothing made
    np.testing.assert_allclose(both + least, one + other, rtol=1e-9, atol=1e-9 * float(np.min(UNITS)) ** 2)
    np.testing.assert_allclose(larger(other, one) / np.outer(UNITS, UNITS), both / np.outer(UNITS, UNITS), rtol=1e-7)
    np.testing.assert_allclose(larger(one, 0.5 * one), one, rtol=1e-9)
    np.testing.assert_allclose(smaller(one, 2.0 * one), one, rtol=1e-9)
    flat = np.diag([4.0, 1.0]), np.diag([1.0, 9.0])
    np.testing.assert_allclose(larger(*flat), np.diag([4.0, 9.0]), atol=1e-12)
    np.testing.assert_allclose(smaller(*flat), np.diag([1.0, 1.0]), atol=1e-12)


def test_a_combination_that_is_certain_stays_as_it_is() -> None:
    """The sum of two parameters is known to 1e-5 of each; of the other only their difference is wider."""
    one = np.array([[1.0, -1.0], [-1.0, 1.0]]) + 1e-10 * np.eye(2)
    wide = larger(one, 9.0 * one)
    np.testing.assert_allclose(wide, 9.0 * one, rtol=1e-5)
    assert float(np.ones(2) @ wide @ np.ones(2)) == pytest.approx(9.0 * 2e-10, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("prior", [0.0, 40.0])
def test_groups_of_white_residuals_scatter_as_the_information_says(prior: float) -> None:
    """Four groups of nine rows, one of which alone tells the third parameter; without the share they scatter less."""
    rng = np.random.default_rng(3)
    J = rng.standard_normal((4, 9, 3)) * [1.0, 5.0, 1e-3]
    J[1:, :, 2] *= 0.1
    held = prior * np.diag([1.0, 25.0, 1e-6])
    A = np.einsum("gri,grj->ij", J, J) + held
    back, grams = inverse(A), np.einsum("gri,grj->gij", J, J)
    np.testing.assert_allclose(back @ A, np.eye(3), atol=1e-9)
    told, bare, times, large = np.zeros((3, 3)), np.zeros((3, 3)), 0.0, 0.0
    draws = 3000
    for _ in range(draws):
        # the truth is drawn from its prior too, as its score is one of a number of observations
        true = rng.standard_normal(3) / np.sqrt(np.diag(held)) if prior else np.zeros(3)
        y = J @ true + rng.standard_normal(J.shape[:2])
        p = back @ np.einsum("gri,gr->i", J, y)
        scores = np.einsum("gri,gr->gi", J, J @ p - y)
        scatter, more = by_groups(A, grams, scores)
        told += scatter / draws
        times += more / draws
        large += by_groups(A, grams, 3.0 * scores)[1] / draws
        bare += (back @ (scores.T @ scores + held) @ back) / draws
    np.testing.assert_allclose(np.diag(told) / np.diag(back), 1.0, atol=0.1)
    # scores of white residuals scatter as these do, and three times as large ones by nine times the variance
    assert times == pytest.approx(1.0, abs=0.1)
    assert large == pytest.approx(9.0 * times)
    if not prior:
        assert np.diag(bare)[2] < 0.8 * back[2, 2]


def test_what_no_group_informs_scatters_by_its_own_information() -> None:
    held = np.diag([40.0, 1e3, 4e-5])
    none, times = by_groups(held, np.zeros((1, 3, 3)), np.zeros((1, 3)))
    assert times == 0.0
    np.testing.assert_allclose(none, np.diag(1.0 / np.diag(held)), rtol=1e-9)


def test_a_group_that_alone_tells_a_parameter_is_compared_with_little() -> None:
    """Without a prior its score is rounding, which the vanishing share that it leaves must not make large."""
    gram = np.diag([1e4, 1.0])
    told, _ = by_groups(gram, [gram], [np.array([1e-6, 1e-6])])
    assert np.all(np.abs(told) < 1e-9)


def test_data_that_count_less_leave_priors_as_they_are() -> None:
    """By rows of readings that are each repeated less often: a ninth of the information, and the prior beside it."""
    rng = np.random.default_rng(5)
    J, prior = rng.standard_normal((9, 3)), np.diag([0.5, 2.0, 1e3])
    data = J.T @ J
    np.testing.assert_allclose(weakened(9.0 * data + prior, 9.0 * data, 9.0), np.linalg.inv(data + prior), rtol=1e-9)
    np.testing.assert_allclose(weakened(data + prior, data, 1.0), np.linalg.inv(data + prior), rtol=1e-9)
    np.testing.assert_allclose(weakened(data + prior, data, 1e9), np.diag(1.0 / np.diag(prior)), rtol=1e-5, atol=1e-7)
