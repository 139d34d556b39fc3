"""Forces measured by motion: exact for rates that are written down, and Clarke's numbers for a hull of his formulas."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from plain_ships import L, plain

from seatrial.core.parameters import update, values
from seatrial.ships.files import load
from seatrial.validate.requirements import Finding, body, ranged, slips, whole
from seatrial.validate.requirements import thresholds as limit
from seatrial.validate.requirements.probe import Probe
from seatrial.validate.requirements.thresholds import within

MASSES = np.diag([1.0, 1.7, 0.09 * L * L])


def test_forces_split_by_symmetry_are_the_terms_of_a_polynomial() -> None:
    p = plain(lambda m: (m.n - m.u + 0.7 * m.v * m.r - 0.2 * m.v**2, -m.v - 2.0 * m.v**3 - 0.5 * m.v * m.r**2,
                         -m.r - 0.3 * m.v - 0.4 * m.v**2 * m.r), masses=MASSES)  # fmt: skip
    odd_v, odd_r, both, even = whole.Whole(p).parts(0.3, 0.5)
    assert odd_v == pytest.approx([0.0, 1.7 * (-0.3 - 2.0 * 0.027 - 0.5 * 0.3 * 0.25), -0.09 * 0.09])
    assert odd_r == pytest.approx([0.0, 0.0, 0.09 * (-0.5 - 0.4 * 0.09 * 0.5)])
    assert both == pytest.approx([0.7 * 0.15, 0.0, 0.0])
    assert even == pytest.approx([-0.2 * 0.09, 0.0, 0.0])


@pytest.mark.parametrize(("long", "holds", "doubt"), [(399.0, True, True), (430.0, False, True),
                                                      (1000.0, False, False)])  # fmt: skip
def test_no_ship_is_longer_than_the_longest(long: float, holds: bool, doubt: bool) -> None:
    """The tanker of 304.8 m in feet has 1000."""
    ship = load("esso_190k_tanker")
    longer = replace(ship, L_pp=long, model=update(ship.model, {"body.L_pp": long}))
    found = next(one for one in whole.findings(Probe.of(longer)) if one.what.startswith("length between"))
    assert (found.value, found.holds, found.doubt) == (long, holds, doubt)


def test_surge_by_drift_and_by_turning_are_over_their_squares() -> None:
    p = plain(lambda m: (m.n - m.u - 0.4 * m.v**2 + 0.3 * m.r**2, -m.v, -m.r), masses=MASSES)
    found = {one.what: one.value for one in whole.findings(p)}
    assert found["surge by drift"] == pytest.approx(-0.4)
    assert found["surge by turning"] == pytest.approx(0.3)


def test_slopes_are_those_of_the_written_rates_times_the_masses() -> None:
    p = plain(lambda m: (m.n - m.u, -1.2 * m.v - 0.4 * m.r - 0.3 * m.d, -0.6 * m.v - 3.0 * m.r + 2.0 * m.d),
              masses=MASSES)  # fmt: skip
    ship, straight = whole.Whole(p), (1.0, 0.0, 0.0, 1.0, 0.0)
    assert ship.slope(straight, (0.0, 0.02, 0.0, 0.0, 0.0)) == pytest.approx([0.0, -1.2 * 1.7, -0.6 * 0.09])
    assert ship.slope(straight, (0.0, 0.0, 0.02, 0.0, 0.0)) == pytest.approx([0.0, -0.4 * 1.7, -3.0 * 0.09])
    assert ship.slope(straight, (0.0, 0.0, 0.0, 0.0, 0.1)) == pytest.approx([0.0, -0.3 * 1.7, 2.0 * 0.09])


def test_a_hull_of_clarke_has_clarkes_numbers() -> None:
    """KVLCC2 with its rudder taken off and Clarke's derivatives, from primes over 0.5 rho L^2 as he prints them."""
    ship = load("kvlcc2")
    v = values(ship.model)
    T, B, Lpp, m = (float(v[f"body.{name}"]) for name in ("d", "B", "L_pp", "m"))
    C_b = m / 1025.0 / (Lpp * B * T)
    k, per = math.pi * (T / Lpp) ** 2, Lpp / T  # his forces are over 0.5 rho L^2, those of the file over 0.5 rho L d
    munk = float(v["body.m_y"] - v["body.m_x"]) / (0.5 * 1025.0 * Lpp**2 * T)
    clarke = {"hull.Y_v": -k * (1.0 + 0.4 * C_b * B / T) * per, "hull.N_v": -k * (0.5 + 2.4 * T / Lpp) * per,
              "hull.N_r": -k * (0.25 + 0.039 * B / T - 0.56 * B / Lpp) * per}  # fmt: skip
    assert munk > 0.0
    bare = {"rudder.A_R": 1e-9, "body.x_G": 0.0, **clarke}
    p = Probe.of(replace(ship, model=update(ship.model, bare)))
    found = {one.what: one.value for one in whole.findings(p)}
    assert found["sway by drift over Clarke's"] == pytest.approx(1.0, abs=0.02)
    assert found["yaw by drift over Clarke's"] == pytest.approx(1.0, abs=0.02)
    assert found["yaw by turning over Clarke's"] == pytest.approx(1.0, abs=0.02)
    assert found["block coefficient"] == pytest.approx(C_b)


