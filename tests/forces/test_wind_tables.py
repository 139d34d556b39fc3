"""Isherwood's and Blendermann's wind forces: printed tables, signs, continuity, agreement with one another."""

from __future__ import annotations

import itertools
import math
from typing import Any

import casadi as ca
import numpy as np
import pytest

from seatrial.core.parameters import ParameterError
from seatrial.forces import Flow
from seatrial.forces.wind_blendermann import Blendermann, blendermann1994
from seatrial.forces.wind_isherwood import Isherwood, isherwood1972
from seatrial.ships.files import load

SHAPE = {"A_T": 1000.0, "A_L": 4000.0, "L_OA": 200.0, "B": 30.0, "S": 260.0, "C": 96.0, "M": 2.0, "A_SS": 1200.0}
ISHERWOOD = Isherwood(rho_air=1.225, **SHAPE)
BLENDERMANN = Blendermann(
    rho_air=1.225, A_T=1000.0, A_L=4000.0, L_OA=200.0, s_L=4.0, **blendermann1994("Container ship, loaded")
)
both = pytest.mark.parametrize("module", [ISHERWOOD, BLENDERMANN], ids=["isherwood", "blendermann"])


def wind(u_A: Any, v_A: Any) -> Flow:
    return Flow(0.0, 0.0, 0.0, 0.0, 0.0, u_A, v_A, 1025.0, 190.0, 10.0)


def blow(module: Any, gamma: float, U: float = 10.0) -> tuple[float, float, float]:
    """(C_X, C_Y, C_N) at an angle off the bow [rad], forces over pressure, areas and length over all."""
    force = module.force(wind(U * math.cos(gamma), U * math.sin(gamma)))
    q = 0.5 * 1.225 * U * U
    return force.X / (q * 1000.0), force.Y / (q * 4000.0), force.N / (q * 4000.0 * 200.0)


def test_isherwood_rows_by_hand() -> None:
    rows = {row.gamma: row for row in isherwood1972(**SHAPE)}
    # 2 A_L/L^2 = 0.2, 2 A_T/B^2 = 2.2222, L/B = 6.6667, S/L = 1.3, C/L = 0.48, M = 2, A_SS/A_L = 0.3
    r, b = 2000 / 900, 200 / 30
    found = (rows[0].C_X, rows[60].C_X, rows[120].C_Y, rows[140].C_N, rows[170].C_X)
    by_hand = (
        -(2.152 - 5 * 0.2 + 0.243 * r - 0.164 * b),
        -(0.913 - 4.68 * 0.2 - 0.104 * b + 0.482 * 1.3 + 0.052 * 2),
        0.996 + 0.184 * r - 0.212 * 1.3 - 0.66 * 0.48 + 0.34 * 0.3,
        0.0256 - 0.0422 * r + 0.01 * b + 0.0889 * 1.3 - 0.463 * 0.48,
        -(-2.707 + 3.97 * 0.2 - 0.175 * r + 0.126 * b + 1.81 * 0.48),
    )
    assert found == pytest.approx(by_hand)


def test_isherwood_is_exact_at_the_printed_angles_and_straight_between() -> None:
    rows = isherwood1972(**SHAPE)
    for row in rows:
        printed = (row.C_X, -row.C_Y, -row.C_N)  # wind from starboard pushes to port
        assert blow(ISHERWOOD, math.radians(row.gamma)) == pytest.approx(printed, abs=1e-9)
    for low, high in itertools.pairwise(rows):
        middle = (0.5 * (low.C_X + high.C_X), -0.5 * (low.C_Y + high.C_Y), -0.5 * (low.C_N + high.C_N))
        assert blow(ISHERWOOD, math.radians(low.gamma + 5)) == pytest.approx(middle, abs=1e-9)


