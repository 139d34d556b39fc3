"""What the papers print, against what the package has: particulars, coefficients, ranges, kinematics."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.environment import CALM, to_body, to_earth
from seatrial.forces import Flow, Slipstream
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

PRINTED = tomllib.loads((Path(__file__).parent / "golden" / "papers.toml").read_text(encoding="utf-8"))
ROUND = 1e-12


def has(part: Any, printed: dict[str, float], unit: float = 1.0, **units: float) -> None:
    """A component holds the printed numbers, each times its unit."""
    for name, value in printed.items():
        assert getattr(part, name) == pytest.approx(value * units.get(name, unit), rel=ROUND), name


def test_suzaku_has_the_particulars_of_table_1() -> None:
    ship, told = load("suzaku"), dict(PRINTED["suyama2023"]["table1"])
    model: Any = ship.model
    H_R = told.pop("H_R")
    has(model.propeller, {"D_P": told.pop("D_P")})
    has(model.rudder, {"A_R": told.pop("A_R"), "eta": 2.80 / H_R})
    assert ship.entries["particulars.C_b"].given == told.pop("C_b")
    has(model.body, told)
    assert model.body.m == pytest.approx(1025.0 * 0.737 * 83.0 * 13.5 * 3.8, rel=ROUND)  # the displacement is assumed


def test_suzaku_has_the_coefficients_of_tables_3_to_6() -> None:
    """Tables 3 and 4 made dimensional by hand; what is printed as a sum with an added mass is taken apart."""
    model: Any = load("suzaku").model
    told, rho, L, d = PRINTED["suyama2023"], 1025.0, 83.0, 3.8
    mass = 0.5 * rho * L**2 * d
    has(model.body, told["table3"], mass, J_z=mass * L**2)
    hull = dict(told["table4"])
    hull["X_vr"] = hull.pop("X_vr_and_m_y") - told["table3"]["m_y"]
    hull["Y_r"] = hull.pop("Y_r_less_m_x") + told["table3"]["m_x"]
    assert len(hull) == 18
    has(model.hull, hull)
    has(model.propeller, told["table5"])
    has(model.rudder, told["table6"], x_H=L, l_R=L)


def test_the_hull_of_suzaku_is_equation_15_with_table_4() -> None:
    """Its forces in a turn, with the printed numbers and nothing of the ship file."""
    c, (u, v_m, r) = PRINTED["suyama2023"]["table4"], (4.0, -0.9, 0.03)
    rho, L, d, U = 1025.0, 83.0, 3.8, math.hypot(4.0, -0.9)
    v, q, m_x, m_y = v_m / U, r * L / U, 0.010, 0.168
    X = (-c["R_0"] + c["X_vv"] * v**2 + (c["X_vr_and_m_y"] - m_y) * v * q + c["X_rr"] * q**2 + c["X_vvvr"] * v**3 * q
         + c["X_vvvv"] * v**4)  # fmt: skip
    Y = (c["Y_v"] * v + (c["Y_r_less_m_x"] + m_x) * q + c["Y_vvv"] * v**3 + c["Y_vvr"] * v**2 * q
         + c["Y_vrr"] * v * q**2 + c["Y_rrr"] * q**3)  # fmt: skip
    N = (c["N_v"] * v + c["N_r"] * q + c["N_vvv"] * v**3 + c["N_vvr"] * v**2 * q
         + c["N_vrr"] * v * q**2 + c["N_rrr"] * q**3)  # fmt: skip
    unit = 0.5 * rho * L * d * U**2
    model: Any = load("suzaku").model
    found = model.hull.force(Flow(u, v_m, r, 1.8, 0.0, 0.0, 0.0, rho, L, d))
    assert found == pytest.approx((unit * X, unit * Y, unit * L * N), rel=1e-10)


@pytest.mark.parametrize("name", ["qiuxin5", "qiuxin5_6"])
def test_the_tug_has_the_particulars_of_table_1(name: str) -> None:
    model: Any = load(name).model
    told = dict(PRINTED["you2023"]["table1"])
    assert told.pop("volume") * told["rho"] == pytest.approx(model.body.m)
    has(model.body, told)
    assert len(model.thrusters.components) == 2
    for thruster, side in zip(model.thrusters.components, (1.0, -1.0), strict=True):  # section 4.1: places from CO
        has(thruster, {"x": -0.8, "y": 0.163 * side})


def test_the_tug_has_the_22_parameters_of_table_3_and_no_other() -> None:
    told, model = PRINTED["you2023"]["table3"], load("qiuxin5").model
    assert len(told) == 22
    parts: Any = {**vars(model)}
    has(parts["inertia"], {k: v for k, v in told.items() if k.startswith("m_")})
    has(parts["damping"], {k: v for k, v in told.items() if not k.startswith("m_")})
    rest = {k: v for k, v in vars(parts["damping"]).items() if k not in told and isinstance(v, float)}
    assert rest
    assert not any(rest.values())


def test_the_tug_has_the_6_parameters_of_table_4_and_no_other() -> None:
    told = PRINTED["you2023"]["table4"]
    model: Any = load("qiuxin5_6").model
    has(model.inertia, {k: v for k, v in told.items() if k.startswith("m_")})
    has(model.damping, {"X_u": -told["d_11"], "Y_v": -told["d_22"], "N_r": -told["d_33"]})
    rest = {k: v for k, v in vars(model.damping).items() if k not in ("X_u", "Y_v", "N_r") and isinstance(v, float)}
    assert rest
    assert not any(rest.values())


def test_esso_osaka_has_the_particulars_and_ranges_of_tables_3_and_4() -> None:
    """To the two digits printed; the ship file has the five of its own source."""
    ship = load("esso_osaka_3m")
    model: Any = ship.model
    found = {**vars(model.body), "C_b": ship.entries["particulars.C_b"].given}
    for name, value in PRINTED["wakita2022"]["table3"].items():
        assert found[name] == pytest.approx(value, abs=0.005), name
    ranges = PRINTED["wakita2022"]["table4"]
    propeller, rudder = ship.actuators.by_name["propeller"], ship.actuators.by_name["rudder"]
    assert [propeller.low, propeller.high] == pytest.approx(ranges["n_P"], rel=ROUND)
    assert [rudder.low, rudder.high] == pytest.approx([math.radians(a) for a in ranges["delta"]], rel=ROUND)


def test_the_states_and_controls_of_suzaku_are_those_of_table_2() -> None:
    """p: place and heading over the earth; xi: velocities at midship; tau: revolutions and rudder."""
    ship = load("suzaku")
    assert STATES == ("x", "y", "psi", "u", "v_m", "r")
    assert ship.model.controls == ("n_P", "delta")
    rates = ship.model.derivative((0.0, 0.0, 0.0, 1.0, 0.5, 0.1), (0.0, 0.0), CALM)
    assert rates[:3] == pytest.approx((1.0, 0.5, 0.1), rel=1e-12)


def test_orders_pass_the_actuators_before_the_forces_and_these_move_the_ship() -> None:
    """Sawada 2024 Fig. 1: rates of the run are those of the model at the rudder as it stands, not as it was ordered."""
    ship, dt = load("kvlcc2_l7"), 0.02
    U, n_P = approach(ship)
    run = simulate(ship, Turning(n_P, math.radians(35.0)), speed=U, duration=6.0, dt=dt)
    gear = ship.actuators.by_name["rudder"]
    assert run["delta"][50] == pytest.approx(gear.rate * run.t[50], rel=0.05)
    for k in (20, 60, 250):
        slopes = [(run[name][k + 1] - run[name][k - 1]) / (run.t[k + 1] - run.t[k - 1]) for name in STATES]
        state = tuple(float(run[name][k]) for name in STATES)
        acting, ordered = ((float(run["n_P"][k]), float(run[name][k])) for name in ("delta", "delta_cmd"))
        assert slopes == pytest.approx(ship.model.derivative(state, acting, CALM), rel=2e-3, abs=1e-6)
        yaw = ship.model.derivative(state, ordered, CALM)[5]
        assert (abs(slopes[5] - yaw) > 0.05 * abs(yaw)) == (k < 100), "the order itself acts once it is reached"


def test_ahead_and_starboard_are_where_the_figures_have_them() -> None:
    """x north, y east, heading clockwise: heading east, ahead is east and starboard is south."""
    for psi, ahead, starboard in ((0.0, (1, 0), (0, 1)), (0.5 * math.pi, (0, 1), (-1, 0)), (math.pi, (-1, 0), (0, -1))):
        c, s = math.cos(psi), math.sin(psi)
        assert to_earth(1.0, 0.0, c, s) == pytest.approx(ahead, abs=1e-15)
        assert to_earth(0.0, 1.0, c, s) == pytest.approx(starboard, abs=1e-15)
        assert to_body(*map(float, ahead), c, s) == pytest.approx((1.0, 0.0), abs=1e-15)
        assert to_body(*map(float, starboard), c, s) == pytest.approx((0.0, 1.0), abs=1e-15)


@pytest.mark.parametrize("name", ["suzaku", "esso_osaka_3m", "kvlcc2_l7", "qiuxin5", "mariner"])
def test_a_ship_moves_over_ground_as_the_kinematics_say(name: str) -> None:
    """By complex numbers: x' + i y' = (u + i v_m) e^(i psi), psi' = r."""
    model = load(name).model
    assert STATES == ("x", "y", "psi", "u", "v_m", "r")
    rng = np.random.default_rng(3)
    for _ in range(5):
        psi, u, v_m, r = rng.uniform((-3.0, 0.3, -0.2, -0.02), (3.0, 0.9, 0.2, 0.02)).tolist()
        rates = model.derivative((5.0, -7.0, psi, u, v_m, r), (0.0,) * len(model.controls), CALM)
        over = (u + 1j * v_m) * np.exp(1j * psi)
        assert (rates[0], rates[1], rates[2]) == pytest.approx((over.real, over.imag, r), rel=1e-12)


