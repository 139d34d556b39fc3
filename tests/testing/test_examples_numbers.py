"""The forces of the suite's examples, by the formulas of their kinds and numbers that are written here."""

from __future__ import annotations

import math
from typing import Any

import pytest

from seatrial.forces import Flow
from seatrial.testing import ships
from seatrial.testing.examples import MODULES


def flow(**given: float) -> Flow:
    usual = dict.fromkeys(Flow._fields, 0.0) | {"rho": 1000.0, "L_pp": 7.0, "d": 0.46}
    return Flow(**usual | given)


def example(kind: str, which: int = 0) -> Any:
    return [one for one in MODULES if type(one).__name__ == kind][which]


def test_tunnels_push_by_their_coefficient_and_place() -> None:
    T = 1000.0 * 20.0**2 * 0.06**4 * 0.3
    X, Y, N = example("Tunnel").force(flow(), (20.0,))
    assert pytest.approx((0.0, T, 2.5 * T)) == (X, Y, N)
    jet = example("Tunnel", 1)
    assert tuple(jet.force(flow(), (20.0,)))[1:] == pytest.approx((T, 2.5 * T))
    assert jet.force(flow(), (-20.0,))[1] == pytest.approx(-0.9 * T)
    assert (jet.c_Y, jet.c_N) == (4.0, 7.0)
    bare = example("Tunnel", 2)
    assert (bare.T_0, bare.n_0, bare.a_Y1, bare.a_Y2, bare.a_N1, bare.a_N2) == (4.0, 20.0, -4.0, 5.0, -6.0, 9.0)
    assert tuple(bare.force(flow(), (20.0,)))[1:] == pytest.approx((4.0, 10.0))


def test_fixed_thrusters_push_at_their_place() -> None:
    X, Y, N = example("Fixed").force(flow(), (0.5,))
    T = 2.0 * 0.5 + 3.0 * 0.25
    assert pytest.approx((T, -0.3 * T)) == (X, N)
    assert Y == 0.0
    assert example("Fixed").force(flow(), (-0.5,))[0] == pytest.approx(-0.6 * T)
    X, Y, N = example("ThrustAzimuth").force(flow(), (10.0, 0.5))
    assert pytest.approx((10.0 * math.cos(0.5), 10.0 * math.sin(0.5))) == (X, Y)
    assert pytest.approx(-3.3 * Y - 0.3 * X) == N


def test_a_drag_is_what_its_derivatives_say() -> None:
    drag = example("CrossFlowDrag")
    X, Y, N = drag.force(flow(u=0.5))
    assert pytest.approx((-4.0 * 0.5 - 20.0 * 0.25, 0.0, 0.0)) == (X, Y, N)
    small = 1e-6
    assert drag.force(flow(v_m=small))[1] == pytest.approx(-60.0 * small, rel=1e-3)
    assert drag.force(flow(v_m=small))[2] == pytest.approx(-20.0 * small, rel=1e-3)
    assert drag.force(flow(r=small))[1] == pytest.approx(5.0 * small, rel=1e-3)
    assert drag.force(flow(r=small))[2] == pytest.approx(-150.0 * small, rel=1e-3)
    # the drag of a plate of length by draught besides
    assert drag.force(flow(v_m=1.0))[1] == pytest.approx(-60.0 - 0.5 * 1000.0 * 0.9 * 7.0 * 0.46, rel=0.02)


def test_numbers_of_the_others_are_those_of_a_seven_metre_ship() -> None:
    """Of wind, waves, banks, quays and tugs: breadth, areas and places that the 7 m ship has."""
    for name, numbers in {
        "Isherwood": {"rho_air": 1.225, "A_T": 0.4, "A_L": 1.0, "L_OA": 7.3, "B": 1.27, "S": 9.0, "C": 3.8, "M": 2.0,
                      "A_SS": 0.3},
        "Blendermann": {"rho_air": 1.225, "A_T": 0.4, "A_L": 1.0, "L_OA": 7.3, "s_L": -0.1},
        "HeadSea": {"B": 1.27, "L_BWL": 1.0}, "Bank": {"A_M": 0.58, "c_bank": 1.2, "x_bank": -0.2},
        "Passing": {"A_M": 0.58, "B": 1.27}, "Cushion": {"B": 1.27, "k_c": 0.7},
        "QuayTunnel": {"x": 2.5, "D": 0.06, "K_T": 0.3, "B": 1.27, "k_q": 0.4, "l_q": 2.0},
        "PushTug": {"x": 2.0, "y": 0.6, "f_max": 150.0, "pulls": 0.9},
        "LineTug": {"x": -3.0, "y": 0.2, "f_max": 150.0, "rise": 0.2}, "DredgedAnchor": {"H": 20.0, "x": 3.2},
        "Azimuth": {"x": -3.3, "y": 0.3, "c_0": 0.1, "c_1": 0.5, "c_2": 1.2, "T_nu": 0.9, "t": 0.1, "astern": 0.7},
        "OffCentre": {"delta_0": 0.02}, "ShallowPolynomial": {"B": 1.27, "C_b": 0.81},
    }.items():  # fmt: skip
        one = example(name)
        assert {key: getattr(one, key) for key in numbers} == numbers, name
    quays = [vars(one) for one in MODULES if type(one).__name__ == "QuayTunnel"]
    assert [(one["B"], one["k_q"], one["l_q"]) for one in quays] == 3 * [(1.27, 0.4, 2.0)]
    assert (quays[1]["T_0"], quays[1]["n_0"], quays[1]["a_Y1"], quays[1]["a_N1"]) == (4.0, 20.0, -4.0, -6.0)
    assert (quays[2]["c_Y"], quays[2]["c_N"], quays[2]["to_port"]) == (4.0, 7.0, 0.9)


