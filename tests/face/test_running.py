"""Orders in degrees, runs and what is read off them."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest

import seatrial as st
from seatrial.core.errors import RequestError
from seatrial.core.parameters import ParameterError
from seatrial.data import DataError
from seatrial.face import orders
from seatrial.face.orders import Order
from seatrial.manoeuvres import Given
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships import Ship as HouseShip
from seatrial.ships.files import load as load_house
from seatrial.simulate.run import approach
from seatrial.workflow.asked import Around, Orders, Span
from seatrial.workflow.simulation import known, simulate

OF = "kvlcc2_l7"


@pytest.fixture(scope="module")
def ship() -> st.Ship:
    return st.load(OF)


@pytest.fixture(scope="module")
def zigzag(ship: st.Ship) -> st.Run:
    return ship.simulate(st.Zigzag(rudder_deg=20, heading_deg=20))


def classes() -> dict[str, type[Order]]:
    found = [one for one in vars(orders).values() if isinstance(one, type) and issubclass(one, Order) and one.kind]
    return {one.kind: one for one in found}


def test_there_is_an_order_for_every_manoeuvre_with_the_options_that_it_takes() -> None:
    assert set(classes()) == set(known())
    for kind, manoeuvre in known().items():
        cls = classes()[kind]
        given = {f.name.removesuffix("_deg") for f in fields(cls)}
        assert given - {"steer_percent"} == set(manoeuvre.takes), kind
        assert ("steer_percent" in given) == ("rudder" in manoeuvre.takes), kind
        assert getattr(st, cls.__name__) is cls
        assert cls.__name__ == manoeuvre.__name__


@pytest.mark.slow
def test_degrees_only_where_the_name_says_so(ship: st.Ship, zigzag: st.Run) -> None:
    """The order in degrees, the house's manoeuvre in radians and the command line's are one run."""
    n_P, angle = approach(ship)[1], math.radians(20.0)
    of_house = ship.simulate(Zigzag(n_P, angle, angle))
    of_command = simulate(OF, "zigzag", orders=Orders(20.0, heading=20.0)).trial
    for name in ("x", "psi", "delta"):
        assert np.array_equal(zigzag[name], of_house[name])
        assert np.array_equal(zigzag[name], of_command[name])
    with pytest.raises(ParameterError, match=r"180 deg is 3\.14 rad"):
        Zigzag(n_P, 20.0, 20.0)
    with pytest.raises(TypeError, match="delta"):
        st.Zigzag(delta=0.3)  # type: ignore[call-arg]


def test_indices_are_radians_by_name_and_degrees_in_print(zigzag: st.Run) -> None:
    overshoot = zigzag.indices["first_overshoot"]
    assert overshoot.unit == "rad"
    printed = str(zigzag.indices)
    assert f"{math.degrees(overshoot.value):.2f}  deg" in printed
    frame = zigzag.indices.to_frame()
    row = frame.filter(frame["index"] == "first_overshoot").row(0, named=True)
    assert (row["value"], row["unit"]) == (math.degrees(overshoot.value), "deg")
    assert dict(zigzag.indices)["period"] == zigzag.indices["period"]
    with pytest.raises(st.MissingError, match="first_overshoot"):
        zigzag.indices["overshoot_first"]


def test_a_ship_with_verbs_is_the_ship_of_the_house(ship: st.Ship) -> None:
    of_house = load_house(OF)
    assert isinstance(ship, HouseShip)
    assert (ship.model, ship.L_pp, ship.entries) == (of_house.model, of_house.L_pp, of_house.entries)
    changed = ship.having({"hull.Y_v": -0.3})
    assert isinstance(changed, st.Ship)
    assert changed.parameters["hull.Y_v"] == -0.3
    assert set(changed.parameters) == set(ship.parameters.to_frame()["parameter"])
    with pytest.raises(st.MissingError, match=r"near: hull\.Y_v"):
        ship.parameters["hull.Y_w"]


@pytest.mark.parametrize("name", ["kvlcc2", "qiuxin5", "zeefakkel"])
def test_reprs_are_a_line(name: str) -> None:
    for one in (st.load(name), load_house(name)):
        assert len(repr(one)) < 100
        assert name in repr(one)


def test_messages_name_arguments_not_options(ship: st.Ship) -> None:
    with pytest.raises(RequestError, match=r"^rudder_deg is 50 deg; the rudder of kvlcc2_l7 goes to 35 deg"):
        ship.simulate(st.Turning(rudder_deg=50))
    with pytest.raises(RequestError, match=r"^wind: kvlcc2_l7 has no force of wind"):
        ship.simulate(st.Turning(), weather=st.Weather(wind=5.0))
    with pytest.raises(RequestError, match=r"^n_P is inf"):
        ship.simulate(st.Turning(), n_P=math.inf)
    with pytest.raises(RequestError, match="give a duration"):
        ship.simulate(Given(("delta",)))
    with pytest.raises(RequestError, match="beyond any on record"):
        st.load("kvlcc2").simulate(st.Turning(), weather=st.Weather(current=60.0))


def test_weather_is_that_of_the_command_line() -> None:
    order = st.Turning(rudder_deg=20)
    around = st.Weather(wind=8.0, wind_from_deg=30.0, current=0.5, current_towards_deg=90.0)
    with pytest.warns(UserWarning, match="not over after 60 s"):
        run = st.load("kvlcc2").simulate(order, duration=60.0, weather=around)
    theirs = simulate("kvlcc2", "turning", orders=Orders(20.0), span=Span(60.0),
                      around=Around("8,30", current="0.5,90"))  # fmt: skip
    assert np.array_equal(run["y"], theirs.trial["y"])
    assert not run.complete
    assert run["U_T"][0] == 8.0


def test_a_run_that_ends_early_warns_where_it_was_asked_for(ship: st.Ship) -> None:
    with pytest.warns(UserWarning, match="not over after 20 s") as told:
        run = ship.simulate(st.Zigzag(), duration=20.0)
    assert told[0].filename == __file__
    assert not run.complete
    assert "not complete" in str(run.indices)


def test_any_policy_runs_for_a_duration(ship: st.Ship) -> None:
    run = ship.simulate(Given(("n_P", "delta")), duration=2.0)
    assert len(run.indices) == 0
    assert run.duration == pytest.approx(2.0)


def test_a_trial_keeps_its_verbs_through_the_house(zigzag: st.Run) -> None:
    part = zigzag.rows(slice(0, 100)).with_noise({"psi": 0.01}, seed=1).named("part")
    assert isinstance(part, st.Trial)
    assert part.name == "part"
    assert np.std(part["psi"] - zigzag["psi"][:100]) == pytest.approx(0.01, rel=0.3)


def test_a_prediction_of_a_run_is_the_run(ship: st.Ship, zigzag: st.Run) -> None:
    again = ship.predict(zigzag)
    assert np.abs(again["y"] - zigzag["y"]).max() < 1e-3
    assert isinstance(again, st.Trial)


@pytest.mark.slow
def test_plant_equations_and_linear_model_are_one_ship(ship: st.Ship) -> None:
    """After one step from the approach, the plant, the CasADi function and the Jacobian agree."""
    n_P = approach(ship)[1]
    plant, dt = ship.plant(dt=0.01), 0.01
    state = np.array([plant[n] for n in ("x", "y", "psi", "u", "v_m", "r")])
    plant.step()
    step = ship.equations().step(state, [n_P, 0.0], np.zeros(8), dt)
    ahead = np.array([plant[n] for n in ("x", "y", "psi", "u", "v_m", "r")])
    assert np.abs(np.array(step).ravel() - ahead).max() < 1e-12
    rates, h = ship.equations().rates, 1e-6
    slope = (np.array(rates(state, [n_P, h], np.zeros(8))) - np.array(rates(state, [n_P, -h], np.zeros(8)))) / (2 * h)
    linear = ship.linear()
    assert linear.input("delta")[linear.states.index("r")] == pytest.approx(float(slope[5, 0]), rel=1e-5)


@pytest.mark.slow
def test_a_craft_without_a_rudder_is_steered_by_a_demand() -> None:
    """As on the command line, and messages name what is given here."""
    otter = st.load("otter")
    run = otter.simulate(st.Zigzag(steer_percent=30, heading_deg=20))
    assert run.complete
    assert np.array_equal(run["y"], simulate("otter", "zigzag", orders=Orders(steer=30.0, heading=20.0)).trial["y"])
    with pytest.raises(RequestError, match="rudder_deg: otter has no rudder; give steer_percent, a demand in percent"):
        otter.simulate(st.Zigzag(rudder_deg=20))
    with pytest.raises(RequestError, match="steer_percent: kvlcc2_l7 is steered by an angle; give rudder_deg"):
        st.load("kvlcc2_l7").simulate(st.Zigzag(steer_percent=20))


def test_a_restart_of_no_length_is_refused(ship: st.Ship, zigzag: st.Run) -> None:
    with pytest.raises(DataError, match="restart is 0 s; it must be above zero"):
        ship.predict(zigzag, restart=0.0)
