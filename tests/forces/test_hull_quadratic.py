"""The hull with |.| in place of third powers: the printed form, and what it does beyond it."""

from __future__ import annotations

import math

import pytest

from seatrial.forces import Flow
from seatrial.forces.hull_quadratic import QuadraticDrift

C = {
    "R_0": 0.025, "X_bb": -0.01, "X_br": -0.05, "X_rr": 0.07, "X_bbbb": 0.06, "Y_b": 0.36, "Y_r": 0.1, "Y_bb": 0.59,
    "Y_rr": 0.02, "Y_bbr": -0.34, "Y_brr": 0.21, "N_b": 0.09, "N_r": -0.04, "N_bb": 0.03, "N_rr": -0.01,
    "N_bbr": -0.13, "N_brr": -0.05,
}  # fmt: skip
HULL, L, D, RHO = QuadraticDrift(**C), 100.0, 4.0, 1000.0


def force(u: float, v: float, r: float) -> tuple[float, float, float]:
    return tuple(HULL.force(Flow(u, v, r, n_P=0.0, delta=0.0, u_A=0.0, v_A=0.0, rho=RHO, L_pp=L, d=D)))


@pytest.mark.parametrize(("drift", "rate"), [(0.0, 0.0), (0.2, 0.4), (-0.15, 0.7), (0.3, -0.9), (-0.1, -0.2)])
def test_it_is_the_printed_form(drift: float, rate: float) -> None:
    U, b, r = 4.0, drift, rate
    X = -C["R_0"] + C["X_bb"] * b**2 + C["X_br"] * b * r + C["X_rr"] * r**2 + C["X_bbbb"] * b**4
    Y, N = (
        C[f"{k}_b"] * b + C[f"{k}_r"] * r + C[f"{k}_bb"] * b * abs(b) + C[f"{k}_rr"] * r * abs(r)
        + (C[f"{k}_bbr"] * b + C[f"{k}_brr"] * r) * b * r
        for k in "YN"
    )  # fmt: skip
    unit = 0.5 * RHO * L * D * U**2
    wanted = (unit * X, unit * Y, unit * L * N)
    assert force(U * math.cos(b), -U * math.sin(b), r * U / L) == pytest.approx(wanted, rel=1e-9)


def test_at_rest_and_on_the_spot_it_stays_finite_and_continuous() -> None:
    assert force(0.0, 0.0, 0.0) == (0.0, 0.0, 0.0)
    still, creeping = force(0.0, 0.0, 0.02), force(0.0, 1e-9, 0.02)
    assert creeping == pytest.approx(still, rel=1e-3)  # no jump in what the angle of a rest is
    assert still[2] < 0.0  # a turn on the spot is damped


def test_astern_the_resistance_turns_round() -> None:
    assert force(-2.0, 0.0, 0.0)[0] == pytest.approx(-force(2.0, 0.0, 0.0)[0])
    assert force(-2.0, 0.3, 0.0)[1] == pytest.approx(force(2.0, 0.3, 0.0)[1])
