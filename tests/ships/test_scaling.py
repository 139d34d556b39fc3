"""From model to full scale and back: Froude's law moves everything alike, friction and wake follow the ITTC."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.parameters import read, values
from seatrial.environment import Environment
from seatrial.models import unit
from seatrial.ships import ShipError
from seatrial.ships.files import load, save
from seatrial.ships.scaling import form_factor, line_1957, power, roughness, scale, wake

MODEL, FULL = load("kvlcc2_l7"), load("kvlcc2")


@pytest.mark.parametrize("name", ["kvlcc2", "kcs", "esso_osaka_3m_harbour", "suzaku", "milliampere", "twin_virtual"])
def test_by_froudes_law_alone_two_ships_move_alike(name: str) -> None:
    """Lengths go with the scale, times with its root: the same accelerations, wind, waves and thrusters included."""
    ship = load(name)
    ratio = 40.0 / ship.L_pp
    root = math.sqrt(ratio)
    other = scale(ship, 40.0, rho=float(read(ship.model, "body.rho")), effects=False).ship
    rng, U = np.random.default_rng(1), ship.speed
    by = {"1/s": 1 / root, "rad": 1.0, "N": ratio**3}
    for _ in range(5):
        state = rng.uniform(-0.3, 0.3, 6) * [1, 1, 1, U, U, U / ship.L_pp] + [0, 0, 0, U, 0, 0]
        control = rng.uniform(0.1, 0.4, len(ship.model.controls))
        wind, height, period = rng.uniform(-U, U), 0.01 * ship.L_pp, 3.0 * math.sqrt(ship.L_pp / 320.0)
        here = Environment(wind_x=wind, wind_y=0.5 * wind, wave_x=height, wave_T=period)
        there = Environment(wind_x=root * wind, wind_y=0.5 * root * wind, wave_x=ratio * height, wave_T=root * period)
        a = ship.model.derivative(tuple(state), tuple(control), here)
        moved = tuple(c * by[unit(n)] for n, c in zip(ship.model.controls, control, strict=True))
        b = other.model.derivative(tuple(state * [ratio, ratio, 1, root, root, 1 / root]), moved, there)
        assert np.allclose(b, np.array(a) * [root, root, 1 / root, 1, 1, 1 / ratio], rtol=1e-9, atol=1e-12)


def test_there_and_back_is_the_same_ship(tmp_path: Path) -> None:
    there = scale(MODEL, 320.0).ship
    read_back = load(save(there, tmp_path / "full.toml"))
    assert values(read_back.model) == values(there.model)
    back = scale(read_back, 7.0).ship
    assert values(back.model) == pytest.approx(values(MODEL.model), rel=1e-12)
    assert (back.speed, back.L_pp) == pytest.approx((MODEL.speed, MODEL.L_pp))
    assert back.actuators.rudder.rate == pytest.approx(MODEL.actuators.rudder.rate)


def test_every_number_says_where_it_comes_from() -> None:
    made = scale(MODEL, 320.0).ship
    assert made.entries["hull.Y_v"] == MODEL.entries["hull.Y_v"]  # a prime is what it was
    assert made.entries["body.B"].source.startswith("by Froude's law from 1.27 m of kvlcc2_l7; yasukawa2015")
    assert "ITTC 1978" in made.entries["propeller.w_P0"].source
    assert "ITTC-1957" in made.entries["hull.R_0"].source


def test_the_ittc_line_and_allowances() -> None:
    assert line_1957(1e7) == pytest.approx(0.003)  # 0.075/25
    assert line_1957(1e9) == pytest.approx(0.075 / 49)
    assert roughness(150e-6, 320.0) == pytest.approx(0.176e-3, rel=0.01)
    assert roughness(0.0, 7.0) == 0.0
    assert form_factor(320.0, 58.0, 20.8, 0.81) == pytest.approx(0.313, abs=0.002)
    assert wake(wake(0.4, 0.22, 4.0, 2.0), 0.22, 2.0, 4.0) == pytest.approx(0.4)
    assert wake(0.26, 0.22, 4.0, 2.0) == pytest.approx(0.26)  # what is potential stays


def test_the_two_kvlcc2_of_the_library() -> None:
    """All but friction is a geosim, to the rounding of its dimensions; the wake is within .025 of that given."""
    made = scale(MODEL, 320.0)
    ours, theirs = values(made.ship.model), values(FULL.model)
    assert made.ship.speed == pytest.approx(FULL.speed, rel=1e-3)
    assert made.ship.actuators.rudder.rate == pytest.approx(FULL.actuators.rudder.rate, rel=2e-3)
    differ = {path for path in ours if path in theirs and not math.isclose(ours[path], theirs[path], rel_tol=0.021)}
    assert differ == {"hull.R_0", "propeller.w_P0"}
    assert ours["propeller.w_P0"] == pytest.approx(theirs["propeller.w_P0"], abs=0.025)
    # The file of the full ship has the model's R_0'; the friction of a ship is half as large, so it must be too high.
    assert theirs["hull.R_0"] == read(MODEL.model, "hull.R_0")
    assert 0.55 < ours["hull.R_0"] / theirs["hull.R_0"] < 0.7
    assert made.after.whole / made.before.whole == pytest.approx(0.48, abs=0.02)


def test_a_ship_has_less_thrust_and_less_rudder_than_its_model() -> None:
    """The lighter load of the propeller takes more from the rudder than the thinner wake gives it."""
    from seatrial.workflow.judging import scale as run

    found = run(MODEL, 320.0)
    assert found.before is not None
    assert found.after is not None
    assert found.after.thrust < 0.7 * found.before.thrust
    assert 0.8 < found.after.rudder / found.before.rudder < 0.95
    own = run(MODEL, 320.0, rudder="own").after
    assert own is not None
    assert own.rudder < found.after.rudder


@pytest.mark.parametrize(
    ("named", "powers"),
    [("m", (1, 0)), ("kg m^2", (5, 1)), ("N s^2", (4, 1)), ("m/s^2", (0, 0)), ("rad/s", (-0.5, 0)), ("'", (0, 0)),
     ("W", (3.5, 1))],
)  # fmt: skip
def test_dimensions(named: str, powers: tuple[float, float]) -> None:
    assert power(named) == powers


@pytest.mark.parametrize(
    ("name", "length", "more", "said"),
    [("kvlcc2_l7", 0.0, {}, "0 m"), ("mariner", 7.0, {}, "no body in water"), ("kcs", 7.0, {}, "no R_0"),
     ("kvlcc2_l7", 320.0, {"rudder": "none"}, "proportion or own"),
     ("kvlcc2_l7", 320.0, {"form": 9.0}, "less than the friction")],
)  # fmt: skip
def test_what_cannot_be_scaled_is_refused(name: str, length: float, more: dict, said: str) -> None:
    with pytest.raises(ShipError, match=said):
        scale(load(name), length, **more)
