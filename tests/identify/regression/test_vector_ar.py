"""Vector AR and ARX models of any channels: known coefficients, orders, forecasts and their intervals."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.identify import StudyError
from seatrial.identify.regression.vector_ar import fit_vector_ar, forecast, vector_orders

A = np.array([[[1.2, 0.1], [-0.2, 0.9]], [[-0.5, 0.0], [0.1, -0.3]]])
B = np.array([[[0.4], [0.1]]])
NOISE = np.array([0.1, 0.2])


def record(rows: int, seed: int = 0, noise: float = 1.0, constant: float = 0.3) -> Trial:
    """A stable system of two outputs and one input that changes at random."""
    rng = np.random.default_rng(seed)
    c = np.repeat(rng.standard_normal(rows // 5 + 1), 5)[:rows]
    x = np.zeros((rows, 2))
    for k in range(2, rows):
        x[k] = (
            A[0] @ x[k - 1] + A[1] @ x[k - 2] + B[0] @ c[k - 1 : k] + constant + noise * NOISE * rng.standard_normal(2)
        )
    return Trial("waves", np.arange(rows, dtype=float), {"r": x[:, 0].copy(), "phi": x[:, 1].copy(), "delta": c.copy()})


@pytest.mark.slow
def test_coefficients_and_noise_are_found() -> None:
    found = fit_vector_ar(record(20_000), ("r", "phi"), ("delta",), order=(2, 1))
    np.testing.assert_allclose(found.A, A, atol=0.03)
    np.testing.assert_allclose(found.B, B, atol=0.01)
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), NOISE, rtol=0.02)
    assert found.radius < 1.0


def test_of_one_channel_it_is_the_ar_model_of_the_family() -> None:
    trial = record(400)
    mine, z = fit_vector_ar(trial, ("r",), order=(3, 0)), trial["r"] - trial["r"].mean()
    theirs = np.linalg.lstsq(np.column_stack([z[3 - i : -i] for i in (1, 2, 3)]), z[3:])[0]
    np.testing.assert_allclose(mine.A[:, 0, 0], theirs, atol=0.01)


@pytest.mark.slow
def test_aic_finds_the_order_and_bic_takes_no_more() -> None:
    trial = record(3000, seed=1)
    orders = {rule: vector_orders(trial, ("r", "phi"), ("delta",), most=5, criterion=rule)[0].order
              for rule in ("aic", "bic")}  # fmt: skip
    assert orders["bic"] == (2, 1)
    assert orders["aic"] >= (2, 1)


def test_without_noise_a_forecast_with_known_inputs_is_exact() -> None:
    trial = record(300, noise=0.0)
    found = fit_vector_ar(trial, ("r", "phi"), ("delta",), order=(2, 1))
    starts = np.arange(100, 200)
    made = forecast(found, trial, starts, 20, inputs="known")
    truth = np.stack([trial.stack("r", "phi")[starts + h] for h in range(1, 21)], axis=1)
    np.testing.assert_allclose(made, truth, atol=1e-8)


def test_a_forecast_looks_at_nothing_after_its_start() -> None:
    trial = record(300)
    found = fit_vector_ar(trial, ("r", "phi"), ("delta",), order=(2, 1))
    later = np.arange(300) > 150
    other = trial.having(**{name: np.where(later, 99.0, trial[name]) for name in ("r", "phi", "delta")})
    start = np.array([150])
    np.testing.assert_array_equal(forecast(found, trial, start, 10), forecast(found, other, start, 10))


@pytest.mark.slow
def test_errors_are_as_large_as_the_intervals_say() -> None:
    train, test = record(5000, seed=3), record(5000, seed=4)
    found = fit_vector_ar(train, ("r", "phi"), ("delta",), order=(2, 1))
    starts = np.arange(10, 4900)
    made = forecast(found, test, starts, 8, inputs="known")
    truth = np.stack([test.stack("r", "phi")[starts + h] for h in range(1, 9)], axis=1)
    np.testing.assert_allclose(np.sqrt(np.mean((made - truth) ** 2, axis=0)), found.spread(8), rtol=0.08)


@pytest.mark.parametrize(
    ("change", "options", "error", "message"),
    [(lambda t: t.having(r=np.where(t.t == 7, np.nan, t["r"])), {}, DataError, "channel r has a gap at 7 s"),
     (lambda t: t.rows(np.arange(200) != 9), {}, DataError, "time steps are uneven"),
     (lambda t: t.rows(slice(0, 8)), {}, DataError, "equations for"),
     (lambda t: t.having(delta=np.zeros(200)), {}, DataError, "not excited|do not separate"),
     (lambda t: t, {"order": (0, 1)}, StudyError, "lags of the outputs from 1"),
     (lambda t: t, {"order": (2, 0)}, StudyError, "of the inputs from 1")],
)  # fmt: skip
def test_what_cannot_be_fitted_is_named(change, options, error, message: str) -> None:
    with pytest.raises(error, match=message):
        fit_vector_ar(change(record(200)), ("r", "phi"), ("delta",), **{"order": (2, 1), **options})


def test_unknown_words_and_starts_are_refused() -> None:
    trial = record(200)
    found = fit_vector_ar(trial, ("r", "phi"), ("delta",), order=(2, 1))
    with pytest.raises(StudyError, match="criterion"):
        vector_orders(trial, ("r",), most=3, criterion="aicc")
    with pytest.raises(StudyError, match="treatment of inputs"):
        forecast(found, trial, np.array([20]), 3, inputs="guessed")
    for start in (0, 199):
        with pytest.raises(StudyError, match="starts from row 1 to 197"):
            forecast(found, trial, np.array([start]), 3, inputs="known")
