"""Rates and limits of a ship file against logs whose rudder moves at a known rate to a known angle."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from seatrial.actuators import Actuator, Actuators, Shaft
from seatrial.data import Trial
from seatrial.identify.components.actuation import exceeded, moving, shown
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
def test_a_rudder_as_the_file_has_it_says_nothing(noise):
    assert not list(exceeded(_ship(), (_log(2.3, 20.0, noise=noise),)))


@pytest.mark.parametrize("noise", [0.0, 0.1])
@pytest.mark.parametrize("rate", [1.03, 1.97])
def test_a_slower_rudder_shows_in_moves_of_one_pace(rate, noise):
    (told,) = shown(_ship(), (_log(rate, 20.0, noise=noise),))
    assert (told.table, told.key) == ("actuators.rudder", "rate")
    assert told.value == pytest.approx(DEG * rate, rel=0.03)


@pytest.mark.parametrize("period", [15.0, 30.0, 60.0])
def test_small_orders_do_not_prove_a_slow_rudder(period):
    """An autopilot that asks for little moves its rudder at any pace below the greatest."""
    delta = 0.25 * DEG * 2.3 * period / (2.0 * np.pi) * np.sin(2.0 * np.pi * T / period)
    assert not list(shown(_ship(), (Trial("log", T, {"delta": delta, "n_P": np.full(T.size, 10.0)}),)))
    wide = 3.0 * delta  # 1.7 deg/s at most
    assert not list(shown(_ship(), (Trial("log", T, {"delta": wide, "n_P": np.full(T.size, 10.0)}),)))


@pytest.mark.parametrize(("rate", "dt"), [(4.5, 1.0), (8.0, 1.0), (12.0, 0.5), (3.0, 0.1)])
def test_the_rate_is_that_of_rows_within_a_move(rate, dt):
    """The rows in which a move begins and ends show a part of the rate; of a fast rudder those are most rows."""
    t = np.arange(0.0, 400.0, dt)
    ends = 20.0 * np.sign(np.sin(2.0 * np.pi * (t - 3.3) / 41.7))
    delta = np.zeros(t.size)
    for k in range(1, t.size):
        delta[k] = delta[k - 1] + np.clip(ends[k] - delta[k - 1], -rate * dt, rate * dt)
    noisy = DEG * (delta + np.random.default_rng(2).normal(0.0, 0.1, t.size))
    (told,) = shown(_ship(), (Trial("log", t, {"delta": noisy, "n_P": np.full(t.size, 10.0)}),))
    assert told.value == pytest.approx(DEG * rate, rel=0.03)


@pytest.mark.slow
def test_lag_and_dead_time_show_where_the_order_is_on_record():
    """By the closed form of a first-order answer, 1 - exp(-(t - T_d)/T), to steps of a servo fast enough."""
    t = np.arange(0.0, 300.0, 0.5)
    order, delta = np.zeros(t.size), np.zeros(t.size)
    for k, at in enumerate(np.arange(20.0, 280.0, 30.0)):
        step = 5.0 * DEG * (1.0 if k % 2 else -1.0) - (order[-1] if k else 0.0)
        order[t >= at] += step
        late = np.clip(t - at - 1.5, 0.0, None)
        delta += step * (1.0 - np.exp(-late / 2.5))
    delta += DEG * np.random.default_rng(3).normal(0.0, 0.05, t.size)
    log = Trial("log", t, {"delta": delta, "delta_cmd": order, "n_P": np.full(t.size, 10.0)})
    told = {one.key: one.value for one in shown(_ship(rate=8.0), (log,))}
    assert told["lag"] == pytest.approx(2.5, rel=0.05)
    assert told["dead_time"] == pytest.approx(1.5, abs=0.3)  # an order acts from its row on


def test_a_shaft_has_a_rate_for_each_way():
    t = np.arange(0.0, 200.0, 1.0)
    n = np.interp(t, [0.0, 20.0, 60.0, 120.0, 200.0], [10.0, 10.0, 2.0, 2.0, 10.0])
    log = Trial("log", t, {"delta": np.zeros(t.size), "n_P": n})
    ship = replace(_ship(), actuators=Actuators({"propeller": Shaft(rate=0.5, rate_down=0.1)}))
    told = {one.key: one.value for one in shown(ship, (log,))}
    assert told["rate_down"] == pytest.approx(0.2)
    assert told["rate"] == pytest.approx(0.1)


def test_of_two_rudders_of_one_table_one_speaks():
    log = _log(4.5, 30.0)
    log = log.having(delta_1=log["delta"], delta_2=log["delta"])
    both = replace(_ship(), model=SimpleNamespace(controls=("delta_1", "delta_2")))
    (told,) = shown(both, (log,))
    assert told.table == "actuators.rudder"


def test_the_entry_of_a_study_is_taken_as_that_of_a_ship_file(tmp_path):
    (told,) = shown(_ship(), (_log(4.5, 30.0),))
    text = f'schema = "seatrial-ship/1"\nlike = "kvlcc2_l7"\nname = "x"\n[{told.table}]\n{told.entry}\n'
    (tmp_path / "x.toml").write_text(text)
    assert load(tmp_path / "x.toml").actuators.rudder.rate == pytest.approx(told.value, rel=0.01)


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
    assert moving(slow, "delta", DEG * 2.3, 0.0) == pytest.approx(DEG * 2.0)