def test_blendermann_by_hand() -> None:
    g, ratio = math.radians(30), 0.55 * 1000 / 4000 / 0.9
    loading = 1 - 0.5 * 0.4 * (1 - ratio) * math.sin(2 * g) ** 2
    C_Y = 0.9 * math.sin(g) / loading
    expected = (-0.55 * math.cos(g) / loading, -C_Y, -(4 / 200 - 0.18 * (g - math.pi / 2)) * C_Y)
    assert blow(BLENDERMANN, g) == pytest.approx(expected, rel=1e-9)


def test_blendermann_knows_seventeen_types_and_names_near_ones() -> None:
    assert blendermann1994("Tanker, in ballast") == {"C_Dt": 0.7, "C_Dl_bow": 0.75, "C_Dl_stern": 0.55, "delta": 0.4}
    assert blendermann1994("drilling vessel")["C_Dl_stern"] == 0.925
    with pytest.raises(ParameterError, match="tanker, loaded") as caught:
        blendermann1994("tanker")
    assert "\n" not in str(caught.value)


@both
def test_head_wind_pushes_astern_and_beam_wind_to_leeward(module: Any) -> None:
    assert blow(module, 0.0)[0] < -0.3
    assert blow(module, math.pi)[0] > 0.3
    assert blow(module, math.pi / 2)[1] < -0.5
    assert blow(module, -math.pi / 2)[1] > 0.5


@both
def test_the_side_force_acts_at_the_end_that_faces_the_wind(module: Any) -> None:
    for gamma, sign in ((math.radians(30), 1.0), (math.radians(150), -1.0)):
        _, C_Y, C_N = blow(module, gamma)
        assert sign * C_N / C_Y > 0.02


@pytest.mark.slow
@both
def test_continuous_round_the_ship_and_mirrored(module: Any) -> None:
    angles = np.linspace(-math.pi, math.pi, 1441)  # over bow, beam and stern, quarter degrees
    found = np.array([blow(module, float(g)) for g in angles])
    assert np.abs(np.diff(found, axis=0)).max() < 0.02
    assert found[::-1] * (1, -1, -1) == pytest.approx(found, abs=1e-9)


@both
def test_silent_in_a_calm_finite_and_equal_on_symbols(module: Any) -> None:
    assert all(abs(y) == 0 for y in module.force(wind(0.0, 0.0)))
    x = ca.SX.sym("x", 2)
    y = ca.vertcat(*(ca.SX(e) for e in module.force(wind(x[0], x[1]))))
    f, j = ca.Function("f", [x], [y]), ca.Function("j", [x], [ca.jacobian(y, x)])
    for point in [(u, v) for u in (0.0, 8.0, -8.0, 1e-9) for v in (0.0, 5.0, -5.0, 1e-9)]:
        direct = np.array(module.force(wind(*point)))
        assert np.array(f(point)).ravel() == pytest.approx(direct, rel=1e-12, abs=1e-9)
        assert np.isfinite(np.array(ca.DM(j(point)).full())).all()


def test_three_methods_agree_on_a_tanker() -> None:
    """Fujiwara, Isherwood and Blendermann on the 3 m Esso Osaka: nowhere apart by half of the largest force."""
    osaka: Any = load("esso_osaka_3m").model
    shape = {"A_T": 0.13544, "A_L": 0.52038, "L_OA": 3.17}
    others = (
        Isherwood(rho_air=1.225, B=0.48925, S=3.76, C=1.6, A_SS=0.1423, **shape),
        Blendermann(rho_air=1.225, s_L=-0.013, **shape, **blendermann1994("tanker, loaded")),
    )
    angles = [math.radians(10.0 * i) for i in range(19)]
    reference = np.array([osaka.wind.force(wind(3 * math.cos(g), 3 * math.sin(g))) for g in angles])
    for module in others:
        found = np.array([module.force(wind(3 * math.cos(g), 3 * math.sin(g))) for g in angles])
        assert (np.abs(found - reference).max(axis=0) < 0.5 * np.abs(reference).max(axis=0)).all()