def test_rolling_examples_come_upright_and_their_masses_are_positive() -> None:
    """GM over BM, periods of roll, heave and pitch of a ship of 7 m, and mass matrices that are positive definite."""
    for name in ("rolling", "unified"):
        model: Any = ships()[name].model
        roll = model.roll
        period = 2 * math.pi * math.sqrt((roll.I_x + roll.J_x) / (model.body.m * 9.81 * roll.GM))
        assert period == pytest.approx(2 * math.pi * math.sqrt(650.0 / (3270.0 * 9.81 * 0.12)))
        assert (roll.BM, roll.B_1, roll.B_2, roll.B_U) == (0.29, 60.0, 120.0, 30.0)
        assert (roll.z_H, roll.z_R, roll.z_T, roll.z_W, roll.l_x, roll.l_y) == (0.1, 0.2, 0.1, -0.4, 0.05, 0.1)
    heel = vars(ships()["rolling"].model)["heel"]
    assert {abs(value) for value in vars(heel).values()} == {0.01, 0.05, 0.1}
    heave = vars(ships()["unified"].model)["heave"]
    m = 3270.0
    assert (m + heave.A_33) * (heave.I_y + heave.A_55) > heave.A_35**2
    assert heave.C_33 * heave.C_55 > heave.C_35**2
    assert 2 * math.pi * math.sqrt((m + heave.A_33) / heave.C_33) == pytest.approx(1.82, rel=0.01)
    assert 2 * math.pi * math.sqrt((heave.I_y + heave.A_55) / heave.C_55) == pytest.approx(1.83, rel=0.01)
    assert {key: getattr(heave, key) for key in ("A_13", "A_15", "A_35", "A_26", "A_46", "C_35", "B_33", "B_55")} == {
        "A_13": 5.0, "A_15": 20.0, "A_35": -100.0, "A_26": 60.0, "A_46": -10.0, "C_35": -2000.0, "B_33": 50.0,
        "B_55": 100.0}  # fmt: skip
    unified: Any = ships()["unified"].model
    along, across = (dict(part.items())["m1"] for part in (unified.longitudinal, unified.transverse))
    assert (along.a, along.w, across.a, across.w) == (0.6, 3.0, 0.7, 3.5)
    assert [getattr(along, f"d_{k}") for k in (11, 13, 15, 33, 35, 55)] == [120.0, 5.0, -10.0, 9000.0, 200.0, 20000.0]
    assert [getattr(across, f"d_{k}") for k in (22, 24, 26, 44, 46, 66)] == [4000.0, -60.0, 90.0, 100.0, 5.0, 6000.0]


def test_ships_of_matrices_are_symmetric_and_heavier_than_the_water_they_carry() -> None:
    for name in ("matrices", "quayside"):
        model: Any = ships()[name].model
        M = model.inertia
        assert (M.m_11, M.m_22, M.m_33, M.m_23, M.m_32) == (3330.0, 5800.0, 12000.0, 800.0, 800.0)
        assert (model.body.rho, model.body.L_pp, model.body.B, model.body.d) == (1000.0, 7.0, 1.27, 0.46)
    quay = vars(ships()["quayside"].model)["quay"]
    assert (quay.north, quay.east, quay.direction, quay.reach, quay.mu, quay.flat, quay.half) == (
        0.0, -5.0, 0.1, 5.0, 0.1, 2.5, 0.3)  # fmt: skip
    hybrid: Any = ships()["hybrid"].model
    assert (hybrid.drift_along, hybrid.drift_across) == (0.006, -0.002)
    assert ships()["network"].model.learned.layers == (12, 8)  # type: ignore[union-attr]
