"""Fossen's family: published ships to the digits printed, and the mechanics that any of them must keep."""

from __future__ import annotations

import math
import tomllib
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import brentq

from seatrial.cli.app import main
from seatrial.core.parameters import ParameterError, Parts, update, values, walk
from seatrial.environment import CALM, Environment
from seatrial.forces import Flow
from seatrial.forces.azimuth import Azimuth
from seatrial.forces.damping import CrossFlowDrag, Polynomial
from seatrial.forces.rudder_linear import Linear
from seatrial.manoeuvres.turning import Turning
from seatrial.models.fossen import Fossen, Inertia, Particulars
from seatrial.ships.files import load
from seatrial.simulate.run import simulate
from tiers import slow_but

GOLDEN = tomllib.loads((Path(__file__).parents[1] / "golden" / "fossen.toml").read_text(encoding="utf-8"))
SHIPS = ("milliampere", "cybership2", "qiuxin5", "qiuxin5_6")
every_ship = pytest.mark.parametrize("name", SHIPS)

FREE = Inertia(m_11=120.0, m_22=180.0, m_33=60.0, m_23=8.0, m_32=8.0, m_12=-5.0, m_21=-5.0, m_13=3.0, m_31=3.0)
NO_DAMPING = Polynomial(X_u=0.0, Y_v=0.0, N_r=0.0)
BODY = Particulars(rho=1000.0, L_pp=3.0, d=0.2)


def agrees(found: float, printed: str) -> bool:
    """Whether a figure is what was printed, to half a unit of its last digit."""
    return abs(found - float(printed)) <= 0.5 * 10.0 ** -len(printed.partition(".")[2])


def ahead(name: str, x: float) -> tuple[float, ...]:
    """Controls of a ship driven straight ahead: total thrust [N], or revolutions [1/s] of each thruster."""
    return {"milliampere": (x / 2, 0.0, x / 2, 0.0), "cybership2": (x, 0.0, 0.0)}.get(name, (x, 0.0, x, 0.0))


def sway_yaw(model: Any, u: float) -> Any:
    """Eigenvalues of sway and yaw about a straight run at `u` [m/s]."""
    state, control = ca.SX.sym("x", 6), (0.0,) * len(model.controls)
    rates = ca.vertcat(*model.derivative(tuple(state[i] for i in range(6)), control, CALM))
    jacobian = ca.Function("j", [state], [ca.jacobian(rates, state)])
    return np.linalg.eigvals(np.array(jacobian([0, 0, 0, u, 0, 0]))[4:, 4:])


def run(model: Any, state: Any, control: Any, seconds: float, dt: float, around: Environment = CALM) -> Any:
    def f(s: Any) -> Any:
        return np.array(model.derivative(tuple(s.tolist()), control, around), dtype=float)

    state = np.array(state, dtype=float)
    for _ in range(round(seconds / dt)):
        a = f(state)
        b = f(state + 0.5 * dt * a)
        c = f(state + 0.5 * dt * b)
        state = state + dt / 6.0 * (a + 2 * b + 2 * c + f(state + dt * c))
    return state


@pytest.mark.parametrize(
    ("name", "u", "printed"), [(n, *row) for n in GOLDEN for row in GOLDEN[n].get("eigenvalues", [])]
)
def test_instability_on_course(name: str, u: float, printed: str) -> None:
    assert agrees(max(sway_yaw(load(name).model, u).real), printed)


@pytest.mark.slow
def test_tug_is_stable_on_course() -> None:
    model: Any = load("qiuxin5").model
    real = [sway_yaw(model, u).real for u in np.linspace(0.0, 1.5, 16)]
    assert agrees(float(np.max(real)), GOLDEN["qiuxin5"]["stable_range"][0])
    assert agrees(float(np.min(real)), GOLDEN["qiuxin5"]["stable_range"][1])


@pytest.mark.parametrize(("name", "x", "printed"), [(n, *row) for n in GOLDEN for row in GOLDEN[n]["speeds"]])
def test_steady_speed(name: str, x: float, printed: str) -> None:
    model: Any = load(name).model

    def surge(u: float) -> float:
        return model.derivative((0.0, 0.0, 0.0, u, 0.0, 0.0), ahead(name, x), CALM)[3]

    assert agrees(float(brentq(surge, 1e-3, 10.0)), printed)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("n", "alpha", "printed"), slow_but(GOLDEN["qiuxin5"]["turns"], GOLDEN["qiuxin5"]["turns"][-1])
)
def test_tug_turns_away_from_its_stern_thrust(n: float, alpha: float, printed: str) -> None:
    model: Any = load("qiuxin5").model
    a = math.radians(alpha)
    end = run(model, (0, 0, 0, 0.1 * n, 0, 0), (n, a, n, a), 90.0, 0.1)
    assert end[5] < 0  # stern pushed to starboard, bow to port
    assert agrees(2.0 * math.hypot(end[3], end[4]) / abs(end[5]) / 2.152, printed)


