"""Each regression formula once more from its printed equation, with forces in newton, on two ships of unlike shape."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from seatrial.ships.formulas import Particulars, added_mass, hull, propeller, resistance, rudder
from seatrial.ships.formulas.reading import read_particulars
from seatrial.ships.formulas.roll_damping import Hull, lift

EXAMPLES = Path(__file__).parents[3] / "examples" / "particulars"
KCS = read_particulars(EXAMPLES / "kcs.toml").ship
FULL = replace(KCS, L_pp=180.0, B=32.0, d=11.0, C_b=0.8, C_m=0.99, volume=0.8 * 180.0 * 32.0 * 11.0, x_G=4.0,
               w_P0=0.4, D_P=6.0, H_R=8.0, aspect=1.6)  # fmt: skip
FINE = replace(KCS, L_pp=120.0, B=18.0, d=6.0, C_b=0.58, C_m=0.97, volume=0.58 * 120.0 * 18.0 * 6.0, x_G=-1.0,
               w_P0=0.25, D_P=4.0, H_R=3.0, aspect=1.1)  # fmt: skip
both = pytest.mark.parametrize("ship", [FULL, FINE], ids=["full", "fine"])


def yoshimura_masumoto(s: Particulars) -> dict[str, float]:
    """Coefficients of the cubic in beta and r', at beta = -v': each odd power of beta changes the sign."""
    X, slim = s.C_b * s.B / s.L_pp, (1.0 - s.C_b) * s.L_pp / s.B
    beta = {
        ("Y", "bbb"): 0.185 * s.L_pp / s.B + 0.48, ("Y", "bbr"): -0.75, ("Y", "brr"): 0.26 * slim + 0.11,
        ("Y", "rrr"): -0.051, ("N", "bbb"): 0.66 - 0.69 * s.C_b, ("N", "bbr"): 1.55 * X - 0.76,
        ("N", "brr"): 0.075 * slim - 0.098, ("N", "rrr"): 0.25 * X - 0.056, ("X", "bb"): 1.15 * X - 0.18,
        ("X", "bbbb"): 1.1 - 6.68 * X,
    }  # fmt: skip
    return {
        f"hull.{force}_{of.replace('b', 'v')}": (-1.0) ** of.count("b") * value for (force, of), value in beta.items()
    }


@both
def test_cubic_hull_of_yoshimura_and_masumoto(ship: Particulars) -> None:
    found, X = hull.yoshimura(ship), ship.C_b * ship.B / ship.L_pp
    m_y = added_mass.motora(ship)["body.m_y"]
    wanted = yoshimura_masumoto(ship) | {
        "hull.X_vr": 1.91 * X - 0.08 - m_y, "hull.X_rr": 0.008 - 0.085 * X - m_y * ship.x_G / ship.L_pp,
    }  # fmt: skip
    assert found == pytest.approx(wanted, rel=1e-12)


@both
def test_linear_terms_of_four_authors(ship: Particulars) -> None:
    L, B, d, C_b = ship.L_pp, ship.B, ship.d, ship.C_b
    m, m_x = 2.0 * C_b * B / L, 0.1 * C_b * B / L
    wing = {"hull.Y_v": -math.pi * d / L - 1.4 * C_b * B / L, "hull.N_v": -2.0 * d / L,
            "hull.N_r": 2.0 * d / L * (2.0 * d / L - 0.54)}  # fmt: skip
    assert hull.yoshimura_linear(ship) == pytest.approx(wing | {"hull.Y_r": m_x + 0.5 * C_b * B / L}, rel=1e-12)
    assert hull.inoue(ship) == pytest.approx(wing | {"hull.Y_r": 0.5 * math.pi * d / L}, rel=1e-12)
    X = C_b * B / L
    kijima = {
        "hull.Y_r": m + m_x - 1.5 * X, "hull.Y_vvr": 1.5 * d * C_b / B - 0.65,
        "hull.Y_vrr": -5.95 * d * (1.0 - C_b) / B, "hull.N_vvr": 18.4 * X - 57.5 * X**2 - 1.6,
        "hull.N_vrr": 0.5 * d * C_b / B - 0.05,
    }  # fmt: skip
    assert hull.kijima(ship) == pytest.approx(wing | kijima, rel=1e-12)
    # over 0.5 rho L^2 U and its kin with pi (T/L)^2; here over 0.5 rho L d U: times L/d
    S = math.pi * (d / L) ** 2
    clarke = {"Y_v": -S * (1.0 + 0.40 * C_b * B / d), "Y_r": -S * (-0.5 + 2.2 * B / L - 0.08 * B / d),
              "N_v": -S * (0.5 + 2.4 * d / L), "N_r": -S * (0.25 + 0.039 * B / d - 0.56 * B / L)}  # fmt: skip
    wanted = {f"hull.{name}": value * L / d for name, value in clarke.items()}
    wanted["hull.Y_r"] += m_x
    assert hull.clarke(ship) == pytest.approx(wanted, rel=1e-12)
    assert hull.hasegawa(ship)["hull.X_vr"] == pytest.approx(
        (1.66 * C_b - 0.432 - 1.0) * added_mass.motora(ship)["body.m_y"]
    )


@both
def test_added_masses_of_four_authors(ship: Particulars) -> None:
    L, B, d, C_b = ship.L_pp, ship.B, ship.d, ship.C_b
    mass = C_b * L * B * d  # over rho
    prime = 0.5 * L * L * d
    assert added_mass.twentieth(ship) == pytest.approx({"body.m_x": 0.05 * mass / prime})
    assert added_mass.soeding(ship) == pytest.approx({"body.m_x": 2.7 * mass ** (5.0 / 3.0) / L**2 / prime})
    S = math.pi * (d / L) ** 2 * 0.5 * L**3
    assert added_mass.clarke(ship) == pytest.approx({
        "body.m_y": S * (1.0 + 0.16 * C_b * B / d - 5.1 * (B / L) ** 2) / prime,
        "body.J_z": S * L**2 * (1.0 / 12.0 + 0.017 * C_b * B / d - 0.33 * B / L) / (prime * L**2),
    })  # fmt: skip
    d_B, L_B = d / B, L / B
    per_m = (0.882 - 0.54 * C_b * (1.0 - 1.6 * d_B) - 0.156 * L_B * (1.0 - 0.673 * C_b)
             + 0.826 * d_B * L_B * (1.0 - 0.678 * d_B) - 0.638 * C_b * d_B * L_B * (1.0 - 0.669 * d_B))  # fmt: skip
    radius = (33.0 - 76.85 * C_b * (1.0 - 0.784 * C_b) + 3.43 * L / B * (1.0 - 0.63 * C_b)) / 100.0  # over L
    assert added_mass.motora(ship) == pytest.approx(
        {"body.m_y": per_m * mass / prime, "body.J_z": radius**2 * mass / prime}
    )


@both
def test_rudder_and_what_it_induces(ship: Particulars) -> None:
    X, epsilon = ship.C_b * ship.B / ship.L_pp, 0.44 + 1.82 * ship.w_P0
    assert rudder.yoshimura(ship) == pytest.approx({
        "rudder.t_R": 0.39, "rudder.epsilon": epsilon, "rudder.kappa": 0.55 / epsilon, "rudder.l_R": -0.9,
        "rudder.gamma_Rp": 2.06 * X + 0.14, "rudder.gamma_Rn": 2.06 * X + 0.14,
    })  # fmt: skip
    assert rudder.yoshimura_hull(ship) == pytest.approx({"rudder.a_H": 3.6 * X, "rudder.x_H": -0.4})
    assert rudder.quadvlieg(ship) == pytest.approx({"rudder.a_H": 0.627 * ship.C_b - 0.153})
    assert rudder.aoki(ship) == {"rudder.x_H": -0.45}
    assert rudder.kijima(ship) == pytest.approx(
        {"rudder.t_R": 0.45 - 0.28 * ship.C_b, "rudder.epsilon": 41.6 * X - 156.2 * X**2 - 1.76}
    )
    assert rudder.slim(ship) == pytest.approx({"rudder.kappa": 0.55 - 0.8 * X})
    assert rudder.geometry(ship) == pytest.approx({"rudder.x_R": -0.5, "rudder.eta": min(1.0, ship.D_P / ship.H_R)})
    assert rudder.fujii(ship) == pytest.approx({"rudder.f_alpha": 6.13 / (1.0 + 2.25 / ship.aspect)})


@both
def test_wake_and_thrust_of_one_screw_and_of_two(ship: Particulars) -> None:
    final = 1.0 / (1.0 - ship.w_P0)
    assert propeller.taylor(ship) == pytest.approx(
        {"propeller.w_P0": 0.5 * ship.C_b - 0.05, "propeller.C_2p": final, "propeller.C_2n": final}
    )
    twin = replace(ship, screws=2.0)
    assert propeller.taylor_twin(twin) == pytest.approx(
        {"propeller.w_P0": 0.55 * ship.C_b - 0.2, "propeller.C_2p": final, "propeller.C_2n": final}
    )
    share = ship.D_P / (ship.B * ship.d) ** 0.5
    w = 0.3095 * ship.C_b + 10.0 * resistance.viscous(ship) * ship.C_b - 0.23 * share
    assert resistance.twin_wake(twin) == pytest.approx({"propeller.w_P0": w})
    assert resistance.twin_thrust_deduction(twin) == pytest.approx({"propeller.t_P": 0.325 * ship.C_b - 0.1885 * share})
    for single in (propeller.taylor, resistance.wake, resistance.thrust_deduction):
        assert single(twin) == {} != single(ship)
    for double in (propeller.taylor_twin, resistance.twin_wake, resistance.twin_thrust_deduction):
        assert double(ship) == {}
    assert propeller.drift(ship) == {"propeller.C_1": 2.0, "propeller.x_P": -0.48}


def test_form_factor_with_the_centre_of_buoyancy() -> None:
    """Holtrop 1984 by the length of run L_R = L (1 - C_P + .06 C_P lcb/(4 C_P - 1))."""
    for ship in (FULL, FINE):
        L, B, T = ship.L_pp, ship.B, ship.d
        C_P, lcb = ship.C_b / ship.C_m, 100.0 * ship.x_G / ship.L_pp
        L_R = L * (1.0 - C_P + 0.06 * C_P * lcb / (4.0 * C_P - 1.0))
        k = (
            0.93
            + 0.487118
            * (B / L) ** 1.06806
            * (T / L) ** 0.46106
            * (L / L_R) ** 0.121563
            * (L**3 / (ship.C_b * L * B * T)) ** 0.36486
            * (1.0 - C_P) ** -0.604247
        )
        assert resistance.form_factor(ship) == pytest.approx(k, rel=1e-12)


def test_lift_damps_roll_as_the_square_of_the_draught_says() -> None:
    """Half rho L d k_N l_0 l_R (1 - 1.4 OG/l_R + .7 OG^2/(l_0 l_R)), l_0 = .3 d, l_R = .5 d."""
    for C_m, OG in ((0.93, 1.5), (0.98, -0.5)):
        one = Hull(L_pp=120.0, B=18.0, d=6.0, C_b=0.58, C_m=C_m, OG=OG)
        kappa = (C_m - 0.91) ** 2 * (106.0 - 700.0 * (C_m - 0.91))
        k_N = math.pi * 2.0 * 6.0 / 120.0 + kappa * (4.1 * 18.0 / 120.0 - 0.045)
        wanted = 0.5 * 1025.0 * 120.0 * 6.0 * k_N * (1.8 * 3.0 - 1.4 * 1.8 * OG + 0.7 * OG**2)
        assert lift(one, 1025.0) == pytest.approx(wanted, rel=1e-12)
