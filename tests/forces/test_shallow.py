"""Shallow water: exact in deep water, two published methods against one another, finite down to the bottom."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from seatrial.environment import Environment
from seatrial.forces import Flow
from seatrial.forces.hull import Polynomial
from seatrial.forces.shallow import SHALLOWEST, ShallowPolynomial, afloat, ankudinov1990, kijima1990
from seatrial.models.common import Surroundings
from seatrial.ships.files import load

# L_pp, B, d [m] and C_b of KVLCC2, KCS and the full-scale Esso Osaka.
SHIPS = {
    "kvlcc2": (320.0, 58.0, 20.8, 0.81),
    "kcs": (230.0, 32.2, 10.8, 0.651),
    "esso_osaka": (325.0, 53.0, 21.79, 0.83),
}
KVLCC2: Any = load("kvlcc2").model
every_ship = pytest.mark.parametrize("ship", list(SHIPS))
every_form = pytest.mark.parametrize("form", ["ankudinov1990", "kijima1990"])


def hull(form: str = "ankudinov1990") -> ShallowPolynomial:
    deep = {f.name: getattr(KVLCC2.hull, f.name) for f in fields(Polynomial)}
    return ShallowPolynomial(**deep, B=58.0, C_b=0.81, form=form)


def moving(u: Any, v_m: Any, r: Any, d_over_h: Any) -> Flow:
    return Flow(u, v_m, r, 0.0, 0.0, 0.0, 0.0, 1025.0, 320.0, 20.8, d_over_h=d_over_h)


@every_form
def test_deep_water_is_exact(form: str) -> None:
    flow = moving(6.0, -1.0, 0.01, 0.0)
    assert hull(form).force(flow) == KVLCC2.hull.force(flow)
    assert afloat(KVLCC2.body, hull(form), flow) == KVLCC2.body
    assert afloat(KVLCC2.body, KVLCC2.hull, moving(6.0, -1.0, 0.01, 0.8)) is KVLCC2.body


def test_factors_by_hand() -> None:
    found = ankudinov1990(1 / 1.5, *SHIPS["kvlcc2"])  # F = 0.5
    b = 0.81 * 58 / 20.8 * (1 + 58 / 320) ** 2
    K_0 = 1 + 0.0775 / 0.5**2 - 0.0110 / 0.5**3 + 0.000068 / 0.5**5
    K_1 = -0.0643 / 0.5 + 0.0724 / 0.5**2 - 0.0113 / 0.5**3 + 0.0000767 / 0.5**5
    K_2 = 0.0342 / 0.5
    assert found.N_v == pytest.approx(K_0 + K_1 * b + K_2 * b * b)
    assert found.m_y == pytest.approx(K_0 + 2 / 3 * K_1 * b + 8 / 15 * K_2 * b * b)
    assert found.Y_v == pytest.approx(1.5 * (K_0 + K_1 * b / 2 + K_2 * b * b / 3) - 0.5)
    found = kijima1990(0.5, *SHIPS["kvlcc2"])
    x = 0.81 * 58 / 20.8
    assert found.Y_v == pytest.approx(0.5 ** (-0.4 * x) - 0.5)
    assert found.N_r == pytest.approx(0.5 ** (-(1.5 - 7.14 * 2 * 20.8 / 320)) - 0.5)


@every_ship
def test_two_methods_agree_on_drift(ship: str) -> None:
    """Strip theory and regression of model tests share no number: Y_v and N_v within an eighth of one another."""
    for h_over_d in (1.2, 1.35, 1.5, 2.0, 3.0, 6.0):
        one, two = (form(1 / h_over_d, *SHIPS[ship]) for form in (ankudinov1990, kijima1990))
        assert one.Y_v == pytest.approx(two.Y_v, rel=0.125)
        assert one.N_v == pytest.approx(two.N_v, rel=0.125)
        assert 1.0 <= one.Y_r <= one.N_r <= one.N_v


@every_form
def test_limits_of_the_range(form: str) -> None:
    factors = {"ankudinov1990": ankudinov1990, "kijima1990": kijima1990}[form]
    end = factors(1 / SHALLOWEST, *SHIPS["kvlcc2"])
    assert factors(0.99, *SHIPS["kvlcc2"]) == end  # nearly aground
    assert factors(1.5, *SHIPS["kvlcc2"]) == end
    assert factors(-0.1, *SHIPS["kvlcc2"]) == factors(0.0, *SHIPS["kvlcc2"])
    wide = (100.0, 40.0, 8.0, 0.7)  # B/d = 5, the second branch of K_2
    assert ankudinov1990(0.5, *wide).N_v > 1.0
    edges = [ankudinov1990(0.5, 100.0, 4.0 * 8.0 * (1 + e), 8.0, 0.7).N_v for e in (-1e-4, 1e-4)]
    assert edges[0] == pytest.approx(edges[1], rel=1e-3)  # 0.137/4 against 0.0342


@every_form
def test_silent_mirrored_finite_and_equal_on_symbols(form: str) -> None:
    module = hull(form)
    assert all(abs(y) == 0 for y in module.force(moving(0.0, 0.0, 0.0, 0.7)))
    x = ca.SX.sym("x", 4)
    y = ca.vertcat(*(ca.SX(e) for e in module.force(moving(*(x[i] for i in range(4))))))
    f, j = ca.Function("f", [x], [y]), ca.Function("j", [x], [ca.jacobian(y, x)])
    for u in (0.0, 7.0, -3.0):
        for v_m, r in ((0.0, 0.0), (1.0, -0.01)):
            for s in (0.0, 0.5, 1 / SHALLOWEST, 0.95, 1.0):
                here = module.force(moving(u, v_m, r, s))
                there = module.force(moving(u, -v_m, -r, s))
                assert tuple(here) == pytest.approx((there.X, -there.Y, -there.N), rel=1e-12)
                assert np.array(f([u, v_m, r, s])).ravel() == pytest.approx(np.array(here), rel=1e-12)
                assert np.isfinite(np.array(ca.DM(j([u, v_m, r, s])).full())).all()


def turn(h_over_d: float, form: str) -> float:
    """Tactical diameter over length of KVLCC2, 35 deg of rudder at once, added mass of the depth included."""
    model = replace(KVLCC2, hull=hull(form))
    around = Environment(per_depth=1.0 / (h_over_d * 20.8))

    def rates(x: np.ndarray) -> np.ndarray:
        at = Surroundings.of(tuple(x), around)
        flow = at.flow(model.body, 1.7, math.radians(35.0))
        body = afloat(model.body, model.hull, flow)
        return np.array(at.rates(body.acceleration(model.force(flow), flow.u, flow.v_m, flow.r)))

    x, dt = np.array([0.0, 0.0, 0.0, 7.0, 0.0, 0.0]), 4.0
    while abs(x[2]) < math.pi:
        half = rates(x + 0.5 * dt * rates(x))
        x = x + dt * half
    return abs(float(x[1])) / 320.0


@every_form
def test_ships_turn_wider_near_the_bottom(form: str) -> None:
    deep, shallow, shallowest = (turn(h_over_d, form) for h_over_d in (math.inf, 1.5, 1.2))
    assert deep == pytest.approx(2.93, abs=0.05)
    assert shallow < shallowest
    assert 1.15 * deep < shallowest < 2.0 * deep
