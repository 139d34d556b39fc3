"""Gaussian processes of the change of each velocity (scikit-learn), inputs as they are, on a part of the rows."""

from __future__ import annotations

import numpy as np
from common import Series, Step, main, pairs
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

_ROWS = 400


def fit(series: list[Series]) -> Step:
    before, acting, after = pairs(series, 1)
    some = np.random.default_rng(0).permutation(len(after))[:_ROWS]
    points, change = np.column_stack([before[some, 0], acting[some, 0]]), after[some] - before[some, 0]
    size = change.std(axis=0)
    kernel = ConstantKernel(1.0) * RBF(np.full(points.shape[1], 3.0), (0.3, 1e3)) + WhiteKernel(0.1)
    models = [GaussianProcessRegressor(kernel, normalize_y=True, random_state=0).fit(points, change[:, c] / size[c])
              for c in range(3)]

    def step(velocity: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        at = np.column_stack([velocity[:, 0], inputs[:, 0]])
        return velocity[:, 0] + np.column_stack([m.predict(at) for m in models]) * size

    return step


if __name__ == "__main__":
    main(fit)
