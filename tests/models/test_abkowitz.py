"""Abkowitz: Mariner against MSS, the grammar of its terms, and what it does where it was never fitted."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from casadi import SX, Function, jacobian, vertcat

from seatrial.core.parameters import ParameterError, Terms, read, update
from seatrial.environment import CALM, Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.models.abkowitz import Abkowitz, factors
from seatrial.ships import ShipError
from seatrial.ships.files import FOLDER, load, save
from seatrial.simulate.run import simulate
from tiers import slow_but

GOLDEN = tomllib.loads((Path(__file__).parents[1] / "golden" / "mariner.toml").read_text())
REFS = Path(__file__).parents[3] / "shared" / "refs"
RATIO = GOLDEN["tolerance"]["ratio"]
h = 0.1
State = tuple[float, ...]


def mss(order: Callable[[float, State, float], float], duration: float, start: float = 0.0) -> np.ndarray:
    """Rows (t, six states, delta) of MSS's Euler loop, its rudder (lag 1 s, 5 deg/s) included."""
    ship = load("mariner")
    model, rudder = ship.model, ship.actuators.of("delta")
    x: State = (0.0, 0.0, 0.0, model.U_0, 0.0, 0.0)
    delta, command, rows = start, 0.0, []
    for k in range(round(duration / h) + 1):
        command = order(k * h, x, command)
        rows.append((k * h, *x, delta))
        rate = model.derivative(x, (0.0, delta), CALM)
        x = tuple(a + h * b for a, b in zip(x, rate, strict=True))
        delta += h * max(-rudder.rate, min(rudder.rate, (command - delta) / rudder.lag))
    return np.array(rows)


def test_linear_set() -> None:
    """Nomoto's K, T1, T2, T3 from the Jacobian of the model at U_0."""
    model: Any = load("mariner").model
    x, d = SX.sym("x", 2), SX.sym("d")
    rates = vertcat(*model.derivative((0.0, 0.0, 0.0, model.U_0, x[0], x[1]), (0.0, d), CALM)[4:6])
    A, B = Function("f", [x, d], [jacobian(rates, x), jacobian(rates, d)])([0, 0], 0)
    A, (b_v, b_r) = A.full(), B.full().ravel()
    # r/delta = (b_r s + A_rv b_v - A_vv b_r) / (s^2 - tr A s + det A)
    det, gain = np.linalg.det(A), A[1, 0] * b_v - A[0, 0] * b_r
    roots = np.linalg.eigvals(A)  # complex from NumPy 2.5 on, even where they are real
    assert np.isreal(roots).all()
    T1, T2 = sorted((-1.0 / roots.real).tolist(), reverse=True)
    found = {"K": gain / det, "T1": T1, "T2": T2, "T3": b_r / gain}
    for name, half in (("K", 5e-5), ("T1", 0.05), ("T2", 0.005), ("T3", 0.005)):
        assert found[name] == pytest.approx(GOLDEN["linear"][name], abs=half), name


@pytest.mark.slow
@pytest.mark.parametrize("side", slow_but(GOLDEN["turning"], "+15"))
def test_turning_by_the_logic_of_mss(side: str) -> None:
    """turncircle.m: execute where round(t) reaches 100 s, axes of the start, headings rounded to degrees."""
    rows = mss(lambda t, x, c: math.radians(float(side)) if round(t) >= 100 else 0.0, 700.0)
    heading, x, y = np.degrees(np.abs(rows[:, 3])).round(), rows[:, 1], rows[:, 2]
    origin, quarter, half = x[round(100 / h) - 1], int(np.argmax(heading >= 90)), int(np.argmax(heading >= 180))
    U = math.hypot(rows[-1, 4], rows[-1, 5])
    found = {
        "rudder_execute_x": origin, "steady_radius": U / abs(rows[-1, 6]), "max_transfer": np.abs(y).max(),
        "max_advance": np.abs(x).max() - origin, "transfer90": abs(y[quarter]),
        "advance90": abs(x[quarter] - origin), "tactical180": abs(y[half]), "U_end": U,
    }  # fmt: skip
    for name, value in GOLDEN["turning"][side].items():
        assert found[name] == pytest.approx(value, rel=RATIO), name