def test_resistance_is_held_against_friction_of_the_wetted_surface() -> None:
    """A flat plate's friction, ITTC 1957, of the surface 2.6 sqrt(volume L) alone is 1, less waves."""
    ship = load("kvlcc2")
    v = values(ship.model)
    volume, Lpp, d, U = float(v["body.m"]) / 1025.0, 320.0, 20.8, ship.speed
    C_F = 0.075 / (math.log10(U * Lpp / 1.19e-6) - 2.0) ** 2
    R_0 = C_F * 2.6 * math.sqrt(volume * Lpp) / (Lpp * d)
    p = Probe.of(replace(ship, model=update(ship.model, {"hull.R_0": R_0, "rudder.A_R": 1e-9, "propeller.k_2": 0.0})))
    found = {one.what: one for one in whole.findings(p)}
    waves = 1.0 + (U / math.sqrt(9.81 * Lpp) / 0.3) ** 4
    assert found["resistance over friction and waves"].value == pytest.approx(1.0 / waves, rel=0.01)


@pytest.mark.parametrize(("value", "holds", "doubt"), [(1.0, True, True), (2.5, False, True), (9.0, False, False),
                                                      (float("inf"), False, False)])  # fmt: skip
def test_beyond_the_usual_a_value_is_doubted_and_far_beyond_it_fails(value: float, holds: bool, doubt: bool) -> None:
    (one,) = ranged("x", value, "-", within(0.5, 2.0, 0.1, 5.0, "why"), "wrong")
    assert (one.holds, one.doubt) == (holds, doubt)


@pytest.mark.parametrize("name", ["kvlcc2", "kvlcc2_l7", "seiun_maru", "suzaku", "mariner", "esso_osaka",
                                  "esso_osaka_3m", "gms_110", "twin_virtual", "container_son_nomoto",
                                  "esso_190k_tanker", "milliampere", "supply_76m", "cybership2", "gunnerus",
                                  "wamv_16", "blueboat", "northern_clipper"])  # fmt: skip
def test_ships_of_the_library_lie_within_what_ships_have(name: str) -> None:
    assert not [one.wrong for one in whole.findings(Probe.of(load(name))) if not one.holds]


