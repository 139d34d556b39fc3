"""Fitting auto-regressive models with inputs (ARX) by least squares, and how many lags (Sawada 2024 4.1.2)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core.parameters import Free, Terms, unknown, values
from ...core.values import dataclass
from ...data import Array, DataError, Trial
from ...data.prepare import to_body
from ...models.arx import CONSTANT, INPUTS, OUTPUTS, Arx, lag_of
from .. import Fit, Problem, Progress, StudyError
from ..lint import linted
from ..record import even
from .regression import Solution, criteria, least_squares, weighted_fit


def _criterion(name: str) -> int:
    if name not in ("aic", "bic"):
        raise StudyError(unknown(name, ("aic", "bic"), "criterion"))
    return ("aic", "bic").index(name)


class Candidate(NamedTuple):
    """One line of the table of orders: lags of the outputs and of the controls, AIC, BIC, residual deviations."""

    outputs: int
    inputs: int
    aic: float
    bic: float
    sigma: tuple[float, ...]


@dataclass(frozen=True)
class ArxFit:
    """A fitted ARX model.

    Attributes:
        model: the model, with the order that the criterion prefers.
        sigma: standard deviation of each coefficient, in the order of the model's.
        covariance: of the coefficients, block by block of the equations, shape (n, n).
        residual: standard deviation of the one-step error of each output, SI.
        table: every order tried, best first.
    """

    model: Arx
    sigma: Array
    covariance: Array
    residual: tuple[float, ...]
    table: tuple[Candidate, ...]


def fit_arx(
    trials: Sequence[Trial], *, dt: float, outputs: Sequence[str] = ("r",), inputs: Sequence[str] = ("delta",),
    orders: tuple[int, ...] | None = None, most: int = 6, criterion: str = "bic", constant: bool = True,
) -> ArxFit:  # fmt: skip
    """ARX model of some velocities on some controls, by least squares, equation by equation.

    Args:
        trials: measured or simulated; resampled to `dt` where they are not on it.
        dt: sample time of the model [s].
        outputs: velocities to predict, of u, v_m, r; each may depend on all of them.
        inputs: controls, of n_P and delta; none makes it (vector) AR.
        orders: lags of outputs and inputs; None takes those up to `most` that the criterion prefers.
        most: greatest number of lags tried.
        criterion: "aic" or "bic".
        constant: whether each equation has a constant.

    Raises:
        DataError: too few samples, a missing channel, or motion that does not excite all coefficients.
        StudyError: an unknown output, input or criterion.
    """
    from scipy.linalg import block_diag

    at = _criterion(criterion)
    for name, known in (*((n, OUTPUTS) for n in outputs), *((n, INPUTS) for n in inputs)):
        if name not in known:
            raise StudyError(unknown(name, known, "channel"))
    tried = [orders] if orders else [(a, b) for a in range(1, most + 1) for b in range(1, (most if inputs else 1) + 1)]
    first = max(max(pair) for pair in tried)
    series = [_series(trial, dt, (*outputs, *inputs)) for trial in trials]
    found: list[tuple[Candidate, tuple[str, ...], list[Solution]]] = []
    for a, b in tried:
        names = _names(outputs, inputs, a, b, constant)
        solved, left = _solve(series, outputs, names, first)
        spread = np.atleast_2d(left.T @ left / len(left))
        count = sum(len(s.values) for s in solved)
        scores = criteria(float(np.linalg.det(spread)), len(left), count)
        found.append((Candidate(a, b, *scores, tuple(np.sqrt(np.diag(spread)).tolist())), names, solved))
    found.sort(key=lambda one: one[0][2 + at])
    best, names, solved = found[0]
    covariance = np.asarray(block_diag(*(s.covariance for s in solved)), dtype=np.float64)
    model = Arx(dt=dt, coefficients=Terms(names, tuple(float(v) for s in solved for v in s.values)))
    return ArxFit(model, np.sqrt(np.diag(covariance)), covariance, best.sigma, tuple(one[0] for one in found))


@dataclass(frozen=True)
class ArxRegression:
    """Estimator of a study for a ship whose model is `Arx`: the free coefficients by least squares.

    The structure is that of the ship's coefficients; those that are not free hold.  Priors and bounds count.
    """

    @linted
    def fit(self, problem: Problem, *, progress: Progress | None = None, checkpoint: Path | None = None) -> Fit:
        """Estimate the free coefficients of `problem`; there is nothing to resume, so `checkpoint` stays unused.

        Raises StudyError where the model is not ARX or something else is free, DataError where trials hold too little.
        """
        began = time.perf_counter()
        model: Any = problem.ship.model
        if not isinstance(model, Arx):
            raise StudyError(f"{problem.ship.name}: ArxRegression fits ARX models only; this is {type(model).__name__}")
        free = [f.path.removeprefix("coefficients.") for f in problem.free]
        wrong = [f.path for f in problem.free if not f.path.startswith("coefficients.")]
        if wrong:
            raise StudyError(f"free: {wrong[0]} is no coefficient; ArxRegression fits coefficients.* only")
        held = Terms(model.coefficients.names, tuple(
            0.0 if name in free else float(number) for name, number in model.coefficients.items()
        ))  # fmt: skip
        matrices, rights = list[Array](), list[Array]()
        longest = max(model.lags.values(), default=1)
        own = {lag_of(name).output for name in held.names}
        for trial in problem.trials:
            data = _series(trial, float(model.dt), _channels(model))
            rows = _rows(data, longest)
            rights.append(np.column_stack([data[n][rows] if n in own else np.zeros(rows.size) for n in OUTPUTS]))
            matrices.append(np.zeros((rows.size, len(OUTPUTS), len(free))))
            for name, number in held.items():
                column, k = _lagged(data, rows, name), OUTPUTS.index(lag_of(name).output)
                rights[-1][:, k] -= number * column
                if name in free:
                    matrices[-1][:, k, free.index(name)] = column
        return weighted_fit(problem, np.concatenate(matrices), np.concatenate(rights), self, began, progress)


def free_coefficients(model: Arx) -> tuple[Free, ...]:
    """Every coefficient free, without prior or bound."""
    return tuple(Free(path, value) for path, value in values(model).items() if path != "dt")


def predict(model: Arx, trial: Trial, steps: int) -> dict[str, Array]:
    """Predictions up to `steps` samples ahead from every sample, under the controls of the trial.

    Returns:
        For each output with an equation, shape (samples, steps): entry [t, k] is the prediction made at row
        t for row t + k + 1, NaN where the trial is too short before or behind.  Rows are those of the trial
        on the model's sample time.
    """
    data = _series(trial, float(model.dt), _channels(model))
    longest = max(model.lags.values(), default=1)
    count = next(iter(data.values())).size
    outputs = tuple(dict.fromkeys(lag_of(n).output for n in model.coefficients.names))
    starts = np.arange(longest - 1, count - steps)
    out = {name: np.full((count, steps), np.nan) for name in outputs}
    for k in range(steps):
        made = {name: np.zeros(starts.size) for name in outputs}
        for name, number in model.coefficients.items():
            output, of, lag = lag_of(name)
            if of == CONSTANT:
                made[output] += number
            elif of in out and lag <= k:
                made[output] += number * out[of][starts, k - lag]
            else:
                made[output] += number * data[of][starts + k + 1 - lag]
        for name in outputs:
            out[name][starts, k] = made[name]
    return out


def _channels(model: Arx) -> tuple[str, ...]:
    return tuple(dict.fromkeys((*model.lags, *(lag_of(name).output for name in model.coefficients.names))))


def _series(trial: Trial, dt: float, names: Sequence[str]) -> dict[str, Array]:
    """Channels on the sample time; velocities through the water where the trial has a current."""
    absent = [name for name in names if name not in trial]
    if absent:
        raise DataError(f"{trial.name}: no channel {', '.join(absent)}; the model needs {', '.join(names)}")
    on = even(trial, dt)
    out = {name: on[name].copy() for name in names}
    if "U_C" in on and "gamma_C" in on and "psi" in on:
        u_C, v_C = to_body(on["U_C"] * np.cos(on["gamma_C"]), on["U_C"] * np.sin(on["gamma_C"]), on["psi"])
        for name, drift in (("u", u_C), ("v_m", v_C)):
            if name in out:
                out[name] -= drift
    return out


def _rows(data: dict[str, Array], first: int) -> Any:
    """Rows that can be predicted: `first` samples before them, and no gap among these."""
    good = np.asarray(np.isfinite(np.column_stack(list(data.values()))).all(axis=1), dtype=np.float64)
    return np.flatnonzero(np.convolve(good, np.ones(first + 1), "valid") > first + 0.5) + first


def _lagged(data: dict[str, Array], rows: Any, name: str) -> Array:
    """What a coefficient multiplies, in these rows."""
    _, of, lag = lag_of(name)
    return np.ones(rows.size) if of == CONSTANT else data[of][rows - lag]


def _names(outputs: Sequence[str], inputs: Sequence[str], a: int, b: int, constant: bool) -> tuple[str, ...]:
    out: list[str] = []
    for output in outputs:
        out += [f"{output}_{of}_{lag}" for of in outputs for lag in range(1, a + 1)]
        out += [f"{output}_{of}_{lag}" for of in inputs for lag in range(1, b + 1)]
        out += [f"{output}_{CONSTANT}"] if constant else []
    return tuple(out)


def _solve(
    series: Sequence[dict[str, Array]], outputs: Sequence[str], names: Sequence[str], first: int
) -> tuple[list[Solution], Array]:
    """Least squares per equation, and the residuals, shape (rows, outputs)."""
    solved, left = list[Solution](), list[Array]()
    rows = [_rows(data, first) for data in series]
    for output in outputs:
        own = [name for name in names if lag_of(name).output == output]
        matrix = np.concatenate([
            np.column_stack([_lagged(data, at, name) for name in own]) for data, at in zip(series, rows, strict=True)
        ])  # fmt: skip
        right = np.concatenate([data[output][at] for data, at in zip(series, rows, strict=True)])
        solved.append(least_squares(matrix, right))
        left.append(right - matrix @ solved[-1].values)
    return solved, np.column_stack(left)
