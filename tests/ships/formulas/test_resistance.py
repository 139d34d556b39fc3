"""Resistance of Holtrop and Mennen against their printed example, and against another regression in its own range."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from seatrial.ships.formulas import Particulars
from seatrial.ships.formulas import resistance as own

KNOT = 1852.0 / 3600.0
PRINTED = Particulars(
    L_pp=205.0, B=32.0, d=10.0, C_b=37500.0 / (205.0 * 32.0 * 10.0), rho=1025.0, nu=1.1883e-6, volume=37500.0,
    x_G=-0.0075 * 205.0, C_m=0.98, speed=25.0 * KNOT, D_P=8.0, pitch_ratio=1.0, blades=4.0, area_ratio=0.7393,
    A_R=25.0, H_R=8.0, aspect=2.0, w_P0=0.25, C_WP=0.75, A_BT=20.0, h_B=4.0, A_T=16.0,
)  # fmt: skip
"""The example of Holtrop and Mennen 1982, a container ship of 205 m; its viscosity follows from the printed C_F."""


def test_the_printed_example_of_1982_term_by_term() -> None:
    q = 0.5 * PRINTED.rho * PRINTED.speed**2
    assert PRINTED.ratios["F_n"] == pytest.approx(0.2868, abs=5e-5)
    assert own.prismatic(PRINTED) == pytest.approx(0.5833, abs=5e-5)
    assert 205.0 * own.run(PRINTED) == pytest.approx(81.385, abs=5e-4)
    assert own.wetted_surface(PRINTED) == pytest.approx(7381.45, abs=5e-3)
    assert own.friction(PRINTED) == pytest.approx(0.001390, abs=5e-7)
    assert q * own.friction(PRINTED) * own.wetted_surface(PRINTED) == pytest.approx(869.63e3, rel=1e-4)
    assert math.degrees(own.entrance(PRINTED)) == pytest.approx(12.08, abs=5e-3)
    assert own.bulb(PRINTED) == pytest.approx(0.7595, abs=5e-5)
    # Printed are 1 + k_1 = 1.156 and R_W = 557.11 kN by the formulas of 1982; those of 1984 differ by less than this.
    assert own.form_factor(PRINTED) == pytest.approx(1.156, rel=5e-3)
    weight = PRINTED.rho * own.GRAVITY * PRINTED.volume
    assert weight * own.waves(PRINTED) == pytest.approx(557.11e3, rel=6e-3)
    allowance = own.viscous(PRINTED) - own.form_factor(PRINTED) * own.friction(PRINTED)
    assert allowance == pytest.approx(0.000352, abs=5e-7)
    assert PRINTED.rho * own.pressure(PRINTED) == pytest.approx(0.049e3, abs=0.5)  # the transom is past its range
    whole = own.resistance(PRINTED)["hull.R_0"] * q * PRINTED.L_pp * PRINTED.d
    rudder = q * 1.5 * 2.0 * PRINTED.A_R * own.friction(PRINTED)
    assert whole - rudder == pytest.approx(1793.26e3 - 8.83e3, rel=3e-3)  # less the printed 50 m^2 of appendages


def test_the_example_of_1982_by_its_own_decay_of_the_humps() -> None:
    """With m_2 = c_15 C_P^2 exp(-.1 F_n^-2) in place of the m_4 of 1984 the wave resistance is the printed one."""
    F_n, C_p = PRINTED.ratios["F_n"], own.prismatic(PRINTED)
    wave = math.cos((1.446 * C_p - 0.03 * 205.0 / 32.0) * F_n**-2)
    m_4, m_2 = 0.4 * math.exp(-0.034 * F_n**-3.29), C_p**2 * math.exp(-0.1 * F_n**-2)
    turned = own.waves(PRINTED) * math.exp(-1.69385 * (m_2 - m_4) * wave)
    assert PRINTED.rho * own.GRAVITY * 37500.0 * turned == pytest.approx(557.11e3, rel=4e-4)  # g is 9.81 there


def test_fast_ships_by_the_formula_of_1984_and_a_line_between_the_two() -> None:
    ship = replace(PRINTED, L_pp=50.0, B=12.0, d=3.2, volume=900.0, C_b=900.0 / (50.0 * 12.0 * 3.2), C_m=0.78,
                   x_G=-0.045 * 50.0, C_WP=0.8, A_BT=0.0, A_T=10.0, i_E=math.radians(25.0))  # fmt: skip

    def at(F_n: float) -> float:
        return own.waves(replace(ship, speed=F_n * math.sqrt(9.80665 * 50.0)))

    c_17 = 6919.3 * 0.78**-1.3346 * (900.0 / 50.0**3) ** 2.00977 * (50.0 / 12.0 - 2.0) ** 1.40692
    m_3 = -7.2035 * (12.0 / 50.0) ** 0.326869 * (3.2 / 12.0) ** 0.605375
    c_5 = 1.0 - 0.8 * 10.0 / (12.0 * 3.2 * 0.78)
    for F_n in (0.55, 0.7):
        m_4 = -1.69385 * 0.4 * math.exp(-0.034 * F_n**-3.29)
        humps = m_4 * math.cos((1.446 * own.prismatic(ship) - 0.03 * 50.0 / 12.0) * F_n**-2)
        assert at(F_n) == pytest.approx(c_17 * c_5 * math.exp(m_3 * F_n**-0.9 + humps), rel=1e-9)
    for low, high in ((0.4 - 1e-9, 0.4 + 1e-9), (0.55 - 1e-9, 0.55 + 1e-9)):
        assert at(low) == pytest.approx(at(high), rel=1e-6)
    assert at(0.475) == pytest.approx(0.5 * (at(0.4) + at(0.55)), rel=1e-9)


def test_waves_rise_steeply_and_vanish_when_slow() -> None:
    def share(F_n: float) -> float:
        ship = replace(PRINTED, speed=F_n * math.sqrt(9.80665 * 205.0))
        return 9.80665 * ship.volume * own.waves(ship) / (0.5 * ship.speed**2 * 205.0 * 10.0)

    assert share(0.1) < 1e-5 < share(0.2) < share(0.25) < share(0.3)


def test_a_bulb_and_a_finer_entrance_take_waves_away() -> None:
    bare = replace(PRINTED, A_BT=0.0, h_B=0.0)
    assert own.waves(PRINTED) == pytest.approx(0.7595 * own.waves(bare), rel=1e-4)
    fine, blunt = (own.waves(replace(bare, i_E=math.radians(half))) for half in (10.0, 20.0))
    assert blunt / fine == pytest.approx((80.0 / 70.0) ** 1.37565)


def test_a_transom_drags_while_it_is_slow() -> None:
    """0.5 U^2 A_T 0.2 (1 - 0.2 F_nT), F_nT = U/sqrt(2 g A_T/(B + B C_WP)), until F_nT is 5."""
    slow = replace(PRINTED, A_BT=0.0, speed=4.0)
    F_T = 4.0 / math.sqrt(2.0 * 9.80665 * 16.0 / (32.0 * 1.75))
    assert own.pressure(slow) == pytest.approx(0.5 * 16.0 * 16.0 * 0.2 * (1.0 - 0.2 * F_T))
    assert own.pressure(replace(slow, speed=5.001 / F_T * 4.0)) == 0.0


TUGS = (  # L_pp, B, d, C_b, speed
    (30.0, 10.0, 4.0, 0.55, 5.0), (28.0, 8.0, 3.2, 0.5, 5.0), (45.0, 9.5, 3.6, 0.58, 6.0), (24.0, 7.0, 2.8, 0.5, 5.0),
    (60.0, 11.0, 4.5, 0.55, 6.5),
)  # fmt: skip


def tug(L_pp: float, B: float, d: float, C_b: float, speed: float) -> Particulars:
    return replace(PRINTED, L_pp=L_pp, B=B, d=d, C_b=C_b, C_m=0.85, volume=C_b * L_pp * B * d, speed=speed,
                   x_G=-0.01 * L_pp, C_WP=(1.0 + 2.0 * C_b) / 3.0 + 0.08, A_R=0.02 * L_pp * d, A_BT=0.0,
                   A_T=0.0)  # fmt: skip


@pytest.mark.parametrize("numbers", TUGS, ids=lambda numbers: f"{numbers[0]:g} m")
def test_two_regressions_of_different_models_agree_on_tugs_and_trawlers(numbers: tuple[float, ...]) -> None:
    ship = tug(*numbers)
    holtrop, oortmerssen = own.resistance(ship)["hull.R_0"], own.by_oortmerssen(ship)["hull.R_0"]
    assert oortmerssen == pytest.approx(holtrop, rel=0.25)
    waves = oortmerssen - own.friction(ship) * own.wetted_surface(ship) / (ship.L_pp * ship.d)
    assert waves > 0.3 * oortmerssen  # so that it is no agreement of friction alone


def test_van_oortmerssen_holds_for_small_ships_below_half_a_froude_number() -> None:
    broad, slender = tug(*TUGS[0]), tug(*TUGS[2])
    assert own.broad(broad) == own.by_oortmerssen(broad) != own.slender(broad)
    assert own.slender(slender) == own.by_oortmerssen(slender) != own.broad(slender)
    assert own.by_oortmerssen(replace(slender, speed=0.51 * math.sqrt(9.80665 * 45.0))) == {}
    assert own.by_oortmerssen(PRINTED) == {}


def test_each_rudder_adds_the_friction_of_its_two_sides() -> None:
    one, two = (own.resistance(replace(PRINTED, screws=screws))["hull.R_0"] for screws in (1.0, 2.0))
    assert two - one == pytest.approx(1.5 * 2.0 * 25.0 * own.friction(PRINTED) / (205.0 * 10.0))
