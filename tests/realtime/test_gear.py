"""What of every kind of ship is on the page: names, places, units and ends of the scales."""

from __future__ import annotations

import math

import pytest

from seatrial.realtime.bridge.view import Order, gear
from seatrial.realtime.helm import clipped, ranges
from seatrial.realtime.plant import Plant
from seatrial.ships.felt import idle
from seatrial.ships.files import load
from seatrial.simulate.approach import approach, time_step


def aboard(name: str) -> dict[str, Order]:
    ship = load(name)
    return {order.name: order for order in gear(Plant.of(ship, dt=time_step(ship)))}


def test_azimuths_and_thrusters() -> None:
    tug = aboard("qiuxin5")
    assert tug["alpha_1"].high == pytest.approx(math.pi)
    assert (tug["n_1"].low, tug["n_1"].high) == (0.0, 10.0)
    assert tug["delta"].actual({"alpha_1": -0.29, "alpha_2": -0.31}) == pytest.approx(0.3)
    assert [order.kind for order in tug.values()] == ["thruster", "dial", "thruster", "dial", "engine", "rudder"]
    assert [tug[name].label for name in ("n_P", "delta")] == ["Both thrusters", "Turn by azimuths"]
    assert tug["alpha_2"].label == "Azimuth 2"


def test_a_screw_and_a_rudder() -> None:
    tanker = aboard("kvlcc2_l7")
    assert tanker["n_P"].full < tanker["n_P"].high == -tanker["n_P"].low
    assert tanker["delta"].high == pytest.approx(math.radians(35.0))
    assert tanker["delta"].low == -tanker["delta"].high
    assert [(one.label, one.kind, one.sided) for one in tanker.values()] == [
        ("Engine", "engine", False), ("Rudder", "rudder", True)]  # fmt: skip


def test_a_pair_has_sides() -> None:
    assert [one.label for one in aboard("twin_virtual").values()] == [
        "Port engine", "Starboard engine", "Port rudder", "Starboard rudder", "Both engines", "Both rudders",
    ]  # fmt: skip


def test_forces_that_are_ordered_directly_are_no_rudder_and_no_engine() -> None:
    model = aboard("cybership2")
    assert [(one.name, one.label, one.kind, one.unit, one.high) for one in model.values()] == [
        ("X_tau", "Force ahead", "engine", "N", 2.0), ("Y_tau", "Sideways force", "thruster", "N", 1.5),
        ("N_tau", "Turning moment", "rudder", "N m", 1.5)]  # fmt: skip
    assert 0.0 < model["X_tau"].full < 0.5  # holds the approach speed


def test_thrust_that_is_ordered_together_is_shown_as_thrust() -> None:
    both = aboard("milliampere")["n_P"]
    assert (both.unit, both.high * both.per) == ("N", 500.0)


def test_orders_beyond_the_gear_are_told_as_they_are_shown() -> None:
    tanker, model, ferry = load("kvlcc2_l7"), load("cybership2"), load("milliampere")
    assert clipped(tanker, "n_P", 99999.0 / 60.0, 14.81) == "Engine ordered 99999 rpm, taken as 889 rpm"
    assert clipped(tanker, "delta", -1.0, -0.6108652) == "Rudder ordered 57.3 deg port, taken as 35 deg port"
    assert clipped(model, "N_tau", 9.0, 1.5) == "Turning moment ordered 9 N m starboard, taken as 1.5 N m starboard"
    assert clipped(ferry, "n_P", 20.0, 10.0) == "Both thrusters ordered 1000 N, taken as 500 N"
    assert clipped(load("twin_virtual"), "n_P_1", -9.0, 0.0) == "Port engine ordered -540 rpm, taken as 0 rpm"


def test_thrusters_across_the_ship_have_sides_and_others_none() -> None:
    harbour = aboard("esso_osaka_3m_harbour")
    assert {name for name, order in harbour.items() if order.sided} == {"delta", "n_bow", "n_stern"}
    assert not any(order.sided for name, order in aboard("qiuxin5").items() if name.startswith("n"))
    ship = load("esso_osaka_3m_harbour")
    assert clipped(ship, "n_bow", -40.0, -30.0) == "Bow thruster ordered 2400 rpm port, taken as 1800 rpm port"
    plant = Plant.of(ship, dt=time_step(ship), start=(0.0,) * 6)
    plant.order("n_bow", 20.0)
    for _ in range(round(10.0 / plant.dt)):
        plant.step()
    assert plant["r"] > 1e-3  # above zero is to starboard


def test_azimuths_that_stand_apart_are_not_shown_as_one_figure() -> None:
    turn = aboard("milliampere_aft")["delta"]
    assert turn.label == "Turn by azimuths"  # to starboard, where each of the two points to port
    assert turn.actual({"alpha_port": -0.1, "alpha_starboard": -0.1}) == pytest.approx(0.1)
    assert turn.actual({"alpha_port": -0.1, "alpha_starboard": 2.0 * math.pi - 0.1}) == pytest.approx(0.1)
    assert turn.actual({"alpha_port": math.pi / 2, "alpha_starboard": -math.pi / 2}) is None  # not "0 deg"


def test_revolutions_that_move_nothing_have_no_telegraph() -> None:
    assert idle(load("zeefakkel")) == idle(load("mariner_nomoto")) == {"n_P"}
    assert idle(load("esso_osaka_3m_harbour")) == frozenset()  # though side thrusters are useless at speed
    assert list(aboard("zeefakkel")) == ["delta"]


def test_a_range_is_that_of_the_gear_else_what_is_usual() -> None:
    ship = load("kvlcc2_l7")
    told = ranges(ship)
    assert told["n_P"].high == pytest.approx(1.25 * approach(ship)[1])
    assert told["n_P"].full == pytest.approx(approach(ship)[1])
    assert ranges(load("esso_osaka_3m"))["n_P"].high == 20.0
    round_ = ranges(load("milliampere"))["alpha_bow"]
    assert round_.all_round
    assert round_.taken(4.0) == pytest.approx(4.0 - 2.0 * math.pi)
    assert round_.taken(-3.0) == -3.0
    assert ranges(load("cybership2"))["delta"].high == pytest.approx(math.radians(35.0))


def test_orders_end_where_the_scale_does_and_azimuths_turn_on() -> None:
    ship = load("kvlcc2_l7")
    plant = Plant.of(ship, dt=0.05)
    for asked in (99999.0, -1e308):
        assert plant.order("n_P", asked) == math.copysign(plant.ranges["n_P"].high, asked)
    fast = Plant.of(ship, dt=0.05, n_P=20.0)
    assert fast["n_P_cmd"] == 20.0  # starts with the requested revolutions
    ferry = load("milliampere")
    turned = Plant.of(ferry, dt=time_step(ferry))
    assert turned.order("alpha_bow", 4.0) == 4.0  # the same direction, so nothing is cut off
    assert turned["alpha_bow_cmd"] == pytest.approx(4.0 - 2.0 * math.pi)
