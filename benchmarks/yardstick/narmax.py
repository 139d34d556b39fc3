"""Polynomial NARX models by forward regression with orthogonal least squares (sysidentpy), one of each velocity."""

from __future__ import annotations

import numpy as np
from common import Series, Step, main, pairs
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS

LAGS = 2
_MOST = 3000  # rows


def fit(series: list[Series]) -> Step:
    whole = np.concatenate([np.column_stack([one.velocity, one.inputs]) for one in series])[-_MOST:]
    models = [_one(whole, c) for c in range(3)]

    def step(velocity: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        past = np.concatenate([velocity, inputs], axis=2)
        return velocity[:, -1] + np.column_stack([_answer(past, c, *model) for c, model in enumerate(models)])

    # A selection is of one series; the numbers of what it selected are of all of them, of differences to the last step.
    before, acting, after = pairs(series, LAGS)
    past = np.concatenate([before, acting], axis=2)
    for c, (codes, _) in enumerate(models):
        columns = _columns(past, c, codes)
        theta, *_ = np.linalg.lstsq(columns, after[:, c] - before[:, -1, c], rcond=1e-8)
        models[c] = (codes, theta)
    return step


def _one(whole: np.ndarray, c: int) -> tuple[np.ndarray, np.ndarray]:
    others = [k for k in range(whole.shape[1]) if k != c]
    model = FROLS(
        order_selection=True, n_info_values=20, info_criteria="bic", ylag=LAGS, basis_function=Polynomial(degree=2),
        xlag=[[*range(1, LAGS + 1)]] * len(others),
    )
    model.fit(X=whole[:, others], y=whole[:, [c]])
    return np.asarray(model.final_model), np.zeros(0)


def _answer(past: np.ndarray, c: int, codes: np.ndarray, theta: np.ndarray) -> np.ndarray:
    return _columns(past, c, codes) @ theta


def _columns(past: np.ndarray, c: int, codes: np.ndarray) -> np.ndarray:
    """Products that codes of sysidentpy name: 1001 is the output a step before, 2001 the first input, 3002 a second."""
    others = [k for k in range(past.shape[2]) if k != c]
    out = np.ones((len(past), len(codes)))
    for row, code in enumerate(codes):
        for one in code[code > 0]:
            source, lag = divmod(int(one), 1000)
            channel = c if source == 1 else others[source - 2]
            out[:, row] *= past[:, -lag, channel]
    return out


if __name__ == "__main__":
    main(fit, LAGS)