def at(u: float, v_m: float, r: float, n_P: float, delta: float, rho: float, L: float, d: float) -> Flow:
    return Flow(u, v_m, r, n_P, delta, 0.0, 0.0, rho, L, d)


def on_ship(rudder: Any, F_N: float, delta: float) -> tuple[float, float, float]:
    """(48) to (50) of Sawada 2024, (25) of Suyama 2023."""
    across = -F_N * math.cos(delta)
    return (-(1 - rudder.t_R) * F_N * math.sin(delta), (1 + rudder.a_H) * across,
            (rudder.x_R + rudder.a_H * rudder.x_H) * across)  # fmt: skip


@pytest.mark.parametrize(("u", "v_m", "r"), [
    (0.5, 0.2, 0.05), (0.5, -0.2, 0.05), (-0.4, 0.1, 0.1), (-0.4, -0.1, 0.1), (0.1, 0.02, -0.3), (-0.1, 0.0, 0.2),
])  # fmt: skip
def test_the_hull_at_low_speed_is_equation_38(u: float, v_m: float, r: float) -> None:
    """Of Sawada 2024, all quadrants, the cross flow by a sum over strips."""
    model: Any = load("esso_osaka_3m").model
    h, rho, L, d = model.hull, 998.0, 3.0, 0.20114
    x = (np.arange(20_000) + 0.5) / 20_000 * L - 0.5 * L
    width = L / 20_000

    def strips(c: float) -> np.ndarray:
        return np.abs(v_m + c * r * x) * (v_m + c * r * x)

    beta, U = abs(math.atan2(-v_m, u)), math.hypot(u, v_m)
    area = 0.5 * rho * L * d
    X = area * ((h.X_0F + (h.X_0A - h.X_0F) * beta / math.pi) * u * U + h.X_vr * L * v_m * r)
    Y = area * (h.Y_v * v_m * abs(u) + h.Y_r * L * r * u - h.C_D / L * strips(h.C_rY).sum() * width)
    N = area * L * (h.N_v * v_m * u + h.N_r * L * r * abs(u) - h.C_D / L**2 * (strips(h.C_rN) * x).sum() * width)
    assert h.force(at(u, v_m, r, 0.0, 0.0, rho, L, d)) == pytest.approx((X, Y, N), rel=1e-6)


