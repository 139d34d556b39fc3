"""Ships that roll against independent runs, published figures, and what physics asks of heel."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from seatrial.core.parameters import ParameterError, update
from seatrial.data import Array
from seatrial.environment import CALM, Uniform
from seatrial.manoeuvres.straight import Straight
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models.son_nomoto import factors
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.approach import approach
from seatrial.simulate.run import simulate
from seatrial.testing import ships

REFS = Path(__file__).parents[3] / "shared" / "refs"
FIVE = math.radians(5.0)


def rk4(rates: Callable[..., Any], controls: int) -> Any:
    """One step of Runge-Kutta's method: (x, control at its start, middle and end, step) to x, compiled."""
    x, h = ca.SX.sym("x", 8), ca.SX.sym("h")
    at = [ca.SX.sym(f"c{k}", controls) for k in range(3)]

    def f(y: Any, c: Any) -> Any:
        return ca.vertcat(*rates(tuple(y[i] for i in range(8)), tuple(c[i] for i in range(controls)), CALM))

    a = f(x, at[0])
    b = f(x + 0.5 * h * a, at[1])
    c = f(x + 0.5 * h * b, at[1])
    d = f(x + h * c, at[2])
    return ca.Function("step", [x, *at, h], [x + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)])


def reference(name: str) -> dict[str, Array]:
    path = REFS / name
    if not path.exists():
        pytest.skip(f"reference run {name} lies in ../shared/refs of the authors only")
    head, *lines = path.read_text().splitlines()
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    return {column.split(" ")[0].strip(): rows[:, k] for k, column in enumerate(head.split(","))}


def agrees(track: Array, rows: dict[str, Array], L: float) -> None:
    """Places within 1e-6 L, heel within 1e-4 deg; beyond that half a unit of the seventh digit, as printed."""
    printed = {n: 0.5 * 10.0 ** (np.floor(np.log10(np.maximum(np.abs(rows[n]), 1e-6))) - 6.0) for n in rows}
    off = np.hypot(track[:, 0] - rows["x"], track[:, 1] - rows["y"])
    assert (off <= 1e-6 * L + np.hypot(printed["x"], printed["y"])).all(), off.max() / L
    assert np.degrees(np.abs(track[:, 6] - rows["phi"])).max() < 1e-4
    for k, name in ((2, "psi"), (3, "u"), (4, "v"), (5, "r"), (7, "p")):
        assert (np.abs(track[:, k] - rows[name]) <= 1e-6 * np.maximum(np.abs(rows[name]), 1.0)).all(), name


def steered(
    ship: Ship, n_P: float, u: float, order: Callable[[float], float], duration: float, phi: float = 0.0
) -> Array:
    """States each second under a rudder that follows the order, a function of the heading, at 5 deg/s.

    Steps of 0.05 s; each stage of a step has the angle of its own instant.
    """
    step, h = rk4(ship.model.derivative, 2), 0.05
    second, x, delta = step.mapaccum(20), np.array([0.0, 0.0, 0.0, u, 0.0, 0.0, phi, 0.0]), 0.0
    track = [x]
    for _ in range(round(duration)):
        ramp = [delta]
        for _ in range(20):  # a turn orders one angle
            ramp.append(ramp[-1] + max(-FIVE * h, min(FIVE * h, order(float(x[2])) - ramp[-1])))
        angle = np.array(ramp)
        given = [np.vstack([np.full(20, n_P), one]) for one in (angle[:-1], 0.5 * (angle[1:] + angle[:-1]), angle[1:])]
        x, delta = second(x, *given, np.full((1, 20), h)).full()[:, -1], ramp[-1]
        track.append(x)
    return np.array(track)


def zigzag(ship: Ship, n_P: float, u: float, order: Callable[[float], float], duration: float) -> Array:
    """The same where the order is asked for at every step."""
    step, h = rk4(ship.model.derivative, 2), 0.05
    x, delta = np.array([0.0, 0.0, 0.0, u, 0.0, 0.0, 0.0, 0.0]), 0.0
    track = [x]
    for k in range(round(duration / h)):
        end = delta + max(-FIVE * h, min(FIVE * h, order(float(x[2])) - delta))
        x = step(x, (n_P, delta), (n_P, 0.5 * (delta + end)), (n_P, end), h).full().ravel()
        delta = end
        if (k + 1) % 20 == 0:
            track.append(x)
    return np.array(track)


