"""Rates and limits of a ship file against logs whose rudder moves at a known rate to a known angle."""

from dataclasses import replace

import numpy as np
import pytest

from seatrial.actuators import Actuator, Actuators
from seatrial.data import Trial
from seatrial.identify.components.actuation import exceeded, moving
from seatrial.ships.files import load

T = np.arange(0.0, 100.0, 0.5)
DEG = np.pi / 180.0


def _log(rate, most, *, noise=0.0, outliers=()):
    """A rudder that is put over at `rate` [deg/s] to `most` [deg], and back again."""
    delta = np.clip(rate * (T - 10.0), 0.0, most) - np.clip(rate * (T - 60.0), 0.0, 2.0 * most)
    delta = DEG * (delta + np.random.default_rng(1).normal(0.0, noise, T.size))
    delta[list(outliers)] += 2.0
    return Trial("log", T, {"delta": delta, "n_P": np.full(T.size, 10.0)})


def _ship(rate=2.3, limit=35.0):
    rudder = Actuator(low=-DEG * limit, high=DEG * limit, rate=DEG * rate)
    return replace(load("kvlcc2_l7"), actuators=Actuators({"rudder": rudder}))


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.5])
def test_a_faster_rudder_is_named_with_its_rate(noise):
    (told,) = exceeded(_ship(), (_log(4.5, 30.0, noise=noise),))
    assert "[actuators.rudder] rate" in told
    assert float(told.split("moves at ")[1].split()[0]) == pytest.approx(4.5, rel=0.12)
    assert "rate 2.3" in told


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.5, 2.0])
@pytest.mark.parametrize("rate", [0.5, 2.0, 2.3])
def test_a_rudder_that_is_no_faster_says_nothing(rate, noise):
    """A slow one may have had small orders."""
    assert not list(exceeded(_ship(), (_log(rate, 20.0, noise=noise),)))


def test_an_angle_beyond_the_limit_is_named_on_its_side():
    lines = exceeded(_ship(rate=10.0, limit=20.0), (_log(4.5, 30.0),))
    (told,) = [line for line in lines if "high" in line]
    assert "goes to 30 deg, the ship file has high 20" in told


def test_two_outliers_are_no_rate_and_no_angle():
    assert not list(exceeded(_ship(), (_log(2.3, 30.0, outliers=(50, 150)),)))


def test_an_order_beyond_the_limit_is_not_judged():
    order = np.where(np.arange(T.size) // 10 % 2, 50.0 * DEG, -50.0 * DEG)
    log = Trial("log", T, {"delta": order, "n_P": np.full(T.size, 10.0)})
    assert list(exceeded(_ship(), (log,)))
    assert not list(exceeded(_ship(), (replace(log, meta={"held": ["delta"]}),)))


def test_the_fastest_trial_counts():
    slow, fast = _log(2.0, 30.0), _log(4.0, 30.0)
    (told,) = exceeded(_ship(), (slow, fast))
    assert "moves at 4 deg/s" in told
    assert moving(slow, "delta", DEG * 2.3) == pytest.approx(DEG * 2.0)
