"""Least squares: hull derivatives in integrated form, AR, Yule-Walker, ARX, orders, predictions."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import Free, Terms, match, read
from seatrial.core.symbolic import sin
from seatrial.data import DataError, Trial
from seatrial.identify import Problem, StudyError
from seatrial.identify.regression.arx_fit import (
    ArxRegression,
    fit_arx,
    free_coefficients,
    predict,
)
from seatrial.identify.regression.regression import Regression, least_squares
from seatrial.manoeuvres import Policy
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models.arx import Arx
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

SHIP = load("kvlcc2_l7")
HULL = tuple(match(SHIP.model, "hull.*"))


@pytest.fixture(scope="module")
def trials() -> tuple[Trial, ...]:
    n, ten, twenty = approach(SHIP)[1], math.radians(10), math.radians(20)
    policies = (Turning(n_P=n, delta=0.4), Zigzag(n_P=n, delta=twenty, psi=twenty), Zigzag(n_P=n, delta=ten, psi=ten))
    return tuple(simulate(SHIP, p, duration=60.0, dt=0.1, name=f"t{i}") for i, p in enumerate(policies))


def noisy(trials: tuple[Trial, ...], size: float, seed: int = 0) -> tuple[Trial, ...]:
    rng = np.random.default_rng(seed)
    scale = {"u": 10 * size, "v_m": 10 * size, "r": size}
    return tuple(t.having(**{n: t[n] + s * rng.standard_normal(len(t)) for n, s in scale.items()}) for t in trials)


@pytest.mark.slow
def test_hull_derivatives_come_back_without_a_search(trials: tuple[Trial, ...]) -> None:
    free = tuple(Free(p, 0.0) for p in HULL)
    fit = Regression().fit(Problem(SHIP, trials, free))
    for path, value in zip(HULL, fit.values, strict=True):
        true = read(SHIP.model, path)
        assert value == pytest.approx(true, rel=0.01, abs=0.01 if abs(true) < 0.1 or "vv" in path else 0.0), path
        assert read(fit.ship.model, path) == value
    assert fit.status == "solved: linear least squares"


@pytest.mark.slow
def test_linear_derivatives_come_back_from_noise_within_three_sigma(trials: tuple[Trial, ...]) -> None:
    paths = ("hull.Y_v", "hull.Y_r", "hull.N_v", "hull.N_r", "hull.R_0")
    free = tuple(Free(p, 0.0) for p in paths)
    seen = []
    for seed in range(5):
        fit = Regression(window=3.0).fit(Problem(SHIP, noisy(trials, 2e-5, seed), free))
        true = np.array([read(SHIP.model, p) for p in paths])
        seen.append((fit.values - true) / fit.sigma)
    assert np.abs(seen).max() < 3.5
    assert np.sqrt(np.mean(np.square(seen))) < 1.5


@pytest.mark.slow
def test_bounds_and_priors_count(trials: tuple[Trial, ...]) -> None:
    bound = Regression().fit(Problem(SHIP, trials, (Free("hull.N_r", -0.04, -0.045, 0.0), Free("hull.Y_v", 0.0))))
    assert bound.at_bound == ("hull.N_r",)
    assert bound.values[0] == -0.045
    held = Regression().fit(Problem(SHIP, trials, (Free("hull.N_r", -0.04, prior=-0.04, sigma=1e-9),)))
    assert held.values[0] == pytest.approx(-0.04, abs=1e-6)


@pytest.mark.slow
def test_what_regression_cannot_do_is_said(trials: tuple[Trial, ...]) -> None:
    with pytest.raises(StudyError, match=r"not linear in body\.m_y"):
        Regression().fit(Problem(SHIP, trials, (Free("body.m_y", 100.0), Free("hull.Y_v", -0.3))))
    alike = tuple(replace(trial, meta={}) for trial in trials)  # of no length: those of another ship are refused before
    with pytest.raises(StudyError, match="states are all measured"):
        Regression().fit(Problem(load("mariner_nomoto2"), alike, (Free("K", 0.1),)))
    with pytest.raises(StudyError, match="above zero"):
        Regression(window=0.0)
    gone = replace(trials[0], channels={k: v for k, v in trials[0].channels.items() if k != "r"})
    with pytest.raises(StudyError, match="no channel r"):
        Regression().fit(Problem(SHIP, (gone,), (Free("hull.Y_v", -0.3),)))
    with pytest.raises(DataError, match="separate the 2 unknowns"):
        least_squares(np.ones((10, 2)), np.arange(10.0))


@dataclass(frozen=True)
class Waves(Policy):
    """Rudder and revolutions that never hold still."""

    memory: tuple[str, ...] = ()

    def begin(self, state: Any) -> tuple[()]:
        return ()

    def command(self, t: Any, state: Any, memory: Any) -> Any:
        n = 10.0 + 2.0 * sin(0.13 * t) + sin(0.37 * t) + sin(1.1 * t)
        return (n, 0.15 * sin(0.21 * t) + 0.1 * sin(0.057 * t) + 0.05 * sin(0.9 * t)), ()


TRUE = Arx(dt=0.5, coefficients=Terms(
    ("u_u_1", "u_n_P_1", "v_m_v_m_1", "v_m_r_1", "v_m_delta_1", "r_r_1", "r_r_2", "r_v_m_1", "r_delta_1", "r_delta_2",
     "r_constant"),
    (0.95, 0.005, 0.9, -0.4, 0.005, 1.1, -0.2, -0.01, 0.02, 0.005, 1e-4),
))  # fmt: skip


@pytest.fixture(scope="module")
def sampled() -> tuple[Ship, Trial]:
    ship = Ship("sampled", TRUE, SHIP.actuators, 7.0, 1.0, 10.0)
    trial = simulate(replace(ship, actuators=type(SHIP.actuators)()), Waves(), duration=400.0)
    # Without steering gear the order acts over the sample that begins with it.
    return ship, trial.having(delta=trial["delta_cmd"], n_P=trial["n_P_cmd"])


@pytest.mark.slow
def test_vector_arx_comes_back(sampled: tuple[Ship, Trial]) -> None:
    ship, trial = sampled
    fit = ArxRegression().fit(Problem(ship, (trial.rows(slice(0, -1)),), free_coefficients(TRUE)))
    np.testing.assert_allclose(fit.values, TRUE.coefficients.numbers, rtol=1e-7, atol=1e-9)
    some = (Free("coefficients.r_r_1", 0.0), Free("coefficients.r_delta_1", 0.0))
    part = ArxRegression().fit(Problem(ship, (trial,), some))
    np.testing.assert_allclose(part.values, (1.1, 0.02), rtol=1e-7)
    with pytest.raises(StudyError, match="no fit can move"):
        ArxRegression().fit(Problem(ship, (trial,), (Free("dt", 0.5),)))
    with pytest.raises(StudyError, match="ARX models only"):
        ArxRegression().fit(Problem(SHIP, (trial,), (Free("hull.Y_v", -0.3),)))


def test_order_and_coefficients_from_noisy_records_within_three_sigma(sampled: tuple[Ship, Trial]) -> None:
    rng = np.random.default_rng(5)
    _, trial = sampled
    delta = trial["delta"] + 0.05 * rng.standard_normal(len(trial))
    r = np.zeros(len(trial))
    for t in range(2, r.size):
        given = 0.02 * delta[t - 1] - 0.01 * delta[t - 2]
        r[t] = 1.2 * r[t - 1] - 0.3 * r[t - 2] + given + 2e-4 * rng.standard_normal()
    record = Trial("driven", trial.t, {"r": r, "delta": delta})
    found = fit_arx((record,), dt=0.5, most=4)
    assert found.table[0][:2] == (2, 2)
    assert len(found.table) == 16
    error = np.array(found.model.coefficients.numbers) - (1.2, -0.3, 0.02, -0.01, 0.0)
    assert np.abs(error / found.sigma).max() < 3.0
    assert found.residual[0] == pytest.approx(2e-4, rel=0.1)
    autoregressive = fit_arx((record,), dt=0.5, inputs=(), orders=(2, 1))
    assert autoregressive.model.coefficients.names == ("r_r_1", "r_r_2", "r_constant")
    with pytest.raises(StudyError, match="no channel"):
        fit_arx((record,), dt=0.5, outputs=("psi",))
    with pytest.raises(DataError, match="no channel v_m"):
        fit_arx((record,), dt=0.5, outputs=("v_m",))
    still = record.having(delta=np.zeros(len(record)))
    with pytest.raises(DataError, match="control held"):
        fit_arx((still,), dt=0.5)


def test_predictions_over_many_steps_are_free_runs(sampled: tuple[Ship, Trial]) -> None:
    _, trial = sampled
    made = predict(TRUE, trial, 20)
    for name in ("u", "v_m", "r"):
        for k in (0, 7, 19):
            ahead = made[name][: len(trial) - k - 1, k]
            good = np.isfinite(ahead)
            assert good.sum() > 700
            np.testing.assert_allclose(ahead[good], trial[name][k + 1 :][good], atol=1e-12)
    numbers = (0.9, *TRUE.coefficients.numbers[1:])
    wrong = predict(replace(TRUE, coefficients=replace(TRUE.coefficients, numbers=numbers)), trial, 20)
    error = np.nanstd(wrong["u"][:-20] - np.lib.stride_tricks.sliding_window_view(trial["u"][1:], 20), axis=0)
    assert error[0] < error[5] < error[-1]


@pytest.mark.slow
def test_a_gap_costs_the_rows_that_need_it(sampled: tuple[Ship, Trial]) -> None:
    ship, trial = sampled
    r = trial["r"].copy()
    r[100:103] = math.nan
    fit = ArxRegression().fit(Problem(ship, (trial.having(r=r).rows(slice(0, -1)),), free_coefficients(TRUE)))
    np.testing.assert_allclose(fit.values, TRUE.coefficients.numbers, rtol=1e-7, atol=1e-9)
