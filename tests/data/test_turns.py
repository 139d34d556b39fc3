"""Two instruments in one series, against series whose instruments are known, and series of one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.check import check_folder
from seatrial.data.turns import DIFFER, turns

DEG = math.radians(1.0)


def _mixed(rng: np.random.Generator, count: int, off: float, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """A heading of two gyros in random order, and which of them each reading is of."""
    second = rng.random(count) < 0.5
    t = np.arange(count) * 0.5
    return 0.3 * np.sin(0.02 * t) + np.where(second, off, 0.0) + rng.normal(0.0, noise, count), second


@pytest.mark.parametrize("off", [0.5 * DEG, -3.0 * DEG])
@pytest.mark.parametrize("seed", range(5))
def test_readings_of_two_in_any_order_are_told_apart(off: float, seed: int) -> None:
    psi, second = _mixed(np.random.default_rng(seed), 400, off, abs(off) / 40.0)
    found = turns("psi", psi)
    assert found is not None
    by, apart = found
    assert apart == pytest.approx(abs(off), rel=0.25)
    assert np.mean(by == (second ^ second[0])) > 0.98


def test_places_of_two_antennas_that_turn_with_the_ship_are_told_apart() -> None:
    """20 m fore and aft of midship on a circle: the leap between them turns by all angles."""
    t = np.arange(600) * 0.5
    heading, second = 0.02 * t, np.arange(600) % 3 == 1
    arm = np.where(second, -20.0, 20.0)
    north, east = 250.0 * np.sin(heading) + arm * np.cos(heading), -250.0 * np.cos(heading) + arm * np.sin(heading)
    found = turns("x", north, east)
    assert found is not None
    assert np.mean(found[0] == second) > 0.99
    assert found[1] == pytest.approx(40.0, rel=0.1)


ONE = {
    "white noise": lambda rng, n: rng.normal(0.0, 2.0 * DEG, n),
    "a step": lambda rng, n: np.where(np.arange(n) > 60, 1.0, 0.0),
    "a square wave": lambda rng, n: np.where(np.arange(n) // 20 % 2, 0.3, -0.3),
    "coarse": lambda rng, n: np.round(np.arange(n) * 0.2) * DEG,
    "flickers between two digits": lambda rng, n: np.round(10.5 + rng.normal(0.0, 0.3, n)) * DEG,
    "flickers along a turn": lambda rng, n: np.round(0.05 * np.arange(n) + rng.normal(0.0, 0.3, n)) * DEG,
    "flickers over some digits": lambda rng, n: np.round(10.5 + rng.normal(0.0, 0.8, n)) * DEG,
    "stairs of a turn": lambda rng, n: np.repeat(20.0 * np.sin(0.04 * np.arange(n // 2)), 2) * DEG,
    "waves": lambda rng, n: 3.0 * DEG * np.sin(0.9 * np.arange(n)),
    "random walk": lambda rng, n: np.cumsum(rng.normal(0.0, DEG, n)),
    "spikes": lambda rng, n: np.where(rng.random(n) < 0.04, 1.0, 0.0),
    "held": lambda rng, n: np.repeat(rng.normal(0.0, DEG, n // 4), 4),
    "few": lambda rng, n: np.arange(12) % 2 * 0.1,
    "nothing": lambda rng, n: np.zeros(n),
}


@pytest.mark.parametrize("name", ONE)
@pytest.mark.parametrize("seed", range(3))
def test_one_instrument_is_one(name: str, seed: int) -> None:
    values = ONE[name](np.random.default_rng(seed), 240)
    assert turns("psi", values) is None


@pytest.mark.parametrize(("wiggle", "told"), [(0.05, True), (0.15, False)])
def test_leaps_are_five_times_what_each_instrument_is_off_a_line(wiggle: float, told: bool) -> None:
    """Each of two goes up and down from reading to reading, by twice the wiggle off the middle of its neighbours."""
    k = np.arange(200)
    values = DEG * (k % 2 + np.where(k // 2 % 2, wiggle, -wiggle))
    assert (turns("psi", values) is not None) == told


@pytest.mark.parametrize("name", ["psi", "delta"])
def test_less_than_what_instruments_agree_in_is_not_told(name: str) -> None:
    leaps, along = np.arange(100) % 2 * DIFFER[name], 2e-3 * DEG * np.arange(100)
    assert turns(name, 0.9 * leaps + along) is None
    assert turns(name, 1.2 * leaps + along) is not None


@pytest.mark.parametrize(("apart", "told"), [(2, False), (3, True)])
def test_two_that_are_as_coarse_are_told_from_one_that_flickers_by_more_than_two_digits(apart: int, told: bool) -> None:
    values = 0.5 * DEG * (np.arange(200) // 40 + np.arange(200) % 2 * apart)
    assert (turns("psi", values) is not None) == told


@pytest.mark.parametrize("off", [2.0 * DEG, 0.0])
def test_the_check_names_a_channel_of_two(off: float) -> None:
    t = np.arange(200.0)
    rng = np.random.default_rng(0)
    psi = 6.2 + 0.01 * t + np.where(np.arange(200) % 2, off, 0.0) + rng.normal(0.0, 0.02 * DEG, 200)
    found = [one for one in check_folder([Trial("a", t, {"psi": psi})]) if one.key == "turns"]
    assert len(found) == bool(off)
    if off:
        assert "2 deg apart, 100 of 200 readings" in found[0].evidence
