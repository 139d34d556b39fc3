"""Sparse identification of nonlinear dynamics with control (pysindy): products of the second order, thresholded."""

from __future__ import annotations

import numpy as np
import pysindy as ps
from common import Series, Step, main


def fit(series: list[Series]) -> Step:
    model = ps.SINDy(
        feature_library=ps.PolynomialLibrary(degree=2), optimizer=ps.STLSQ(threshold=0.002, alpha=0.1),
        differentiation_method=ps.FiniteDifference(),
    )
    model.fit([one.velocity for one in series], t=1.0, u=[one.inputs for one in series])

    def step(velocity: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        now, acting = velocity[:, -1], inputs[:, -1]
        middle = np.clip(now + 0.5 * np.asarray(model.predict(now, u=acting)), -10.0, 10.0)
        return now + np.asarray(model.predict(middle, u=acting))

    return step


if __name__ == "__main__":
    main(fit)
