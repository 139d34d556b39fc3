"""Tracks against independent implementations; the reference files stay outside the project."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from seatrial.environment import CALM, Environment, Uniform
from seatrial.ships import Ship
from seatrial.ships.files import load

REFS = Path(__file__).parents[3] / "shared" / "refs"
State = tuple[float, ...]


def rk4(f: Any, x: State, dt: float) -> State:
    a = f(x)
    b = f(tuple(p + 0.5 * dt * q for p, q in zip(x, a, strict=True)))
    c = f(tuple(p + 0.5 * dt * q for p, q in zip(x, b, strict=True)))
    d = f(tuple(p + dt * q for p, q in zip(x, c, strict=True)))
    return tuple(p + dt / 6 * (q + 2 * r + 2 * s + t) for p, q, r, s, t in zip(x, a, b, c, d, strict=True))


def turn(
    ship: Ship, *, n_P: float, u: float, order: float, dt: float, steps: int,
    environment: Environment = CALM, mean: bool = True,
) -> list[State]:  # fmt: skip
    """States of a turn from rest of the rudder; `mean`: the mean of the ramp acts over a step."""
    x, actual, track = (0.0, 0.0, 0.0, u, 0.0, 0.0), 0.0, []
    for _ in range(steps + 1):
        track.append(x)
        acts, (end,) = ship.actuators.rudder.advance((actual,), math.radians(order), dt)
        control = (n_P, acts if mean else actual)
        x = rk4(lambda y, c=control: ship.model.derivative(y, c, environment), x, dt)
        actual = end
    return track


def reference(name: str) -> list[State]:
    path = REFS / name
    if not path.exists():
        pytest.skip(f"reference track {name} lies in ../shared/refs of the authors only")
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    return [tuple(float(cell or "nan") for cell in line.split(",")) for line in lines]


@pytest.mark.slow
@pytest.mark.parametrize("order", [35, pytest.param(-35, marks=pytest.mark.long)])
@pytest.mark.parametrize(
    ("name", "block", "n_P", "u", "dt", "steps"),
    [
        ("kvlcc2_l7", "L7", 11.851590315879161, 1.179, 0.02, 5000),
        pytest.param("kvlcc2", "full", 1.7785105973628208, 7.973888888888889, 0.1, 7000, marks=pytest.mark.long),
    ],
)
def test_kvlcc2_turns(name: str, block: str, n_P: float, u: float, dt: float, steps: int, order: int) -> None:
    rows = reference(f"kvlcc2_{block}_turn{order:+d}.csv")
    ship = load(name)
    track = turn(ship, n_P=n_P, u=u, order=order, dt=dt, steps=steps)
    for t, u_, v_, r_, x, y, psi, _ in rows:
        k = round(t / dt)
        if k > steps:
            break
        assert math.hypot(track[k][0] - x, track[k][1] - y) < 1e-6 * ship.L_pp
        assert track[k][2:] == pytest.approx((psi, u_, v_, r_), rel=1e-6, abs=1e-7)


@pytest.mark.parametrize(
    ("file", "steps", "windy"),
    [pytest.param("mmg1p1r_turn+35.csv", 1800, False, marks=pytest.mark.slow),
     ("mmg1p1r_turn35_wind.csv", 600, True)],
)  # fmt: skip
def test_esso_osaka_turns(file: str, steps: int, windy: bool) -> None:
    rows = reference(file)
    ship = load("esso_osaka_3m")
    environment = Uniform(U_T=3.0, gamma_T=math.pi / 2).now() if windy else CALM
    if not windy:
        ship = replace(ship, model=replace(ship.model, wind=None))  # type: ignore[type-var]
    track = turn(ship, n_P=10.0, u=0.446, order=35, dt=0.1, steps=steps, environment=environment, mean=False)
    for k, row in enumerate(rows):
        assert math.hypot(track[k][0] - row[1], track[k][1] - row[3]) < 1e-5 * ship.L_pp


@pytest.mark.parametrize(
    ("name", "n_P", "u", "dt"),
    [("kvlcc2_l7", 11.85, 1.179, 0.1), pytest.param("esso_osaka_3m", 10.0, 0.4, 0.1, marks=pytest.mark.slow),
     ("zeefakkel", 0.0, 5.0, 0.1)],
)  # fmt: skip
def test_motion_in_current_is_motion_in_still_water_plus_drift(name: str, n_P: float, u: float, dt: float) -> None:
    """Seen from the water a uniform current is not there (wind off: it would be)."""
    ship = load(name)
    if name == "esso_osaka_3m":
        ship = replace(ship, model=replace(ship.model, wind=None))  # type: ignore[type-var]
    current = Uniform(U_C=0.3, gamma_C=1.1).now()
    cx, cy = current.current_x, current.current_y
    x = (0.0, 0.0, 0.0, u, 0.0, 0.0)
    z = (0.0, 0.0, 0.0, u + cx, cy, 0.0)
    for _ in range(300):
        x = rk4(lambda y: ship.model.derivative(y, (n_P, 0.5), CALM), x, dt)
        z = rk4(lambda y: ship.model.derivative(y, (n_P, 0.5), current), z, dt)
    c, s = math.cos(x[2]), math.sin(x[2])
    drifted = (x[0] + 30 * cx, x[1] + 30 * cy, x[2], x[3] + cx * c + cy * s, x[4] + cy * c - cx * s, x[5])
    assert z == pytest.approx(drifted, rel=1e-5, abs=1e-5)
    at = (0.0, 0.0, 0.4, 0.7, 0.1, 0.05)
    c, s = math.cos(0.4), math.sin(0.4)
    u_C, v_C = cx * c + cy * s, cy * c - cx * s
    still = ship.model.derivative(at, (n_P, 0.3), CALM)
    moving = ship.model.derivative((0.0, 0.0, 0.4, 0.7 + u_C, 0.1 + v_C, 0.05), (n_P, 0.3), current)
    expected = (
        still[0] + cx,
        still[1] + cy,
        still[2],
        still[3] + 0.05 * v_C,
        still[4] - 0.05 * u_C,
        still[5],
    )
    assert moving == pytest.approx(expected, rel=1e-12, abs=1e-14)


def test_nomoto_answers_a_step_as_its_closed_form() -> None:
    ship = load("mariner_nomoto")
    model: Any = ship.model
    x, dt, delta = (0.0, 0.0, 0.0, model.U, 0.0, 0.0), 0.5, 0.05
    for _ in range(200):
        x = rk4(lambda y: model.derivative(y, (0.0, delta), CALM), x, dt)
    assert x[5] == pytest.approx(model.K * delta * (1 - math.exp(-100.0 / model.T)), rel=1e-8)
    assert x[3] == model.U


def test_norrbin_settles_on_its_cubic() -> None:
    model: Any = load("zeefakkel").model
    x, delta = (0.0, 0.0, 0.0, model.U, 0.0, 0.0), 0.5
    for _ in range(800):
        x = rk4(lambda y: model.derivative(y, (0.0, delta), CALM), x, 0.5)
    assert x[5] + model.alpha * x[5] ** 3 == pytest.approx(model.K * delta, rel=1e-5)