@pytest.mark.slow
def test_simulated_tug_turns_as_its_equations_say() -> None:
    ship = load("qiuxin5")
    trial = simulate(ship, Turning(n_P=7.0, delta=math.radians(20.0)), speed=0.9, duration=90.0)
    u, v, r = (trial.channels[key][-1] for key in ("u", "v_m", "r"))
    assert r > 0  # an order of delta > 0 turns the thrusters to alpha < 0 and the ship to starboard
    assert agrees(2.0 * math.hypot(u, v) / r / ship.L_pp, {a: p for _, a, p in GOLDEN["qiuxin5"]["turns"]}[20.0])
    first = trial.channels["alpha_1"][1] - trial.channels["alpha_1"][0]
    assert abs(first) / (trial.t[1] - trial.t[0]) == pytest.approx(0.1151)  # K_alpha


@every_ship
def test_what_is_said_of_the_masses(name: str) -> None:
    inertia: Inertia = load(name).model.inertia  # type: ignore[attr-defined]
    M = np.array(inertia.matrix, dtype=float)
    assert np.linalg.eigvalsh(0.5 * (M + M.T)).min() > 0
    body: Particulars = load(name).model.body  # type: ignore[attr-defined]
    assert body.m == {"qiuxin5": 187.6, "qiuxin5_6": 187.6, "cybership2": 23.8}.get(name, 0.0)
    text = " ".join(inertia.doubts(body.m, body.L_pp))
    assert ("gyration" in text) == (name == "qiuxin5_6")
    assert ("not symmetric" in text) == (name in ("milliampere", "qiuxin5"))
    assert ("displaced" in text) == name.startswith("qiuxin")
    assert "positive definite" not in text


@pytest.mark.slow
def test_a_ship_that_spins_is_told_of_before_and_stopped(capsys) -> None:
    assert main(["simulate", "qiuxin5_6", "turning", "--rudder", "17.5"]) == 1
    told = capsys.readouterr().err
    assert "warning: qiuxin5_6: m_33 = 0.0632 kg m^2 is that of a radius of gyration of 0.018 m" in told
    assert "is outside [-0.7, 0.7]" in told
    assert "[validity]" in told
    assert main(["simulate", "qiuxin5_6", "turning", "--rudder", "10"]) == 0


def test_mass_that_is_no_mass_is_doubted() -> None:
    assert "positive definite" in replace(FREE, m_23=200.0, m_32=200.0).doubts()[0]
    assert FREE.doubts() == ()


@pytest.mark.parametrize("coriolis", ["published", "consistent"])
def test_matrices_as_written(coriolis: str) -> None:
    inertia = replace(load("qiuxin5").model.inertia, coriolis=coriolis)  # type: ignore[attr-defined]
    damping: Any = load("qiuxin5").model.damping  # type: ignore[attr-defined]
    nu = np.array([0.7, -0.2, 0.15])
    M, C, D = (np.array(x, dtype=float) for x in (
        inertia.matrix, inertia.coriolis_matrix(*nu), damping.matrix(*nu)))  # fmt: skip
    m_23 = 1.1254 if coriolis == "published" else 0.5 * (1.1254 - 16.0598)
    c_13, c_23 = -106.6003 * -0.2 - m_23 * 0.15, 138.0574 * 0.7
    assert pytest.approx(np.array([[0, 0, c_13], [0, 0, c_23], [-c_13, -c_23, 0]])) == C  # You 2023 (3)
    d_22 = 71.9041 + 77.6429 * 0.2 + 43.2207 * 0.15 + 27.1394 * 0.04
    d_33 = 26.7122 + 2.3474 * 0.2 + 9.8284 * 0.15 + 9.232 * 0.0225
    assert (D[1, 1], D[2, 2]) == pytest.approx((d_22, d_33))  # You 2023 (4)
    model: Any = replace(load("qiuxin5").model, inertia=inertia)  # type: ignore[type-var]
    rates = model.derivative((0.0, 0.0, 0.0, *nu.tolist()), (0.0,) * 4, CALM)[3:]
    assert rates == pytest.approx(np.linalg.solve(M, -C @ nu - D @ nu), rel=1e-12)


