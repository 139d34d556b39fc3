"""Each formula of a first guess by itself, for a slender hull and a beamy one, with what it may be off by."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.actuators import Azimuth
from seatrial.core.errors import ShipError
from seatrial.core.parameters import values
from seatrial.identify.components.first_guess import Hull, as_printed, first_guess, fossen_ship, guesses
from seatrial.identify.components.servo import ServoFit
from seatrial.identify.components.thrust_map import fit_thrust

SLENDER = Hull(L_pp=100.0, B=16.0, d=5.0, m=5.6e6, x_G=2.0, rho=1025.0)  # L/B 6.25, block coefficient .683
BEAMY = Hull(L_pp=30.0, B=10.0, d=3.0, m=4.0e5, x_G=-0.5, rho=1025.0)  # L/B 3


def clarke(hull: Hull) -> tuple[float, float]:
    """Added mass in sway and in yaw over pi (d / L)^2 and 0.5 rho L^3, L^5 (Clarke 1983)."""
    C_b = hull.m / (hull.rho * hull.L_pp * hull.B * hull.d)
    unit = math.pi * (hull.d / hull.L_pp) ** 2
    sway = unit * (1.0 + 0.16 * C_b * hull.B / hull.d - 5.1 * (hull.B / hull.L_pp) ** 2)
    yaw = unit * (1.0 / 12.0 + 0.017 * C_b * hull.B / hull.d - 0.33 * hull.B / hull.L_pp)
    return 0.5 * hull.rho * hull.L_pp**3 * sway, 0.5 * hull.rho * hull.L_pp**5 * yaw


def strip(hull: Hull) -> tuple[float, float]:
    """Half of a cylinder of water of the draught's radius; in yaw along the length, and a tenth of the mass."""
    cylinder = 0.5 * math.pi * hull.rho * hull.d**2
    return cylinder * hull.L_pp, cylinder * hull.L_pp**3 / 12.0 + 0.1 * hull.m * hull.B**2 / 24.0


@pytest.mark.parametrize(("hull", "ours", "other"), [(SLENDER, clarke, strip), (BEAMY, strip, clarke)])
def test_added_masses_are_off_by_the_difference_of_two_formulas(hull: Hull, ours: object, other: object) -> None:
    """A tenth of the value at least."""
    found = guesses(hull)
    (sway, yaw), (sway_2, yaw_2) = ours(hull), other(hull)  # type: ignore[operator]
    assert found["inertia.m_22"].value == pytest.approx(hull.m + sway)
    assert found["inertia.m_22"].sigma == pytest.approx(max(abs(sway - sway_2), 0.1 * sway))
    own = hull.m * (0.25 * hull.L_pp) ** 2
    assert found["inertia.m_33"].value == pytest.approx(own + hull.m * hull.x_G**2 + yaw)
    assert found["inertia.m_33"].sigma == pytest.approx(math.hypot(0.2 * own, max(abs(yaw - yaw_2), 0.1 * yaw)))
    assert found["inertia.m_22"].source.startswith("m + Clarke" if hull is SLENDER else "m + strip")


@pytest.mark.parametrize(("breadth", "name"), [(25.0, "Clarke"), (25.1, "strip"), (100.0 / 9.0, "Clarke"),
                                               (11.0, "strip")])  # fmt: skip
def test_clarke_holds_for_lengths_of_four_to_nine_breadths(breadth: float, name: str) -> None:
    hull = Hull(L_pp=100.0, B=breadth, d=5.0, m=5.0e6, rho=1025.0)
    assert guesses(hull)["inertia.m_22"].source.startswith(f"m + {name}")


def test_added_mass_in_surge_is_of_soeding() -> None:
    for hull in (SLENDER, BEAMY):
        volume = hull.m / hull.rho
        added = 2.7 * hull.rho * volume ** (5.0 / 3.0) / hull.L_pp**2
        found = guesses(hull)["inertia.m_11"]
        assert found.value == pytest.approx(hull.m + added)
        assert found.sigma == pytest.approx(max(abs(added - 0.05 * hull.m), 0.02 * hull.m))


def test_the_centre_of_gravity_couples_sway_and_yaw() -> None:
    found = guesses(SLENDER)
    for path in ("inertia.m_23", "inertia.m_32"):
        assert found[path].value == pytest.approx(5.6e6 * 2.0)
        assert found[path].sigma == pytest.approx(0.05 * 5.6e6 * 100.0)


def test_cross_flow_drag_is_that_of_strips() -> None:
    """Integrals of rho d/2 |v + x r| (v + x r) over the length, for either motion alone, by a fine sum."""
    n = 4000
    x = [(k + 0.5) / n * 100.0 - 50.0 for k in range(n)]
    found = guesses(SLENDER)
    assert found["damping.Y_vv"].value == pytest.approx(-0.5 * 1025.0 * 5.0 * 100.0)
    moment = sum(0.5 * 1025.0 * 5.0 * abs(one) * one * one for one in x) * 100.0 / n
    assert found["damping.N_rr"].value == pytest.approx(-moment, rel=1e-5)
    for name in ("Y_vv", "N_rr"):
        one = found[f"damping.{name}"]
        assert one.sigma == pytest.approx(-0.5 * one.value)


