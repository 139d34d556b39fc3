"""The covariance of a least-squares factor by the scatter of stretches, against the sandwich written out."""

from __future__ import annotations

import numpy as np

from seatrial.data.check.symmetry import Least


def test_each_stretch_counts_by_itself_in_whatever_order_its_rows_come() -> None:
    rng = np.random.default_rng(5)
    back, e, length = rng.normal(size=(3, 40)), rng.normal(size=40), np.array([2.0, 3.0, 5.0])
    stretch = rng.permutation(np.repeat([0.0, 1.0, 4.0, 7.0], 10))
    x, covariance = Least(back, length, np.array([4.0, 9.0, 1.0]), e, stretch).first(2)
    wanted = np.zeros((2, 2))
    for k in (0.0, 1.0, 4.0, 7.0):
        score = sum(back[:2, row] * e[row] for row in range(40) if stretch[row] == k) / length[:2]
        wanted += np.outer(score, score)
    np.testing.assert_allclose(x, [2.0, 3.0])
    np.testing.assert_allclose(covariance, wanted)


def test_factors_are_those_of_least_squares_with_columns_apart_nearly_alike_and_alike() -> None:
    random = np.random.default_rng(4)
    a, b, d, y = random.normal(size=(4, 400))
    for c in (d, a + 1e-2 * d, a + 1e-4 * d, a):
        columns = np.column_stack([3.0 * a, b, c])
        found = Least.of(columns, y, np.arange(400.0) // 40)
        wanted = np.linalg.lstsq(columns, y, rcond=None)[0]
        np.testing.assert_allclose(found.e, y - columns @ wanted, atol=1e-9)
        length = np.linalg.norm(columns, axis=0)
        np.testing.assert_allclose(found.back, np.linalg.pinv(columns / length, rcond=1e-6)[:2], atol=1e-8)
        np.testing.assert_allclose(found.length, length)
        if c is not a:
            np.testing.assert_allclose(found.x / length, wanted, rtol=1e-6)