@pytest.mark.slow
def test_consistent_coriolis_keeps_energy_and_momentum() -> None:
    body = Fossen(body=BODY, inertia=replace(FREE, coriolis="consistent"), damping=NO_DAMPING)
    M = np.array(FREE.matrix)

    def kept(s: Any) -> tuple[float, ...]:
        p, c, n = M @ s[3:], math.cos(s[2]), math.sin(s[2])
        return (*(float(x) for x in (p[0] * c - p[1] * n, p[0] * n + p[1] * c)), float(s[3:] @ M @ s[3:]))

    start = np.array([0, 0, 0.4, 0.8, -0.3, 0.5])
    end = run(body, start, (), 10.0, 0.01)
    assert np.abs(end[3:] - start[3:]).max() > 0.1
    assert kept(end) == pytest.approx(kept(start), rel=1e-7)


def test_published_coriolis_is_the_consistent_one_of_a_symmetric_decoupled_mass() -> None:
    decoupled = replace(FREE, m_12=0.0, m_21=0.0, m_13=0.0, m_31=0.0)
    nu = (0.7, -0.2, 0.15)
    both = (replace(decoupled, coriolis=c).coriolis_matrix(*nu) for c in ("published", "consistent"))
    assert np.array(next(both)) == pytest.approx(np.array(next(both)))


@pytest.mark.slow
@pytest.mark.parametrize("name", [SHIPS[0], *(pytest.param(name, marks=pytest.mark.long) for name in SHIPS[1:])])
def test_current_only_carries_the_ship_along(name: str) -> None:
    ship = load(name)
    model: Any = ship.model
    own = {"milliampere": (150.0, 0.2, 180.0, -0.1), "cybership2": (0.4, 0.1, 0.05)}
    control = own.get(name, (6.0, -0.2, 5.0, 0.1))
    current = np.array([0.21, -0.13])
    psi, u, v, r = 0.7, 0.8 * ship.speed, -0.05, 0.02
    c, s = math.cos(psi), math.sin(psi)
    drift = (current[0] * c + current[1] * s, current[1] * c - current[0] * s)
    seconds, dt = 10.0, 0.005
    still = run(model, (0, 0, psi, u, v, r), control, seconds, dt)
    carried = run(
        model, (0, 0, psi, u + drift[0], v + drift[1], r), control, seconds, dt, Environment(0, 0, *current.tolist())
    )
    assert carried[:2] - seconds * current == pytest.approx(still[:2], abs=1e-9)
    assert carried[[2, 5]] == pytest.approx(still[[2, 5]], abs=1e-9)


@every_ship
def test_mirrored_at_rest_and_finite(name: str) -> None:
    model: Any = load(name).model
    n = len(model.controls)
    x = ca.SX.sym("x", 6 + n)
    y = ca.vertcat(*model.derivative(tuple(x[i] for i in range(6)), tuple(x[i] for i in range(6, 6 + n)), CALM))
    f, j = ca.Function("f", [x], [y]), ca.Function("j", [x], [ca.jacobian(y, x)])
    assert not np.array(f([0.0] * (6 + n))).any()
    rng = np.random.default_rng(5)
    signs = np.array([1, -1, -1, 1, -1, -1])
    turned = {"cybership2": [1, -1, -1]}.get(name, [1, -1, 1, -1])
    swap = [0, 1, 2, 3] if name == "milliampere" else [2, 3, 0, 1] if n == 4 else list(range(n))
    for row in [np.zeros(6 + n), *rng.uniform(-1, 1, (30, 6 + n))]:
        row[:2] = 0.0
        here = np.array(f(row)).ravel()
        direct = model.derivative(tuple(row[:6].tolist()), tuple(row[6:].tolist()), CALM)
        assert here == pytest.approx(np.array(direct), rel=1e-12, abs=1e-12)
        assert np.isfinite(np.array(j(row))).all()
        there = np.array(f([*(signs * row[:6]), *(np.array(turned) * row[6:])[swap]])).ravel()
        assert signs * there == pytest.approx(here, rel=1e-9, abs=1e-9 * np.abs(here).max())


@every_ship
def test_parameters_may_be_symbols(name: str) -> None:
    model: Any = load(name).model
    known = values(model)
    p = ca.SX.sym("p", len(known))
    symbolic = update(model, {path: p[i] for i, path in enumerate(known)})
    at = (0.0, 0.0, 0.2, 0.5, -0.1, 0.03), (2.0, 0.3, 1.5, -0.2)[: len(model.controls)], Environment(2.0, 1.0, 0.1, 0.0)
    y = ca.vertcat(*symbolic.derivative(*at))
    found = ca.Function("f", [p], [y, ca.jacobian(y, p)])(list(known.values()))
    assert np.array(found[0]).ravel() == pytest.approx(np.array(model.derivative(*at)), rel=1e-12)
    assert np.isfinite(np.array(found[1])).all()


