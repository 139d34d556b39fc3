"""Options as numbers: what is accepted, in which unit, and what a refusal names."""

from __future__ import annotations

import math

import pytest

from seatrial.ships.files import load
from seatrial.workflow import RequestError
from seatrial.workflow.asked import Around
from seatrial.workflow.request import DEGREE, finite, left, numbers, positive, speed_of, surroundings, vector


def test_a_degree_is_a_degree() -> None:
    assert pytest.approx(math.pi) == 180.0 * DEGREE


@pytest.mark.parametrize("value", [0.0, -1.0, math.inf, math.nan, 1e31])
def test_what_is_to_be_positive_is(value: float) -> None:
    with pytest.raises(RequestError, match="--dead-time is"):
        positive(dead_time=value)
    positive(dead_time=None)
    positive(dead_time=1e-3)


@pytest.mark.parametrize("value", [math.inf, math.nan, 1e31, 1e-31])
def test_what_is_to_be_finite_is(value: float) -> None:
    with pytest.raises(RequestError, match="--heading is"):
        finite(heading=value)
    finite(heading=-5.0)
    finite(heading=0.0)
    finite(heading=None)


def test_a_speed_is_the_ship_s_own_or_one_that_makes_sense() -> None:
    """Up to a Froude number of one, or twice the ship's own speed where that is more."""
    ship = load("kvlcc2_l7")
    assert speed_of(ship, None) == ship.speed
    most = math.sqrt(9.81 * ship.L_pp)
    assert most > 2.0 * ship.speed
    assert speed_of(ship, 0.999 * most) == 0.999 * most
    with pytest.raises(RequestError, match="--speed is"):
        speed_of(ship, 1.001 * most)
    with pytest.raises(RequestError, match="--speed is nan"):
        speed_of(ship, math.nan)


def test_a_direction_is_within_a_turn_with_its_sign() -> None:
    assert vector("--wind", "5,90") == pytest.approx((5.0, 0.5 * math.pi))
    assert vector("--wind", "5,450") == pytest.approx((5.0, 0.5 * math.pi))
    assert vector("--wind", "5,-450") == pytest.approx((5.0, -0.5 * math.pi))
    assert vector("--wind", "0,0") == (0.0, 0.0)
    assert vector("--wind", None) == (0.0, 0.0)


def test_an_exchange_of_speed_and_direction_is_told_where_it_can_be_one() -> None:
    with pytest.raises(RequestError, match="speed first, that is 5,90"):
        vector("--wind", "90,5", 60.0)
    with pytest.raises(RequestError) as refused:
        vector("--wind", "400,5", 60.0)
    assert "that is" not in str(refused.value)
    for text in ("-1,5", "1", "1,2,3", "a,b", "1,nan"):
        with pytest.raises(RequestError, match="--wind is"):
            vector("--wind", text)


def test_as_many_numbers_as_the_form_has() -> None:
    assert numbers("--start", "1,2,3", "X,Y,DEG such as 250,-60,0") == [1.0, 2.0, 3.0]
    for text in ("1,2", "1,2,3,4", "1,,3"):
        with pytest.raises(RequestError, match="write X,Y,DEG"):
            numbers("--start", text, "X,Y,DEG such as 250,-60,0")


def test_what_is_left_takes_as_long_a_piece_as_what_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("seatrial.workflow.request.time.monotonic", lambda: 110.0)
    assert left(100.0, 2, 8) == "; 30 s left"
    assert left(100.0, 0, 8) == left(100.0, 8, 8) == ""
    assert left(109.0, 4, 8) == ""  # a second is not worth a word


def test_wind_comes_from_and_current_goes_towards() -> None:
    """Components of where the wind is from, and of where the water goes; a wind from port pushes to starboard."""
    ship = load("esso_osaka_3m")
    now = surroundings(ship, Around("5,0", current="0.3,90")).weather.now()
    assert (now.wind_x, now.wind_y) == pytest.approx((5.0, 0.0), abs=1e-12)
    assert (now.current_x, now.current_y) == pytest.approx((0.0, 0.3), abs=1e-12)
    abeam = surroundings(ship, Around(wind="5,270")).weather.now()
    still = (0.0,) * 6
    pushed = ship.model.derivative(still, (0.0,) * len(ship.model.controls), abeam)
    assert pushed[4] > 0.0
