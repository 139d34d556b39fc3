"""Rudders and revolutions of a guess: units on both sides of each bound, signs by ships that answer to them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from columns import signal

from seatrial.data import Array
from seatrial.data.guess.answers import ASK, quoted
from seatrial.data.guess.helm import _held, _mean, read_revolutions, read_rudder, rudder_sense

DEGREE = math.pi / 180.0


@pytest.mark.parametrize(("largest", "said", "logged", "unit"), [
    (4.2, "rad", set(), "deg"), (3.8, "rad", set(), "rad"), (90.0, "deg", set(), "deg"),
    (182.0, "", set(), ASK), (178.0, "", set(), "deg"), (1.65, "", set(), "deg"), (1.55, "", {"rad"}, "rad"),
    (1.55, "", set(), ASK), (1.55, "", {"deg"}, ASK), (0.16, "", set(), "rad"), (0.14, "", set(), ASK),
    (0.79, "", set(), "rad"), (0.81, "", set(), ASK), (0.5, "", {"deg"}, ASK), (0.5, "", {"deg", "rad"}, ASK),
])  # fmt: skip
def test_the_unit_of_a_rudder_by_its_largest_value(largest: float, said: str, logged: set[str], unit: str) -> None:
    values = [0.0, -largest, 0.5 * largest]
    keys, answer = read_rudder(signal("delta", values, unit=said), np.arange(3.0), None, logged)
    assert keys == {"unit": quoted(unit), "sign": quoted(ASK)}
    assert any("deg or rad" in one for one in answer.doubts) == (unit == ASK)
    assert any("are taken as radians" in one for one in answer.doubts) == (unit == "rad" and not said and not logged)
    assert any("says rad" in one for one in answer.doubts) == (said == "rad" and unit == "deg")


def test_a_mean_over_rows_lies_in_their_middle_and_is_none_at_the_ends() -> None:
    six, none = np.arange(6.0), np.nan
    assert _mean(six, 3) == pytest.approx([none, 1.0, 2.0, 3.0, 4.0, none], nan_ok=True)
    assert _mean(six, 4) == pytest.approx([none, 1.5, 2.5, 3.5, none, none], nan_ok=True)
    assert _mean(six, 1) == pytest.approx(six)
    assert _mean(six, 6) == pytest.approx([none, none, 2.5, none, none, none], nan_ok=True)
    assert np.isnan(_mean(six, 7)).all()


def answered(delta: Array, dt: float, K: float = 0.1, T: float = 6.0) -> Array:
    """Rate of turn of Nomoto's ship, T r' + r = K delta, exactly for a rudder that is held from row to row."""
    r, keep = np.zeros(delta.size), math.exp(-dt / T)
    for k in range(delta.size - 1):
        r[k + 1] = keep * r[k] + (1.0 - keep) * K * delta[k]
    return r


@pytest.mark.parametrize("dt", [0.5, 2.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_side_to_which_a_ship_answers_is_that_of_its_rudder(side: float, dt: float) -> None:
    t = dt * np.arange(400)
    delta = 0.2 * np.sign(np.sin(2.0 * np.pi * t / (120.0 * dt)))
    r = answered(delta, dt)
    assert rudder_sense(t, r, side * delta) == (side, 99.0)
    noise = np.random.default_rng(0).normal(0.0, 0.3 * np.std(r), t.size)
    sense, sure = rudder_sense(t, r + noise, side * delta)
    assert sense == side
    assert 6.0 < sure < 99.0
    assert rudder_sense(t, noise, delta)[1] < 6.0  # a ship that does not answer


@pytest.mark.parametrize(("swing", "shows"), [(0.027, False), (0.034, True)])
def test_a_rudder_that_moves_by_less_than_a_fifth_of_what_it_is_held_at_tells_nothing(
    swing: float, shows: bool
) -> None:
    t = np.arange(600.0)
    delta = 0.3 + swing * np.sin(2.0 * np.pi * t / 240.0)
    for side in (1.0, -1.0):  # held to either side
        sense, sure = rudder_sense(t, answered(side * delta, 1.0), side * delta)
        assert (sense, sure > 6.0) == ((1.0, True) if shows else (0.0, False))


def test_less_than_thirty_windows_tell_nothing() -> None:
    t = np.arange(31.0)
    delta = 0.2 * np.sign(np.sin(2.0 * np.pi * (t + 0.5) / 10.0))
    assert rudder_sense(t[:30], answered(delta, 1.0)[:30], delta[:30]) == (0.0, 0.0)
    t = np.arange(60.0)
    delta = 0.2 * np.sign(np.sin(2.0 * np.pi * (t + 0.5) / 20.0))
    assert rudder_sense(t, answered(delta, 1.0), delta)[0] == 1.0


def test_how_sure_a_side_is_is_the_partial_correlation_with_a_quarter_of_the_rows() -> None:
    """t of a regression by rho sqrt(n / (1 - rho^2)), halved as windows overlap by three quarters."""
    rng = np.random.default_rng(3)
    t = 2.0 * np.arange(32)  # 31 steps of one row; all longer windows are too few
    delta, r = rng.normal(0.0, 0.1, 32), rng.normal(0.0, 0.01, 32)
    r[1:] += 0.05 * delta[:-1]
    table = np.column_stack([r[:-1], np.ones(31)])
    rest = [one - table @ np.linalg.lstsq(table, one, rcond=None)[0] for one in (r[1:] - r[:-1], delta[:-1])]
    rho = float(np.corrcoef(*rest)[0, 1])
    assert rudder_sense(t, r, delta) == pytest.approx((1.0, 0.5 * rho * math.sqrt(28 / (1.0 - rho**2))))
    assert rudder_sense(t[:31], r[:31], delta[:31])[1] > 0.0  # thirty windows
    assert rudder_sense(t[:30], r[:30], delta[:30]) == (0.0, 0.0)
    weak = rng.normal(0.0, 0.01, 400) + np.concatenate([[0.0], 0.02 * (long := rng.normal(0.0, 0.1, 400))[:-1]])
    weak = np.cumsum(weak)  # a twenty-fifth of the changes is that of the rudder
    assert rudder_sense(2.0 * np.arange(400), weak, long) == (0.0, 0.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_rudder_that_turns_the_ship_to_port_gets_a_sign(side: float) -> None:
    t = np.arange(400.0)
    delta = 0.2 * np.sign(np.sin(2.0 * np.pi * (t + 0.5) / 100.0))
    way, sign = "starboard" if side > 0 else "port", {} if side > 0 else {"sign": "-1"}
    keys, answer = read_rudder(signal("delta", side * delta, unit="rad"), t, answered(delta, 1.0), set())
    assert (keys, answer.doubts) == ({"unit": '"rad"', **sign}, ())
    assert f"the bow goes to {way} with it (99 standard errors)" in answer.evidence
    still, r, over = held(side * 0.5, 0.02)
    keys, answer = read_rudder(signal("delta", over, unit="rad"), still, r, set())
    assert (keys, answer.doubts) == ({"unit": '"rad"', **sign}, ())
    assert f"held, it turns the bow to {way}" in answer.evidence


def held(delta: float, r: float, rows: int = 100) -> tuple[Array, Array, Array]:
    return np.arange(float(rows)), np.full(rows, r), np.full(rows, delta)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_rudder_held_well_over_shows_its_side_after_a_radian_of_turn(side: float) -> None:
    assert _held(*held(side * 0.5, 0.02), "rad") == side
    assert _held(*held(0.5, side * 0.0105), "rad") == side
    assert _held(*held(0.5, side * 0.0095), "rad") == 0.0  # .95 rad
    assert _held(*held(side * 0.125, 0.02), "rad") == side
    assert _held(*held(side * 0.115, 0.02), "rad") == 0.0
    assert _held(*held(side * 7.0, 0.02), "deg") == side  # .122 rad
    assert _held(*held(side * 6.8, 0.02), "deg") == 0.0
    assert _held(*held(side * 7.0, 0.02), ASK) == 0.0
    assert _held(*held(side * 0.5, 0.05, 30), "rad") == side
    assert _held(*held(side * 0.5, 0.05, 29), "rad") == 0.0
    t, r, delta = held(side * 0.5, 0.01)
    assert _held(2.0 * t, r, delta, "rad") == side  # two seconds a row


@pytest.mark.parametrize(("against", "shows"), [(4, True), (6, False)])
def test_nine_tenths_of_the_turn_must_be_to_one_side(against: int, shows: bool) -> None:
    t, r, delta = held(-0.5, 0.05)
    r[10 : 10 + against] *= -1.0  # 92 % and 88 % of the turn, less what is turned back
    assert _held(t, r, delta, "rad") == (-1.0 if shows else 0.0)
    assert _held(t, np.where(t < 50, -5.0, 0.05), np.where(t < 50, -0.43, -0.5), "rad") == -1.0  # .86 of the greatest
    assert _held(t, np.where(t < 50, -5.0, 0.05), np.where(t < 50, -0.46, -0.5), "rad") == 1.0  # .92 of it


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_letters_of_a_rudder_are_turned_where_the_ship_goes_the_other_way(side: float) -> None:
    t = np.arange(400.0)
    delta = 10.0 * np.sign(np.sin(2.0 * np.pi * (t + 0.5) / 100.0))
    cells = tuple(f"10 {'S' if one > 0 else 'P'}" for one in delta)
    rudder = signal("delta", np.abs(delta), letters={"P": 200, "S": 200}, cells=cells, unit="deg")
    keys, answer = read_rudder(rudder, t, side * answered(0.01 * delta, 1.0), set())
    assert keys["letters"] == ("{ P = -1, S = 1 }" if side > 0 else "{ P = 1, S = -1 }")
    assert any("turned here" in one for one in answer.doubts) == (side < 0)
    keys, answer = read_rudder(rudder, t, None, set())
    assert keys["letters"] == "{ P = -1, S = 1 }"
    assert any("turns too little" in one for one in answer.doubts)
    straight = answered(0.01 * delta, 1.0)[::-1] * 0.0
    assert any("turns too little" in one for one in read_rudder(rudder, t, straight, set())[1].doubts)


def steaming(n: float, speed: float = 5.0, r: float = 0.02, rows: int = 40) -> tuple[dict[str, str], list[str]]:
    """Revolutions of a ship of .5 speed / r of length, and the doubts about their unit."""
    keys, answer = read_revolutions(signal("n_P", np.full(rows, n)), np.full(rows, speed), np.full(rows, -r), 3.0)
    return keys, list(answer.doubts)


def test_revolutions_are_per_second_or_minute_by_the_lengths_that_the_ship_goes_in_one() -> None:
    # 125 m at 5 m/s: .025 lengths a turn at 1.6 1/s, and at 96 rpm
    assert steaming(1.6) == ({"unit": '"1/s"'}, [])
    assert steaming(96.0) == ({"unit": '"rpm"'}, [])
    assert steaming(96.0, -5.0) == ({"unit": '"rpm"'}, [])
    assert steaming(-96.0) == ({"unit": '"rpm"'}, [])
    sure, doubtful = (math.sqrt(1.6 * 96.0 * math.exp(-one)) for one in (1.6, 1.4))  # by factors of e
    assert steaming(sure) == ({"unit": '"1/s"'}, [])
    assert steaming(doubtful) == ({"unit": '"1/s"'}, ["1/s fits a little better than rpm; write rpm if it is that"])
    sure, doubtful = (math.sqrt(1.6 * 96.0 * math.exp(one)) for one in (1.6, 1.4))
    assert steaming(sure) == ({"unit": '"rpm"'}, [])
    assert steaming(doubtful) == ({"unit": '"rpm"'}, ["rpm fits a little better than 1/s; write 1/s if it is that"])
    # 31.25 m: 49.6 is midway between both
    assert steaming(48.0, r=0.08)[0] == {"unit": '"1/s"'}
    assert len(steaming(58.0, r=0.08)[1]) == 1
    assert steaming(62.0, r=0.08) == ({"unit": '"rpm"'}, [])  # no shaft turns so often in a second


def test_the_length_is_that_of_the_fast_rows_and_the_advance_that_of_the_running_ones() -> None:
    speed, r = np.linspace(0.0, 5.0, 101), np.linspace(0.0, 0.02, 101)
    length = 0.5 * 4.5 / 0.0196  # the ninth tenth of the speeds, all but a fiftieth of the rates
    n = np.where(np.arange(101) <= 50, 2.0, 0.5)  # a quarter of the greatest is coasting
    n[:26] = 0.7
    advance = float(np.median(speed[:51] / n[:51])) / length
    _, answer = read_revolutions(signal("n_P", n), speed, r, 3.0)
    assert f"about {advance:.2g} lengths" in answer.evidence
    assert f"if in rpm {60.0 * advance:.2g}" in answer.evidence


@pytest.mark.parametrize(("largest", "unit"), [(61.0, "rpm"), (59.0, ASK)])
def test_without_a_turn_revolutions_above_sixty_are_per_minute(largest: float, unit: str) -> None:
    n = signal("n_P", np.full(40, largest))
    speed, r = np.full(40, 5.0), np.full(40, 0.02)
    for given in ((None, None, 3.0), (speed, None, 3.0), (speed, r, 0.49)):
        keys, answer = read_revolutions(n, *given)
        assert keys == {"unit": f'"{unit}"'}
        assert len(answer.doubts) == 1
        assert ("is taken as rpm" in answer.doubts[0]) == (unit == "rpm")
    assert "lengths in a turn" in read_revolutions(n, speed, r, 0.51)[1].evidence
    for rows, told in ((10, True), (9, False)):
        some = signal("n_P", np.where(np.arange(40) < rows, largest, 0.0))
        assert ("lengths in a turn" in read_revolutions(some, speed, r, 3.0)[1].evidence) == told
