"""ARX as a sampled model: names, lags, memory, the closed loop, current."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import ParameterError, Terms
from seatrial.environment import CALM, Environment, Uniform
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import Sampled
from seatrial.models.arx import Arx, coefficient, lag_of
from seatrial.ships import Ship, ShipError
from seatrial.ships.files import load, save
from seatrial.simulate.run import simulate


def arx(dt: float = 0.5, **numbers: float) -> Any:
    return Arx(dt=dt, coefficients=Terms(tuple(numbers), tuple(numbers.values())))


MODEL = arx(r_r_1=1.2, r_r_2=-0.3, r_delta_1=0.02, r_delta_3=0.01, r_constant=1e-4)


def test_names_say_what_they_multiply() -> None:
    assert tuple(lag_of("r_delta_2")) == ("r", "delta", 2)
    assert tuple(lag_of("v_m_v_m_10")) == ("v_m", "v_m", 10)
    assert tuple(lag_of("u_n_P_1")) == ("u", "n_P", 1)
    assert lag_of("u_constant").of == "constant"
    assert coefficient("r_delta_1").unit == "(rad/s)/(rad)"
    for wrong in ("r_delta_0", "delta_r_1", "r_r", "w_r_1", "r_psi_1", "r_1"):
        with pytest.raises(ParameterError, match="no coefficient"):
            arx(**{wrong: 1.0})


def test_it_is_sampled_and_remembers_what_its_lags_need() -> None:
    assert isinstance(MODEL, Sampled)
    assert MODEL.memory == ("r_back_1", "delta_back_1", "delta_back_2")
    assert MODEL.begin((0, 0, 0, 5.0, 0, 0.1), (2.0, 0.3)) == (0.0, 0.3, 0.3)


def test_it_is_the_difference_equation() -> None:
    rng = np.random.default_rng(1)
    delta = 0.2 * rng.standard_normal(30)
    state, memory = (0.0, 0.0, 0.0, 5.0, 0.0, 0.01), MODEL.begin((0.0, 0.0, 0.0, 5.0, 0.0, 0.01), (0.0, 0.05))
    r, d = [0.01, 0.01], [0.05, 0.05]
    for k in range(30):
        rates, memory = MODEL.advance(state, (0.0, delta[k]), CALM, memory)
        state = (0.0, 0.0, 0.0, *(a + 0.5 * b for a, b in zip(state[3:], rates, strict=True)))
        d.append(delta[k])
        r.append(1.2 * r[-1] - 0.3 * r[-2] + 0.02 * d[-1] + 0.01 * d[-3] + 1e-4)
        assert state[5] == pytest.approx(r[-1], abs=1e-14)
        assert state[3:5] == (5.0, 0.0)


def test_closed_loop_runs_at_its_own_step_only() -> None:
    ship = load("kvlcc2_l7_arx")
    zigzag = Zigzag(n_P=ship.n_P, delta=math.radians(10), psi=math.radians(10))
    trial = simulate(ship, zigzag, duration=120.0)
    assert trial.dt == pytest.approx(0.25)
    found = zigzag.indices(trial, ship.L_pp)
    mother = load("kvlcc2_l7")
    real = zigzag.indices(simulate(mother, zigzag, speed=ship.speed, duration=120.0), 7.0)
    for name, tolerance in (("first_overshoot", 0.1), ("period", 0.12)):
        assert found[name].value == pytest.approx(real[name].value, rel=tolerance)
    with pytest.raises(ShipError, match=r"0\.25 s"):
        simulate(ship, zigzag, duration=10.0, dt=0.1)


def test_a_current_only_drifts_it() -> None:
    ship = load("kvlcc2_l7_arx")
    zigzag = Zigzag(n_P=ship.n_P, delta=math.radians(10), psi=math.radians(10))
    still = simulate(ship, zigzag, duration=60.0)
    state = (0.0, 0.0, 0.0, ship.speed + 0.3, 0.2, 0.0)
    drift = simulate(ship, zigzag, duration=60.0, start=state,
                     environment=Uniform(U_C=math.hypot(0.3, 0.2), gamma_C=math.atan2(0.2, 0.3)))  # fmt: skip
    np.testing.assert_allclose(drift["r"], still["r"], atol=1e-13)
    c, s = np.cos(drift["psi"]), np.sin(drift["psi"])
    np.testing.assert_allclose(drift["u"] - (0.3 * c + 0.2 * s), still["u"], atol=1e-12)
    # Ground velocities run straight between samples, so the track is the drifted one to second order only.
    np.testing.assert_allclose(drift["x"] - 0.3 * drift.t, still["x"], atol=2e-3)


def test_vector_model_keeps_a_steady_run() -> None:
    ahead = arx(u_u_1=0.9, u_n_P_1=0.01, v_m_v_m_1=0.8, v_m_r_1=0.1, r_r_1=0.9, r_delta_1=0.02, r_v_m_2=-0.01)
    state = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    memory = ahead.begin(state, (10.0, 0.0))
    rates, after = ahead.advance(state, (10.0, 0.0), CALM, memory)
    assert rates == pytest.approx((0.0, 0.0, 0.0), abs=1e-15)
    assert after == memory
    turning = ahead.advance((0, 0, 0, 1.3, 0.1, 0.02), (10.0, 0.1), Environment(0, 0, 0.3, 0.1), (0.0,))
    plain = ahead.advance((0, 0, 0, 1.0, 0.0, 0.02), (10.0, 0.1), CALM, (0.0,))
    assert turning[0][2] == pytest.approx(plain[0][2], rel=1e-12)


def test_ship_file_round_trip(tmp_path: Any) -> None:
    ship = load("kvlcc2_l7_arx")
    again: Ship = load(save(ship, tmp_path / "again.toml"))
    assert again.model == ship.model
    assert again.model.dt == 0.25
    text = (tmp_path / "again.toml").read_text().replace("r_delta_3", "r_delta_x")
    (tmp_path / "bad.toml").write_text(text)
    with pytest.raises(ShipError, match="r_delta_x"):
        load(tmp_path / "bad.toml")