@pytest.mark.parametrize("angle", [10, pytest.param(20, marks=pytest.mark.slow)])
def test_zigzag_by_the_logic_of_mss(angle: int) -> None:
    set_point = math.radians(angle)

    def order(t: float, x: State, command: float) -> float:
        if round(t) == 10:
            return set_point
        if round(t) > 10 and command * x[2] >= set_point * set_point and command * x[5] > 0:
            return -command
        return command

    rows, golden = mss(order, 300.0), GOLDEN["zigzag"][str(angle)]
    heading, k, side = np.degrees(rows[:, 3]), 0, 1.0
    for reversal in (1, 2, 3):
        k += int(np.argmax(side * heading[k:] >= angle))
        assert rows[k, 0] == pytest.approx(golden[f"t_switch{reversal}"], abs=0.5 * h)
        end = int(np.argmax(side * heading[k:] < 0)) or len(heading)
        overshoot = (side * heading[k : k + end]).max() - angle
        assert overshoot == pytest.approx(golden[f"overshoot{reversal}"], rel=RATIO)
        side = -side


@pytest.mark.parametrize("side", slow_but([1, -1], 1))
def test_track_of_mss(side: int) -> None:
    path = REFS / f"mss_mariner_turn{-35 * side:+d}.csv"  # positive to port there
    if not path.exists():
        pytest.skip("reference tracks lie in ../shared/refs of the authors only")
    theirs = np.loadtxt(path, delimiter=",", comments="#")[:, [0, 4, 5, 6]]
    ours = mss(lambda t, x, c: side * math.radians(35) if round(t) >= 100 else 0.0, 700.0)[::5, :4]
    assert ours.shape == theirs.shape
    assert (np.abs(ours - theirs) <= np.maximum(1e-6 * np.abs(theirs), 1e-4)).all()


@pytest.mark.parametrize("side", [1, -1])
def test_turning_executed_at_heading_zero(side: int) -> None:
    """Re-referenced, to the digits printed: without the 8 deg that the ship has turned before MSS's execute."""
    ship, policy = load("mariner"), Turning(0.0, side * math.radians(35))
    trial = simulate(ship, policy, duration=700.0, dt=0.1)
    assert side * trial.channels["psi"][-1] > 0
    found = policy.indices(trial, ship.L_pp)
    for name, value in GOLDEN["referenced"][f"{35 * side:+d}"].items():
        assert found[name].over_L == pytest.approx(value, abs=0.005), name


@pytest.mark.parametrize(
    ("name", "expected"),
    [("Y_vvr", "rvv"), ("N_rvv", "rvv"), ("N_ddd", "ddd"), ("X_vr", "rv"), ("Y_0", ""), ("N_0uu", "uu"), ("X_0", ""),
     ("X_uuu", "uuu"), ("Y_vvvvv", "vvvvv"), ("N_vrd", "drv"), ("X_vvrrdd", "ddrrvv")],
)  # fmt: skip
def test_names_of_terms(name: str, expected: str) -> None:
    assert factors(name) == expected


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("Y_vv", "Y_vv breaks the symmetry of port and starboard: Y needs an odd number"),
        ("X_v", "X_v breaks the symmetry of port and starboard: X needs an even number"),
        ("N_rd", "N needs an odd number"),
        ("Y_u", "the bias of a single screw is written Y_0u"),
        ("Y_vq", "no term 'Y_vq'"), ("Z_v", "no term 'Z_v'"), ("Yv", "no term 'Yv'"), ("Y_", "no term 'Y_'"),
        ("Y_0v", "write Y_v"), ("X_0u", "write X_u"),
    ],
)  # fmt: skip
def test_terms_that_cannot_be(name: str, says: str) -> None:
    with pytest.raises(ParameterError) as raised:
        factors(name)
    assert says in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("X_vv =", "X_v =", "derivatives: X_v breaks the symmetry"),
        ("Y_vvv =", "Y_vw =", "derivatives: no term 'Y_vw'"),
        ("Y_vvr =", "Y_ud =", "Cannot overwrite a value"),
        ("Y_vvr =", "Y_vdr = { prime = 1.0, source = 'x' }\nY_rvd =", "Y_vdr and Y_rvd are the same term"),
        ('"abkowitz:Abkowitz"', '"abkowitz:Abkowitsch"', "near: Abkowitz"),
        ('"abkowitz:Abkowitz"', '"abkowits:Abkowitz"', "near: abkowitz"),
        ('"absorbed"', '"added"', "'added' is not one of explicit, absorbed"),
    ],
)
def test_ship_files_that_cannot_be(tmp_path: Path, old: str, new: str, says: str) -> None:
    path = tmp_path / "ship.toml"
    path.write_text((FOLDER / "mariner.toml").read_text().replace(old, new))
    with pytest.raises(ShipError) as raised:
        load(path)
    assert says in str(raised.value)
    assert "\n" not in str(raised.value)


