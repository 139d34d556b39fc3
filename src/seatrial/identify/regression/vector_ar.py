"""Vector AR and ARX models of any channels of a log: fit, order, and forecasts with their intervals.

x(t) = sum A_i x(t - i) + sum B_j c(t - j) + constant + white noise (Sawada 2024 Eq. 9 for several outputs, as in the
literature of ships' autopilots since Ohtsu).  `models.arx` is the ship model among these: of u, v_m and r, with the
controls as inputs.  Here outputs are what was logged, such as yaw rate and roll in waves, and the rudder of an
autopilot may be an output itself: then its loop is part of the model, and a forecast needs no order of the future.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import unknown
from ...core.values import dataclass
from ...data import Array, DataError, Trial
from .. import StudyError
from .regression import criteria, least_squares

_RULES = ("aic", "bic")


@dataclass(frozen=True)
class VectorAr:
    """A fitted model.

    Attributes:
        outputs, inputs: channels; without inputs it is (vector) AR.
        A: coefficients of the outputs, the most recent sample's first, shape (lags, outputs, outputs).
        B: coefficients of the inputs, shape (input lags, outputs, inputs).
        constant: of each equation, shape (outputs,).
        covariance: of the one-step errors, shape (outputs, outputs).
        rows: samples that the fit rests on.
        aic, bic: criteria on these rows.
    """

    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    A: Array
    B: Array
    constant: Array
    covariance: Array
    rows: int
    aic: float
    bic: float

    @property
    def order(self) -> tuple[int, int]:
        """Lags of the outputs and of the inputs."""
        return len(self.A), len(self.B)

    @property
    def longest(self) -> int:
        """The longest lag."""
        return max(self.order)

    @property
    def radius(self) -> float:
        """Largest modulus of the roots of the homogeneous part; below 1 it is stable."""
        p, n = len(self.A), len(self.outputs)
        companion = np.zeros((p * n, p * n))
        companion[:n] = np.concatenate(list(self.A), axis=1)
        companion[n:, : (p - 1) * n] = np.eye((p - 1) * n)
        return float(np.max(np.abs(np.linalg.eigvals(companion))))

    def spread(self, steps: int) -> Array:
        """Standard deviation of a forecast by step, inputs known, shape (steps, outputs)."""
        n = len(self.outputs)
        impulse = [np.eye(n)]
        for k in range(1, steps):
            impulse.append(sum((self.A[i] @ impulse[k - 1 - i] for i in range(min(k, len(self.A)))), np.zeros((n, n))))
        parts = np.cumsum([one @ self.covariance @ one.T for one in impulse], axis=0)
        return np.sqrt(np.diagonal(parts, axis1=1, axis2=2))


def fit_vector_ar(
    trial: Trial, outputs: Sequence[str], inputs: Sequence[str] = (), *, order: tuple[int, int],
    first: int | None = None,
) -> VectorAr:  # fmt: skip
    """Least squares, equation by equation.

    Args:
        trial: evenly sampled, without gaps in these channels.
        outputs, inputs: channels.
        order: lags of outputs and of inputs, from 1 (no inputs: 0).
        first: first row that is predicted; orders compare on the same rows.

    Raises:
        DataError: a gap, uneven samples, or too few or too dull ones.
        StudyError: an order that is not possible.
    """
    p, q = order
    if p < 1 or (q < 1) != (not inputs):
        raise StudyError(f"order {order}: lags of the outputs from 1, of the inputs from 1 where there are any")
    x, c = _table(trial, outputs), _table(trial, inputs)
    start = max(p, q) if first is None else max(first, p, q)
    rows = np.arange(start, len(x))
    lagged = [x[rows - i] for i in range(1, p + 1)] + [c[rows - j] for j in range(1, q + 1)]
    matrix = np.column_stack([*lagged, np.ones(rows.size)])
    found = np.stack([least_squares(matrix, x[rows, k]).values for k in range(len(outputs))])
    left = x[rows] - matrix @ found.T
    n, m = len(outputs), len(inputs)
    spread = left.T @ left / rows.size
    aic, bic = criteria(float(np.linalg.det(spread)), rows.size, found.size)
    return VectorAr(
        tuple(outputs), tuple(inputs), found[:, : p * n].reshape(n, p, n).swapaxes(0, 1),
        found[:, p * n : p * n + q * m].reshape(n, q, m).swapaxes(0, 1), found[:, -1], spread, rows.size, aic, bic,
    )  # fmt: skip


def vector_orders(
    trial: Trial, outputs: Sequence[str], inputs: Sequence[str] = (), *, most: int = 15, criterion: str = "aic"
) -> list[VectorAr]:
    """Models of every order up to `most`, on the same rows, the one that AIC or BIC prefers first."""
    if criterion not in _RULES:
        raise StudyError(unknown(criterion, _RULES, "criterion"))
    tried = [(p, q) for p in range(1, most + 1) for q in (range(1, most + 1) if inputs else (0,))]
    every = [fit_vector_ar(trial, outputs, inputs, order=order, first=most) for order in tried]
    return sorted(every, key=lambda one: one.aic if criterion == "aic" else one.bic)


def forecast(model: VectorAr, trial: Trial, starts: NDArray[np.intp], steps: int, *, inputs: str = "held") -> Array:
    """Forecasts from some rows, each by what was logged up to and including that row.

    Args:
        model: what forecasts.
        trial: on the sample time of the model.
        starts: rows, each at least `model.longest` - 1.
        steps: how many samples ahead.
        inputs: of the time to come: "held" at the row of the start, or "known" as logged.

    Returns:
        Outputs, shape (starts, steps, outputs): entry [k, h] is for row starts[k] + h + 1.

    Raises:
        StudyError: a start too early, or where inputs are known too late.
    """
    if inputs not in ("held", "known"):
        raise StudyError(unknown(inputs, ("held", "known"), "treatment of inputs"))
    x, c = _table(trial, model.outputs), _table(trial, model.inputs)
    last = len(x) - 1 - (steps - 1 if inputs == "known" and model.inputs else 0)
    if starts.size and (int(starts.min()) < model.longest - 1 or int(starts.max()) > last):
        raise StudyError(f"starts from row {model.longest - 1} to {last} can be forecast {steps} steps ahead")
    p, q = model.order
    out = np.zeros((starts.size, steps, len(model.outputs)))
    for h in range(steps):
        value = np.tile(model.constant, (starts.size, 1))
        for i in range(1, p + 1):
            back = out[:, h - i] if h >= i else x[starts + h + 1 - i]
            value = value + back @ model.A[i - 1].T
        for j in range(1, q + 1):
            at = starts + h + 1 - j
            value = value + c[np.minimum(at, starts) if inputs == "held" else at] @ model.B[j - 1].T
        out[:, h] = value
    return out


def _table(trial: Trial, names: Sequence[str]) -> Array:
    """Channels side by side, shape (samples, channels); none may have a gap, and time must be even."""
    if len(trial) > 1 and float(np.ptp(np.diff(trial.t))) > 1e-3 * trial.dt:
        raise DataError(f"{trial.name}: time steps are uneven; seatrial resample makes them even")
    table = np.column_stack([trial[name] for name in names]) if names else np.zeros((len(trial), 0))
    gaps = ~np.isfinite(table).all(axis=0)
    if gaps.any():
        name = names[int(np.flatnonzero(gaps)[0])]
        row = int(np.flatnonzero(~np.isfinite(trial[name]))[0])
        raise DataError(f"{trial.name}: channel {name} has a gap at {trial.t[row]:g} s; AR models need every row")
    if table.size and not math.isfinite(float(table.std())):
        raise DataError(f"{trial.name}: values of {', '.join(names)} are too large")
    return table
