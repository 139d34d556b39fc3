"""Stability and roll damping from particulars, and a ship that gets roll from them."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from seatrial.manoeuvres.straight import Straight
from seatrial.manoeuvres.turning import Turning
from seatrial.ships import ShipError
from seatrial.ships.files import load, save
from seatrial.ships.formulas.roll_damping import Hull, coefficients, damping, lift
from seatrial.ships.formulas.stability import (
    centre_of_buoyancy,
    height_by_period,
    metacentric_height,
    metacentric_radius,
    period,
)
from seatrial.ships.rolled import Stability, with_roll
from seatrial.simulate.run import simulate

L, B, D = 300.0, 50.0, 12.5


def box(OG: float = -0.2, b: float = 0.025) -> Hull:
    """The hull of the published check: B/d 4, L/B 6, C_b .65, C_m .98, bilge keels of .025 B and .2 L."""
    return Hull(L_pp=L, B=B, d=D, C_b=0.65, C_m=0.98, OG=OG * D, b_BK=b * B, l_BK=0.2 * L)


OMEGA = 0.6 / math.sqrt(B / (2.0 * 9.81))


@pytest.mark.parametrize(
    ("OG", "deg", "whole", "parts"),
    [
        (-0.2, 10.0, 0.010156148773, (1.488e-5, 0.00349354, 0.00099503, 0.00565270)),
        (0.0, 10.0, 0.0120066, (None, 0.0064677, 0.00078815, 0.0047384)),
        (-0.2, 5.0, 0.0072629, ()),
        (-0.2, 20.0, 0.0170069, ()),
    ],
)
def test_damping_as_another_program_has_it(
    OG: float, deg: float, whole: float, parts: tuple[float | None, ...]
) -> None:
    found = damping(box(OG), OMEGA, math.radians(deg))
    digits = 1e-11 if whole == 0.010156148773 else 0.51e-7
    assert found.whole == pytest.approx(whole, abs=digits)
    for value, wanted in zip((found.friction, found.wave, found.eddy, found.keel), parts, strict=False):
        assert wanted is None or value == pytest.approx(wanted, rel=2e-5)


def test_linear_and_quadratic_damping_have_the_energy_of_both_amplitudes() -> None:
    hull, rho = box(), 1025.0
    B_1, B_2 = coefficients(hull, OMEGA, rho)
    for phi in (0.05, 0.2):
        wanted = damping(hull, OMEGA, phi).whole * rho * hull.unit
        assert B_1 + 8.0 / (3.0 * math.pi) * OMEGA * phi * B_2 == pytest.approx(wanted, rel=1e-12)
    assert damping(box(b=0.0), OMEGA, 0.1).keel == 0.0
    assert coefficients(box(b=0.05), OMEGA, rho)[1] > B_2


def test_ranges_are_told() -> None:
    assert not box().outside(OMEGA)
    assert {one.split()[0] for one in Hull(L_pp=51.5, B=8.6, d=2.3, C_b=0.35, C_m=0.8, OG=-1.06).outside(5.0)} == {
        "C_b", "C_m", "omega^"}  # fmt: skip
    assert lift(box(), 1025.0) > 0.0


@pytest.mark.parametrize(
    ("L_", "B_", "d", "volume", "KB", "BM", "KG"),
    [(175.0, 25.4, 8.5, 21222.0, 4.6154, 5.7746, 10.09), (51.5, 8.6, 2.3, 357.0, 1.53, 2.94, 3.36)],
)
def test_metacentre_of_two_published_ships(
    L_: float, B_: float, d: float, volume: float, KB: float, BM: float, KG: float
) -> None:
    C_b = volume / (L_ * B_ * d)
    assert centre_of_buoyancy(d, C_b) == pytest.approx(KB, rel=0.06)
    assert metacentric_radius(B_, d, C_b) == pytest.approx(BM, rel=0.13)
    assert metacentric_height(B_, d, C_b, KG) == pytest.approx(KB + BM - KG, abs=0.6)


def test_roll_period_and_its_inverse() -> None:
    """C .36648 and 33.99 s of the container ship, .43686 and 7.16 s of the naval ship."""
    assert period(25.4, 8.5, 175.0, 0.3) == pytest.approx(33.99, abs=0.005)
    assert period(8.6, 2.3, 51.5, 1.1) == pytest.approx(7.16, abs=0.005)
    assert height_by_period(25.4, 8.5, 175.0, period(25.4, 8.5, 175.0, 0.3)) == pytest.approx(0.3)


@pytest.mark.slow
def test_a_ship_gets_roll(tmp_path: Path) -> None:
    """KVLCC2 with bilge keels: period of the formula, heel out of the turn by its balance, damping that ends a roll."""
    plain, stability = load("kvlcc2"), Stability(GM=5.7, KG=18.6, C_m=0.998, b_BK=0.6, l_BK=90.0)
    ship = with_roll(plain, stability)
    assert load(save(ship, tmp_path / "rolling.toml")).model == ship.model
    assert all(f"roll.{name}" in ship.entries for name in vars(ship.model.part("roll")))
    rolled = simulate(ship, Straight(0.0), duration=120.0, dt=0.05, start=(0.0,) * 3 + (0.0,) * 3 + (0.1, 0.0))
    up = [t for t, a, b in zip(rolled.t[1:], rolled["phi"], rolled["phi"][1:], strict=False) if a < 0.0 <= b]
    assert up[1] - up[0] == pytest.approx(period(58.0, 20.8, 320.0, 5.7), rel=0.05)
    assert abs(rolled["phi"][-200:]).max() < 0.05
    policy = Turning(1.6, math.radians(35.0))
    here, there = (policy.indices(simulate(one, policy, duration=900.0), one.L_pp) for one in (plain, ship))
    assert here["advance"].value == pytest.approx(there["advance"].value, rel=0.01)
    assert 0.0 < there["steady_heel"].value < there["outward_heel"].value < math.radians(5.0)


def test_what_cannot_roll_is_refused() -> None:
    with pytest.raises(ShipError, match="family"):
        with_roll(load("mariner"), Stability(GM=1.0, KG=5.0))
    with pytest.raises(ShipError, match="GM is -1"):
        with_roll(load("kvlcc2"), Stability(GM=-1.0, KG=18.6))