def test_ship_file_round_trip(tmp_path: Path) -> None:
    ship = load("mariner")
    assert load(save(ship, tmp_path / "again.toml")).model == ship.model
    assert read(ship.model, "derivatives.Y_vvr") == 15356e-5


def with_terms(coriolis: str = "absorbed", **numbers: float) -> Abkowitz:
    model: Any = load("mariner").model
    terms = Terms(tuple(numbers), tuple(numbers.values()))
    return replace(model, derivatives=terms, body=replace(model.body, coriolis=coriolis))


def test_a_term_of_any_degree_is_its_product() -> None:
    model = with_terms(N_vrrdd=0.3, Y_vvvvv=-2.0, X_uurr=0.7)
    u, v, r, delta = 7.0, 0.4, 0.9, 0.3  # r in m/s: times L
    U = math.hypot(u, v)
    a, b, c = (u - model.U_0) / U, v / U, r / U
    expected = U * U * 0.7 * a**2 * c**2, U * U * -2.0 * b**5, U * U * 0.3 * b * c**2 * delta**2
    assert model.force(u, v, r, delta) == pytest.approx(expected, rel=1e-13)


def test_explicit_coriolis_is_equation_17() -> None:
    """A body without forces moves straight on: seen from its turning axes, with Euler's accelerations."""
    model = with_terms("explicit")
    model = update(model, {f"body.{name}": 0.0 for name in ("X_udot", "Y_vdot", "Y_rdot", "N_vdot", "N_rdot")})
    u, v, r = 7.0, 0.4, 0.01
    lever = model.body.x_G * model.body.L_pp
    _, _, _, du, dv, dr = model.derivative((0.0, 0.0, 0.0, u, v, r), (0.0, 0.0), CALM)
    assert (du - v * r - lever * r * r, dv + u * r + lever * dr, dr) == pytest.approx((0.0, 0.0, 0.0), abs=1e-15)
    assert with_terms("absorbed").derivative((0.0, 0.0, 0.0, u, v, r), (0.0, 0.0), CALM)[3:] == (0.0, 0.0, 0.0)


def test_silent_at_rest_and_mirrored_without_the_bias_of_the_screw() -> None:
    model: Any = load("mariner").model
    assert model.derivative((0.0,) * 6, (0.0, 0.0), CALM) == (0.0,) * 6
    assert set(model.asymmetries) == {f"derivatives.{n}_0{u}" for n in "YN" for u in ("", "u", "uu")}
    even = update(model, dict.fromkeys(model.asymmetries, 0.0))
    here = even.derivative((0.0, 0.0, 0.3, 7.0, -0.4, 0.005), (1.0, 0.2), CALM)
    there = even.derivative((0.0, 0.0, -0.3, 7.0, 0.4, -0.005), (1.0, -0.2), CALM)
    assert tuple(s * w for s, w in zip((1, -1, -1, 1, -1, -1), there, strict=True)) == pytest.approx(here, rel=1e-13)


@pytest.mark.slow
def test_finite_where_it_was_never_fitted() -> None:
    """Full helm from rest and astern for ten minutes: nothing runs away."""
    model: Any = load("mariner").model
    for u in (0.0, -4.0, 1e-9):
        x: State = (0.0, 0.0, 0.0, u, 0.1, 0.001)
        for _ in range(1200):
            x = tuple(a + 0.5 * b for a, b in zip(x, model.derivative(x, (0.0, 0.6), CALM), strict=True))
        assert all(map(math.isfinite, x))
        assert math.hypot(x[3], x[4]) < 3 * model.U_0


def test_current_only_carries_the_ship_along() -> None:
    model: Any = load("mariner").model
    around = Uniform(U_C=1.1, gamma_C=0.7).now()
    u_C = around.current_x * math.cos(0.4) + around.current_y * math.sin(0.4)
    v_C = around.current_y * math.cos(0.4) - around.current_x * math.sin(0.4)
    still = model.derivative((0.0, 0.0, 0.4, 7.0, 0.3, 0.005), (0.0, 0.2), CALM)
    moving = model.derivative((0.0, 0.0, 0.4, 7.0 + u_C, 0.3 + v_C, 0.005), (0.0, 0.2), around)
    drift = (around.current_x, around.current_y, 0.0, 0.005 * v_C, -0.005 * u_C, 0.0)
    assert moving == pytest.approx(tuple(a + b for a, b in zip(still, drift, strict=True)), rel=1e-12, abs=1e-14)
