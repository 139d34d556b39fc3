"""Berthing and crabbing, in closed loop, on ships that can and on ships that cannot."""

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import ParameterError, Parts, update
from seatrial.data import Trial
from seatrial.forces.thruster import Tunnel
from seatrial.manoeuvres import Settings
from seatrial.manoeuvres.berthing import Berthing
from seatrial.manoeuvres.crabbing import Crabbing
from seatrial.ships import ShipError
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate
from tiers import slow_but


def settings(ship, speed=None, **asked):
    U, n_P = approach(ship, speed)
    return Settings(n_P, U, ship.L_pp, float(ship.actuators.rudder.high), **asked)


@pytest.fixture(scope="module")
def thrusted():
    """The 3 m tanker with a pair of made-up tunnel thrusters."""
    ship = load("esso_osaka_3m")
    pair = Parts(("bow", "stern"), tuple(Tunnel(x=x, D=0.06, K_T=0.4) for x in (1.2, -1.2)))
    return replace(ship, model=replace(ship.model, thrusters=pair))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("speed", slow_but([0.5, None], None))
def test_a_tanker_stops_at_its_berth(side, speed):
    ship = load("kvlcc2_l7")
    asked = settings(ship, speed, side=side)
    policy = Berthing.ordered(asked)
    run = simulate(ship, policy, speed=asked.speed, duration=60 * ship.L_pp / asked.speed)
    assert policy.complete(run)
    found = policy.indices(run, ship.L_pp)
    assert found["final_distance"].over_L < 0.25
    assert found["final_speed"].value < 0.05 * asked.speed
    assert abs(found["heading_error"].value) < math.radians(10.0)
    assert found["time"].value > 28 * ship.L_pp / asked.speed
    assert run["n_P"].min() < 0  # it took the propeller astern
    assert run["n_P"].min() >= -asked.n_P - 1e-9


@pytest.mark.slow
def test_a_single_screw_swings_as_it_backs_and_the_indices_say_so():
    ship = load("esso_osaka_3m")
    asked = settings(ship, 0.3)
    policy = Berthing.ordered(asked)
    found = policy.indices(simulate(ship, policy, speed=0.3, duration=600.0), 3.0)
    assert found["final_distance"].over_L < 1.0
    assert found["heading_error"].value > math.radians(20.0)  # to starboard, as a right-handed screw does


@pytest.mark.slow
def test_the_berth_is_counted_from_where_the_ship_begins():
    ship = load("kvlcc2_l7")
    policy = Berthing.ordered(settings(ship, 0.6))
    a = simulate(ship, policy, speed=0.6, duration=700.0)
    b = simulate(ship, policy, duration=700.0, start=(100.0, -50.0, 2.0, 0.6, 0.0, 0.0))
    found = [policy.indices(run, 7.0) for run in (a, b)]
    for name, index in found[0].items():
        assert found[1][name].value == pytest.approx(index.value, abs=2e-3), name


def test_a_ship_that_never_stops_has_no_time():
    ship = load("mariner_nomoto")
    policy = Berthing.ordered(Settings(0.0, ship.speed, ship.L_pp, 0.6))
    run = simulate(ship, policy, duration=400.0)
    assert not policy.complete(run)
    found = policy.indices(run, ship.L_pp)
    assert "time" not in found
    assert found["final_speed"].value == pytest.approx(ship.speed)


def test_berthing_figures_of_a_run_drawn_by_hand():
    t = np.arange(0.0, 11.0)
    u = np.where(t < 10, 1.0, 0.01)
    trial = Trial("drawn", t, {"x": 3.0 + t, "y": 0 * t + 1.0, "psi": 0.01 * t, "u": u, "v_m": 0 * t})
    policy = Berthing(5.0, 1.0, 12.0, -1.0, 0.0, 5.0, 10.0, 1.0, 1.0, 1.0, 5.0)
    found = policy.indices(trial, 2.0)
    assert found["final_along"].value == pytest.approx(-2.0)
    assert found["final_across"].value == pytest.approx(1.0)
    assert found["final_distance"].over_L == pytest.approx(math.sqrt(5.0) / 2)
    assert found["heading_error"].value == pytest.approx(0.1)
    assert found["time"].value == 10.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_ship_with_thrusters_crabs_and_holds_its_heading(thrusted, side):
    policy = replace(Crabbing.ordered(settings(thrusted, 0.3, side=side)), bow_max=30.0, stern_max=30.0)
    assert policy.orders == ("n_bow", "n_stern")
    run = simulate(thrusted, policy, speed=0.0, duration=240.0, dt=0.05)
    assert policy.complete(run)
    found = policy.indices(run, 3.0)
    assert found["heading_deviation"].value < math.radians(10.0)
    assert abs(found["forward_drift"].over_L) < 0.1
    assert 0.02 < found["lateral_speed"].value <= found["lateral_speed_max"].value < 0.5
    assert found["lateral_distance"].over_L >= 2.0
    assert np.sign(run["y"][-1]) == side
    assert np.abs(run["n_bow_cmd"]).max() <= 30.0 + 1e-12
    assert np.all(run["n_P"] == 0)


