"""Twin screws and rudders: mirror images, the single-screw ship they came from, and turning without a rudder."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from seatrial.core.parameters import update
from seatrial.environment import CALM, Environment, Uniform
from seatrial.forces.waves import MeanDrift
from seatrial.manoeuvres.turning import Turning
from seatrial.models import unit
from seatrial.models.common import Surroundings
from seatrial.models.twin import TwinMmg, mirrored, mirrored_flow
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

STATE = (1.0, 2.0, 0.3, 0.8, -0.1, 0.06)
WEATHER = Environment(3.0, 1.0, 0.2, -0.1)


def handed() -> TwinMmg:
    """A pair with side forces and unequal flow straightening: the modules of SUZAKU on the virtual hull."""
    twin, suzaku = load("twin_virtual").model, load("suzaku").model
    scale = {"D_P": 0.15, "x_P": -3.5}
    screw = replace(suzaku.propeller, **scale)
    rudder = replace(suzaku.rudder, A_R=0.027, x_H=-4.2, x_R=-3.5, l_R=-6.2)
    return replace(twin, propeller=screw, rudder=rudder)


def mirror(model: TwinMmg, state: tuple[float, ...], control: tuple[float, ...], around: Environment) -> Any:
    x, y, psi, u, v, r = state
    n_1, n_2, d_1, d_2 = control
    other = Environment(around.wind_x, -around.wind_y, around.current_x, -around.current_y)
    out = model.derivative((x, -y, -psi, u, -v, -r), (n_2, n_1, -d_2, -d_1), other)
    return tuple(s * w for s, w in zip((1, -1, -1, 1, -1, -1), out, strict=True))


@pytest.mark.parametrize("control", [(9.0, 9.0, 0.2, 0.2), (9.0, -4.0, 0.1, 0.5), (0.0, 12.0, -0.3, 0.0)])
@pytest.mark.parametrize("model", [load("twin_virtual").model, handed()], ids=["plain", "handed"])
def test_swapping_port_and_starboard_mirrors_the_motion(model: TwinMmg, control: tuple[float, ...]) -> None:
    here = model.derivative(STATE, control, WEATHER)
    assert mirror(model, STATE, control, WEATHER) == pytest.approx(here, rel=1e-12, abs=1e-14)
    alike = replace(model, pair="alike")
    if model.propeller.mirror_symmetric:
        assert alike.derivative(STATE, control, WEATHER) == pytest.approx(here, rel=1e-12, abs=1e-14)
    else:
        assert mirror(alike, STATE, control, WEATHER) != pytest.approx(
            alike.derivative(STATE, control, WEATHER), rel=1e-6
        )


def test_on_the_centre_line_it_is_one_screw_with_doubled_forces() -> None:
    model: Any = load("twin_virtual").model
    model = update(model, {"y_P": 0.0, "y_R": 0.0})
    n, delta = 16.0, 0.3
    flow = Surroundings.of(STATE, WEATHER).flow(model.body, n, delta)
    pull, slipstream = model.propeller.force(flow)
    steer = model.rudder.force(flow, slipstream)
    wanted = model.hull.force(flow) + pull + pull + steer + steer
    assert model.force(flow, (n, n, delta, delta)) == pytest.approx(tuple(wanted), rel=1e-12)


def test_it_came_from_kvlcc2() -> None:
    """Straight ahead, two screws at sqrt(2) n_P pull as the one of kvlcc2_l7 does."""
    one, two = load("kvlcc2_l7").model, load("twin_virtual").model
    at = (0.0, 0.0, 0.0, 1.179, 0.0, 0.0)
    n = 11.85
    single = one.derivative(at, (n, 0.0), CALM)
    pair = two.derivative(at, (math.sqrt(2) * n, math.sqrt(2) * n, 0.0, 0.0), CALM)
    assert pair == pytest.approx(single, rel=1e-9, abs=1e-12)


def test_port_ahead_and_starboard_astern_turn_to_starboard_on_the_spot() -> None:
    model: Any = load("twin_virtual").model
    rest = (0.0,) * 6
    n = 8.0
    flow = Surroundings.of(rest, CALM).flow(model.body)
    force = model.force(flow, (n, -n, 0.0, 0.0))
    pull = model.propeller.force(flow._replace(n_P=n))[0].X
    assert tuple(force) == pytest.approx((0.0, 0.0, 2 * model.y_P * pull), rel=1e-9, abs=1e-9)
    assert model.derivative(rest, (n, -n, 0.0, 0.0), CALM)[5] > 0


def test_each_side_meets_the_water_at_its_own_place() -> None:
    """Turning to starboard, the port screw is the faster one: it pulls less at equal revolutions."""
    model: Any = update(load("twin_virtual").model, {"rudder.A_R": 0.0})
    flow = Surroundings.of((0.0, 0.0, 0.0, 1.0, 0.0, 0.1), CALM).flow(model.body)
    bare = model.hull.force(flow)
    faster, slower = (model.propeller.force(flow._replace(u=1.0 + s * 0.1 * model.y_P, n_P=16.0))[0].X for s in (1, -1))
    assert faster < slower
    found = model.force(flow, (16.0, 16.0, 0.0, 0.0))
    moment = found.N - bare.N
    assert moment == pytest.approx(model.y_P * (faster - slower), rel=1e-9)


def test_a_reversed_hand_has_the_opposite_side_force() -> None:
    model = replace(handed(), hull=load("twin_virtual").model.hull)
    flow = Surroundings.of((0.0, 0.0, 0.0, 0.8, 0.0, 0.0), CALM).flow(model.body)
    port = model.propeller.force(flow._replace(n_P=15.0))[0]
    both = model.force(flow, (15.0, 15.0, 0.0, 0.0))
    alike = replace(model, pair="alike").force(flow, (15.0, 15.0, 0.0, 0.0))
    assert abs(port.Y) > 0
    assert tuple(both)[1:] == pytest.approx((0.0, 0.0), abs=1e-9)
    assert tuple(alike)[:2] == pytest.approx((both.X, 2 * port.Y), rel=1e-9)


@pytest.mark.parametrize("model", [load("twin_virtual").model, handed()], ids=["plain", "handed"])
def test_finite_with_finite_jacobians_and_silent_at_rest(model: TwinMmg) -> None:
    assert model.derivative((0.0,) * 6, (0.0,) * 4, CALM) == (0.0,) * 6
    x = ca.SX.sym("x", 10)
    y = ca.vertcat(*model.derivative(tuple(x[i] for i in range(6)), tuple(x[i] for i in range(6, 10)), CALM))
    f = ca.Function("f", [x], [y, ca.jacobian(y, x)])
    random = np.random.default_rng(5).uniform(-1, 1, (50, 10)) * (1, 1, 3, 1, 0.4, 0.2, 15, 15, 0.6, 0.6)
    for point in [*random, np.zeros(10), *(np.eye(10) * 0.3), *(-np.eye(10) * 0.3)]:
        rates, jacobian = f(point)
        assert np.isfinite(jacobian.full()).all()
        direct = model.derivative(tuple(map(float, point[:6])), tuple(map(float, point[6:])), CALM)
        assert rates.full().ravel() == pytest.approx(direct, rel=1e-10, abs=1e-12)


def test_current_is_a_moving_frame() -> None:
    model: Any = load("twin_virtual").model
    current = Uniform(U_C=0.3, gamma_C=1.1).now()
    control = (9.0, 14.0, 0.1, 0.3)
    c, s = math.cos(0.4), math.sin(0.4)
    u_C = current.current_x * c + current.current_y * s
    v_C = current.current_y * c - current.current_x * s
    still = model.derivative((0.0, 0.0, 0.4, 0.7, 0.1, 0.05), control, CALM)
    moving = model.derivative((0.0, 0.0, 0.4, 0.7 + u_C, 0.1 + v_C, 0.05), control, current)
    expected = (still[0] + current.current_x, still[1] + current.current_y, still[2],
                still[3] + 0.05 * v_C, still[4] - 0.05 * u_C, still[5])  # fmt: skip
    assert moving == pytest.approx(expected, rel=1e-12, abs=1e-14)


def test_controls_are_numbered_from_port_and_obey_the_conventional_orders() -> None:
    model = load("twin_virtual").model
    assert model.controls == ("n_P_1", "n_P_2", "delta_1", "delta_2")
    assert model.follows == (("n_P", 1.0), ("n_P", 1.0), ("delta", 1.0), ("delta", 1.0))
    assert [unit(name) for name in model.controls] == ["1/s", "1/s", "rad", "rad"]


def test_the_mirror_image_of_a_flow_is_felt_as_the_mirror_image_of_a_force() -> None:
    """Drift, turn, wind and waves change sides: any part that is alike to port and starboard shows which did not."""
    flow = Surroundings.of(STATE, WEATHER).flow(load("twin_virtual").model.body)
    flow = flow._replace(wave_u=0.2, wave_v=-0.3, wave_T=2.0, delta=0.2)
    for module in (MeanDrift(), load("kvlcc2").model.wind, load("twin_virtual").model.hull):
        here, there = module.force(flow), module.force(mirrored_flow(flow))
        assert here.Y != 0
        assert tuple(there) == pytest.approx(tuple(mirrored(here)), rel=1e-12)
    assert mirrored_flow(mirrored_flow(flow)) == flow


def test_turns_as_a_ship() -> None:
    ship = load("twin_virtual")
    run = simulate(ship, Turning(16.76, math.radians(35)), duration=150.0)
    found = Turning(16.76, math.radians(35)).indices(run, ship.L_pp)
    assert 2.0 < found["advance"].value / ship.L_pp < 4.0
    np.testing.assert_array_equal(run["delta_1"], run["delta_2"])
    np.testing.assert_array_equal(run["n_P_1"], run["n_P_2"])
