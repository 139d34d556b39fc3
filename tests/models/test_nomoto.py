"""Nomoto, first and second order, Norrbin: primes, the route from derivatives, step answers, unstable ships."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import ParameterError, Terms
from seatrial.environment import CALM, Environment
from seatrial.models.nomoto import Nomoto, NomotoTable, from_prime, to_prime
from seatrial.models.nomoto2 import Derivatives, Nomoto2, SecondOrder, time_constants
from seatrial.ships.files import load


def run(model: Any, delta: Any, duration: float, dt: float = 0.05, u: float | None = None) -> np.ndarray:
    """Yaw rate of an RK4 run under delta(t)."""
    x = (0.0, 0.0, 0.0, model.U if u is None else u, *([0.0] * (len(model.states) - 4)))
    out = []

    def f(t: float, y: tuple[float, ...]) -> tuple[float, ...]:
        return model.derivative(y, (0.0, delta(t)), CALM)

    for k in range(round(duration / dt)):
        t = k * dt
        out.append(x[5])
        a = f(t, x)
        b = f(t + dt / 2, tuple(p + dt / 2 * q for p, q in zip(x, a, strict=True)))
        c = f(t + dt / 2, tuple(p + dt / 2 * q for p, q in zip(x, b, strict=True)))
        d = f(t + dt, tuple(p + dt * q for p, q in zip(x, c, strict=True)))
        x = tuple(p + dt / 6 * (q + 2 * r + 2 * s + w) for p, q, r, s, w in zip(x, a, b, c, d, strict=True))
    return np.array([*out, x[5]])


def test_primes_of_the_mariner() -> None:
    K, T = to_prime(0.185, 107.3, 160.93, 7.7175)
    assert (round(K, 2), round(T, 2)) == (3.86, 5.15)
    assert from_prime(K, T, 160.93, 7.7175) == pytest.approx((0.185, 107.3), rel=1e-14)
    second = SecondOrder(0.185, 118.0, 7.8, 18.5)
    assert second.to_prime(160.93, 7.7175).from_prime(160.93, 7.7175) == pytest.approx(second, rel=1e-14)
    assert abs(second.T - 107.3) < 1e-12
    assert abs(SecondOrder(-0.019, -124.1, 16.4, 46.0).T + 153.7) < 1e-12


def test_constants_from_derivatives_solve_the_equations_they_come_from() -> None:
    c = Derivatives(0.25, 0.4, 0.02, 0.3, 0.07, 0.05, 0.1, 0.07, 0.025)
    L, U = 100.0, 8.0
    found = c.second_order(L, U)
    assert c.stability > 0
    # Eq. 4 with all rates zero gives K; with exp(p t) its determinant gives the time constants.
    steady = np.array([[c.C_Y_beta, -(c.m_x - c.C_Y_r) * L / U], [-c.C_N_beta, c.C_N_r * L / U]])
    assert np.linalg.solve(steady, [c.C_Y_delta, c.C_N_delta])[1] == pytest.approx(found.K, rel=1e-12)
    mass = np.diag([c.m_y * L / U, c.n * (L / U) ** 2])
    roots = np.linalg.eigvals(-np.linalg.solve(mass, steady))
    assert sorted(-1.0 / roots) == pytest.approx(sorted(found[1:3]), rel=1e-12)
    # the initial answer to a step of the rudder is K T3 / (T1 T2)
    assert c.C_N_delta / mass[1, 1] == pytest.approx(found.K * found.T_3 / (found.T_1 * found.T_2), rel=1e-12)


def test_derivatives_that_give_no_model_are_refused() -> None:
    neutral = Derivatives(0.2, 0.4, 0.02, 0.3, 0.0, 0.05, 0.1, 0.2 / 3, 0.025)
    with pytest.raises(ParameterError, match="no finite K"):
        neutral._replace(C_N_beta=0.0, C_N_r=0.0).second_order(100.0, 8.0)
    with pytest.raises(ParameterError, match="oscillates"):
        time_constants(1.0, 10.0)
    unstable = neutral._replace(C_N_r=0.03).second_order(100.0, 8.0)
    assert unstable.K < 0 > unstable.T_1
    assert unstable.T_2 > 0


def test_second_order_answers_a_step_as_its_closed_form() -> None:
    model: Any = load("mariner_nomoto2").model
    K, T1, T2, T3 = model.constants
    r = run(model, lambda t: 0.05, 100.0)
    t = np.arange(r.size) * 0.05
    closed = K * 0.05 * (1 - (T1 - T3) / (T1 - T2) * np.exp(-t / T1) + (T2 - T3) / (T1 - T2) * np.exp(-t / T2))
    np.testing.assert_allclose(r, closed, atol=1e-9)


def test_second_order_obeys_its_differential_equation_under_a_moving_rudder() -> None:
    model: Any = load("mariner_nomoto2").model
    K, T1, T2, T3 = model.constants
    dt, w = 0.05, 0.15
    r = run(model, lambda t: 0.1 * math.sin(w * t), 60.0, dt)
    t = (np.arange(r.size) * dt)[1:-1]
    slope, bend = (r[2:] - r[:-2]) / (2 * dt), (r[2:] - 2 * r[1:-1] + r[:-2]) / dt**2
    left = T1 * T2 * bend + (T1 + T2) * slope + r[1:-1]
    right = K * 0.1 * (np.sin(w * t) + T3 * w * np.cos(w * t))
    np.testing.assert_allclose(left, right, atol=2e-6)


@pytest.mark.parametrize("name", ["mariner_nomoto", "mariner_nomoto2"])
def test_speed_keeps_the_primes(name: str) -> None:
    model: Any = load(name).model
    slow = run(model, lambda t: 0.05, 120.0, 0.1, u=0.5 * model.U)
    full = run(model, lambda t: 0.05, 60.0, 0.05)
    np.testing.assert_allclose(slow, 0.5 * full, rtol=1e-9, atol=1e-15)


@pytest.mark.slow
def test_unstable_ship_settles_on_its_loop_and_both_signs_say_the_same() -> None:
    model: Any = load("tanker_nomoto").model
    turned = Nomoto(K=-model.K, T=-model.T, U=model.U, alpha=-model.alpha)
    for m in (model, turned):
        r = run(m, lambda t: 0.01 if t < 10 else 0.0, 3000.0, 1.0)
        assert r[-1] == pytest.approx(1 / math.sqrt(model.alpha), rel=1e-4)
    assert r[-1] * load("tanker_nomoto").L_pp / model.U == pytest.approx(0.30, abs=0.005)
    second: Any = load("tanker_nomoto2").model
    assert abs(second.constants.T + model.T) < 1e-12
    assert run(second, lambda t: 0.01 if t < 10 else 0.0, 3000.0, 1.0)[-1] == pytest.approx(r[-1], rel=1e-3)


def test_residual_rudder_is_rudder() -> None:
    for cls, times in ((Nomoto, {"T": 20.0}), (Nomoto2, {"T_1": 20.0, "T_2": 3.0, "T_3": 5.0})):
        plain, biased = cls(K=0.1, U=5.0, **times), cls(K=0.1, U=5.0, delta_r=0.02, **times)
        np.testing.assert_allclose(run(plain, lambda t: 0.05, 30.0), run(biased, lambda t: 0.03, 30.0), rtol=1e-12)


def test_second_order_rests_on_a_straight_run_and_drifts_with_a_current() -> None:
    model: Any = load("mariner_nomoto2").model
    assert model.derivative((0.0, 0.0, 0.3, 7.0, 0.0, 0.0, 0.0), (0.0, 0.0), CALM)[3:] == (0.0,) * 4
    moving = model.derivative((0.0, 0.0, 0.0, 7.5, 0.4, 0.01, 1e-4), (0.0, 0.1), Environment(0, 0, 0.5, 0.4))
    still = model.derivative((0.0, 0.0, 0.0, 7.0, 0.0, 0.01, 1e-4), (0.0, 0.1), CALM)
    assert moving[5:] == pytest.approx(still[5:], rel=1e-13)
    assert moving[3:5] == pytest.approx((0.01 * 0.4, -0.01 * 0.5))


def test_table_over_speed_gives_its_rows_and_the_straight_line_between() -> None:
    model: Any = load("zeefakkel_speeds").model
    rows = ((2, 0.15, 33), (2.6, 0.19, 33), (3.6, 0.29, 33), (4, 0.37, 33), (5, 0.5, 31), (6.2, 0.83, 43))
    for U, K, T in rows:
        assert model.at(float(U)) == pytest.approx((K, T), rel=1e-14)
    assert model.at(4.5) == pytest.approx((0.435, 32.0))
    assert model.at(1.0) == pytest.approx((0.15, 33.0))
    assert model.at(9.0) == pytest.approx((0.83, 43.0))
    single: Any = load("zeefakkel").model
    x, c = (0.0, 0.0, 0.2, 5.0, 0.0, 0.02), (0.0, 0.3)
    assert model.derivative(x, c, CALM) == pytest.approx(single.derivative(x, c, CALM), rel=1e-14)
    assert model.derivative((0.0,) * 6, c, CALM) == (0.0,) * 6


def test_table_needs_one_list_of_rising_speeds() -> None:
    two = Terms(("a", "b"), (1.0, 2.0))
    with pytest.raises(ParameterError, match="same speeds"):
        NomotoTable(speed=two, K=two, T=Terms(("a",), (1.0,)))
    with pytest.raises(ParameterError, match="rise"):
        NomotoTable(speed=Terms(("a", "b"), (2.0, 1.0)), K=two, T=two)


@pytest.mark.parametrize(("name", "U"), [("zeefakkel", 5.0), *(("zeefakkel_speeds", U) for U in (2.0, 3.6, 5.0, 6.2))])
def test_zeefakkel_turns_as_ships_do(name: str, U: float) -> None:
    """At 30 deg between 2 and 6 lengths, far tighter per degree at 5 deg: the cubic term is what bounds the circle."""
    model: Any = load(name).model
    diameters = []
    for rudder in (5.0, 30.0):
        x = (0.0, 0.0, 0.0, U, 0.0, 0.0)
        for _ in range(600):
            rate = model.derivative(x, (0.0, math.radians(rudder)), CALM)
            x = tuple(a + 0.5 * b for a, b in zip(x, rate, strict=True))
        diameters.append(2.0 * U / x[5] / 45.0)
    assert 2.0 < diameters[1] < 6.0
    assert diameters[1] > 1.5 * diameters[0] * 5.0 / 30.0, "linear, it would be a sixth"


@pytest.mark.parametrize(
    ("U", "K", "T", "n_3"), [(6.0, 0.08, 20.0, 0.4), (9.0, 0.18, 27.0, 0.6), (12.0, 0.23, 21.0, 0.3)]
)
def test_the_frigate_of_the_same_thesis_circles_as_ships_do_with_n_3_per_square_degree(
    U: float, K: float, T: float, n_3: float
) -> None:
    """A frigate of 100 m, as coded in MSS frigate.m: the unit of n_3 decides between 5 lengths and 2."""
    per_square = {"deg": n_3 * math.degrees(1.0) ** 2, "rad": n_3}
    rates = {unit: run(Nomoto(K=K, T=T, U=U, alpha=alpha), lambda t: math.radians(30.0), 300.0, 0.2)[-1]
             for unit, alpha in per_square.items()}  # fmt: skip
    diameter = {unit: 2.0 * U / r / 100.0 for unit, r in rates.items()}
    assert 4.5 < diameter["deg"] < 6.0
    assert diameter["rad"] < 3.0
    assert per_square["rad"] * rates["rad"] ** 2 < 0.01, "a term that no trial could show"
