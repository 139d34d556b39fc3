"""What `seatrial study new` bounds by physics, and what a fit says of such a bound that binds."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from seatrial.core.parameters import Free, values
from seatrial.environment import CALM
from seatrial.identify.posterior.verdicts import verdicts
from seatrial.ships.files import load
from seatrial.study.drafting.limits import ellipsoid, limits
from seatrial.study.drafting.text import text_of
from seatrial.study.freedom import freedom

BOAT = load("wamv_16")


def of(ship, *names: str) -> dict[str, dict[str, float]]:
    return {path: dict(one) for path, one in limits(ship, names or values(ship.model)).items()}


def test_damping_of_its_own_velocity_stays_negative_and_couplings_are_free() -> None:
    found = of(BOAT)
    damped = {f"damping.{name}" for name in ("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr")}
    assert {path for path, one in found.items() if one == {"high": 0.0}} == damped
    none = {path: 0.0 for path in values(BOAT.model) if path.startswith("damping.") and path != "damping.order"}
    nu = np.array([0.7, -0.4, 0.3])
    for path in damped:  # alone, on this side of its bound it takes energy, and beyond gives some
        takes, gives = (float(nu @ np.array(BOAT.moved({**none, path: value}).model.damping.matrix(*nu)) @ nu)
                        for value in (found[path]["high"] - 1.0, found[path]["high"] + 1.0))  # fmt: skip
        assert gives < 0.0 < takes


def test_no_mass_is_below_that_of_the_water_displaced() -> None:
    found = of(BOAT, "inertia.m_11", "inertia.m_22", "inertia.m_33")
    heavy = float(BOAT.model.displaced)
    assert found["inertia.m_11"] == found["inertia.m_22"] == {"low": heavy} == {"low": 180.0}
    bar = heavy * (BOAT.L_pp / 3.0) ** 2 / 12.0  # a bar of a third of the length
    assert found["inertia.m_33"]["low"] == pytest.approx(bar, rel=0.1)
    assert found["inertia.m_33"]["low"] < values(BOAT.model)["inertia.m_33"]


def test_what_a_ship_breaks_already_or_its_file_does_not_tell_has_no_bound() -> None:
    assert "damping.X_u" not in of(BOAT.moved({"damping.X_u": 2.0}))
    assert "inertia.m_22" not in of(BOAT.moved({"inertia.m_22": 100.0}))
    assert not any(path.startswith("inertia.") for path in of(load("milliampere")))


@pytest.mark.parametrize(
    ("name", "held"),
    [("mariner", {"derivatives.X_u", "derivatives.Y_v", "derivatives.N_r"}), ("kvlcc2", {"hull.Y_v", "hull.N_r"})],
)
def test_of_a_polynomial_only_the_linear_terms_have_a_sign(name: str, held: set[str]) -> None:
    """X_uu of the Mariner is a curvature about its service speed, and may have either sign."""
    assert {path for path in of(load(name)) if not path.startswith(("body.", "propeller."))} == held


@pytest.mark.parametrize(("slender", "ahead", "aside", "turned"), [
    (1.50, 0.305, 0.621, 0.094), (2.99, 0.122, 0.803, 0.465), (6.01, 0.045, 0.918, 0.764), (9.97, 0.021, 0.960, 0.883),
])  # fmt: skip
def test_water_about_a_spheroid_is_that_of_lamb(slender: float, ahead: float, aside: float, turned: float) -> None:
    """Hydrodynamics, section 115: coefficients of inertia of prolate spheroids, to three digits."""
    rho, d = 1025.0, 2.0
    L, B = 2.0 * d * slender, 2.0 * d
    mass = rho * 2.0 / 3.0 * np.pi * (0.5 * L) * d * d
    own = mass * ((0.5 * L) ** 2 + d * d) / 5.0
    found = np.array(ellipsoid(rho, L, B, d)) / (mass, mass, own)
    assert found == pytest.approx((ahead, aside, turned), abs=0.003)


def test_a_ship_holds_more_water_than_the_ellipsoid_in_its_box() -> None:
    """Published added masses are above the floor, which is none where what a file has is below it."""
    for name in ("kvlcc2", "kcs", "suzaku", "gms_110"):
        ship = load(name)
        floor = of(ship, "body.m_x", "body.m_y", "body.J_z")
        assert len(floor) == 3
        assert all(0.05 < one["low"] / float(values(ship.model)[path]) < 0.8 for path, one in floor.items())
    light = load("kvlcc2").moved({"body.m_y": 0.3 * float(values(load("kvlcc2").model)["body.m_y"])})
    assert set(of(light, "body.m_x", "body.m_y")) == {"body.m_x"}


def test_a_propeller_that_stands_still_is_no_engine() -> None:
    ship = load("kvlcc2")
    assert of(ship, "propeller.k_0", "propeller.k_1", "propeller.k_2") == {"propeller.k_2": {"high": 0.0}}
    flow = 0.0, 0.0, 0.0, 5.0, 0.0, 0.0
    stopped, none, pulls = (float(ship.moved({"propeller.k_2": k_2}).model.derivative(flow, (0.0, 0.0), CALM)[3])
                            for k_2 in (-0.1, 0.0, 0.1))  # fmt: skip
    assert stopped < none < pulls


def test_the_draft_writes_bounds_that_the_study_takes_beside_the_priors_of_their_pattern() -> None:
    paths = ("damping.X_u", "damping.X_uu", "damping.N_v")
    ship = BOAT.moved({"damping.N_v": 5.0})
    text = text_of(
        ship="boat", family="Fossen", actuators=(), assumed=(), root="logs",
        format="", mapping="", files={}, kinds={}, train={}, test={},
        left_out={}, free=(("damping.*", 0.5, paths),), limits=limits(ship, paths), sampled=False, timed=False,
        clock=1.0, duration=60.0, windy=False, sigma={}, common={},
    )  # fmt: skip
    found, _ = freedom(ship.model, tomllib.loads(text)["free"])
    by = {one.path: one for one in found}
    assert set(paths) <= set(by)
    assert (by["damping.X_u"].high, by["damping.X_uu"].high) == (0.0, 0.0)
    assert by["damping.N_v"].high > 0.0
    assert by["damping.X_u"].sigma == pytest.approx(0.5 * abs(by["damping.X_u"].prior))


@pytest.mark.parametrize(("low", "high", "value", "told"), [
    (-np.inf, 0.0, 0.0, "the other sign"), (180.0, np.inf, 180.0, "it beyond"), (-3.0, 0.0, -3.0, "it beyond"),
    (0.0, 4.0, 0.0, "the other sign")])  # fmt: skip
def test_a_bound_that_binds_is_named_with_what_lies_beyond(low: float, high: float, value: float, told: str) -> None:
    one = Free("damping.X_u", value, low, high)
    (found,) = verdicts([one], np.array([value]), np.array([[1e-4]]), np.array([0.99]), [one.path], [one.path])
    assert found.status == "at bound"
    assert f"the data want {told}" in found.text
