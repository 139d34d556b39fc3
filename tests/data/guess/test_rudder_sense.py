"""The sign of a rudder from what the ship answers: right where the log tells it, open where it does not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from sailed import sail, steps, zigzag

from seatrial.data.guess.helm import rudder_sense

Array = NDArray[np.float64]
SURE = 6.0


def steady(angle: float, seed: int, dt: float = 0.5) -> tuple[Array, Array, Array]:
    """The steady part of a turn: rate and rudder are constants with noise, the latter to a tenth of a degree."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 120.0, dt)
    r = 0.11 * angle + 0.002 * rng.standard_normal(t.size)
    return t, r, np.radians(np.round(np.degrees(angle + 1e-3 * rng.standard_normal(t.size)), 1))


@pytest.mark.parametrize("angle", [-0.6, -0.09, 0.09, 0.35, 0.6])
def test_a_steady_turn_tells_nothing_by_its_noise(angle: float) -> None:
    """Means reach over whole windows only: padded ones would bend rudder and rate down together at the ends."""
    told = [rudder_sense(*steady(angle, seed, dt)) for seed in range(8) for dt in (0.1, 0.5, 1.0)]
    assert max(sure for _, sure in told) < SURE


@pytest.mark.slow
def test_the_sense_is_as_often_either_way_where_there_is_none() -> None:
    """Noise about a constant rudder is unbiased: both signs, within three standard deviations of a fair coin."""
    count = 120
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 300.0, 0.5)
    signs = [rudder_sense(t, 0.1 + 1e-3 * rng.standard_normal(t.size), 0.1 * rng.standard_normal(t.size))[0]
             for _ in range(count)]  # fmt: skip
    assert abs(sum(signs)) < 3.0 * math.sqrt(count)


@pytest.mark.parametrize("drift", [-0.006, 0.006])
def test_a_rudder_that_creeps_while_the_turn_settles_tells_nothing(drift: float) -> None:
    """The rate falls as speed is lost; a creep of a third of a degree goes with it or against it by chance."""
    t = np.arange(0.0, 200.0, 0.5)
    rng = np.random.default_rng(0)
    r = 0.04 * (1.0 + 0.6 * np.exp(-t / 60.0) - np.exp(-t / 15.0)) + 5e-5 * rng.standard_normal(t.size)
    for creep in (np.exp(-t / 60.0), np.exp(-t / 30.0), t / t[-1]):
        assert rudder_sense(t, r, 0.35 + drift * creep + 5e-5 * rng.standard_normal(t.size))[1] < SURE


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("helm", [zigzag(10.0, 10.0), steps((0.0, 0.0), (20.0, 20.0), (120.0, -5.0), (180.0, 0.0))])
def test_a_rudder_that_is_moved_shows_its_sign(helm, sign: float) -> None:
    trial = sail(helm, 240.0)
    sense, sure = rudder_sense(trial.t, trial["r"], sign * trial["delta"])
    assert (sense, sure > SURE) == (sign, True)


def test_a_gap_in_the_rate_hides_no_more_than_the_windows_about_it() -> None:
    trial = sail(zigzag(10.0, 10.0), 240.0)
    r = trial["r"].copy()
    r[400:420] = np.nan
    sense, sure = rudder_sense(trial.t, r, trial["delta"])
    assert (sense, sure > SURE) == (1.0, True)


@pytest.mark.parametrize("which", ["r", "delta"])
def test_a_value_that_is_no_number_of_a_ship_hides_no_sense_and_ends(which: str) -> None:
    """The square of 1e200 is infinite, and LAPACK looks for the singular values of an infinite number for ever."""
    t = np.arange(0.0, 400.0, 0.5)
    delta = 0.2 * np.sin(0.05 * t)
    r = 0.1 * np.sin(0.05 * (t - 4.0))
    sense, sure = rudder_sense(t, r, delta)
    assert (sense, sure > SURE) == (1.0, True)
    spoiled = {"r": r.copy(), "delta": delta.copy()}
    spoiled[which][10] = -1e200
    sense, sure = rudder_sense(t, spoiled["r"], spoiled["delta"])
    assert (sense, sure > SURE) == (1.0, True)
