"""Trim and linearisation of every model: published constants, eigenvalues, transfer functions, step answers."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from makes import TRACED, ships
from seatrial.actuators import Actuators
from seatrial.core.parameters import ParameterError
from seatrial.core.symbolic import is_symbol
from seatrial.environment import CALM, Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.models.linear import Linear, course_stability, linearise, straight, trim
from seatrial.models.trim import point
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate


def printed(value: float, digits: str) -> bool:
    """Whether a value rounds to what is printed."""
    places = len(digits.partition(".")[2])
    return round(float(value), places) == float(digits)


def about(name: str, speed: float | None = None) -> Linear:
    ship = load(name)
    return straight(ship.model, speed or ship.speed)


@pytest.mark.slow
@pytest.mark.parametrize("name", ships(TRACED))
def test_every_ship_of_the_library_has_a_linear_form(name: str) -> None:
    found = about(name)
    assert np.isfinite(found.A).all()
    assert np.isfinite(found.B).all()
    assert np.isfinite(found.E).all()
    assert found.at.residual < 1e-9
    assert abs(found.at.orders.get("delta", 0.0)) < math.radians(3.0)
    word, text = found.stability()
    assert text.startswith(word)


@pytest.mark.slow
def test_mariner_has_the_constants_of_mss() -> None:
    model: Any = load("mariner").model
    # About the exact design point, as MSS linearises: its own Y_0 and N_0 ask for a little helm otherwise.
    found = linearise(model, point(model, (0.0, 0.0, 0.0, 7.7175, 0.0, 0.0), {})).nomoto()
    for value, digits in zip(found, (".1850", "118.0", "7.76", "18.53"), strict=True):
        assert printed(value, digits), (value, digits)
    trimmed = about("mariner")
    assert trimmed.at.speed == pytest.approx(7.7175, rel=1e-2)
    assert math.degrees(trimmed.at.orders["delta"]) == pytest.approx(-1.1, abs=0.1)
    assert trimmed.nomoto() == pytest.approx(found, rel=2e-3)


@pytest.mark.parametrize(("speed", "digits"), [(0.5, ".055"), (1.0, ".135"), (2.0, ".296")])
def test_milliampere_is_unstable_ahead(speed: float, digits: str) -> None:
    found = about("milliampere", speed)
    assert printed(max(found.eigenvalues.real), digits)
    assert found.stability()[0] == "unstable"


@pytest.mark.slow
def test_kvlcc2_full_scale_from_its_derivatives() -> None:
    ship = load("kvlcc2")
    model: Any = ship.model
    found = straight(model, ship.speed)
    b, h, U = model.body, model.hull, ship.speed
    q = 0.5 * b.rho * b.L_pp * b.d * U
    sway, yaw, lever = b.m + b.m_y, b.I_zG + b.x_G**2 * b.m + b.J_z, b.x_G * b.m
    hull = q * np.array([[h.Y_v, h.Y_r * b.L_pp], [b.L_pp * h.N_v, h.N_r * b.L_pp**2]])
    hull -= np.array([[0.0, (b.m + b.m_x) * U], [0.0, lever * U]])
    bare = np.linalg.solve(np.array([[sway, lever], [lever, yaw]]), hull)
    without = replace(model, rudder=replace(model.rudder, A_R=1e-9))
    np.testing.assert_allclose(straight_at(without, found).A[1:, 1:], bare, rtol=1e-6)
    assert found.lateral().states == ("v_m", "r")
    assert found.E.shape == (3, 8)


def straight_at(model: Any, like: Linear) -> Linear:
    return linearise(model, point(model, like.at.state, like.at.orders))


@pytest.mark.slow
def test_response_models_give_back_what_they_were_made_of() -> None:
    second: Any = load("mariner_nomoto2").model
    assert about("mariner_nomoto2").nomoto() == pytest.approx(second.constants, rel=1e-10)
    assert about("mariner_nomoto").nomoto() == pytest.approx((0.185, 107.3, 0.0, 0.0), rel=1e-12)
    tanker = about("tanker_nomoto")
    assert tanker.nomoto() == pytest.approx((-0.019, -153.7, 0.0, 0.0), rel=1e-12)
    assert "doubles every 107 s" in tanker.stability()[1]


@pytest.mark.parametrize("name", ["kvlcc2_l7", "esso_osaka_3m", "mariner_nomoto2", "kcs"])
@pytest.mark.long
def test_step_answer_is_that_of_a_small_rudder_in_the_nonlinear_model(name: str) -> None:
    from control import step_response

    ship = replace(load(name), actuators=Actuators())
    found = straight(ship.model, ship.speed, side=1.0)
    small, duration = 1e-5, 5.0 * ship.L_pp / ship.speed
    dt = duration / 500
    start = found.at.state
    steer = Turning(n_P=found.at.orders.get("n_P", 0.0), delta=small)
    trial = simulate(ship, steer, speed=start[3], duration=duration, dt=dt)
    t = dt * np.arange(len(trial))
    for output in ("r", "psi"):
        answer = step_response(found.transfer_function(output), t)
        scale = float(np.max(np.abs(trial[output])))
        np.testing.assert_allclose(small * answer.y[0, 0], trial[output], atol=2e-3 * scale)


@pytest.mark.slow
def test_a_kink_has_two_sides_and_a_mean() -> None:
    model: Any = load("kvlcc2_l7").model
    port, mean, starboard = (straight(model, 1.179, side=s).A for s in (-1.0, None, 1.0))
    np.testing.assert_allclose(mean, 0.5 * (port + starboard), atol=1e-14)
    assert np.abs(port - starboard).max() > 0.01
    alike = replace(model, rudder=replace(model.rudder, gamma_Rp=0.5, gamma_Rn=0.5))
    port, starboard = (straight(alike, 1.179, side=s).lateral().A for s in (-1.0, 1.0))
    np.testing.assert_allclose(port, starboard, atol=1e-9)
    word, text = course_stability(model, trim(model, speed=1.179))
    assert word == "unstable"
    assert "to starboard stable" in text
    assert "to port unstable" in text
    kcs = load("kcs")
    assert course_stability(kcs.model, trim(kcs.model, speed=kcs.speed))[0] == "stable"


@pytest.mark.slow
def test_control_objects_carry_the_names() -> None:
    found = about("kvlcc2_l7")
    system = found.state_space()
    assert system.state_labels == ["u", "v_m", "r"]
    assert system.input_labels == ["n_P", "delta"]
    r, psi = found.transfer_function("r"), found.transfer_function("psi")
    assert r.dcgain() == pytest.approx(found.nomoto().K)
    assert sorted(psi.poles().real) == pytest.approx(sorted([*found.lateral().eigenvalues.real, 0.0]), abs=1e-12)
    with pytest.raises(ParameterError, match="no output"):
        found.transfer_function("heave")
    with pytest.raises(ParameterError, match="no order"):
        found.input("n_bow")


def test_without_python_control_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(ImportError, match=r"seatrial\[control\]"):
        about("zeefakkel").transfer_function()


@pytest.mark.slow
def test_sampled_model_gives_the_map_of_a_sample() -> None:
    ship = load("kvlcc2_l7_arx")
    found = straight(ship.model, ship.speed)
    assert found.dt == ship.model.dt
    numbers = dict(ship.model.coefficients.items())
    a = [1.0, *(-numbers.get(f"r_r_{k}", 0.0) for k in (1, 2, 3))]
    lively = found.lateral().eigenvalues
    assert sorted(np.abs(lively))[-2:] == pytest.approx(sorted(np.abs(np.roots(a[:3]))), rel=1e-9)
    gain = sum(numbers.get(f"r_delta_{k}", 0.0) for k in (1, 2, 3)) / sum(a)
    assert found.transfer_function("r").dcgain() == pytest.approx(gain)
    assert found.stability()[0] == "stable"
    with pytest.raises(ParameterError, match="sampled"):
        found.nomoto()


@pytest.mark.slow
def test_a_step_of_a_sampled_model_is_that_of_its_transfer_function() -> None:
    from control import step_response

    ship = replace(load("kvlcc2_l7_arx"), actuators=Actuators())
    trial = simulate(ship, Turning(n_P=11.85, delta=0.1), duration=60.0)
    found = straight(ship.model, ship.speed)
    for output in ("r", "psi"):
        answer = step_response(found.transfer_function(output), trial.t)
        np.testing.assert_allclose(0.1 * answer.y[0, 0], trial[output], atol=1e-11)


@pytest.mark.slow
def test_trim_finds_the_speed_of_given_revolutions_and_the_helm_of_a_wind() -> None:
    ship = load("esso_osaka_3m")
    at = trim(ship.model, orders={"n_P": 10.0})
    assert at.speed == pytest.approx(approach(ship, n_P=10.0)[0], rel=1e-10)
    beam = Uniform(U_T=3.0, gamma_T=math.pi / 2).now()
    held = trim(ship.model, speed=0.4, environment=beam)
    assert held.residual < 1e-9
    assert held.state[4] < 0  # pushed to port by wind from starboard
    assert held.orders["delta"] != 0.0
    assert held.state[5] == 0.0


@pytest.mark.slow
def test_the_equations_are_traced_once_for_all_first_guesses(monkeypatch: pytest.MonkeyPatch) -> None:
    model: Any = load("kvlcc2_l7").model
    kind, symbolic = type(model), []
    whole = kind.derivative

    def counted(self: Any, state: Any, control: Any, environment: Any) -> Any:
        symbolic.append(is_symbol(state[4]))
        return whole(self, state, control, environment)

    monkeypatch.setattr(kind, "derivative", counted)
    assert trim(model, speed=1.179).residual < 1e-10
    assert sum(symbolic) == 1


@pytest.mark.slow
def test_what_cannot_be_trimmed_is_said() -> None:
    model = load("kvlcc2_l7").model
    with pytest.raises(ParameterError, match="needs a speed"):
        trim(model)
    with pytest.raises(ParameterError, match="no order 'rudder'"):
        trim(model, speed=1.0, orders={"rudder": 0.1})
    with pytest.raises(ParameterError, match="no steady straight run"):
        trim(model, speed=1.0, orders={"n_P": 0.0, "delta": 0.0})
    with pytest.raises(ParameterError, match="give the speed"):
        trim(load("zeefakkel").model, orders={"n_P": 1.0})
    with pytest.raises(ParameterError, match="no state"):
        straight(model, 1.0, CALM).reduced(["heave"])
