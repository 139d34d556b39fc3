"""A passing ship beside quadrature of the theory: where it fades, how small and how near the other ship may be."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.forces import Flow
from seatrial.forces.passing import Passing

RHO, A_1, A_2 = 1025.0, 120.0, 70.0


def theory(L_1: float, L_2: float, U_1: float, U_2: float, xi: float, eta: float) -> tuple[float, float, float]:
    """X, Y, N in deep water by quadrature of the integrals over both ships."""
    x, w = np.polynomial.legendre.leggauss(80)
    a, b = 0.5 * L_1 * x[:, None], 0.5 * L_2 * x[None]
    weight = 0.25 * L_1 * L_2 * w[:, None] * w[None]
    slope_1, slope_2 = -8.0 * A_1 / L_1**2 * a, -8.0 * A_2 / L_2**2 * b
    section = A_1 * (1.0 - 4.0 * a * a / L_1**2)
    s = b + xi - a
    r3 = (s * s + eta * eta) ** 1.5
    aside, ahead = U_2 * eta * slope_2 / r3 / math.tau, U_2 * slope_2 * s / r3 / math.tau
    lead = 2.0 * U_2 - U_1
    return (RHO * U_2 * float((weight * slope_1 * ahead).sum()), RHO * lead * float((weight * slope_1 * aside).sum()),
            RHO * float((weight * (lead * a * slope_1 + 2.0 * U_2 * section) * aside).sum()))  # fmt: skip


def forces(L_2: float, xi: float, eta: float, U_2: float = 3.0, **more: float) -> tuple[float, ...]:
    flow = Flow(1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, RHO, 100.0, 6.0, xi=xi, eta=eta, U_2=U_2, L_2=L_2, A_2=A_2)
    return tuple(Passing(A_M=A_1, B=18.0, **more).force(flow))


@pytest.mark.parametrize(("xi", "eta", "U_2"), [(0.0, 40.0, 3.0), (30.0, -25.0, 3.0), (-90.0, 60.0, -4.0)])
def test_it_is_the_theory_near_by(xi: float, eta: float, U_2: float) -> None:
    assert forces(60.0, xi, eta, U_2) == pytest.approx(theory(100.0, 60.0, 1.5, U_2, xi, eta), rel=1e-7, abs=1e-6)
    twice = forces(60.0, xi, eta, U_2, c_passing=2.0)
    assert twice == pytest.approx(tuple(2.0 * one for one in forces(60.0, xi, eta, U_2)))


@pytest.mark.parametrize(("share", "left"), [(0.49, 1.0), (0.75, 0.5), (0.875, 0.15625), (1.0, 0.0)])
def test_it_fades_over_the_outer_half_of_eight_mean_lengths(share: float, left: float) -> None:
    """By the cubic without slope at its ends; ships of 100 and 60 m are 80 m long in the mean."""
    for xi, eta in ((share * 640.0, 30.0), (-share * 640.0, 30.0)):
        wanted = [left * one for one in theory(100.0, 60.0, 1.5, 3.0, xi, eta)]
        assert forces(60.0, xi, eta) == pytest.approx(wanted, rel=2e-4, abs=1e-9)
    for eta in (share * 640.0, -share * 640.0):
        wanted = [left * one for one in theory(100.0, 60.0, 1.5, 3.0, 20.0, eta)]
        assert forces(60.0, 20.0, eta) == pytest.approx(wanted, rel=2e-3, abs=1e-9)


def test_a_boat_is_a_quarter_as_long_as_the_ship_and_no_nearer_than_its_breadth() -> None:
    assert forces(10.0, 15.0, 30.0) == pytest.approx(theory(100.0, 25.0, 1.5, 3.0, 15.0, 30.0), rel=1e-7)
    assert forces(26.0, 15.0, 30.0) == pytest.approx(theory(100.0, 26.0, 1.5, 3.0, 15.0, 30.0), rel=1e-7)
    for eta, taken in ((5.0, 18.0), (-5.0, -18.0), (17.9, 18.0), (18.1, 18.1)):
        assert forces(60.0, 15.0, eta) == pytest.approx(theory(100.0, 60.0, 1.5, 3.0, 15.0, taken), rel=1e-6)