class Reversing:
    """A zigzag, starboard first: reversed at the first step at or beyond the set heading."""

    def __init__(self, delta: float) -> None:
        self.delta, self.side = math.radians(delta), 1.0

    def __call__(self, psi: float) -> float:
        if self.side * psi >= self.delta:
            self.side = -self.side
        return self.side * self.delta


long = pytest.mark.long


@pytest.mark.parametrize(
    ("name", "rpm", "order", "GM"),
    [
        pytest.param("turn+35_80rpm", 80, 35, 0.3, marks=pytest.mark.slow),
        pytest.param("turn+10_80rpm", 80, 10, 0.3, marks=long),
        pytest.param("turn+20_80rpm", 80, 20, 0.3, marks=long),
        pytest.param("turn+20_70rpm", 70, 20, 0.3, marks=long),
        pytest.param("turn+35_70rpm", 70, 35, 0.3, marks=long),
        pytest.param("turn+35_80rpm_GM1.0", 80, 35, 1.0, marks=long),
    ],
)
def test_container_turns(name: str, rpm: int, order: float, GM: float) -> None:
    rows, ship = reference(f"container_4dof/{name}.csv"), load("container_son_nomoto").having({"body.GM": GM})
    u = approach(ship, None, rpm / 60.0)[0]
    track = steered(ship, rpm / 60.0, u, lambda psi: math.radians(order), len(rows["t"]) - 1.0)
    agrees(track, rows, ship.L_pp)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "rpm", "angle"),
    [
        ("zigzag+20_20_80rpm", 80, 20),
        pytest.param("zigzag+10_10_80rpm", 80, 10, marks=long),
        pytest.param("zigzag+20_20_70rpm", 70, 20, marks=long),
    ],
)
def test_container_zigzags(name: str, rpm: int, angle: float) -> None:
    rows, ship = reference(f"container_4dof/{name}.csv"), load("container_son_nomoto")
    u = approach(ship, None, rpm / 60.0)[0]
    agrees(zigzag(ship, rpm / 60.0, u, Reversing(angle), len(rows["t"]) - 1.0), rows, ship.L_pp)