def test_a_polynomial_of_drift_that_does_not_fall_with_speed_is_doubted_across() -> None:
    """KCS: forces over the design speed, taken at 90 degrees of drift and 0.4 U; resistance falls with the square."""
    ship = load("kcs")
    (found,) = [one for one in whole.findings(Probe.of(ship)) if not one.holds]
    hull, beta = ship.model.part("hull"), 0.5 * np.pi
    across = float(hull.Y_b) * beta + float(hull.Y_bbb) * beta**3
    assert found.doubt
    assert "forces kept at low speed" in found.wrong
    assert slips.named(Probe.of(ship), [found]) == [found], "the file has no slip"
    assert found.value == pytest.approx(across / 0.4**2 / -float(hull.X_0), rel=0.2)
    ahead = replace(ship, validity={**ship.validity, "v_m": (-0.3 * ship.speed, 0.3 * ship.speed)})
    assert all(one.holds for one in whole.findings(Probe.of(ahead))), "its file would not claim it"


def turned(**numbers: float) -> list[Finding]:
    ship = load("container_son_nomoto")
    model = update(ship.model, {key.replace("__", "."): value for key, value in numbers.items()})
    return [*body.heel(Probe.of(replace(ship, model=model)))]


@pytest.mark.slow
def test_a_ship_that_rolls_rights_itself_and_heels_outwards() -> None:
    """Stiffness by hand: m g GM over the inertia in roll, the small parts of speed and sway left out."""
    stiff, damped, starboard, port = turned()
    volume, rho = 21222.0, 1025.0
    inertia = (1.76e-5 + 3.4e-6) * 0.5 * rho * 175.0**5
    assert stiff.value == pytest.approx(rho * volume * 9.81 * 0.3 / inertia * 25.4 / 9.81, rel=0.35)
    assert all(one.holds for one in (stiff, damped, starboard, port))
    assert not turned(body__GM=-0.3)[0].holds
    assert not turned(derivatives__K_p=7.5e-6)[1].holds
    assert limit.HEEL.usual.low > 0.0


@pytest.mark.slow
@pytest.mark.parametrize(("share", "holds"), [(1.0, True), (1.0 / 0.3048, False), (0.02, False)])
def test_a_metacentric_height_that_no_breadth_has_is_doubted(share: float, holds: bool) -> None:
    """1.1 m on 8.6 m of breadth is an eighth; in feet 0.42 of it, which barges have."""
    ship = load("naval_blanke")
    GM = share * float(values(ship.model)["body.GM"])
    stiff = next(iter(body.heel(Probe.of(replace(ship, model=update(ship.model, {"body.GM": GM}))))))
    assert stiff.holds == holds
    assert stiff.holds or stiff.doubt


@pytest.mark.parametrize(("name", "number"), [("container_son_nomoto", "derivatives.K_v"),
                                              ("naval_blanke", "hull.K_uuv")])  # fmt: skip
def test_the_side_force_of_a_drift_acts_below_the_centre_of_gravity(name: str, number: str) -> None:
    """By hand on the container ship: K_v over Y_v in lengths, over the draught, of its own gyration for 0.4 B."""
    ship = load(name)
    about = "depth of the side force of a drift"

    def depth(factor: float) -> Finding:
        moved = replace(ship, model=update(ship.model, {number: factor * float(values(ship.model)[number])}))
        return next(one for one in whole.findings(Probe.of(moved)) if one.what.startswith(about))

    usual, other = depth(1.0), depth(-1.0)
    assert usual.holds
    assert other.value < 0.0
    assert not other.holds
    assert "K_v" in other.wrong
    if name == "container_son_nomoto":
        rho, L, inertia = 1025.0, 175.0, (1.76e-5 + 3.4e-6) * 0.5 * 1025.0 * 175.0**5
        k = math.sqrt(inertia / (rho * 21222.0)) / 25.4
        assert usual.value == pytest.approx(0.0003026 / 0.0116 * L / 8.5 * (0.4 / k) ** 2, rel=0.25)
    assert not [one for one in whole.findings(Probe.of(load("kvlcc2"))) if one.what.startswith(about)]


