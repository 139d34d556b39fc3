"""Propellers and rudders against their published non-dimensional forms, quadrant by quadrant."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

import pytest

from seatrial.forces import Flow, Slipstream
from seatrial.forces.propeller import KoseWake
from seatrial.forces.rudder_neutral import OffCentre
from seatrial.ships.files import load

L7: Any = load("kvlcc2_l7").model
ESSO: Any = load("esso_osaka_3m").model


def flow(model: Any, u: float, v_m: float, r: float, n_P: float, delta: float = 0.0) -> Flow:
    b = model.body
    return Flow(u, v_m, r, n_P, delta, 0.0, 0.0, b.rho, b.L_pp, b.d)


@pytest.mark.parametrize(("v_m", "r"), [(0.0, 0.0), (-0.15, 0.05), (0.15, -0.05), (0.1, 0.04)])
def test_standard_propeller_and_rudder(v_m: float, r: float) -> None:
    u, n, delta, (b, p, k) = 1.0, 11.0, 0.3, (L7.body, L7.propeller, L7.rudder)
    U = math.hypot(u, v_m)
    beta, yaw = math.atan2(-v_m, u), r * b.L_pp / U
    beta_P = beta + 0.48 * yaw
    ratio = 1 + (1 - math.exp(-2.0 * abs(beta_P))) * ((1.6 if beta_P > 0 else 1.1) - 1)
    u_P = u * (1 - p.w_P0) * ratio
    J = u_P / (n * p.D_P)
    K_T = p.k_0 + p.k_1 * J + p.k_2 * J * J
    force, slipstream = p.force(flow(L7, u, v_m, r, n))
    assert force == pytest.approx(((1 - p.t_P) * b.rho * n**2 * p.D_P**4 * K_T, 0.0, 0.0), rel=1e-10)
    assert slipstream.u_P == pytest.approx(u_P, rel=1e-10)

    race = 1 + k.kappa * (math.sqrt(1 + 8 * K_T / (math.pi * J * J)) - 1)
    u_R = k.epsilon * u_P * math.sqrt(k.eta * race**2 + 1 - k.eta)
    beta_R = beta + 0.71 * yaw
    v_R = U * (0.640 if beta_R > 0 else 0.395) * beta_R
    F_N = 0.5 * b.rho * k.A_R * k.f_alpha * (u_R**2 + v_R**2) * math.sin(delta - math.atan2(v_R, u_R))
    X = -(1 - k.t_R) * F_N * math.sin(delta)
    Y = -(1 + k.a_H) * F_N * math.cos(delta)
    N = -(k.x_R + k.a_H * k.x_H) * F_N * math.cos(delta)
    assert k.force(flow(L7, u, v_m, r, n, delta), slipstream) == pytest.approx((X, Y, N), rel=1e-9)


def test_kose_wake_fades_with_drift() -> None:
    p = L7.propeller
    kose = KoseWake(D_P=p.D_P, t_P=p.t_P, w_P0=p.w_P0, x_P=-0.690 * L7.body.L_pp, k_0=p.k_0, k_1=p.k_1, k_2=p.k_2)
    straight = flow(L7, 1.0, 0.0, 0.0, 10.0)
    for ours, theirs in zip(kose.force(straight), p.force(straight), strict=True):
        assert tuple(ours) == pytest.approx(tuple(theirs), rel=1e-12)
    r = 0.05
    beta_P = 0.690 * r * L7.body.L_pp
    _, slipstream = kose.force(flow(L7, 1.0, 0.0, r, 10.0))
    assert slipstream.u_P == pytest.approx(1 - p.w_P0 * math.exp(-4 * beta_P**2), rel=1e-9)


def test_an_off_centre_rudder_is_in_line_where_its_pointer_shows_minus_the_offset() -> None:
    """A pointer that shows 2 deg to port when the rudder is amidships: delta_0 is what is missing on it."""
    k = L7.rudder
    off = OffCentre(**{f.name: getattr(k, f.name) for f in fields(k)}, delta_0=math.radians(2.0))
    straight = flow(L7, 1.0, 0.0, 0.0, 11.0)
    _, slipstream = L7.propeller.force(straight)
    in_line = off.force(straight._replace(delta=math.radians(-2.0)), slipstream)
    assert tuple(in_line) == pytest.approx((0, 0, 0), abs=1e-9)
    shown = off.force(straight._replace(delta=0.0), slipstream)
    assert tuple(shown) == tuple(k.force(straight._replace(delta=math.radians(2.0)), slipstream))
    assert shown.N > 0, "amidships on the pointer the ship turns to starboard"


@pytest.mark.parametrize("n_P", [-3.0, 0.0, 3.0])
def test_standard_thrust_is_odd(n_P: float) -> None:
    there, _ = L7.propeller.force(flow(L7, 0.7, 0.0, 0.0, n_P))
    back, _ = L7.propeller.force(flow(L7, -0.7, 0.0, 0.0, -n_P))
    assert there == pytest.approx((-back.X, 0.0, 0.0))


def test_four_quadrant_ahead() -> None:
    p, b, u, v_m, r, n = ESSO.propeller, ESSO.body, 0.4, -0.05, 0.03, 10.0
    U = math.hypot(u, v_m)
    q = v_m / U + -0.517 * r * 3.0 / U
    u_P = (1 - 0.614 + 0.871 * abs(q) - 0.359 * q * q) * u  # Sawada 2024 (40)
    J = u_P / (n * p.D_P)
    K_T = 0.3278 - 0.3323 * J - 0.156 * J * J
    force, _ = p.force(flow(ESSO, u, v_m, r, n))
    assert force == pytest.approx((0.78 * b.rho * n**2 * p.D_P**4 * K_T, 0.0, 0.0), rel=1e-9)


@pytest.mark.parametrize("u", [0.05, 0.1, 0.18, 0.3, -0.2])
def test_four_quadrant_reversed(u: float) -> None:
    p, b, n = ESSO.propeller, ESSO.body, -10.0
    J_s = u / (n * p.D_P)
    K = -0.175 + 0.330 * J_s if J_s >= -0.233 else -0.251
    if J_s < -0.35:
        A, B = p.A_3 + p.A_4 * J_s, p.B_3 + p.B_4 * J_s
    else:
        A = p.A_5 if J_s > -0.06 else p.A_1 + p.A_2 * J_s
        B = p.B_5 if J_s > -0.06 else p.B_1 + p.B_2 * J_s
    side = 0.5 * b.rho * b.L_pp * b.d * (n * p.D_P) ** 2
    force, _ = p.force(flow(ESSO, u, 0.0, 0.0, n))
    expected = (b.rho * n**2 * p.D_P**4 * K, side * A, side * b.L_pp * B)
    assert force == pytest.approx(expected, rel=1e-12)


def test_four_quadrant_astern_at_ahead_revolutions() -> None:
    p, b, n, u = ESSO.propeller, ESSO.body, 8.0, -0.2
    J_s = u / (n * p.D_P)
    side = 0.5 * b.rho * b.L_pp * b.d * (n * 0.7151 * p.D_P) ** 2
    force, slipstream = p.force(flow(ESSO, u, 0.0, 0.0, n))
    assert slipstream.u_P == u
    Y = side * (p.A_6 * J_s**2 + p.A_7 * J_s + p.A_8)
    N = side * 3.0 * (p.B_6 * J_s**2 + p.B_7 * J_s + p.B_8)
    assert tuple(force)[1:] == pytest.approx((Y, N), rel=1e-12)


def test_a_stopped_four_quadrant_propeller_is_silent() -> None:
    for u in (0.4, -0.4):
        assert ESSO.propeller.force(flow(ESSO, u, 0.1, 0.02, 0.0))[0] == (0.0, 0.0, 0.0)


def inflow(u: float, n_P: float, K_T: float, u_P: float) -> float:
    """u_R of the low-speed rudder, read back from its moment at a small angle without cross flow."""
    nD = n_P * ESSO.propeller.D_P
    k, delta = ESSO.rudder, 0.1
    slipstream = Slipstream(u_P, K_T * nD * nD, ESSO.propeller.D_P)
    force = k.force(flow(ESSO, u, 0.0, 0.0, n_P, delta), slipstream)
    scale = 0.5 * ESSO.body.rho * k.A_R * k.f_alpha * (1 - k.t_R) * math.sin(delta) ** 2
    return math.copysign(math.sqrt(abs(force.X) / scale), -force.X)


def test_low_speed_rudder_in_each_quadrant() -> None:
    k, D = ESSO.rudder, ESSO.propeller.D_P
    u, n, K_T, u_P = 0.3, 9.0, 0.25, 0.15
    gain = math.sqrt(u_P**2 + 8 * K_T * (n * D) ** 2 / math.pi) - u_P
    ahead = 1.42 * math.sqrt(k.eta * (u_P + 0.288 / 1.42 * gain) ** 2 + (1 - k.eta) * u_P**2)
    assert inflow(u, n, K_T, u_P) == pytest.approx(ahead, rel=1e-9)

    a = 1.42 * u_P - n * D * 0.144 * math.sqrt(8 * 0.2 / math.pi)
    q = k.eta * math.copysign(a * a, a) + (1 - k.eta) * (1.42 * u_P) ** 2 - 0.176 * u * u
    assert inflow(u, -n, -0.2, u_P) == pytest.approx(math.copysign(math.sqrt(abs(q)), q), rel=1e-9)

    coasting = (1.42 * u_P) ** 2 - 0.176 * u * u
    expected = math.copysign(math.sqrt(abs(coasting)), coasting)
    assert inflow(u, 0.0, 0.0, u_P) == pytest.approx(expected, rel=1e-9)
    assert inflow(-u, -n, -0.2, -u) == pytest.approx(-u, rel=1e-9)


def test_starboard_rudder_turns_to_starboard() -> None:
    for model in (L7, ESSO):
        ahead = flow(model, 0.5, 0.0, 0.0, 8.0, 0.3)
        _, slipstream = model.propeller.force(ahead)
        force = model.rudder.force(ahead, slipstream)
        assert force.N > 0 > force.Y
        assert force.X < 0
