"""Azimuth and side thrusters: published thrust, levers, loss with speed, and silence at rest."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
import pytest

from seatrial.core.parameters import ParameterError, walk
from seatrial.forces import Flow
from seatrial.forces.azimuth import Azimuth, ThrustAzimuth
from seatrial.forces.thruster import Direct, Tunnel
from seatrial.ships.files import load

TUG: Any = load("qiuxin5").model
TUNNEL: dict[str, Any] = {"x": 2.5, "D": 0.05, "K_T": 0.3}
EXAMPLES: dict[str, Any] = {
    "tug": TUG.thrusters.components[0],
    "lossy": Azimuth(x=-0.8, y=0.1, c_2=1.2, T_nu=0.9, t=0.1, astern=0.7),
    "ordered": ThrustAzimuth(x=1.8, y=0.2),
    "plain": Tunnel(**TUNNEL),
    "jet": Tunnel(**TUNNEL, loss_form="jet", c_Y=4.0, c_N=7.0, to_port=0.9),
    "froude": Tunnel(**TUNNEL, loss_form="froude", a_Y1=-4.0, a_Y2=5.0, a_N1=-6.0, a_N2=9.0),
    "rated": Tunnel(x=-2.0, D=0.05, T_0=3.0, n_0=30.0, loss_form="jet", c_Y=4.0, c_N=4.0),
    "direct": Direct(),
}
every_thruster = pytest.mark.parametrize("name", list(EXAMPLES))


def at(u: Any = 0.0, v: Any = 0.0, r: Any = 0.0) -> Flow:
    return Flow(u, v, r, 0.0, 0.0, 0.0, 0.0, 1000.0, 3.0, 0.2)


@every_thruster
def test_silent_finite_and_the_same_on_symbols(name: str) -> None:
    part = EXAMPLES[name]
    n = len(part.prefixes)
    x = ca.SX.sym("x", 3 + n)
    y = ca.vertcat(*part.force(at(*(x[i] for i in range(3))), tuple(x[i] for i in range(3, 3 + n))))
    f, j = ca.Function("f", [x], [y]), ca.Function("j", [x], [ca.jacobian(y, x)])
    assert not any(part.force(at(0.8, 0.1, 0.2), (0.0,) * n))
    corners = [np.array([u, 0, 0, n_, *([0.4] * (n - 1))]) for u in (0, 0.5, -0.5) for n_ in (0, 1e-6, 1e-9, 9, -9)]
    random = np.random.default_rng(2).uniform(-1, 1, (50, 3 + n)) * [1, 0.3, 0.2, 9, *([0.7] * (n - 1))]
    for row in [*corners, *random]:
        direct = part.force(at(*row[:3].tolist()), tuple(row[3:].tolist()))
        assert np.array(f(row)).ravel() == pytest.approx(np.array(direct), rel=1e-12, abs=1e-12)
        assert np.isfinite(np.array(j(row))).all()


@every_thruster
def test_numbers_are_declared_and_the_linear_form_is_the_force(name: str) -> None:
    part = EXAMPLES[name]
    assert all(meaning.about and meaning.low <= value <= meaning.high for _, meaning, value in walk(part))
    assert len(part.follows) == len(part.prefixes)
    flow, control = at(0.6), (5.0, 0.4, 0.3)[: len(part.prefixes)]
    B, u = np.array(part.effect, dtype=float).T, np.array(part.inputs(flow, control), dtype=float)
    total = B @ u - np.array(part.loss(flow, control), dtype=float) * 0.6
    assert total == pytest.approx(np.array(part.force(flow, control), dtype=float), rel=1e-12)


@pytest.mark.parametrize("n", [0.5, 3.0, 5.0, 7.0, 10.0])
def test_thrust_of_the_tug_as_printed(n: float) -> None:
    both = -0.0001773 * n**5 + 0.001187 * n**4 + 0.04978 * n**3 + 0.151 * n**2 + 1.974 * n + 0.0722
    assert TUG.thrusters.components[0].thrust(n) == pytest.approx(both / 2, rel=1e-12)  # You 2023 (20)


def test_thrust_of_the_tug_where_nothing_was_measured() -> None:
    part = TUG.thrusters.components[0]
    assert part.thrust(0.0) == 0.0
    assert part.thrust(-5.0) == -part.thrust(5.0)
    assert part.thrust(16.9) == part.thrust(22.1) == part.thrust(10.0)  # the bare polynomial falls to zero


def test_lever_of_an_azimuth() -> None:
    port, starboard = Azimuth(x=-0.8, y=-0.163, c_1=1.0), Azimuth(x=-0.8, y=0.163, c_1=1.0)
    assert starboard.force(at(), (10.0, 0.0)) == pytest.approx((10.0, 0.0, -1.63))  # the bow goes to port
    assert port.force(at(), (10.0, 0.0)) == pytest.approx((10.0, 0.0, 1.63))
    a = 0.3
    X, Y = 10 * math.cos(a), 10 * math.sin(a)
    assert port.force(at(), (10.0, a)) == pytest.approx((X, Y, -0.8 * Y + 0.163 * X))  # Sawada 2024 (25)


def test_quadratic_law_with_deduction_and_loss() -> None:
    part = Azimuth(x=-1.0, y=0.2, c_2=1.5, T_nu=0.4, t=0.1)
    n, a, u = 6.0, 0.25, 0.7
    c, s = math.cos(a), math.sin(a)
    T = 0.9 * 1.5 * n * n - 0.9 * 0.4 * n * u * c
    assert part.force(at(u), (n, a)) == pytest.approx((T * c, T * s, T * (-s - 0.2 * c)))
    assert pytest.approx(0.9 * 1.5 * n * n) == part.force(at(u), (n, math.pi / 2)).Y  # no stream along the shaft


@pytest.mark.parametrize("x", [-2.0, 2.0])
def test_rudder_order_turns_to_starboard(x: float) -> None:
    for part in (Azimuth(x=x, c_2=1.0), ThrustAzimuth(x=x, f_per_n=50.0)):
        order = {"n_P": 4.0, "delta": 0.3}
        control = tuple(factor * order[name] for name, factor in part.follows)
        assert part.force(at(), control).N > 0
    assert ThrustAzimuth(x=x, f_per_n=50.0).follows[0] == ("n_P", 50.0)


def test_tunnel_at_rest() -> None:
    T = 0.3 * 1000.0 * 0.05**4 * 400.0
    assert Tunnel(**TUNNEL).force(at(), (20.0,)) == pytest.approx((0.0, T, 2.5 * T))
    assert EXAMPLES["jet"].force(at(), (-20.0,)) == pytest.approx((0.0, -0.9 * T, -0.9 * 2.5 * T))
    assert EXAMPLES["rated"].force(at(), (15.0,)) == pytest.approx((0.0, 0.75, -1.5))


def test_jet_bends_with_forward_speed() -> None:
    part, u, n = EXAMPLES["jet"], 0.3, 20.0
    _, T, M = part.force(at(), (n,))
    V_j = math.sqrt(T / (1000.0 * math.pi / 4 * 0.05**2))
    for sign in (1, -1):
        _, Y, N = part.force(at(sign * u), (n,))
        assert pytest.approx((T * math.exp(-4 * (u / V_j) ** 2), M * math.exp(-7 * (u / V_j) ** 2))) == (Y, N)
    assert part.force(at(u), (0.5 * n,)).Y / part.force(at(), (0.5 * n,)).Y < Y / T  # a weak jet suffers more


def test_moment_comes_back_at_speed() -> None:
    # Chislett and Bjoerheden 1966, abstract: half the moment at 4 kn, all of it at 15 kn; L_pp of 220 m assumed.
    L, knot = 220.0, 0.514444
    F_4, F_15 = (s * knot / math.sqrt(9.80665 * L) for s in (4.0, 15.0))
    a_1 = -0.5 / (F_4 * (1 - F_4 / F_15))
    part = Tunnel(x=95.0, D=2.0, T_0=150e3, n_0=4.0, loss_form="froude", a_N1=a_1, a_N2=-a_1 / F_15)
    speeds = [s * knot for s in (0.0, 4.0, 8.0, 15.0)]
    moments = [part.force(Flow(u, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1025.0, L, 12.0), (4.0,)).N for u in speeds]
    assert np.array(moments) / moments[0] == pytest.approx([1.0, 0.5, 0.355, 1.0], abs=0.01)
    strong = Tunnel(x=2.5, D=0.05, K_T=0.3, loss_form="froude", a_Y1=-10.0, a_N1=-10.0)
    assert strong.force(at(2.0), (20.0,)) == (0.0, 0.0, 0.0)  # never turned round


@pytest.mark.parametrize("form", ["jet", "froude"])
def test_loss_needs_its_numbers(form: str) -> None:
    with pytest.raises(ParameterError, match=f"loss_form {form} needs"):
        Tunnel(**TUNNEL, loss_form=form)


@pytest.mark.parametrize("given", [{}, {"K_T": 0.3, "T_0": 5.0}])
def test_tunnel_needs_one_thrust(given: dict[str, Any]) -> None:
    with pytest.raises(ParameterError, match="K_T"):
        Tunnel(x=1.0, D=0.1, **given)


def test_direct_forces() -> None:
    assert Direct().force(at(), (1.0, 2.0, 3.0)) == (1.0, 2.0, 3.0)
    assert [name for name, _ in Direct().follows] == ["", "", ""]
    assert Direct(X_per_n=0.2, N_per_delta=2.5).follows == (("n_P", 0.2), ("", 0.0), ("delta", 2.5))