@pytest.mark.parametrize(("factor", "words"), [(1.0, ""), (5.0, "too large"), (0.2, "too small")])
def test_inertia_in_yaw_is_held_against_the_plan_of_the_craft(factor: float, words: str) -> None:
    """A catamaran as broad as long: an even plate has sqrt((L^2 + B^2)/12), 0.29 of its diagonal."""
    ship = load("blueboat")
    moved = update(ship.model, {"inertia.m_33": factor * float(values(ship.model)["inertia.m_33"])})
    p = Probe.of(replace(ship, model=moved))
    found = next(one for one in whole.findings(p) if one.what.startswith("radius of gyration in yaw, of the mass"))
    M = whole.Whole(p).mass
    slender = float(ship.model.breadth) / ship.L_pp
    assert found.value == pytest.approx(math.sqrt(M[2, 2] / M[0, 0] / (1.0 + slender**2)))
    assert found.holds == (not words)
    assert not words or words in found.wrong
    unknown = replace(p, ship=replace(p.ship, model=update(moved, {"body.B": 0.0})))
    found = next(one for one in whole.findings(unknown) if one.what.startswith("radius of gyration in yaw, of"))
    assert found.value == pytest.approx(math.sqrt(M[2, 2] / M[0, 0] / 1.25)), "half as broad as long"


def test_surge_by_drift_and_yaw_is_told_as_the_share_of_the_added_mass_that_is_left() -> None:
    """Potential flow gives m + m_y, so 1; a displaced mass of 1, 0.7 added in sway."""
    for share in (1.0, 0.4, 2.0):
        p = plain(lambda m, k=share: (m.n - m.u + (1.0 + 0.7 * k) * m.v * m.r, -m.v, -m.r), masses=MASSES)
        assert drifting(p).value == pytest.approx(share)
    light = plain(lambda m: (m.n - m.u + m.v * m.r, -m.v, -m.r), masses=np.diag([1.0, 1.1, 0.09 * L * L]))
    assert not [one for one in whole.findings(light) if one.what.startswith(DRIFTING)], "nothing to be a share of"


@pytest.mark.parametrize(("name", "number"), [("container_son_nomoto", "derivatives.X_vr"), ("kcs", "hull.X_br"),
                                              ("esso_osaka", "derivatives.X_vr"), ("mariner", "derivatives.X_rv"),
                                              ("modified_abkowitz_kvlcc2_l7", "derivatives.X_vr")])  # fmt: skip
def test_a_changed_sign_of_surge_by_drift_and_yaw_is_told(name: str, number: str) -> None:
    ship = load(name)
    other = {number: -float(values(ship.model)[number])}
    assert drifting(Probe.of(ship)).holds
    assert not drifting(Probe.of(replace(ship, model=update(ship.model, other)))).holds


DRIFTING = "surge by drift and yaw"


def drifting(p: Probe) -> Finding:
    return next(one for one in whole.findings(p) if one.what.startswith(DRIFTING))


def test_drag_of_a_turned_rudder_over_its_side_force_is_that_of_a_normal_force() -> None:
    """X = -(1 - t_R) F_N sin(delta), Y = -(1 + a_H) F_N cos(delta): turned, it holds the ship back."""
    ship = load("kvlcc2")
    rudder = ship.model.rudder
    about = "drag of the rudder over its side force"

    def found(t_R: float) -> Finding:
        moved = replace(ship, model=update(ship.model, {"rudder.t_R": t_R}))
        return next(one for one in whole.findings(Probe.of(moved)) if one.what.startswith(about))

    for t_R in (float(rudder.t_R), 0.2):
        one = found(t_R)
        shares = (1.0 - t_R) / (1.0 + float(rudder.a_H))
        assert one.value == pytest.approx(shares * math.tan(math.radians(35.0)), rel=1e-6)
        assert one.holds
    assert not found(1.3).holds, "it would push the ship ahead"
