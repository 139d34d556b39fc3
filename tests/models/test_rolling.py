"""Ships that roll against independent runs, published figures, and what physics asks of heel."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from seatrial.core.parameters import ParameterError, update
from seatrial.data import Array
from seatrial.environment import CALM, Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models.son_nomoto import factors
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.approach import approach
from seatrial.simulate.run import simulate

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
        assert track[:, k] == pytest.approx(rows[name], rel=1e-6, abs=1e-6), name


def steered(ship: Ship, n_P: float, u: float, order: Callable[[float, float], float], duration: float, **start: float) -> Array:
    """States each second under a rudder that follows the order at 5 deg/s, stage by stage; steps of 0.05 s."""
    step, h = rk4(ship.model.derivative, 2), 0.05
    x = np.array([0.0, 0.0, 0.0, u, 0.0, 0.0, start.get("phi", 0.0), 0.0])
    delta, track = 0.0, [x]
    for k in range(round(duration / h)):
        wanted = order(k * h, float(x[2]))
        end = delta + max(-FIVE * h, min(FIVE * h, wanted - delta))
        x = step(x, (n_P, delta), (n_P, 0.5 * (delta + end)), (n_P, end), h).full().ravel()
        delta = end
        if (k + 1) % 20 == 0:
            track.append(x)
    return np.array(track)


class Reversing:
    """A zigzag, starboard first: reversed at the first step at or beyond the set heading."""

    def __init__(self, delta: float) -> None:
        self.delta, self.side = math.radians(delta), 1.0

    def __call__(self, t: float, psi: float) -> float:
        if self.side * psi >= self.delta:
            self.side = -self.side
        return self.side * self.delta


long = pytest.mark.long


@pytest.mark.parametrize(
    ("name", "rpm", "order", "GM"),
    [
        ("turn+35_80rpm", 80, 35, 0.3),
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
    track = steered(ship, rpm / 60.0, u, lambda t, psi: math.radians(order), len(rows["t"]) - 1.0)
    agrees(track, rows, ship.L_pp)


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
    agrees(steered(ship, rpm / 60.0, u, Reversing(angle), len(rows["t"]) - 1.0), rows, ship.L_pp)


def test_container_rolls_freely() -> None:
    rows, ship = reference("container_4dof/roll_decay_10deg_80rpm.csv"), load("container_son_nomoto")
    u = approach(ship, None, 80.0 / 60.0)[0]
    track = steered(ship, 80.0 / 60.0, u, lambda t, psi: 0.0, rows["t"][-1], phi=math.radians(10.0))
    each = np.flatnonzero(rows["t"] % 1.0 == 0.0)
    agrees(track[: len(each)], {name: column[each] for name, column in rows.items()}, ship.L_pp)


@pytest.mark.parametrize("name", ["step_N200kNm", "step_N500kNm", "step_N1000kNm", "zigzag_N500kNm_20",
                                  "roll_decay_0mps", "roll_decay_8mps"])  # fmt: skip
def test_naval_ship(name: str) -> None:
    rows, ship = reference(f"naval_4dof/{name}.csv"), load("naval_blanke")
    h = 0.02 if name.startswith("roll") else 0.05
    each, step = round((rows["t"][1] - rows["t"][0]) / h), rk4(ship.model.derivative, 3)
    x = np.array([rows[n][0] for n in ("x", "y", "psi", "u", "v", "r", "phi", "p")])
    push, side, track = float(rows["N_e"][0]), 1.0, [x]
    for _ in range(each * (len(rows["t"]) - 1)):
        if name.startswith("zigzag") and side * float(x[2]) >= math.radians(20.0):
            side = -side
        given = (float(rows["X_e"][0]), 0.0, side * push)
        x = step(x, given, given, given, h).full().ravel()
        track.append(x)
    agrees(np.array(track)[::each], rows, ship.L_pp)