@pytest.mark.parametrize(("v_m", "r"), [(0.1, 0.05), (-0.1, 0.05), (0.05, -0.1), (0.0, -0.1)])
def test_the_low_speed_rudder_is_equations_48_to_57(v_m: float, r: float) -> None:
    """Of Sawada 2024, ahead with the propeller ahead, in drift and yaw to either side."""
    model: Any = load("esso_osaka_3m").model
    k, u, u_P, n_P, K_T, delta = model.rudder, 0.4, 0.25, 9.0, 0.25, 0.3
    nD = n_P * model.propeller.D_P
    gain = math.sqrt(u_P**2 + 8 * K_T * nD**2 / math.pi) - u_P
    u_R = k.epsilon * math.sqrt(k.eta * (u_P + k.k_x / k.epsilon * gain) ** 2 + (1 - k.eta) * u_P**2)
    v_R = -(k.gamma_P if v_m + k.x_R * r >= 0 else k.gamma_N) * (v_m + k.l_R * r)
    F_N = 0.5 * 998.0 * k.A_R * k.f_alpha * (u_R**2 + v_R**2) * math.sin(delta - math.atan2(v_R, u_R))
    found = k.force(at(u, v_m, r, n_P, delta, 998.0, 3.0, 0.20114), Slipstream(u_P, K_T * nD**2, model.propeller.D_P))
    assert found == pytest.approx(on_ship(k, F_N, delta), rel=1e-9)