def test_rudder_orders_turn_every_ship_to_starboard() -> None:
    for name in SHIPS:
        ship = load(name)
        model: Any = ship.model
        order = {"n_P": 3.0, "delta": 0.2}
        control = tuple(order.get(key, 0.0) * factor for key, factor in model.follows)
        rates = model.derivative((0.0, 0.0, 0.0, ship.speed, 0.0, 0.0), control, CALM)
        assert rates[5] > 0, name


def test_linear_form_is_the_thrusters_force() -> None:
    model: Any = load("qiuxin5").model
    lossy = update(model, {"thrusters.1.T_nu": 0.9, "thrusters.2.T_nu": 1.1, "thrusters.1.t": 0.1})
    nu, control = (0.6, -0.1, 0.05), (7.0, 0.3, 4.0, -0.5)
    flow = Flow(*nu, 0.0, 0.0, 0.0, 0.0, 1000.0, 2.152, 0.2)
    B, u, D_loss = (np.array(x, dtype=float) for x in lossy.affine(flow, control))
    assert pytest.approx(np.array([[1, 0, 1, 0], [0, 1, 0, 1], [-0.163, -0.8, 0.163, -0.8]])) == B  # Sawada 2024 (28)
    with_thrust, without = (np.array(lossy.force(flow, c)) for c in (control, (0.0,) * 4))
    assert B @ u - D_loss @ np.array(nu) == pytest.approx(with_thrust - without, rel=1e-12)
    assert not D_loss[:, 1:].any()
    assert D_loss[0, 0] > 0


@pytest.mark.parametrize(
    ("model", "count"),
    [
        (load("qiuxin5_6").model, 6),
        (load("qiuxin5").model, 22),
        (load("milliampere").model, 22),
    ],
)
def test_number_of_parameters(model: Any, count: int) -> None:
    speed = {f"damping.{name}" for name in ("Y_uv", "N_uv", "N_ur", "X_vr")}  # not in the paper
    of_form = [v for path, _, v in walk(model) if path.startswith(("inertia.", "damping.")) and path not in speed]
    assert len(of_form) == 30  # the fully coupled form
    zeros = {"damping.N_rrr"} if model.damping.N_rrr == 0 and count == 22 else set()
    assert len([v for v in of_form if v != 0]) + len(zeros) == count


def test_fully_coupled_terms_act() -> None:
    model = Fossen(body=BODY, inertia=FREE, damping=Polynomial(
        X_u=-5.0, Y_v=-20.0, N_r=-8.0, X_v=1.0, X_r=2.0, Y_u=3.0, N_u=4.0))  # fmt: skip
    u, v, r = 0.5, 0.2, -0.1
    nu = np.array([u, v, r])
    force = model.force(Flow(u, v, r, 0.0, 0.0, 0.0, 0.0, 1000.0, 3.0, 0.2))
    assert force == pytest.approx(np.array([[-5, 1, 2], [3, -20, 0], [4, 0, -8]]) @ nu)
    rates = model.derivative((0.0, 0.0, 0.0, u, v, r), (), CALM)[3:]
    C = np.array(FREE.coriolis_matrix(u, v, r), dtype=float)
    assert rates == pytest.approx(np.linalg.solve(np.array(FREE.matrix), np.array(force) - C @ nu), rel=1e-12)


@pytest.mark.parametrize(("order", "left"), [("linear", 4.0), ("quadratic", 4.0 + 6.0), ("cubic", 4.0 + 6.0 + 8.0)])
def test_order_of_damping(order: str, left: float) -> None:
    damping = Polynomial(order=order, X_u=-4.0, X_uu=-3.0, X_uuu=-2.0, Y_v=-1.0, N_r=-1.0)
    assert pytest.approx(-2.0 * left) == damping.force(Flow(2.0, 0, 0, 0, 0, 0, 0, 1000.0, 3.0, 0.2)).X


def test_lift_of_a_hull_that_makes_way_is_by_its_speed_and_turned_with_it() -> None:
    damping = Polynomial(order="quadratic", X_u=-4.0, Y_v=-1.0, N_r=-2.0, Y_uv=-3.0, N_uv=5.0, N_ur=-6.0)
    v, r = 0.3, -0.2
    for u in (2.0, -2.0):
        force = damping.force(Flow(u, v, r, 0, 0, 0, 0, 1000.0, 3.0, 0.2))
        assert pytest.approx((-1.0 - 3.0 * 2.0) * v) == force.Y
        assert pytest.approx((-2.0 - 6.0 * 2.0) * r + 5.0 * u * v) == force.N
    linear = replace(damping, order="linear").force(Flow(2.0, v, r, 0, 0, 0, 0, 1000.0, 3.0, 0.2))
    assert linear == pytest.approx((-8.0, -v, -2.0 * r))


