"""Forces in a harbour against their check figures: squat, banks, passing, cushion, quay thrusters, tugs, anchors."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from seatrial.core.constants import KNOT
from seatrial.forces import Flow
from seatrial.forces.anchor import DredgedAnchor, holding
from seatrial.forces.bank import Bank
from seatrial.forces.body import Body
from seatrial.forces.cushion import Cushion, quay_gap
from seatrial.forces.hull import Polynomial
from seatrial.forces.passing import Passing, shape
from seatrial.forces.shallow import ShallowPolynomial, afloat
from seatrial.forces.squat import FORMS, OPEN, Channel, Hull, ends, sunk, under_keel
from seatrial.forces.thruster import Tunnel
from seatrial.forces.thruster_quay import QuayTunnel
from seatrial.forces.tug import LineTug, PushTug
from seatrial.harbour.energy import ADDED, Berthed, frictionless, gyration
from seatrial.ships.files import load

L, B, D = 320.0, 58.0, 20.8
K = Hull(L, B, D, 312622.0 / (L * B * D))
CANAL = Channel(200.0)

SQUAT = {  # [m] at 4, 8 and 12 kn, h = 25 m, open water
    "icorels": (0.128, 0.524, 1.239), "tuck": (0.093, 0.382, 0.903), "eryuzlu1994": (0.061, 0.300, 0.760),
    "millward1990": (0.103, 0.478, 1.273), "millward1992": (0.148, 0.606, 1.433),
    "barrass_simple": (0.130, 0.518, 1.166),
    "barrass1979": (0.111, 0.467, 1.086), "barrass2004": (0.111, 0.469, 1.091), "barrass_K": (0.128, 0.512, 1.152),
    "roemisch1989": (0.142, 0.490, 1.096), "huuska": (0.128, 0.524, 1.239),
}  # fmt: skip


def water(u: float = 0.0, v_m: float = 0.0, r: float = 0.0, **more: float) -> Flow:
    return Flow(u, v_m, r, 0.0, 0.0, 0.0, 0.0, 1025.0, L, D, **more)


@pytest.mark.parametrize("form", list(FORMS))
def test_squat_has_the_published_figures(form: str) -> None:
    for knots, wanted in zip((4.0, 8.0, 12.0), SQUAT[form], strict=True):
        assert FORMS[form](knots * KNOT, 25.0, K, OPEN) == pytest.approx(wanted, abs=6e-4)


def test_squat_in_a_canal() -> None:
    for knots, row in {6.0: (0.532, 0.523, 0.732), 8.0: (0.967, 0.951, 1.322)}.items():
        for name, wanted in zip(("barrass2004", "barrass1979", "huuska"), row, strict=True):
            assert FORMS[name](knots * KNOT, 25.0, K, CANAL) == pytest.approx(wanted, abs=6e-4)


@pytest.mark.parametrize("form", list(FORMS))
def test_squat_is_silent_at_rest_smooth_and_grows(form: str) -> None:
    assert FORMS[form](0.0, 25.0, K, OPEN) == pytest.approx(0.0, abs=1e-9)
    sizes = [FORMS[form](V, 25.0, K, OPEN) for V in np.linspace(0.5, 8.0, 30)]
    assert (np.diff(sizes) > 0.0).all()
    assert FORMS[form](-4.0, 25.0, K, OPEN) == FORMS[form](4.0, 25.0, K, OPEN)
    V, h = ca.SX.sym("V"), ca.SX.sym("h")
    S = FORMS[form](V, h, K, OPEN)
    slope = ca.Function("S", [V, h], [ca.jacobian(S, ca.vertcat(V, h))])
    for speed in (0.0, 1e-9, 3.0, 30.0):
        assert np.isfinite(slope(speed, 25.0).full()).all()


def test_bow_sinks_first_when_full_and_the_keel_has_less_water() -> None:
    bow, stern = ends(1.0, 0.81)
    assert (bow, stern) == pytest.approx((1.0, 1.0 - 40.0 * 0.11**2))
    assert ends(1.0, 0.6)[1] == 1.0
    assert under_keel(8.0 * KNOT, 25.0, K) == pytest.approx(25.0 - D - 0.524, abs=1e-3)
    assert under_keel(15.0 * KNOT, 22.0, K) < 0.0
    assert sunk(6.0, 0.0, K, "icorels") == 0.0
    assert sunk(0.0, 0.8, K, "icorels") == pytest.approx(0.8)
    assert sunk(5.0, 0.8, K, "icorels") > 0.8


def test_squat_makes_a_shallow_hull_heavier_to_steer_and_leaves_deep_water_alone() -> None:
    hull = load("kvlcc2_shallow").model.part("hull")
    assert isinstance(hull, ShallowPolynomial)
    sunken = replace(hull, squat="icorels")
    fast = water(6.0, 0.3, 0.0, d_over_h=0.7)
    assert abs(sunken.force(fast).Y) > 1.005 * abs(hull.force(fast).Y)
    assert sunken.force(fast._replace(d_over_h=0.0)) == hull.force(fast._replace(d_over_h=0.0))
    assert isinstance(hull, Polynomial)


def passing(L_1: float, A_1: float, L_2: float, A_2: float, speeds: tuple[float, float], xi: float, eta: float,
            h: float, images: int, rho: float = 1025.0) -> tuple[float, float, float]:  # fmt: skip
    """X, Y, N by the theory alone, without the fading of the force module."""
    U_1, U_2 = speeds
    q = shape(L_1, L_2, xi, eta, 1.0 / h, images, 1e9)
    s_1, s_2, lead = -8.0 * A_1 / L_1**2, -8.0 * A_2 / L_2**2, 2.0 * U_2 - U_1
    scale = rho * U_2 / (2.0 * math.pi)
    section = A_1 * (q.second_only - 4.0 / L_1**2 * q.second)
    return (scale * U_2 * s_1 * s_2 * q.along, scale * eta * lead * s_1 * s_2 * q.both,
            scale * eta * s_2 * (lead * s_1 * q.second + 2.0 * U_2 * section))  # fmt: skip


def test_a_ship_passing_a_moored_one_reproduces_the_worksheet_after_wang() -> None:
    """76 440 lbf, in feet, slugs and pounds; the images in the bottom one by one."""
    for images, wanted in {0: 36478.0, 1: 65807.0, 2: 73036.0, 5: 76163.0, 10: 76440.4, 200: 76468.6}.items():
        X, Y, N = passing(950.0, 3192.0, 475.0, 6413.0, (0.0, 11.2), 0.0, 190.0, 95.0, images, 1.9905)
        assert pytest.approx(wanted, abs=0.51 if images < 10 else 0.06) == Y
        assert abs(X) + abs(N) < 1e-6
    module = Passing(A_M=3192.0, B=100.0)
    flow = Flow(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.9905, 950.0, 30.0, d_over_h=30.0 / 95.0, eta=190.0, U_2=11.2,
                L_2=475.0, A_2=6413.0)  # fmt: skip
    assert pytest.approx(76440.0, abs=0.5) == module.force(flow).Y


def test_an_episode_of_passing_has_the_published_figures() -> None:
    """KVLCC2 passes another that is moored, in deep water at 150 m: X, Y [kN] and N [MNm] by distance."""
    known = {-0.5: (-67.8, -17.6, -9.96), -0.25: (-65.3, 146.6, -12.60), 0.0: (0.0, 239.1, 0.0),
             0.25: (65.3, 146.6, 12.60), 0.5: (67.8, -17.6, 9.96), 1.0: (-5.6, -78.9, -3.35)}  # fmt: skip
    A = 0.99 * B * D
    for place, wanted in known.items():
        X, Y, N = passing(L, A, L, A, (0.0, 3.0), place * L, 150.0, 1e9, 0)
        assert pytest.approx(wanted, abs=0.051) == (X / 1e3, Y / 1e3, N / 1e6)


def test_meeting_and_overtaking_have_the_published_figures() -> None:
    """Two of them at 25 m of water and 150 m: abeam, and half a length ahead."""
    known = {(3.0, 3.0): (622.9, (478.0, 8.8, 85.6)), (3.0, 4.0): (1384.3, (849.7, 19.5, 136.6)),
             (4.0, 3.0): (415.3, (478.0, 5.9, 97.3)), (3.0, -3.0): (1868.8, (478.0, 26.4, 15.3))}  # fmt: skip
    A = 0.998 * B * D
    for speeds, (abeam, ahead) in known.items():
        assert passing(L, A, L, A, speeds, 0.0, 150.0, 25.0, 100)[1] / 1e3 == pytest.approx(abeam, abs=0.06)
        X, Y, N = passing(L, A, L, A, speeds, 0.5 * L, 150.0, 25.0, 100)
        assert pytest.approx(ahead, abs=0.06) == (X / 1e3, Y / 1e3, N / 1e6)


def test_the_closed_form_is_the_double_integral() -> None:
    """Against quadrature, with ships of two lengths, off to one side."""
    x, w = np.polynomial.legendre.leggauss(160)
    for L_1, L_2, xi, eta in ((320.0, 180.0, 70.0, 90.0), (100.0, 250.0, -160.0, -60.0)):
        a, b = 0.5 * L_1 * x[:, None], 0.5 * L_2 * x[None]
        s = b + xi - a
        r3, weight = (s * s + eta * eta) ** -1.5, 0.25 * L_1 * L_2 * w[:, None] * w[None]
        wanted = [(weight * f * r3).sum() for f in (a * b, a * a * b, b + 0.0 * a, a * b * s)]
        assert shape(L_1, L_2, xi, eta, 0.0) == pytest.approx(wanted, rel=1e-9)


def test_passing_is_silent_far_away_and_without_a_ship() -> None:
    module = Passing(A_M=1200.0, B=B)
    there = water(3.0, eta=150.0, xi=50.0, U_2=3.0, L_2=L, A_2=1200.0)
    near = module.force(there).Y
    assert near > 1e5
    assert module.force(there._replace(xi=20.0 * L)) == (0.0, 0.0, 0.0)
    assert module.force(there._replace(eta=20.0 * L)) == (0.0, 0.0, 0.0)
    assert abs(module.force(there._replace(xi=3.0 * L)).Y) < 0.01 * near
    assert not any(module.force(there._replace(A_2=0.0)))
    assert not any(module.force(there._replace(U_2=0.0)))
    assert math.isfinite(module.force(there._replace(eta=0.0, xi=0.0)).N)


def test_a_bank_draws_the_ship_and_turns_its_bow_off() -> None:
    bank = Bank(A_M=0.998 * B * D, x_bank=-0.2)
    force = bank.force(water(3.0, bank_v=2.0))
    assert force.Y > 0.0 > force.N
    assert pytest.approx(4.0 * force.Y) == bank.force(water(6.0, bank_v=2.0)).Y
    assert not any(bank.force(water(0.0, bank_v=2.0)))
    assert not any(bank.force(water(3.0)))
    assert Bank(A_M=1.0).x_bank == 0.0


def test_the_cushion_has_the_published_masses_and_keeps_energy() -> None:
    """m_b over the displacement by the gap; pushed into it without other forces, (m + m_b) v^2 stays."""
    cushion = Cushion(B=B, k_c=1.0)
    for gap, wanted in {5.0: 7.35, 10.0: 6.29, 20.0: 4.88, 40.0: 3.37, 80.0: 2.09}.items():
        flow = water(d_over_h=D / 25.0, quay_v=1.0 / (gap + 0.5 * B))
        assert quay_gap(flow, B) == pytest.approx((gap, 1.0))
        assert cushion.mass(flow)[0] / (1025.0 * 312622.0) == pytest.approx(wanted, abs=6e-3)
    m, v, gap, dt = 1025.0 * 312622.0, 0.1, 60.0, 0.05
    kept: list[float] = []
    for _ in range(4000):
        flow = water(v_m=v, d_over_h=D / 25.0, quay_v=1.0 / (gap + 0.5 * B))
        whole = m + cushion.added(flow, 0.0)
        kept.append(0.5 * whole * v * v)
        v += dt * cushion.force(flow).Y / whole
        gap -= dt * v
    assert np.array(kept) == pytest.approx(kept[0], rel=2e-3)
    assert v < 0.095


def test_the_cushion_is_off_unless_asked_for() -> None:
    body = load("kvlcc2_shallow").model.part("body")
    assert isinstance(body, Body)
    flow = water(v_m=0.1, d_over_h=D / 25.0, quay_v=1.0 / 40.0)
    hull = Polynomial(R_0=0.0, X_vv=0, X_vr=0, X_rr=0, X_vvvv=0, Y_v=0, Y_r=0, Y_vvv=0, Y_vvr=0, Y_vrr=0, Y_rrr=0,
                      N_v=0, N_r=0, N_vvv=0, N_vvr=0, N_vrr=0, N_rrr=0)  # fmt: skip
    assert not any(Cushion(B=B).force(flow))
    assert afloat(body, hull, flow, (Cushion(B=B),)).m_y == body.m_y
    assert afloat(body, hull, flow, (Cushion(B=B, k_c=1.0),)).m_y > 2.0 * body.m_y
    for nothing in (water(v_m=0.1, d_over_h=0.8), water(v_m=0.1, quay_v=0.02)):
        assert not any(Cushion(B=B, k_c=1.0).force(nothing))


def test_a_thruster_loses_thrust_where_its_jet_strikes_the_quay_only() -> None:
    size: dict[str, Any] = {"x": 140.0, "D": 3.0, "K_T": 0.4}
    free, tied = Tunnel(**size), QuayTunnel(**size, B=B, k_q=0.5, l_q=10.0)
    beside = water(quay_v=1.0 / (0.5 * B + 10.0))  # a quay to starboard, ten metres off
    off, onto = (-4.0,), (4.0,)
    assert pytest.approx(free.force(beside, off).Y * (1.0 - 0.5 * math.exp(-1.0))) == tied.force(beside, off).Y
    assert tied.force(beside, onto) == free.force(beside, onto)
    assert tied.force(water(), off) == free.force(water(), off)
    assert QuayTunnel(**size, B=B).force(beside, off) == free.force(beside, off)


def test_tugs_push_and_pull_one_way_and_less_at_speed() -> None:
    push, line = PushTug(x=100.0, y=29.0, f_max=6e5), LineTug(x=-150.0, f_max=6e5, U_free=12.5 * KNOT)
    assert push.force(water(), (4e5,)) == (0.0, -4e5, -4e7)
    assert not any(push.force(water(), (-4e5,)))
    assert push.force(water(), (9e5,)).Y == -6e5
    pull = line.force(water(), (5e5, 0.5 * math.pi))
    assert pytest.approx((0.0, 5e5, -7.5e7), abs=1e-6) == (pull.X, pull.Y, pull.N)
    assert not any(line.force(water(), (-5e5, 0.3)))
    for knots, left in {2.0: 0.84, 4.0: 0.68, 6.0: 0.52, 8.0: 0.36, 10.0: 0.20}.items():
        assert pytest.approx(-left * 5e5, rel=1e-5) == line.force(water(knots * KNOT), (5e5, math.pi)).X
    assert not any(line.force(water(8.0), (5e5, 0.0)))


def test_anchors_hold_by_their_mass_and_drag_against_the_motion() -> None:
    known = {("mud", "movable"): (117e3, 321e3), ("sand", "movable"): (212e3, 510e3), ("mud", "fixed"): (224e3, 615e3),
             ("sand", "fixed"): (337e3, 811e3)}  # fmt: skip
    for (soil, fluke), wanted in known.items():
        assert [holding(m, soil, fluke) for m in (5e3, 15e3)] == pytest.approx(wanted, rel=6e-3)
    anchor = DredgedAnchor(H=1e5, x=150.0)
    force = anchor.force(water(2.0, 0.0, 0.0))
    assert pytest.approx(-1e5, rel=1e-3) == force.X
    swinging = anchor.force(water(1.0, 0.5, 0.01))
    assert swinging.X * 1.0 + swinging.Y * 0.5 + swinging.N * 0.01 < 0.0
    assert not any(anchor.force(water()))


def test_berthing_energy_has_the_published_figures() -> None:
    first = Berthed(M=39e6, L=170.0, B=26.4, d=10.9, C_b=0.77, from_bow=0.25, angle=math.radians(5.0), v=0.1, keel=3.0)
    for name, wanted in (("ueda", 1.842), ("vasco_costa", 1.826), ("pianc2002", 1.669)):
        assert ADDED[name](26.4, 10.9, 0.77, 3.0) == pytest.approx(wanted, abs=6e-4)
    assert first.eccentricity() == pytest.approx(0.5627, abs=1e-4)
    assert first.energy("ueda") == pytest.approx(202.1e3, rel=1e-3)
    second = Berthed(M=125e6, L=236.0, B=43.0, d=15.1, C_b=0.796, from_bow=1.0 / 3.0, angle=math.radians(5.0), v=0.1,
                     keel=1.9)  # fmt: skip
    assert gyration(236.0, 0.796) == pytest.approx(61.65, abs=0.01)
    assert second.eccentricity() == pytest.approx(0.7604, abs=2e-4)
    for name, wanted in (("pianc2002", 1.78), ("ueda", 1.69), ("vasco_costa", 1.70)):
        assert ADDED[name](43.0, 15.1, 0.796, 1.9) == pytest.approx(wanted, abs=6e-3)
    assert frictionless(1.84 * 39e6, 43.57, 42.5, 0.06) == pytest.approx(66.19e3, rel=1e-3)


def test_what_a_flow_is_not_told_of_is_not_there() -> None:
    """No bank, no quay, no ship that passes, deep water, still air."""
    assert set(Flow._field_defaults.values()) == {0.0}
    assert quay_gap(Flow(**dict.fromkeys(set(Flow._fields) - set(Flow._field_defaults), 1.0)), 30.0)[1] == 0.0
