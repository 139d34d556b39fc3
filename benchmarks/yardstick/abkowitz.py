"""Regression of an Abkowitz polynomial: accelerations on products of velocities and inputs to the third order.

Terms as in Abkowitz (1964) and Fossen's texts, of the same parity in sway and yaw, by ridge regression.
"""

from __future__ import annotations

import numpy as np
from common import Series, Step, main, pairs


def terms(velocity: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Columns of the regression, shape (n, terms)."""
    u, v, r = velocity.T
    one = np.ones(u.size)
    hull = [one, u, v, r, u * u, u * v, u * r, v * r, v * v, r * r, u * np.abs(u), v * np.abs(v), r * np.abs(r),
            v**3, v * v * r, v * r * r, r**3]
    acting = [c * f for c in inputs.T for f in (one, u, u * u)] + [c * np.abs(c) for c in inputs.T]
    return np.column_stack(hull + acting)


def fit(series: list[Series]) -> Step:
    before, acting, after = pairs(series, 1)
    a = terms(before[:, 0], acting[:, 0])
    theta = np.linalg.solve(a.T @ a + 1e-3 * len(a) * 1e-3 * np.eye(a.shape[1]), a.T @ (after - before[:, 0]))
    return lambda velocity, inputs: velocity[:, 0] + terms(velocity[:, 0], inputs[:, 0]) @ theta


if __name__ == "__main__":
    main(fit)
