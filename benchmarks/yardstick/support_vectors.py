"""Support vector regression of the change of each velocity (scikit-learn), as in studies of ship identification."""

from __future__ import annotations

import numpy as np
from common import Series, Step, main, pairs
from sklearn.svm import SVR

_ROWS = 3000


def fit(series: list[Series]) -> Step:
    before, acting, after = pairs(series, 1)
    some = np.random.default_rng(0).permutation(len(after))[:_ROWS]
    points, change = np.column_stack([before[some, 0], acting[some, 0]]), after[some] - before[some, 0]
    size = change.std(axis=0)
    models = [SVR(C=10.0, epsilon=0.05, gamma=0.1).fit(points, change[:, c] / size[c]) for c in range(3)]

    def step(velocity: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        at = np.column_stack([velocity[:, 0], inputs[:, 0]])
        return velocity[:, 0] + np.column_stack([m.predict(at) for m in models]) * size

    return step


if __name__ == "__main__":
    main(fit)
