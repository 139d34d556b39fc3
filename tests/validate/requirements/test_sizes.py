"""Wind, waves, thrusters and propeller over their areas and diameters are the coefficients that their files state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from seatrial.core.parameters import update, values
from seatrial.forces.wind import Fujiwara, fujiwara1998
from seatrial.ships.files import load
from seatrial.validate.requirements import Finding, control, propulsion, typical, weather
from seatrial.validate.requirements.probe import Probe


def known(name: str = "kvlcc2", **numbers: float) -> Probe:
    ship = load(name)
    return Probe.of(replace(ship, model=update(ship.model, {k.replace("__", "."): x for k, x in numbers.items()})))


def by_name(found: Iterator[Finding]) -> dict[str, Finding]:
    return {one.what: one for one in found}


@pytest.mark.slow
def test_wind_over_pressure_and_area_is_blendermanns_coefficient() -> None:
    p = known()
    found = by_name(weather._sized(p, "wind", weather._forces(p, "wind", 1.0)))
    assert found["wind: force across over pressure and area"].value == pytest.approx(0.70, rel=1e-6)
    assert found["wind: force along over pressure and area"].value == pytest.approx(0.90, rel=1e-6)
    assert found["wind: lever of a beam wind"].value == pytest.approx(-15.0 / 320.0, rel=1e-6)
    knots = known(wind__C_Dt=0.70 / 0.5144**2)
    told = by_name(weather._sized(knots, "wind", weather._forces(knots, "wind", 1.0)))
    assert not told["wind: force across over pressure and area"].holds


@pytest.mark.slow
def test_the_lever_of_the_wind_holds_by_either_formula_and_fails_off_the_hull() -> None:
    """KVLCC2's rectangles by Fujiwara et al. (1998): at 90 degrees (N_1 - N_3)/(Y_1 - Y_3 + Y_5)."""
    shape = {"A_T": 1540.0, "A_L": 3330.0, "A_OD": 384.0, "C": -15.0, "C_BR": -130.0, "H_BR": 33.2, "H_C": 6.5}
    a = fujiwara1998(**shape, B=58.0, L=320.0)
    other = Fujiwara(rho_air=1.225, A_T=1540.0, A_L=3330.0, L_wind=320.0, **a)
    ship = load("kvlcc2")
    p = Probe.of(replace(ship, model=replace(ship.model, wind=other)))
    force = weather._forces(p, "wind", 1.0)
    found = by_name(weather._sized(p, "wind", force)) | by_name(weather._turned(force))
    by_hand = (a["N_1"] - a["N_3"]) / (a["Y_1"] - a["Y_3"] + a["Y_5"])
    assert found["wind: lever of a beam wind"].value == pytest.approx(by_hand, rel=1e-6)
    assert found["wind: lever of a beam wind"].holds
    assert found["wind: greatest lever of the side force"].holds
    off = known(wind__s_L=-150.0)
    (told,) = (one for one in weather._sized(off, "wind", weather._forces(off, "wind", 1.0)) if "lever" in one.what)
    assert (told.holds, told.doubt) == (False, False)


def test_waves_over_what_a_wall_reflects_are_the_cubic_at_half_a_length() -> None:
    p = known()
    (found,) = weather._sized(p, "waves", weather._forces(p, "waves", 1.0))
    assert found.value == pytest.approx(0.46 + 6.83 * 0.5 - 15.65 * 0.25 + 8.44 * 0.125, rel=2e-3)
    assert found.holds


def test_the_propeller_is_loaded_by_its_open_water_curve() -> None:
    """Bollard K_T is (1 - t_P) k_0; a quarter of it turns too fast."""
    p = known()
    found = by_name(propulsion._loaded(p))
    assert found["bollard pull over rho n^2 D^4"].value == pytest.approx(0.78 * 0.2931, rel=1e-3)
    assert found["speed over revolutions and diameter"].value == pytest.approx(p.U / (p.n_P * 9.86))
    assert found["surplus of thrust at the approach"].value == pytest.approx(0.0, abs=1e-4)
    weak = known(propeller__k_0=0.2931 / 4, propeller__k_1=-0.2753 / 4, propeller__k_2=-0.1385 / 4)
    assert [one.what for one in propulsion._loaded(weak) if not one.holds]


def test_a_propeller_in_an_abkowitz_table_is_held_against_its_speed_too() -> None:
    """The diameter stands with the race: ten times the thrust of n^2 turns a propeller too slowly for its ship."""
    name = "modified_abkowitz_kvlcc2_l7"
    p = known(name)
    strong = known(name, derivatives__eta_3=10.0 * float(values(p.ship.model)["derivatives.eta_3"]))
    about = "speed over revolutions and diameter"
    found, other = (by_name(propulsion._loaded(one))[about] for one in (p, strong))
    assert found.value == pytest.approx(p.U / (p.n_P * 0.216))
    assert found.holds
    assert not other.holds


@pytest.mark.slow
def test_thrusters_stand_where_they_are_called() -> None:
    p = known("esso_osaka_3m_harbour")
    found = by_name(control.places(p))
    for name, side in (("bow", 1.0), ("stern", 1.0)):
        assert found[f"{name}: lever of its thrust"].value == pytest.approx(0.4, rel=1e-6)
        assert found[f"{name}: lever towards its name"].value == pytest.approx(side * 0.4, rel=1e-6)
    weight = (244.6 + 42.19) * 9.81
    assert found["bow: thrust over weight"].value == pytest.approx(0.6 / weight, rel=1e-3)
    swapped = known("esso_osaka_3m_harbour", thrusters__bow__x=-1.2, thrusters__stern__x=1.2)
    wrong = [one.what for one in control.places(swapped) if not one.holds]
    assert wrong == ["bow: lever towards its name", "stern: lever towards its name"]


def test_rudder_and_propeller_are_held_against_the_draught() -> None:
    found = by_name(typical.stern(known()))
    assert found["rudder area over L d"].value == pytest.approx(112.5 / (320.0 * 20.8))
    assert found["propeller diameter over draught"].value == pytest.approx(9.86 / 20.8)
    wrong = [one.what for one in typical.stern(known(rudder__A_R=1211.0, propeller__D_P=32.3)) if not one.holds]
    assert wrong == ["propeller diameter over draught", "rudder area over L d",
                     "height of the rudder, D_P/eta, over draught"]  # fmt: skip
