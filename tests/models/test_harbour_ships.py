"""A ship beside a quay: contact, its energy, its inner corner, and the steady force."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.environment import CALM
from seatrial.forces.damping import Polynomial
from seatrial.models.fossen import Fossen, Inertia, Particulars
from seatrial.models.harbour import Harbour, Quay, Steady

BODY = Particulars(rho=1000.0, L_pp=5.0, B=2.8)
INERTIA = Inertia(m_11=2000.0, m_22=3000.0, m_33=8000.0, coriolis="consistent")
DAMPING = Polynomial(X_u=0.0, Y_v=0.0, N_r=0.0)
# The side runs north through (0, -3): a hull of half breadth 1.4 at the origin is 1.6 m off.
QUAY = Quay(north=0.0, east=-3.0, direction=0.0, K=3e4, flat=1.5, half=0.9)


def harbour(quay: Quay = QUAY, steady: Steady | None = None) -> Harbour:
    return Harbour(body=BODY, inertia=INERTIA, damping=DAMPING, quay=quay, steady=steady or Steady())


def run(model: Any, state: tuple[float, ...], seconds: float, dt: float = 0.01) -> Any:
    rows = [np.array(state)]
    for _ in range(round(seconds / dt)):
        s = rows[-1]
        a = np.array(model.derivative(tuple(s), (), CALM))
        b = np.array(model.derivative(tuple(s + 0.5 * dt * a), (), CALM))
        rows.append(s + dt * b)
    return np.array(rows)


def energy(s: Any) -> float:
    return 0.5 * float(2000.0 * s[3] ** 2 + 3000.0 * s[4] ** 2 + 8000.0 * s[5] ** 2)


def test_away_from_the_quay_the_ship_is_that_of_fossen() -> None:
    state = (3.0, 4.0, 0.4, 0.2, -0.3, 0.05)
    plain = Fossen(body=BODY, inertia=INERTIA, damping=DAMPING).derivative(state, (), CALM)
    assert harbour().derivative(state, (), CALM) == pytest.approx(plain, abs=1e-4)
    assert harbour(replace(QUAY, K=0.0)).derivative((3.0, -3.0, *state[2:]), (), CALM) == pytest.approx(plain)


@pytest.mark.slow
def test_a_ship_that_drifts_broadside_on_rebounds_with_the_energy_it_came_with() -> None:
    found = run(harbour(), (0.0, -1.0, 0.0, 0.0, -0.2, 0.0), 8.0)
    assert found[-1, 4] == pytest.approx(0.2, rel=0.01)
    assert energy(found[-1]) == pytest.approx(energy(found[0]), rel=0.02)
    assert found[:, 1].min() > -1.75, "the hull goes through the quay"


@pytest.mark.slow
def test_damping_and_friction_take_energy() -> None:
    dull = run(harbour(replace(QUAY, C=5e3, mu=0.3)), (0.0, -1.0, 0.0, 0.3, -0.2, 0.0), 8.0)
    assert 0.0 < dull[-1, 4] < 0.15
    assert dull[-1, 3] < 0.28


def test_a_bow_that_touches_turns_away_from_the_quay() -> None:
    force = QUAY.force((0.0, -1.3, -0.3, 0.0, 0.0, 0.0), 5.0, 2.8)
    assert force.Y > 0.0
    assert force.N > 0.0


def test_the_force_turns_with_the_quay_and_the_ship() -> None:
    turn = 2.1
    state = (0.3, -1.65, 0.1, 0.05, -0.1, 0.02)
    c, s = math.cos(turn), math.sin(turn)
    moved = (c * 0.3 + s * 1.65, s * 0.3 - c * 1.65, 0.1 + turn, *state[3:])
    other = replace(QUAY, north=3.0 * s, east=-3.0 * c, direction=turn, mu=0.2)
    assert other.force(moved, 5.0, 2.8) == pytest.approx(replace(QUAY, mu=0.2).force(state, 5.0, 2.8), rel=1e-9)


def test_a_wall_across_stops_the_stern_where_it_stands_and_nowhere_else() -> None:
    corner = replace(QUAY, reach=3.0)
    assert corner.force((2.45, -1.0, 0.0, 0.0, 0.0, 0.0), 5.0, 2.8).X > 500.0
    beyond = corner.force((2.45, 4.0, 0.0, 0.0, 0.0, 0.0), 5.0, 2.8)
    behind = corner.force((-1.0, 4.0, 0.0, 0.0, 0.0, 0.0), 5.0, 2.8)
    assert max(map(abs, (*beyond, *behind))) < 1.0
    open_end = QUAY.force((2.45, -1.0, 0.0, 0.0, 0.0, 0.0), 5.0, 2.8)
    assert abs(open_end.X) < 1e-6


def test_the_steady_force_is_one_in_ship_axes() -> None:
    rates = harbour(replace(QUAY, K=0.0), Steady(X_0=200.0, Y_0=-300.0, N_0=80.0)).derivative((0.0,) * 6, (), CALM)
    assert rates[3:] == pytest.approx((0.1, -0.1, 0.01))
