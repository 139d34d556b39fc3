"""Grey-box least squares (SciPy), as MATLAB's nlgreyest: a dozen numbers of a three-degree model, by simulation.

Accelerations are linear and quadratic damping, the Coriolis terms and one gain for each input; residuals are those of
velocities simulated over windows, each from its measured start.
"""

from __future__ import annotations

import numpy as np
from common import Series, Step, main, pairs
from scipy.optimize import least_squares

_WINDOW, _MOST = 40, 60


def terms(velocity: np.ndarray, inputs: np.ndarray) -> list[np.ndarray]:
    """Terms of surge, sway and yaw, each shape (lanes, terms)."""
    u, v, r = velocity.T
    own = ([u, u * np.abs(u), v * r, r * r, np.ones_like(u)], [v, v * np.abs(v), u * r, u * v, r],
           [r, r * np.abs(r), u * v, u * r, v])  # fmt: skip
    acting = [one * f for one in inputs.T for f in (np.ones_like(u), u)]
    return [np.column_stack([*some, *acting]) for some in own]


def change(velocity: np.ndarray, inputs: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Change of the velocities in a step, shape (lanes, 3)."""
    return np.column_stack([a @ b for a, b in zip(terms(velocity, inputs), theta.reshape(3, -1), strict=True)])


def begun(series: list[Series]) -> np.ndarray:
    """Where the search begins: regression of the changes from row to row."""
    before, acting, after = pairs(series, 1)
    step, columns = after - before[:, 0], terms(before[:, 0], acting[:, 0])
    return np.concatenate([np.linalg.lstsq(np.vstack([a, 0.03 * np.sqrt(len(a)) * np.eye(a.shape[1])]),
                                           np.append(b, np.zeros(a.shape[1])))[0]
                           for a, b in zip(columns, step.T, strict=True)])  # fmt: skip


def fit(series: list[Series]) -> Step:
    starts = [(one, row) for one in series for row in range(0, len(one.velocity) - _WINDOW, _WINDOW)]
    some = starts[:: max(len(starts) // _MOST, 1)]
    true = np.array([one.velocity[row : row + _WINDOW + 1] for one, row in some])
    acting = np.array([one.inputs[row : row + _WINDOW + 1] for one, row in some])

    def residuals(theta: np.ndarray) -> np.ndarray:
        now, out = true[:, 0], []
        for k in range(_WINDOW):
            now = np.clip(now + change(now, acting[:, k], theta), -10.0, 10.0)
            out.append(now - true[:, k + 1])
        return np.concatenate([np.nan_to_num(np.ravel(out)), 1e-2 * theta])

    found = least_squares(residuals, begun(series), max_nfev=20, method="trf").x
    return lambda velocity, inputs: velocity[:, 0] + change(velocity[:, 0], inputs[:, 0], found)


if __name__ == "__main__":
    main(fit)