def test_crabbing_mirrors_on_a_symmetric_ship():
    ship = load("kvlcc2_l7")
    pair = Parts(("bow", "stern"), tuple(Tunnel(x=x, D=0.1, K_T=0.4) for x in (3.0, -2.5)))
    model = update(ship.model, {"rudder.gamma_Rn": ship.model.rudder.gamma_Rp,
                                "propeller.C_2n": ship.model.propeller.C_2p})  # fmt: skip
    ship = replace(ship, model=replace(model, thrusters=pair), validity={})
    policies = [Crabbing(20.0, 20.0, 14.0, side, K_d=20.0, K_i=0.01) for side in (1.0, -1.0)]
    a, b = (simulate(ship, policy, speed=0.0, duration=60.0, dt=0.05) for policy in policies)
    assert a["y"][-1] > 0.3
    for name, sign in (("x", 1), ("y", -1), ("psi", -1), ("r", -1)):
        assert b[name] == pytest.approx(sign * a[name], abs=1e-9)


def test_a_ship_without_thrusters_is_refused_in_one_line():
    ship = load("kvlcc2_l7")
    with pytest.raises(ShipError, match=r"kvlcc2_l7: .*'n_bow'.*delta, n_P") as caught:
        simulate(ship, Crabbing.ordered(settings(ship)), speed=0.0, duration=10.0)
    assert "\n" not in str(caught.value)


def test_azimuths_are_set_athwart_and_thrusts_are_linear():
    policy = Crabbing(100.0, 80.0, 5.0, drive=0.5, bow="f_1", stern="f_2", bow_angle="alpha_1", stern_angle="alpha_2")
    assert policy.orders == ("f_1", "f_2", "alpha_1", "alpha_2")
    state = (0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
    orders, _ = policy.command(0.0, state, policy.begin(state))
    assert orders == pytest.approx((50.0, 40.0, math.pi / 2, math.pi / 2))
    aside = (0.0, 0.0, 0.2, 0.0, 0.0, 0.0)  # 0.1 rad too far to starboard: bow less, stern more
    orders, _ = policy.command(0.0, aside, policy.begin(state))
    assert orders[:2] == pytest.approx((100.0 * (0.5 - 0.3), 80.0 * (0.5 + 0.3)))
    with pytest.raises(ParameterError, match="both"):
        Crabbing(1.0, 1.0, 5.0, bow_angle="alpha_1")


def test_revolutions_go_with_the_root_of_the_thrust():
    policy = Crabbing(30.0, 20.0, 5.0, side=-1.0, drive=0.25)
    state = (0.0,) * 6
    assert policy.command(0.0, state, policy.begin(state))[0] == pytest.approx((-15.0, -10.0))
    there = (0.0, -5.1, 0.0, 0.0, 0.0, 0.0)
    assert policy.command(0.0, there, policy.begin(state))[0] == pytest.approx((0.0, 0.0))


def test_the_pair_is_the_one_that_the_ship_has():
    asked = Settings(10.0, 1.0, 5.0, 0.6)
    tunnels = Crabbing.fitted(asked, {"n_P": 15.0, "n_bow": 40.0, "n_stern": math.inf})
    assert (tunnels.orders, tunnels.bow_max, tunnels.stern_max) == (("n_bow", "n_stern"), 40.0, 10.0)
    azimuths = {"f_bow": 500.0, "alpha_bow": math.inf, "f_stern": 400.0, "alpha_stern": math.inf}
    ferry = Crabbing.fitted(asked, azimuths)
    assert ferry.orders == ("f_bow", "f_stern", "alpha_bow", "alpha_stern")
    assert (ferry.bow_max, ferry.stern_max) == (500.0, 400.0)
    with pytest.raises(ParameterError, match="f_stern has no limit"):
        Crabbing.fitted(asked, azimuths | {"f_stern": math.inf})
    assert Crabbing.ordered(asked).orders == ("n_bow", "n_stern")