def test_lift_damps_by_the_speed() -> None:
    found, C_b = guesses(SLENDER, speed=6.0), 5.6e6 / (1025.0 * 100.0 * 16.0 * 5.0)
    unit = 0.5 * 1025.0 * 6.0 * math.pi * 25.0
    assert found["damping.Y_v"].value == pytest.approx(-unit * (1.0 + 0.4 * C_b * 16.0 / 5.0))
    assert found["damping.N_r"].value == pytest.approx(-unit * 1e4 * (0.25 + 0.039 * 16.0 / 5.0 - 0.56 * 0.16))
    assert found["damping.Y_v"].sigma == -found["damping.Y_v"].value
    assert found["damping.N_r"].sigma == -found["damping.N_r"].value
    assert guesses(SLENDER, speed=12.0)["damping.Y_v"].value == pytest.approx(2.0 * found["damping.Y_v"].value)
    # the regression would drive the turn of a raft, and says nothing then
    raft = Hull(L_pp=10.0, B=10.0, d=5.0, m=2.0e5, rho=1025.0)
    assert "damping.N_r" not in guesses(raft, speed=1.0)
    assert "damping.Y_v" in guesses(raft, speed=1.0)
    assert "damping.Y_v" not in guesses(SLENDER)


def test_the_resistance_that_a_thrust_holds() -> None:
    one = guesses(SLENDER, speed=6.0, thrust=1.8e5)["damping.X_uu"]
    assert one.value == pytest.approx(-1.8e5 / 36.0)
    assert one.sigma == pytest.approx(0.3 * 1.8e5 / 36.0)
    assert first_guess(SLENDER, speed=6.0, thrust=1.8e5)["damping.X_uu"] == one.value
    for wrong in (0.0, -1.0):
        with pytest.raises(ShipError, match="above zero"):
            guesses(SLENDER, speed=wrong)


def test_as_printed_is_a_spheroid_without_pi() -> None:
    found = as_printed(SLENDER)
    a, b = 50.0, 8.0
    volume = 4.0 / 3.0 * math.pi * a * b * b
    spheroid = 1025.0 * volume * (a * a + b * b) / 5.0
    assert found["inertia.m_11"] == pytest.approx(1.05 * 5.6e6)
    assert found["inertia.m_22"] == pytest.approx(5.6e6 + 0.5 * 1025.0 * 25.0 * 100.0)
    assert found["inertia.m_33"] == pytest.approx(spheroid + strip(SLENDER)[1])
    assert found["inertia.m_23"] == found["inertia.m_32"] == pytest.approx(5.6e6 * 2.0)


@pytest.mark.parametrize("astern", [True, False])
def test_a_ship_says_where_each_of_its_numbers_comes_from(astern: bool) -> None:
    """Two azimuths, 12 m aft and 3 m to either side; pulled from -4 or 0 to 10 1/s by T = 40 n |n|."""
    n = np.linspace(-4.0 if astern else 0.0, 10.0, 29)
    pull = fit_thrust(n, 40.0 * n * np.abs(n))
    servo = ServoFit("alpha_1", Azimuth(rate=0.2), {"rate": 0.01, "lag": math.inf}, 0.0, 0.005, 0.999, 400)
    ship = fossen_ship("raft", BEAMY, {"1": (-12.0, -3.0, pull), "2": (-12.0, 3.0, pull)}, speed=4.0, n=5.0,
                       servos={"alpha_1": servo})  # fmt: skip
    own = values(ship.model)
    assert [own[f"thrusters.{k}.{at}"] for k in "12" for at in "xy"] == [-12.0, -3.0, -12.0, 3.0]
    found = guesses(BEAMY, speed=4.0, thrust=2.0 * float(pull.thrust(5.0)))
    for path, one in found.items():
        assert own[path] == pytest.approx(one.value), path
        entry = ship.entries[path]
        assert (entry.given, entry.sigma, entry.source) == (one.value, one.sigma, f"first guess: {one.source}")
    assert own["damping.X_u"] == 0.0
    told = ship.entries["thrusters.1.astern"].source
    assert told == ("bollard pull astern" if astern else "assumed: not tested astern")
    assert ship.entries["thrusters.2.y"].given == 3.0
    assert (ship.entries["actuators.n_1.low"].given, ship.entries["actuators.n_1.high"].given) == (n[0], 10.0)
    assert (ship.entries["actuators.alpha_1.rate"].given, ship.entries["actuators.alpha_1.rate"].sigma) == (0.2, 0.01)
    assert ship.entries["actuators.alpha_1.lag"].sigma is None
    assert "actuators.alpha_2.rate" not in ship.entries
    assert (ship.speed, ship.n_P, ship.L_pp) == (4.0, 5.0, 30.0)
    assert ship.entries["body.m"].source == "particulars"