def test_drift_in_a_turn_is_resisted_by_the_product_of_both_and_on_either_side_alike() -> None:
    damping = Polynomial(order="quadratic", X_u=-4.0, Y_v=-1.0, N_r=-2.0, X_vr=7.0, X_v=0.5)
    for side in (1.0, -1.0):  # outward in the turn: v and r of opposite signs
        force = damping.force(Flow(2.0, -0.3 * side, 0.2 * side, 0, 0, 0, 0, 1000.0, 3.0, 0.2))
        assert pytest.approx(-4.0 * 2.0 + 0.5 * -0.3 * side - 7.0 * 0.3 * 0.2) == force.X
    assert replace(damping, order="linear").force(Flow(2.0, -0.3, 0.2, 0, 0, 0, 0, 1000.0, 3.0, 0.2)).X == -8.15


def test_cross_flow_drag_is_the_integral_over_the_hull() -> None:
    damping = CrossFlowDrag(X_u=-4.0, Y_v=-1.0, N_r=-1.0, C_D=0.8)
    v, r = 0.1, 0.3
    x = (np.arange(20000) + 0.5) / 20000 * 3.0 - 1.5
    strip = 0.5 * 1000.0 * 0.2 * 0.8 * np.abs(v + x * r) * (v + x * r) * (3.0 / 20000)
    force = damping.force(Flow(0.5, v, r, 0, 0, 0, 0, 1000.0, 3.0, 0.2))
    assert force == pytest.approx((-2.0, -v - strip.sum(), -r - (x * strip).sum()), rel=1e-6)
    assert not any(damping.force(Flow(0, 0, 0, 0, 0, 0, 0, 1000.0, 3.0, 0.2)))


def test_ship_with_rudder_and_propeller() -> None:
    mmg: Any = load("kvlcc2_l7").model
    k = mmg.rudder
    rudder = Linear(**{key: getattr(k, key) for key in values(k) if key in Linear.__dataclass_fields__})
    model = Fossen(
        body=Particulars(rho=1000.0, L_pp=7.0, d=0.46), inertia=Inertia(m_11=3500.0, m_22=5800.0, m_33=16000.0),
        damping=Polynomial(X_u=-30.0, Y_v=-900.0, N_r=-9000.0), propeller=mmg.propeller, rudder=rudder,
    )  # fmt: skip
    assert model.controls == ("n_P", "delta")
    flow = Flow(1.0, 0.0, 0.0, 11.0, 0.02, 0.0, 0.0, 1000.0, 7.0, 0.46)
    pull, slipstream = mmg.propeller.force(flow)
    linear, full = rudder.force(flow, slipstream), k.force(flow, slipstream)
    assert tuple(linear) == pytest.approx(tuple(full), rel=3e-4)  # Sawada 2024 (31) at a small angle
    assert pytest.approx(-30.0 + pull.X + linear.X) == model.force(flow).X
    assert model.derivative((0, 0, 0, 1.0, 0.0, 0.0), (11.0, 0.2), CALM)[5] > 0
    with pytest.raises(ParameterError, match="slipstream of a propeller"):
        replace(model, propeller=None)


def test_thrusters_beside_a_propeller() -> None:
    mmg: Any = load("kvlcc2_l7").model
    bow = Parts(("bow",), (Azimuth(x=3.0, c_2=1.0),))
    model = Fossen(body=BODY, inertia=FREE, damping=NO_DAMPING, propeller=mmg.propeller, thrusters=bow)
    assert model.controls == ("n_P", "n_bow", "alpha_bow")
    assert model.follows == (("n_P", 1.0), ("n_P", 1.0), ("delta", 1.0))


def test_the_page_on_models_says_which_matrix_goes_with_M_by_default() -> None:
    """Two readings of C give two ships, so nobody should have to find out which one a file without a word means."""
    (default,) = (field.default for field in fields(Inertia) if field.name == "coriolis")
    page = (Path(__file__).parents[2] / "docs" / "models.md").read_text(encoding="utf-8")
    section = " ".join(page.partition("## Fossen\n")[2].partition("\n## ")[0].split())
    assert f'`coriolis` is "{default}" (the default)' in section