def test_container_rolls_freely() -> None:
    rows, ship = reference("container_4dof/roll_decay_10deg_80rpm.csv"), load("container_son_nomoto")
    u = approach(ship, None, 80.0 / 60.0)[0]
    track = steered(ship, 80.0 / 60.0, u, lambda psi: 0.0, rows["t"][-1], phi=math.radians(10.0))
    each = np.flatnonzero(rows["t"] % 1.0 == 0.0)
    agrees(track[: len(each)], {name: column[each] for name, column in rows.items()}, ship.L_pp)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "step_N1000kNm",
        "zigzag_N500kNm_20",
        "roll_decay_0mps",
        "roll_decay_8mps",
        *(pytest.param(name, marks=long) for name in ("step_N200kNm", "step_N500kNm")),
    ],
)
def test_naval_ship(name: str) -> None:
    rows, ship = reference(f"naval_4dof/{name}.csv"), load("naval_blanke")
    h = 0.02 if name.startswith("roll") else 0.05
    each, step = round((rows["t"][1] - rows["t"][0]) / h), rk4(ship.model.derivative, 3)
    x = np.array([rows[n][0] for n in ("x", "y", "psi", "u", "v", "r", "phi", "p")])
    push, side, track = float(rows["N_e"][0]), 1.0, [x]
    swings = name.startswith("zigzag")
    many, steps = 1 if swings else each, each * (len(rows["t"]) - 1)
    some = step.mapaccum(many)
    for _ in range(steps // many):
        if swings and side * float(x[2]) >= math.radians(20.0):
            side = -side
        given = np.tile([[float(rows["X_e"][0])], [0.0], [side * push]], many)
        x = some(x, given, given, given, np.full((1, many), h)).full()[:, -1]
        track.append(x)
    agrees(np.array(track)[:: each // many], rows, ship.L_pp)


# Facts of the reference runs: advance, transfer, tactical [L], inward, outward, steady heel [deg].
TURNS = {
    (80, 10): (5.6063, 3.7324, 8.1985, 0.370, 6.727, 5.036),
    (80, 20): (4.0335, 2.4958, 5.6502, 0.656, 8.973, 4.702),
    (80, 35): (3.2488, 1.8139, 4.0935, 0.838, 11.810, 3.076),
    (70, 10): (5.6945, 3.8449, 8.4186, 0.346, 5.176, 3.842),
    (70, 20): (4.0895, 2.5666, 5.7753, 0.619, 7.018, 3.601),
    (70, 35): (3.2787, 1.8547, 4.1588, 0.810, 8.752, 2.352),
}


OTHERS = [pytest.param(*one, marks=long) for one in TURNS if one != (80, 35)]


@pytest.mark.slow
@pytest.mark.parametrize(("rpm", "angle"), [(80, 35), *OTHERS])
def test_indices_of_container_turns(rpm: int, angle: int) -> None:
    """By simulate, at its own step; the engine holds the mean of a ramp over a step, 1e-3 deg of the inward heel."""
    ship, policy = load("container_son_nomoto"), Turning(rpm / 60.0, math.radians(angle))
    u, _ = approach(ship, None, rpm / 60.0)
    trial = simulate(ship, policy, speed=u, duration=1200.0 if angle == 10 else 900.0, dt=0.05)
    found, wanted = policy.indices(trial, ship.L_pp), TURNS[rpm, angle]
    lengths = [found[name].over_L for name in ("advance", "transfer", "tactical_diameter")]
    assert lengths == pytest.approx(wanted[:3], abs=0.51e-4)
    heels = [math.degrees(found[name].value) for name in ("inward_heel", "outward_heel", "steady_heel")]
    assert heels[:2] == pytest.approx(wanted[3:5], abs=1.5e-3)
    assert heels[2] == pytest.approx(wanted[5], abs=5e-3)  # read over the last quarter turn, there at the end


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rpm", "angle", "overshoots", "reversals", "heels"),
    [
        (80, 20, (6.771, 6.350, 5.983, 5.902), (36.50, 128.00, 221.30, 314.10), (9.092, 8.912)),
        pytest.param(80, 10, (3.704, 4.997, 4.935, 4.879), (32.85, 112.45, 200.00, 287.70), (7.382, 6.554), marks=long),
        pytest.param(70, 20, (5.959, 5.511, 5.256, 5.182), (41.60, 144.20, 248.75, 353.00), (7.203, 7.883), marks=long),
    ],
)
def test_indices_of_container_zigzags(
    rpm: int, angle: int, overshoots: tuple[float, ...], reversals: tuple[float, ...], heels: tuple[float, ...]
) -> None:
    ship, policy = load("container_son_nomoto"), Zigzag(rpm / 60.0, math.radians(angle), math.radians(angle), 1.0)
    u, _ = approach(ship, None, rpm / 60.0)
    trial = simulate(ship, policy, speed=u, duration=600.0, dt=0.05)
    found = policy.indices(trial, ship.L_pp)
    four = ("first", "second", "third", "fourth")
    # The figures count from the set heading, ours from that at the sample of the reversal.
    at = np.flatnonzero(np.diff(np.sign(trial["delta_cmd"])))[:4] + 1
    late = np.degrees(np.abs(trial["psi"][at] - trial["psi"][0])) - angle
    assert [math.degrees(found[f"{n}_overshoot"].value) for n in four] == pytest.approx(overshoots - late, abs=1.1e-3)
    assert [found[f"{n}_reversal"].value for n in four] == pytest.approx(reversals, abs=1e-6)
    ways = [math.degrees(found[f"heel_to_{n}"].value) for n in ("starboard", "port")]
    assert ways == pytest.approx(heels, abs=1.1e-3)


def test_rates_as_printed() -> None:
    container, naval = load("container_son_nomoto").model, load("naval_blanke").model
    rates = container.derivative((0.0, 0.0, 0.2, 8.0, 0.3, 0.005, 0.05, 0.002), (80.0 / 60.0, 0.1), CALM)
    assert (rates[3], rates[4], rates[5], rates[7]) == pytest.approx(
        (0.0050904350, -0.0378176058, -0.0005426011, -0.0027834132), abs=0.51e-10
    )
    body, hull = naval.part("body"), naval.part("hull")
    X, Y, K, N = hull.force(7.0, 0.4, 0.03, 0.02, 0.1)  # type: ignore[union-attr]
    du, dv, dp, dr = body.acceleration(  # type: ignore[union-attr]
        (X + 1e5, Y + 2e4, K + 1e4, N + 3e5), 7.0, 0.4, 0.03, 0.02, 0.1
    )
    assert (du, dv, dp, dr) == pytest.approx((0.01990645, 0.06687618, -0.14234845, -0.00758821), abs=0.51e-8)


@pytest.mark.parametrize(
    ("push", "form", "r", "phi"),
    [
        (2e5, "phi_uphi", 0.62889, -0.8538), (5e5, "phi_uphi", 1.24353, -1.6914), (1e6, "phi_uphi", 2.00744, -2.6971),
        (2e5, "phi_uv", 0.64108, -0.8704), (5e5, "phi_uv", 1.27612, -1.7354), (1e6, "phi_uv", 2.06609, -2.7715),
    ],
)  # fmt: skip
def test_steady_turns_of_the_naval_ship(push: float, form: str, r: float, phi: float) -> None:
    """Also with the other reading of N_phiuv, by whose size the two differ."""
    model: Any = load("naval_blanke").model
    model = replace(model, hull=replace(model.hull, yaw_by_heel=form))
    x, step = np.array([0.0, 0.0, 0.0, 8.0, 0.0, 0.0, 0.0, 0.0]), rk4(model.derivative, 3)
    many = step.mapaccum(6000)
    given = np.tile(np.array([[125440.0], [0.0], [push]]), 6000)
    end = many(x, given, given, given, np.full((1, 6000), 0.1)).full()[:, -1]
    assert math.degrees(end[5]) == pytest.approx(r, abs=1e-5)
    assert math.degrees(end[6]) == pytest.approx(phi, abs=1e-4)


def test_a_starboard_rudder_heels_inwards_first_and_a_large_gm_stiffens() -> None:
    ship = load("container_son_nomoto")
    rates = ship.model.derivative((0.0, 0.0, 0.0, 8.377, 0.0, 0.0, 0.0, 0.0), (80.0 / 60.0, 0.1), CALM)
    assert rates[4:6] == pytest.approx((-0.0081063, 0.00040379), rel=2e-5)
    assert rates[7] == pytest.approx(0.00058061, rel=2e-5)  # starboard side down: into the turn
    heels: list[float] = []
    for GM in (0.3, 1.0, 30.0):
        policy = Turning(80.0 / 60.0, math.radians(20.0))
        found = policy.indices(simulate(ship.having({"body.GM": GM}), policy, duration=400.0, dt=0.1), ship.L_pp)
        heels.append(math.degrees(found["outward_heel"].value))
    assert heels[0] > 3.0 * heels[1] > 30.0 * heels[2]


def test_port_turns_are_mirror_images() -> None:
    ship, tracks = load("container_son_nomoto"), []
    for side in (1.0, -1.0):
        trial = simulate(ship, Turning(80.0 / 60.0, side * math.radians(35.0)), duration=120.0)
        tracks.append([trial["x"], side * trial["y"], side * trial["phi"], side * trial["p"]])
    assert np.allclose(tracks[0], tracks[1], rtol=0.0, atol=1e-12 * 1000.0)


def test_a_run_begins_with_a_heel_where_it_is_given() -> None:
    """The naval ship at rest: extremes and times of a free roll from 10 deg, as the facts print them."""
    ship = load("naval_blanke")
    rest = simulate(ship, Straight(0.0), duration=12.0, dt=0.02,
                    start=(0.0, 0.0, 0.0, 0.01, 0.0, 0.0, math.radians(10.0), 0.0))  # fmt: skip
    phi = np.degrees(rest["phi"])
    turned = np.flatnonzero(np.diff(np.sign(np.diff(phi))) != 0) + 1
    assert phi[turned][:4] == pytest.approx((-7.735, 6.021, -4.710, 3.699), abs=2e-2)
    assert rest.t[turned][:4] == pytest.approx((2.78, 5.58, 8.38, 11.16), abs=0.021)


def test_uncoupled_periods() -> None:
    """T = 2 pi sqrt((I_x + J_x)/(W GM)): 33.01 s of the container ship, 5.643 s of the naval ship."""
    for name, wanted in (("container_son_nomoto", 33.01), ("naval_blanke", 5.643)):
        body: Any = load(name).model.part("body")
        slope = 1e-6
        still = (0.0, 0.0, 0.0, 0.0)
        if name == "naval_blanke":
            lone = update(body, {"Y_pdot": -body.m * body.z_G, "K_vdot": -body.m * body.z_G})
            rate = lone.acceleration(still, 0.0, 0.0, 0.0, 0.0, slope)[2]
        else:
            lone = update(body, {"l_y": 0.0})
            rate = lone.acceleration(still, 0.0, 0.0, 0.0, slope)[2]
        assert 2.0 * math.pi / math.sqrt(-rate / slope) == pytest.approx(wanted, rel=3e-4)


def test_terms_are_named_by_their_factors() -> None:
    assert factors("Y_vvphi") == ("phi", "v", "v")
    for wrong in ("Y_vv", "X_v", "Y_vd", "Z_v", "K_phiphi"):
        with pytest.raises(ParameterError):
            factors(wrong)


def test_wind_heels_a_ship_with_the_height_of_its_force() -> None:
    """Wind from the east on a ship heading north: pushed to port, and with the wind's force high up heeled to port."""
    ship = ships()["rolling"]
    rates = ship.model.derivative((0.0,) * 8, (0.0, 0.0), Uniform(U_T=10.0, gamma_T=math.pi / 2).now())
    assert rates[4] < 0.0
    assert rates[7] < 0.0


@pytest.mark.slow
def test_a_rudder_pulse_rolls_the_container_ship_inwards_then_outwards() -> None:
    """10 deg from 50 to 75 s at 7.3 m/s, 70 rpm: 0.346 deg at 58.1 s, then -3.751 deg at 79.9 s."""
    steps = iter(range(10_000))
    track = zigzag(load("container_son_nomoto"), 70.0 / 60.0, 7.3,
                   lambda psi: math.radians(10.0) if 1000 <= next(steps) < 1500 else 0.0, 120.0)  # fmt: skip
    phi = np.degrees(track[:, 6])
    assert (phi[50:70].max(), int(phi[50:70].argmax()) + 50) == pytest.approx((0.346, 58), abs=1e-3)
    assert (phi.min(), int(phi.argmin())) == pytest.approx((-3.751, 80), abs=6e-3)  # read each second


@pytest.mark.long
def test_a_heading_autopilot_with_a_lagging_rudder() -> None:
    """The setting of the toolbox: order -(psi - 5 deg + 10 r) held over steps of 0.1 s, lag of 1 s, 10 deg, 5 deg/s."""
    rows, ship, h = reference("container_4dof/pd_heading5_70rpm.csv"), load("container_son_nomoto"), 0.1
    z, order = ca.SX.sym("z", 9), ca.SX.sym("order")

    def f(y: Any) -> Any:
        state, delta = tuple(y[i] for i in range(8)), y[8]
        rates = ship.model.derivative(state, (70.0 / 60.0, delta), CALM)
        return ca.vertcat(*rates, ca.fmin(ca.fmax(order - delta, -FIVE), FIVE))

    a = f(z)
    b = f(z + 0.5 * h * a)
    c = f(z + 0.5 * h * b)
    d = f(z + h * c)
    step = ca.Function("step", [z, order], [z + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)])
    x = np.array([0.0, 0.0, 0.0, 7.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    track = [x]
    for _ in range(6000):
        wanted = max(-2.0 * FIVE, min(2.0 * FIVE, -(x[2] - FIVE + 10.0 * x[5])))
        x = step(x, wanted).full().ravel()
        track.append(x)
    agrees(np.array(track)[::10, :8], rows, ship.L_pp)
