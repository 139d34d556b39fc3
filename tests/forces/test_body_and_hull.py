"""Body, polynomial hull and low-speed hull against their defining formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.forces import Flow, Force
from seatrial.forces.crossflow import drag_force, drag_moment
from seatrial.ships.files import load


def test_acceleration_solves_the_equations_of_motion() -> None:
    b = load("kvlcc2_l7").model.body
    force, (u, v, r) = Force(3.0, -40.0, 70.0), (1.1, -0.2, 0.06)
    du, dv, dr = b.acceleration(force, u, v, r)
    m, xm = b.m, b.x_G * b.m
    assert (m + b.m_x) * du - (m + b.m_y) * v * r - xm * r * r == pytest.approx(force.X, rel=1e-12)
    assert (m + b.m_y) * dv + (m + b.m_x) * u * r + xm * dr == pytest.approx(force.Y, rel=1e-12)
    yaw = b.I_zG + b.x_G**2 * m + b.J_z
    assert yaw * dr + xm * (dv + u * r) == pytest.approx(force.N, rel=1e-12)


def flow(u: float, v_m: float, r: float, **other: float) -> Flow:
    given = {"n_P": 0.0, "delta": 0.0, "u_A": 0.0, "v_A": 0.0, "rho": 1000.0, "L_pp": 7.0, "d": 0.46}
    return Flow(u=u, v_m=v_m, r=r, **(given | other))


@pytest.mark.parametrize(("u", "v_m", "r"), [(1.1, -0.2, 0.06), (0.4, 0.3, -0.1), (0.1, 0.4, 0.02)])
def test_polynomial_is_the_published_non_dimensional_form(u: float, v_m: float, r: float) -> None:
    h = load("kvlcc2_l7").model.hull
    U, L, d = math.hypot(u, v_m), 7.0, 0.46
    v, q = v_m / U, r * L / U
    X = -h.R_0 + h.X_vv * v**2 + h.X_vr * v * q + h.X_rr * q**2 + h.X_vvvv * v**4
    Y = h.Y_v * v + h.Y_r * q + h.Y_vvv * v**3 + h.Y_vvr * v**2 * q + h.Y_vrr * v * q**2 + h.Y_rrr * q**3
    N = h.N_v * v + h.N_r * q + h.N_vvv * v**3 + h.N_vvr * v**2 * q + h.N_vrr * v * q**2 + h.N_rrr * q**3
    unit = 0.5 * 1000.0 * L * d * U**2
    assert h.force(flow(u, v_m, r)) == pytest.approx((unit * X, unit * Y, unit * L * N), rel=1e-10)


def test_resistance_opposes_the_motion_ahead_and_astern() -> None:
    for name in ("kvlcc2_l7", "esso_osaka_3m"):
        hull = load(name).model.hull
        assert hull.force(flow(0.5, 0.0, 0.0)).X < 0 < hull.force(flow(-0.5, 0.0, 0.0)).X


@pytest.mark.parametrize(
    ("v", "k"),
    [(0.3, 0.1), (-0.3, 0.1), (0.05, 0.4), (-0.05, 0.4), (0.05, -0.4), (-0.02, -0.9), (0.0, 0.5), (0.4, 0.0),
     (0.0, 0.0), (0.6, 0.4), (1e-9, 1.0)],
)  # fmt: skip
def test_cross_flow_integrals_match_quadrature(v: float, k: float) -> None:
    """Gauss quadrature on either side of the zero of the cross flow is exact for its pieces."""
    h = 1.5
    nodes, weights = np.polynomial.legendre.leggauss(400)
    split = float(np.clip(-v / k, -h, h)) if k else 0.0
    force = moment = 0.0
    for a, b in ((-h, split), (split, h)):
        x = 0.5 * (a + b) + 0.5 * (b - a) * nodes
        w = 0.5 * (b - a) * weights
        strip = np.abs(v + k * x) * (v + k * x)
        force += float(w @ strip)
        moment += float(w @ (strip * x))
    assert drag_force(v, k, h) == pytest.approx(force, rel=1e-12, abs=1e-14)
    assert drag_moment(v, k, h) == pytest.approx(moment, rel=1e-12, abs=1e-14)


def test_cross_flow_is_continuous_where_its_zero_leaves_the_hull() -> None:
    h, k = 1.5, 0.4
    for s in (1.0, -1.0):
        inside, outside = s * k * h * (1 - 1e-9), s * k * h * (1 + 1e-9)
        assert drag_force(inside, k, h) == pytest.approx(drag_force(outside, k, h), rel=1e-8)
        assert drag_moment(inside, k, h) == pytest.approx(drag_moment(outside, k, h), rel=1e-8)
