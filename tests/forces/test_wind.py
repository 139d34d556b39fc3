"""Fujiwara's wind forces: published coefficients, signs and the series over the angle."""

from __future__ import annotations

import math

import pytest

from seatrial.forces import Flow
from seatrial.forces.wind import fujiwara1998
from seatrial.ships.files import load

WIND = load("esso_osaka_3m").model.wind
# Esso Osaka 3 m: FACTS section 3, from the published regression, printed to four decimals.
PUBLISHED = {
    "X_0": -0.0105, "X_1": -0.8220, "X_3": 0.0603, "X_5": 0.0446, "Y_1": 1.0582, "Y_3": 0.0023,
    "Y_5": -0.0153, "N_1": -0.0307, "N_2": 0.1041, "N_3": -0.0009,
}  # fmt: skip


def blow(gamma_A: float, U_A: float = 3.0) -> tuple[float, float, float]:
    u_A, v_A = U_A * math.cos(gamma_A), U_A * math.sin(gamma_A)
    return WIND.force(Flow(0.0, 0.0, 0.0, 0.0, 0.0, u_A, v_A, 998.0, 3.0, 0.2))


def test_regression_gives_the_published_coefficients() -> None:
    found = fujiwara1998(
        A_T=0.13544,
        A_L=0.52038,
        A_OD=0.1423,
        C=-0.01299,
        C_BR=-0.06209,
        H_BR=0.294,
        H_C=0.10359,
        B=0.48925,
        L=3.0,
    )
    assert found == pytest.approx(PUBLISHED, abs=5e-5)
    assert {key: getattr(WIND, key) for key in found} == pytest.approx(found, rel=1e-12)


def test_head_wind_pushes_astern_and_beam_wind_to_leeward() -> None:
    assert blow(0.0)[0] < 0 < blow(math.pi)[0]
    assert blow(math.pi / 2)[1] < 0 < blow(-math.pi / 2)[1]


@pytest.mark.parametrize("gamma_A", [0.0, 0.7, 1.57, 2.5, 3.1, -0.4, -2.2])
def test_components_give_the_series_over_the_angle(gamma_A: float) -> None:
    p, w = 2 * math.pi - gamma_A, WIND
    q = 0.5 * w.rho_air * 9.0
    X = w.X_0 + w.X_1 * math.cos(p) + w.X_3 * math.cos(3 * p) + w.X_5 * math.cos(5 * p)
    Y = w.Y_1 * math.sin(p) + w.Y_3 * math.sin(3 * p) + w.Y_5 * math.sin(5 * p)
    N = w.N_1 * math.sin(p) + w.N_2 * math.sin(2 * p) + w.N_3 * math.sin(3 * p)
    expected = (q * w.A_T * X, q * w.A_L * Y, q * w.A_L * w.L_wind * N)
    assert blow(gamma_A) == pytest.approx(expected, rel=1e-9, abs=1e-12)
