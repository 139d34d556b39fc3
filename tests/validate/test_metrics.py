import math

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.validate.metrics import (
    ESSO_OSAKA_SIGMA,
    heading,
    horizons,
    metrics,
    rmse,
    segments,
    spread,
    standardised,
)

A = np.array([1.0, 2.0, 3.0, np.nan])
B = np.array([2.0, 2.0, 5.0, 7.0])


def trial(n=11, dt=1.0, **channels):
    t = dt * np.arange(n)
    base = {name: np.zeros(n) for name in ("x", "y", "psi", "u", "v_m", "r")}
    return Trial("t", t, {**base, **channels})


def test_by_hand():
    # errors 1, 0, 2; measured mean 2, SST 2; var(error) = 2/3, var(measured) = 2/3
    assert rmse(A, B) == pytest.approx(math.sqrt(5 / 3))
    found = metrics(A, B)
    assert (found.rmse, found.bias, found.r2, found.fvu) == pytest.approx((math.sqrt(5 / 3), 1.0, 1 - 5 / 2, 1.0))
    assert found.samples == 3


def test_constant_channel_has_no_r2():
    found = metrics(np.ones(4), np.zeros(4))
    assert math.isnan(found.r2)
    assert math.isnan(found.fvu)
    assert found.rmse == 1.0


def test_nothing_to_compare():
    found = metrics(np.full(3, np.nan), np.zeros(3))
    assert found.samples == 0
    assert math.isnan(found.rmse)


def test_heading_across_the_wrap_and_whole_turns():
    truth = np.linspace(3.0, 10.0, 50)
    wrapped = np.angle(np.exp(1j * truth))
    a, b = heading(wrapped, truth + 0.1 + 4 * math.pi, np.zeros(50, dtype=np.intp))
    assert b - a == pytest.approx(np.full(50, 0.1))


def test_a_lap_too_many_counts():
    one = np.linspace(0.0, 0.0, 200)
    lap = np.linspace(0.0, 2 * math.pi, 200)
    a, b = heading(one, lap, np.zeros(200, dtype=np.intp))
    assert (b - a)[-1] == pytest.approx(2 * math.pi)


def test_heading_is_aligned_in_each_segment():
    # the first prediction runs off by more than half a turn; the second starts at the measurement
    truth = np.zeros(20)
    guess = np.concatenate([np.linspace(0, 4.0, 10), np.zeros(10)])
    segment = np.repeat([0, 1], 10).astype(np.intp)
    _, b = heading(truth, guess, segment)
    assert b[10:] == pytest.approx(np.zeros(10))


def test_segments():
    t = 0.1 * np.arange(21)
    assert list(np.unique(segments(t, 1.0), return_counts=True)[1]) == [10, 10, 1]
    assert segments(t, None).max() == 0
    with pytest.raises(ValueError, match="restart is 0 s"):
        segments(t, 0.0)


def test_standardised_by_hand():
    measured = trial()
    predicted = trial(x=np.full(11, 2.0), u=np.linspace(0, 1, 11))
    value = standardised(measured, predicted, {"x": 4.0, "u": 0.5, "r": 1.0})
    assert value == pytest.approx(0.25 + np.mean(np.linspace(0, 1, 11) ** 2) / 0.25)
    assert standardised(measured, measured, ESSO_OSAKA_SIGMA) == 0.0


def test_standardised_refuses():
    with pytest.raises(DataError, match="must be positive"):
        standardised(trial(), trial(), {"x": 0.0})
    with pytest.raises(DataError, match="phi is missing"):
        standardised(trial(), trial(), {"phi": 1.0})
    with pytest.raises(DataError, match="no sample of u"):
        standardised(trial(), trial(u=np.full(11, np.nan)), {"u": 1.0})


def test_spread_pools_trials_and_leaves_constants_out():
    a, b = trial(u=np.zeros(11)), trial(u=np.full(11, 2.0))
    assert spread([a, b]) == {"u": 1.0}


def test_horizons_by_hand():
    measured = trial(21)
    since = np.arange(21) % 10.0
    found = horizons(measured, trial(21, u=since), 10.0)
    assert list(found) == [1.0, 2.0, 5.0, 10.0]
    assert found[1.0]["u"] == 1.0
    assert found[2.0]["u"] == 2.0
    assert found[5.0]["u"] == pytest.approx(math.sqrt((9 + 16 + 25) / 3))