@pytest.mark.parametrize(("v_m", "r"), [(0.3, 0.02), (-0.3, 0.02), (0.3, -0.02), (0.0, 0.03)])
@pytest.mark.parametrize("delta", [0.35, -0.2])
def test_the_flapped_rudder_is_equations_25_to_36_with_table_6(v_m: float, r: float, delta: float) -> None:
    """Of Suyama 2023, with the printed numbers; flap as the rudder, and the K_T of (30) that of the thrust."""
    model: Any = load("suzaku").model
    told, L, u, u_P, n_P, K_T = PRINTED["suyama2023"]["table6"], 83.0, 3.0, 1.7, 1.8, 0.2
    D_P, J_P, U = 2.8, u_P / (n_P * 2.8), math.hypot(u, v_m)
    beta = math.atan2(-v_m, u)
    gain = math.sqrt(1 + 8 * K_T / (math.pi * J_P**2)) - 1
    u_R = u_P * told["epsilon"] * (D_P / 3.49 * told["kappa"] * gain + 1)
    assert u_R > 0.7 * math.pi * n_P * D_P * told["u_R0"]  # (29)
    gamma = told["gamma_Rp"] if beta - told["l_R"] * r * L / U > 0 else told["gamma_Rn"]
    v_R = gamma * (U * math.sin(beta) - told["l_R"] * L * r)
    f_alpha, C_l0 = told["f_0"] + told["f_2"] * delta**2, told["l_1"] * delta + told["l_3"] * delta**3
    attack = delta - math.atan2(v_R, u_R)
    F_N = 0.5 * 1025.0 * 6.282 * (u_R**2 + v_R**2) * (f_alpha * math.sin(attack) + C_l0)
    rudder = replace(model.rudder, flap="equal", slipstream="consistent")
    found = rudder.force(at(u, v_m, r, n_P, delta, 1025.0, L, 3.8), Slipstream(u_P, K_T * (n_P * D_P) ** 2, D_P))
    assert found == pytest.approx(on_ship(rudder, F_N, delta), rel=1e-9)
