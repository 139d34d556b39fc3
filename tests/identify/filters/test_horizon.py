"""Moving horizon estimation: the Kalman filter on a linear model, and no worse on a ship."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from seatrial.identify.filters.horizon import Horizon
from seatrial.identify.filters.kalman import Extended, FilterModel, Numeric, dense, rk4

DT, ROWS, SPAN = 0.5, 60, 6.0
DENSITY = np.array([0.0, 0.04])


def pendulum(stiff: float) -> FilterModel:
    """A mass on a spring, position read; cubic where `stiff` is not zero."""
    z, a, dt = ca.SX.sym("z", 2), ca.SX.sym("a", 1), ca.SX.sym("dt")

    def rates(s: ca.SX) -> ca.SX:
        return ca.vertcat(s[1], -0.5 * s[0] - stiff * s[0] ** 3 - 0.2 * s[1] + a[0])

    whole, half = rk4(rates, z, dt), rk4(rates, z, 0.5 * dt)
    read = z[0] + stiff * z[0] ** 2
    unused = Numeric(dense([z], [z]))
    return FilterModel(
        names=("p", "v"), channels=("p",), angle=np.zeros(1), noise=np.array([0.1]), delay=np.zeros(1),
        step=Numeric(dense([z, a, dt], [whole, ca.jacobian(whole, z), ca.jacobian(half, z)])), step_points=unused,
        read=Numeric(dense([z, a], [read, ca.jacobian(read, z)])), read_points=unused,
    )  # fmt: skip


def readings(model: FilterModel, stiff: float, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Truth and readings."""
    rng = np.random.default_rng(seed)
    z, truth, read = np.array([1.0, 0.0]), [], []
    for _ in range(ROWS):
        z = model.step(z, np.zeros(1), DT)[0] + np.array([0.0, 0.2 * np.sqrt(DT)]) * rng.standard_normal(2)
        truth.append(z)
        read.append([z[0] + stiff * z[0] ** 2 + 0.1 * rng.standard_normal()])
    return np.array(truth), np.array(read)


def run(model: FilterModel, read: np.ndarray, iterations: int = 1) -> tuple[list, list, Horizon]:
    """Means and covariances of both, row by row."""
    mean, cov, first, still = np.array([0.5, 0.0]), np.eye(2), np.array([0], dtype=np.intp), np.zeros(1)
    horizon = Horizon.begun(model, DENSITY, DT, SPAN, 0.0, mean, cov)
    ekf, kalman, moving = Extended(model, DENSITY, DT), [], []
    for k, y in enumerate(read):
        mean, cov, _ = ekf.predict(mean, cov, still, DT)
        mean, cov, *_ = ekf.update(mean, cov, y, first, still)
        horizon.add((k + 1) * DT, still, y, first)
        kalman.append((mean, cov))
        moving.append(horizon.solve(iterations))
    return kalman, moving, horizon


@pytest.mark.slow
def test_a_linear_model_gives_the_kalman_filter() -> None:
    """The past counts exactly once: more would show as a smaller covariance, less as a larger one."""
    model = pendulum(0.0)
    kalman, moving, horizon = run(model, readings(model, 0.0)[1])
    assert horizon.rows == round(SPAN / DT) + 1
    for (mean, cov), (other, spread) in zip(kalman, moving, strict=True):
        np.testing.assert_allclose(other, mean, atol=1e-9)
        np.testing.assert_allclose(spread, cov, atol=1e-11)


@pytest.mark.slow
def test_a_nonlinear_model_gains_from_the_window() -> None:
    """With a curved reading the window linearises where the ship was, the filter where it was taken to be."""
    model, errors = pendulum(0.3), []
    for seed in range(6):
        truth, read = readings(model, 0.3, seed)
        kalman, moving, _ = run(model, read, iterations=3)
        errors.append([np.mean([np.sum((m - z) ** 2) for (m, _), z in zip(some, truth, strict=True)])
                       for some in (kalman, moving)])  # fmt: skip
    ekf, mhe = np.mean(errors, axis=0)
    assert mhe < ekf
